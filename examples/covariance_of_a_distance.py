"""How well are a distance, an angle and an area known? Functions of adjusted points and photos.

A simulated block with control in its corners. One object keeps the factor of the normal equations for all
questions.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from photogram import adjust, simulate
from photogram.results import Propagated

Floats = NDArray[np.float64]


def distance(p: Floats, q: Floats) -> Floats:
    """Return the distance of two points; without absolute values, so that it takes complex arrays, too."""
    return np.sqrt(((q - p) ** 2).sum())


def angle(p: Floats) -> Floats:
    """Return the horizontal angle at the first of three points, radians."""
    (x1, y1), (x2, y2) = (p[1] - p[0])[:2], (p[2] - p[0])[:2]
    return np.arctan2(x1 * y2 - y1 * x2, x1 * x2 + y1 * y2)


def area(p: Floats) -> Floats:
    """Return the area of the polygon of points in plan."""
    x, y = p[:, 0], p[:, 1]
    return 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()


def main() -> dict[str, Propagated]:
    """Adjust a block and print functions of it with their standard deviations."""
    block = simulate(strips=3, photos_per_strip=5, points_per_photo=30, control="corners", seed=2).block
    result = adjust(block)
    points = [name for name, used in zip(block.point_ids, result.used_points, strict=True) if used]
    a, b, c, d = points[5], points[25], points[45], points[60]

    covariances = result.covariances()
    found = {
        "distance": covariances.propagate(distance, [("point", a), ("point", b)]),
        "angle": covariances.propagate(angle, ("point", [a, b, c]), bias=True),
        "area": covariances.propagate(area, ("point", [a, b, c, d])),
        "base": covariances.propagate(
            lambda one, other: distance(one[:3], other[:3]),
            [("photo", block.photo_ids[0]), ("photo", block.photo_ids[1])],
        ),
    }
    for name, each in found.items():
        print(f"{name:<10}{each.value:>16.5f}  +- {each.standard_deviation:.5f}")
    joint = covariances.covariance(("point", None))
    print(f"joint covariance matrix of {len(joint) // 3} points: {joint.shape[0]} x {joint.shape[1]}")
    # Two points on the same photos are known better towards each other than each by itself.
    sd = np.sqrt(np.diag(covariances.covariance(("point", a))))
    print(f"a point by itself: {sd[0]:.3f} {sd[1]:.3f} {sd[2]:.3f} m")
    return found


if __name__ == "__main__":
    main()
