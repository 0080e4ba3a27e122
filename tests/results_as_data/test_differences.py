"""Results compared with each other, and adjusted again from where they ended."""

from dataclasses import replace

import numpy as np
import pytest

from photogram import Camera, InputError, adjust, differences, read_result, simulate

BLOCK = simulate(strips=2, photos_per_strip=4, points_per_photo=25, control_spacing=2, seed=12).block


@pytest.fixture(scope="module")
def result():
    return adjust(BLOCK)


def test_a_result_does_not_differ_from_itself(result):
    found = differences(result, result)
    assert (found.values.size, found.deviations.size, found.variance, found.alone) == (0, 0, 1, {})
    assert found.compared == 6 * len(BLOCK.photo_ids) + 3 * int(result.used_points.sum())


def test_the_largest_difference_is_named_in_standard_deviations(result):
    positions = result.point_positions.copy()
    positions[3, 1] += 0.25 * result.point_sd[3, 1]
    positions[5, 0] -= 0.5 * result.point_sd[5, 0]
    attitudes = result.photo_attitudes + np.array([0, 0, 2 * np.pi])
    found = differences(result, replace(result, point_positions=positions, photo_attitudes=attitudes))
    assert found.values.size == pytest.approx(0.5)
    assert (found.values.kind, found.values.name, found.values.component) == (
        "point",
        BLOCK.point_ids[5],
        "X",
    )
    assert found.deviations.size == 0


def test_deviations_are_compared_as_parts(result):
    cofactors = result.photo_cofactors.copy()
    cofactors[2] *= 1.01**2
    found = differences(result, replace(result, photo_cofactors=cofactors))
    assert found.deviations.size == pytest.approx(0.01)
    assert (found.deviations.kind, found.deviations.name) == ("photo", BLOCK.photo_ids[2])
    assert "0.01 (" in str(found)


def test_what_is_in_one_only_is_named(result):
    out = BLOCK.image_points != 7
    fewer = adjust(
        BLOCK.replace(
            image_photos=BLOCK.image_photos[out],
            image_points=BLOCK.image_points[out],
            image_xy=BLOCK.image_xy[out],
            image_sd=BLOCK.image_sd[out],
        )
    )
    assert differences(result, fewer).alone == {"point": [BLOCK.point_ids[7]]}


def test_things_without_common_names_are_refused(result):
    renamed = replace(
        result,
        block=BLOCK.replace(
            photo_ids=[f"{name}a" for name in BLOCK.photo_ids],
            point_ids=[f"{name}a" for name in BLOCK.point_ids],
        ),
    )
    with pytest.raises(InputError, match="with the same names"):
        differences(result, renamed)


def test_a_restart_from_a_file_ends_where_it_began(tmp_path):
    lens = {"c": -152.74, "xp": 0.0, "yp": 0.0}
    block = simulate(
        strips=3,
        photos_per_strip=4,
        points_per_photo=30,
        relief=800.0,
        control_spacing=1,
        seed=3,
        cameras=[Camera("brown", lens)],
        start_cameras=[Camera("brown", lens | {"c": -152.0}, sd={"c": np.inf, "xp": 0.01})],
    ).block
    first = adjust(block)
    first.to_parquet(tmp_path)
    read = read_result(tmp_path)
    again = adjust(read.restarted())
    # Weighted parameters of the camera stay where they were given.
    assert again.cameras[0].given.deviations.tolist() == block.cameras[0].deviations.tolist()
    assert len(again.iterations) < len(first.iterations)
    found = differences(first, again)
    assert found.values.size < 1e-4
    assert found.deviations.size < 1e-6
