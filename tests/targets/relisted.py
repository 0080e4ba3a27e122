"""Corners as a detector would list them that begins elsewhere."""

import numpy as np

from photogram.targets.sightings import Listings


def relisted(board, corners, orders):
    """Return corners with pictures listed in other orders: numbers of pictures to numbers of orders."""
    points, point = Listings.of(board).points, corners.point.copy()
    for picture, order in orders.items():
        own = corners.picture == picture
        point[own] = np.argsort(points[order])[corners.point[own]]
    return corners.replace(point=point)
