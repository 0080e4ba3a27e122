"""What first values set aside, judged again by the adjusted block: what returns, is named, is kept."""

import re

import networks
import numpy as np
import pytest

from golden_data import shared
from message_codes import has_code
from photogram import adjust, adjust_started, first_values, formats
from photogram.results.result import NOT_PHOTOGRAPHED, REJECTED


def printed(kind, count):
    """Return figures of the reference program's report, behind the word `kind`, as text."""
    text = shared("camcal", "expected_report.txt").read_text()
    found = re.findall(rf"{kind}: +(\S+) ?(?:mm\S*|deg|ou)? *$", text, re.MULTILINE)
    assert len(found) >= count
    return found


@pytest.fixture(scope="module")
def calibrated():
    block = formats.read(shared("camcal", "camcaldemo.xml")).block
    return adjust_started(first_values(block), unit_variance="free")


def test_a_start_without_a_lens_costs_no_image(calibrated):
    assert calibrated.set_aside == ()
    assert f"{calibrated.variance_of_unit_weight**0.5:.4f}" == "1.6148"
    assert calibrated.degrees_of_freedom == 3725
    assert int(calibrated.used_images.sum()) == 2074
    returned = calibrated.messages[0]
    assert (returned.code, returned.phrase.fields) == ("first.returned.images", {"n": 2, "all": 2})


def test_the_calibration_has_the_published_digits(calibrated):
    (camera,) = calibrated.cameras
    names = ("c", "xp", "yp", "K1", "K2", "K3", "P1", "P2", "b1")
    sd = [camera.sd[camera.names.index(name)] for name in names]
    published = printed("Deviation", 135)
    assert [float(f"{own:.3g}") for own in sd] == [float(each) for each in published[:9]]
    poses = np.column_stack([np.degrees(calibrated.photo_sd[:, 3:]), calibrated.photo_sd[:, :3]])
    assert [float(f"{own:.3g}") for own in poses.ravel()] == [float(each) for each in published[9:135]]
    known = [float(each) for each in printed("Value", 10)]
    np.testing.assert_allclose([-camera.values[0], *camera.values[3:8]], [known[0], *known[5:10]], rtol=3e-6)


def test_its_control_is_held_at_what_the_images_contradict(calibrated):
    """The sheet is not flat: a corner that is let go is 2.6 mm, 40 standard deviations, off."""
    assert (calibrated.verdict.code, calibrated.verdict.exit) == ("gross-errors", 4)
    headline = calibrated.verdict.headline
    said = re.search(r"1\) control point 1004 \(fixed\) \(T = (\d+)\)", headline)
    assert has_code(calibrated.verdict.message, "part.fixed.control")
    block = calibrated.block
    row = block.point_ids.index("1004")
    sd = block.point_sd.copy()
    sd[row] = np.inf
    free = adjust(block.replace(point_sd=sd), unit_variance="unity")
    apart, cofactors = free.point_positions[row] - block.point_positions[row], free.point_cofactors[row]
    assert 0.0025 < -apart[2] < 0.0027
    assert -apart[2] > 35 * cofactors[2, 2] ** 0.5
    assert float(said[1]) == pytest.approx(apart @ np.linalg.solve(cofactors, apart), rel=0.01)


def started(wrong, *, seed=3):
    """Return first values of strips over points of control, without lens, with images wrong by 30 sd."""
    positions, angles, points = networks.strips(seed)
    block, _, _ = networks.network(positions, angles, points, seed=7, control=range(0, 400, 4))
    xy = block.image_xy.copy()
    xy[wrong] += 30 * block.image_sd[wrong]
    return block.replace(image_xy=xy)


def test_images_that_stay_out_head_the_verdict():
    block = started([5, 70])
    result = adjust_started(first_values(block))
    names = [
        f"image of point {block.point_ids[block.image_points[row]]} on photo"
        f" {block.photo_ids[block.image_photos[row]]}"
        for row in (5, 70)
    ]
    assert sorted(map(str, result.set_aside)) == sorted(names)
    assert result.verdict.code == "set-aside"
    assert result.verdict.warning
    assert all(name in result.verdict.headline for name in names)
    assert (result.verdict.exit_code(), result.verdict.exit_code(strict=True)) == (0, 4)


def without_images(block):
    """Return a block with a further pass point that no photo shows."""
    return block.replace(
        point_ids=[*block.point_ids, "UNSEEN"],
        point_positions=np.vstack([block.point_positions, [[1.0, 2.0, 3.0]]]),
        point_sd=np.vstack([block.point_sd, [[0.1, 0.1, 0.1]]]),
    )


def test_rejected_points_differ_from_points_that_were_never_photographed():
    block = without_images(started([]))
    tie_points = np.flatnonzero(~np.isfinite(block.point_sd).any(axis=1))
    point = next(row for row in tie_points.tolist() if (block.image_points == row).sum() == 3)
    rows, xy = np.flatnonzero(block.image_points == point), block.image_xy.copy()
    xy[rows] += 1000 * block.image_sd[rows] * [[1, 1], [-1, 1], [1, -1]]
    result = adjust_started(first_values(block.replace(image_xy=xy)))
    reasons = {block.point_ids[point]: REJECTED, "UNSEEN": NOT_PHOTOGRAPHED}
    assert {name: reason for name, reason in result.dropped.items() if name in reasons} == reasons
    (said,) = [str(each) for each in result.messages if "not photographed" in str(each)]
    assert block.point_ids[point] not in said.split(": ")[-1].split(", ")


def test_all_may_be_kept():
    found = first_values(started([5, 70]), keep_all=True)
    assert not found.set_aside.any()
    assert found.messages[-1].code == "first.images.kept"
    result = adjust_started(found)
    assert result.set_aside == ()
    assert result.verdict.code == "gross-errors"


def test_too_many_are_no_result():
    rows = np.arange(0, 1800, 12)
    result = adjust_started(first_values(started(rows)))
    assert result.verdict.code == "too-much-set-aside"
    assert result.verdict.exit == 4


@pytest.mark.parametrize(("options", "said"), [([], "are rejected"), (["--keep-all"], "are used")])
def test_the_command_takes_all_that_fits_in(run, tmp_path, options, said):
    path = str(shared("camcal", "camcaldemo.xml"))
    done = run("adjust", path, "--out", str(tmp_path / "out"), "--no-html", *options)
    assert f"2 images do not fit and {said}" in done.output
    assert done.exit_code == 4
    report = (tmp_path / "out" / "report.txt").read_text().splitlines()
    assert any(line.split() == ["image", "points", "2074", "used", "of", "2074"] for line in report)
