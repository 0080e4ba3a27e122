"""Checks, hints and first values of blocks with photos on trajectories: nothing is tried on what moves."""

from dataclasses import replace

import numpy as np
import pytest

from message_codes import coded, has_code, raises
from moving_blocks import rolling, scanned
from photogram import (
    AdjustmentError,
    Block,
    InputError,
    adjust,
    adjust_started,
    diagnose,
    first_values,
    simulate,
)
from photogram.diagnosis.after_adjustment import errors_explained
from photogram.diagnosis.conventions import hints
from photogram.network import Lines, LineSensor, OnPlane, Plane, Polynomial, Table, Timed, Trajectory
from photogram.network.rays import image_directions, seen_without_lenses
from photogram.results.fixed_tests import held_tested
from photogram.words import Phrase


def test_the_check_proposes_nothing_for_what_moves():
    """It said that the principal distance of a scanner had the wrong sign, and that photos were turned."""
    for block in (rolling(), scanned(), scanned(photos=True)):
        found = diagnose(block)
        assert not found.grave, found.grave
        assert found.result is not None
        assert "is on a trajectory" in found.report()


def test_the_check_finds_gross_errors():
    found = diagnose(rolling(gross=True))
    assert len(found.grave) == 1
    assert found.grave[0].phrase.code == "check.blunder.image"
    assert has_code(found.grave[0], "named.image", point="P0", photo="IMG_1")
    assert found.grave[0].phrase.fields["component"] == "x"
    assert 10 < abs(found.grave[0].phrase.fields["error"]) < 20
    block = scanned()
    row = next(k for k, each in enumerate(block.observations) if each.KIND == "velocity")
    wrong = replace(block.observations[row], velocity=[0.0, 0.0, 5.0])
    observations = [*block.observations[:row], wrong, *block.observations[row + 1 :]]
    found = diagnose(block.replace(observations=observations))
    assert [str(each.phrase.fields["named"]) for each in found.grave] == [wrong.name]


def test_the_check_of_what_cannot_be_adjusted():
    block = rolling()
    free = [replace(each, sd_velocity=np.inf, sd_rate=np.inf) for each in block.timed]
    found = diagnose(block.replace(timed=free))
    assert found.grave[0].kind == "no-adjustment"
    assert found.result is None


def test_hints_are_of_photos_at_rest():
    """Of a block all of whose photos move there are none, whatever is wrong with it."""
    assert hints(rolling()) == []
    assert hints(scanned(photos=True)) == []
    metres = simulate(strips=2, photos_per_strip=5, control_spacing=1).block
    feet = metres.replace(photo_positions=metres.photo_positions * [1, 1, 1 / 0.3048])
    plain = [str(each) for each in hints(feet)]
    assert plain
    assert [str(each) for each in hints(with_a_scanner(feet))] == plain


def test_an_adjustment_that_fails_has_the_right_hint():
    block = scanned(photos=True)
    upside = block.replace(cameras=[block.cameras[0].replace(parameters={"c": 60.0})])
    with pytest.raises(AdjustmentError, match="must intersect") as told, errors_explained(upside):
        adjust(upside)
    hint = "probably the principal distance has the wrong sign"
    assert str(told.value).count("hint: ") == str(told.value).count(f"hint: {hint}") == 1


def with_a_scanner(block: Block) -> Block:
    """Return a block with one photo more, a strip of a scanner that sees some points nowhere near them."""
    middle = np.nanmean(block.photo_positions, axis=0)
    table = Table([0.0, 100.0], [middle, middle + np.array([50.0, 0.0, 0.0])], [0.0, 100.0], [np.eye(3)] * 2)
    course = Trajectory("pass", table, position=Polynomial(1, sd=1.0), rotation=Polynomial(0, sd=1e-3))
    seen = np.arange(12)
    own = Timed("S", course, lines=Lines([[0, 0.0, 0.01]]), line_sensor=LineSensor((0.01, 0.0), 500.0))
    add = {
        "photo_positions": middle,
        "photo_attitudes": np.zeros(3),
        "photo_position_sd": np.full(3, np.inf),
        "photo_attitude_sd": np.full(3, np.inf),
    }
    rows = {name: np.vstack([getattr(block, name), value]) for name, value in add.items()}
    random = np.random.default_rng(3)
    return block.replace(
        photo_ids=[*block.photo_ids, "S"],
        principal_distances=np.append(block.principal_distances, -152.0),
        image_photos=np.append(block.image_photos, np.full(12, len(block.photo_ids))),
        image_points=np.append(block.image_points, seen),
        image_xy=np.vstack([block.image_xy, random.uniform(0, 1000, (12, 2))]),
        image_sd=np.vstack([block.image_sd, np.full((12, 2), 0.01)]),
        timed=[own],
        **rows,
    )


def test_first_values_leave_alone_what_moves():
    """Samples and lines were taken for millimetres, and photos for pictures at the place of a trajectory."""
    block = simulate(strips=2, photos_per_strip=4, control_spacing=1).block
    unknown = block.replace(
        photo_positions=np.nan, photo_attitudes=np.nan, photo_position_sd=np.inf, photo_attitude_sd=np.inf
    )
    moved = with_a_scanner(block).replace(
        photo_positions=np.vstack([np.full((8, 3), np.nan), np.zeros(3)]),
        photo_attitudes=np.vstack([np.full((8, 3), np.nan), np.zeros(3)]),
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
    )
    found, plain = first_values(moved), first_values(unknown)
    assert found.sources == {**plain.sources, "S": "given"}
    np.testing.assert_array_equal(found.block.photo_positions[:8], plain.block.photo_positions)
    assert (found.block.photo_positions[8] == 0).all()
    assert not found.set_aside[-12:].any()
    assert [each.photo for each in found.usable().timed] == ["S"]
    assert any(has_code(each, "first.moving", n=1) for each in found.messages)
    all_given = first_values(scanned())
    assert set(all_given.sources.values()) == {"given"}
    assert not all_given.missing


def test_first_values_without_a_datum():
    block = simulate(strips=1, photos_per_strip=4).block.replace(point_sd=np.inf)
    moved = with_a_scanner(block).replace(
        photo_positions=np.vstack([np.full((4, 3), np.nan), np.zeros(3)]),
        photo_attitudes=np.vstack([np.full((4, 3), np.nan), np.zeros(3)]),
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
    )
    with raises(AdjustmentError, "first.no-datum-of-photos"):
        first_values(moved)


def test_photos_that_move_from_an_unknown_pose():
    with pytest.raises(InputError, check=coded("block.moving-pose-unknown", photo="IMG_1")):
        rolling().replace(photo_positions=np.nan)
    block = rolling()
    found = first_values(
        block.replace(timed=(), photo_positions=np.nan, photo_attitudes=np.nan), keep_all=True
    )
    again = adjust_started(replace(found, block=found.block.replace(timed=block.timed)))
    assert again.converged
    assert again.sums_of_squares.total == pytest.approx(adjust(block).sums_of_squares.total, rel=1e-4)


def test_rays_are_of_pictures():
    """A scanner has directions in its axes, and no place among pictures with one pose."""
    block = scanned(photos=True)
    directions = image_directions(block)
    assert np.abs(directions[:84, 1]).max() < 1e-12
    assert np.abs(directions[:84, 0]).max() < 0.5
    plain, seen = seen_without_lenses(block)
    assert seen.sum() == len(plain.image_xy) == 126
    assert not seen[:84].any()
    assert not plain.timed
    drone, all_seen = seen_without_lenses(rolling())
    assert all_seen.all()
    assert not drone.timed


def test_what_is_held_is_tested_where_it_can_be():
    """Fixed control that scanners alone see is not tested by a pose that they have not."""
    block = scanned()
    held = np.isfinite(block.point_sd).all(axis=1)
    wrong = block.point_positions.copy()
    wrong[np.flatnonzero(held)[0], 2] += 3.0
    fixed = block.replace(
        point_sd=np.where(held[:, np.newaxis], 0.0, np.inf) * np.ones(3), point_positions=wrong
    )
    assert held_tested(adjust(fixed)) == []
    drone = rolling()
    held = np.isfinite(drone.point_sd).all(axis=1)
    sd = np.where(held[:, np.newaxis], 0.0, np.inf) * np.ones(3)
    wrong = drone.point_positions.copy()
    row = np.flatnonzero(held)[5]
    wrong[row, 2] += 1.5
    result = adjust(drone.replace(point_sd=sd, point_positions=wrong))
    found = held_tested(result)[0]
    place = found.largest()
    assert str(found.name(place)) == str(
        Phrase("named.held", {"named": Phrase("named.control", {"point": drone.point_ids[row]})})
    )
    # Rows of pixels count downwards, those of a camera without lens upwards: T was 846 in place of 10,224.
    sd[row] = np.inf
    without = adjust(drone.replace(point_sd=sd, point_positions=wrong))
    fall = result.sums_of_squares.total - without.sums_of_squares.total
    assert found.values[place] == pytest.approx(fall, rel=0.02)


def test_planes_start_from_pictures():
    """An open plane through points that scanners alone see says what it lacks."""
    block = scanned()
    plane = Plane("roof")
    names = [name for name, sd in zip(block.point_ids, block.point_sd, strict=True) if np.isinf(sd).all()][:5]
    on = [OnPlane(name, plane, sd=0.1) for name in names]
    with pytest.raises(InputError, check=coded("first.unknown.points", n=0, least=3)):
        adjust(block.replace(observations=[*block.observations, *on]))
