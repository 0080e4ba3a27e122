"""Reasons for missed targets and attempts to reach them, by the names of the targets."""

_SIZES = ("20x50", "50x100", "200x250")
_OUTSIDE = (
    "This is the time for ordering, screening, intersections of the points, transfer of arrays, and memory "
    "that a process uses for the first time. Adopted: all of it on all threads, arrays read without copies, "
    "columns of results created by the threads. Rejected: huge pages (less than half as many page faults, "
    "and the same time). Fewer candidate orderings were also rejected, since the selected ordering "
    "determines the last bits."
)
_LIMIT = (
    "Factor and inverse reach two thirds of the product rate for large fronts, and a third for small ones. "
    "Formation reaches a twentieth (see below). The work outside the numerical phases consists of other "
    "operations than products."
)
_PEERS = (
    "The numerical phases alone need about a tenth of the time of gtsam's solution, so all other work would "
    "have to be eliminated. Rejected: chords in all blocks, which are steps with the previous factor "
    "instead of one formation and factorisation of four. Blocks of fixed cameras and of films need a tenth "
    "less time. Strips, free networks and unknown cameras need 3 to 26 percent more, because their weak "
    "combinations decrease by less than a factor of ten after it."
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
        "The longest strip needs one iteration more than the shorter ones. The time of one iteration "
        "grows with a smaller exponent than the target."
    ),
    "200x250: formation and reduction, times its operations at a quarter of the product rate": (
        "The matrices of an image point (2 x 3 and 2 x 6) are too small for the rate of large "
        "products. A large part of the time is spent on the collinearity equations, which contain few "
        "products. Adopted: joint elimination of points on the same photographs, sums of a pair of "
        "photographs in registers, separate code for the common sizes, points ordered by ground "
        "position, and reuse of the memory of fronts. 512-bit vectors contain several image points of one "
        "photograph (linearisation), or the matrices of several points (factorisation)."
    ),
}
