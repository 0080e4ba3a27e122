"""Positions that photographs carry, in a project: precedence, heights, groups, the way to the report."""

import shutil
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

from example_scripts import load
from formats.photographs import EXAMPLE, ORIGIN, block_with_pictures, dji, packet, picture, tags
from message_codes import refused
from photogram import Position, formats
from photogram.formats import ReadOptions, read_metadata
from photogram.formats.metadata.adding import located
from photogram.formats.metadata.merged import Photos
from photogram.formats.metadata.pictures import DOP_ALONE, RADIAL
from photogram.words import Phrase, option_sd

MRK = "{}\t384233.385421\t[2264]\t -40,N\t 0,E\t 86,V\t{},Lat\t{},Lon\t{},Ellh\t0.021, 0.022, 0.043\t50,Q\n"
PLACE = (8.5, 47.3, 500.0)


@pytest.fixture(autouse=True)
def _libraries():
    pytest.importorskip("PIL")
    pytest.importorskip("pyproj")


@pytest.fixture
def flown(tmp_path):
    """Make a block with pictures of RTK: the folder, its result without errors, longitudes .. heights."""
    return tmp_path / "block", *block_with_pictures(tmp_path / "block")


def adjusted(folder, **kinds):
    """Read a block with positions of its pictures."""
    sd = kinds.pop("sd", {})
    return formats.read(folder, ReadOptions(sd=sd, photos_dir=folder / "photos", **kinds))


def positions(project):
    return {each.photo: each for each in project.block.observations if isinstance(each, Position)}


def fields(project, code):
    """Return the fields of the only message with a code."""
    (own,) = [each.phrase.fields for each in project.messages if each.code == code]
    return own


def test_positions_of_pictures_are_observations_with_their_own_deviations(run, flown):
    folder, truth, _ = flown
    project = adjusted(folder)
    found = positions(project)
    assert set(found) == set(project.block.photo_ids)
    assert project.frame.kind == "topocentric"
    np.testing.assert_allclose(
        np.sqrt(np.diag(found["DJI_0101"].covariance)), (0.012, 0.011, 0.025), rtol=1e-6
    )
    observed = fields(project, "photos.observed")
    assert observed == {"n": 6, "positions": "6 of XMP", "deviations": ["6 of XMP"]}
    done = run("adjust", folder, "--photos-dir", folder / "photos", "--out", "out", "--no-html")
    assert done.exit_code == 0, done.output
    assert "Accepted" in done.output
    assert "standard deviations: 6 of XMP" in Path("out/report.txt").read_text()
    assert truth.converged


def test_flights_of_rtk_have_a_shift_and_a_lever_arm_in_common(flown):
    folder, *_ = flown
    (folder / "photos" / "b").mkdir()
    for name in ("DJI_0101", "DJI_0102"):
        shutil.move(folder / "photos" / f"{name}.JPG", folder / "photos" / "b")
    found = positions(adjusted(folder))
    assert {each.shift.name for each in found.values()} == {"photos", "b"}
    assert found["DJI_0101"].shift is found["DJI_0102"].shift is not found["DJI_0103"].shift
    for each in found.values():
        np.testing.assert_array_equal(each.shift.deviations, [0.05] * 3)
        np.testing.assert_array_equal(each.lever_arm.deviations, [0.01] * 3)
        assert not each.shift.position.any()
        assert not each.lever_arm.position.any()


def test_positions_without_rtk_have_nothing_in_common(tmp_path):
    def write(path, longitude, latitude, height):
        picture(path, gps=tags(longitude, latitude, height - 47.0, tag_31=3.0))

    block_with_pictures(tmp_path, write=write)
    found = positions(adjusted(tmp_path, photos_crs="EPSG:4326+geoid=47"))
    for each in found.values():
        assert each.shift is None
        assert not np.any(each.lever_arm)
    sd = np.sqrt(np.diag(found["DJI_0101"].covariance))
    np.testing.assert_allclose(sd, np.array([1, 1, 2]) * 3 / np.sqrt(2), rtol=1e-6)


def test_heights_of_exif_need_a_word(tmp_path):
    def write(path, *place):
        picture(path, gps=tags(*place, tag_31=3.0))

    block_with_pictures(tmp_path, write=write)
    with refused("photos.height-kind option=--photos-crs"):
        adjusted(tmp_path)
    with refused("photos.wgs84 crs=EPSG:25832 option=--photos-crs"):
        adjusted(tmp_path, photos_crs="EPSG:25832")
    ellipsoidal, above = (
        positions(adjusted(tmp_path, photos_crs=crs))["DJI_0101"]
        for crs in ("EPSG:4979", "EPSG:4326+geoid=47")
    )
    assert np.linalg.norm(np.subtract(above.position, ellipsoidal.position)) < 1.0  # each amid its own photos
    heights = [
        adjusted(tmp_path, photos_crs=crs).frame.origin[2] for crs in ("EPSG:4979", "EPSG:4326+geoid=47")
    ]
    assert heights[1] - heights[0] == 47.0


def test_heights_of_two_kinds_are_refused_by_photos_of_both(tmp_path):
    picture(tmp_path / "a.jpg", xmp=packet(dji(*PLACE)))
    picture(tmp_path / "b.jpg", gps=tags(*PLACE, tag_31=3.0))
    found = read_metadata(tmp_path)
    for crs in (None, "EPSG:4326+geoid=47"):
        with refused("photos.heights one=above the ellipsoid first=['a.jpg (XMP)']"):
            located(list(found.photos.values()), crs)
    assert located(list(found.photos.values()), "EPSG:4979").systems == ("EPSG:4979",) * 2


def test_altitude_references_2_and_3_are_sea_level(tmp_path):
    """EXIF 3.0; 0 and 1 were sea level before, and are the ellipsoid since: they are what a user says."""
    for name, reference, sign in (("a.jpg", b"\2", 1.0), ("b.jpg", b"\3", -1.0)):
        picture(tmp_path / name, gps=tags(*PLACE, tag_5=reference, tag_31=3.0))
        assert read_metadata(tmp_path).photos[name].position.position[2] == sign * PLACE[2]
    records = list(read_metadata(tmp_path).photos.values())
    geoid = "EPSG:4326+geoid=47"
    assert located(records, geoid).systems == (geoid,) * 2
    with refused("photos.sea-level option=--photos-crs"):
        located(records)
    for crs in ("EPSG:4979", "EPSG:4326"):
        with refused("photos.sea-level option=--photos-crs"):
            located(records, crs)
    picture(tmp_path / "b.jpg", gps=tags(*PLACE, tag_31=3.0))
    records = list(read_metadata(tmp_path).photos.values())
    assert located(records, geoid).systems == (geoid,) * 2
    for crs in (None, "EPSG:4979"):
        with refused("photos.heights one=above the geoid first=['a.jpg (EXIF)']"):
            located(records, crs)


def all_sources(folder):
    """Write one photo with all sources, each with a height of its own."""
    picture(
        folder / "DJI_0001.JPG",
        xmp=packet(dji(8.5, 47.3, 502.0, sd=(0.2, 0.2, 0.2))),
        gps=tags(8.5, 47.3, 501.0, tag_31=1.0),
    )
    (folder / "100_Timestamp.MRK").write_text(MRK.format(1, 47.3, 8.5, 503.0))
    (folder / "reference.csv").write_text(
        "#Label,X/Longitude,Y/Latitude,Z/Altitude,Accuracy\nDJI_0001,8.5,47.3,504,0.4\n"
    )
    (folder / "geo.txt").write_text("EPSG:4979\nDJI_0001.JPG 8.5 47.3 505 0 0 0 0.5 0.5\n")


def test_a_table_counts_before_exposures_these_before_xmp_and_that_before_exif(tmp_path):
    all_sources(tmp_path)
    order = ["geo.txt", "reference.csv", "100_Timestamp.MRK"]
    expected = [(505.0, 0.5), (504.0, 0.4), (503.0, 0.022), (502.0, 0.2)]
    for height, sd in expected:
        (record,) = read_metadata(tmp_path).photos.values()
        assert record.position.position[2] == height
        assert record.deviations.sd[0] == sd
        if order:
            (tmp_path / order.pop(0)).unlink()
    picture(tmp_path / "DJI_0001.JPG", gps=tags(8.5, 47.3, 501.0, tag_31=1.0))
    (record,) = read_metadata(tmp_path).photos.values()
    assert record.position.source == record.deviations.source == "EXIF"


def test_deviations_come_from_the_next_source_that_has_some(tmp_path):
    all_sources(tmp_path)
    (tmp_path / "reference.csv").unlink()
    (tmp_path / "geo.txt").write_text("EPSG:4979\nDJI_0001.JPG 8.5 47.3 505\n")
    (record,) = read_metadata(tmp_path).photos.values()
    assert (record.position.source, record.deviations.source) == ("geo.txt", ".MRK")
    assert record.rtk
    (tmp_path / "100_Timestamp.MRK").unlink()
    (record,) = read_metadata(tmp_path).photos.values()
    assert record.deviations.sd == (0.2, 0.2, 0.2)
    (tmp_path / "geo.txt").write_text("EPSG:4979\nDJI_0001.JPG 8.5 47.3\n")
    found = read_metadata(tmp_path)
    assert found.photos["DJI_0001.JPG"].position.source == "XMP"


def test_the_second_of_two_tables_is_told(tmp_path):
    all_sources(tmp_path)
    (message,) = read_metadata(tmp_path).messages
    assert (message.code, message.phrase.fields["n"]) == ("photos.other-table", 1)
    assert message.file.name == "reference.csv"


def test_a_table_gnss_counts_before_all_files(flown):
    folder, *_ = flown
    project = adjusted(folder)
    own = positions(project)["DJI_0103"].position
    (folder / "gnss.csv").write_text("photo,x,y,z,sd\nDJI_0103,{},{},{},0.5\n".format(*own))
    toml = folder / "project.toml"
    toml.write_text(toml.read_text() + '[frame]\nkind = "topocentric"\norigin = [47.38, 8.54, 554.0]\n')
    found = positions(adjusted(folder))
    assert len(found) == 6
    assert np.diag(found["DJI_0103"].covariance).tolist() == [0.25] * 3
    assert found["DJI_0103"].shift is None


def test_a_project_names_the_folder_itself(flown):
    folder, *_ = flown
    toml = folder / "project.toml"
    text = toml.read_text()
    toml.write_text(text + '[photos]\ndirectory = "photos"\n')
    assert len(positions(formats.read(folder))) == 6
    toml.write_text(text + '[photos]\ndirectory = "nowhere"\n')
    with refused("error.key table=photos key=directory message=error.absent kind=folder name=nowhere"):
        formats.read(folder)
    toml.write_text(text + '[photos]\ndirectory = "photos"\nmrk_antenna = 3\n')
    with refused("error.key table=photos key=mrk_antenna message=error.flag value=3"):
        formats.read(folder)


def test_deviations_that_lack_are_told_and_given_by_the_option(tmp_path):
    def write(path, *place):
        picture(path, xmp=packet(dji(*place, sd=None)))

    block_with_pictures(tmp_path, write=write)
    project = adjusted(tmp_path)
    assert positions(project) == {}
    assert Phrase("read.positions", {"n": 6, "option": option_sd("gnss")}) in project.lacks
    project = adjusted(tmp_path, sd={"gnss": (0.02, 0.02, 0.04)})
    assert len(positions(project)) == 6
    assert fields(project, "photos.observed")["deviations"] == ["6 of --sd gnss"]
    toml = tmp_path / "project.toml"
    toml.write_text(toml.read_text().replace("images = 0.5", "images = 0.5\ngnss = 0.03"))
    assert len(positions(adjusted(tmp_path))) == 6


def test_solutions_that_are_not_fixed_and_accuracies_of_exif_are_told(tmp_path):
    def write(path, *place):
        number = int(path.stem[-1])
        if number < 4:
            flag = (50, 34, 16)[number - 1]
            picture(path, xmp=packet(dji(*place, flag=flag)))
        else:
            picture(path, gps=tags(*place, **({"tag_31": 3.0} if number < 6 else {"tag_11": 1.2})))

    block_with_pictures(tmp_path, write=write)
    project = adjusted(tmp_path, photos_crs="EPSG:4979", sd={"gnss": (5.0,)})
    fixes = [own.fields for own in map(attrgetter("phrase"), project.messages) if own.code == "photos.fix"]
    assert [(own["fix"], own["names"]) for own in fixes] == [
        ("float", ["DJI_0102.JPG"]),
        ("single", ["DJI_0103.JPG"]),
    ]
    remarks = [
        own.fields for own in map(attrgetter("phrase"), project.messages) if own.code == "photos.remark"
    ]
    assert {own["remark"]: own["n"] for own in remarks} == {RADIAL: 2, DOP_ALONE: 1}
    observed = fields(project, "photos.observed")
    assert observed["positions"] == "3 of XMP, 3 of EXIF"
    assert observed["deviations"] == ["3 of XMP, 2 of EXIF", "1 of --sd gnss"]


def test_exposures_without_a_photo_are_counted_and_flights_are_files_of_a_folder(tmp_path):
    for name in ("100_0004_0001", "100_0005_0001", "100_0005_0002"):
        picture(tmp_path / f"{name}.JPG")
    (tmp_path / "100_0004_Timestamp.MRK").write_text(
        "".join(MRK.format(k, 47.3, 8.5, 500) for k in (1, 2, 3))
    )
    (tmp_path / "100_0005_Timestamp.MRK").write_text("".join(MRK.format(k, 47.3, 8.5, 600) for k in (1, 2)))
    found = read_metadata(tmp_path)
    assert {key: each.position.position[2] for key, each in found.photos.items()} == {
        "100_0004_0001.JPG": 500.0,
        "100_0005_0001.JPG": 600.0,
        "100_0005_0002.JPG": 600.0,
    }
    flights = {each.flight for each in found.photos.values()}
    assert {each.rpartition("/")[2] for each in flights} == {"100_0004", "100_0005"}
    assert [each.phrase.fields for each in found.messages] == [{"n": 2, "total": 3}]
    picture(tmp_path / "DJI_0001.JPG")
    with refused(r"photos.flight photo=DJI_0001\.JPG names=\['100_0004_Timestamp\.MRK', '100_0005"):
        read_metadata(tmp_path)


def test_a_model_in_axes_of_its_own_is_carried_onto_its_positions(flown):
    folder, *_ = flown
    project = adjusted(folder)
    assert fields(project, "photos.transformed")["n"] == 6
    found = np.array([each.position for each in positions(project).values()])
    assert np.abs(project.block.photo_positions - found).max() < 0.2


def test_poses_that_do_not_fit_are_found_anew(run, flown):
    folder, *_ = flown
    lines = (folder / "photos.csv").read_text().splitlines()
    heads = [line for line in lines if not line.startswith("DJI")]
    rows = [line.split(",") for line in lines if line.startswith("DJI")]
    for row, other in zip(rows, [each[2:5] for each in reversed(rows)], strict=True):
        row[2:5] = other if row[0] != "DJI_0101" else ["900", "3", "5"]
    (folder / "photos.csv").write_text("\n".join([*heads, *(",".join(row) for row in rows)]))
    project = adjusted(folder)
    assert fields(project, "photos.new-poses")
    assert np.isnan(project.block.photo_positions).all()
    done = run("adjust", folder, "--photos-dir", folder / "photos", "--out", "out", "--no-html")
    assert done.exit_code == 0, done.output
    assert "Accepted" in done.output


def test_control_in_axes_of_its_own_leaves_no_way_for_positions(flown):
    folder, *_ = flown
    shutil.copy(EXAMPLE / "control.csv", folder)
    with refused("photos.place"):
        adjusted(folder, sd={"control": (0.01,)})


@pytest.mark.parametrize(
    "frame",
    [
        'kind = "topocentric"\norigin = [47.38, 8.54, 450.0]',
        'kind = "geocentric"',
        'kind = "cartesian"\ncrs = "EPSG:32632"',
    ],
)
def test_positions_come_into_the_frame_of_the_project(flown, frame):
    from photogram.formats import from_frame

    folder, _, places = flown
    toml = folder / "project.toml"
    toml.write_text(f"{toml.read_text()}[frame]\n{frame}\n")
    project = adjusted(folder)
    found = positions(project)
    xyz = np.array([each.position for each in found.values()])
    covariances = np.array([each.covariance for each in found.values()])
    back, turned = from_frame("EPSG:4979", xyz, covariances, project.frame)
    np.testing.assert_allclose(back, [places[name] for name in found], rtol=0, atol=1e-4)
    np.testing.assert_allclose(back[:, :2], [places[name][:2] for name in found], rtol=0, atol=2e-9)
    np.testing.assert_allclose(
        np.sqrt(np.diagonal(turned, axis1=1, axis2=2)), [(0.012, 0.011, 0.025)] * 6, rtol=2e-3
    )
    assert ORIGIN[0] == pytest.approx(back[0, 1], abs=0.01)


def test_photos_are_known_by_path_name_or_stem():
    photos = Photos(["a/DJI_0001.JPG", "b/DJI_0001.JPG", "b/DJI_0002.JPG", "c.d.jpg"])
    assert photos.meant("a/DJI_0001.JPG") == ["a/DJI_0001.JPG"]
    assert photos.meant("DJI_0001.JPG") == ["a/DJI_0001.JPG", "b/DJI_0001.JPG"]
    assert photos.meant("DJI_0001.JPG", "b") == ["b/DJI_0001.JPG"]
    assert photos.meant("dji_0002") == photos.meant("DJI_0002.tif") == ["b/DJI_0002.JPG"]
    assert photos.meant("c.d") == ["c.d.jpg"]
    assert photos.meant("x") == []


def test_photos_of_one_name_in_two_folders_are_refused(flown):
    folder, *_ = flown
    (folder / "photos" / "b").mkdir()
    shutil.copy(folder / "photos" / "DJI_0101.JPG", folder / "photos" / "b")
    with refused("photos.ambiguous photo=DJI_0101 names=['DJI_0101.JPG', 'b/DJI_0101.JPG']"):
        adjusted(folder)


def test_folders_that_say_nothing_are_refused(tmp_path, flown):
    folder, *_ = flown
    (tmp_path / "empty").mkdir()
    with refused("photos.sources"):
        read_metadata(tmp_path / "empty")
    with refused("photos.folder"):
        read_metadata(folder / "project.toml")
    picture(tmp_path / "others" / "a.jpg", xmp=packet(dji(*PLACE)))
    with refused("photos.none"):
        formats.read(folder, ReadOptions(photos_dir=tmp_path / "others"))


def test_the_command_writes_tables_that_a_project_reads(run, flown):
    folder, *_ = flown
    expected = positions(adjusted(folder))
    done = run("metadata", folder / "photos", "--out", folder / "gnss.csv")
    assert done.exit_code == 0, done.output
    assert "6 of XMP" in done.stdout
    assert (folder / "gnss_groups.csv").is_file()
    toml = folder / "project.toml"
    toml.write_text(toml.read_text() + '[gnss]\ncrs = "EPSG:4979"\n')
    text = (folder / "gnss.csv").read_text()
    (folder / "gnss.csv").write_text(text.replace(".JPG", ""))
    project = formats.read(folder)
    found = positions(project)
    assert set(found) == set(expected)
    for name, each in found.items():
        np.testing.assert_allclose(each.covariance, expected[name].covariance, rtol=1e-6, atol=1e-12)
        np.testing.assert_array_equal(each.shift.deviations, expected[name].shift.deviations)
        np.testing.assert_array_equal(each.lever_arm.deviations, expected[name].lever_arm.deviations)


def test_the_command_spares_pictures_and_refuses_words_about_nothing(run, flown):
    folder, *_ = flown
    picture_of = folder / "photos" / "DJI_0101.JPG"
    before = picture_of.read_bytes()
    for words in (
        ("metadata", folder / "photos", "--out", picture_of),
        ("info", folder, "--photos-dir", folder / "photos", "--json", picture_of),
    ):
        done = run(*words)
        assert done.exit_code == 1, done.output
        assert "over the input" in done.stderr
        assert picture_of.read_bytes() == before
    for words in (("--mrk-antenna",), ("--photos-crs", "EPSG:4979")):
        refused = run("info", folder, *words)
        assert refused.exit_code == 2
        assert f"Invalid value for {words[0]}: requires --photos-dir" in refused.stderr


def test_the_example_reads_five_pictures_and_a_table(capsys):
    result = load("photo_positions").main()
    assert result.converged
    assert "{'XMP': 5, 'geo.txt': 1}" in capsys.readouterr().out
    assert [each.shift is None for each in result.block.observations].count(True) == 1


def test_positions_that_are_not_used_are_of_no_kind(tmp_path):
    def write(path, *place):
        if path.stem == "DJI_0101":
            picture(path, gps=tags(*place))
        else:
            picture(path, xmp=packet(dji(*place)))

    block_with_pictures(tmp_path, write=write)
    project = adjusted(tmp_path)
    assert len(positions(project)) == 5
    assert Phrase("read.positions", {"n": 1, "option": option_sd("gnss")}) in project.lacks
    with refused("photos.heights one=above the geoid or above the ellipsoid first=['DJI_0101.JPG (EXIF)']"):
        adjusted(tmp_path, sd={"gnss": (5.0,)})
