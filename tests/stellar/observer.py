"""What pyerfa's own observer is given."""

import erfa
import numpy as np

from photogram.stellar import ARCSEC


def places_of_j2000(stars):
    """Return the places of a catalogue of 1991.25 at J2000, as the functions of erfa take them."""
    return erfa.pmsafe(
        *stars.places.T,
        stars.proper_motions[:, 0] / np.cos(stars.places[:, 1]),
        stars.proper_motions[:, 1],
        stars.parallaxes / ARCSEC,
        0.0,
        *erfa.epj2jd(1991.25),
        2451545.0,
        0.0,
    )
