"""Control in another system than the photos: named before the adjustment, with the option that mends it."""

from pathlib import Path

import numpy as np
import pytest

from message_codes import refused
from photogram import InputError, Position, formats
from photogram.formats import Frame
from photogram.formats.columns import columns_given
from photogram.formats.supplements import with_control

LISTS = Path(__file__).parents[1] / "data" / "control_lists"
ORIGIN = (48.8666, 8.4711, 430.0)


@pytest.fixture(scope="module")
def local():
    """Return the control in the frame of the block."""
    rows = [line.split(", ") for line in (LISTS / "dbat.txt").read_text().splitlines()[2:]]
    return {row[1]: np.array(row[2:5], dtype=float) for row in rows}


def block(*, gnss=True, place=False):
    project = formats.read(LISTS / "block")
    own = project.block
    if gnss:
        observed = [
            Position(name, xyz, sd=1.0) for name, xyz in zip(own.photo_ids, own.photo_positions, strict=True)
        ]
        project = project.replace(block=own.replace(observations=observed))
    return project.replace(frame=Frame("topocentric", "EPSG:4979", ORIGIN)) if place else project


def given(project, path, control, change, crs=None, columns=None):
    lines = [f"{name},{','.join(repr(float(v)) for v in change(xyz))}" for name, xyz in control.items()]
    path.write_text("\n".join(["name,east,north,height", *lines, ""]))
    return with_control(project, path, {"control": (0.01,)}, crs, columns_given(columns, None))


@pytest.mark.parametrize(
    ("change", "what", "option"),
    [
        (lambda v: v[[1, 0, 2]], "x and y (east and north) are exchanged", "x=north,y=east"),
        (lambda v: v * [1, -1, 1], "'north' has the opposite sign", "y=-north"),
        (lambda v: v / 0.3048, "in ft", "x=east[ft],y=north[ft],z=height[ft]"),
        (lambda v: v * 1000, "in mm", "x=east[mm],y=north[mm],z=height[mm]"),
    ],
)
def test_an_exchange_is_named_and_its_option_mends_it(tmp_path, local, change, what, option):
    with pytest.raises(InputError) as caught:
        given(block(), tmp_path / "list.csv", local, change)
    assert what in str(caught.value)
    assert f"--columns {option}" in str(caught.value)
    mended = given(block(), tmp_path / "list.csv", local, change, columns=option)
    place = mended.block.point_ids.index("103")
    np.testing.assert_allclose(mended.block.point_positions[place], local["103"])


def test_control_as_it_should_be_is_not_doubted(tmp_path, local):
    for project in (block(), block(gnss=False), block(place=True)):
        found = given(project, tmp_path / "list.csv", local, lambda v: v)
        assert not [each for each in found.messages if "exchanged" in str(each)]


def test_a_map_without_its_system_is_named_before_the_adjustment(tmp_path, local):
    shift = np.array([461_200.0, 5_412_300.0, 430.0])
    with refused("control-system.far"):
        given(block(), tmp_path / "list.csv", local, lambda v: v + shift)
    unknown = block().block.replace(photo_positions=np.nan, photo_attitudes=np.nan)
    with refused("control-system.far"):
        given(block().replace(block=unknown), tmp_path / "list.csv", local, lambda v: v + shift)


def test_the_zone_is_named_where_the_block_has_a_place(tmp_path, local):
    pytest.importorskip("pyproj")
    from photogram.formats.crs import to_system

    names, xyz = list(local), np.array(list(local.values()))
    frame = Frame("topocentric", "EPSG:4979", ORIGIN)
    for crs in ("EPSG:32632", "EPSG:4979"):
        there, _ = to_system(crs, xyz, frame)
        control = dict(zip(names, there, strict=True))
        with pytest.raises(InputError, match=f"--control-crs {crs}"):
            given(block(place=True), tmp_path / "list.csv", control, lambda v: v)
        found = given(block(place=True), tmp_path / "list.csv", control, lambda v: v, crs)
        row = found.block.point_ids.index("103")
        np.testing.assert_allclose(found.block.point_positions[row], local["103"], atol=1e-3)
    there, _ = to_system("EPSG:32632", xyz, frame)
    control = dict(zip(names, there, strict=True))
    with pytest.raises(InputError, match="exchanged"):
        given(block(place=True), tmp_path / "list.csv", control, lambda v: v[[1, 0, 2]], "EPSG:32632")
    with pytest.raises(InputError, match="zone"):
        given(
            block(place=True),
            tmp_path / "list.csv",
            control,
            lambda v: v + np.array([32e6, 0, 0]),
            "EPSG:32632",
        )


def test_a_free_model_that_control_turns_upside_down_is_told(tmp_path, local):
    found = given(block(gnss=False), tmp_path / "list.csv", local, lambda v: v[[1, 0, 2]])
    assert any("--columns x=north,y=east" in str(each) for each in found.messages)


def test_control_of_a_plain_project_is_looked_at_too(tmp_path, local):
    for each in (LISTS / "block").iterdir():
        (tmp_path / each.name).write_bytes(each.read_bytes())
    lines = [f"{name},{xyz[1]},{xyz[0]},{xyz[2]},0.01" for name, xyz in local.items()]
    (tmp_path / "control.csv").write_text("\n".join(["point,x,y,z,sd", *lines, ""]))
    with refused("control-system.exchange"):
        formats.read(tmp_path)
    settings = (tmp_path / "project.toml").read_text()
    (tmp_path / "project.toml").write_text(settings + '[control]\ncolumns = "x=y,y=x"\n')
    project = formats.read(tmp_path)
    row = project.block.point_ids.index("103")
    np.testing.assert_array_equal(project.block.point_positions[row], local["103"])
