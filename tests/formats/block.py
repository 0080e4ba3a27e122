"""The small block of tests/data/formats in every format, and the truth behind it."""

from __future__ import annotations

from functools import cache

import numpy as np

from golden_data import DATA, golden
from photogram import Attitudes, adjust

FORMATS = DATA / "formats"


def sample(*names):
    """Return a path of the samples."""
    return FORMATS.joinpath(*names)


@cache
def truth(*names):
    return golden("formats", *(names or ("truth.json",)))


def plain_name(name):
    """Return a name as formats without blanks have it."""
    return name.replace(" ", "_")


def check_poses(block, photos, tolerance=1e-10, attitude=1e-12):
    """Compare positions and attitudes of photos with the truth."""
    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).values("matrix_to_photo")
    known = {plain_name(name): own for name, own in photos.items()}
    assert {plain_name(name) for name in block.photo_ids} == set(known)
    for row, name in enumerate(block.photo_ids):
        own = known[plain_name(name)]
        np.testing.assert_allclose(block.photo_positions[row], own["centre"], rtol=0, atol=tolerance)
        np.testing.assert_allclose(matrices[row], own["rotation"], rtol=0, atol=attitude)


def with_noise(project, point_names=None):
    """Return the block of a project whose exact observations in pixels got the errors of the truth."""
    block = project.block
    names = point_names or {}
    noise = {(plain_name(each["photo"]), each["point"]): each["noise"] for each in truth()["observations"]}
    rows = [
        noise[plain_name(block.photo_ids[photo]), names.get(block.point_ids[point], block.point_ids[point])]
        for photo, point in zip(block.image_photos, block.image_points, strict=True)
    ]
    return block.replace(image_xy=block.image_xy + np.array(rows), image_sd=0.3)


def names_by_position(project):
    """Return the true names of points that a format calls otherwise."""
    known = truth()["points"]
    names = list(known)
    places = np.array([known[name]["position"] for name in names])
    return {
        point: names[int(np.argmin(np.linalg.norm(places - start, axis=1)))]
        for point, start in zip(project.block.point_ids, project.positions(), strict=True)
    }


def with_control(block, names=None):
    """Return a block with the true control of the expected adjustment, and nothing else beside images."""
    own = names or {}
    known = truth()["points"]
    positions = np.full((len(block.point_ids), 3), np.nan)
    sd = np.full((len(block.point_ids), 3), np.inf)
    for row, point in enumerate(block.point_ids):
        each = known[own.get(point, point)]
        if each["role"] == "control":
            positions[row], sd[row] = each["position"], (0.02, 0.02, 0.03)
    return block.replace(point_positions=positions, point_sd=sd, observations=(), mounts=())


def check_adjustment(block, names=None):
    """Compare the adjustment of a noisy block with the dense one."""
    expected = truth("expected_adjustment.json")
    result = adjust(block, unit_variance="free", tolerance=1e-9)
    assert result.converged
    np.testing.assert_allclose(result.sums_of_squares.total, expected["weighted_sum_of_squares"], rtol=1e-9)
    assert result.degrees_of_freedom == expected["degrees_of_freedom"]
    photos = {plain_name(name): own for name, own in expected["photos"].items()}
    # Those of the dense adjustment are for a priori unit weight.
    sd = np.sqrt(np.einsum("nii->ni", result.photo_cofactors))
    for row, name in enumerate(block.photo_ids):
        own = photos[plain_name(name)]
        np.testing.assert_allclose(result.photo_positions[row], own["centre"], rtol=0, atol=1e-8)
        np.testing.assert_allclose(sd[row, :3], own["sd_centre"], rtol=1e-7)
        np.testing.assert_allclose(np.degrees(sd[row, 3:]), own["sd_angles_deg"], rtol=1e-7)
    for row, name in enumerate(block.point_ids):
        own = expected["points"][(names or {}).get(name, name)]
        np.testing.assert_allclose(result.point_positions[row], own["position"], rtol=0, atol=1e-8)


def same_blocks(one, other, tolerance=1e-9):
    """Compare two blocks whose photos and points bear the same names, in any order."""
    photos = [other.photo_ids.index(name) for name in one.photo_ids]
    assert len(one.photo_ids) == len(other.photo_ids)
    np.testing.assert_allclose(other.photo_positions[photos], one.photo_positions, rtol=1e-13, atol=tolerance)
    mine = [Attitudes.of("omega_phi_kappa", each.photo_attitudes).matrices for each in (one, other)]
    np.testing.assert_allclose(mine[1][photos], mine[0], rtol=0, atol=1e-13)
    found = [
        {
            (block.photo_ids[photo], block.point_ids[point]): xy
            for photo, point, xy in zip(
                block.image_photos, block.image_points, block.image_xy.tolist(), strict=True
            )
        }
        for block in (one, other)
    ]
    assert found[0].keys() == found[1].keys()
    keys = list(found[0])
    np.testing.assert_allclose(
        [found[1][key] for key in keys], [found[0][key] for key in keys], rtol=0, atol=tolerance
    )
