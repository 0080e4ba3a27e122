"""What blocks with photos on trajectories refuse, and what is asked of them."""

from dataclasses import replace

import numpy as np
import pytest

from message_codes import raises
from moving_blocks import rolling, scanned
from photogram import Camera, InputError, Position
from photogram.network import (
    Attitude,
    Clock,
    Polynomial,
    Range,
    Rate,
    Sensor,
    Smoothness,
    Table,
    Timed,
    Trajectory,
    Velocity,
)
from photogram.network.motion import (
    at_rest,
    flown_by,
    focal_images,
    of_photos,
    of_pictures,
    scanners,
    timed_photos,
)
from photogram.words import Phrase


def table():
    return Table([0.0, 1.0], np.zeros((2, 3)), [0.0, 1.0], [np.eye(3)] * 2)


def known(name="pass"):
    """Return a trajectory without coefficients."""
    return Trajectory(name, table())


RECORDS = {
    Position: {"position": [0.0, 0.0, 0.0]},
    Attitude: {"attitude": np.eye(3)},
    Velocity: {"velocity": [0.0, 0.0, 0.0]},
    Rate: {"rate": [0.0, 0.0, 0.0]},
    Range: {"point": "P", "length": 1.0},
}


def test_weights_of_samples_and_lines_are_refused():
    """They were taken for those of places before the lens, in mm."""
    block = scanned(photos=True)
    lens = Camera("brown", {"c": -60.0, "K1": 1e-6}, name="lens")
    measured = lens.replace(weights="measured", name="measured")
    with raises(InputError, "block.scanner-weights"):
        block.replace(cameras=[measured, lens])
    # Of a frame they are what they say.
    block.replace(cameras=[lens, measured])


@pytest.mark.parametrize("kind", RECORDS)
@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"trajectory": "strip"}, "error.kind"),
        ({"clock": "receiver"}, "error.kind"),
        ({"time": None}, "time of the"),
        ({"time": "noon"}, "time of the"),
        ({"time": np.nan}, "error.finite"),
        ({"photo": "A"}, "error.exclusive"),
        ({"photo": "A", "trajectory": None, "clock": Clock("receiver")}, "error.requires"),
        ({"trajectory": None}, "None"),
    ],
)
def test_records_of_nothing_are_refused(kind, changes, said):
    good = {"photo": None, "sd": 1.0, "trajectory": known(), "time": 0.5, **RECORDS[kind]}
    kind(**good)
    with raises(InputError, said):
        kind(**good | changes)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"coefficients": None}, "of one kind"),
        ({"coefficients": 3}, "of one kind"),
        ({"coefficients": ()}, "of one kind"),
        ({"factors": [1.0]}, "factors"),
        ({"factors": [np.nan, 1.0]}, "error.finite"),
        ({"observed_sum": np.inf}, "error.finite"),
    ],
)
def test_smoothness_of_nothing_is_refused(changes, said):
    own = Trajectory("pass", table(), position=Polynomial(1)).coefficients[0]
    good = {"coefficients": own, "factors": [1.0, -1.0], "sd": 1.0}
    Smoothness(**good)
    with raises(InputError, said):
        Smoothness(**good | changes)
    with pytest.raises(InputError, match="once"):
        Smoothness([own[0], own[0]], [1.0, -1.0], sd=1.0)


def test_two_trajectories_of_one_name():
    """Records of two known trajectories of one name, at one time, were taken for records of the first."""
    at = {"sd": 1.0, "time": 0.5}
    both = [Position(None, [0.0, 0.0, float(k)], trajectory=known(), **at) for k in range(2)]
    with raises(InputError, "block.repeated-object"):
        rolling().replace(observations=both)


def test_a_weighted_pose_on_a_shared_trajectory():
    block = scanned()
    with raises(InputError, "block.value.timed"):
        block.replace(photo_position_sd=[[np.inf] * 3, [0.1] * 3])
    with raises(InputError, "block.value.timed"):
        block.replace(photo_attitude_sd=0.0)
    rolling().replace(photo_position_sd=0.1)


def test_a_scanner_with_pixels():
    camera = Camera("pinhole", {"fx": 6000.0, "fy": 6000.0, "cx": 0.0, "cy": 0.0})
    with raises(InputError, "block.scanner-unit"):
        scanned().replace(cameras=[camera])


def test_what_is_on_trajectories():
    block = scanned(photos=True)
    assert flown_by(block) == Phrase("block.moving.photo", {"photo": "S1"})
    assert flown_by(block.replace(timed=())) == Phrase("block.moving.record", {"trajectory": "strip 1"})
    assert timed_photos(block).all()
    assert scanners(block).tolist() == [True, True, False, False, False]
    assert not timed_photos(at_rest(block)).any()
    plain = focal_images(block)
    of_lines = scanners(block)[block.image_photos]
    assert (plain[of_lines, 1] == 0).all()
    np.testing.assert_allclose(plain[of_lines, 0], (block.image_xy[of_lines, 0] - 3000) * 0.01)
    np.testing.assert_array_equal(plain[~of_lines], block.image_xy[~of_lines])
    assert len(of_pictures(block).image_xy) == (~of_lines).sum()
    assert of_pictures(rolling()).image_photos.size == rolling().image_photos.size


def test_what_is_at_rest():
    """Photos without a trajectory are left as they were, with what was observed of them."""
    block = rolling()
    own = [Timed(each.photo, shutter=each.shutter) for each in block.timed[:3]]
    mixed = block.replace(
        timed=own,
        observations=[
            Position("IMG_1", [0.0, 0.0, 0.0], sd=1.0),
            Position("IMG_8", [0.0, 0.0, 0.0], sd=1.0),
            Velocity(None, [0.0, 0.0, 0.0], sd=1.0, trajectory=known(), time=0.5),
        ],
    )
    left = at_rest(mixed)
    assert left.photo_ids == block.photo_ids[3:]
    assert [each.photo for each in left.observations] == ["IMG_8"]
    assert not flown_by(left)
    assert at_rest(left) is left


def test_some_of_the_photos():
    """Records and smoothness stay with the trajectories of photos that do."""
    block = scanned(photos=True, smooth=True)
    fewer = of_photos(block, np.array([True, False, True, True, True]))
    assert [each.photo for each in fewer.timed] == ["S1", "F0", "F1", "F2"]
    assert {each.moment.trajectory.name for each in fewer.observations if each.moment} == {"strip 1"}
    kinds = [each for each in block.observations if each.KIND == "position"]
    assert sum(each.KIND == "position" for each in fewer.observations) == len(kinds) / 2
    assert sum(each.KIND == "smoothness" for each in fewer.observations) == 6
    assert {each.name.split(" position")[0] for each in fewer.unknowns if "position" in each.name} == {
        "strip 1"
    }
    apart = Position(None, [0.0, 0.0, 0.0], sd=1.0, trajectory=known(), time=0.5)
    left = of_photos(block.replace(observations=[*block.observations, apart]), np.arange(5) == 1)
    assert {each.moment.trajectory.name for each in left.observations if each.moment} == {"strip 2", "pass"}


def test_the_motion_of_what_does_not_move():
    """The core named photo 0 of observation 0."""
    block = rolling()
    still = block.replace(timed=block.timed[1:])
    for kind in (Velocity, Rate):
        block.replace(observations=[kind("IMG_1", [0.0] * 3, sd=1.0)])
        with raises(InputError, "block.motion.at-rest"):
            still.replace(observations=[kind("IMG_1", [0.0] * 3, sd=1.0)])
        with raises(InputError, "error.absent"):
            still.replace(observations=[kind("NOBODY", [0.0] * 3, sd=1.0)])
    frames = scanned(photos=True)
    *others, last = frames.timed
    oblique = Timed(
        "F2", last.trajectory, last.time, sensor=Sensor("oblique", np.zeros(3), np.eye(3), sd=0.0)
    )
    with raises(InputError, "block.motion.sensor"):
        frames.replace(timed=[*others, oblique], observations=[Rate("F2", [0.0] * 3, sd=1.0)])


def test_a_scanner_has_no_one_pose():
    """It would have been that in the middle of its images, another without some of them."""
    block = scanned()
    first, second = block.timed
    own = Position("S1", [0.0, -60.0, 600.0], sd=1.0)
    with raises(InputError, "block.motion.scanner-time"):
        block.replace(observations=[*block.observations, own])
    dated = replace(first, time=104.0)
    block.replace(timed=[dated, second], observations=[*block.observations, own])
