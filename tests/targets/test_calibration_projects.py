"""Calibrations as plain projects: written, read, adjusted again."""

import numpy as np
import pytest
from given_targets import left_table, rig_small

from golden_data import shared
from message_codes import described, refusal, refused
from photogram import InputError, formats
from photogram.formats.targets import adjusted_project, calibration_of, project_of
from photogram.targets import read


def again(project, folder):
    for name, content in formats.to_files(project, "plain").items():
        (folder / name).write_bytes(content)
    return formats.read(folder)


def test_a_rig_is_the_same_after_a_plain_project(tmp_path):
    given = rig_small()
    found = calibration_of(again(project_of(given), tmp_path))
    assert (found.sd0, found.sync) == (0.3, "known")
    assert np.array_equal(found.references, given.references)
    assert np.abs(found.sensors - given.sensors).max() < 1e-12
    assert np.abs(found.poses - given.poses).max() < 1e-9
    assert np.abs(found.corners.xy - given.corners.xy).max() < 1e-9
    assert np.allclose(found.corners.sd, given.corners.sd)
    assert np.array_equal(found.corners.views, given.corners.views)
    first, second = given.adjust(), found.adjust()
    assert second.sums_of_squares.total == pytest.approx(first.sums_of_squares.total, rel=1e-10)
    names, expected = first.cofactors()
    assert second.cofactors()[0] == names
    scale = np.sqrt(np.diag(expected))
    assert np.abs((second.cofactors()[1] - expected) / np.outer(scale, scale)).max() < 1e-6


def test_frames_without_a_picture_of_their_reference_come_back(tmp_path):
    given = rig_small()
    keep = ~((given.corners.cameras == 0) & (given.corners.views < 5))
    part = given.replace(corners=given.corners.of_pictures(keep))
    found = calibration_of(again(project_of(part), tmp_path))
    assert found.adjust().sums_of_squares.total == pytest.approx(
        part.adjust().sums_of_squares.total, rel=1e-10
    )


def test_a_board_that_bends_goes_on_bending(tmp_path):
    adjusted = rig_small("bend").adjust()
    found = calibration_of(again(adjusted_project(adjusted), tmp_path))
    assert found.bend == pytest.approx(adjusted.bend.position[:2].tolist(), rel=1e-12)
    restarted = found.adjust()
    assert len(restarted.iterations) <= 2
    assert restarted.sums_of_squares.total == pytest.approx(adjusted.sums_of_squares.total, rel=1e-10)


def test_levels_stand_for_standard_deviations_that_nobody_knows(tmp_path):
    given = rig_small().replace(sd0=None)
    project = project_of(given)
    found = again(project, tmp_path)
    header = (tmp_path / "images.csv").read_text().split("\n")[0]
    assert header == "photo,point,column,row,level"
    assert "read.levels" in {each.code for each in found.lacks}
    calibration = calibration_of(found)
    assert calibration.sd0 is None
    assert np.array_equal(calibration.corners.sd, given.corners.sd)


def test_an_adjusted_calibration_begins_where_it_has_ended(tmp_path):
    adjusted = read(left_table(tmp_path)).adjust()
    (tmp_path / "after").mkdir()
    found = calibration_of(again(adjusted_project(adjusted), tmp_path / "after"))
    assert found.board.shape == "held"
    assert found.board.unit == "mm"
    restarted = found.adjust()
    assert len(restarted.iterations) <= 2
    camera = adjusted.cameras[0]
    moved = np.abs(restarted.cameras[0].values - camera.values)[camera.estimated]
    assert (moved < 1e-5 * camera.sd[camera.estimated]).all()


@pytest.mark.parametrize("sd0", [None, 0.3])
def test_corners_that_are_left_out_stay_and_are_marked(tmp_path, sd0):
    given = rig_small().replace(sd0=sd0)
    use = given.corners.use.copy()
    use[[3, 700]] = False
    corners = given.corners.replace(use=use)
    found = again(project_of(given.replace(corners=corners)), tmp_path)
    assert "plain.unused-images" in [each.code for each in found.messages]
    *_, first, second = (tmp_path / "images.csv").read_text().splitlines()
    assert first.endswith(",off")
    assert second.endswith(",off")
    calibration = calibration_of(found)
    left = np.flatnonzero(~calibration.corners.use)
    assert len(left) == 2
    for row, old in zip(left.tolist(), [3, 700], strict=True):
        own = calibration.corners
        assert own.title(row) == corners.title(old)
        assert own.xy[row] == pytest.approx(corners.xy[old], abs=1e-9)
        assert own.sd[row] == pytest.approx(corners.sd[old], rel=1e-12)
    # Written once more, by `convert` or after an adjustment, they are still there.
    (tmp_path / "more").mkdir()
    assert calibration_of(again(project_of(calibration), tmp_path / "more")).corners == calibration.corners


def test_corners_that_snooping_takes_out_are_marked(tmp_path):
    given = rig_small()
    xy = given.corners.xy.copy()
    xy[5] += 20.0
    snooped = given.replace(corners=given.corners.replace(xy=xy)).snoop().result
    found = calibration_of(again(adjusted_project(snooped), tmp_path))
    left = np.flatnonzero(~found.corners.use).tolist()
    assert given.corners.title(5) in [found.corners.title(row) for row in left]
    assert len(left) == np.count_nonzero(~snooped.calibration.corners.use)


def test_a_calibration_of_mrcal_is_the_same_after_a_plain_project(tmp_path):
    """With the priors of its lens, which have no other place, and its three outliers."""
    given = read(shared("targets", "opencv8-0.cameramodel"))
    assert "targets.unused n=3" in map(described, given.messages)
    adjusted = given.adjust()
    found = calibration_of(again(adjusted_project(adjusted), tmp_path))
    assert found.regularise == "mrcal"
    assert np.count_nonzero(~found.corners.use) == 3
    restarted = found.adjust()
    assert restarted.sums_of_squares.total == pytest.approx(adjusted.sums_of_squares.total, rel=1e-10)
    boards = tmp_path / "boards.csv"
    boards.write_text(boards.read_text().replace(",mrcal,", ",other,"))
    with pytest.raises(InputError, match="column regularise: must be one of mrcal, got 'other'"):
        formats.read(tmp_path)


@pytest.mark.parametrize(
    ("table", "before", "after", "said"),
    [
        ("boards.csv", "chessboard", "ring", "error.column column=kind message=error.choice"),
        ("boards.csv", "board,kind", "board,sort", "kind"),
        ("boards.csv", ",9,7,", ",9,1,", "rows: error.least low=2 value=1"),
        ("boards.csv", ",9,7,", ",9,6,", "board-project.points"),
        ("control.csv", "\n1,0.04,", "\n1,0.05,", "board-project.position point=1"),
    ],
)
def test_boards_that_are_wrong(tmp_path, table, before, after, said):
    for name, content in formats.to_files(project_of(rig_small()), "plain").items():
        (tmp_path / name).write_bytes(content)
    path = tmp_path / table
    assert before in path.read_text()
    path.write_text(path.read_text().replace(before, after, 1))
    with refused(said):
        calibration_of(formats.read(tmp_path))


def test_a_project_without_a_board_is_no_calibration():
    project = project_of(rig_small())
    with refused("board-project.none"):
        calibration_of(project.replace(boards={}))


def test_what_is_known_of_sensors_and_of_the_bend_stays_known(tmp_path):
    sd = np.array([np.full(6, np.inf), [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3]])
    given = rig_small("bend").replace(sd_sensors=sd, sd_bend=[1e-4, np.inf])
    found = calibration_of(again(project_of(given), tmp_path))
    assert found.sd_sensors == pytest.approx(sd, rel=1e-12)
    assert found.sd_bend == pytest.approx([1e-4, np.inf])
    with refusal("targets.free-sd name=sd_sensors"):
        given.replace(sd_sensors=0.0)


def test_what_is_known_of_a_bend_together_is_read_and_written(tmp_path):
    project = project_of(rig_small("bend"))
    files = formats.to_files(project, "plain")
    rows = ["kind,name,first,second,covariance", "bend,board,x,x,1e-06", "bend,board,y,x,2e-07"]
    files["covariances.csv"] = "\n".join([*rows, "bend,board,y,y,4e-06"]).encode()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    found = formats.read(tmp_path)
    (prior,) = found.block.observations
    assert np.array_equal(prior.covariance, [[1e-6, 2e-7], [2e-7, 4e-6]])
    (figure,) = found.block.passages
    assert prior.unknown is figure.bend
    assert again(found, tmp_path).block.observations[0].covariance == pytest.approx(prior.covariance)
    # A calibration has no place for it, and does not leave it out silently.
    with refused("board-project.observations names=['prior board']"):
        calibration_of(found)
