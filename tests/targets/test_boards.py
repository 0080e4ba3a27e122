"""Boards: their points, their files, what is refused."""

import numpy as np
import pytest

from message_codes import refusal
from photogram.targets import Board
from photogram.targets.board import is_board, read_board


def test_points_of_a_chessboard_run_along_x_first():
    board = Board(columns=3, rows=2, spacing=(0.1, 0.2))
    assert board.names == ["0", "1", "2", "3", "4", "5"]
    assert board.places[4].tolist() == [0.1, 0.2, 0.0]


def test_corners_of_an_aprilgrid_are_those_of_kalibr():
    board = Board(kind="aprilgrid", columns=6, rows=5, tag_size=0.088, tag_spacing=0.3)
    places = board.places.reshape(10, 12, 3)
    pitch = 0.088 * 1.3
    assert places[3, 5] == pytest.approx([2 * pitch + 0.088, pitch + 0.088, 0.0])
    assert board.grid == (12, 10)


def test_rows_of_asymmetric_circles_are_shifted():
    places = Board(kind="asymmetric_circles", columns=4, rows=11, spacing=0.02).places
    assert places[4:6] == pytest.approx(np.array([[0.02, 0.02, 0.0], [0.06, 0.02, 0.0]]))


def test_a_bend_is_zero_at_the_corners_and_largest_amid_the_sides():
    board = Board(columns=5, rows=3, spacing=0.1, shape="bend")
    z = board.bent(1e-3, -2e-3)[:, 2].reshape(3, 5)
    assert z[[0, 0, 2, 2], [0, 4, 0, 4]] == pytest.approx(0.0)
    assert z[0, 2] == pytest.approx(1e-3)
    assert z[1, 0] == pytest.approx(-2e-3)
    assert z[1, 2] == pytest.approx(-1e-3)


def test_the_shape_goes_by_the_views():
    board = Board(columns=9, rows=7, spacing=0.04)
    assert (board.shape_of(7), board.shape_of(8)) == ("held", "points")
    assert not board.deviations(7).any()
    assert board.deviations(8)[0] == pytest.approx([0.04 / 500, 0.04 / 500, 0.04 / 200])
    assert board.replace(shape="bend").shape_of(20) == "bend"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"columns": 9, "rows": 7}, "error.at what=spacing message=error.empty"),
        (
            {"columns": 1, "rows": 7, "spacing": 1.0},
            "error.at what=columns message=error.least low=2 value=1",
        ),
        (
            {"columns": 9, "rows": 7, "spacing": -1.0},
            "error.range low=9.999999999999999e-51 high=1e+50 value=-1.0",
        ),
        (
            {"kind": "ring", "columns": 9, "rows": 7, "spacing": 1.0},
            "ring",
        ),
        (
            {"columns": 9, "rows": 7, "spacing": 1.0, "tag_size": 1.0},
            "error.not-applicable name=tag_size other=targets.kind kind=chessboard",
        ),
        (
            {"kind": "aprilgrid", "columns": 6, "rows": 6, "tag_size": 0.1},
            "error.at what=tag_spacing message=error.empty",
        ),
        ({"kind": "points"}, "error.at what=points message=error.empty"),
        ({"kind": "points", "points": np.zeros((9, 3)), "shape": "bend"}, "targets.bend"),
        ({"kind": "points", "points": np.zeros((2, 3)), "point_names": ["a", "a"]}, "targets.names count=2"),
        (
            {"columns": 9, "rows": 7, "spacing": 1.0, "shape": "round"},
            "round",
        ),
    ],
)
def test_what_is_no_board_is_refused(given, said):
    with refusal(said):
        Board(**given)


def test_board_toml(tmp_path):
    (tmp_path / "targets.csv").write_text("point,x,y,z,sd\nA,0,0,0,0.001\nB,1,0,0.5,0.002\n")
    path = tmp_path / "board.toml"
    path.write_text('kind = "points"\npoints = "targets.csv"\nunit = "ft"\n')
    board = read_board(path)
    assert (board.names, board.unit) == (["A", "B"], "ft")
    assert board.deviations(20)[1].tolist() == [0.002] * 3
    path.write_text("columns = 9\nrows = 6\nspacing_x = 0.1\nspacing_y = 0.2\nsd_plane = 0.001\n")
    board = read_board(path)
    assert (board.kind, board.spacing, board.sd_plane) == ("chessboard", (0.1, 0.2), 0.001)


@pytest.mark.parametrize(
    ("text", "record", "said"),
    [
        ("columns = 9\nrow = 6\n", 2, "error.unknown.close kind=key name=row close=rows"),
        (
            "columns = 9.5\nrows = 6\nspacing = 1\n",
            1,
            "error.at what=columns message=error.whole-range value=9.5",
        ),
        (
            "columns = 9\nrows = 6\nspacing = 'wide'\n",
            3,
            "error.at what=spacing message=error.number value=wide",
        ),
        ("columns = 9\nrows = 6\nspacing = 1\nspacing_x = 1\n", 4, "targets.spacings"),
        ("kind = 'points'\npoints = 'none.csv'\n", 2, "targets.no-table name=none.csv"),
        ("columns = 9\nrows = 6\n", None, "error.at what=spacing message=error.empty"),
        ("columns = \n", 1, "TOML"),
    ],
)
def test_board_toml_that_is_wrong(tmp_path, text, record, said):
    path = tmp_path / "board.toml"
    path.write_text(text)
    with refusal(said) as found:
        read_board(path)
    assert (found.value.file, found.value.record) == (path, record)


@pytest.mark.parametrize(
    ("text", "kind", "grid"),
    [
        (
            "target_type: 'aprilgrid' #gridtype\ntagCols: 6 #number\ntagRows: 5\ntagSize: 0.088\n"
            "tagSpacing: 0.3\n",
            "aprilgrid",
            (12, 10),
        ),
        (
            "target_type: 'checkerboard'\ntargetCols: 7\ntargetRows: 6\nrowSpacingMeters: 0.06\n"
            "colSpacingMeters: 0.05\n",
            "chessboard",
            (7, 6),
        ),
        (
            "target_type: 'circlegrid'\ntargetCols: 4\ntargetRows: 11\nspacingMeters: 0.02\n"
            "asymmetricGrid: True\n",
            "asymmetric_circles",
            (4, 11),
        ),
    ],
)
def test_targets_of_kalibr(tmp_path, text, kind, grid):
    path = tmp_path / "target.yaml"
    path.write_text(text)
    assert is_board(path)
    board = read_board(path)
    assert (board.kind, board.grid) == (kind, grid)
    if kind == "chessboard":
        assert board.spacing == (0.05, 0.06)


def test_a_target_that_kalibr_does_not_have(tmp_path):
    path = tmp_path / "target.yaml"
    path.write_text("target_type: 'ring'\n")
    with refusal("error.choice value=ring names=['aprilgrid', 'checkerboard',"):
        read_board(path)
