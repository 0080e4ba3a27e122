"""Corners in files of all formats: what is read, how images are grouped, what is refused by name."""

import json

import numpy as np
import pytest
from given_targets import rig_small
from seen_boards import seen

from golden_data import shared
from message_codes import described, refusal
from photogram import Camera, InputError
from photogram.targets import Board, CalibrationOptions, read
from photogram.targets.corner_files import holds_targets, read_table, read_vnl, sorted_files
from photogram.targets.corners import grouped
from photogram.targets.mrcal import read_model
from photogram.targets.opencv_corners import read_npz, read_storage
from photogram.targets.reading import _measured

SMALL = Board(columns=3, rows=2, spacing=0.1)
XY = np.array([[10.5, 20.25], [30.0, 21.0], [50.0, 22.0], [11.0, 40.0], [31.0, 41.0], [51.0, 42.0]])


MODEL = "opencv8-0.cameramodel"


def rows(*images, form="{image},{k},{x},{y}"):
    return [
        form.format(image=image, k=k, x=x, y=y) for image in images for k, (x, y) in enumerate(XY.tolist())
    ]


def written(path, *lines):
    path.write_text("\n".join(lines) + "\n")
    return path


def test_text_of_mrcal(tmp_path):
    lines = rows("a.jpg", "c.jpg", form="{image} {x} {y} 0")
    lines[1] = "a.jpg 30.0 21.0 2"
    lines[2] = "a.jpg - - -"
    lines[3] = "a.jpg 11.0 40.0 -"
    lines[4] = "a.jpg 31.0 41.0 -1"
    path = written(tmp_path / "c.vnl", "# filename x y level", *lines[:6], "b.jpg - - -", *lines[6:])
    found = read_vnl(path, SMALL)
    assert found.images == ["a.jpg", "b.jpg", "c.jpg"]
    assert found.point.tolist() == [0, 1, 3, 4, 5, 0, 1, 2, 3, 4, 5]
    assert found.sd[:2].tolist() == [1.0, 4.0]
    assert found.use.tolist() == [True, True, False, False, *[True] * 7]
    corners, _ = grouped(found, CalibrationOptions(size=(640, 480)))
    assert corners.pictures == ("a.jpg", "c.jpg")


def test_weights_in_the_text_of_mrcal(tmp_path):
    lines = rows("a.jpg", form="{image} {x} {y} 0.5")
    found = read_vnl(written(tmp_path / "c.vnl", "# filename x y weight", *lines), SMALL)
    assert found.sd.tolist() == [2.0] * 6


def test_text_of_mrcal_needs_all_rows_of_an_image(tmp_path):
    path = written(tmp_path / "c.vnl", "# filename x y level", *rows("a.jpg", form="{image} {x} {y} 0")[:5])
    with refusal("targets.rows-of-image rows=5 points=6") as found:
        read_vnl(path, SMALL)
    assert found.value.record == 2


def test_table_with_columns_and_rows_of_the_board(tmp_path):
    lines = [f"a,{k % 3},{k // 3},{x},{y}" for k, (x, y) in enumerate(XY.tolist())]
    found = read_table(written(tmp_path / "c.csv", "image,i,j,u,v", *lines), SMALL)
    assert found.point.tolist() == [*range(6)]
    with refusal("error.column column=i message=error.whole-range low=0 high=2 value=3.0"):
        read_table(written(tmp_path / "d.csv", "image,i,j,u,v", "a,3,0,1,2"), SMALL)


def test_table_of_tags(tmp_path):
    board = Board(kind="aprilgrid", columns=2, rows=2, tag_size=0.1, tag_spacing=0.5)
    lines = [f"a,3,{k},{k},{k}" for k in range(4)]
    found = read_table(written(tmp_path / "c.csv", "image,tag,corner,x,y", *lines), board)
    # Tag 3 has column 1 and row 1: lower left, lower right, upper right, upper left.
    assert found.point.tolist() == [10, 11, 15, 14]


def test_table_with_levels_cameras_views_and_times(tmp_path):
    path = written(
        tmp_path / "c.csv",
        "image;point;x;y;camera;view;time;level",
        "l1;0;1,5;2;left;7;0,1;1",
        "r1;0;1,5;2;right;7;0,1;0",
    )
    found = read_table(path, SMALL)
    assert (found.cameras, found.views) == (["left", "right"], ["7", "7"])
    assert found.sd.tolist() == [2.0, 1.0]
    corners, _ = grouped(found, CalibrationOptions())
    assert corners.camera_names == ("left", "right")
    assert corners.views.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("lines", "record", "said"),
    [
        (["image,point,x,y", "a,6,1,2"], 2, "error.column column=point message=targets.no-point point=6"),
        (["image,point,x,y", "a,0,1,"], 2, "y"),
        (["image,point,x,y", "a,0,1,wide"], 2, "error.number value=wide"),
        (["image,point,x,y,sd", "a,0,1,2,0"], 2, "error.column column=sd message=error.positive value=0.0"),
        (["image,point,y", "a,0,1"], 1, "x"),
        (
            ["image,tag,corner,x,y", "a,0,0,1,2"],
            1,
            "targets.tags board=chessboard, 3 x 2 points, spacing 0.1 m",
        ),
        (
            ["image,point,x,y,view", "a,0,1,2,1", "a,1,1,2,2"],
            3,
            "error.column column=view message=targets.other-view",
        ),
    ],
)
def test_tables_that_are_wrong(tmp_path, lines, record, said):
    path = written(tmp_path / "c.csv", *lines)
    with refusal(said) as found:
        read_table(path, SMALL)
    assert (found.value.file, found.value.record) == (path, record)


def test_corners_that_a_table_calls_off_do_not_count(tmp_path):
    lines = [
        f"a,{k},{x},{y},{'off' if k == 4 else 'on' if k else ''}" for k, (x, y) in enumerate(XY.tolist())
    ]
    found = read_table(written(tmp_path / "c.csv", "image,point,x,y,use", *lines), SMALL)
    assert np.flatnonzero(~found.use).tolist() == [4]
    with pytest.raises(InputError, match="column use: must be true or false, got 'maybe'"):
        read_table(written(tmp_path / "d.csv", "image,point,x,y,use", "a,0,1,2,maybe"), SMALL)


def test_cameras_by_the_names_of_their_images(tmp_path):
    lines = rows("left07.jpg", "right07.jpg", "left02.jpg", "other.jpg")
    found = read_table(written(tmp_path / "c.csv", "image,point,x,y", *lines), SMALL)
    corners, told = grouped(found, CalibrationOptions(cameras=("left*.jpg", "right*.jpg")))
    assert corners.camera_names == ("left", "right")
    assert dict(zip(corners.pictures, corners.views.tolist(), strict=True)) == {
        "left07.jpg": 0,
        "right07.jpg": 0,
        "left02.jpg": 1,
    }
    assert "other.jpg" in str(told[0])
    with refusal("targets.two-cameras image=left07.jpg"):
        grouped(found, CalibrationOptions(cameras=("left*.jpg", "*07.jpg")))
    apart, _ = grouped(found, CalibrationOptions(cameras=("left*.jpg", "right*.jpg"), sync="none"))
    assert apart.views.tolist() == [0, 1, 2]
    corner, _ = grouped(found, CalibrationOptions(pixel_origin="corner"))
    assert corner.xy[0].tolist() == [10.0, 19.75]


def test_views_by_time_in_files_of_kalibr(tmp_path):
    begin = 1_403_715_000_000_000_000
    for camera, shift in (("cam0", 0), ("cam1", 2_000_000)):
        lines = [
            f"{begin + view * 50_000_000 + shift} {k} {x} {y}"
            for view in range(3)
            for k, (x, y) in enumerate(XY.tolist())
        ]
        written(tmp_path / f"{camera}.txt", *lines)
    _, _, corners = sorted_files(tmp_path)
    found = _measured(tmp_path, corners, SMALL)
    by_time, _ = grouped(found, CalibrationOptions(views="time", within=0.005))
    assert by_time.camera_names == ("cam0", "cam1")
    assert by_time.views.tolist() == [0, 1, 2, 0, 1, 2]
    by_name, _ = grouped(found, CalibrationOptions())
    assert by_name.views.tolist() == [0, 1, 2, 3, 4, 5]
    assert by_time.times[3] - by_time.times[0] == pytest.approx(0.002, abs=1e-6)


def storage(kind):
    data = np.stack([XY, XY + 1]).ravel().tolist()
    numbers = ", ".join(map(repr, data))
    if kind == "yml":
        return (
            "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nboard_width: 3\nboard_height: 2\n"
            'square_size: 0.1\nimage_points: !!opencv-matrix\n   rows: 2\n   cols: 6\n   dt: "2f"\n'
            f"   data: [ {numbers} ]\n"
        )
    if kind == "xml":
        return (
            '<?xml version="1.0"?>\n<opencv_storage><image_width>640</image_width>'
            "<image_height>480</image_height>"
            "<board_width>3</board_width><board_height>2</board_height><square_size>0.1</square_size>"
            '<image_points type_id="opencv-matrix"><rows>2</rows><cols>6</cols><dt>"2f"</dt>'
            f"<data>{numbers.replace(',', ' ')}</data></image_points></opencv_storage>\n"
        )
    matrix = {"type_id": "opencv-matrix", "rows": 2, "cols": 6, "dt": "2f", "data": data}
    return json.dumps(
        {"image_width": 640, "image_height": 480, "board_width": 3, "board_height": 2, "square_size": 0.1}
        | {"image_points": matrix}
    )


@pytest.mark.parametrize("kind", ["yml", "xml", "json"])
def test_storage_of_opencv(tmp_path, kind):
    path = tmp_path / f"calibration.{kind}"
    path.write_text(storage(kind))
    found = read_storage(path, None)
    assert found.board == SMALL
    assert found.sizes == {"": (640, 480)}
    assert found.xy[6:] == pytest.approx(XY + 1)
    with refusal("targets.corner-count points=6 count=20 board=chessboard, 5 x 4 points,"):
        read_storage(path, Board(columns=5, rows=4, spacing=0.1))
    path.write_text(storage(kind).replace("2f", "2i"))
    with refusal("targets.matrix what=floating-point numbers"):
        read_storage(path, None)


def test_arrays_of_opencv(tmp_path):
    path = tmp_path / "corners.npz"
    objpoints = np.tile(SMALL.places, (2, 1, 1))
    np.savez(
        path, objpoints=objpoints, imgpoints=np.stack([XY, XY + 1])[:, :, np.newaxis], image_size=(640, 480)
    )
    found = read_npz(path, None)
    assert found.board == SMALL
    assert found.xy[6:] == pytest.approx(XY + 1)
    np.savez(path, objpoints=objpoints + np.array([0, 0, 0.01]), imgpoints=np.stack([XY, XY + 1]))
    assert read_npz(path, None).board == SMALL
    objpoints[1, 2, 0] += 0.01
    np.savez(path, objpoints=objpoints, imgpoints=np.stack([XY, XY + 1]))
    with refusal("targets.no-grid"):
        read_npz(path, None)


@pytest.mark.parametrize("unit", [None, "mm"])
def test_metres_are_assumed_only_without_a_unit(tmp_path, unit):
    board = Board(columns=9, rows=7, spacing=30.0)
    parameters = {"fx": 900.0, "fy": 900.0, "cx": 511.5, "cy": 383.5} | dict.fromkeys(
        ("k1", "k2", "p1", "p2"), 0.0
    )
    corners, _ = seen(board, Camera("opencv", parameters), (1024, 768), views=6, seed=3, least=63)
    np.savez(
        tmp_path / "corners.npz",
        objpoints=np.tile(board.places, (6, 1, 1)),
        imgpoints=corners.xy.reshape(6, 63, 2),
        image_size=(1024, 768),
    )
    calibration = read(tmp_path / "corners.npz", unit=unit)
    assert calibration.board.unit == (unit or "m")
    assert any("are assumed" in str(each) for each in calibration.messages) is (unit is None)


def test_arrays_of_python_objects_are_not_unpickled(tmp_path):
    path = tmp_path / "corners.npz"
    ragged = np.array([XY, XY[:3]], dtype=object)
    np.savez(path, imgpoints=ragged, objpoints=ragged)
    with refusal("targets.array-damaged name=imgpoints reason=Object arrays cannot be loaded"):
        read_npz(path, None)
    path.write_bytes(b"PK\x03\x04 no archive")
    with refusal("error.parse format=as an archive of arrays (npz) reason=File is not a zip file"):
        read_npz(path, None)


def test_content_of_a_model_of_mrcal():
    found = read_model(shared("targets", MODEL))
    corners = found.corners
    assert (corners.view_count, len(corners.xy), np.count_nonzero(~corners.use)) == (186, 18_600, 3)
    sd, counts = np.unique(corners.sd[corners.use], return_counts=True)
    assert dict(zip(sd.tolist(), counts.tolist(), strict=True)) == {1: 15_740, 2: 2_788, 4: 64, 8: 5}
    assert corners.sizes == ((6016, 4016),)
    assert (found.board.spacing, found.board.shape, found.regularise) == ((0.077, 0.077), "bend", "mrcal")
    assert found.cameras[0].model == "opencv_pinhole"
    assert np.count_nonzero(found.cameras[0].deviations) == 12


def test_the_table_has_the_corners_of_the_model():
    found = read_model(shared("targets", MODEL)).corners
    table = read_vnl(shared("targets", "mrcal_corners.vnl"), Board(columns=10, rows=10, spacing=0.077))
    assert table.images[:2] == ["view000.jpg", "view001.jpg"]
    assert np.array_equal(table.point, found.point)
    assert np.array_equal(table.use, found.use)
    assert np.abs(table.xy - found.xy).max() < 1e-6
    assert np.array_equal(table.sd[found.use], found.sd[found.use])


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("'optimization_inputs'", "'inputs'", "targets.mrcal-no-corners key=optimization_inputs"),
        ("b'P)h", "b'P h", "targets.mrcal-damaged key=optimization_inputs"),
        ("'imagersize'", "__import__('os')", "targets.mrcal-dictionary"),
        ("'lensmodel'", "'lens'", "targets.mrcal-no-model"),
    ],
)
def test_a_damaged_model_of_mrcal_is_refused(tmp_path, before, after, said):
    path = tmp_path / "x.cameramodel"
    text = shared("targets", MODEL).read_text()
    assert before in text
    path.write_text(text.replace(before, after, 1))
    with refusal(said):
        read_model(path)


def test_a_model_of_mrcal_with_damaged_arrays_is_refused(tmp_path):
    path = tmp_path / "x.cameramodel"
    text = shared("targets", MODEL).read_text()
    amid = len(text) // 2
    path.write_text(text[:amid] + ("A" if text[amid] != "A" else "B") + text[amid + 1 :])
    with refusal("error.parse format=as an archive of arrays (npz) reason=Bad CRC-32 for file"):
        read_model(path)


def test_corners_without_a_board_are_refused(tmp_path):
    written(tmp_path / "c.vnl", "# filename x y level", *rows("a.jpg", form="{image} {x} {y} 0"))
    assert holds_targets(tmp_path)
    with refusal("targets.no-board"):
        read(tmp_path)
    written(tmp_path / "c.csv", "image,point,x,y", *rows("a.jpg"))
    written(tmp_path / "board.toml", "columns = 3", "rows = 2", "spacing = 0.1")
    with refusal("targets.formats names=['table of corners: c.csv', 'corners of mrcal:"):
        read(tmp_path)


def test_a_table_without_a_board_is_no_calibration(tmp_path):
    written(tmp_path / "c.csv", "image,point,x,y", *rows("a.jpg"))
    assert not holds_targets(tmp_path)
    written(tmp_path / "board.toml", "columns = 3", "rows = 2", "spacing = 0.1")
    assert holds_targets(tmp_path)


def test_views_with_few_corners_or_on_a_line_are_left_out_and_named():
    given = rig_small()
    corners = given.corners
    keep = np.ones(len(corners.xy), dtype=bool)
    own = np.flatnonzero(corners.picture == 3)
    keep[own[5:]] = False  # five corners
    line = np.flatnonzero(corners.picture == 4)
    keep[line[corners.point[line] >= 9]] = False  # the first row
    names = corners.pictures[3], corners.pictures[4]
    part = corners.replace(
        picture=corners.picture[keep],
        point=corners.point[keep],
        xy=corners.xy[keep],
        sd=corners.sd[keep],
        use=corners.use[keep],
    )
    found = given.replace(corners=part)
    assert [described(each) for each in found.messages] == [
        f"targets.left-out picture={names[0]} reason=targets.few count=5 least=6",
        f"targets.left-out picture={names[1]} reason=targets.line",
    ]
    assert len(found.corners.pictures) == len(corners.pictures) - 2


def test_a_calibration_needs_a_camera_for_each_name():
    given = rig_small()
    with refusal("targets.cameras count=2 value=error.value"):
        given.replace(cameras=[Camera("brown", {"c": 100.0})] * 2)
    with refusal("error.at what=sensors message=error.empty"):
        given.replace(sensors=None)


def test_a_chessboard_by_its_numbers_of_corners():
    with pytest.raises(InputError) as raised:
        CalibrationOptions(board=(10, 10))
    assert raised.value.phrase.fields["what"] == "board"
    path = shared("targets", "mrcal_corners.vnl")
    found = read(path, CalibrationOptions(board=(10, 10), spacing=0.077), size=(6000, 3376), model="opencv4")
    assert found.board == Board(columns=10, rows=10, spacing=0.077)
