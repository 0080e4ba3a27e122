"""Camera XML and marker tables of Metashape."""

import numpy as np
import pytest
from block import sample, truth
from damaged import check_damaged
from test_opensfm import only
from test_plain_project import EXAMPLE, written

from message_codes import fields_of, refused
from photogram import Attitudes, Camera, InputError, adjust, formats
from photogram.formats import Frame, supplements
from photogram.formats.description import agreement

pyproj = pytest.importorskip("pyproj", reason="pyproj is not installed")


def test_the_sample_is_the_truth():
    project = formats.read(sample("agisoft", "cameras.xml"))
    block = project.block
    # The frame has its origin amid the photos: what is compared is carried there by the same formulas.
    from photogram.formats import to_frame
    from photogram.formats.crs import turn_to_frame

    known = {name.rsplit(".", 1)[0]: each for name, each in truth()["photos"].items()}
    assert set(block.photo_ids) == set(known)
    assert fields_of(project.messages, "format.unposed")["n"] == 1
    local = "ENU:47.38,8.54,450"
    centres = np.array([known[name]["centre"] for name in block.photo_ids])
    expected, _, _ = to_frame(local, centres, np.zeros((6, 3, 3)), project.frame)
    np.testing.assert_allclose(block.photo_positions, expected, atol=5e-9)
    turns = turn_to_frame(local, centres, project.frame)
    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).matrices
    for row, name in enumerate(block.photo_ids):
        np.testing.assert_allclose(
            turns[row].T @ matrices[row], np.array(known[name]["rotation"]).T, atol=1e-9
        )
    assert agreement(project).median < 1e-6
    assert [block.point_ids[row] for row in project.checks] == ["CHK-1", "CHK-2"]
    assert sum(each.KIND == "control" for each in block.observations) == 5
    assert sum(each.KIND == "position" for each in block.observations) == 6
    known_images = {
        (each["photo"].rsplit(".", 1)[0], each["point"]): each for each in truth()["observations"]
    }
    for photo, point, xy in zip(block.image_photos, block.image_points, block.image_xy, strict=True):
        own = known_images[block.photo_ids[photo], block.point_ids[point]]
        np.testing.assert_allclose(xy, [own["column"], own["row"]], atol=1e-9)
    result = adjust(block)
    assert result.converged


def test_a_table_of_markers_is_control(tmp_path):
    project = formats.read(only(tmp_path / "model"))
    names = {str(row): name for row, name in enumerate(truth()["points"])}
    project = project.replace(
        block=project.block.replace(point_ids=[names[point] for point in project.block.point_ids])
    )
    found = supplements.with_control(project, sample("agisoft", "markers.csv"), {}, "EPSG:4979")
    control = [each for each in found.block.observations if each.KIND == "control"]
    assert len(control) == 7
    for each in control:
        np.testing.assert_allclose(each.observed, truth()["points"][each.point]["position"], atol=2e-8)
        np.testing.assert_allclose(np.sqrt(np.diag(each.precision)), [0.02, 0.02, 0.03], rtol=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('type="frame"', 'type="rpc"', ["record 5", "format.unknown what=type of the sensor value=rpc"]),
        ("<f>3612.5</f>", "<f>x</f>", ["record 13", "error.number value=x"]),
        (
            "<p1>-0.00025</p1>",
            "<p1>-0.00025</p1><p3>1e999</p3>",
            ["record 13", "error.number value=1e999"],
        ),
        (
            'sensor_id="0" component_id="0" label="DJI_0001"',
            'sensor_id="9" label="DJI_0001"',
            ["format.undefined what=camera name=9"],
        ),
        ("<document", "<documents", ["record"]),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, old, new, words):
    text = sample("agisoft", "cameras.xml").read_text()
    assert old in text
    (tmp_path / "cameras.xml").write_text(text.replace(old, new, 1))
    with refused("cameras.xml", *words):
        formats.read(tmp_path / "cameras.xml", file_format="agisoft")


def test_further_tangential_terms_have_a_camera(tmp_path):
    text = sample("agisoft", "cameras.xml").read_text()
    (tmp_path / "cameras.xml").write_text(
        text.replace("<p1>-0.00025</p1>", "<p1>-0.00025</p1><p3>0.1</p3>", 1)
    )
    camera, other = formats.read(tmp_path / "cameras.xml").block.cameras
    assert (camera.model, other.model) == ("agisoft_frame_p4", "agisoft_frame")
    assert camera.parameters["p3"] == 0.1


def both_ways(project, place):
    """Write and read a project."""
    return formats.read(written(project, place, "agisoft") / "cameras.xml")


def test_what_is_written_is_read_again(tmp_path):
    project = formats.read(sample("agisoft", "cameras.xml"))
    other = both_ways(project, tmp_path)
    one, two = project.block, other.block
    assert other.frame == project.frame
    assert two.photo_ids == one.photo_ids
    assert two.point_ids == one.point_ids
    assert [each.parameters for each in two.cameras] == [each.parameters for each in one.cameras]
    np.testing.assert_allclose(two.photo_positions, one.photo_positions, rtol=0, atol=5e-9)
    np.testing.assert_allclose(two.photo_attitudes, one.photo_attitudes, rtol=0, atol=1e-12)
    np.testing.assert_allclose(two.image_xy, one.image_xy, rtol=0, atol=1e-12)
    assert project.checks == other.checks
    mine, own = ([each for each in block.observations if each.KIND == "control"] for block in (one, two))
    assert [each.point for each in own] == [each.point for each in mine]
    for a, b in zip(mine, own, strict=True):
        np.testing.assert_allclose(b.observed, a.observed, rtol=0, atol=5e-9)
        np.testing.assert_allclose(b.precision, a.precision, rtol=1e-6, atol=1e-12)
    # Digits of the earth: the loss that the page of formats states.
    a, b = adjust(one), adjust(two)
    assert (np.abs(a.photo_positions - b.photo_positions) < 1e-6 * a.photo_sd[:, :3]).all()


def test_a_block_without_a_place_on_the_earth_keeps_all_digits(tmp_path):
    project = formats.read(sample("project"))
    local = project.replace(frame=Frame(), starts=project.starts)
    names = " ".join(formats.cannot_hold(local, "agisoft"))
    assert "images of tie points" in names
    assert "digits" not in names
    other = both_ways(local, tmp_path)
    assert [each.model for each in other.block.cameras] == ["agisoft_frame", "agisoft_frame"]
    np.testing.assert_array_equal(other.block.photo_positions, local.block.photo_positions)
    np.testing.assert_allclose(other.block.photo_attitudes, local.block.photo_attitudes, rtol=0, atol=1e-14)
    points = {name: row for row, name in enumerate(local.block.point_ids)}
    for row, name in enumerate(other.block.point_ids):
        np.testing.assert_array_equal(
            other.block.point_positions[row], local.block.point_positions[points[name]]
        )
        np.testing.assert_array_equal(other.block.point_sd[row], local.block.point_sd[points[name]])
    # Control and references of cameras adjust to the same, as the images of control do.
    own = set(other.block.point_ids)
    block = local.block
    keep = np.array([block.point_ids[point] in own for point in block.image_points])
    less = block.replace(
        image_photos=block.image_photos[keep],
        image_points=block.image_points[keep],
        image_xy=block.image_xy[keep],
        image_sd=0.3,
    )
    one, two = adjust(less, tolerance=1e-10), adjust(other.block.replace(image_sd=0.3), tolerance=1e-10)
    assert (np.abs(one.photo_positions - two.photo_positions) < 1e-9 * one.photo_sd[:, :3]).all()
    np.testing.assert_allclose(two.photo_sd, one.photo_sd, rtol=1e-9)


def test_what_metashape_does_not_have_is_refused():
    project = formats.read(sample("project"))
    camera = Camera("opencv_fisheye", {"fx": 900.0, "fy": 900.0, "cx": 500.0, "cy": 400.0}, name="A")
    other = project.block.cameras[1]
    with pytest.raises(InputError, match="must be known to Metashape, got opencv_fisheye"):
        formats.to_files(project.replace(block=project.block.replace(cameras=[camera, other])), "agisoft")


def test_damaged_documents_end_in_a_message(tmp_path):
    assert check_damaged(sample("agisoft", "cameras.xml"), tmp_path, "agisoft", 500, 5) > 100


def document(tmp_path, change, shift=(0.0, 0.0, 0.0)):
    """Return the packaged project, shifted, as a document whose text is changed, read again."""
    project = formats.read(EXAMPLE)
    block = project.block
    block = block.replace(
        photo_positions=block.photo_positions + shift,
        point_positions=block.point_positions + shift,
        observations=(),
    )
    place = written(project.replace(block=block, starts=project.starts + shift), tmp_path, "agisoft")
    path = place / "cameras.xml"
    path.write_text(change(path.read_text()))
    return block, path


def as_photoscan(text):
    """Return a document as PhotoScan 1.2 has it: a list of chunks, a transform of the whole chunk."""
    text = text.replace('version="2.0.0"', 'version="1.2.0"')
    text = text.replace(
        '<chunk enabled="true">', '<chunks next_id="2" active_id="0"><chunk id="0" label="A">'
    )
    return text.replace("</chunk>", '</chunk><chunk id="1" label="B"></chunk></chunks>')


def test_projects_of_photoscan_have_a_list_of_chunks(tmp_path):
    block, path = document(tmp_path, as_photoscan)
    project = formats.read(path)
    np.testing.assert_array_equal(project.block.photo_positions, block.photo_positions)
    assert fields_of(project.messages, "format.model-chosen") == {"n": 2, "names": ["A", "B"], "model": 0}
    with refused("format.missing what=sensors"):
        formats.read(path, formats.ReadOptions(model=1))
    with refused("format.models n=2 model=2"):
        formats.read(path, formats.ReadOptions(model=2))


@pytest.mark.parametrize("named", [True, False])
def test_local_coordinates_far_from_0_are_no_degrees_and_not_geocentric(tmp_path, named):
    start, end = "<reference>", "</reference>"

    def unnamed(text):
        return text if named else text[: text.index(start)] + text[text.index(end) + len(end) :]

    block, path = document(tmp_path, unnamed, shift=(5e5, 5.9e6, 100.0))
    project = formats.read(path)
    assert project.frame == Frame()
    np.testing.assert_array_equal(project.block.photo_positions, block.photo_positions)
    rows = [block.point_ids.index(name) for name in project.block.point_ids]
    np.testing.assert_array_equal(project.block.point_positions, block.point_positions[rows])


def test_references_of_a_chunk_without_a_place_are_left_out(tmp_path):
    def geographic(text):
        start = text.index("<reference>LOCAL") + len("<reference>")
        return f"{text[:start]}EPSG:4326{text[text.index('</reference>', start) :]}"

    _, path = document(tmp_path, geographic)
    project = formats.read(path)
    assert not np.isfinite(project.block.point_positions).any()
    assert fields_of(project.messages, "agisoft.local")["n"] == 5


def test_accuracies_of_the_settings_and_of_all_coordinates_count(tmp_path):
    def coarse(text):
        for axis in "xyz":
            for value in (0.01, 0.02, 0.015):
                text = text.replace(f' s{axis}="{value}"', "")
        text = text.replace("<reference x", '<reference sxyz="0.25" x', 1)
        settings = '<settings><property name="accuracy_markers" value="0.5"/></settings>'
        return text.replace("</chunk>", f"{settings}</chunk>")

    _, path = document(tmp_path, coarse)
    found = formats.read(path).block.point_sd
    held = np.isfinite(found).all(axis=1)
    assert sorted(found[held][:, 0]) == [0.25, 0.5, 0.5, 0.5]
