"""Images with support data: published answers of usgscsm, a pair of the Lunar Reconnaissance Orbiter."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ephemeris_seconds import added_to_ephemeris_seconds
from golden_data import SHARED, needs
from photogram import Block, adjust
from photogram.formats.csm import SupportedImage, read_support
from photogram.formats.csm.isd import Polynomials, Positions, Turns, fitted, of_angles, to_angles
from photogram.formats.csm.photos import trajectory_of
from photogram.io.pvl import parsed
from photogram.network import Table, Trajectory

MOVING = SHARED / "moving"
OURS = np.diag([1.0, -1.0, -1.0])

pytestmark = [needs("moving", "csm"), needs("moving", "lro")]


def supported(name, **how):
    return SupportedImage(read_support(MOVING / "csm" / f"{name}.json"), name, **how)


@pytest.mark.parametrize(
    ("line", "sample", "ground"),
    [
        (8.0, 8.0, [9.99999500000, 0.0, 0.00999999500]),
        # Misses the body: the nearest point of the ray.
        (0.0, 4.0, [0.04799688020, -7.99961602495, 16.00004799688]),
    ],
)
def test_a_scanner_sees_what_was_published(line, sample, ground):
    found = supported("constVelocityLineScan").to_ground([line], [sample])
    np.testing.assert_allclose(found[0], ground, rtol=0, atol=1e-10)


def test_a_camera_that_looks_away_sees_what_was_published_first():
    # What usgscsm's own test of this image said before that program resampled positions.
    found = supported("orbitalLineScan").to_ground([8.5], [8.0])
    published = [999999.67040488799, 0.0, -811.90523782723039]
    np.testing.assert_allclose(found[0], published, rtol=1e-13, atol=1e-9)


def test_resampled_positions_see_what_was_published_later():
    # 25 positions evenly spaced, of the 16 records by cubics with their velocities, and polynomials through
    # these: velocities of 1.05 km/s beside places 1 km apart in a second move them by up to 0.48 m.
    own = supported("orbitalLineScan")
    records = own.isd.position
    times = np.linspace(records.times[0], records.times[-1], 25)
    joined = replace(own.isd, position=replace(records, interpolation="hermite"))
    places, *_ = trajectory_of(joined, "t").flown(times, *np.zeros((2, 0, 3)))
    isd = replace(own.isd, position=Positions(times, places))
    found = SupportedImage(isd, "resampled").to_ground([8.5], [8.0])
    published = [999999.67004351015, 0.0, -812.35021438796923]
    np.testing.assert_allclose(found[0], published, rtol=1e-13, atol=1e-9)


def test_jitter_shifts_what_a_frame_has_measured(tmp_path):
    still = json.loads((MOVING / "csm" / "jitterFramer.json").read_text())
    del still["jitter"]
    (tmp_path / "still.json").write_text(json.dumps(still))
    other = SupportedImage(read_support(tmp_path / "still.json"), "still")
    np.testing.assert_allclose(
        supported("jitterFramer").to_ground([8.0], [8.0]),
        other.to_ground([7.75], [8.25]),
        rtol=0,
        atol=1e-9,
    )
    assert np.abs(other.to_ground([7.75], [8.25]) - other.to_ground([8.0], [8.0])).max() > 10


@pytest.mark.parametrize("name", ["constVelocityLineScan", "jitterFramer"])
@pytest.mark.parametrize("pixels", ["csm", "isis"])
def test_pixels_are_found_again_from_the_ground(name, pixels):
    image = supported(name, pixels=pixels)
    lines, samples = (each.ravel() for each in np.mgrid[0:17, 0:17] + (0.5 if pixels == "isis" else 0.0))
    back = image.to_image(image.to_ground(lines, samples))
    np.testing.assert_allclose(back, np.column_stack([lines, samples]), rtol=0, atol=1e-9)


def test_the_pixels_of_isis_are_half_a_pixel_from_those_of_csm():
    # A frame: the same numbers of pixels, counted from the same edge, lie half a pixel of the detector apart.
    csm, isis = (supported("jitterFramer", pixels=pixels) for pixels in ("csm", "isis"))
    (_, first), (_, other) = csm.coordinates([4.0], [5.0]), isis.coordinates([4.5], [5.5])
    np.testing.assert_allclose(other - first, [[0.05, -0.05]], atol=1e-12)


def test_lines_that_do_not_fit_their_tables_are_told():
    isd = read_support(MOVING / "csm" / "orbitalLineScan.json")
    [remark] = isd.remarks
    values = [round(remark.fields[name], 4) for name in ("lines", "span", "table", "percent")]
    assert (remark.code, values) == ("csm.duration", [16, 1.6, 1.5, 6.25])
    assert not read_support(MOVING / "csm" / "constVelocityLineScan.json").remarks


# ---------------------------------------------------------------------------- Lunar Reconnaissance Orbiter

SIDES = ("L", "R")


@pytest.fixture(scope="module")
def lro():
    return json.loads((MOVING / "lro" / "lro.json").read_text())


@pytest.fixture(scope="module")
def isds():
    return {side: read_support(MOVING / "lro" / f"observationImage{side}.isd") for side in SIDES}


@pytest.fixture(scope="module")
def measures(lro):
    """Return samples and lines, (46, 2) by side, in the order of the points."""
    path = MOVING / "lro" / "observationPair.net"
    network = parsed(path.read_text(), path).groups("ControlNetwork")[0]
    points = {each.get("PointId"): each for each in network.groups("ControlPoint")}
    found = {side: [] for side in SIDES}
    for name in lro["points"]:
        for own in points[name].groups("ControlMeasure"):
            found[own.get("SerialNumber")[-1]].append([own.get("Sample"), own.get("Line")])
    return {side: np.array(own, dtype=float) for side, own in found.items()}


@pytest.mark.parametrize("side", SIDES)
def test_the_times_of_lines_take_what_the_keywords_say(side, lro, isds):
    truth, isd = lro["images"][side], isds[side]
    (first, zero, rate) = np.asarray(isd.lines.table)[0]
    assert first == 0.0
    assert zero == pytest.approx(truth["line_time_zero"], abs=1e-6)
    assert rate == pytest.approx(truth["seconds_per_line"], rel=1e-9)
    assert isd.remarks[0].code == "csm.drift"
    # The span of its own tables, to a microsecond.
    assert isd.lines.times([isd.size[1]])[0] == pytest.approx(isd.pointing.times[-1], abs=2e-6)


@pytest.mark.parametrize("side", SIDES)
def test_three_angles_as_polynomials(side, lro, isds):
    truth, isd = lro["images"][side], isds[side]
    fit = fitted(isd.pointing.times, to_angles(isd.pointing.matrices), 2)
    assert (fit.reference, fit.scale) == pytest.approx(
        (truth["reference_time"], truth["time_scale"]), rel=1e-12
    )
    np.testing.assert_allclose(np.rad2deg(fit.coefficients), truth["coefficients_deg"], rtol=1e-9)
    np.testing.assert_allclose(of_angles(fit.at(isd.pointing.times)), isd.pointing.matrices, atol=1e-4)


@pytest.mark.parametrize("side", SIDES)
def test_a_pointing_of_polynomials_is_that_of_its_angles(side, isds):
    isd = isds[side]
    first, last = isd.pointing.times[[0, -1]]
    fit = fitted(isd.pointing.times, to_angles(isd.pointing.matrices), 2)
    sampled, angles = fit.sampled(first, last)
    polynomial = replace(isd, pointing=Turns(sampled, of_angles(angles), "lagrange"))
    on = trajectory_of(polynomial, side, interpolation="isis")
    assert on.table.interpolation == "linear"
    times = np.linspace(first, last, 1001)
    _, turned, *_ = Trajectory(side, on.table).flown(times, *np.zeros((2, 0, 3)))
    expected = np.swapaxes(of_angles(fit.at(times)), 1, 2) @ OURS
    # A turn of 1e-3 rad a second, times that have 6e-8 s of resolution.
    np.testing.assert_allclose(turned.reshape(-1, 3, 3), expected, rtol=0, atol=3e-10)


def held(side, lro, isds, measures):
    """Return the image on a trajectory with the published pointing, a record at each measured line."""
    isd = isds[side]
    fit = fitted(isd.pointing.times, to_angles(isd.pointing.matrices), 2)
    pointing = lro["published"]["pointing_deg"][side]
    a1, a2 = np.deg2rad([pointing["right_ascension"], pointing["declination"]])
    angles = Polynomials(np.array([a1, a2, [*fit.coefficients[2], 0.0]]), fit.reference, fit.scale)
    own = trajectory_of(isd, side, interpolation="isis")
    at = np.unique(isd.lines.times(measures[side][:, 1] - 0.5))
    at = np.concatenate([[at[0] - 1e-2], at, [at[-1] + 1e-2]])
    attitudes = np.swapaxes(of_angles(angles.at(at)), 1, 2) @ OURS
    table = Table(own.table.times, own.table.positions, at, attitudes)
    on = Trajectory(side, table, body=own.body)
    return SupportedImage(isd, side, pixels="isis", interpolation="isis", trajectory=on)


def to_pixels(residuals):
    """Return x and y, millimetres with y up, as lines and samples of ISIS."""
    return residuals * [1.0, -1.0] / 0.007


def test_the_published_pointing_holds(lro, isds, measures):
    images = [held(side, lro, isds, measures) for side in SIDES]
    truth = lro["pointing_held"]
    latitude, longitude, radius = np.array(truth["points"]).T
    solved = 1000 * np.column_stack(
        [
            radius * np.cos(latitude) * np.cos(longitude),
            radius * np.cos(latitude) * np.sin(longitude),
            radius * np.sin(latitude),
        ]
    )
    count = len(solved)
    fixed = np.array(lro["fixed"])
    block = Block(
        photo_ids=list(SIDES),
        photo_positions=np.zeros((2, 3)),
        photo_attitudes=np.zeros((2, 3)),
        point_positions=np.where(fixed[:, np.newaxis], solved, solved + np.array([300.0, -200.0, 100.0])),
        point_sd=np.where(fixed[:, np.newaxis], 0.0, np.full((count, 3), np.inf)),
        image_photos=np.repeat([0, 1], count),
        image_points=np.tile(np.arange(count), 2),
        image_xy=np.concatenate(
            [each.coordinates(*measures[side].T)[1] for each, side in zip(images, SIDES, strict=True)]
        ),
        image_sd=1.4 * 0.007,
        cameras=[each.camera for each in images],
        photo_cameras=[0, 1],
        timed=[each.timed[0] for each in images],
    )
    # Our own are exact; the figures are not.
    with added_to_ephemeris_seconds():
        result = adjust(block)
    residuals = to_pixels(result.residuals).reshape(2, count, 2)
    told = np.array([truth["fixed_points_residual_px"][side] for side in SIDES])
    np.testing.assert_allclose(residuals[:, fixed], told, rtol=0, atol=1e-8)
    expected = np.array([truth["residuals_px"][side] for side in SIDES])
    np.testing.assert_allclose(residuals, expected, rtol=0, atol=1e-5)
    sizes = np.linalg.norm(residuals, axis=2)
    assert sizes.mean() == pytest.approx(truth["average_residual_px"], abs=1e-8)
    np.testing.assert_allclose(result.point_positions, solved, rtol=0, atol=0.1)
    # The same by the projected form: the line at whose time each point is seen, along a line behind its lens.
    for image, side, sense, own in zip(images, SIDES, (1.0, -1.0), residuals, strict=True):
        apart = measures[side] - image.to_image(result.point_positions)[:, ::-1]
        np.testing.assert_allclose(sense * apart[:, 0], own[:, 1], rtol=0, atol=0.01)
