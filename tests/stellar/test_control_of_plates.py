"""What a plate takes as control: landmarks beside stars, places of a catalogue, times of any year."""

import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import coded, codes
from photogram import InputError
from photogram.cli import app
from photogram.io.delimited import read_records
from photogram.stellar import ARCSEC, Site, apparent_places, calibrate, landmark, read_plain, sidereal_time
from photogram.stellar.places import epoch
from photogram.stellar.sky import HOUR

EXAMPLE = Path(str(files("photogram") / "examples" / "stellar"))


def written(folder, stars, images):
    """Write the example with other tables of stars and images, stars held at their places."""
    folder.mkdir()
    text = (EXAMPLE / "plate.toml").read_text()
    stars_at = text.index("weight", text.index("[stars]"))
    text = text[:stars_at] + "weight = [inf, inf, 0.0]" + text[text.index("\n", stars_at) :]
    (folder / "plate.toml").write_text(text)
    (folder / "stars.csv").write_text(
        "star,ra_rad,dec_rad,azimuth_north_deg,elevation_deg\n" + "\n".join(stars)
    )
    (folder / "images.csv").write_text("star,point,x_m,y_m,sidereal_time_rad\n" + "\n".join(images))
    return read_plain(folder / "plate.toml")


def test_landmarks_are_control_like_stars(plate, tmp_path):
    """A star seen once, and a landmark in the direction in which it was seen: one calibration."""
    stars = (EXAMPLE / "stars.csv").read_text().splitlines()[1:]
    images = (EXAMPLE / "images.csv").read_text().splitlines()[1:]
    chosen = ("3", "20", "71")
    once = [line for i, line in enumerate(images) if line.split(",")[0] not in chosen or i % 5 == 0]
    before = written(tmp_path / "stars", [f"{line},," for line in stars], once)
    rows, times = [], {line.split(",")[0]: float(line.split(",")[4]) for line in once}
    for line in stars:
        name, ra, dec = line.split(",")
        if name in chosen:
            ((xi, eta),) = before.site.standard_coordinates([[float(ra), float(dec)]], [times[name]])
            azimuth, elevation = np.degrees([np.arctan2(eta, xi), np.arctan2(1, np.hypot(xi, eta))])
            line = f"{name},,,{azimuth:.13f},{elevation:.13f}"
        else:
            line += ",,"
        rows.append(line)
    # A landmark has no time.
    blank = [line.rsplit(",", 1)[0] + "," if line.split(",")[0] in chosen else line for line in once]
    problem = written(tmp_path / "landmarks", rows, blank)
    assert (problem.image_times == HOUR).sum() == 3
    one, two = calibrate(before), calibrate(problem)
    errors = np.sqrt(np.diag(one.covariance))[:22]
    assert np.abs((one.solved.parameters - two.solved.parameters)[:22] / errors).max() < 1e-4
    assert two.computed_mean_error == pytest.approx(one.computed_mean_error, rel=1e-6)


def test_weights_of_landmarks_are_those_of_their_directions():
    site = Site(latitude=0.8, longitude_west=0.1)
    cofactors = np.array([[4.0, 0.5], [0.5, 1.0]]) * ARCSEC**2
    place, weight = landmark(site, 2.0, 0.3, np.linalg.inv(cofactors))
    generator = np.random.default_rng(5)
    errors = np.linalg.cholesky(cofactors) @ generator.standard_normal((2, 400))
    seen = [landmark(site, 2.0 + a, 0.3 + e, np.zeros((2, 2)))[0] - place for a, e in errors.T]
    # Chi-square with two degrees of freedom.
    assert np.mean([v @ weight @ v for v in seen]) == pytest.approx(2.0, abs=0.3)
    assert landmark(site, 2.0, 0.3, np.diag([np.inf, np.inf]))[1][0, 0] == np.inf


def test_landmarks_below_the_horizon_and_with_refraction_are_refused(tmp_path):
    image = "1,901,0.01,0.01,1.0"
    with pytest.raises(InputError, check=coded("stars.elevation", value=-2.0)):
        written(tmp_path / "low", ["1,,,20.0,-2.0"], [image])
    folder = tmp_path / "refraction"
    shutil.copytree(EXAMPLE, folder)
    text = (folder / "plate.toml").read_text().replace("[options]", "[options]\nrefraction = true")
    (folder / "plate.toml").write_text(text)
    (folder / "stars.csv").write_text("star,ra_rad,dec_rad,azimuth_north_deg,elevation_deg\n1,,,20.0,40.0\n")
    (folder / "images.csv").write_text(f"star,point,x_m,y_m,sidereal_time_rad\n{image}\n")
    with pytest.raises(InputError, check=coded("stars.landmarks-and-refraction")):
        read_plain(folder / "plate.toml")


def test_images_have_utc_or_sidereal_time(tmp_path):
    folder = tmp_path / "plate"
    shutil.copytree(EXAMPLE, folder)
    lines = (folder / "images.csv").read_text().splitlines()
    star, point, x, y, _ = lines[1].split(",")
    lines = [
        lines[0] + ",utc",
        f"{star},{point},{x},{y},,1966-03-01T21:03:05",
        *(f"{each}," for each in lines[2:]),
    ]
    (folder / "images.csv").write_text("\n".join(lines) + "\n")
    problem = read_plain(folder / "plate.toml")
    assert problem.image_times[0] == sidereal_time(problem.site, "1966-03-01T21:03:05")
    lines[1] = lines[1].replace("1966-03-01T21:03:05", "yesterday")
    (folder / "images.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, check=coded("stars.utc", value="yesterday")):
        read_plain(folder / "plate.toml")


def test_times_before_1960_are_universal_time():
    """There was no UTC: nothing jumps at its beginning, and a sidereal day is a sidereal day."""
    site = Site(latitude=0.8, longitude_west=0.0)
    eve, new_year = (sidereal_time(site, utc) for utc in ("1959-12-31T23:59:59", "1960-01-01T00:00:00"))
    assert new_year - eve == pytest.approx(1.00273791 * 15 * ARCSEC, rel=1e-4)
    assert epoch("1935-07-02T12:00:00") == pytest.approx(1935.5, abs=2e-3)
    assert sidereal_time(site, "1935-07-02T12:00:00", 0.5) > sidereal_time(site, "1935-07-02T12:00:00")
    # Mean sidereal time of 0h at Greenwich (Newcomb): 6h 38m 45.836s + 8640184.542s T from 1900 January 0.5.
    newcomb = (23925.836 + 8640184.542 * 12965.5 / 36525) / 86400 * 2 * np.pi
    found = sidereal_time(site, "1935-07-02T00:00:00") - newcomb
    assert abs(np.remainder(found + np.pi, 2 * np.pi) - np.pi) < 25 * ARCSEC
    with pytest.raises(InputError, check=coded("stars.utc-range")):
        epoch("1849-01-01T00:00:00")


def test_apparent_places_as_a_command(tmp_path):
    from photogram.stellar import Catalogue

    out = tmp_path / "stars.csv"
    utc = "1966-03-01T21:03:05"
    run = CliRunner().invoke(app, ["stellar-camera", "places", str(out), "--utc", utc, "--faintest", "2"])
    assert run.exit_code == 0, run.output
    table = read_records(out)
    stars = Catalogue.hipparcos().brighter(2.0)
    assert table.texts("star") == list(stars.ids)
    assert np.array_equal(table.given(["ra_rad", "dec_rad"]), apparent_places(stars, utc))


def test_one_attitude_is_not_compared_with_others(plate):
    only = plate.without(np.zeros(75, bool), plate.image_groups != 2)
    result = calibrate(replace(only, options=replace(only.options, movement_factor=3.0)))
    assert "stars.moved-between-all" not in codes(result.messages)


def test_a_pre_run_has_no_curves_of_zeros(plate):
    images = plate.image_stars[plate.image_groups == 2]
    stars = tuple(plate.star_ids[i] for i in np.unique(images)[[0, 12]])
    options = replace(plate.options, minimum_stars=stars, pre_run=True, curves=True)
    initial = plate.initial.copy()
    initial[14:22] = 0
    document = calibrate(replace(plate, initial=initial, options=options)).document()
    assert document.table("pre-run").visible
    assert not document.table("distortion").visible
