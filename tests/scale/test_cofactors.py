"""The selected inverse of a block of 5,000 photos is the inverse."""

import numpy as np
from unit_vectors import UnitVectors, project

from photogram import adjust, network, simulate

IMAGES = 67
"""Three blocks each: of the photo, of the point, of the adjusted image; 201 in all."""


def largest_difference(actual, expected):
    """Return the largest difference of two cofactor matrices in parts of the roots of the variances."""
    deviations = np.sqrt(np.diagonal(expected))
    return np.abs((actual - expected) / np.outer(deviations, deviations)).max()


def test_cofactors_are_those_of_unit_vectors() -> None:
    """Cofactors of photos, points and images of 50 strips of 100 photos agree with those of unit vectors.

    Those of images rest on the cofactors between photo and point, those of points on the cofactors between
    all photos that show them. To 1e-10 of the variances.
    """
    block = simulate(strips=50, photos_per_strip=100, seed=1).block
    # Cofactors hold before the last step, which is therefore made next to nothing.
    result = adjust(block, tolerance=1e-9)
    images = np.random.default_rng(7).choice(len(block.image_photos), IMAGES, replace=False)
    around = UnitVectors(result).around(images)
    for image, (of_photo, of_point, of_image) in zip(images, around, strict=True):
        photo, point = block.image_photos[image], block.image_points[image]
        assert largest_difference(result.photo_cofactors[photo], of_photo) < 1e-10
        assert largest_difference(result.point_cofactors[point], of_point) < 1e-10
        redundancy = 1 - np.diagonal(of_image)
        np.testing.assert_allclose(result.redundancy[image], redundancy, rtol=0, atol=1e-10)


def test_collinearity_equations_are_the_same() -> None:
    """The equations behind the unit vectors are the package's."""
    random = np.random.default_rng(3)
    points, positions = random.normal(0.0, 1e3, (2, 50, 3))
    positions[:, 2] += 4500.0
    attitudes = random.uniform(-0.3, 0.3, (50, 3))
    distances = np.full(50, -152.74)
    expected = network.project(points, positions, attitudes, distances)
    np.testing.assert_allclose(project(points, positions, attitudes, distances), expected, rtol=1e-12)
