"""Why targets are missed and what was tried, by the names of the targets; printed for those that are."""

_SIZES = ("20x50", "50x100", "200x250")
_OUTSIDE = (
    "Ordering, screening, intersections of the points, arrays handed over and back, and memory that a "
    "process touches for the first time. Tried, and kept: all of it on all threads, arrays read in place, "
    "columns of results made by the threads. Tried, and not kept: huge pages (less than half as many page "
    "faults, and no less time); fewer rival orders, since which one is taken decides on the bits."
)
_LIMIT = (
    "Factor and inverse are at two thirds of the product rate where fronts are large, at a third where "
    "they are small; formation is at a twentieth (see below), and what is outside the numerical phases is "
    "no product at all."
)
_PEERS = (
    "Our numerical phases alone take about a tenth of gtsam's solution: all that is outside them would have "
    "to go. Tried, and not kept: chords in all blocks, a step with the factor before in the place of one "
    "formation and factorisation of four: a tenth less time for blocks of known cameras and of films, 3 to "
    "26 percent more for strips, free networks and unknown cameras, whose weak combinations fall by less "
    "than ten after it."
)

REASONS: dict[str, str] = {
    **{f"{size}: outside the numerical phases, share of the time": _OUTSIDE for size in _SIZES},
    **{f"{size}: everything, times its operations at the product rate": _LIMIT for size in _SIZES},
    **{
        f"{size}: everything / {peer}'s bare solution": _PEERS
        for size in _SIZES
        for peer in ("gtsam", "pycolmap")
    },
    "strips from 1x1000 to 1x50000: exponent of time": (
        "The longest strip takes one iteration more than the shorter ones; the time of one iteration "
        "grows with a smaller exponent than the target."
    ),
    "200x250: formation and reduction, times its operations at a quarter of the product rate": (
        "The matrices of an image point (2 x 3 and 2 x 6) are too small for the rate of large "
        "products, and a large part of the time goes into the collinearity equations, which are not "
        "products at all. Tried, and kept: points on the same photographs eliminated side by side, "
        "sums of a pair of photographs held in registers, the common sizes compiled for themselves, "
        "points in the order of the ground, memory of fronts used again, 512-bit vectors, several image "
        "points of one photograph linearised, and the matrices of several points factored, in one vector."
    ),
}
