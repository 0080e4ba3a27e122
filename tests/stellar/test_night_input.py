"""Directions, names of stars and headings of other programs in the files of a night."""

import csv
import re

import numpy as np
import pytest

from message_codes import coded
from photogram import InputError
from photogram.stellar import Catalogue, calibrate_night, read_night

pytest.importorskip("erfa")
DIRECTION = ("azimuth", "elevation_deg", "roll_deg", "alpha", "omega", "kappa")


@pytest.fixture(scope="module")
def solved(whole_example):
    """Calibrate the example once."""
    return calibrate_night(read_night(whole_example))


@pytest.fixture(scope="module")
def whole_example():
    from nights import EXAMPLE

    return EXAMPLE


def change_directions(file, lines_of):
    """Replace the direction of each exposure by lines that a function returns for its name."""
    kept = [line for line in file.read_text().splitlines() if not line.startswith(DIRECTION)]
    found = []
    for line in kept:
        found.append(line)
        if match := re.fullmatch(r'name = "(\d+)"', line):
            found += lines_of(match[1])
    file.write_text("\n".join(found) + "\n")


def write_named(folder, solved, prefix="HIP "):
    """Give the images their stars by name."""
    ids = solved.night.catalogue.ids
    with (folder / "images.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["exposure", "x_px", "y_px", "star"])
        for name, exposure in zip(solved.names, solved.exposures, strict=True):
            for (x, y), star in zip(exposure.xy.tolist(), exposure.stars.tolist(), strict=True):
                if star >= 0:
                    table.writerow([name, x, y, f"{prefix}{ids[star]}"])


def axis_of(matrix):
    """Return right ascension and declination of the axis of a camera, degrees."""
    x, y, z = matrix[2]
    return np.degrees([np.arctan2(y, x) % (2 * np.pi), np.arctan2(z, np.hypot(x, y))])


def test_exposures_point_at_right_ascension_and_declination(folder, solved):
    named = dict(zip(solved.names, solved.inertial.values("matrix_to_vision"), strict=True))

    def lines_of(name):
        ra, dec = axis_of(named[name])
        down = named[name][1]
        cd, sd = np.cos(np.radians(dec)), np.sin(np.radians(dec))
        cr, sr = np.cos(np.radians(ra)), np.sin(np.radians(ra))
        north, east = np.array([-sd * cr, -sd * sr, cd]), np.array([-sr, cr, 0.0])
        angle = np.degrees(np.arctan2(-down @ east, -down @ north))
        return [f"ra_deg = {ra}", f"dec_deg = {dec}", f"position_angle_deg = {angle}"]

    change_directions(folder / "night.toml", lines_of)
    night = read_night(folder / "night.toml")
    given = dict(zip(night.names, night.exposures, strict=True))
    for name, exposure, attitude in zip(
        solved.names, solved.exposures, solved.calibration.attitudes, strict=True
    ):
        assert given[name].utc == exposure.utc
        apart = np.remainder(given[name].attitude - attitude + np.pi, 2 * np.pi) - np.pi
        assert np.abs(apart).max() < np.radians(0.2)  # aberration and refraction
    assert len(calibrate_night(night).names) == len(solved.names)


def test_a_roll_from_the_horizon_belongs_to_any_direction(folder, solved):
    named = dict(zip(solved.names, solved.inertial.values("matrix_to_vision"), strict=True))
    before = {name: each.attitude for name, each in zip(*_given(folder), strict=True)}
    rolls = dict(re.findall(r'name = "(\d+)"[^\[]*?roll_deg = (\S+)', (folder / "night.toml").read_text()))

    def lines_of(name):
        ra, dec = axis_of(named[name])
        return [f"ra_deg = {ra}", f"dec_deg = {dec}", f"roll_deg = {rolls[name]}"]

    change_directions(folder / "night.toml", lines_of)
    for name, each in zip(*_given(folder), strict=True):
        apart = np.remainder(each.attitude - before[name] + np.pi, 2 * np.pi) - np.pi
        assert np.abs(apart).max() < np.radians(2.0)


def _given(folder):
    night = read_night(folder / "night.toml")
    return night.names, night.exposures


@pytest.mark.parametrize("prefix", ["HIP ", "hip", ""])
def test_images_that_name_their_stars_need_no_direction(folder, solved, prefix):
    change_directions(folder / "night.toml", lambda _: [])
    write_named(folder, solved, prefix)
    result = calibrate_night(read_night(folder / "night.toml"))
    np.testing.assert_allclose(result.camera.values, solved.camera.values, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(
        result.calibration.attitudes, solved.calibration.attitudes, rtol=0, atol=np.radians(1e-3)
    )


def test_images_that_name_their_stars_need_no_field_of_view(folder, solved):
    change_directions(folder / "night.toml", lambda _: [])
    file = folder / "night.toml"
    kept = [line for line in file.read_text().splitlines() if not line.startswith("field_of_view")]
    file.write_text("\n".join(kept))
    write_named(folder, solved)
    night = read_night(file, {"matching": {"blind_field_deg": [25.0, 60.0]}})
    assert calibrate_night(night).camera.values[0] == pytest.approx(solved.camera.values[0], rel=1e-3)


def test_an_exposure_without_a_direction_names_what_is_required(folder):
    change_directions(folder / "night.toml", lambda _: [])
    with pytest.raises(InputError) as caught:
        read_night(folder / "night.toml")
    for key in ("azimuth_north_deg", "elevation_deg", "ra_deg", "dec_deg", "alpha"):
        assert key in caught.value.message


def test_two_directions_of_an_exposure_are_rejected(folder):
    change_directions(folder / "night.toml", lambda _: ["ra_deg = 1", "dec_deg = 2", "azimuth_deg = 3"])
    with pytest.raises(InputError, check=coded("error.key", key="ra_deg", message="stars.two-directions")):
        read_night(folder / "night.toml")


@pytest.mark.parametrize(
    ("x", "y", "magnitude", "first"),
    [
        ("xcentroid", "ycentroid", "mag", 0.0),
        ("x_centroid", "y_centroid", "mag", 0.0),
        ("X_IMAGE", "Y_IMAGE", "MAG_AUTO", 1.0),
        ("XWIN_IMAGE", "YWIN_IMAGE", "MAG_AUTO", 1.0),
    ],
)
def test_headings_of_photutils_and_sextractor(folder, x, y, magnitude, first):
    before = read_night(folder / "night.toml")
    table = list(csv.reader((folder / "images.csv").read_text().splitlines()))
    head = [{"x_px": x, "y_px": y, "magnitude": magnitude}.get(name, name) for name in table[0]]
    places = [head.index(x), head.index(y)]
    for row in table[1:]:
        for k in places:
            row[k] = repr(float(row[k]) - 0.5 + first)
    (folder / "images.csv").write_text("\n".join(map(",".join, [head, *table[1:]])))
    for one, other in zip(before.exposures, read_night(folder / "night.toml").exposures, strict=True):
        np.testing.assert_allclose(other.xy, one.xy, rtol=0, atol=1e-9)


def test_headings_of_catalogues(tmp_path):
    path = tmp_path / "stars.csv"
    path.write_text("NUMBER,ALPHA_J2000,DELTA_J2000,MAG_AUTO\n1,10.5,-20.25,3.5\n")
    found = Catalogue.read(path)
    assert found.ids == ("1",)
    np.testing.assert_allclose(np.degrees(found.places), [[10.5, -20.25]])
    assert not found.proper_motions.any()
    path.write_text("HIP,RAJ2000,DEJ2000,pmRA,pmDE,Plx,Vmag\n1,10.5,-20.25,4,5,6,3.5\n")
    assert np.degrees(Catalogue.read(path).proper_motions * 3.6e6) == pytest.approx(np.array([[4.0, 5.0]]))


def test_columns_of_azimuths_name_their_origin(solved):
    assert "azimuth_south_deg" in solved.document().table("exposures").frame()
    assert "Azimuth from south" in solved.report()
