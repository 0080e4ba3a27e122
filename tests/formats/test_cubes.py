"""ISIS cubes by their labels and tables, and lists of images."""

import made_cubes
import numpy as np
import pytest
from support_data import START, written

from message_codes import refused
from photogram import InputError
from photogram.formats.csm import SupportedImage, read_list, read_support
from photogram.formats.csm.cubes import read_cube, read_label, read_positions, read_turns, serial_number
from photogram.formats.csm.isd import Polynomials, of_angles
from photogram.formats.csm.photos import trajectory_of

SAMPLES, LINES = np.array([1.0, 150.0, 300.0]), np.array([400.0, 200.5, 1.0])


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_cube_says_what_its_isd_says(tmp_path, order):
    cube, isd = (
        read_cube(made_cubes.cube(tmp_path / "a.cub", order=order)),
        read_support(written(tmp_path, made_cubes.isd())),
    )
    for name in ("kind", "size", "radii", "focal_length", "lens", "remarks"):
        assert getattr(cube, name) == getattr(isd, name)
    assert cube.remarks[0].code == "csm.drift"
    np.testing.assert_allclose(cube.lines.table, [[0.0, START, 0.01]], rtol=1e-12)
    np.testing.assert_allclose(isd.lines.table, [[0.0, START, 0.01]], rtol=1e-12)
    for one, other in ((cube.pointing, isd.pointing), (cube.body, isd.body)):
        np.testing.assert_array_equal(one.times, other.times)
        np.testing.assert_allclose(one.matrices, other.matrices, atol=1e-15)
    np.testing.assert_allclose(cube.position.places, isd.position.places, rtol=1e-15)
    own, other = (SupportedImage(each, "I", pixels="isis", interpolation="isis") for each in (cube, isd))
    np.testing.assert_allclose(
        own.timed[0].line_sensor.places(SAMPLES), other.timed[0].line_sensor.places(SAMPLES), rtol=1e-14
    )
    # By TRANSX, TRANSY: 0.02 mm a pixel of the detector, two in one of the image.
    assert np.hypot(*own.timed[0].line_sensor.pitch) == pytest.approx(0.04)
    flown = [each.flown.flown(np.array([START + 1.234]), *np.zeros((2, 0, 3))) for each in (own, other)]
    np.testing.assert_allclose(flown[0][0], flown[1][0], rtol=1e-12)


def test_records_are_joined_as_the_cube_says(tmp_path):
    tables = made_cubes.tables()
    tables["InstrumentPosition"][2]["CacheType"] = "HermiteSpline"
    isd = read_cube(made_cubes.cube(tmp_path / "a.cub", tables=tables))
    table = trajectory_of(isd, "t", interpolation="csm").table
    assert (table.interpolation, table.attitude_interpolation) == ("hermite", "linear")
    np.testing.assert_allclose(table.velocities, isd.position.velocities)


def test_polynomials_are_tables(tmp_path):
    reference, scale = START + 2.0, 2.0
    angles = np.array([[2.0, -0.01, 1e-3, 2e-4], [1.8, 0.02, -1e-3, 1e-4], [-1.0, 0.03, 2e-3, -3e-4]])
    places = np.array([[1800.0, -2.0, -0.01], [20.0, 0.1, 0.02], [-5.0, 3.2, 0.03]])
    tables = made_cubes.tables()
    tables["InstrumentPointing"] = (
        ["J2000Ang1", "J2000Ang2", "J2000Ang3"],
        [*angles.T, [reference, scale, 3]],
        tables["InstrumentPointing"][2],
    )
    tables["InstrumentPosition"] = (
        ["J2000SVX", "J2000SVY", "J2000SVZ"],
        [*places.T, [reference, scale, 2]],
        tables["InstrumentPosition"][2] | {"CacheType": "PolyFunction"},
    )
    isd = read_cube(made_cubes.cube(tmp_path / "a.cub", tables=tables))
    on = trajectory_of(isd, "t", interpolation="isis")
    times = START + np.array([0.0, 0.01, 1.2345, 3.99, 4.0])
    at, turned, *_ = on.flown(times, *np.zeros((2, 0, 3)))
    s = ((times - reference) / scale)[:, np.newaxis]
    inertial = 1000 * (places.T[0] + s * places.T[1] + s**2 * places.T[2])
    matrices = np.reshape(made_cubes.CONSTANT, (3, 3)) @ of_angles(
        Polynomials(angles, reference, scale).at(times)
    )
    body = np.stack([made_cubes.support_data.body(np.array([t]))[0] for t in times])
    np.testing.assert_allclose(at, np.einsum("nij,nj->ni", body, inertial), rtol=0, atol=1e-6)
    expected = body @ np.swapaxes(matrices, 1, 2) @ np.diag([1.0, -1.0, -1.0])
    np.testing.assert_allclose(turned.reshape(-1, 3, 3), expected, rtol=0, atol=1e-12)


def changed(name, **keys):
    tables = made_cubes.tables()
    tables[name] = (*tables[name][:2], tables[name][2] | keys)
    return {"tables": tables}


def columns(name, *left):
    tables = made_cubes.tables()
    own, rows, keys = tables[name]
    kept = [k for k, column in enumerate(own) if column not in left]
    tables[name] = ([own[k] for k in kept], np.asarray(rows)[:, kept], keys)
    return {"tables": tables}


def less(*names):
    return {"known": {key: value for key, value in made_cubes.keywords().items() if key not in names}}


FAULTS = [
    (
        {"instrument": made_cubes.INSTRUMENT | {"InstrumentId": "WAC"}},
        "csm.instrument instrument=WAC spacecraft=LUNAR RECONNAISSANCE ORBITER",
    ),
    ({"group": "AlphaCube"}, "csm.derived name=AlphaCube"),
    ({"group": "Mapping"}, "csm.derived name=Mapping"),
    ({"tables": {}}, "csm.no-table name=InstrumentPointing"),
    (
        changed("InstrumentPosition", CacheType="PolyFunctionOverHermiteConstant"),
        "format.unknown what=CacheType value=polyfunctionoverhermiteconstant",
    ),
    (columns("InstrumentPosition", "J2000Y"), "format.member name=J2000Y"),
    (columns("InstrumentPointing", "J2000Q2"), "format.member name=J2000Q2"),
    (
        changed("BodyRotation", ConstantRotation="(1, 2, 3)"),
        "BodyRotation/ConstantRotation: error.count count=9 actual=3",
    ),
    (changed("BodyRotation", **{"^Table": '"body.tab"'}), "csm.elsewhere"),
    (
        {"known": made_cubes.keywords() | {"INS-85600_ITRANSL": [0, 0, 0]}},
        "csm.inverse other=NaifKeywords/INS-85600_ITRANSL",
    ),
    ({"instrument": made_cubes.INSTRUMENT | {"LineExposureDuration": "0"}}, "format.zero"),
    (
        {"instrument": made_cubes.INSTRUMENT | {"SpatialSumming": "0"}},
        "format.positive name=the sum of pixels",
    ),
    (less("INS-85600_OD_K"), "NaifKeywords: error.missing name=INS-85600_OD_K"),
    (less("BODY301_RADII"), "NaifKeywords: error.missing name=BODY301_RADII"),
    (less(f"CLOCK_ET_-85_{made_cubes.CLOCK}_COMPUTED"), "csm.clock"),
]


@pytest.mark.parametrize(("made", "said"), FAULTS, ids=[said for _, said in FAULTS])
def test_what_is_wrong_with_a_cube_is_named(tmp_path, made, said):
    path = made_cubes.cube(tmp_path / "a.cub", **made)
    with refused(said) as caught:
        read_cube(path)
    assert caught.value.file == path


def test_a_cube_that_ends_too_early(tmp_path):
    path = made_cubes.cube(tmp_path / "a.cub")
    data = path.read_bytes()
    path.write_bytes(data[:-8])
    with refused("csm.short"):
        read_cube(path)
    path.write_bytes(data[:500])
    with refused("csm.label"):
        read_cube(path)


def test_hermite_positions_need_velocities(tmp_path):
    tables = columns("InstrumentPosition", "J2000XV", "J2000YV", "J2000ZV")["tables"]
    path = made_cubes.cube(tmp_path / "a.cub", tables=tables)
    assert read_positions(read_label(path), path).velocities is None
    tables["InstrumentPosition"][2]["CacheType"] = "HermiteSpline"
    path = made_cubes.cube(tmp_path / "b.cub", tables=tables)
    with refused("csm.velocities"):
        read_positions(read_label(path), path)
    assert len(read_turns(read_label(path), "BodyRotation", path).times) == 21


def test_serial_numbers_by_rule(tmp_path):
    path = made_cubes.cube(tmp_path / "a.cub")
    assert serial_number(read_label(path), path) == "LRO/1/269182000:51104/NACL"
    apollo = {
        "SpacecraftName": '"APOLLO 15"',
        "InstrumentId": "METRIC",
        "StartTime": "1971-07-31T01:24:36.970",
    }
    path = made_cubes.cube(tmp_path / "b.cub", instrument=apollo)
    assert serial_number(read_label(path), path) == "APOLLO15/METRIC/1971-07-31T01:24:36.970"
    path = made_cubes.cube(tmp_path / "c.cub", instrument=apollo | {"InstrumentId": "PANORAMIC"})
    with refused("csm.serial instrument=PANORAMIC spacecraft=APOLLO 15"):
        serial_number(read_label(path), path)


def test_a_list_has_cubes_and_isds(tmp_path):
    made_cubes.cube(tmp_path / "left.cub")
    written(tmp_path, made_cubes.isd(), "right.json")
    listed = tmp_path / "images.lis"
    listed.write_text("# a pair\nleft.cub\n\nLRO/1/269182000:51104/NACR, right.json\n")
    found = read_list(listed)
    assert found == {
        "LRO/1/269182000:51104/NACL": tmp_path / "left.cub",
        "LRO/1/269182000:51104/NACR": tmp_path / "right.json",
    }
    assert [read_support(path).kind for path in found.values()] == ["line", "line"]


@pytest.mark.parametrize(
    ("text", "record", "said"),
    [
        ("left.cub\nright.json\n", 2, "csm.isd-serial"),
        ("left.cub\nA, none.json\n", 2, "csm.file name=none.json"),
        ("none.cub\n", 1, "csm.file name=none.cub"),
        ("A, left.cub\nA, right.json\n", 2, "format.repeated what=serial number name=A"),
        ("# nothing\n", None, "format.missing what=images"),
    ],
)
def test_what_is_wrong_with_a_list_is_named(tmp_path, text, record, said):
    made_cubes.cube(tmp_path / "left.cub")
    written(tmp_path, made_cubes.isd(), "right.json")
    listed = tmp_path / "images.lis"
    listed.write_text(text)
    with refused(said) as caught:
        read_list(listed)
    assert (caught.value.file, caught.value.record) == (listed, record)


HOSTILE = ["NULL", '""', "x", "()", "(1, (2))", "-1", "0", "1e300", "9999999999999999", "2 <km>"]


def test_whatever_stands_in_a_label_is_understood_or_refused(tmp_path):
    path = made_cubes.cube(tmp_path / "a.cub")
    data = path.read_bytes()
    lines, rest = data[: made_cubes.LABEL].rstrip(b"\0").decode().split("\n"), data[made_cubes.LABEL :]
    known = 0
    for row, line in enumerate(lines):
        if " = " not in line:
            continue
        for hostile in HOSTILE:
            changed = [*lines[:row], f"{line.split(' = ')[0]} = {hostile}", *lines[row + 1 :]]
            path.write_bytes("\n".join(changed).encode().ljust(made_cubes.LABEL, b"\0") + rest)
            try:
                with np.errstate(all="ignore"):
                    own = SupportedImage(read_cube(path), "I", pixels="isis", interpolation="isis")
                    own.to_image(own.to_ground([100.0], [100.0]))
                known += 1
            except InputError:
                continue
            except Exception as error:
                raise AssertionError(f"{line} = {hostile}: {error!r}") from error
    assert known > 20
