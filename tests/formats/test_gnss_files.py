"""Positions of photos in files of other programs (`--gnss`): formats, systems, antennas, order of events."""

import json
import shutil
from datetime import datetime, timedelta

import numpy as np
import pytest

from formats.photographs import EXAMPLE, block_with_pictures, picture
from message_codes import refused
from photogram import InputError, LeverArm, Message, Position, Spheroid, adjust, formats
from photogram.formats import ReadOptions, read_metadata
from photogram.network import geographic_to_geocentric, local_frames

SD = (0.012, 0.011, 0.025)
ANTENNA = (0.05, 0.08, 0.12)
BEGIN = datetime(2024, 5, 17, 10, 7, 45)
MRK = "{}\t384233.385421\t[2264]\t -40,N\t 0,E\t 86,V\t{},Lat\t{},Lon\t{},Ellh\t0.011, 0.012, 0.025\t50,Q\n"
RTKLIB = (
    "% program   : RTKLIB ver.2.4.3\n% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,5:single)\n%  GPST"
    "                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)   sdu(m)  sdne(m)\n"
)


@pytest.fixture(autouse=True)
def _libraries():
    pytest.importorskip("pyproj")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Make a plain project without positions, the same as a COLMAP model, and the places of its photos."""
    folder = tmp_path_factory.mktemp("gnss")
    truth, places = block_with_pictures(folder / "plain", errors=SD, write=lambda *_: None)
    (folder / "colmap").mkdir()
    for name, content in formats.to_files(formats.read(folder / "plain"), "colmap").items():
        (folder / "colmap" / name).write_bytes(content)
    return folder, truth, places


def pix4d(places, sd=SD):
    rows = (f"{name}.JPG,{y!r},{x!r},{z!r},{sd[0]},{sd[2]}" for name, (x, y, z) in places.items())
    return "reference.csv", "\n".join(rows)


def metashape(places, sd=SD):
    rows = (f"{name},{x!r},{y!r},{z!r},{sd[0]},{sd[1]},{sd[2]}" for name, (x, y, z) in places.items())
    head = "# CoordinateSystem: EPSG:4979\n#Label,X/Longitude,Y/Latitude,Z/Altitude,X_acc,Y_acc,Z_acc\n"
    return "reference.txt", head + "\n".join(rows)


def odm(places, sd=SD):
    rows = (f"{name}.JPG {x!r} {y!r} {z!r} 0 0 0 {sd[0]} {sd[2]}" for name, (x, y, z) in places.items())
    return "positions.txt", "EPSG:4979\n" + "\n".join(rows)


def rtklib(places, sd=SD, extra=0):
    lines = []
    rows = [*places.values()] + [(8.5, 47.4, 500.0)] * extra
    for k, (x, y, z) in enumerate(rows):
        time = (BEGIN + timedelta(seconds=3 * k)).strftime("%Y/%m/%d %H:%M:%S")
        lines.append(f"{time}.123 {y!r} {x!r} {z!r} 1 12 {sd[1]} {sd[0]} {sd[2]} 0.002\n")
    return "flight_events.pos", RTKLIB + "".join(reversed(lines))


def mrk(places, sd=SD):
    return "100_0101_Timestamp.MRK", "".join(
        MRK.format(int(name[-4:]), *(repr(value) for value in (y, x, z)))
        for name, (x, y, z) in places.items()
    )


def plain(places, sd=SD):
    rows = (f"{name};{x!r};{y!r};{z!r};{sd[0]};{sd[1]};{sd[2]}" for name, (x, y, z) in places.items())
    return "table.csv", "image;longitude;latitude;height;sd_x;sd_y;sd_z\n" + "\n".join(rows)


PROGRAMS = {each.__name__: each for each in (pix4d, metashape, odm, rtklib, mrk, plain)}


def written(folder, made):
    name, text = made
    (folder / name).write_text(text)
    return folder / name


def positions(project):
    return {each.photo: each for each in project.block.observations if isinstance(each, Position)}


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("project", ["plain", "colmap"])
def test_positions_of_each_program_adjust_a_model_and_a_plain_project(tmp_path, flown, program, project):
    folder, truth, places = flown
    path = written(tmp_path, PROGRAMS[program](places))
    crs = "EPSG:4979" if program in ("pix4d", "plain") else None
    read = formats.read(folder / project, ReadOptions(sd={"images": (0.5,)}, gnss=path, gnss_crs=crs))
    found = positions(read)
    assert {name.partition(".")[0] for name in found} == set(places)
    back, turned = formats.from_frame(
        "EPSG:4979",
        np.array([each.position for each in found.values()]),
        np.array([each.covariance for each in found.values()]),
        read.frame,
    )
    np.testing.assert_allclose(back, [places[name.partition(".")[0]] for name in found], rtol=0, atol=1e-4)
    horizontal = 0.012 if program in ("pix4d", "odm") else 0.011
    expected = np.tile((0.012, horizontal, 0.025), (len(found), 1))
    np.testing.assert_allclose(np.sqrt(np.diagonal(turned, axis1=1, axis2=2)), expected, rtol=2e-3)
    result = adjust(read.block)
    assert result.converged
    baselines = [
        np.linalg.norm(np.diff(each, axis=0), axis=1)
        for each in (result.photo_positions, truth.photo_positions)
    ]
    np.testing.assert_allclose(baselines[0], baselines[1], atol=0.15)


def test_systems_of_coordinates_are_those_of_the_option(tmp_path, flown):
    folder, _, places = flown
    from photogram.formats import Frame, from_frame, to_frame

    earth, turned, _ = to_frame(
        "EPSG:4979", np.array([*places.values()]), np.zeros((len(places), 3, 3)), Frame("geocentric")
    )
    utm, _ = from_frame("EPSG:32632", earth, turned, Frame("geocentric"))
    rows = (f"{name}.JPG,{x!r},{y!r},{z!r}" for name, (x, y, z) in zip(places, utm.tolist(), strict=True))
    path = written(tmp_path, ("utm.csv", "\n".join(rows)))
    options = ReadOptions(sd={"gnss": (0.02, 0.02, 0.04)}, gnss=path, gnss_crs="EPSG:32632")
    found = positions(formats.read(folder / "plain", options))
    geographic = written(tmp_path, pix4d(places))
    other = positions(formats.read(folder / "plain", ReadOptions(gnss=geographic, gnss_crs="EPSG:4979")))
    apart = [np.linalg.norm(np.subtract(found[each].position, other[each].position)) for each in found]
    assert max(apart) < 0.1  # the origin of the frame differs by centimetres
    with pytest.raises(InputError, match="--gnss-crs"):
        formats.read(folder / "plain", ReadOptions(gnss=geographic))


def test_positions_without_a_system_are_in_the_frame_of_the_project(tmp_path, flown):
    folder, truth, _ = flown
    rows = (
        f"{name},{x!r},{y!r},{z!r}"
        for name, (x, y, z) in zip(truth.block.photo_ids, truth.photo_positions.tolist(), strict=True)
    )
    path = written(tmp_path, ("local.csv", "photo,x,y,z\n" + "\n".join(rows)))
    options = ReadOptions(sd={"gnss": (0.02,)}, gnss=path)
    project = formats.read(folder / "plain", options)
    assert project.frame.kind == "cartesian"
    np.testing.assert_array_equal(
        [each.position for each in positions(project).values()], truth.photo_positions
    )
    result = adjust(project.block)
    np.testing.assert_allclose(result.photo_positions, truth.photo_positions, atol=0.1)
    model = formats.read(folder / "plain")
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    from photogram.formats.models import carried

    moved = carried(model, (0.1, turn, np.array([3.0, 4, 5])), model.frame, Message(""))
    (tmp_path / "moved").mkdir()
    for name, content in formats.to_files(moved, "colmap").items():
        (tmp_path / "moved" / name).write_bytes(content)
    result = adjust(formats.read(tmp_path / "moved", options).block)
    np.testing.assert_allclose(result.photo_positions, truth.photo_positions, atol=0.1)


@pytest.mark.parametrize("sd", [0.0, 0.01, np.inf])
def test_an_antenna_has_a_lever_arm(tmp_path, flown, sd):
    folder, _, places = flown
    path = written(tmp_path, plain(places))
    options = ReadOptions(gnss=path, gnss_crs="EPSG:4979", gnss_antenna=(*ANTENNA, sd))
    arms = [each.lever_arm for each in positions(formats.read(folder / "plain", options)).values()]
    if sd == 0.0:
        np.testing.assert_array_equal(arms, [ANTENNA] * len(arms))
        return
    assert all(each is arms[0] for each in arms)
    assert isinstance(arms[0], LeverArm)
    np.testing.assert_array_equal(arms[0].position, ANTENNA)
    np.testing.assert_array_equal(arms[0].deviations, [sd] * 3)


def test_events_belong_to_photos_in_their_order_and_must_be_as_many(tmp_path, flown):
    folder, _, places = flown
    path = written(tmp_path, rtklib(places, extra=1))
    with pytest.raises(InputError, match=r"7 events.*got 6") as caught:
        formats.read(folder / "plain", ReadOptions(gnss=path))
    assert caught.value.file == path


def test_events_belong_to_all_pictures_of_a_folder_by_their_times(tmp_path, flown):
    image = pytest.importorskip("PIL.Image")
    folder, _, places = flown
    # The names are not in the order of the times, and one picture is not in the project.
    names = [*reversed(places), "DJI_0107"]
    for k, name in enumerate(names):
        exif = image.Exif()
        time = BEGIN + timedelta(seconds=3 * k + 2 * 3600)
        exif.get_ifd(0x8769)[0x9003] = time.strftime("%Y:%m:%d %H:%M:%S")
        (tmp_path / "photos").mkdir(exist_ok=True)
        image.new("RGB", (16, 12)).save(tmp_path / "photos" / f"{name}.JPG", exif=exif)
    rows = {name: places.get(name, (8.5, 47.4, 500.0)) for name in names}
    path = written(tmp_path, rtklib(rows))
    options = ReadOptions(gnss=path, photos_dir=tmp_path / "photos")
    project = formats.read(folder / "plain", options)
    found = positions(project)
    back, _ = formats.from_frame(
        "EPSG:4979", np.array([each.position for each in found.values()]), np.zeros((6, 3, 3)), project.frame
    )
    np.testing.assert_allclose(back, [places[name] for name in found], rtol=0, atol=1e-6)
    path.write_text(path.read_text().replace("10:07:54", "10:08:59"))
    with refused("photos.interval") as caught:
        formats.read(folder / "plain", options)
    assert caught.value.record is not None


def test_events_in_weeks_and_in_degrees_minutes_seconds(tmp_path):
    from photogram.formats.metadata.record import is_events, read_events

    path = tmp_path / "a_events.pos"
    path.write_text(
        "% (lat/lon/height=WGS84/geodetic,Q=1:fix)\n"
        "%  GPST latitude(d'\") longitude(d'\") height(m) Q ns sdn(m)\n"
        "2264 384233.500  47 22 48.0  -8 32 24.0  551.2  2  9  0.02 0.03 0.05\n"
    )
    assert is_events(path)
    ((seconds, said),) = read_events(path)
    assert seconds == 2264 * 604800 + 384233.5
    assert said.position == pytest.approx((-8.54, 47.38, 551.2))
    assert (said.sd, said.fix, said.heights) == (
        (0.03, 0.02, 0.05),
        "float",
        "above sea level",
    )
    for old, new in (("2264 ", "x "), ("latitude(d'\")", "e-baseline(m)"), ("551.2", "high"), (" 0.05", "")):
        other = tmp_path / "b_events.pos"
        other.write_text(path.read_text().replace(old, new))
        with pytest.raises(InputError) as caught:
            read_events(other)
        assert caught.value.record is not None


def test_geocentric_events_are_the_same_positions_with_their_covariances(tmp_path):
    from photogram.formats.metadata.record import is_events, read_events

    place = [*np.radians([8.54, 47.38]).tolist(), 551.2]
    [xyz] = geographic_to_geocentric([place], Spheroid.wgs84())
    [axes] = local_frames([place])
    matrix = axes.T @ np.diag([0.03**2, 0.02**2, 0.05**2]) @ axes
    pairs = [matrix[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
    words = [f"{value:.6f}" for value in [*xyz, *np.sign(pairs) * np.sqrt(np.abs(pairs))]]
    path = tmp_path / "a_events.pos"
    path.write_text(
        "% (x/y/z-ecef=WGS84,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp,ns=# of satellites)\n"
        "%  GPST                      x-ecef(m)      y-ecef(m)      z-ecef(m)   Q  ns   sdx(m)   sdy(m)"
        "   sdz(m)  sdxy(m)  sdyz(m)  sdzx(m) age(s)  ratio\n"
        f"2024/05/17 10:07:45.500 {' '.join(words[:3])} 1 12 {' '.join(words[3:])} 0.00 3.5\n"
    )
    assert is_events(path)
    ((_, said),) = read_events(path)
    np.testing.assert_allclose(said.position, (8.54, 47.38, 551.2), rtol=0, atol=2e-6)
    assert said.position[2] == pytest.approx(551.2, abs=2e-6)
    np.testing.assert_allclose(said.sd, (0.03, 0.02, 0.05), rtol=1e-3)
    assert (said.fix, said.heights) == ("fixed", "")
    text = path.read_text()
    path.write_text(text.replace(" ".join(words[:3]), "0 0 0"))
    assert read_events(path)[0][1].position is None
    path.write_text(text.replace(f" {words[-1]} 0.00 3.5", ""))
    with refused("format.words n=12"):
        read_events(path)


def test_positions_of_a_file_replace_those_of_the_project(tmp_path, flown):
    folder, _, places = flown
    shutil.copytree(folder / "plain", tmp_path / "own")
    (tmp_path / "own" / "gnss.csv").write_text("photo,x,y,z,sd\nDJI_0103,1,2,3,0.5\nDJI_0104,1,2,3,0.5\n")
    toml = tmp_path / "own" / "project.toml"
    toml.write_text(toml.read_text() + '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 554.0]\n')
    some = {name: place for name, place in places.items() if name != "DJI_0104"}
    path = written(tmp_path, plain(some))
    found = positions(formats.read(tmp_path / "own", ReadOptions(gnss=path, gnss_crs="EPSG:4979")))
    assert len(found) == 6
    np.testing.assert_array_equal(found["DJI_0104"].position, (1, 2, 3))
    assert np.linalg.norm(found["DJI_0103"].position) > 10


def test_the_commands_have_the_options(run, tmp_path, flown):
    folder, _, places = flown
    path = written(tmp_path, plain(places))
    words = ("--gnss", path, "--gnss-crs", "EPSG:4979", "--gnss-antenna", "0.05,0.08,0.12,0.01")
    done = run("adjust", folder / "plain", *words, "--out", "out", "--no-html", "--json", "a.json")
    assert done.exit_code == 0, done.output
    assert "position" in json.dumps(json.loads((tmp_path.cwd() / "a.json").read_text()))
    for command in ("info", "check"):
        assert run(command, folder / "plain", *words).exit_code == 0
    assert run("convert", folder / "plain", "converted", *words).exit_code == 0
    for wrong in (("--gnss-crs", "EPSG:4979"), ("--gnss", path, "--gnss-antenna", "1,2"), ("--mrk-antenna",)):
        assert run("info", folder / "plain", *wrong).exit_code == 2
    before = path.read_bytes()
    assert run("info", folder / "plain", *words, "--json", path).exit_code == 1
    assert path.read_bytes() == before


UNUSABLE = {
    "missing.csv": None,
    "folder": "",
    "empty.csv": b"",
    "empty.MRK": b"",
    "empty.pos": b"",
    "zeros.csv": bytes(4000),
    "binary.csv": np.random.default_rng(3).bytes(5000),
    "binary.MRK": np.random.default_rng(4).bytes(5000),
    "binary.xlsx": np.random.default_rng(5).bytes(5000),
    "photo.jpg": b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(range(256)),
}


@pytest.mark.parametrize("name", UNUSABLE)
@pytest.mark.parametrize("command", ["info", "adjust", "convert", "check"])
def test_an_unusable_file_is_named_and_nothing_is_written(run, tmp_path, command, name):
    content = UNUSABLE[name]
    if content == "":
        (tmp_path / name).mkdir()
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    before = sorted(tmp_path.rglob("*"))
    own = {"convert": ["out"], "adjust": ["--out", "out", "--json", "a.json"]}.get(command, [])
    done = run(command, EXAMPLE, *own, "--gnss", name)
    assert done.exit_code == 1, done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)
    assert f"error: {name}" in done.stderr
    assert sorted(tmp_path.rglob("*")) == before


TIE_POINTS = {
    "rows": "DJI_0101.JPG,17,103.5,82.1\nDJI_0101.JPG,18,203.5,92.1\nDJI_0102.JPG,17,113.5,81.1\n",
    "header": "photo,point,column,row\nDJI_0101.JPG,17,103.5,82.1\nDJI_0102.JPG,17,113.5,81.1\n",
    "ground": "image,point,x,y,z\nDJI_0101.JPG,17,1,2,3\nDJI_0102.JPG,18,4,5,6\n",
    "points": "point,x,y,z\n17,1,2,3\n18,4,5,6\n",
    "markers": "# CoordinateSystem: LOCAL\n#Label,X/Easting,Y/Northing,Z/Altitude\ntarget 1,1,2,3\n",
}


@pytest.mark.parametrize("kind", TIE_POINTS)
def test_tie_points_and_points_are_no_positions_of_photos(tmp_path, kind):
    pytest.importorskip("PIL")
    for name in ("DJI_0101", "DJI_0102"):
        picture(tmp_path / f"{name}.JPG")
    (tmp_path / "table.csv").write_text(TIE_POINTS[kind])
    found = read_metadata(tmp_path)
    assert not any(each.position for each in found.photos.values())
    assert not found.tables


@pytest.mark.parametrize("kind", ["rows", "header", "ground", "points"])
def test_a_file_without_positions_is_rejected(tmp_path, flown, kind):
    path = written(tmp_path, ("table.csv", TIE_POINTS[kind]))
    with pytest.raises(InputError) as caught:
        formats.read(EXAMPLE, ReadOptions(gnss=path))
    assert caught.value.file == path
