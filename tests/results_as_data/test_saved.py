"""Results as data: written as Parquet, read again, and the same in everything they say."""

import hashlib
import json
import math
from dataclasses import fields

import numpy as np
import pytest

from fuzz.networks import random_network
from message_codes import refused
from photogram import (
    Camera,
    Distance,
    InnerConstraints,
    InputError,
    LeverArm,
    Position,
    Refraction,
    Result,
    Spheroid,
    adjust,
    formats,
    read_result,
    simulate,
)
from photogram import collection as collections
from photogram.arguments.fields import check_members
from photogram.io.seals import seal
from photogram.network import Level, OnLevel, Shift
from photogram.results.parts import AdjustedCamera

parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")

EXAMPLE = formats.__path__[0].replace("formats", "examples/project")


def observed_block():
    """Make a geographic block with observations that share unknowns, refraction and a free camera."""
    lens = {"c": -152.74, "xp": 0.0, "yp": 0.0}
    block = simulate(
        strips=2,
        photos_per_strip=4,
        points_per_photo=30,
        seed=12,
        spheroid=Spheroid.wgs84(),
        origin=(-1.65, 0.52, 10.0),
        refraction=Refraction(air="standard"),
        cameras=[Camera("brown", lens, name="RMK")],
        start_cameras=[Camera("brown", lens, sd={"xp": 0.01, "c": math.inf}, name="RMK")],
        position_sd=0.05,
    ).block
    lever, shift = LeverArm("antenna", [0.1, 0.2, 1.0], 0.02), Shift("flight", 0.0, [0.1, 0.1, math.inf])
    level = Level("lake", height=12.0)
    points = [block.point_ids[row] for row in block.image_points[:6].tolist()]
    return block.replace(
        observations=[
            *(
                Position(photo, place, sd=0.1, lever_arm=lever, shift=shift)
                for photo, place in zip(block.photo_ids, block.photo_positions, strict=True)
            ),
            Distance(points[0], points[1], length=400.0, sd=500.0),
            *(OnLevel(point, level, sd=200.0) for point in points[:4]),
        ],
        title="shared unknowns",
    )


def example():
    return formats.read(EXAMPLE).block


BLOCKS = {
    "rectangular": lambda: adjust(
        simulate(strips=2, photos_per_strip=4, points_per_photo=25, control_spacing=2, seed=12).block
    ),
    "robust": lambda: adjust(
        simulate(strips=2, photos_per_strip=4, points_per_photo=25, blunders=2, seed=5).block, loss="huber"
    ),
    "free": lambda: adjust(
        simulate(strips=2, photos_per_strip=3, points_per_photo=25, control="none", seed=1).block,
        datum=InnerConstraints(),
    ),
    "without covariances": lambda: adjust(
        simulate(strips=2, photos_per_strip=3, points_per_photo=25, seed=1).block, covariance=False
    ),
    "observed": lambda: adjust(observed_block()),
    "project": lambda: adjust(example()),
    "collection": lambda: collections.adjust(collections.simulate().collection),
}


@pytest.fixture(scope="module", params=BLOCKS)
def pair(request, tmp_path_factory):
    """Return a result, the folder where it was written, and what is read from there."""
    result = BLOCKS[request.param]()
    folder = tmp_path_factory.mktemp("results") / "data"
    result.to_parquet(folder)
    return result, folder, read_result(folder)


def compare(one, two, place="result"):
    """Assert that two values are the same, to the last bit but for cofactors (half a unit of it)."""
    assert type(one) is type(two), place
    if isinstance(one, np.ndarray):
        assert one.dtype == two.dtype, place
        exact = not place.endswith(("photo_cofactors", "point_cofactors"))
        (np.testing.assert_array_equal if exact else _close)(one, two, err_msg=place)
    elif hasattr(one, "__dataclass_fields__"):
        for each in fields(one):
            compare(getattr(one, each.name), getattr(two, each.name), f"{place}.{each.name}")
    elif isinstance(one, dict):
        assert list(one) == list(two), place
        for name in one:
            compare(one[name], two[name], f"{place}[{name}]")
    elif isinstance(one, list | tuple):
        assert len(one) == len(two), place
        for row, (first, second) in enumerate(zip(one, two, strict=True)):
            compare(first, second, f"{place}[{row}]")
    elif hasattr(one, "__getnewargs__") and not isinstance(one, str | float | int):
        assert one.__getnewargs__() == two.__getnewargs__()
    else:
        assert one == two or (one != one and two != two), place


def _close(one, two, err_msg):
    rows, columns = np.tril_indices(one.shape[1])
    lower = [each[:, rows, columns] for each in (one, two)]
    np.testing.assert_allclose(*lower, rtol=3e-16, atol=0, err_msg=err_msg)
    # What rounding has made unsymmetric is symmetric now.
    sd = np.sqrt(np.diagonal(one, axis1=1, axis2=2))
    np.testing.assert_allclose(two, one, rtol=0, atol=1e-9 * float(np.nanmax(sd, initial=0)) ** 2)


def test_what_is_read_is_what_was_written(pair):
    result, _, again = pair
    compare(result, again)
    for each in ("photo_covariances", "point_covariances"):
        one, two = (getattr(own, each) for own in (again, result))
        lower = np.tril_indices(one.shape[1])
        np.testing.assert_array_equal(one[:, *lower], two[:, *lower])
    np.testing.assert_array_equal(again.point_sd, result.point_sd)
    if isinstance(result, Result):
        one, two = (own.photo_rotation_covariances for own in (again, result))
        sd = np.sqrt(np.diagonal(two, axis1=1, axis2=2))
        assert np.all(np.isnan(two) | (abs(one - two) <= 1e-15 * sd[:, :, np.newaxis] * sd[:, np.newaxis]))


def test_it_says_the_same(pair):
    result, _, again = pair
    assert again.report() == result.report()
    assert again.verdict == result.verdict
    for name in ("photo", "point", "image", "control", "station"):
        one, two = (getattr(each, f"{name}_table")() for each in (result, again))
        assert one.equals(two)


@pytest.mark.parametrize("number", range(0, 42, 3))
def test_random_networks_of_every_kind_come_back(number, tmp_path):
    network = random_network(5, number)
    result = adjust(network.block, datum=network.datum)
    result.to_parquet(tmp_path)
    again = read_result(tmp_path)
    compare(result, again)
    assert again.report() == result.report()


def test_unknowns_in_common_are_one_object_again():
    result = BLOCKS["observed"]()
    assert len(result.block.unknowns) == 3


def test_covariances_of_anything_are_asked_of_what_was_read(tmp_path):
    result = BLOCKS["observed"]()
    result.to_parquet(tmp_path)
    again = read_result(tmp_path)
    ask = [("photo", again.block.photo_ids[0]), ("unknown", "flight"), ("camera", "RMK")]
    np.testing.assert_array_equal(again.covariance(ask), result.covariance(ask))
    assert len(again.block.unknowns) == 3
    reliable, before = again.reliability(), result.reliability()
    np.testing.assert_array_equal(reliable.detectable, before.detectable)


def test_columns_say_unit_and_description(pair):
    _, folder, _ = pair
    tables = sorted(folder.glob("*.parquet"))
    assert {"photos", "points", "images", "control", "stations"} <= {path.stem for path in tables}
    for path in tables:
        for field in parquet.read_schema(path):
            said = field.metadata or {}
            assert b"description" in said, f"{path.stem}.{field.name}"
            number = "double" in str(field.type) or "int64" in str(field.type)
            if number and field.name not in ("photo", "point", "unknown"):
                assert b"unit" in said or folder_is_without_unit(folder), f"{path.stem}.{field.name}"
            assert " " not in field.name


def folder_is_without_unit(folder):
    """Whether lengths have none, as those of a collection."""
    return json.loads((folder / "summary.json").read_text())["kind"] == "collection"


def test_covariances_are_lower_triangles_in_the_order_that_they_say(pair):
    result, folder, _ = pair
    table = parquet.read_table(folder / "photos.parquet")
    field = table.schema.field("covariance")
    k = result.photo_cofactors.shape[1]
    assert field.type.list_size == k * (k + 1) // 2
    names = field.metadata[b"order"].decode().split()
    assert len(names) == k
    cells = np.array(table.column("covariance").to_pylist())
    matrix = result.photo_covariances[1]
    np.testing.assert_array_equal(cells[1], [matrix[i, j] for i in range(k) for j in range(i + 1)])
    for row, name in enumerate(names):
        np.testing.assert_array_equal(table.column(f"sd_{name}").to_numpy(), result.photo_sd[:, row])
    assert json.loads(table.schema.metadata[b"photogram.frame"])["kind"] == "cartesian"
    assert table.schema.metadata[b"photogram.scaled"] == b"covariance"


def test_angles_are_radians_and_names_have_no_units(tmp_path):
    result = BLOCKS["observed"]()
    result.to_parquet(tmp_path)
    photos = parquet.read_table(tmp_path / "photos.parquet")
    np.testing.assert_array_equal(photos.column("longitude").to_numpy(), result.photo_positions[:, 0])
    np.testing.assert_array_equal(photos.column("omega").to_numpy(), result.photo_attitudes[:, 0])
    assert photos.schema.field("omega").metadata[b"unit"] == b"rad"
    stations = parquet.read_table(tmp_path / "stations.parquet")
    np.testing.assert_allclose(
        stations.column("difference_longitude").to_numpy(), -result.stations.residuals[:, 0], rtol=1e-12
    )


def test_other_programs_read_it(tmp_path):
    pandas = pytest.importorskip("pandas")
    result = BLOCKS["project"]()
    result.to_parquet(tmp_path)
    images = pandas.read_parquet(tmp_path / "images.parquet")
    taken = images.groupby("photo", observed=True).size()
    assert taken["DJI_0101"] == np.count_nonzero(result.block.image_photos == 0)


def test_a_second_result_replaces_the_first_one_whole(tmp_path):
    first, second = BLOCKS["free"](), BLOCKS["rectangular"]()
    second.to_parquet(tmp_path)
    first.to_parquet(tmp_path)
    compare(first, read_result(tmp_path))
    assert parquet.read_metadata(tmp_path / "control.parquet").num_rows == 0


def test_what_cannot_be_written_whole_changes_nothing(tmp_path):
    result = BLOCKS["free"]()
    result.to_parquet(tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    (tmp_path / "state.parquet").unlink()
    (tmp_path / "state.parquet").mkdir()
    with pytest.raises((InputError, OSError)):
        BLOCKS["rectangular"]().to_parquet(tmp_path)
    (tmp_path / "state.parquet").rmdir()
    del before["state.parquet"]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


# Folders that are not what they should be


@pytest.fixture
def folder(tmp_path):
    BLOCKS["project"]().to_parquet(tmp_path)
    return tmp_path


def test_damaged_folders_are_refused_with_the_file(folder):
    with pytest.raises(InputError, match=r"nothing/summary\.json: the file must be readable"):
        read_result(folder / "nothing")
    images = folder / "images.parquet"
    whole = images.read_bytes()
    images.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"images\.parquet: the checksum must agree with summary"):
        read_result(folder)
    resealed(folder)
    with pytest.raises(InputError, match=r"images\.parquet: the file must be valid Parquet"):
        read_result(folder)
    table = parquet.read_table(folder / "points.parquet")
    images.write_bytes(whole)
    parquet.write_table(table.slice(1), folder / "points.parquet")
    resealed(folder)
    with pytest.raises(InputError, match=r"images\.parquet: the name '.*' must be in the table"):
        read_result(folder)
    parquet.write_table(table.drop_columns(["covariance"]), folder / "points.parquet")
    resealed(folder)
    with pytest.raises(InputError, match=r"points\.parquet: the column covariance is missing"):
        read_result(folder)


def resealed(folder, change=lambda document: None):
    """Give a folder a summary whose checksums are those of its tables: what only a program would do."""
    path = folder / "summary.json"
    document = json.loads(path.read_text())
    document["tables"] = {
        name: hashlib.sha256((folder / f"{name}.parquet").read_bytes()).hexdigest()
        for name in document["tables"]
    }
    change(document)
    document["sha256"] = seal(document)
    path.write_text(json.dumps(document))


@pytest.mark.parametrize(
    "table", ["photos", "points", "images", "state", "cameras", "control", "observations"]
)
def test_a_table_of_another_result_is_refused(folder, tmp_path_factory, table):
    other = tmp_path_factory.mktemp("other")
    result = read_result(folder)
    adjust(result.restarted(), loss="huber", unit_variance="unity").to_parquet(other)
    summary, others = (json.loads((each / "summary.json").read_text()) for each in (folder, other))
    assert others["input"] != summary["input"]  # it began where the first has ended
    (folder / f"{table}.parquet").write_bytes((other / f"{table}.parquet").read_bytes())
    same = summary["tables"][table] == others["tables"][table]
    if not same:
        with pytest.raises(InputError, match=rf"{table}\.parquet: the checksum must agree with"):
            read_result(folder)
    assert not same or table in ("control", "observations")
    (folder / f"{table}.parquet").unlink()
    with pytest.raises(InputError, match=rf"{table}\.parquet: the file must be readable"):
        read_result(folder)


def test_the_input_of_a_result_is_known_again(tmp_path):
    block = BLOCKS["rectangular"]().block
    inputs = []
    for name, changed in (
        ("one", block),
        ("two", block),
        ("other", block.replace(image_sd=2 * block.image_sd)),
    ):
        adjust(changed, threads=1).to_parquet(tmp_path / name)
        inputs.append(json.loads((tmp_path / name / "summary.json").read_text())["input"])
    assert inputs[0] == inputs[1] != inputs[2]


@pytest.mark.parametrize(
    ("table", "column", "values"),
    [
        ("state", "unknown", "text"),
        ("points", "covariance", "text"),
        ("points", "covariance", "number"),
        ("photos", "corrections", "short"),
        ("images", "residual_x", "text"),
        ("points", "point", "number"),
        ("images", "photo", "number"),
    ],
)
def test_columns_that_hold_something_else_are_named(folder, table, column, values):
    pyarrow = pytest.importorskip("pyarrow")
    path = folder / f"{table}.parquet"
    found = parquet.read_table(path)
    rows = found.num_rows
    new = {
        "text": pyarrow.array(["a"] * rows),
        "number": pyarrow.array([1.0] * rows),
        "short": pyarrow.FixedSizeListArray.from_arrays(pyarrow.array([0.0] * 5 * rows), 5),
    }[values]
    parquet.write_table(found.set_column(found.schema.get_field_index(column), column, new), path)
    resealed(folder)
    with pytest.raises(InputError, match=rf"{table}\.parquet: the column {column} must contain"):
        read_result(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda document: document.update(format=1), "error.version version=1"),
        (
            lambda document: document.update(kind="other"),
            "format.unknown what=kind of the result value=other",
        ),
        (lambda document: document.pop("kept"), "adjusted.summary"),
        (lambda document: document["kept"]["block"].update(frame={"is": "Path"}), "document.class name=Path"),
        (lambda document: document["kept"]["block"].update(frame={"was": 1}), "document.kind"),
        (lambda document: document["kept"]["result"].update(loss={"same": 10**6}), "document.value"),
        (lambda document: document["kept"]["result"].update(dropped={"map": 3}), "document.value"),
        (
            lambda document: document["kept"].update(state={"tuple": []}),
            "error.content content=state of an adjustment",
        ),
        (lambda document: document["kept"]["result"].update(cameras=["x"]), "error.kind kind=AdjustedCamera"),
        (
            lambda document: document["kept"]["block"].update(point_ids="x"),
            "point_ids: error.kind kind=a list of names",
        ),
        (lambda document: document["kept"]["block"].update(other=1), "results.contradiction .*'other'"),
        (
            lambda document: document["kept"]["block"].pop("spheroid"),
            "results.contradiction reason='spheroid'",
        ),
    ],
)
def test_damaged_summaries_are_refused(folder, change, message):
    resealed(folder, change)
    with refused("summary.json", message):
        read_result(folder)


@pytest.mark.parametrize("name", ["summary.json", "photos.parquet", "images.parquet", "state.parquet"])
def test_damage_anywhere_is_refused_or_does_no_harm(folder, name):
    random = np.random.default_rng(8)
    path = folder / name
    whole = path.read_bytes()
    report = read_result(folder).report()
    for kind in range(60):
        damaged = bytearray(whole)
        place = int(random.integers(len(damaged)))
        if kind % 3 == 0:
            del damaged[place:]
        elif kind % 3 == 1:
            damaged[place] ^= int(random.integers(1, 256))
        else:
            del damaged[place : place + int(random.integers(1, 20))]
        path.write_bytes(damaged)
        try:
            again = read_result(folder)
        except InputError:
            continue
        assert again.report() == report


def test_a_number_does_not_stand_for_an_array():
    with pytest.raises(InputError, match="redundancy: must be an array of numbers, got 3"):
        check_members(AdjustedCamera, {"redundancy": 3})
