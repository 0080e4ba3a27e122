"""PhotoModeler and DBAT: export files, scripts and tables, against published networks and the sample."""

import json
import shutil

import numpy as np
import pytest
from block import sample, truth
from damaged import check_damaged

from message_codes import fields_of, refused
from photogram import Attitudes, formats
from photogram.formats import ReadOptions
from photogram.formats.description import agreement
from test_roma import read as read_roma


def table_of_cameras(path):
    """Write the cameras of the sample as a table of the plain project."""
    lines = ["camera,width,height,pixel_mm,c,xp,yp,k1,k2,k3,p1,p2"]
    sizes = {"A": (4000, 3000), "B": (3000, 4000)}
    for name, own in json.loads(sample("dbat", "cameras.json").read_text()).items():
        (width, height), pixel = sizes[name], own["pixel_mm"]
        values = [own["c_mm"], own["px_mm"] - width / 2 * pixel, height / 2 * pixel - own["py_mm"]]
        values += [own[term] for term in ("K1", "K2", "K3", "P1", "P2")]
        lines.append(",".join([name, str(width), str(height), *map(repr, [pixel, *values])]))
    path.write_text("\n".join(lines) + "\n")
    return path


def copied(source, place):
    """Copy the tables of the sample: its file of cameras is no file of the package."""
    place.mkdir()
    for each in source.glob("*.txt"):
        shutil.copyfile(each, place / each.name)
    return place


def check_sample(project, tolerance):
    """Compare positions and attitudes with the truth, and measurements with the cameras of the file."""
    known = truth()["photos"]
    block = project.block
    assert set(block.photo_ids) == set(known)
    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).values("matrix_to_photo")
    for row, name in enumerate(block.photo_ids):
        np.testing.assert_allclose(block.photo_positions[row], known[name]["centre"], atol=1e-12)
        np.testing.assert_allclose(matrices[row], known[name]["rotation"], atol=1e-14)
    points = list(truth()["points"].values())
    starts = np.array([points[int(name) - 1]["position"] for name in block.point_ids])
    assert agreement(project.replace(starts=starts)).median < tolerance


def test_the_tables_of_the_sample_are_the_truth(tmp_path):
    cameras = table_of_cameras(tmp_path / "cameras.csv")
    place = copied(sample("dbat"), tmp_path / "block")
    project = formats.read(place, ReadOptions(cameras=cameras))
    check_sample(project, 1e-11)
    held = np.isfinite(project.block.point_sd).all(axis=1)
    np.testing.assert_array_equal(project.block.point_sd[held], [(0.02, 0.02, 0.03)] * 5)
    with refused("format.cameras"):
        formats.read(place)


@pytest.mark.parametrize("header", ["point,label,X,Y,Z,sX,sY,sZ", "X,Y,Z,sX,sY,sZ"])
def test_control_in_the_folder_may_have_other_headers(tmp_path, header):
    options = ReadOptions(cameras=table_of_cameras(tmp_path / "cameras.csv"))
    place = copied(sample("dbat"), tmp_path / "block")
    before = formats.read(place, options).block
    control = place / "control.txt"
    rows = [line.split(",") for line in control.read_text().splitlines() if not line.startswith("#")]
    if not header.startswith("point"):
        rows = [[row[0], *row[2:]] for row in rows]  # a word less than there are cells
    control.write_text("\n".join([header, *(",".join(row) for row in rows), ""]))
    after = formats.read(place, options).block
    np.testing.assert_array_equal(after.point_sd, before.point_sd)
    np.testing.assert_array_equal(after.point_positions, before.point_positions)


def export_of(place):
    """Write the photos of camera A of the sample as an export file, with all digits."""
    cameras = json.loads(sample("dbat", "cameras.json").read_text())["A"]
    size = [4000 * cameras["pixel_mm"], 3000 * cameras["pixel_mm"]]
    camera = [cameras["c_mm"], cameras["px_mm"], cameras["py_mm"], *size]
    camera += [cameras[term] for term in ("K1", "K2", "K3", "P1", "P2")]
    words = " ".join(map(repr, camera))
    rounded = " ".join(f"{value:.5f}" for value in camera)
    rows = {name: [] for name in ("images", "stations", "control", "markpts")}
    for name, found in rows.items():
        lines = sample("dbat", f"{name}.txt").read_text().splitlines()[1:]
        found += [[cell.strip() for cell in line.split(",")] for line in lines]
    names = {row[0]: row[1] for row in rows["images"] if row[2] == "A"}
    lines = ["Bundle Soln", " 0.0005 20 4000 3000", " ".join(["1.0"] * 9), words, " ".join(["0.1"] * 10)]
    for number, x, y, z, *angles in rows["stations"]:
        if number in names:
            own = int(number) - 1
            lines += [f"  {own} C:\\photos\\{names[number]}", f"{own} {x} {y} {z} {' '.join(angles[::-1])}"]
            lines += [
                f"{own} {' '.join(['0.01'] * 6)}",
                "",
                f"{own} {rounded}",
                f"{own} {' '.join(['0'] * 10)}",
            ]
    lines += ["", *(" ".join([row[0], *row[2:]]) for row in rows["control"]), ""]
    points = list(truth()["points"].values())
    lines += [f"{k} {' '.join(map(repr, each['position']))} 1 1 1" for k, each in enumerate(points, 1)]
    lines += [""]
    lines += [
        f"{int(photo) - 1} {point} {x} {y} 0.5 0.5"
        for point, photo, x, y in rows["markpts"]
        if photo in names
    ]
    lines += ["", "   1    1      317 ", "", "   0    1", ""]
    path = place / "block-pmexport.txt"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_an_export_is_the_truth(tmp_path):
    project = formats.read(export_of(tmp_path))
    assert project.title == "PhotoModeler export"
    assert [each.name for each in project.block.cameras] == ["camera"]
    known = {name: each for name, each in truth()["photos"].items() if each["camera"] == "A"}
    assert set(project.block.photo_ids) == set(known)
    assert agreement(project).median < 1e-11
    np.testing.assert_allclose(project.block.image_sd, 0.5 * 0.0024)
    assert any(each.code == "dbat.control" for each in project.messages)
    other = formats.read(tmp_path, ReadOptions(sd={"images": (1.0,), "control": (0.1,)}))
    np.testing.assert_allclose(other.block.image_sd, 0.0024)
    assert set(other.block.point_sd[np.isfinite(other.block.point_sd)]) == {0.1}


def test_deviations_of_control_that_are_not_computed_do_not_hold_it(tmp_path):
    path = export_of(tmp_path)
    lines = path.read_text().splitlines()
    first = next(row for row in range(5, len(lines)) if not lines[row - 1] and len(lines[row].split()) == 7)
    words = lines[first].split()
    lines[first] = " ".join([*words[:4], "-1", "-1", "-1"])
    second = lines[first + 1].split()
    lines[first + 1] = " ".join([*second[:6], "-1"])
    path.write_text("\n".join(lines) + "\n")
    project = formats.read(path)
    block = project.block
    assert [block.point_ids[row] for row in project.checks] == [words[0]]
    assert ("read.negative", 1) in {(each.code, each.fields.get("number")) for each in project.lacks}
    row = block.point_ids.index(second[0])
    assert np.isfinite(block.point_sd[row]).tolist() == [True, True, False]
    held = formats.read(path, ReadOptions(sd={"control": (0.1,)}))
    assert not held.checks


def test_photos_with_another_camera_have_their_own(tmp_path):
    path = export_of(tmp_path)
    lines = path.read_text().splitlines()
    row = next(k for k, line in enumerate(lines) if line.startswith("1 8.67"))
    lines[row] = lines[row].replace("1 8.67", "1 8.71")
    path.write_text("\n".join(lines) + "\n")
    project = formats.read(path)
    assert [each.name for each in project.block.cameras] == ["camera", "camera of photo 1"]
    assert project.block.cameras[1].parameters["c"] == -8.71
    assert fields_of(project.messages, "dbat.other-camera")["photo"] == 1


@pytest.mark.parametrize(
    ("line", "change", "words"),
    [
        (2, lambda line: " 0.0005 20", ["record 2", "dbat.size"]),
        (4, lambda line: line.replace("8.67", "8,67"), ["record 4", "c: error.number value=8,67"]),
        (4, lambda line: "-" + line, ["record 4", "dbat.distance c=-8.67"]),
        (7, lambda line: line.replace("0 -33.0", "7 -33.0"), ["record 7", "dbat.photo number=0 other=7"]),
        (12, lambda line: line.replace("1 C", "0 C"), ["record 12", "format.repeated what=photo name=0"]),
        (31, lambda line: "8" + line[1:], ["record 32", "format.repeated what=control point name=8"]),
        (79, lambda line: "9" + line[1:], ["record 79", "format.undefined what=photo name=9"]),
    ],
)
def test_a_fault_of_an_export_is_named_with_its_line(tmp_path, line, change, words):
    path = export_of(tmp_path)
    lines = path.read_text().splitlines()
    assert change(lines[line - 1]) != lines[line - 1]
    lines[line - 1] = change(lines[line - 1])
    path.write_text("\n".join(lines) + "\n")
    with refused(*words):
        formats.read(path, file_format="dbat")


MEASURED = """Project Units: meters
Units & Scale - Active, Translate - Active, Rotate - Active

Object Point ID,Photo #,X (pixels),Y (pixels),Residual X,Residual Y,Mark Type,Layer,Tagged
"""
COMPUTED = """Project Units: meters
Units & Scale - Active, Translate - Active, Rotate - Active

Id,Name,Photos (used),X (project units),Y (project units),Z (project units),X Precision
"""


def test_tables_of_measurements_are_the_truth(tmp_path):
    lines = [line.split(", ") for line in sample("dbat", "markpts.txt").read_text().splitlines()[1:]]
    own = [
        f"{point},{photo},{x},{y},0.1,0.2,SmartPoint,Default, " for point, photo, x, y in lines if photo < "5"
    ]
    (tmp_path / "a-2dpts.txt").write_text(MEASURED + "\n".join(own) + "\n")
    points = enumerate(truth()["points"].values(), 1)
    computed = [f'{k}," ","1,2",{",".join(map(repr, each["position"]))},0.001' for k, each in points]
    (tmp_path / "a-3dpts.txt").write_text(COMPUTED + "\n".join(computed) + "\n")
    cameras = table_of_cameras(tmp_path / "cameras.csv")
    cameras.write_text("\n".join(cameras.read_text().splitlines()[:2]) + "\n")
    project = formats.read(tmp_path / "a-2dpts.txt", ReadOptions(cameras=cameras))
    assert project.block.photo_ids == ["1", "2", "3", "4"]
    known = list(truth()["points"].values())
    for name, start in zip(project.block.point_ids, project.starts, strict=True):
        np.testing.assert_array_equal(start, known[int(name) - 1]["position"])


SCRIPT = """<?xml version="1.0" encoding="UTF-8"?>
<document dbat_script_version="1.0">
  <input base_dir="$HERE">
    <c>the control is the check, too</c>
    <ctrl_pts>
      <file format="id,label,x,y,z,sx,sy,sz">control.txt</file><filter id="{check}">remove</filter>
    </ctrl_pts>
    <check_pts>
      <file format="id,label,x,y,z,sx,sy,sz">control.txt</file><filter id="{check}">keep</filter>
    </check_pts>
    <images image_base_dir="$DBAT"><file format="id,path">images.txt</file></images>
    <image_pts>
      <file format="id,im,x,y" sxy="0.5">markpts.txt</file>
      <file format="id,im,x,y" sxy="1.0">smartpts.txt</file>
    </image_pts>
    <cameras>
      <camera>
        <name>Aerial camera</name><unit>mm</unit><sensor>53.14800,77.97600</sensor><image>8858,12996</image>
        <focal>123</focal><cc>123.9392</cc><pp>26.5770,38.8110</pp><K>0,0,0</K><P>0,0</P><model>3</model>
        <skew>0</skew><aspect>1</aspect>
      </camera>
    </cameras>
  </input>
  <operations>
    <operation><set_bundle_estimate_params><io><all>false</all></io></set_bundle_estimate_params></operation>
  </operations>
</document>
"""


@pytest.fixture
def sxb(strasbourg, tmp_path):
    """Return a folder with the script of a published network, and its tables."""
    place = tmp_path / "sxb"
    place.mkdir()
    for name in ("control.txt", "markpts.txt", "smartpts.txt"):
        shutil.copyfile(strasbourg / name, place / name)
    (place / "images.txt").write_text("# id, path\n" + "".join(f"{k}, images/{k}.jpg\n" for k in range(1, 6)))
    (place / "sxb.xml").write_text(SCRIPT.format(check="351, 410"))
    return place


def test_a_script_adjusts_to_what_its_program_reports(run, strasbourg, sxb, tmp_path):
    expected = json.loads((strasbourg / "expected_dbat.json").read_text())
    done = run("adjust", "sxb/sxb.xml", "--out", "out", "--json", "result.json")
    assert done.exit_code in (0, 4), done.output
    found = json.loads((tmp_path / "result.json").read_text())
    assert found["degrees_of_freedom"] == expected["redundancy"]
    assert np.sqrt(found["variance_of_unit_weight"]) == pytest.approx(expected["sigma0"], abs=5e-5)


def test_the_script_of_a_folder_is_read_and_not_its_tables_alone(sxb):
    assert formats.read(sxb).title == "DBAT script"


def test_a_script_says_what_is_unknown_and_held(roma, tmp_path):
    for source, target in (
        ("project.xml", "project.xml"),
        ("camera.xml", "cameras/EOS5DMarkII.xml"),
        ("initial_eo.txt", "prior/initial_eo.txt"),
        ("markpts.txt", "measurements/markpts.txt"),
    ):
        (tmp_path / target).parent.mkdir(exist_ok=True)
        shutil.copyfile(roma / source, tmp_path / target)
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "images.txt").write_text("".join(f"{k}, roma/P{k}.JPG\n" for k in range(1, 61)))
    project = formats.read(tmp_path / "project.xml")
    (camera,) = project.block.cameras
    free = {name for name, sd in zip(camera.names, camera.deviations, strict=True) if np.isinf(sd)}
    assert free == {"c", "xp", "yp", "K1", "K2"}
    assert [
        name
        for name, sd in zip(project.block.photo_ids, project.block.photo_position_sd, strict=True)
        if not sd.any()
    ] == ["P1.JPG"]
    # The same block, which another test adjusts to the figures of the program.
    other = read_roma(roma)
    middle = np.array([5616 / 2, -3744 / 2]) * 24 / 3744
    np.testing.assert_allclose(project.block.image_xy + middle, other.image_xy, rtol=0, atol=1e-12)
    np.testing.assert_allclose(project.block.image_sd, other.image_sd, rtol=1e-14)
    np.testing.assert_allclose(project.block.photo_attitudes, other.photo_attitudes, rtol=0, atol=1e-14)
    own, theirs = camera.parameters, other.cameras[0].parameters
    assert (own["xp"] + middle[0], own["yp"] + middle[1]) == pytest.approx((theirs["xp"], theirs["yp"]))
    assert [own[name] for name in ("c", "K1", "K2")] == [theirs[name] for name in ("c", "K1", "K2")]
    names = np.array(project.block.point_ids)[project.block.image_points]
    assert (names == np.array(other.point_ids)[other.image_points]).all()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("351, 410", "351, x", ["sxb.xml record 6", "error.whole value=x"]),
        (">keep<", ">drop<", ["record 9", "format.unknown what=filter value=drop"]),
        ("id,im,x,y", "id,im,x", ["markpts.txt record 2", "error.cells count=4 columns=3"]),
        ("smartpts.txt", "smart.txt", ["smart.txt", "error.read"]),
        ("$HERE", "$DBAT", ["dbat.path value=$DBAT"]),
        ("<model>3<", "<model>4<", ["sxb.xml", "format.unknown what=model value=4"]),
        ("26.5770,38.8110", "26.5770,-38.8110", ["dbat.old"]),
        (">false<", ">maybe<", None),
    ],
)
def test_a_fault_of_a_script_is_named_with_its_line(sxb, old, new, words):
    text = SCRIPT.format(check="351, 410").replace("<K>0,0,0<", "<K>1e-9,0,0<")
    assert old in text
    (sxb / "sxb.xml").write_text(text.replace(old, new, 1))
    if words is None:
        assert fields_of(formats.read(sxb / "sxb.xml").messages, "dbat.estimate")["value"] == "maybe"
        return
    with refused(*words):
        formats.read(sxb / "sxb.xml")


def test_damaged_tables_end_in_a_message(tmp_path):
    cameras = table_of_cameras(tmp_path / "cameras.csv")
    place = copied(sample("dbat"), tmp_path / "block")
    assert check_damaged(place, tmp_path / "there", "dbat", 250, 1, ReadOptions(cameras=cameras)) > 50


def test_damaged_exports_end_in_a_message(tmp_path):
    (tmp_path / "there").mkdir()
    assert check_damaged(export_of(tmp_path), tmp_path / "there", "dbat", 250, 2) > 50


def test_damaged_scripts_end_in_a_message(sxb, tmp_path):
    for name in ("markpts.txt", "smartpts.txt"):
        lines = (sxb / name).read_text().splitlines()[:60]
        (sxb / name).write_text("\n".join(lines) + "\n")
    shutil.copytree(sxb, tmp_path / "there")
    assert check_damaged(sxb / "sxb.xml", tmp_path / "there", "dbat", 250, 3) > 50
