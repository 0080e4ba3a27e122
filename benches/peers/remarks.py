"""Why targets are missed and what was tried, by the names of the targets; printed for those that are."""

REASONS: dict[str, str] = {
    "strips from 1x1000 to 1x50000: exponent of time": (
        "The longest strip takes one iteration more than the shorter ones; the time of one iteration "
        "grows with a smaller exponent than the target."
    ),
    "200x250: formation and reduction, times its operations at a quarter of the product rate": (
        "The matrices of an image point (2 x 3 and 2 x 6) are too small for the rate of large "
        "products, and a large part of the time goes into the collinearity equations, which are not "
        "products at all. Tried, and kept: points on the same photographs eliminated side by side, "
        "sums of a pair of photographs held in registers, the common sizes compiled for themselves, "
        "points in the order of the ground, memory of fronts used again, 512-bit vectors. Not tried: "
        "several image points linearised in one vector."
    ),
}
