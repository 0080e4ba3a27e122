"""Free networks: minimum and inner constraints, other datums without adjusting again, what is not free."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from example_scripts import load
from golden_data import golden
from golden_network import free_network
from message_codes import raises
from photogram import (
    AdjustmentError,
    AdjustOptions,
    Block,
    InnerConstraints,
    InputError,
    MinimumConstraints,
    Result,
    adjust,
    snoop,
)
from photogram.network.motion import kept_images

FINE = 1e-9


def block_of(name: str) -> Block:
    return free_network(bars=not name.startswith("no scale bar"))


def solution_of(name: str) -> dict[str, Any]:
    return golden("network", "free_network.json")["solutions"][name]


def datum_of(solution) -> InnerConstraints:
    names = solution["datum"]
    return InnerConstraints(
        points=[name for name in names if name.startswith("point")],
        photos=[name for name in names if name.startswith("photo")],
        scale=solution["with_scale"],
    )


def compare(result: Result, cofactors) -> None:
    """Compare cofactors of points and, by their steps, of photos with golden ones."""
    covariances, scale = result.covariances(), result.covariance_scale
    for name, expected in cofactors.items():
        if name == "held":
            continue
        a, *b = [("step" if part.startswith("photo") else "point", part) for part in name.split(" | ")]
        found = covariances.covariance(a, *b) / scale
        own = [np.diag(covariances.covariance(each)) / scale for each in (a, *(b or [a]))]
        tolerance = 1e-8 * np.sqrt(np.outer(*own))
        assert (np.abs(found - np.array(expected)) <= tolerance + 1e-20).all(), name


NAMES = (
    "all points",
    "points 5 to 16",
    "all points and photo positions",
    "no scale bar, all points, with scale",
    "no scale bar, points 5 to 16, with scale",
)


@pytest.mark.parametrize("name", NAMES)
def test_golden_networks_in_their_datums(name):
    expected = solution_of(name)
    block, datum = block_of(name), datum_of(expected)
    result = adjust(block, tolerance=FINE, datum=datum)
    minimum = adjust(block, tolerance=FINE)
    assert minimum.datum.kind == "minimum constraints"
    assert len(minimum.datum.held) == (7 if "no scale bar" in name else 6)
    other = InnerConstraints(points=[f"point{k}" for k in (20, 25, 30, 31)])
    for found in (result, minimum.in_datum(datum), minimum.in_datum(other).in_datum(datum)):
        assert found.degrees_of_freedom == expected["degrees_of_freedom"]
        assert found.variance_of_unit_weight == pytest.approx(expected["sigma0"] ** 2, rel=1e-10)
        for k, point in enumerate(block.point_ids):
            golden_point = expected["unknowns_solved"][point]
            difference = found.point_positions[k] - golden_point["value"]
            assert (np.abs(difference) < 1e-6 * np.array(golden_point["sd"])).all()
        compare(found, {**expected["cofactors"], **expected["cross_cofactors"]})
        # The observations know of no datum.
        np.testing.assert_allclose(found.redundancy, expected["kinds"]["image"]["redundancy"], atol=1e-8)
        np.testing.assert_allclose(found.residuals, minimum.residuals, atol=1e-9)
        assert found.datum.kind == "inner constraints"
        assert set(found.datum.points) == {name for name in expected["datum"] if name.startswith("point")}
        assert found.datum.lost < 1e-9


def test_what_is_held_may_be_chosen():
    expected = golden("network", "free_network.json")["solutions"]
    held = MinimumConstraints(photo="photo1", coordinate=("photo5", "X"))
    for bars, name, chosen in (
        (True, "all points", MinimumConstraints(photo="photo1")),
        (False, "no scale bar, all points, with scale", held),
    ):
        result = adjust(free_network(bars=bars), tolerance=FINE, datum=chosen)
        pose = [("photo1", unknown) for unknown in ("X", "Y", "Z", "omega", "phi", "kappa")]
        assert result.datum.held == (*pose, *([] if bars else [("photo5", "X")]))
        # Golden ones hold where the inner constraints have taken the network.
        moved = adjust(free_network(bars=bars), tolerance=FINE, datum=datum_of(expected[name]))
        again = adjust(
            moved.block.replace(
                photo_positions=moved.photo_positions,
                photo_attitudes=moved.photo_attitudes,
                point_positions=moved.point_positions,
            ),
            tolerance=FINE,
            datum=chosen,
        )
        compare(again, expected[name]["cofactors_minimum_constraints"])


def test_relative_to_a_photo_is_what_holding_it_gives():
    expected = golden("network", "free_network.json")["solutions"]["all points"]
    inner = adjust(free_network(bars=True), tolerance=FINE, datum=datum_of(expected))
    relative = inner.relative_to(photo="photo1")
    compare(relative, expected["cofactors_minimum_constraints"])
    np.testing.assert_array_equal(relative.photo_positions, inner.photo_positions)
    assert (relative.photo_sd[relative.block.photo_ids.index("photo1")] == 0).all()
    assert str(relative.datum) == "relative to photo1"
    points = [f"point{k}" for k in range(5, 17)]
    by_points = relative.in_datum(InnerConstraints(points=points)).relative_to(points=points)
    compare(by_points, golden("network", "free_network.json")["solutions"]["points 5 to 16"]["cofactors"])


def test_standard_deviations_say_what_they_refer_to():
    result = adjust(free_network(bars=False), datum=InnerConstraints(photos=None))
    assert str(result.datum) == "inner constraints over 40 points and 8 photos, scale included"
    sections = {section.key: section for section in result.document().sections}
    assert all(str(result.datum) in sections[key].intro for key in ("photos", "points"))
    document = json.loads(result.to_json())["datum"]
    assert document["kind"] == "inner constraints"
    assert document["scale"] is True
    assert len(document["points"]) == 40
    barred = adjust(free_network(bars=True), datum=InnerConstraints(photos=None))
    assert str(barred.datum) == "inner constraints over 40 points and 8 photos"
    assert json.loads(barred.to_json())["datum"]["scale"] is False
    assert result.point_table().attrs["datum"] == str(result.datum)
    assert any("inner constraints" in str(message) for message in result.messages)
    minimum = adjust(free_network(bars=False))
    again = minimum.in_datum(InnerConstraints(photos=None))
    assert [str(m) for m in again.messages] == [str(m) for m in result.messages]


def test_a_block_that_is_not_free_says_why(small_block):
    assert adjust(small_block).datum.kind == "observations"
    with pytest.raises(AdjustmentError, check=lambda error: error.code == "free.not-free"):
        adjust(small_block, datum=InnerConstraints())
    with pytest.raises(AdjustmentError, check=lambda error: error.code == "free.not-free"):
        adjust(small_block).in_datum(InnerConstraints())
    # Relative covariances it has all the same.
    relative = adjust(small_block).relative_to(photo=small_block.photo_ids[0])
    assert (relative.photo_sd[0] == 0).all()


def test_options_of_an_adjustment_are_one_object_or_keywords():
    block = free_network(bars=False)
    options = AdjustOptions(datum="inner", max_iterations=30)
    result = adjust(block, options)
    keywords = adjust(block, options=AdjustOptions(), datum=InnerConstraints(), max_iterations=30)
    assert result.datum.kind == keywords.datum.kind == "inner constraints"
    assert (result.point_positions == keywords.point_positions).all()
    with raises(InputError, "error.least"):
        adjust(block, options, max_iterations=0)
    with pytest.raises(TypeError, match="iterations"):
        adjust(block, iterations=3)


def test_datums_that_cannot_be_are_refused():
    block = free_network(bars=False)
    result = adjust(block)
    for points in (["point1", "point2"], []):
        with pytest.raises(InputError, check=lambda error: error.code == "free.few"):
            result.in_datum(InnerConstraints(points=points))
    with pytest.raises(InputError, check=lambda error: error.code == "free.few"):
        adjust(block, datum=InnerConstraints(points=["point1"]))
    with raises(InputError, "error.absent"):
        result.in_datum(InnerConstraints(points=["pointless"]))
    with raises(InputError, "error.unknown"):
        adjust(block, datum=MinimumConstraints(photo="photo1", coordinate=("photo2", "height")))
    with raises(InputError, "error.requires"):
        MinimumConstraints(coordinate=("photo2", "X"))
    with raises(InputError, "error.kind"):
        adjust(block, datum="somewhere")
    with pytest.raises(InputError, check=lambda error: error.code == "error.exclusive"):
        result.relative_to()
    with pytest.raises(InputError, check=lambda error: error.phrase.fields["message"].code == "error.kind"):
        result.in_datum(MinimumConstraints())  # type: ignore[arg-type]


def apart(*, joined: bool) -> Block:
    """Return the network twice, the second one beside the first, joined by distances or not."""
    from photogram import Distance

    block = free_network(bars=False)
    block = block.replace(point_positions=adjust(block, datum=InnerConstraints()).point_positions)
    shift = np.array([25.0, 3.0, 1.0])
    photos, points = len(block.photo_ids), len(block.point_ids)
    pairs = [(k, (3 * k + 5) % points) for k in range(0, 24, 2)]
    lengths = np.linalg.norm(
        [block.point_positions[b] + shift - block.point_positions[a] for a, b in pairs], axis=1
    )
    return block.replace(
        photo_ids=[*block.photo_ids, *(f"{name}'" for name in block.photo_ids)],
        photo_positions=np.vstack([block.photo_positions, block.photo_positions + shift]),
        photo_attitudes=np.vstack([block.photo_attitudes] * 2),
        principal_distances=np.tile(block.principal_distances, 2),
        point_ids=[*block.point_ids, *(f"{name}'" for name in block.point_ids)],
        point_positions=np.vstack([block.point_positions, block.point_positions + shift]),
        image_photos=np.concatenate([block.image_photos, block.image_photos + photos]),
        image_points=np.concatenate([block.image_points, block.image_points + points]),
        image_xy=np.vstack([block.image_xy] * 2),
        image_sd=np.vstack([block.image_sd] * 2),
        photo_position_sd=np.full((2 * photos, 3), np.inf),
        photo_attitude_sd=np.full((2 * photos, 3), np.inf),
        point_sd=np.full((2 * points, 3), np.inf),
        observations=[
            Distance(block.point_ids[a], f"{block.point_ids[b]}'", float(length), sd=1e-4)
            for (a, b), length in zip(pairs, lengths, strict=True)
        ]
        if joined
        else [],
    )


@pytest.mark.parametrize(
    "datum",
    [
        InnerConstraints(),
        InnerConstraints(points=["point4", "point5", "point6", "point7"], photos=None),
        MinimumConstraints(photo="photo3"),
    ],
)
@pytest.mark.parametrize("bars", [True, False])
def test_snooping_is_in_any_datum(datum, bars):
    """Tests do not depend on the datum; coordinates are those of an adjustment without the wrong image."""
    block = free_network(bars=bars)
    xy = block.image_xy.copy()
    xy[5] += 1.0
    found = snoop(block.replace(image_xy=xy), datum=datum)
    [name] = {entry.name for entry in found.removed}
    assert name == f"image of point {block.point_ids[block.image_points[5]]} on photo {block.photo_ids[0]}"
    expected = adjust(kept_images(block, np.arange(len(xy)) != 5), datum=datum)
    assert found.result.datum.kind == expected.datum.kind
    np.testing.assert_allclose(found.result.point_positions, expected.point_positions, atol=1e-9)
    np.testing.assert_allclose(found.result.point_sd, expected.point_sd, atol=1e-9)


def test_every_part_of_a_network_has_its_datum():
    one = adjust(free_network(bars=False), tolerance=FINE)
    block = apart(joined=False)
    both = adjust(block, tolerance=FINE)
    assert len(both.datum.held) == 14
    assert both.degrees_of_freedom == 2 * one.degrees_of_freedom
    half = len(one.redundancy)
    for part in (both.redundancy[:half], both.redundancy[half:]):
        np.testing.assert_allclose(part, one.redundancy, atol=1e-7)
    # In the datum of all points each part is as it would be alone; points of one leave the other as it is.
    inner = one.in_datum(InnerConstraints())
    together = both.in_datum(InnerConstraints())
    np.testing.assert_allclose(together.point_sd, np.vstack([inner.point_sd] * 2), rtol=1e-5)
    first = both.in_datum(InnerConstraints(points=one.block.point_ids))
    np.testing.assert_allclose(first.point_sd, np.vstack([inner.point_sd, both.point_sd[40:]]), rtol=1e-5)


def test_parts_that_distances_join_are_one():
    both = adjust(apart(joined=True), tolerance=FINE)
    assert both.converged
    assert len(both.datum.held) == 6
    freedom = 2 * len(both.residuals) + 12 - (6 * 16 + 3 * 80) + 6
    assert both.degrees_of_freedom == freedom
    assert np.nansum(both.redundancy) + sum(
        np.nansum(kind.redundancy) for kind in both.kinds.values()
    ) == pytest.approx(freedom, abs=1e-4)


def test_the_example_is_the_same_network_in_three_datums(capsys):
    minimum, inner, corners = load("free_network").main()
    assert "inner constraints over 25 points, scale included" in capsys.readouterr().out
    for result in (inner, corners):
        np.testing.assert_allclose(result.redundancy, minimum.redundancy, atol=1e-8)
    trace = [np.trace(result.point_cofactors.sum(axis=0)) for result in (minimum, inner, corners)]
    assert trace[1] == min(trace)


def test_the_figure_of_the_page_is_what_its_script_draws(monkeypatch):
    pytest.importorskip("matplotlib")
    docs = Path(__file__).parents[1] / "docs"
    monkeypatch.syspath_prepend(str(docs))
    import datum_figure

    drawn = datum_figure.svg(datum_figure.draw)
    assert (docs / "datum.svg").read_text(encoding="utf-8").count("<path") == drawn.count("<path")
