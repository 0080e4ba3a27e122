"""Camera XML and marker tables of Metashape."""

import numpy as np
import pytest
from block import sample, truth
from damaged import check_damaged
from test_opensfm import only

from photogram import Attitudes, InputError, adjust, formats
from photogram.formats import additions
from photogram.formats.self_check import agreement

pyproj = pytest.importorskip("pyproj", reason="pyproj is not installed")


def test_the_sample_is_the_truth():
    project = formats.read(sample("agisoft", "cameras.xml"))
    block = project.block
    # The frame has its origin amid the photos: what is compared is carried there by the same formulas.
    from photogram.formats.crs import to_frame, turn_to_frame

    known = {name.rsplit(".", 1)[0]: each for name, each in truth()["photos"].items()}
    assert set(block.photo_ids) == set(known)
    assert any("1 cameras were not aligned" in str(each) for each in project.messages)
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
    found = additions.with_control(project, sample("agisoft", "markers.csv"), {}, "EPSG:4979")
    control = [each for each in found.block.observations if each.KIND == "control"]
    assert len(control) == 7
    for each in control:
        np.testing.assert_allclose(each.observed, truth()["points"][each.point]["position"], atol=2e-8)
        np.testing.assert_allclose(np.sqrt(np.diag(each.precision)), [0.02, 0.02, 0.03], rtol=1e-3)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('type="frame"', 'type="rpc"', ["record 5", "type rpc"]),
        ("<f>3612.5</f>", "<f>x</f>", ["record 13", "'x' is not a number"]),
        ("<p1>-0.00025</p1>", "<p1>-0.00025</p1><p3>0.1</p3>", ["p3 is not zero"]),
        (
            'sensor_id="0" component_id="0" label="DJI_0001"',
            'sensor_id="9" label="DJI_0001"',
            ["sensor of DJI_0001"],
        ),
        ("<document", "<documents", ["record"]),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, old, new, words):
    text = sample("agisoft", "cameras.xml").read_text()
    assert old in text
    (tmp_path / "cameras.xml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError) as refused:
        formats.read(tmp_path / "cameras.xml", "agisoft")
    for word in ("cameras.xml", *words):
        assert word in str(refused.value)


def test_damaged_documents_end_in_a_message(tmp_path):
    assert check_damaged(sample("agisoft", "cameras.xml"), tmp_path, "agisoft", 300, 5) > 100
