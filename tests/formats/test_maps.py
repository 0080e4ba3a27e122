"""Maps of results, against the geometry that they show and the programs that read them."""

import json
import re
import shutil
import sqlite3
import struct
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from test_plain_project import EXAMPLE, change
from test_results_in_a_system import FRAME, UTM

from message_codes import refused
from photogram import InputError, Spheroid, adjust, formats, read_result, simulate
from photogram.formats import placed
from photogram.formats.maps import map_layers, point_cloud
from photogram.formats.maps.files import LAYERS, style
from photogram.formats.maps.layers import chosen_crs
from photogram.words import phrase

geopandas = pytest.importorskip("geopandas", reason="geopandas is not installed")
pyogrio = pytest.importorskip("pyogrio", reason="pyogrio is not installed")
map_files = pytest.importorskip("photogram.formats.maps").map_files


@pytest.fixture(scope="module")
def project():
    return formats.read(EXAMPLE).replace(frame=FRAME)


@pytest.fixture(scope="module")
def result(project):
    return adjust(project.block)


@pytest.fixture(scope="module")
def wrong():
    """Adjust a block with a gross error and observed stations, without a place on the earth."""
    simulation = simulate(
        strips=2,
        photos_per_strip=4,
        points_per_photo=25,
        blunders=1,
        blunder_size=0.5,
        seed=12,
        position_sd=0.1,
    )
    return adjust(simulation.block), simulation


def layers(result, **options):
    return {each.name: each for each in map_layers(result, **options)}


def test_without_a_system_maps_are_in_utm_around_the_block(result):
    assert chosen_crs(result) == UTM
    found = layers(result)
    assert all(each.table.crs == UTM for each in found.values())
    np.testing.assert_allclose(
        np.column_stack(
            [
                found["points"].table.geometry.x,
                found["points"].table.geometry.y,
                found["points"].table.geometry.z,
            ]
        ),
        placed(result, UTM).points,
    )


@pytest.mark.parametrize("crs", [UTM, "EPSG:4979"])
def test_ellipses_are_those_of_the_covariances_at_the_stated_scale(result, crs):
    found = layers(result, crs=crs, scale=50.0)["point_ellipses"]
    assert found.title == "point_ellipses_x50"
    assert (found.table["scale"] == 50.0).all()
    metric = found.table.to_crs(UTM)
    centres = placed(result, UTM).points[:, :2]
    covariances = placed(result, UTM).point_covariances[:, :2, :2]
    for row, polygon in enumerate(metric.geometry):
        steps = (np.array(polygon.exterior.coords) - centres[row]) / 50.0
        assert len(steps) == 37
        forms = np.einsum("vi,ij,vj->v", steps, np.linalg.inv(covariances[row]), steps)
        # The quantile of chi-square; the plane's scale (-460 ppm) and its turn are within 2 percent.
        np.testing.assert_allclose(forms, 5.9915, rtol=0.02)


def test_of_many_ellipses_those_of_control_and_some_others_are_drawn(result, monkeypatch, tmp_path):
    own = layers(result)
    kinds = own["points"].table.set_index("point")["kind"]
    named = set(kinds.index[kinds != "pass"])
    most = len(named) + 8
    found = layers(result, most=most)["point_ellipses"]
    drawn = set(found.table["point"])
    assert named < drawn
    assert len(drawn) <= most
    assert found.left_out == len(own["point_ellipses"].table) - len(drawn) > 0
    assert f"of {len(drawn)} of {len(own['point_ellipses'].table)} points" in found.description
    assert own["point_ellipses"].left_out == 0
    assert len(layers(result, most=1)["point_ellipses"].table) == len(named) + 1
    monkeypatch.setitem(map_layers.__kwdefaults__, "most", most)
    remarks = map_files(result, tmp_path / "map.gpkg")[1]
    left_out = [each for each in remarks if each.code == "maps.left-out"]
    assert any(f"of {len(drawn)} of" in each.fields["content"] for each in left_out)


def test_vectors_lead_from_given_to_adjusted_places(result):
    found = layers(result, crs="ENU:47.38,8.54,450", scale=100.0)
    lines = found["control_residuals"].table
    block = result.block
    for name, line, d_e in zip(lines["point"], lines.geometry, lines["d_e"], strict=True):
        row = block.point_ids.index(name)
        start, end = np.array(line.coords)
        np.testing.assert_allclose(start, block.point_positions[row], atol=1e-6)
        moved = result.point_positions[row] - block.point_positions[row]
        np.testing.assert_allclose(end - start, 100 * moved, atol=1e-4)
        assert d_e == pytest.approx(moved[0], abs=1e-6)
    checks = found["check_residuals"].table
    assert checks["point"].tolist() == ["middle"]
    row = block.point_ids.index("middle")
    assert checks["length"][0] == pytest.approx(np.linalg.norm(result.point_differences[row]))


def test_footprints_hold_the_points_that_their_photos_show(result, project):
    found = layers(result, sizes=project.sizes)
    block, points = result.block, found["points"].table.set_index("point")
    for photo, shape in zip(
        found["footprints"].table["photo"], found["footprints"].table.geometry, strict=True
    ):
        assert shape.is_valid
        row = block.photo_ids.index(photo)
        own = block.image_points[block.image_photos == row]
        inside = [shape.buffer(10.0).contains(points.geometry[block.point_ids[point]]) for point in own]
        assert np.mean(inside) > 0.9
    size = found["footprints"].table["m_per_px"]
    np.testing.assert_allclose(size, 105 / 3620, rtol=0.06)


def test_photos_say_how_good_they_are(result):
    table = layers(result)["photos"].table.set_index("photo")
    own = result.block.image_photos == 1
    assert table["images"]["DJI_0102"] == own.sum()
    assert table["rms_px"]["DJI_0102"] == pytest.approx(np.sqrt(np.mean(result.residuals[own] ** 2)))
    np.testing.assert_allclose(table["sd_u"], np.sqrt(placed(result, UTM).photo_covariances[:, 2, 2]))


def test_suspicious_observations_are_where_they_are(wrong):
    found, simulation = wrong
    table = layers(found)["suspicious"].table
    worst = table.iloc[0]
    image = int(simulation.blunders.images[0])
    block = found.block
    assert worst["point"] == block.point_ids[block.image_points[image]]
    assert worst["photo"] == block.photo_ids[block.image_photos[image]]
    assert worst["beyond"]
    assert (worst["x"], worst["y"]) == tuple(block.image_xy[image])
    place = found.point_positions[block.image_points[image]]
    np.testing.assert_allclose([worst.geometry.x, worst.geometry.y, worst.geometry.z], place)
    # The observations of the table of tests: components with a redundancy number near 0 have no test.
    own = [(found.standardized, found.redundancy)]
    own += [(each.standardized, each.redundancy) for each in (found.stations, found.control)]
    expected = sum(int(np.count_nonzero((np.abs(w) > 3) & (shares > 0.01))) for w, shares in own)
    assert len(table) == expected


def test_a_geopackage_has_all_layers_with_their_styles(result, project, tmp_path):
    path = tmp_path / "quarry.gpkg"
    files, remarks = map_files(result, path, "EPSG:25832", sizes=project.sizes)
    assert (list(files), remarks) == ([path], [])
    path.write_bytes(files[path])
    names = [str(name) for name, _ in pyogrio.list_layers(path)]
    plain = [re.sub(r"_x\d+$", "", name) for name in names]
    assert plain == [*LAYERS, "layer_styles"]
    for name in names[:-1]:
        table = geopandas.read_file(path, layer=name)
        assert table.crs == "EPSG:25832"
        assert len(table)
    with sqlite3.connect(path) as base:
        rows = base.execute(
            "SELECT f_table_catalog, f_table_schema, f_table_name, f_geometry_column, styleQML, useAsDefault"
            " FROM layer_styles"
        ).fetchall()
        columns = dict(base.execute("SELECT table_name, column_name FROM gpkg_geometry_columns").fetchall())
    base.close()
    assert [row[2] for row in rows] == names[:-1]
    for catalog, schema, name, column, qml, default in rows:
        assert (catalog, schema, default) == ("", "", 1)
        assert columns[name] == column
        assert ElementTree.fromstring(qml.partition("\n")[2]).tag == "qgis"


def test_a_layer_without_anything_is_there_all_the_same(wrong, tmp_path):
    path = tmp_path / "map.gpkg"
    clean = adjust(simulate(strips=1, photos_per_strip=3, points_per_photo=20, check_points=0, seed=2).block)
    files, _ = map_files(clean, path)
    path.write_bytes(files[path])
    table = geopandas.read_file(path, layer=pyogrio.list_layers(path)[6][0])
    assert len(table) == 0
    assert "d_e" in table.columns


@pytest.mark.parametrize("name", LAYERS)
def test_a_style_draws_every_kind_of_its_layer(result, name):
    root = ElementTree.fromstring(style(name).partition("\n")[2])
    renderer = root.find("renderer-v2")
    symbols, attribute = LAYERS[name], renderer.get("attr")
    assert len(renderer.findall("symbols/symbol")) == len(symbols)
    kinds = {"Point": "marker", "LineString": "line", "Polygon": "fill"}
    table = layers(result)[name].table
    assert {kinds[each] for each in table.geom_type} <= {
        each.get("type") for each in renderer.findall("symbols/symbol")
    }
    if attribute:
        assert set(table[attribute]) <= {
            each.get("value") for each in renderer.findall("categories/category")
        }


def test_geojson_is_in_wgs_84_whatever_is_asked(result, tmp_path):
    files, remarks = map_files(result, tmp_path / "quarry.geojson", UTM)
    assert remarks == [phrase("maps.geojson", crs=UTM)]
    names = {path.name for path in files}
    assert {"quarry-photos.geojson", "quarry-photos.qml", "quarry-point_ellipses.geojson"} <= names
    document = json.loads(files[tmp_path / "quarry-photos.geojson"])
    assert "crs" not in document
    place = document["features"][0]["geometry"]["coordinates"]
    np.testing.assert_allclose(place, placed(result, "EPSG:4979").photos[0], atol=1e-8)


def test_a_map_without_a_place_says_so(wrong, tmp_path):
    for name in ("map.gpkg", "map.geojson"):
        files, remarks = map_files(wrong[0], tmp_path / name)
        assert remarks == [phrase("maps.no-crs", name=name)]
        for path, content in files.items():
            path.write_bytes(content)
    table = geopandas.read_file(tmp_path / "map.gpkg", layer="photos")
    assert table.crs is None
    np.testing.assert_allclose(table.geometry.x, wrong[0].photo_positions[:, 0])
    with refused("crs.results-place crs=EPSG:32632"):
        map_files(wrong[0], tmp_path / "map.gpkg", UTM)
    with refused("maps.suffix"):
        map_files(wrong[0], tmp_path / "map.shp")


def test_geographic_blocks_are_drawn_in_degrees_where_their_datum_is_unknown(tmp_path):
    origin = (np.radians(8.54), np.radians(47.38), 450.0)
    common = {"strips": 2, "photos_per_strip": 4, "points_per_photo": 25, "seed": 12, "origin": origin}
    known, unknown = (
        adjust(simulate(spheroid=each, **common).block) for each in (Spheroid.wgs84(), Spheroid.clarke_1866())
    )
    assert chosen_crs(known) == UTM
    assert chosen_crs(unknown) == ""
    drawn = layers(unknown, scale=1000.0)
    np.testing.assert_allclose(
        drawn["photos"].table.geometry.x, np.degrees(unknown.photo_positions[:, 0]), rtol=1e-12
    )
    width = drawn["point_ellipses"].table.geometry.bounds
    longest = 111_000 * (width["maxy"] - width["miny"]) / 2 / 1000.0
    table = drawn["point_ellipses"].table
    assert (longest <= table["a"] * 1.01).all()
    assert (longest >= table["b"] * 0.99).all()


# Point clouds


def vertices(content):
    """Return header and rows of a point cloud, read as its header says."""
    head, _, body = content.partition(b"end_header\n")
    lines = head.decode("ascii").splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    codes = {"double": "d", "float": "f", "ushort": "H"}
    fields = [line.split()[1:] for line in lines if line.startswith("property")]
    form = struct.Struct("<" + "".join(codes[kind] for kind, _ in fields))
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex"))
    assert len(body) == count * form.size
    rows = list(form.iter_unpack(body))
    return lines, {name: np.array([row[k] for row in rows]) for k, (_, name) in enumerate(fields)}


def test_a_point_cloud_has_deviations(result):
    lines, found = vertices(point_cloud(result, origin=(10.0, 20.0, 0.0)))
    used = result.used_points
    np.testing.assert_array_equal(found["x"], result.point_positions[used, 0] - 10.0)
    np.testing.assert_allclose(found["sd_z"], result.point_sd[used, 2], rtol=1e-6)
    largest = np.sqrt(np.linalg.eigvalsh(result.point_covariances[used])[:, -1])
    np.testing.assert_allclose(found["sd_max"], largest, rtol=1e-6)
    np.testing.assert_array_equal(found["rays"], result.point_rays[used])
    assert "comment origin 10.0 20.0 0.0 was taken away" in lines
    assert any("topocentric" in line and "unit m" in line for line in lines)


def test_a_point_cloud_is_in_the_system_asked_for(result):
    lines, found = vertices(point_cloud(result, placed(result, UTM)))
    np.testing.assert_array_equal(found["y"], placed(result, UTM).points[:, 1])
    assert any("EPSG:32632" in line for line in lines)
    with pytest.raises(InputError, match="has degrees"):
        point_cloud(result, placed(result, "EPSG:4979"))


# Commands


def test_the_page_of_maps_runs(run):
    page = (Path(__file__).parents[2] / "docs" / "maps.md").read_text(encoding="utf-8")
    shutil.copytree(EXAMPLE, "quarry")
    change(
        Path("quarry/project.toml"), "[frame]", '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 450.0]'
    )
    for block in re.findall(r"```console\n(.*?)```", page, re.DOTALL):
        for line in block.splitlines():
            words = line.split()
            assert words[:2] == ["$", "photogram"]
            done = run(*words[2:])
            assert done.exit_code == 0, done.output
    for block in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(block, {})
    assert geopandas.read_file("quarry.gpkg", layer="photos").crs == "EPSG:25832"
    assert Path("quarry.ply").read_bytes()[:3] == b"ply"


def test_commands_draw_maps_and_clouds(run):
    done = run("giant", "--example", "--map", "bay.geojson", "--ply", "bay.ply")
    assert done.exit_code == 0, done.output
    assert "bay.geojson has no coordinate reference system" in " ".join(done.output.split())
    assert len(json.loads(Path("bay-photos.geojson").read_text())["features"]) == 20
    done = run("adjust", "--example", "--map", "map.shp")
    assert done.exit_code == 1
    assert ".gpkg, .geojson" in done.output
    assert not Path("example-adjusted").exists()


def test_collections_have_clouds_too(run):
    done = run(
        "collection", "--example", "--ply", "ring.ply", "--ply-origin", "1", "2", "3", "--parquet", "data"
    )
    assert done.exit_code == 0, done.output
    lines, found = vertices(Path("ring.ply").read_bytes())
    result = read_result("data")
    used = result.used_points
    np.testing.assert_array_equal(found["z"], result.point_positions[used, 2] - 3.0)
    np.testing.assert_allclose(found["sd_x"], result.point_sd[used, 0], rtol=1e-6)
    assert "comment origin 1.0 2.0 3.0 was taken away" in lines
