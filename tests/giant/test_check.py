"""The check of a project: faults planted in simulated blocks are found and named, clean blocks pass."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from message_codes import nested_codes
from photogram import Spheroid, diagnose, simulate
from photogram.cli import app
from photogram.diagnosis.conventions import KAPPA, TURNS
from photogram.diagnosis.sections import parts_of
from photogram.diagnosis.sets import exchange
from photogram.giant import Limits, Project, write_project
from photogram.giant.checking import check
from photogram.network.motion import kept_images, of_photos
from photogram.network.point_sets import strips_of
from photogram.network.rays import Rays
from photogram.show.quantity import Table

GULF = {"spheroid": Spheroid.clarke_1866(), "origin": (math.radians(-95), math.radians(29.5), 0.0)}


@pytest.fixture(scope="module")
def block():
    """Four strips of ten photos, 40 points on a photo, coarse stations."""
    return simulate(points_per_photo=40, seed=1).block


def checked(block, **options):
    return diagnose(Project.from_block(block), **options)


def found(outcome, kind):
    return [finding for finding in outcome.findings if finding.kind == kind]


def changed(block, name, row, column, amount):
    values = getattr(block, name).copy()
    values[row, column] += amount
    return block.replace(**{name: values})


def image(block, photo, least_rays=3, skip=5):
    """Row of an image on a photo whose point has several rays and is a pass point."""
    rays = np.bincount(block.image_points)
    rows = np.flatnonzero(block.image_photos == block.photo_ids.index(photo))
    plain = np.isnan(block.point_positions[block.image_points[rows]]).all(axis=1)
    return int(rows[(rays[block.image_points[rows]] >= least_rays) & plain][skip])


# Clean blocks


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("space", [{}, GULF], ids=["rectangular", "geographic"])
def test_a_clean_block_has_no_grave_finding(seed, space):
    block = simulate(
        strips=1 + seed % 4,
        points_per_photo=20 + 10 * (seed % 3),
        photo_to_ground=seed % 2 == 1,
        seed=seed,
        **space,
    ).block
    outcome = checked(block)
    assert outcome.grave == []
    assert outcome.result.converged
    assert len(outcome.findings) <= 3


def test_the_packaged_example_passes():
    from importlib.resources import as_file, files

    from photogram.giant import read_project

    with as_file(files("photogram") / "examples" / "galveston") as directory:
        outcome = diagnose(read_project(directory))
    assert outcome.grave == []


# Step 1: intersection


@pytest.mark.giant("13", "1 blunder edit by intersection")
def test_section_13_the_first_run_of_appendix_h_accuses_nobody_on_the_clean_sample():
    from importlib.resources import as_file, files

    from photogram import adjust
    from photogram.giant import read_project

    with as_file(files("photogram") / "examples" / "galveston") as directory:
        sample = read_project(directory).to_block()
    clean = adjust(sample.with_fixed_photos()).verdict
    assert (clean.code, clean.exit, clean.warning) == ("intersection", 0, True)
    assert clean.message.code == "verdict.intersection"
    assert not clean.outlying
    row = image(sample, "SH9960", least_rays=3)
    spoilt = adjust(changed(sample, "image_xy", row, 1, 0.5).with_fixed_photos()).verdict
    assert (spoilt.code, spoilt.exit) == ("gross-errors", 4)
    assert f"1) image of point {sample.point_ids[sample.image_points[row]]} on photo" in spoilt.headline
    assert "held" not in spoilt.headline
    assert "--snoop" not in spoilt.headline


@pytest.mark.giant("13", "2 elevation check: sign of the principal distance, kappa")
@pytest.mark.parametrize("space", [{}, GULF], ids=["rectangular", "geographic"])
def test_section_13_the_sign_of_the_principal_distance(space):
    block = simulate(points_per_photo=30, seed=2, **space).block
    outcome = checked(block.replace(principal_distances=-block.principal_distances))
    (sign,) = found(outcome, "sign-of-principal-distance")
    assert sign.level == "grave"
    assert nested_codes(sign)[:2] == ["convention.likely", "mistake.c or kappa"]
    assert sign.photos == block.photo_ids
    above = found(outcome, "control-above-camera")
    control = np.isfinite(block.point_sd).any(axis=1)
    assert sorted(name for finding in above for name in finding.points) == [
        name for name, of in zip(block.point_ids, control, strict=True) if of
    ]
    # The sign comes before kappa in the text, and with it put right the rest of the block is clean.
    assert above[0].phrase.fields["point"] == above[0].points[0]
    assert {finding.kind for finding in outcome.grave} == {
        "sign-of-principal-distance",
        "control-above-camera",
    }
    assert outcome.result.converged


@pytest.mark.giant("13", "2 elevation check: sign of the principal distance, kappa")
def test_section_13_the_sign_of_one_of_two_cameras(block):
    distances = block.principal_distances.copy()
    xy = block.image_xy.copy()
    distances[20:] *= 2
    xy[block.image_photos >= 20] *= 2
    distances[20:] *= -1
    (sign,) = found(
        checked(block.replace(principal_distances=distances, image_xy=xy)), "sign-of-principal-distance"
    )
    assert sign.photos == block.photo_ids[20:]


@pytest.mark.giant("13", "2 elevation check: sign of the principal distance, kappa")
@pytest.mark.parametrize(
    ("turn", "name"), [(np.pi, "c or kappa"), (np.pi / 2, "kappa + 90"), (-np.pi / 2, "kappa - 90")]
)
@pytest.mark.parametrize("photo_to_ground", [False, True])
def test_section_13_the_kappa_of_one_photo(turn, name, photo_to_ground):
    block = simulate(points_per_photo=30, seed=3, photo_to_ground=photo_to_ground).block
    outcome = checked(changed(block, "photo_attitudes", block.photo_ids.index("0304"), 2, turn))
    (kappa,) = found(outcome, "kappa")
    assert (kappa.level, kappa.photos) == ("grave", ["0304"])
    assert f"mistake.{name}" in nested_codes(kappa)
    assert {finding.kind for finding in outcome.grave} <= {"kappa", "control-above-camera"}


@pytest.mark.giant("13", "2 elevation check: sign of the principal distance, kappa")
def test_section_13_the_kappa_of_all_photos(block):
    outcome = checked(changed(block, "photo_attitudes", slice(None), 2, np.pi / 2))
    (kappa,) = found(outcome, "kappa")
    assert kappa.photos == block.photo_ids
    assert "mistake.kappa + 90" in nested_codes(kappa)


def test_the_sense_of_rotation():
    # North to the right, so that the senses differ.
    block = simulate(points_per_photo=30, seed=3).block
    turned = block.photo_positions[:, [1, 0, 2]] * [-1, 1, 1]
    known = block.point_positions[:, [1, 0, 2]] * [-1, 1, 1]
    block = block.replace(
        photo_positions=turned,
        point_positions=known,
        point_sd=block.point_sd[:, [1, 0, 2]],
        photo_attitudes=block.photo_attitudes + np.array([0, 0, np.pi / 2]),
    )
    kinds = {True: checked(block), False: checked(block.replace(photo_to_ground=True))}
    assert {finding.kind for finding in kinds[True].grave} & {"kappa", "sense-of-rotation"} == set()
    (finding,) = [each for each in kinds[False].grave if each.kind != "control-above-camera"]
    assert finding.kind == "sense-of-rotation"
    # With kappa near +-90 degrees the other sense turns every photo over, as the sign would.
    assert "mistake.sense" in nested_codes(finding)


@pytest.mark.giant("13", "1 blunder edit by intersection")
def test_section_13_exchanged_point_names(block):
    one, other = image(block, "0203"), image(block, "0203", skip=9)
    xy = block.image_xy.copy()
    xy[[one, other]] = xy[[other, one]]
    outcome = checked(block.replace(image_xy=xy))
    (exchanged,) = outcome.grave
    assert (exchanged.kind, exchanged.photos) == ("exchanged-points", ["0203"])
    assert set(exchanged.points) == {block.point_ids[block.image_points[row]] for row in (one, other)}


@pytest.mark.giant("13", "1 blunder edit by intersection")
def test_section_13_exchanged_point_names_on_a_photo_with_a_large_pattern():
    # The station of the photo is the coarsest: its residuals are larger than those of the other photos.
    size = {"strips": 2, "photos_per_strip": 6, "points_per_photo": 48, "side_overlap": 0.2}
    block = simulate(
        **size, control_spacing=4, control_sd=0.05, photo_to_ground=False, seed=1026, **GULF
    ).block
    rows = np.flatnonzero(block.image_photos == block.photo_ids.index("0104"))
    names = {"P000161", "P000166"}
    one, other = (row for row in rows if block.point_ids[block.image_points[row]] in names)
    xy = block.image_xy.copy()
    xy[[one, other]] = xy[[other, one]]
    (exchanged,) = checked(block.replace(image_xy=xy)).grave
    assert (exchanged.kind, exchanged.photos, set(exchanged.points)) == ("exchanged-points", ["0104"], names)


@pytest.mark.giant("13", "1 blunder edit by intersection")
def test_section_13_a_gross_plate_error_is_seen_by_intersection(block):
    row = image(block, "0305", least_rays=4)
    outcome = checked(changed(block, "image_xy", row, 1, 40.0))
    (gross,) = outcome.grave
    assert (gross.kind, gross.photos) == ("gross-error", ["0305"])
    assert gross.points == [block.point_ids[block.image_points[row]]]


@pytest.mark.giant("13", "1 blunder edit by intersection")
@pytest.mark.parametrize("seed", range(4))
def test_section_13_a_bad_frame(seed):
    # Small blocks: the neighbours of the bad photo are most of the photos.
    block = simulate(strips=2, photos_per_strip=4 + seed, points_per_photo=30, seed=seed).block
    rng = np.random.default_rng(seed)
    name = block.photo_ids[int(rng.integers(len(block.photo_ids)))]
    rows = np.flatnonzero(block.image_photos == block.photo_ids.index(name))
    xy = block.image_xy.copy()
    xy[rows] = xy[rng.permutation(rows)]
    outcome = checked(block.replace(image_xy=xy))
    (bad,) = outcome.grave
    assert (bad.kind, bad.photos) == ("bad-photo", [name])
    assert name not in outcome.result.block.photo_ids
    assert outcome.result.converged


@pytest.mark.parametrize("mirror", [name for name in TURNS if name not in KAPPA])
@pytest.mark.parametrize("seed", range(3))
def test_a_mirrored_photo_is_named_once(mirror, seed):
    block = simulate(
        strips=2, photos_per_strip=5, points_per_photo=40, photo_to_ground=seed == 1, seed=seed
    ).block
    photo = 3 * seed
    rows = block.image_photos == photo
    xy = block.image_xy.copy()
    xy[rows] = xy[rows] @ np.transpose(TURNS[mirror])
    outcome = checked(block.replace(image_xy=xy))
    (mirrored,) = outcome.grave
    assert (mirrored.kind, mirrored.photos) == ("mirrored", [block.photo_ids[photo]])
    assert f"mistake.{mirror}" in nested_codes(mirrored)
    assert outcome.result.converged


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("strips", [1, 3])
def test_mirrored_plates_of_all_photos_are_named_once(axis, strips):
    # Within a strip the rays meet though y has the wrong sign; the control tells.
    block = simulate(strips=strips, points_per_photo=40, seed=7).block
    xy = block.image_xy.copy()
    xy[:, axis] *= -1
    outcome = checked(block.replace(image_xy=xy))
    (mirrored,) = outcome.grave
    assert (mirrored.kind, mirrored.photos) == ("mirrored", block.photo_ids)
    assert f"mistake.{('mirrored', 'y down')[axis]}" in nested_codes(mirrored)
    assert outcome.result.converged


@pytest.mark.giant("13", "1 blunder edit by intersection")
@pytest.mark.giant("13", "8 control: differences")
def test_section_13_control_far_off_is_seen_by_intersection(block):
    point = int(np.flatnonzero(np.isfinite(block.point_sd[:, 0]))[3])
    outcome = checked(changed(block, "point_positions", point, 1, 3000.0))
    (difference,) = found(outcome, "control-difference")
    assert (difference.level, difference.points) == ("grave", [block.point_ids[point]])
    assert difference.phrase.fields["axis"] == "Y"


# Step 2: adjustment


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
@pytest.mark.parametrize(("photo", "axis"), [("0106", 1), ("0302", 0), ("0409", 1)])
def test_section_13_a_gross_error_of_a_fifth_of_a_millimetre(block, photo, axis):
    row = image(block, photo, least_rays=4, skip=2)
    outcome = checked(changed(block, "image_xy", row, axis, 0.2))
    (blunder,) = outcome.grave
    assert (blunder.kind, blunder.photos) == ("blunder", [photo])
    assert blunder.points == [block.point_ids[block.image_points[row]]]
    assert blunder.values["error_um"] == pytest.approx(200, abs=60)
    assert blunder.phrase.fields["component"] == "xy"[axis]


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_with_two_rays_both_images_are_named(block):
    row = image(block, "0105", least_rays=2, skip=0)
    rays = np.bincount(block.image_points)
    row = next(
        row for row in np.flatnonzero(block.image_photos == 4).tolist() if rays[block.image_points[row]] == 2
    )
    others = block.image_photos[block.image_points == block.image_points[row]]
    outcome = checked(changed(block, "image_xy", row, 1, 0.3))
    (blunder,) = outcome.grave
    assert set(blunder.photos) == {block.photo_ids[photo] for photo in others}
    assert "check.rival.two-rays" in nested_codes(blunder)


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_blunders_do_not_drag_others_along():
    simulation = simulate(points_per_photo=40, blunders=8, blunder_size=0.3, seed=21)
    block = changed(simulation.block, "image_xy", image(simulation.block, "0203", 4), 0, 3.0)
    outcome = checked(block)
    points = {block.point_ids[block.image_points[row]] for row in simulation.blunders.images}
    points.add(block.point_ids[block.image_points[image(simulation.block, "0203", 4)]])
    named = {point for finding in outcome.grave for point in finding.points}
    assert named <= points
    assert len(named) >= 6


@pytest.mark.giant("13", "8 control: differences")
@pytest.mark.parametrize(
    ("axes", "remedy"),
    [([2], "height"), ([0], "plan")],
)
def test_section_13_a_wrong_control_coordinate(block, axes, remedy):
    point = int(np.flatnonzero(np.isfinite(block.point_sd[:, 0]))[3])
    outcome = checked(changed(block, "point_positions", point, axes, 20.0))
    (misfit,) = outcome.grave
    assert (misfit.kind, misfit.points) == ("control-misfit", [block.point_ids[point]])
    assert {f"check.remedy.{remedy}", "check.remedy.type"} < {*nested_codes(misfit)}
    assert misfit.phrase.fields["components"][0].fields["error"] == pytest.approx(20, abs=4)


@pytest.mark.giant("13", "8 control: differences")
@pytest.mark.parametrize(("seed", "photos"), [(1, 10), (2, 6), (3, 4), (4, 4)])
def test_section_13_exchanged_control_hides_no_blunder(seed, photos):
    block = simulate(strips=2, photos_per_strip=photos, points_per_photo=40, seed=seed).block
    rng = np.random.default_rng(seed)
    points = rng.permutation(np.flatnonzero(np.isfinite(block.point_sd).all(axis=1)))[:2]
    exchanged = exchange(block, tuple(points.tolist()))
    row = image(block, "0103", least_rays=3)
    outcome = checked(changed(exchanged, "image_xy", row, 0, 1.0))
    control, other = sorted(outcome.grave, key=lambda finding: finding.kind != "exchanged-control")
    assert (control.kind, set(control.points)) == (
        "exchanged-control",
        {block.point_ids[point] for point in points},
    )
    assert other.points == [block.point_ids[block.image_points[row]]]
    assert outcome.result.converged


@pytest.mark.giant("13", "8 control: differences")
def test_section_13_a_gross_error_of_control_is_given_in_full_and_spoils_nothing(block):
    point = int(np.flatnonzero(np.isfinite(block.point_sd[:, 0]))[3])
    outcome = checked(changed(block, "point_positions", point, 1, 3000.0))
    (misfit,) = found(outcome, "control-misfit")
    assert misfit.points == [block.point_ids[point]]
    assert "check.remedy.plan" in nested_codes(misfit)
    assert misfit.phrase.fields["components"][0].fields["error"] == pytest.approx(3000, abs=2)
    # X and Z of the point agree with their predictions and are held again.
    row = outcome.result.block.point_ids.index(misfit.points[0])
    assert np.isfinite(outcome.result.block.point_sd[row]).tolist() == [True, False, True]


@pytest.mark.parametrize("photos", [5, 8])
def test_a_photo_turned_by_180_degrees_departs_by_180_degrees(photos):
    from photogram.diagnosis.stations import stations

    block = simulate(strips=1, photos_per_strip=photos, points_per_photo=30, crab=0.001, seed=4).block
    turned = changed(block, "photo_attitudes", 2, 2, np.pi)
    (off,) = [each for each in stations(turned, None).findings if "kappa" in each.text]
    assert off.photos == [block.photo_ids[2]]
    assert abs(off.values["departure"]) == pytest.approx(180, abs=3)


@pytest.mark.giant("13", "7 outlying stations")
def test_section_13_an_outlying_initial_station(block):
    outcome = checked(changed(block, "photo_positions", 7, 1, 2000.0))
    moved = found(outcome, "moved-station") + found(outcome, "bad-photo")
    assert {name for finding in moved for name in finding.photos} == {"0108"}
    assert outcome.result.converged


@pytest.mark.giant("13", "7 outlying stations")
def test_section_13_a_station_off_the_path_without_an_adjustment(block):
    from photogram.diagnosis.stations import stations

    one = changed(block, "photo_positions", block.photo_ids.index("0305"), 2, 900.0)
    one = changed(one, "photo_attitudes", block.photo_ids.index("0407"), 2, 0.6)
    section = stations(one, None)
    assert {(finding.kind, *finding.photos) for finding in section.findings} == {
        ("outlying-station", "0305"),
        ("outlying-station", "0407"),
    }
    departures = [each.values["departure"] for each in section.findings]
    assert min(abs(np.array(departures) - 900)) < 60
    assert any("kappa by 3" in finding.text for finding in section.findings)


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_the_height_of_a_two_ray_point():
    # Along the flight line, here x, so that no residual shows it.
    block = simulate(points_per_photo=60, image_sd=0.005, relief=30.0, seed=5).block
    rays = np.bincount(block.image_points)
    row = next(
        row
        for row in np.flatnonzero(block.image_photos == block.photo_ids.index("0205")).tolist()
        if rays[block.image_points[row]] == 2 and abs(block.image_xy[row]).max() < 100
    )
    outcome = checked(changed(block, "image_xy", row, 0, 0.5))
    (height,) = found(outcome, "two-ray-height")
    assert height.points == [block.point_ids[block.image_points[row]]]
    assert abs(height.values["departure"]) > 10


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_a_pattern_that_all_photos_share(block):
    # A bent fiducial edge: no position or attitude takes that up.
    bent = np.column_stack([np.zeros(len(block.image_xy)), 0.03 * (block.image_xy[:, 0] / 115) ** 2])
    outcome = checked(block.replace(image_xy=block.image_xy + bent))
    (pattern,) = found(outcome, "systematic-pattern")
    assert pattern.phrase.code == "pattern.frame"
    assert abs(pattern.phrase.fields["dy"]) > 5 * abs(pattern.phrase.fields["dx"])
    assert found(checked(block), "systematic-pattern") == []


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_a_pattern_of_one_photo():
    block = simulate(points_per_photo=100, seed=8).block
    xy = block.image_xy.copy()
    rows = block.image_photos == block.photo_ids.index("0305")
    # Sheared film: what position and attitude take up is little.
    xy[rows] += 0.03 * np.column_stack([xy[rows, 1], xy[rows, 0]]) / 115
    outcome = checked(block.replace(image_xy=xy))
    assert "0305" in {name for finding in found(outcome, "photo-pattern") for name in finding.photos}


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_a_lens_that_is_not_corrected_is_named(block):
    # Radial distortion bends the whole block and leaves hardly a residual.
    radius2 = (block.image_xy**2).sum(axis=1, keepdims=True) / 115**2
    outcome = checked(block.replace(image_xy=block.image_xy + 0.06 * radius2 * block.image_xy / 115))
    (common,) = found(outcome, "common-error")
    assert common.level == "grave"
    first, second, *_ = common.phrase.fields["errors"]
    assert first.fields["named"].code == "hypothesis.camera-radial"
    assert second.fields["named"].code == "hypothesis.bending"


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_residuals_grow_with_the_number_of_rays(block):
    outcome = checked(block)
    (section,) = [section for section in outcome.sections if section.title.startswith("Patterns")]
    (table,) = [part for part in section.parts if isinstance(part, Table)]
    rays, images, rms, _ = (column.values for column in table.columns)
    assert list(rays) == sorted(set(np.bincount(block.image_points)))
    assert sum(images) == len(block.image_xy)
    assert rms[0, 0] < rms[-1, 0] / 2


@pytest.mark.giant("13", "9 key numbers")
def test_section_13_the_key_numbers(block):
    outcome = checked(block)
    (section,) = [section for section in outcome.sections if section.title == "Key numbers"]
    facts = {fact.name: fact.value for part in section.parts for fact in part.facts}
    assert any(value.startswith(f"{outcome.result.variance_of_unit_weight:.4f}") for value in facts.values())
    iterations = [name for name in facts if "iteration" in name]
    assert len(iterations) == len(outcome.result.iterations)
    (weights,) = found(checked(block.replace(image_sd=np.array(0.03))), "weights")[:1]
    assert weights.phrase.fields["variance"] == pytest.approx(0.1, abs=0.05)


@pytest.mark.giant("13", "9 key numbers")
def test_section_13_standard_deviations_beyond_the_usual_are_remarked_on(block):
    findings = found(checked(block.replace(image_sd=np.array(0.03))), "weights")
    usual = next(each.phrase.fields for each in findings if each.phrase.code == "check.weights.usual")
    assert (usual["least"], usual["most"]) == (5.0, 15.0)


@pytest.mark.giant("13", "3 clean-up")
def test_section_13_clean_up_without_control(block):
    unknown = np.full_like(block.point_positions, np.nan)
    loose = block.replace(point_positions=unknown, point_sd=np.array(np.inf))
    rows = [image(block, photo, least_rays=4) for photo in ("0106", "0305")]
    outcome = checked(changed(loose, "image_xy", rows, 1, [0.2, -0.3]))
    assert outcome.result.converged
    named = {(finding.kind, *finding.photos, *finding.points) for finding in outcome.grave}
    points = [block.point_ids[block.image_points[row]] for row in rows]
    assert named == {("blunder", "0106", points[0]), ("blunder", "0305", points[1])}


# What cannot be adjusted, and structure


def test_a_block_that_cannot_be_adjusted_says_why(block):
    rng = np.random.default_rng(2)
    outcome = checked(block.replace(image_xy=rng.uniform(-100, 100, block.image_xy.shape)))
    assert found(outcome, "rays-do-not-meet")
    assert outcome.grave
    assert "Key numbers" in outcome.report()


@pytest.mark.giant("13", "6 residual reading: 3-sigma, patterns, heights of two-ray points")
def test_section_13_parts_without_a_common_point(block):
    points = block.image_points.copy()
    upper = block.image_photos >= 20
    names = [*block.point_ids, *(f"U{name}" for name in block.point_ids)]
    points[upper] += len(block.point_ids)
    unknown = np.full_like(block.point_positions, np.nan)
    split = block.replace(
        image_points=points,
        point_ids=names,
        point_positions=np.vstack([block.point_positions, unknown]),
        point_sd=np.vstack([block.point_sd, np.full_like(unknown, np.inf)]),
    )
    (part,) = found(checked(split), "separate-part")
    assert part.photos in (block.photo_ids[20:], block.photo_ids[:20])
    assert sorted(set(parts_of(split).tolist())) == [0, 20]


@pytest.mark.giant("11", "station without enough rays")
def test_section_11_photos_with_few_ties_are_named(block):
    kept = np.ones(len(block.image_xy), dtype=bool)
    rows = np.flatnonzero(block.image_photos == 12)
    kept[rows[2:]] = False
    names = ("image_photos", "image_points", "image_xy", "image_sd")
    outcome = checked(block.replace(**{name: getattr(block, name)[kept] for name in names}))
    (few,) = found(outcome, "few-ties")
    assert few.photos == ["0203"]


@pytest.mark.giant("11", "POINTS NOT PHOTOGRAPHED")
@pytest.mark.giant("11", "PASS POINTS APPEARING ON MORE THAN n PHOTOGRAPHS")
def test_section_11_warnings_stand_in_the_check(block):
    project = Project.from_block(block)
    project.ground.append(type(project.ground[0])("NOWHERE", (1.0, 2.0, 3.0)))
    outcome = check(project, limits=Limits(photos_per_point=5))
    facts = {fact.name: fact.value for fact in outcome.sections[0].parts[1].facts}
    assert facts["Points not photographed"] == "NOWHERE"
    assert "Pass points appearing on more than 5 photographs" in facts
    assert [finding.points for finding in found(outcome, "warning")][-1] == ["NOWHERE"]


# The parts


def test_rays_meet_where_the_points_are():
    for space in ({}, GULF):
        truth = simulate(points_per_photo=20, seed=6, **space).truth
        rays = Rays.of(truth)
        met = rays.intersect()
        assert met.in_front.all()
        assert np.abs(met.residuals).max() < 1e-6
        np.testing.assert_allclose(met.positions, rays.axes.positions(truth.point_positions), atol=1e-4)
        back = rays.axes.from_local(met.positions) - truth.point_positions
        assert np.abs(back).max() < 1e-4


def test_strips_are_cut_where_the_flight_turns():
    truth = simulate(strips=3, photos_per_strip=6, points_per_photo=10, seed=1).truth
    strips = strips_of(truth.photo_positions)
    assert [strip.tolist() for strip in strips] == [list(range(first, first + 6)) for first in (0, 6, 12)]
    stray = truth.photo_positions.copy()
    stray[8] += [20000.0, 9000.0, 0]
    assert [strip.tolist() for strip in strips_of(stray)] == [strip.tolist() for strip in strips]
    assert [strip.tolist() for strip in strips_of(stray[:1])] == [[0]]


@pytest.mark.parametrize("seed", range(40))
def test_no_block_is_too_poor_or_too_bad_for_a_check(seed):
    rng = np.random.default_rng(seed)
    block = simulate(
        strips=1 + seed % 2,
        photos_per_strip=2 + seed % 4,
        points_per_photo=4 + seed % 9,
        control=("perimeter", "corners", "none")[seed % 3],
        seed=seed,
        **(GULF if seed % 2 else {}),
    ).block
    keep = rng.random(len(block.image_xy)) < rng.random()
    keep[0] = True
    block = kept_images(block, keep)
    without = np.ones(len(block.photo_ids), dtype=bool)
    without[np.unique(block.image_photos)] = False
    block = of_photos(block, ~without)
    gross = rng.random((len(block.image_xy), 1)) < 0.2 * (seed % 3)
    block = block.replace(image_xy=(block.image_xy + 30 * gross * rng.standard_normal(2)) * (seed % 10 > 0))
    outcome = checked(block)
    assert [section.title for section in outcome.sections][-1] == "Key numbers"
    assert json.loads(outcome.to_json())["grave"] == len(outcome.grave)
    assert outcome.report().endswith("\n")


def test_intersection_only_is_checked_with_fixed_stations(block):
    project = Project.from_block(block)
    project.common.intersection_only = True
    outcome = diagnose(project)
    (none,) = found(outcome, "no-adjustment")
    assert none.level == "look"
    assert "the stations are not adjusted ones" in none.text
    adjusted = checked(block).result
    final = block.replace(photo_positions=adjusted.photo_positions, photo_attitudes=adjusted.photo_attitudes)
    row = image(block, "0302", least_rays=4)
    project = Project.from_block(changed(final, "image_xy", row, 0, 0.3))
    project.common.intersection_only = True
    outcome = diagnose(project)
    np.testing.assert_array_equal(outcome.result.photo_positions, outcome.result.block.photo_positions)
    (blunder,) = outcome.grave
    assert blunder.photos == ["0302"]


def test_every_kind_of_finding_is_documented():
    root = Path(__file__).parents[2]
    package = root / "python" / "photogram"
    sources = "".join(path.read_text() for path in (package / "diagnosis").glob("*.py"))
    kinds = {*re.findall(r'"check\.([a-z]+(?:-[a-z]+)+)', sources)} | {
        *re.findall(r'finding\([^\n]*kind="([a-z-]+)"', sources)
    }
    text = (root / "docs" / "giant-check.md").read_text() + (root / "docs" / "check.md").read_text()
    assert {kind for kind in kinds if f"`{kind}`" not in text} == set()
    assert len(kinds) > 15


# Command line


def test_the_command(block, tmp_path):
    runner = CliRunner()
    write_project(Project.from_block(block), tmp_path / "clean")
    faulty = changed(block, "image_xy", image(block, "0302", least_rays=4), 0, 0.3)
    write_project(Project.from_block(faulty), tmp_path / "faulty")
    before = {path.name: path.read_bytes() for path in (tmp_path / "faulty").iterdir()}

    result = runner.invoke(app, ["giant", "check", str(tmp_path / "clean"), "--threads", "1"])
    assert result.exit_code == 0, result.output
    assert "grave" not in [line.split(";")[0] for line in result.stdout.splitlines()]
    document = tmp_path / "check.json"
    result = runner.invoke(
        app, ["giant", "check", str(tmp_path / "faulty"), "--json", str(document), "--quiet"]
    )
    assert (result.exit_code, result.stdout) == (3, "")
    found = json.loads(document.read_text())
    (blunder,) = [f for section in found["sections"] for f in section["findings"] if f["level"] == "grave"]
    assert (found["grave"], blunder["kind"], blunder["photos"]) == (1, "blunder", ["0302"])
    assert {path.name: path.read_bytes() for path in (tmp_path / "faulty").iterdir()} == before
    assert runner.invoke(app, ["giant", "check", str(tmp_path / "nowhere")]).exit_code == 1


@pytest.mark.giant("3", "limits are options, unlimited by default")
def test_section_3_limits_are_options_of_the_commands(block, tmp_path):
    write_project(Project.from_block(block), tmp_path / "block")

    def run(*arguments):
        result = CliRunner().invoke(app, ["giant", *arguments])
        return result.exit_code, result.output

    directory, out = str(tmp_path / "block"), ("--out", str(tmp_path / "out"), "--quiet")
    assert run("check", directory, "--quiet") == (0, "")
    assert run(directory, *out) == (0, "")
    code, output = run("check", directory, "--limits", "N1=39")
    assert code == 1
    assert "**CAMERA STATIONS EXCEEDED 39: there are 40" in output
    code, output = run(directory, *out, "--limits", "N6=7")
    assert code == 1
    assert "**ERROR IN SUBROUTINE MODID\nADDING VARIABLE" in output
