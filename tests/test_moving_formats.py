"""Other formats, frames and maps of blocks with photos on trajectories: right, or refused by name."""

from dataclasses import replace

import numpy as np
import pytest

from message_codes import raises, refused
from moving_blocks import rolling, scanned
from photogram import InputError, Spheroid, adjust, formats, predict
from photogram.absolute_orientation import relative_model
from photogram.formats import FORMATS, cannot_hold, to_files
from photogram.formats.models import in_pixels, in_topocentric, is_free
from photogram.formats.project import Repeated
from photogram.formats.supplements import repeated_remarks
from photogram.network import Polynomial, Table, Timed, Trajectory
from photogram.network.block import of_images_alone

OTHERS = [name for name, each in FORMATS.items() if each.write is not None and name != "plain"]


def project_of(block, path, **more):
    """Return a project of a block that somebody has made."""
    count = len(block.cameras)
    return formats.Project(
        block=block,
        path=path,
        title="made",
        sizes=((4000, 3000),) * count,
        pixel_mm=(0.002,) * count,
        starts=block.point_positions,
        **more,
    )


@pytest.mark.parametrize("name", OTHERS)
def test_scanners_are_in_no_other_format(name, tmp_path):
    project = project_of(scanned(photos=True), tmp_path)
    for ask in (to_files, cannot_hold):
        with refused("format.scanner photo=S1"):
            ask(project, name)


@pytest.mark.parametrize("name", [name for name in OTHERS if name != "giant"])
def test_other_formats_lose_motion_and_say_so(name, tmp_path):
    block = rolling()
    project = project_of(block.replace(point_positions=adjust(block).point_positions), tmp_path)
    assert any("trajectories: 8 photos" in each for each in cannot_hold(project, name))
    assert to_files(project, name)


def test_giant_takes_pictures_alone(tmp_path):
    with raises(InputError, "block.unsupported.trajectories"):
        to_files(project_of(rolling(), tmp_path), "giant")
    with raises(InputError, "predict.unknown"):
        predict(scanned())
    with raises(InputError, "block.unsupported.trajectories"):
        of_images_alone(scanned().replace(timed=()), "predict")


def test_millimetres_become_pixels_without_their_shutters(tmp_path):
    """Edges of a shutter in millimetres stood beside images in pixels."""
    block = rolling()
    millimetres = block.replace(
        cameras=[block.cameras[0].replace(model="brown", parameters={"c": -6.0}, unit="mm", sd=0.0)],
        image_xy=(block.image_xy - [2000.0, 1500.0]) * [0.002, -0.002],
        image_sd=block.image_sd * 0.002,
        timed=[replace(each, shutter=replace(each.shutter, edges=(3.0, -3.0))) for each in block.timed],
    )
    assert in_pixels(project_of(millimetres, tmp_path)).block.timed == ()
    with refused("format.scanner photo=S1"):
        in_pixels(project_of(scanned(), tmp_path))


def test_a_model_with_trajectories_is_where_these_are(tmp_path):
    """A similarity onto control would have left the tables of trajectories behind."""
    assert not is_free(project_of(rolling(), tmp_path))
    assert not is_free(project_of(scanned(records=False), tmp_path))
    assert is_free(project_of(rolling().replace(timed=()), tmp_path))


def geographic():
    """Return a block on a sphere with a strip of a scanner and a frame on one trajectory."""
    sphere = Spheroid(3390.0, 3390.0)
    block = scanned(photos=True, records=False)
    table = Table([0.0, 1000.0], [[3400.0, 0.0, 0.0], [3400.0, 10.0, 0.0]], [0.0, 1000.0], [np.eye(3)] * 2)
    course = Trajectory("orbit", table, position=Polynomial(1, sd=1.0))
    moved = [replace(each, trajectory=course) for each in block.timed]
    lonlat = np.column_stack([np.linspace(0.0, 1e-3, 42), np.linspace(0.0, 1e-3, 42), np.zeros(42)])
    return block.replace(
        spheroid=sphere,
        timed=moved,
        observations=(),
        photo_positions=np.zeros((5, 3)),
        point_positions=lonlat,
        linear_unit="km",
    )


def test_trajectories_are_in_no_topocentric_frame(tmp_path):
    project = project_of(geographic(), tmp_path, frame=formats.Frame("geographic"))
    with raises(InputError, "block.unsupported.trajectories"):
        in_topocentric(project)


def test_second_images_of_what_moves_are_not_computed(tmp_path):
    block = rolling()
    photo, point = block.photo_ids[block.image_photos[0]], block.point_ids[block.image_points[0]]
    again = Repeated((photo,), (point,), block.image_xy[:1] + 0.1)
    project = project_of(block, tmp_path).replace(repeated=again)
    assert repeated_remarks(project, adjust(block)) == []


def test_maps_show_records_where_they_were_made():
    pytest.importorskip("geopandas")
    from photogram.formats.maps import map_layers

    block = scanned(photos=True)
    row = next(k for k, each in enumerate(block.observations) if each.KIND == "velocity")
    own = block.observations[row]
    wrong = replace(own, velocity=own.velocity + np.array([0.0, 0.0, 1.0]))
    observations = [*block.observations[:row], wrong, *block.observations[row + 1 :]]
    result = adjust(block.replace(observations=observations))
    found = {each.name: each.table for each in map_layers(result, "")}
    assert len(found["photos"]) == 5
    assert found["footprints"]["photo"].tolist() == ["F0", "F1", "F2"]
    first = found["suspicious"].iloc[0]
    assert first["what"] == f"velocity Z of {own.photos[0]}"
    assert first[["photo", "point"]].isna().all()
    assert first["unit"] == "m/s"
    at = result.trajectories["strip 1"].poses([own.time]).positions[0]
    np.testing.assert_allclose([first.geometry.x, first.geometry.y], at[:2], atol=1e-6)


def test_names_of_timed_photos_are_names():
    with raises(InputError, "error.absent"):
        rolling().replace(timed=[Timed("X")])


def test_models_of_two_photos_are_of_pictures():
    with raises(InputError, "block.unsupported.trajectories"):
        relative_model(rolling(), "IMG_1", "IMG_2")


def test_a_block_says_what_is_smooth():
    assert "smoothness of 3 position coefficients" in repr(scanned(smooth=True))
