"""BlocksExchange XML: matrices and angles, pixels and millimetres, systems of coordinates."""

import zipfile

import numpy as np
import pytest
from block import check_adjustment, check_poses, same_blocks, sample, truth, with_control, with_noise
from damaged import check_damaged
from test_plain_project import EXAMPLE, written

from message_codes import refused
from photogram import Attitudes, adjust, formats
from photogram.formats import xml_stream
from photogram.formats.description import agreement
from photogram.words import option_sd

FILES = ("matrix_pixels_ydown_v2.1.xml", "angles_millimetres_yup_v3.2.xml")


def named(project):
    """Return the true names of points: ties have none in the files."""
    known = truth()["points"]
    names = list(known)
    places = np.array([known[name]["position"] for name in names])
    return {
        point: names[int(np.argmin(np.linalg.norm(places - start, axis=1)))]
        for point, start in zip(project.block.point_ids, project.starts, strict=True)
    }


@pytest.mark.parametrize("file", FILES)
def test_the_sample_is_the_truth_and_comes_out_as_the_dense_adjustment(file):
    project = formats.read(sample("blocksexchange", file), formats.ReadOptions(sd={"gnss": (0.05,)}))
    check_poses(project.block, truth()["photos"])
    assert agreement(project).median < 1e-8
    held = {
        project.block.point_ids[row]
        for row in np.flatnonzero(np.isfinite(project.block.point_sd).all(axis=1))
    }
    assert held == {f"GCP-{k}" for k in range(1, 6)}
    assert [project.block.point_ids[row] for row in project.checks] == ["CHK-1", "CHK-2"]
    np.testing.assert_array_equal(
        project.block.point_sd[project.block.point_ids.index("GCP-1")], [0.02, 0.02, 0.03]
    )
    gnss = {each.photo: each.observed[:3] for each in project.block.observations}
    np.testing.assert_allclose(gnss["DJI_0001.JPG"], truth()["photos"]["DJI_0001.JPG"]["gnss"])
    names = named(project)
    check_adjustment(with_control(with_noise(project, names), names), names)
    alone = formats.read(sample("blocksexchange", file))
    assert option_sd("gnss") in [each.fields.get("option") for each in alone.lacks]


def test_a_round_trip_gives_the_same_adjustment(tmp_path):
    project = formats.read(EXAMPLE)
    place = written(project, tmp_path / "there", "blocks_exchange") / "block.xml"
    other = formats.read(place, formats.ReadOptions(sd={"images": (0.5,), "gnss": (0.03,)}))
    same_blocks(project.block, other.block, 1e-9)
    own = [each for each in project.block.observations if each.KIND == "distance"]
    block = other.block.replace(image_sd=0.5, observations=[*other.block.observations, *own])
    one, two = adjust(project.block, tolerance=1e-9), adjust(block, tolerance=1e-9)
    order = [block.point_ids.index(name) for name in project.block.point_ids]
    assert (np.abs(two.point_positions[order] - one.point_positions) < 1e-7 * one.point_sd).all()
    lost = " ".join(formats.cannot_hold(project, "blocks_exchange"))
    for word in ("standard deviations", "1 observations other than", "GNSS"):
        assert word in lost


def test_a_projected_system_is_carried_into_a_frame_and_attitudes_with_it(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed")
    from photogram.formats import Frame, from_frame

    source = sample("blocksexchange", FILES[0])
    project = formats.read(source)
    frame = Frame("topocentric", "EPSG:4979", (47.38, 8.54, 450.0))
    crs = "EPSG:32632"
    text = source.read_text().replace('LOCAL_CS["Local east, north, up",UNIT["metre",1]]', crs)
    everything = np.vstack([project.block.photo_positions, project.starts])
    known = np.vstack(
        [
            [each["centre"] for each in truth()["photos"].values()],
            [e["position"] for e in truth()["points"].values()],
        ]
    )
    assert everything.shape == known.shape
    moved, _ = from_frame(crs, known, np.zeros((len(known), 3, 3)), frame)
    for before, after in zip(known.tolist(), moved.tolist(), strict=True):
        old = "".join(f"<{axis}>{value!r}</{axis}>" for axis, value in zip("xyz", before, strict=True))
        new = "".join(f"<{axis}>{value!r}</{axis}>" for axis, value in zip("xyz", after, strict=True))
        assert old in text
        text = text.replace(old, new)
    # Grid north is some minutes off true north there: attitudes of the file are relative to the grid.
    from photogram.formats.crs import turn_to_frame

    turns = turn_to_frame(crs, moved[:6], frame)
    angle = np.degrees(np.arctan2(turns[0, 1, 0], turns[0, 0, 0]))
    assert abs(abs(angle) - 0.339) < 0.01
    matrices = Attitudes.of("omega_phi_kappa", project.block.photo_attitudes).matrices
    flip = np.diag([1.0, -1.0, -1.0])
    for own, turn in zip(matrices, turns, strict=True):
        old, new = flip @ own.T, flip @ (turn.T @ own).T
        written_old = [f"<M_{i}{j}>" for i in range(3) for j in range(3)]
        start = text.index(f"{written_old[0]}{truth_digits(text, old[0, 0])}<")
        end = text.index("<Accurate>", start)
        text = (
            text[:start]
            + "".join(f"<M_{i}{j}>{float(new[i, j])!r}</M_{i}{j}>" for i in range(3) for j in range(3))
            + text[end:]
        )
    path = tmp_path / "utm.xml"
    path.write_text(text)
    other = formats.read(path)
    assert agreement(other).median < 1e-5
    apart = np.diff(other.block.photo_positions, axis=0) - np.diff(project.block.photo_positions, axis=0)
    assert np.abs(apart).max() < 1e-3
    assert other.frame.kind == "topocentric"


def truth_digits(text, value):
    """Return the digits that stand in a file for the first element of a matrix."""
    import re

    found = [word for word in re.findall(r"<M_00>([^<]*)<", text) if abs(float(word) - value) < 1e-12]
    return found[0]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<Width>4000</Width>", "<Width>x</Width>", ["record 11", "error.whole value=x"]),
        ("XRightYDown", "XRightYSide", ["XRightYSide", "XRightYDown"]),
        (
            "<K1>-0.071</K1>",
            "<K1>-0.071</K1><Direct>1</Direct>",
            ["format.unknown what=term of the distortion value=Direct"],
        ),
        ("Perspective", "Fisheye", ["format.unknown what=CameraModelType value=Fisheye"]),
        ("<M_00>", "<Q_00>", ["record", "mismatched tag"]),
        ("<Id>1</Id>", "<Id>0</Id>", ["format.repeated what=photo name=0"]),
        ("<HorizontalAccuracy>0.02</HorizontalAccuracy>", "", ["format.sd name=GCP-1"]),
        ("<BlocksExchange", "<Exchange", ["xml.root name=BlocksExchange value=Exchange"]),
        ("<P1>-0.00025</P1><P2>0.0004</P2>", "<P1>0.0004</P1><P2>-0.00025</P2>", ["P1 and P2 exchanged"]),
        ("<K1>-0.071</K1><K2>0.052</K2>", "<K1>0.071</K1><K2>-0.052</K2>", ["with the other sign"]),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, old, new, words):
    text = sample("blocksexchange", FILES[0]).read_text()
    assert old in text
    path = tmp_path / "block.xml"
    path.write_text(text.replace(old, new, 1))
    with refused("block.xml", *words):
        formats.read(path, file_format="blocks_exchange")


def test_a_group_may_have_any_number_of_photos(tmp_path, monkeypatch):
    path = written(formats.read(EXAMPLE), tmp_path / "there", "blocks_exchange") / "block.xml"
    photos = path.read_text().split("<Photo>")[1:]
    assert sum(photo.count("</") for photo in photos) > 120
    monkeypatch.setattr(xml_stream, "MOST", 120)
    assert len(formats.read(path).block.photo_ids) == len(photos)


def test_entities_are_not_read(tmp_path):
    path = tmp_path / "block.xml"
    path.write_text(
        '<?xml version="1.0"?><!DOCTYPE b [<!ENTITY a "aaaa">]><BlocksExchange>&a;</BlocksExchange>'
    )
    with refused("xml.entities"):
        formats.read(path, file_format="blocks_exchange")


@pytest.mark.parametrize("file", FILES)
def test_damaged_files_end_in_a_message(tmp_path, file):
    assert check_damaged(sample("blocksexchange", file), tmp_path, "blocks_exchange", 250, 3) > 60


def test_packed_files_are_read_as_they_are(tmp_path):
    source = sample("blocksexchange", "matrix_pixels_ydown_v2.1.xml")
    packed = tmp_path / "block.xmlz"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(source, "block.xml")
        archive.writestr("readme.txt", "nothing")
    same_blocks(formats.read(packed).block, formats.read(source).block, 0.0)
    (tmp_path / "there").mkdir()
    assert check_damaged(packed, tmp_path / "there", "blocks_exchange", 60, 8) > 20
    with zipfile.ZipFile(packed, "a") as archive:
        archive.writestr("other.xml", "<x/>")
    with refused("xml.archive n=2"):
        formats.read(packed, file_format="blocks_exchange")
