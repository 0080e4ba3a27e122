"""A night of exposures: from the files of the packaged example to the camera that made them."""

import json
from dataclasses import replace
from pathlib import Path

import erfa
import numpy as np
import pytest
from nights import EXAMPLE, MAKER
from observer import places_of_j2000
from typer.testing import CliRunner

from message_codes import as_check, coded, has_code
from photogram import AdjustmentError, InputError, _photocore
from photogram.cli import app
from photogram.network.point_sets import mutually_nearest
from photogram.stellar import (
    ARCSEC,
    Air,
    Catalogue,
    Earth,
    Site,
    SkyCamera,
    apparent_places,
    attitude_of,
    calibrate_exposures,
    calibrate_night,
    project_sky,
    read_night,
    sidereal_time,
)
from photogram.stellar.identification import stars_near
from photogram.stellar.places import axis_of, pole_matrix, terrestrial
from photogram.stellar.plain import inputs

TRUTH = MAKER["CAMERA"].values


def normalized(result):
    return (result.camera.values - TRUTH) / np.sqrt(np.diag(result.camera.covariance))


def test_the_example_is_what_its_maker_makes():
    bright = Catalogue.hipparcos().brighter(MAKER["FAINTEST"])
    made = MAKER["images"](bright, np.random.default_rng(1972))
    assert (EXAMPLE.parent / "images.csv").read_text() == "\n".join(made) + "\n"
    assert EXAMPLE.read_text() == MAKER["night"]()


def test_camera_and_attitudes_come_back(result):
    assert result.converged
    assert len(result.names) == 5
    assert np.abs(normalized(result)).max() < 3
    found = result.calibration
    truth = np.array([MAKER["truth"]()[name] for name in result.names])
    sd = np.sqrt(np.einsum("eii->ei", found.attitude_covariances))
    assert np.abs((found.attitudes - truth) / sd).max() < 3
    assert found.mean_error == pytest.approx(1.0, abs=0.08)
    # Four of a hundred stars are missed, three of a hundred images are of none: nearly all of the rest.
    assert (result.identified / [len(e.xy) for e in result.exposures]).min() > 0.95
    assert found.redundancy.sum() == pytest.approx(found.degrees_of_freedom, rel=1e-9)


def test_blunders_are_left_out(night, result):
    spoilt = []
    for given, found in zip(night.exposures, result.exposures, strict=True):
        xy = given.xy.copy()
        xy[np.flatnonzero(found.stars >= 0)[10:14]] += 2.0
        spoilt.append(replace(given, xy=xy))
    again = calibrate_night(replace(night, exposures=spoilt))
    assert again.rejected.tolist() == [4] * 5
    assert np.abs(normalized(again)).max() < 3
    assert np.abs(again.calibration.standardized).max() < 5


def test_an_exposure_of_another_sky_is_left_out(night):
    attitude = night.exposures[0].attitude + np.array([0.7, 0.0, 0.0])
    others = [replace(night.exposures[0], attitude=attitude), *night.exposures[1:]]
    result = calibrate_night(replace(night, exposures=others))
    assert result.names == ("2", "3", "4", "5")
    assert has_code(result.messages[0], "stars.rejected", name="1")
    with pytest.raises(InputError, check=coded("stars.no-exposure")):
        calibrate_night(replace(night, exposures=others[:1], names=("1",)))


def test_stars_that_are_known_need_no_identification(night, result, folder):
    ids = result.night.catalogue.ids
    lines = ["exposure,x_px,y_px,star"]
    for name, exposure in zip(result.names, result.exposures, strict=True):
        for (x, y), star in zip(exposure.xy, exposure.stars, strict=True):
            lines.append(f"{name},{x:.3f},{y:.3f},{ids[star] if star >= 0 else ''}")
    (folder / "images.csv").write_text("\n".join(lines))
    again = calibrate_night(read_night(folder / "night.toml"))
    assert again.camera.values == pytest.approx(result.camera.values, rel=1e-9)
    (folder / "images.csv").write_text("\n".join([*lines, "1,5,5,none"]))
    with pytest.raises(InputError, check=coded("stars.not-in-catalogue", star="none")):
        read_night(folder / "night.toml")


def test_stars_with_weights(night, result):
    """A milliarcsecond is nothing to a tenth of a pixel of 23 arcsec; 10 arcsec are much."""
    weighted = calibrate_night(replace(night, weigh_stars=True))
    found = weighted.calibration
    assert np.isfinite(found.star_residuals).all()
    assert found.degrees_of_freedom == result.calibration.degrees_of_freedom
    errors = np.sqrt(np.diag(result.camera.covariance))
    assert np.abs((weighted.camera.values - result.camera.values) / errors).max() < 1e-3
    poor = replace(
        night.catalogue, errors=np.tile([10 * ARCSEC, 10 * ARCSEC, 0, 0], (len(night.catalogue.ids), 1))
    )
    exposures = list(weighted.exposures)
    loose = calibrate_exposures(
        exposures, night.camera, night.site, poor, weigh_stars=True, earth=night.earth, pixel_sd=0.1
    )
    # Plate and catalogue share the residuals as their variances are: 2.3 arcsec and 10 arcsec.
    scale = np.degrees(1 / TRUTH[0]) * 3600 * 0.1
    alone = np.bincount(loose.stars, minlength=len(night.catalogue.ids))[loose.stars] == 1
    assert loose.redundancy[alone].mean() == pytest.approx(scale**2 / (scale**2 + 100), abs=0.01)
    total = loose.redundancy.sum() + loose.star_redundancy.sum()
    assert total == pytest.approx(loose.degrees_of_freedom, rel=1e-9)


def test_a_calibrated_camera_as_prior(night, result):
    """The same night twice: half the covariance."""
    again = calibrate_night(replace(night, prior=result.camera, camera=result.camera))
    assert again.calibration.degrees_of_freedom == result.calibration.degrees_of_freedom + 9
    scale = (again.calibration.mean_error / result.calibration.mean_error) ** 2
    ratio = np.diag(again.camera.covariance) / np.diag(result.camera.covariance) / scale
    # The prior's covariance is scaled by its own mean error of unit weight: 1.016 instead of 1.
    m = result.calibration.mean_error**2
    assert ratio == pytest.approx(np.full(9, m / (m + 1)), rel=5e-3)
    few = [replace(e, xy=e.xy[:12]) for e in night.exposures[:1]]
    alone = replace(night, exposures=few, names=("1",), prior=result.camera, camera=result.camera)
    found = calibrate_night(alone)
    own = np.sqrt(np.diag(found.camera.covariance)) / found.calibration.mean_error
    # A dozen stars add little.
    assert own == pytest.approx(np.sqrt(np.diag(result.camera.covariance)), rel=0.3)


def test_camera_parameters_that_are_held(night):
    result = calibrate_night(replace(night, fixed=("k3",)))
    assert result.camera.covariance[6].tolist() == [0.0] * 9
    assert result.camera.values[6] == 0.0
    assert set(result.significance()) == {"k1", "k2", "p1", "p2"}
    with pytest.raises(InputError, check=coded("error.unknown.close", kind="camera parameter", name="k9")):
        calibrate_night(replace(night, fixed=("k9",)))


def test_one_star_does_not_make_a_camera(night, result):
    exposure = result.exposures[0]
    few = replace(exposure, stars=np.where(np.arange(len(exposure.xy)) < 4, exposure.stars, -1))
    with pytest.raises(AdjustmentError, check=coded("stars.undetermined")):
        calibrate_exposures([few], night.camera, night.site, night.catalogue)


def test_variances_beyond_double_precision_are_refused(night, result):
    with pytest.raises(AdjustmentError, check=coded("stars.variances-too-large")):
        calibrate_exposures(
            result.exposures, night.camera, night.site, night.catalogue, pixel_sd=1e154, earth=night.earth
        )


def test_parallaxes_that_no_star_has_are_refused(night):
    near = replace(night.catalogue, parallaxes=np.full_like(night.catalogue.parallaxes, 1.7e308))
    with pytest.raises(InputError, check=coded("stars.no-motion")):
        apparent_places(near, night.exposures[0].utc)


def test_the_pole_agrees_with_erfa(night):
    """At ten times the size that poles have, so that it shows."""
    bright = Catalogue.hipparcos().brighter(3.0)
    site = Site(np.radians(47.0), np.radians(-8.5), air=Air(280.0, 0.0), aberration=0.3192 * ARCSEC)
    earth, utc = Earth(-0.2, (3 * ARCSEC, 4 * ARCSEC)), "2024-03-01T21:03:05.25"
    date = earth.site_of_date(site)
    standard = date.standard_coordinates(apparent_places(bright, utc), sidereal_time(date, utc, earth.dut1))
    turn = terrestrial(site).T @ pole_matrix(earth.pole) @ terrestrial(date)
    j2000 = places_of_j2000(bright)
    day = erfa.dtf2d("UTC", 2024, 3, 1, 21, 3, 5.25)
    azimuth, zenith, *_ = erfa.atco13(
        *j2000, *day, earth.dut1, np.radians(8.5), site.latitude, 0.0, *earth.pole, 0.0, 0.0, 0.0, 0.5
    )
    up = zenith < np.radians(70)
    vectors = np.column_stack([standard[up], np.ones(up.sum())]) @ turn.T
    tangent = np.tan(zenith[up])
    expected = np.column_stack([tangent * np.cos(azimuth[up]), tangent * np.sin(azimuth[up])])
    off = np.abs(vectors[:, :2] / vectors[:, 2:] - expected).max(axis=1) / (1 + tangent**2)
    assert up.sum() > 50
    assert off.max() < 4e-3 * ARCSEC


def test_attitudes_are_those_of_the_mean_pole(night):
    """Azimuths and zenith distances by pyerfa, which knows the pole, come to the measured pixels."""
    earth, bright, utc = Earth(0.3, (30 * ARCSEC, -60 * ARCSEC)), night.catalogue, "2024-03-05T20:10:00"
    date, attitude = earth.site_of_date(night.site), night.exposures[0].attitude
    time = sidereal_time(date, utc, earth.dut1)
    camera = SkyCamera(TRUTH, np.zeros((9, 9)))
    pixels = project_sky(camera, attitude, date, apparent_places(bright, utc), time)
    with np.errstate(invalid="ignore"):
        seen = np.flatnonzero(((pixels > 0) & (pixels < MAKER["FRAME"])).all(axis=1))
    exposure = replace(night.exposures[0], utc=utc, xy=pixels[seen], stars=seen)
    found = calibrate_exposures([exposure], camera, night.site, bright, earth=earth)
    stars, air = bright.take(seen), night.site.air
    j2000 = places_of_j2000(stars)
    day, west = erfa.dtf2d("UTC", 2024, 3, 5, 20, 10, 0.0), night.site.longitude_west
    azimuth, zenith, *_ = erfa.atco13(
        *j2000,
        *day,
        earth.dut1,
        -west,
        night.site.latitude,
        0.0,
        *earth.pole,
        air.pressure * 1013.25 / 760,
        air.temperature - 273.15,
        0.0,
        0.574,
    )
    m, n, q = _photocore.pointing_matrix(found.attitudes[0]) @ np.array(
        [np.tan(zenith) * np.cos(azimuth), np.tan(zenith) * np.sin(azimuth), np.ones(len(zenith))]
    )
    # The matrix of the attitude zero reflects the first coordinate.
    seen_again = _photocore.plate_images(
        np.column_stack([m / q, n / q]) * [-1, 1], np.zeros(3), camera.common[:13], camera.kind
    )
    assert len(seen) > 80
    # A pole of 67 arcsec is three pixels; a thousandth of a pixel is 0.02 arcsec.
    assert seen_again == pytest.approx(exposure.xy, abs=2e-3)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 30), (90, 50), (180, 20), (270, 70), (123, 45)])
def test_rough_attitudes_from_azimuth_elevation_roll(azimuth, elevation):
    """What is east of a camera that looks south is on its left; what is above is on top."""
    camera = SkyCamera.of_field(6000, 4000, 0.6)
    attitude = attitude_of(*np.radians([azimuth, elevation]))
    assert np.degrees(axis_of(attitude)) == pytest.approx((azimuth, elevation))
    site = Site(np.radians(47.0), air=Air(280.0, 0.0), aberration=0.0)

    def seen(azimuth, elevation, attitude):
        z, a = np.radians(90 - elevation), np.radians(azimuth)
        standard = np.array([[-np.tan(z) * np.cos(a), -np.tan(z) * np.sin(a)]])
        return project_sky(camera, attitude, site, site.places(standard, 1.0), 1.0)[0] - [3000, 2000]

    assert np.abs(seen(azimuth, elevation, attitude)).max() < 1e-6
    above, west = seen(azimuth, elevation + 1, attitude), seen(azimuth + 1, elevation, attitude)
    assert above == pytest.approx([0, -np.tan(np.radians(1)) * camera.values[0]], abs=1e-6)
    # West is to the right of south.
    assert west[0] > 50
    assert abs(west[1]) < 2
    # A camera turned clockwise by a right angle has what was above on its left.
    turned = seen(azimuth, elevation + 1, attitude_of(*np.radians([azimuth, elevation, 90])))
    assert turned == pytest.approx([above[1], 0], abs=1e-6)


def test_catalogue_and_prior_from_files(result, folder):
    """The stars that were seen, as a table, and the camera that came out: the same again, known better."""
    catalogue = result.night.catalogue
    stars = catalogue.take(np.unique(result.calibration.stars))
    head = "id,ra_deg,dec_deg,pm_ra_mas,pm_dec_mas,parallax_mas,magnitude"
    lines = [f"{head},ra_error_mas,dec_error_mas,pm_ra_error_mas,pm_dec_error_mas"]
    mas = 1e3 / ARCSEC
    for i, name in enumerate(stars.ids):
        values = [*np.degrees(stars.places[i]), *(mas * stars.proper_motions[i]), mas * stars.parallaxes[i]]
        values += [stars.magnitudes[i], *(mas * stars.errors[i])]
        lines.append(",".join([name, *map(repr, map(float, values))]))
    (folder / "stars.csv").write_text("\n".join(lines))
    (folder / "camera.json").write_bytes(result.camera.to_json())
    file = folder / "night.toml"
    text = file.read_text().replace(
        "faintest = 6.0", 'file = "stars.csv"\nepoch = 1991.25\nfaintest = 6.0\nweigh_stars = true'
    )
    file.write_text(text)
    night = read_night(file)
    assert night.catalogue.errors.min() > 0
    again = calibrate_night(night)
    errors = np.sqrt(np.diag(result.camera.covariance))
    assert np.abs((again.camera.values - result.camera.values) / errors).max() < 0.01
    assert len(again.document().table("stars").record()) == len(again.calibration.catalogue)
    file.write_text(text.replace("[camera]", '[camera]\nprior = "camera.json"'))
    known = calibrate_night(read_night(file))
    assert known.calibration.degrees_of_freedom == again.calibration.degrees_of_freedom + 9
    assert "Given" in [column.head for column in known.document().table("parameters").columns]
    named = {folder / name for name in ("images.csv", "stars.csv", "camera.json")}
    assert set(inputs(file)[1:]) == named
    (folder / "stars.csv").write_text(f"{head}\nx,1,2,3,4,5,\n")
    with pytest.raises(InputError, match="column magnitude: must have a value"):
        read_night(file)


@pytest.mark.parametrize("limit", [0.02, 0.1, 0.7, 3.0])
def test_nearest_images_are_those_of_all_distances(limit):
    generator = np.random.default_rng(31)
    points, others = generator.uniform(-1, 1, (200, 2)), generator.uniform(-1.2, 0.9, (300, 2))
    distance = np.linalg.norm(points[:, None] - others[None], axis=2)
    nearest = distance.argmin(axis=1)
    mutual = distance.argmin(axis=0)[nearest] == np.arange(200)
    expected = np.where(mutual & (distance.min(axis=1) <= limit), nearest, -1)
    assert (mutually_nearest(points, others, limit) == expected).all()
    assert (mutually_nearest(points, others[:0], limit) == -1).all()
    assert len(mutually_nearest(points[:0], others, limit)) == 0


def test_stars_near_are_all_in_the_frame(night, result):
    """Those of the field and some around it; all of them where the axis is level."""
    for exposure in result.exposures:
        near = stars_near(exposure, result.camera, night.site, night, 0.0)
        assert set(exposure.stars[exposure.stars >= 0]) <= set(near)
        assert len(near) < 0.2 * len(night.catalogue.ids)
    level = replace(result.exposures[0], attitude=np.array([np.pi / 2, 0.0, 0.0]))
    assert len(stars_near(level, result.camera, night.site, night, 0.0)) == len(night.catalogue.ids)


def test_mean_errors_of_the_catalogue():
    catalogue = Catalogue.hipparcos()
    first = catalogue.take(np.array([0]))
    # HIP 1: 1.29, 0.66 mas at 1991.25, and 1.25, 0.75 mas a year.
    assert first.mean_errors(1991.25)[0] / ARCSEC * 1e3 == pytest.approx([1.29, 0.66])
    assert first.mean_errors(2001.25)[0] / ARCSEC * 1e3 == pytest.approx(np.hypot([1.29, 0.66], [12.5, 7.5]))


def test_report_and_document(result):
    document = json.loads(result.to_json())
    assert [*map(str, result.messages)] == document["messages"]
    assert set(document["parameters"]) == set(result.camera.names)
    assert document["covariance"]["order"] == list(result.camera.names)
    assert len(document["exposures"]) == 5
    assert {"exposure", "star", "residual_px", "redundancy", "standardized"} <= set(document["images"][0])
    redundancy = sum(sum(image["redundancy"]) for image in document["images"])
    assert redundancy == pytest.approx(document["degrees_of_freedom"], rel=1e-9)


def test_command_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke(app, ["stellar-camera", "exposures", "--example", "--json", "r.json", "--plots"])
    assert run.exit_code == 0, run.output
    written = {path.name for path in (tmp_path / "night-calibrated").iterdir()}
    assert written == {
        "report.html",
        "report.txt",
        "camera.json",
        "camera.yaml",
        "camera-ros.yaml",
        "exposures.csv",
        "star-images.csv",
        "residuals.png",
        "tests.png",
        "correlations.png",
        "distortion.png",
    }
    camera = SkyCamera.read(tmp_path / "night-calibrated" / "camera.json")
    assert camera.known.all()
    assert json.loads((tmp_path / "r.json").read_text())["converged"]


def test_results_do_not_replace_the_input(folder, monkeypatch):
    monkeypatch.chdir(folder)
    assert inputs(Path("night.toml")) == [Path("night.toml"), Path("images.csv")]
    before = (folder / "images.csv").read_bytes()
    for target in ("night.toml", "images.csv"):
        run = CliRunner().invoke(app, ["stellar-camera", "exposures", "night.toml", "--json", target])
        assert run.exit_code == 1
        assert "must not be written over the input" in run.output
    assert (folder / "images.csv").read_bytes() == before
    assert not (folder / "night-calibrated").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[station]", "[sation]", coded("error.unknown.close", kind="table", name="sation")),
        ("latitude_deg", "lattitude_deg", coded("error.unknown.close", kind="key", name="lattitude_deg")),
        ("latitude_deg = 47.05", "latitude_deg = 147.05", coded("error.key", key="latitude_deg")),
        ("field_of_view_deg = 36.9", "field_of_view_deg = 236.9", coded("stars.field-of-view")),
        ("field_of_view_deg", "fov", coded("error.unknown", kind="key", name="fov")),
        ('utc = "2024-03-05T20:10:00.00"', 'utc = "yesterday"', coded("stars.utc")),
        ('utc = "2024-03-05T20:10:00.00"', 'utc = "2024-13-05T20:10:00.00"', coded("stars.utc-range")),
        (
            'name = "2"',
            'name = "1"',
            coded("error.key", table="exposures 1", key="name", message="error.repeated"),
        ),
        ('name = "2"', 'name = "6"', coded("error.unknown", kind="exposure", name="2")),
        ('file = "images.csv"', 'file = "nothing.csv"', "cannot be read"),
        (
            'file = "images.csv"',
            'files = "images.csv"',
            coded("error.unknown.close", kind="key", name="files"),
        ),
        ("sd_px = 0.1", "sd_px = 0.0", coded("error.key", key="sd_px")),
        ("sd_px = 0.1", 'sd_px = "small"', coded("error.key", table="images", key="sd_px")),
        ("[labels]", "[labels", "Expected"),
    ],
)
def test_bad_files_are_named(folder, old, new, message):
    file = folder / "night.toml"
    file.write_text(file.read_text().replace(old, new, 1))
    with pytest.raises(InputError, check=as_check(message)) as raised:
        calibrate_night(read_night(file))
    assert raised.value.file is not None


def test_bad_rows_are_named(folder):
    file = folder / "images.csv"
    lines = file.read_text().splitlines()
    for row, message in (
        ("1,12,x", "column y_px: must be a number, got 'x'"),
        ("1,12,", coded("error.column", column="y_px", message="error.empty")),
        ("9,1,1", coded("error.unknown", kind="exposure", name="9")),
    ):
        file.write_text("\n".join([*lines[:5], row, *lines[5:]]))
        with pytest.raises(InputError, check=as_check(message)) as raised:
            read_night(folder / "night.toml")
        assert (raised.value.file, raised.value.record) == (file, 6)
    file.write_text("exposure,x_px\n1,2\n")
    with pytest.raises(InputError, match="the column y_px is missing"):
        read_night(folder / "night.toml")
