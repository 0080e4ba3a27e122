"""What files of photographs carry, file by file: golden samples, other spellings, files that mean harm."""

import json
import math
from contextlib import suppress

import numpy as np
import pytest

from formats.photographs import DJI, dji, packet, picture, tags
from golden_data import DATA
from message_codes import refused
from photogram import InputError
from photogram.comparator import Place
from photogram.formats import read_metadata
from photogram.formats.metadata.pictures import LARGEST, said_by_packet, said_by_picture, said_by_tags
from photogram.formats.metadata.record import (
    ELLIPSOIDAL,
    SEA_LEVEL,
    UNSAID,
    is_reference,
    number_of,
    read_exposures,
    read_geo_txt,
    read_reference,
)

SAMPLES = DATA / "statement" / "metadata"
PIX4D = "http://pix4d.com/camera/1.0"
LINE = "{}\t384233.385421\t[2264]\t   -40,N\t     0,E\t    86,V\t47.38,Lat\t8.54,Lon\t551.2,Ellh\t{}\t{},Q\n"


@pytest.fixture(scope="module")
def golden():
    return json.loads((SAMPLES / "expected.json").read_text())


def same(said, expected):
    """Compare what was read with the golden figures, exactly."""
    sd = expected["sd_enh_m"]
    assert said.sd == (None if sd is None else tuple(sd))
    if "latitude_deg" in expected:
        height = expected.get("height_m", expected.get("ellipsoidal_height_m"))
        assert said.position == (expected["longitude_deg"], expected["latitude_deg"], height)
    if "flag" in expected:
        assert said.flag == expected["flag"]
    if "fix" in expected:
        assert said.fix == expected["fix"]


@pytest.mark.parametrize("name", ["dji_attributes.xmp", "dji_elements.xmp", "dji_no_rtk.xmp", "pix4d.xmp"])
def test_packets_of_xmp_are_those_of_the_golden_data(golden, name):
    path = SAMPLES / name
    same(said_by_packet(path.read_bytes(), path), golden[name])


def test_the_first_kilobytes_of_a_picture_are_enough(golden):
    (said,) = said_by_picture(SAMPLES / "head.jpg")
    same(said, golden["dji_attributes.xmp"])
    assert said.angles == (-91.5, -90.0, 0.0)
    assert (said.source, said.crs, said.heights, said.rtk) == ("XMP", ELLIPSOIDAL, "", True)


def test_exposures_are_those_of_the_golden_data(golden):
    expected = golden["100_0004_Timestamp.MRK"]
    found = read_exposures(SAMPLES / "100_0004_Timestamp.MRK", antenna=False)
    assert list(found) == [each["number"] for each in expected]
    for each in expected:
        same(found[each["number"]], each)


def test_positions_of_antennas_are_carried_to_the_camera(golden):
    path = SAMPLES / "100_0004_Timestamp.MRK"
    camera, moved = (read_exposures(path, antenna=own)[2].position for own in (False, True))
    assert camera[2] - moved[2] == pytest.approx(0.087)
    metres = np.radians([moved[0] - camera[0], moved[1] - camera[1]]) * 6.378e6
    np.testing.assert_allclose(metres, [0.011 * np.cos(np.radians(47.38)) ** -1 * 1.0, -0.038], rtol=6e-3)


def test_tables_are_those_of_the_golden_data(golden):
    found, expected = read_geo_txt(SAMPLES / "geo.txt"), golden["geo.txt"]
    assert set(found) == set(expected) - {"crs"}
    for name, said in found.items():
        own = expected[name]
        assert said.crs == expected["crs"]
        assert said.position == tuple(own["xyz"])
        assert said.angles == (None if own["angles"] is None else tuple(own["angles"]))
        same(said, own)
    for file in ("metashape_reference.csv", "pix4d_geolocation.csv"):
        assert is_reference(SAMPLES / file)
        rows = read_reference(SAMPLES / file, [])
        assert set(rows) == set(golden[file])
        for name, said in rows.items():
            same(said, golden[file][name])


def test_the_whole_folder_has_the_golden_precedence(golden):
    found = read_metadata(SAMPLES)
    one = found.photos["DJI_0002.JPG"]
    assert (one.position.source, one.deviations.source) == ("geo.txt", ".MRK")
    assert one.deviations.sd == (0.01221, 0.01152, 0.0261)
    assert found.photos["DJI_0003.JPG"].deviations.sd == (0.4, 0.4, 0.9)
    assert found.sources() == {"XMP": 1, "geo.txt": 2, ".MRK": 1}


def test_the_radial_accuracy_of_exif_is_that_of_the_golden_data(golden):
    said = said_by_tags(tags(8.5, -47.3, -12.5, tag_31=0.03), Place())
    np.testing.assert_allclose(said.sd, golden["exif_GPSHPositioningError_0.03"]["sd_enh_m"], rtol=3e-9)
    assert "how sure" in said.remark


@pytest.mark.parametrize("nested", [False, True])
def test_attributes_and_elements_are_read_alike_by_their_namespace(tmp_path, nested):
    given = dji(-18.4, -33.9, 120.5)
    given["GpsLongtitude"] = given.pop("GpsLongitude")
    said = said_by_packet(packet(given, nested=nested), tmp_path)
    assert said.position == (-18.4, -33.9, 120.5)
    assert said.sd == (0.012, 0.011, 0.025)
    assert said_by_packet(packet(given, space="http://example.com/", nested=nested), tmp_path) is None


@pytest.mark.parametrize(
    ("flag", "fix"),
    [
        (50, "fixed"),
        (51, "fixed"),
        (59, "fixed"),
        (34, "float"),
        (16, "single"),
        (0, "none"),
        (60, "unknown"),
    ],
)
def test_flags_have_their_meaning(flag, fix, tmp_path):
    said = said_by_packet(packet(dji(8.5, 47.3, 500.0, flag=flag)), tmp_path)
    assert said.fix == fix
    assert (said.sd is None) == (fix == "none")
    assert said.heights == (UNSAID if fix == "none" else "")


@pytest.mark.parametrize("sd", [None, (0.0, 0.01, 0.02), (0.01, 0.01)])
def test_deviations_that_are_zero_or_missing_are_not_taken(tmp_path, sd):
    assert said_by_packet(packet(dji(8.5, 47.3, 500.0, sd=sd)), tmp_path).sd is None


def test_accuracies_of_pix4d_stand_beside_any_position(tmp_path):
    said = said_by_packet(packet({"GPSXYAccuracy": "0.03", "GPSZAccuracy": "0.05"}, space=PIX4D), tmp_path)
    assert (said.sd, said.position, said.rtk) == ((0.03, 0.03, 0.05), None, False)


def test_heights_of_exif_have_a_sign_and_are_of_a_kind_that_it_says_for_sea_level_only():
    assert said_by_tags(tags(8.5, 47.3, -12.5), Place()).position[2] == -12.5
    assert said_by_tags(tags(8.5, 47.3, 12.5), Place()).heights == UNSAID
    below = said_by_tags(tags(-8.5, -47.3, 12.5, tag_5=b"\3"), Place())
    assert below.heights == SEA_LEVEL
    np.testing.assert_allclose(below.position, (-8.5, -47.3, -12.5), rtol=0, atol=1e-9)


def test_a_receiver_without_a_fix_has_no_position_and_a_dop_no_metres():
    assert said_by_tags(tags(8.5, 47.3, 12.5, tag_9="V"), Place()) is None
    assert said_by_tags(tags(0.0, 0.0, 0.0), Place()) is None
    assert said_by_tags({}, Place()) is None
    said = said_by_tags(tags(8.5, 47.3, 12.5, tag_11=1.2), Place())
    assert said.sd is None
    assert "GPSDOP" in said.remark


def test_pictures_carry_both(tmp_path):
    for ending in ("jpg", "JPEG", "tif"):
        path = picture(
            tmp_path / f"a.{ending}",
            xmp=packet(dji(8.5, 47.3, 500.0)),
            gps=tags(8.5, 47.3, 453.0, tag_31=0.03),
        )
        found = {each.source: each for each in said_by_picture(path)}
        assert list(found) == ["XMP", "EXIF"]
        assert found["XMP"].sd == (0.012, 0.011, 0.025)
        np.testing.assert_allclose(found["EXIF"].position, (8.5, 47.3, 453.0), rtol=0, atol=1e-8)
    assert said_by_picture(picture(tmp_path / "bare.jpg")) == []


@pytest.mark.parametrize(
    ("name", "number"),
    [
        ("DJI_0042", 42),
        ("100_0004_0042", 42),
        ("DJI_20230517120000_0042_V", 42),
        ("IMG_12345", None),
        ("a", None),
    ],
)
def test_photos_have_the_number_of_their_exposure(name, number):
    assert number_of(name) == number


REFERENCES = {
    "#Label,Y/Latitude,X/Longitude,Z/Altitude,Accuracy,Yaw,Pitch\na.jpg,47.3,8.5,500,0.05,1,2\n": (
        0.05,
        0.05,
        0.05,
    ),
    "Z_acc;XY_acc;Altitude;Longitude;Latitude;Image\n0.04;0.02;500;8.5;47.3;a.jpg\n": (0.02, 0.02, 0.04),
    "imagename,latitude,longitude,altitude,accuracy_horz,accuracy_vert\na.jpg,47.3,8.5,500,0.02,0.04\n": (
        *(0.02, 0.02, 0.04),
    ),
    "Label,X/Longitude,Y/Latitude,Z/Altitude,Z_acc,Y_acc,X_acc\na.jpg,8.5,47.3,500,0.3,0.2,0.1\n": (
        *(0.1, 0.2, 0.3),
    ),
    "Label,Longitude,Latitude,Height,Accuracy (cm)\na.jpg,8.5,47.3,500,5\n": (0.05, 0.05, 0.05),
    "a.jpg,47.3,8.5,500\n": None,
}


@pytest.mark.parametrize("text", REFERENCES)
def test_references_are_read_by_their_headings_in_any_order(tmp_path, text):
    path = tmp_path / "reference.csv"
    path.write_text(text)
    assert is_reference(path)
    said = read_reference(path, [])["a.jpg"]
    assert said.position == (8.5, 47.3, 500.0)
    assert said.sd == REFERENCES[text]
    assert said.heights == UNSAID


def test_references_that_are_switched_off_are_left_out_and_systems_are_those_of_the_comment(tmp_path):
    path = tmp_path / "reference.txt"
    path.write_text(
        "# CoordinateSystem: EPSG:32632\n#Label,X/Easting,Y/Northing,Z/Altitude,Enable\n"
        "a.jpg,465371.1,5247623.4,551.2,1\nb.jpg,465372.1,5247623.4,551.2,0\n"
    )
    found = read_reference(path, [])
    assert list(found) == ["a.jpg"]
    assert (found["a.jpg"].crs, found["a.jpg"].heights) == ("EPSG:32632", "")
    assert not is_reference(picture(tmp_path / "a.jpg"))
    (tmp_path / "notes.txt").write_text("flown in the morning\n")
    assert not is_reference(tmp_path / "notes.txt")


BAD_PACKETS = {
    "doctype": (b'<!DOCTYPE a [<!ENTITY b "c">]>' + packet(dji(8.5, 47.3, 1.0)), "DOCTYPE"),
    "doctype of two bytes": (
        ('<?xml version="1.0" encoding="utf-16"?><!DOCTYPE a>' + packet({}).decode()).encode("utf-16"),
        "DOCTYPE",
    ),
    "truncated": (packet(dji(8.5, 47.3, 1.0))[:-30], "photos.xmp reason=unclosed token"),
    "empty": (b"", "photos.xmp reason=no element"),
    "nan": (packet(dji(8.5, 47.3, 1.0) | {"RtkStdLon": "nan"}), "RtkStdLon: error.number value=nan"),
    "infinite": (
        packet(dji(8.5, 47.3, 1.0) | {"AbsoluteAltitude": "1e999"}),
        "AbsoluteAltitude: error.number value=1e999",
    ),
    "far": (packet(dji(8.5, 97.3, 1.0)), "photos.degrees longitude=8.5 latitude=97.3"),
    "high": (packet(dji(8.5, 47.3, 1e7)), "photos.height height=10000000.0"),
    "flag": (packet(dji(8.5, 47.3, 1.0, flag="fixed")), "RtkFlag"),
    "huge": (packet({"Comment": "x" * LARGEST}), "photos.packet n=1048804 most=1048576"),
    "deep": (b"<a>" * 50_000, "photos.xmp"),
    "twice": (
        packet(dji(8.5, 47.3, 1.0)).replace(
            b"></rdf", f'><x:GpsLatitude xmlns:x="{DJI}">1</x:GpsLatitude></rdf'.encode()
        ),
        "photos.repeated name=GpsLatitude first=+47.300000000 second=1",
    ),
}


@pytest.mark.parametrize("name", BAD_PACKETS)
def test_packets_at_fault_are_refused_by_the_name_of_their_file(tmp_path, name):
    data, match = BAD_PACKETS[name]
    with refused(match) as caught:
        said_by_packet(data, tmp_path / "a.jpg")
    assert caught.value.file == tmp_path / "a.jpg"


BAD_TAGS = [
    ({1: "N", 2: "abc", 3: "E", 4: (8, 0, 0)}, "photos.angle"),
    ({1: "N", 2: (47, 0), 3: "E", 4: (8, 0, 0)}, "photos.angle"),
    ({2: (47, 0, 0), 3: "E", 4: (8, 0, 0)}, "photos.letter tag=1 value= names=['N', 'S']"),
    ({1: "N", 2: (47, 0, 0), 3: "X", 4: (8, 0, 0)}, "photos.letter tag=3 value=X names=['E', 'W']"),
    ({1: "N", 2: (97, 0, 0), 3: "E", 4: (8, 0, 0)}, "photos.degrees"),
    ({1: "N", 2: (47, 0, 0), 3: "E", 4: (8, 0, 0), 6: math.inf}, "photos.tag tag=6 value=inf"),
    ({1: "N", 2: (47, 0, 0), 3: "E", 4: (8, 0, 0), 6: "high"}, "photos.tag tag=6 value=high"),
    ({1: "N", 2: (47, 0, 0), 3: "E", 4: (8, 0, 0), 5: b"\7", 6: 1.0}, "photos.altitude-reference value=7"),
]


@pytest.mark.parametrize(("given", "match"), BAD_TAGS)
def test_tags_at_fault_are_refused(given, match):
    with refused(match):
        said_by_tags(given, Place())


def test_tags_without_a_denominator_say_nothing():
    nothing = math.nan
    said = {1: "N", 2: (nothing, 0, 0), 3: "E", 4: (8, 0, 0), 31: nothing}
    assert said_by_tags(said, Place()) is None


BAD_LINES = {
    "cells": ("1\t2\t3\n", "format.words n=3 required=11 words"),
    "week": (LINE.format(1, "0.1, 0.1, 0.1", 50).replace("[2264]", "2264"), "photos.week value=2264"),
    "sd": (LINE.format(1, "0.1, nan, 0.1", 50), "standard deviation: error.number value=nan"),
    "latitude": (
        LINE.format(1, "0.1, 0.1, 0.1", 50).replace("47.38,Lat", "47.38,Lot"),
        "format.member name=Lat",
    ),
    "accuracies": (LINE.format(1, "0.1, 0.1", 50), "format.member name=sN, sE, sV"),
    "flag": (LINE.format(1, "0.1, 0.1, 0.1", -1), "Q"),
    "twice": (LINE.format(1, "0.1, 0.1, 0.1", 50) * 2, "format.repeated what=exposure name=1"),
    "huge": (LINE.format("9" * 30, "0.1, 0.1, 0.1", 50), "number"),
    "far": (LINE.format(1, "0.1, 0.1, 0.1", 50).replace("8.54,Lon", "854,Lon"), "photos.degrees"),
}


@pytest.mark.parametrize("name", BAD_LINES)
def test_exposures_at_fault_are_refused_by_their_record(tmp_path, name):
    text, match = BAD_LINES[name]
    path = tmp_path / "a_Timestamp.MRK"
    path.write_text(text)
    with refused(match) as caught:
        read_exposures(path, antenna=False)
    assert (caught.value.file, caught.value.record) == (path, 2 if name == "twice" else 1)


def test_exposures_without_a_solution_have_no_deviations(tmp_path):
    path = tmp_path / "a_Timestamp.MRK"
    path.write_text(LINE.format(7, "0.1, 0.2, 0.3", 0) + "\n" + LINE.format(8, "0, 0, 0", 50))
    found = read_exposures(path, antenna=False)
    assert (found[7].sd, found[8].sd) == (None, None)
    assert (found[7].rtk, found[8].rtk) == (False, True)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "format.crs"),
        ("# nothing\n", "format.crs"),
        ("UTM\na.jpg 1 2 3\n", "record 1 format.crs"),
        ("EPSG:4326\na.jpg 8\n", "record 2 format.words n=2"),
        ("EPSG:4326\na.jpg 8 47 3 1 2\n", "record 2 format.words n=6"),
        ("EPSG:4326\na.jpg 8 nan 3\n", "record 2 error.number value=nan"),
        ("EPSG:4326\na.jpg 8 147 3\n", "record 2 photos.degrees longitude=8.0 latitude=147.0"),
        ("EPSG:4326\na.jpg 8 47 3\na.jpg 8 47 3\n", "record 3 format.repeated what=photo name=a.jpg"),
    ],
)
def test_lists_at_fault_are_refused(tmp_path, text, match):
    (tmp_path / "geo.txt").write_text(text)
    with refused(match):
        read_geo_txt(tmp_path / "geo.txt")


def test_pictures_at_fault_are_refused_by_their_name(tmp_path):
    whole = picture(
        tmp_path / "whole.jpg", xmp=packet(dji(8.5, 47.3, 500.0)), gps=tags(8.5, 47.3, 453.0, tag_31=0.03)
    ).read_bytes()
    random = np.random.default_rng(3)
    path = tmp_path / "damaged.jpg"
    for trial in range(300):
        data = bytearray(whole)
        if trial % 3 == 0:
            del data[int(random.integers(len(data))) :]
        else:
            for place in random.integers(min(len(data), 900), size=trial % 3).tolist():
                data[place] = int(random.integers(256))
        path.write_bytes(data)
        with suppress(InputError):  # and nothing else
            said_by_picture(path)
    path.write_bytes(b"no picture")
    with refused("photos.picture reason=not a JPEG file"):
        said_by_picture(path)
    with pytest.raises(InputError, match=r"cannot be read"):
        said_by_picture(tmp_path / "absent.jpg")


def test_without_pillow_a_sentence_says_what_to_install(tmp_path, monkeypatch):
    path = picture(tmp_path / "a.jpg")
    monkeypatch.setitem(__import__("sys").modules, "PIL.JpegImagePlugin", None)
    with pytest.raises(InputError, match=r"pip install 'photogram\[photos\]'"):
        said_by_picture(path)
