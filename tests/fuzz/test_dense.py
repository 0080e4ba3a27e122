"""Random blocks, from sound to extreme, against a dense solution; and that the dense solution sees errors."""

from dataclasses import replace

import numpy as np
import pytest

from fuzz.dense import ENDINGS, KINDS, REPORTED, TOLERANCE, _compared, compare, random_block
from photogram import adjust, network, simulate

BLOCKS = 100


@pytest.mark.filterwarnings("ignore:overflow")
def test_random_blocks_agree_with_a_dense_solution_or_are_refused():
    found = [(number, *random_block(1, number)) for number in range(BLOCKS)]
    ends = []
    for number, kind, block in found:
        result = compare(block)
        ends.append((kind, result.ending))
        assert result.ending != "differ", (number, kind, result)
    assert {kind for kind, _ in ends} == set(KINDS)
    assert {ending for _, ending in ends} <= set(ENDINGS)
    for kind in ("as flown", "free, weighted and fixed mixed"):
        assert ends.count((kind, "agree")) == BLOCKS / len(KINDS)


@pytest.mark.parametrize(("number", "remark"), [(37, "adjust.rounding"), (939, "adjust.weak")])
def test_what_differs_says_so(number, remark):
    _, block = random_block(12, number)
    result = adjust(block, threads=1, max_iterations=300, tolerance=TOLERANCE)
    assert _compared(block, result).ending == REPORTED
    assert any(message.code.startswith(remark) for message in result.messages)


@pytest.mark.parametrize("what", ["unknowns", "cofactors", "redundancy"])
def test_a_wrong_result_is_seen(what):
    block = simulate(strips=1, photos_per_strip=3, points_per_photo=8, control_spacing=1, seed=1).block
    result = adjust(block, threads=1, tolerance=1e-9)
    assert _compared(block, result).ending == "agree"
    changes = {
        "unknowns": {"point_positions": result.point_positions + 0.01 * result.point_sd},
        "cofactors": {"photo_cofactors": result.photo_cofactors * 1.0001},
        "redundancy": {"redundancy": result.redundancy + 1e-4},
    }
    assert _compared(block, replace(result, **changes[what])).ending == "differ"


@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_the_dense_equations_project_as_the_geometry_does(photo_to_ground):
    block = simulate(
        strips=1, photos_per_strip=3, points_per_photo=8, photo_to_ground=photo_to_ground, tilt=0.09, seed=2
    ).block
    from fuzz.dense import _Place

    place = _Place(block, adjust(block, threads=1))
    values = place.unknowns[place.columns()]
    expected = network.project(
        values[:, 6:],
        values[:, :3],
        values[:, 3:6],
        block.principal_distances[block.image_photos[place.images]],
        photo_to_ground=photo_to_ground,
    )
    assert place.project(values.astype(complex)).real == pytest.approx(expected, rel=1e-12)
    assert not np.iscomplexobj(expected)
