"""Boards are found in photographs, to hundredths of a pixel; a folder of photographs is enough."""

import sys

import numpy as np
import pytest
from photographed_boards import (
    aprilgrid,
    charuco,
    chessboard,
    circles,
    corners_of,
    opencv,
    photographed,
    pose_of,
)
from typer.testing import CliRunner

from message_codes import described, refusal
from photogram import Camera
from photogram.cli.commands import application
from photogram.targets import Board, read
from photogram.targets.detection import detected
from photogram.words import phrase

SIZE = (640, 480)
TRUTH = {"fx": 620.0, "fy": 620.0, "cx": 321.3, "cy": 238.1, "k1": -0.12, "k2": 0.05, "p1": 0.0, "p2": 0.0}
CAMERA = Camera("opencv", TRUTH)
CHESSBOARD = Board(columns=9, rows=6, spacing=0.03, shape="held")
CHARUCO = Board(kind="charuco", columns=7, rows=5, spacing=0.04)
APRILGRID = Board(kind="aprilgrid", columns=6, rows=4, tag_size=0.05, tag_spacing=0.3)


def written(path, picture):
    """Write a picture."""
    assert opencv().imwrite(str(path), picture)
    return path


def taken(folder, board, pattern, *, facing=0.0, turn=10.0, name="one.png"):
    """Write a photograph of a board; return its file, and where its corners are."""
    pose = pose_of(board, CAMERA, (0.08, -0.05), (25.0 + facing, 5.0), turn, 0.75, SIZE)
    return written(folder / name, photographed(pattern, CAMERA, SIZE, pose)), corners_of(board, CAMERA, pose)


def rms(found, true):
    """Return the root of the mean square of what was found and is true, in pixels."""
    return np.sqrt(np.mean((found.xy - true[found.point]) ** 2))


@pytest.mark.parametrize(
    ("board", "drawn", "facing", "least"),
    [
        (CHARUCO, charuco, 0.0, 30),
        (CHARUCO, lambda board: charuco(board, legacy=True), 0.0, 28),
        (CHARUCO, lambda board: charuco(board, family="DICT_4X4_50", edge=0.6), 0.0, 30),
        (APRILGRID, aprilgrid, 180.0, 94),
        (APRILGRID, lambda board: aprilgrid(board, bits=1), 180.0, 90),
    ],
    ids=["charuco", "charuco as before 4.6", "small tags", "aprilgrid", "thin borders"],
)
def test_tags_say_which_corner_is_which(board, drawn, facing, least, tmp_path):
    file, true = taken(tmp_path, board, drawn(board), facing=facing)
    found = detected(file, [file], board)
    assert len(found.point) >= least
    assert len(set(found.point.tolist())) == len(found.point)
    assert rms(found, true) < 0.12


@pytest.mark.parametrize(
    ("board", "drawn", "limit"),
    [
        (CHESSBOARD, chessboard, 0.06),
        # The centre of an ellipse is not the image of the centre of the circle.
        (Board(kind="circles", columns=8, rows=6, spacing=0.03), circles, 0.2),
        (Board(kind="asymmetric_circles", columns=4, rows=11, spacing=0.02), circles, 0.2),
    ],
    ids=["chessboard", "circles", "asymmetric circles"],
)
def test_whole_boards_are_listed_row_by_row(board, drawn, limit, tmp_path):
    turn = 95.0 if board.kind == "asymmetric_circles" else 10.0
    pose = pose_of(board, CAMERA, (-0.02, 0.01), (12.0, -8.0), turn, 0.7, SIZE)
    file = written(tmp_path / "one.png", photographed(drawn(board), CAMERA, SIZE, pose))
    true = corners_of(board, CAMERA, pose)
    found = detected(file, [file], board)
    assert found.point.tolist() == list(range(len(board.places)))
    # A board that looks alike in half a turn may be listed from its other end.
    assert min(rms(found, true), rms(found, true[::-1])) < limit


def test_pictures_are_read_as_the_sensor_was(tmp_path):
    file, _ = taken(tmp_path, CHESSBOARD, chessboard(CHESSBOARD))
    from PIL import Image

    with Image.open(file) as picture:
        head = picture.getexif()
        head[0x0112] = 6  # to be turned by a quarter for the eye
        picture.save(tmp_path / "turned.png", exif=head)
    plain, turned = (detected(each, [each], CHESSBOARD) for each in (file, tmp_path / "turned.png"))
    assert turned.picture_sizes == [SIZE]
    np.testing.assert_array_equal(turned.xy, plain.xy)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder of ten photographs of a chessboard, one of them of something else."""
    folder = tmp_path_factory.mktemp("photographs")
    random, pattern = np.random.default_rng(5), chessboard(CHESSBOARD)
    for number in range(9):
        ray, tilt = random.uniform(-0.12, 0.12, 2), random.uniform(-30, 30, 2)
        pose = pose_of(CHESSBOARD, CAMERA, ray, tilt, random.uniform(-40, 40), random.uniform(0.5, 0.8), SIZE)
        picture = photographed(pattern, CAMERA, SIZE, pose, seed=number)
        written(folder / f"view{number}.png", picture)
    written(folder / "cat.png", random.integers(0, 255, SIZE[::-1]).astype(np.uint8))
    return folder


def test_a_folder_of_photographs_is_calibrated(folder):
    told = []
    found = read(folder, board=CHESSBOARD, model="opencv4", sd0=0.05, progress=told.append)
    assert told[0] == "looking for the board in cat.png, 1 of 10"
    assert "targets.without-board names=['cat.png']" in map(described, found.messages)
    assert found.corners.sizes == (SIZE,)
    calibrated = found.adjust()
    assert calibrated.variance_of_unit_weight < 1.5
    camera = calibrated.cameras[0]
    for name in ("fx", "fy", "cx", "cy", "k1", "k2"):
        assert abs(camera.value(name) - TRUTH[name]) < 4 * camera.deviation(name), name


def test_the_command_needs_photographs_and_a_board_alone(folder, tmp_path):
    runner, command = CliRunner(), application()
    refused = runner.invoke(command, ["calibrate", str(folder), "--quiet"])
    assert refused.exit_code == 1
    assert "board.toml" in refused.stderr
    out = tmp_path / "out"
    words = ["calibrate", str(folder), "--board", "9x6", "--spacing", "0.03", "--out", str(out)]
    done = runner.invoke(command, words)
    assert done.exit_code == 0
    assert str(phrase("targets.without-board", names=["cat.png"])) in " ".join(done.stderr.split())
    assert len((out / "views.csv").read_text().splitlines()) >= 10


def test_what_cannot_be_found_is_refused(folder, tmp_path):
    with refusal("targets.no-board-found board=chessboard, 8 x 6 points, spacing 0.03 m"):
        detected(folder, [folder / "view0.png"], CHESSBOARD.replace(columns=8))
    with refusal("targets.points-in-photos"):
        detected(folder, [folder / "view0.png"], Board(kind="points", points=np.eye(3)))
    (tmp_path / "one.jpg").write_bytes(b"no picture")
    with refusal("targets.no-picture"):
        detected(tmp_path, [tmp_path / "one.jpg"], CHESSBOARD)
    written(tmp_path / "view0.png", opencv().imread(str(folder / "view0.png")))
    (tmp_path / "one.jpg").unlink()
    large = opencv().resize(opencv().imread(str(folder / "view1.png")), (800, 600))
    written(tmp_path / "view1.png", large)
    with refusal("targets.sizes picture=view1.png width=800 height=600 wide=640 high=480"):
        read(tmp_path, board=CHESSBOARD)


def test_without_opencv_the_extra_is_named(tmp_path, monkeypatch):
    (tmp_path / "one.jpg").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "cv2", None)
    with refusal("error.package what=detection of boards package=OpenCV extra=targets"):
        detected(tmp_path, [tmp_path / "one.jpg"], CHESSBOARD)
