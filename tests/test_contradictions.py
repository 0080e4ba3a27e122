"""Whole pages, texts and documents of every program: no two sentences contradict each other."""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from contradictions import assert_one_judgement, contradictions, sentences_of
from photogram import Camera, adjust, diagnose, orient, plan, simulate, snoop, variance_components
from photogram.absolute_orientation import Stations
from photogram.absolute_orientation import read_csv as read_stations
from photogram.cli import app
from photogram.collection import adjust as adjust_collection
from photogram.collection import simulate as simulate_collection
from photogram.comparator import Grid, compare, listing, simulate_calibration
from photogram.comparator import calibrate as calibrate_comparator
from photogram.giant import Project, write_project
from photogram.perspective_center import run_deck
from photogram.perspective_center.document import set_document
from photogram.show.forms import titled_lines
from photogram.show.judgement import remarks_section

EXAMPLES = files("photogram") / "examples"


def see(result, document=True):
    """Hold page, text, document and exit code of a result against each other."""
    assert_one_judgement(
        result.verdict, result.document(), result.report(), result.to_json() if document else None
    )
    return result.verdict


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch):
    """Leave the pictures out that pages draw at once: they have no sentences."""
    monkeypatch.setattr("photogram.comparator.document.plotters", lambda _: {})


@pytest.fixture(scope="module")
def block():
    """Return a block with control and check points."""
    return simulate(
        strips=2, photos_per_strip=3, points_per_photo=40, control_spacing=1, check_points=6, seed=6
    ).block


def moved(block, row, shift):
    """Return a block with a point given elsewhere."""
    positions = block.point_positions.copy()
    positions[row] += shift
    return block.replace(point_positions=positions)


def with_image(block, shift, count=1):
    """Return a block with gross errors of images."""
    xy = block.image_xy.copy()
    best = np.argsort(-adjust(block).redundancy.min(axis=1))[:count]
    xy[best, 0] += shift
    return block.replace(image_xy=xy)


def held(block):
    """Return rows of held points."""
    return np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))


def checks(block):
    """Return rows of check points."""
    return np.flatnonzero(adjust(block).point_kinds == "check")


def contradicting(block):
    """Return a block whose points are held where they are not."""
    wrong = moved(block, held(block)[1], [0.0, 0.0, 30.0])
    return wrong.replace(point_sd=np.where(np.isfinite(wrong.point_sd), 0.0, np.inf))


def lens_unknown(**options):
    """Return a block whose camera has a distortion that nobody has told."""
    lens, nominal = Camera("brown", {"c": -152.74, "K1": 1e-7}), Camera("brown", {"c": -152.74})
    return simulate(
        strips=3, photos_per_strip=5, cameras=[lens], start_cameras=[nominal], position_sd=0.1, seed=5
    ).block


def waves():
    """Return a block whose images have waves over the frame, which no camera follows."""
    block = simulate(strips=2, photos_per_strip=4, seed=5).block
    return block.replace(image_xy=block.image_xy + 0.020 * np.sin(block.image_xy[:, ::-1] / 30))


def few(block, photos=2, points=5):
    """Return two photos with the images of a few points."""
    on = block.image_photos < photos
    rays = np.bincount(block.image_points[on], minlength=len(block.point_ids))
    given = np.isfinite(block.point_sd).all(axis=1)
    order = np.argsort(~given, kind="stable")
    chosen = [point for point in order.tolist() if rays[point] == photos][:points]
    kept = on & np.isin(block.image_points, chosen)
    return block.replace(
        photo_ids=block.photo_ids[:photos],
        photo_positions=block.photo_positions[:photos],
        photo_attitudes=block.photo_attitudes[:photos],
        principal_distances=block.principal_distances[:photos],
        photo_position_sd=block.photo_position_sd[:photos],
        photo_attitude_sd=block.photo_attitude_sd[:photos],
        image_photos=block.image_photos[kept],
        image_points=block.image_points[kept],
        image_xy=block.image_xy[kept],
        image_sd=block.image_sd[kept],
    )


def free(block):
    """Return a block without control: a free network."""
    return block.replace(point_sd=np.full_like(block.point_sd, np.inf))


BLOCKS = {
    "good": (lambda b: b, "accepted"),
    "gross error": (lambda b: with_image(b, 0.3), "gross-errors"),
    "many gross errors": (lambda b: with_image(b, 0.3, 60), None),
    "single": (lambda b: with_image(b, 0.05), None),
    "wrong control": (lambda b: moved(b, held(b)[1], [20.0, 0.0, 5.0]), "gross-errors"),
    "wrong check point": (lambda b: moved(b, checks(b)[1], [0.0, 0.0, 20.0]), "check-points"),
    "check point to look at": (lambda b: moved(b, checks(b)[1], [0.0, 0.0, 1.8]), None),
    "held points contradict": (contradicting, None),
    "too optimistic": (lambda b: b.replace(image_sd=b.image_sd / 2), "weights"),
    "far too optimistic": (lambda b: b.replace(image_sd=b.image_sd / 9), None),
    "too pessimistic": (lambda b: b.replace(image_sd=3 * b.image_sd), "weights-of-types"),
    "lens": (lambda _: lens_unknown(), "common-error"),
    "waves": (lambda _: waves(), "model"),
    "mirrored": (lambda b: b.replace(image_xy=b.image_xy * [1.0, -1.0]), None),
    "few": (few, None),
    "free network": (free, None),
}
"""Blocks in good and in broken states, and what heads the verdict of those that are made for it."""


@pytest.mark.parametrize("state", BLOCKS)
def test_blocks(block, state):
    make, code = BLOCKS[state]
    given = make(block)
    result = adjust(given)
    verdict = see(result)
    assert code is None or verdict.code == code
    found = diagnose(given, result)
    explained = see(found)
    assert explained == found.result.verdict
    assert bool(found.grave) == (explained.exit != 0)
    assert (explained.exit != 0) == (verdict.exit != 0)


@pytest.mark.parametrize(
    ("state", "options", "code"),
    [
        ("good", {"loss": "huber"}, None),
        ("gross error", {"loss": "huber"}, None),
        ("good", {"covariance": False}, None),
        ("too optimistic", {"unit_variance": "unity"}, None),
        ("too pessimistic", {"unit_variance": "unity"}, None),
        ("gross error", {"max_iterations": 1}, "not-converged"),
    ],
)
def test_adjustments_of_other_kinds(block, state, options, code):
    verdict = see(adjust(BLOCKS[state][0](block), **options))
    assert code is None or verdict.code == code


@pytest.mark.parametrize("state", ["good", "far too optimistic"])
def test_fixed_photos(block, state):
    see(adjust(BLOCKS[state][0](block).with_fixed_photos()))


@pytest.mark.parametrize("state", sorted(BLOCKS.keys() - {"few", "many gross errors"}))
def test_checks(block, state):
    """What looks for mistakes is never green where the adjustment that it makes is red."""
    found = diagnose(BLOCKS[state][0](block))
    verdict = see(found)
    assert bool(found.grave) == (verdict.exit != 0)
    assert verdict.warning or adjust(BLOCKS[state][0](block)).verdict.usable


@pytest.mark.parametrize("state", ["good", "gross error", "many gross errors", "wrong control", "lens"])
def test_snooping(block, state):
    verdict = see(snoop(BLOCKS[state][0](block)))
    assert (verdict.code == "accepted") == (state == "good")


@pytest.mark.parametrize("state", ["good", "too optimistic", "gross error"])
def test_components(block, state):
    see(variance_components(BLOCKS[state][0](block)))


def test_plans():
    size = {"strips": 2, "photos_per_strip": 3, "points_per_photo": 40, "check_points": 0}
    made = plan({each: simulate(control=each, **size).truth for each in ("perimeter", "corners")})
    page, report, document = made.document(), made.report(), json.loads(made.to_json())
    assert [str(each) for each in page.advice] == document["next"]
    assert all(each in " ".join(report.split()) for each in document["next"])


COLLECTIONS = {
    "good": ({}, "accepted"),
    "one wrong": ({"outlier_share": 0.02}, "gross-errors"),
    "many wrong": ({"outlier_share": 0.3}, "not-converged"),
}


@pytest.mark.parametrize("state", COLLECTIONS)
def test_collections(state):
    options, code = COLLECTIONS[state]
    photos = simulate_collection(photos=5, points=30, seed=4, **options).collection
    assert see(adjust_collection(photos)).code == code
    assert see(adjust_collection(photos, loss="huber")).code in (
        *("not-tested", "look-at", "not-converged"),
        *("accepted", "unsupported", "gross-errors"),
    )
    assert (see(snoop(photos)).code == "accepted") == (state == "good")
    assert (see(diagnose(photos)).exit == 0) == (state == "good")
    see(adjust_collection(photos, max_iterations=1))
    see(adjust_collection(replace(photos, image_sd=photos.image_sd / 5)))
    see(adjust_collection(replace(photos, image_sd=photos.image_sd * 5)))


GROUND = np.random.default_rng(1).uniform(0, [1000, 800, 200], size=(6, 3))
NOISE = 0.02 * np.random.default_rng(2).normal(size=GROUND.shape)
WRONG = NOISE + np.where(np.arange(18).reshape(6, 3) == 0, 3.0, 0.0)
STATIONS = {
    "good": (NOISE, {"control_sd": 0.02, "model_sd": 0.00002}, "accepted"),
    "not weighted": (NOISE, {}, "not-tested"),
    "wrong": (WRONG, {"control_sd": 0.02, "model_sd": 0.0002}, "gross-errors"),
    "wrong, not weighted": (WRONG, {}, "look-at"),
    "no model": (1000 * NOISE[::-1] + 200 * GROUND[:, ::-1], {"control_sd": 0.02, "model_sd": 0.0002}, None),
    "too optimistic": (NOISE, {"control_sd": 0.01, "model_sd": 0.00001}, "weights"),
    "far too optimistic": (NOISE, {"control_sd": 0.002, "model_sd": 0.0001}, "weights"),
    "too pessimistic": (NOISE, {"control_sd": 0.1, "model_sd": 0.0002}, "weights-pessimistic"),
}


@pytest.mark.parametrize("state", STATIONS)
@pytest.mark.parametrize("unit_variance", ["estimated", "unity"])
def test_absolute_orientations(state, unit_variance):
    error, deviations, code = STATIONS[state]
    if not deviations and unit_variance == "unity":
        unit_variance = "estimated"
    stations = Stations(range(6), GROUND + error, 0.01 * GROUND, **deviations)
    verdict = see(orient(stations, unit_variance=unit_variance))
    assert code is None or verdict.code == code


def test_an_orientation_that_nothing_checks():
    known = np.where(np.arange(18).reshape(6, 3) < 6, GROUND, np.nan)
    known[2, 2] = GROUND[2, 2]
    assert see(orient(Stations(range(6), known, 0.01 * GROUND))).code == "uncontrolled"
    assert see(orient(read_stations(EXAMPLES / "absolute_orientation" / "stations.csv"))).usable


@pytest.mark.parametrize("options", [{}, {"together": True}, {"unknown": ("c",)}, {"as_published": True}])
@pytest.mark.parametrize("broken", [False, True])
def test_projectors(tmp_path, options, broken):
    text = (EXAMPLES / "perspective_center" / "grid.deck").read_text()
    lines = text.splitlines()
    row = 40
    assert len(lines[row].split()) == 4
    if broken:
        lines[row] = f"{lines[row][:5]}{float(lines[row][5:15]) + 0.5:10.3f}{lines[row][15:]}"
    deck = tmp_path / "grid.deck"
    deck.write_text("\n".join(lines) + "\n")
    run = run_deck(deck, **options)
    for each in run.results:
        alone = replace(run, results=[each])
        text = "\n".join(line for _, lines in titled_lines(set_document(each), []) for line in lines)
        assert_one_judgement(each.verdict, alone.document(), text, None)
        document = json.loads(alone.to_json())["sets"][0]
        assert document["verdict"]["next"] == [str(step) for step in each.verdict.next]
    assert run.document().advice == list(dict.fromkeys(s for each in run.results for s in each.verdict.next))
    assert options or any(each.verdict.warning for each in run.results) == broken


def session(k=0, *, grid_um=0.0, random_um=0.6, scale=0.0, **options):
    """Simulate the measurement of a grid of nine points."""
    plate = Grid.square(4, number=7, sigma_um=0.3)
    errors = 0.3 * np.random.default_rng(1).standard_normal(plate.xy_um.shape)
    made = simulate_calibration(
        replace(plate, xy_um=plate.xy_um * [1 + scale, 1.0]),
        cases=4,
        pointing_um=0.9,
        random_um=random_um,
        grid_errors_um=(1 + grid_um) * errors,
        date=f"{1970 + k}-0{1 + k}-15",
        seed=k,
        **options,
    ).session
    return replace(made, grids={7: plate})


def exchanged(made):
    """Return a session with two names exchanged in its third case."""
    points = made.cases[2].points
    other = np.select([points == 7, points == 8], [8, 7], points)
    cases = [replace(own, points=other) if k == 2 else own for k, own in enumerate(made.cases)]
    return replace(made, cases=tuple(cases))


def shifted(made, by_um):
    """Return a session with all pointings on a point of its third case moved."""
    xy = made.cases[2].xy_um + np.outer(made.cases[2].points == 9, [by_um, 0.0])
    cases = [replace(own, xy_um=xy) if k == 2 else own for k, own in enumerate(made.cases)]
    return replace(made, cases=tuple(cases))


COMPARATORS = {
    "good": (session, "not-tested"),
    "names exchanged": (lambda: exchanged(session()), "gross-errors"),
    "wrong reading": (lambda: shifted(session(), 12.0), "look-at"),
    "wrong grid": (lambda: session(grid_um=1.0), "not-tested"),
}


@pytest.mark.parametrize("state", COMPARATORS)
def test_comparators(state):
    make, code = COMPARATORS[state]
    found = calibrate_comparator(make())
    assert_one_judgement(found.verdict, found.document(), listing(found), found.to_json())
    assert found.verdict.code == code
    assert (json.loads(found.to_json())["correction"] is None) == (found.verdict.exit != 0)


@pytest.mark.parametrize("change", [{}, {"scale": 20e-6}, {"random_um": 4.0}])
def test_comparators_over_years(change):
    years = [session(k, **(change if k > 1 else {})) for k in range(4)]
    found = compare([calibrate_comparator(each) for each in years])
    verdict = see(found)
    assert verdict.code == ("changed" if change else "accepted")
    assert found.usable_grids


def plate(shift=0.0, image=100, mean_error=0.0):
    """Return the packaged plate with an error of one image (m), and a given mean error of unit weight."""
    from photogram.stellar import read_plain

    given = read_plain(Path(str(EXAMPLES / "stellar" / "plate.toml")))
    xy = given.image_xy.copy()
    xy[image, 0] += shift
    changes = {"movement_factor": 0.0, "curves": False, "histogram": False}
    return replace(given, image_xy=xy, options=replace(given.options, mean_error=mean_error, **changes))


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({}, "not-tested"),
        ({"shift": 5e-3}, "gross-errors"),
        ({"shift": 30e-6, "image": 7}, "look-at"),
        ({"mean_error": 3e-6}, "accepted"),
        ({"mean_error": 2e-5}, "weights-pessimistic"),
        ({"mean_error": 1e-7}, "weights"),
        ({"mean_error": 3e-6, "shift": 30e-6, "image": 7}, "gross-errors"),
    ],
)
def test_plates(changes, code):
    from photogram.stellar import calibrate

    assert see(calibrate(plate(**changes))).code == code


@pytest.mark.parametrize("pixel_sd", [None, 0.02])
def test_nights(pixel_sd):
    pytest.importorskip("erfa")
    from photogram.stellar import calibrate_night, read_night

    night = read_night(Path(str(EXAMPLES / "exposures" / "night.toml")))
    see(calibrate_night(night if pixel_sd is None else replace(night, pixel_sd=pixel_sd)))


@pytest.mark.parametrize(
    ("state", "options"),
    [
        ("good", ()),
        ("gross error", ()),
        ("gross error", ("--snoop",)),
        ("wrong check point", ()),
        ("too optimistic", ()),
    ],
)
def test_what_a_command_prints_and_writes(block, tmp_path, monkeypatch, state, options):
    """Exit code, what is printed, report.txt and the document of one run."""
    monkeypatch.chdir(tmp_path)
    write_project(Project.from_block(BLOCKS[state][0](block)), tmp_path / "block")
    done = CliRunner().invoke(
        app, ["adjust", "block", *options, "--out", "out", "--json", "j.json", "--no-html"]
    )
    text, document = Path("out/report.txt").read_text(), json.loads(Path("j.json").read_bytes())
    verdict = document["verdict"]
    assert done.exit_code == verdict["exit"], done.output
    told = [f"exit code {done.exit_code}", *text.splitlines(), *map(str.strip, done.stdout.splitlines())]
    assert not contradictions([*told, verdict["headline"], *verdict["next"]])
    for each in verdict["next"]:
        assert each in " ".join(text.split())
        assert each in done.stdout


PLANTED = {
    "Usable": "Not to be used as it is: do not use these figures",
    "Accepted: the residuals agree with the given standard deviations": "Gross errors likely: 1) x of 7",
    "Gross errors likely; --snoop (photogram.snoop) takes them out": (
        "Do not take out observations before: where the model is wrong, good ones look bad."
    ),
    "Not tested as a whole (a robust loss changes the weights)": (
        "Accepted: the residuals agree with the given standard deviations"
    ),
    "There are no check points. Leave some control out": "check points   0.1  0.2  0.3",
    "There is no control, and no other observation": "held components of control X 3, Y 3, Z 3",
    "Nothing needs to be done.": "Look at the observations that are named.",
    "Weights too optimistic": "Weights too pessimistic",
    "camera.json is withheld: no block may take this camera.": "camera.json holds the calibrated camera",
    "exit code 0": "Too much had to be removed: model or identification is wrong",
    "exit code 4": "Correct measurements with `photogram comparator correct`",
    "Problems: none": "Gross errors likely: 1) x of point 7",
    "0 grave, 1 to look at": "GRAVE point 7 is wrong",
    "status converged": "the adjustment has diverged: do not use these values",
}


@pytest.mark.parametrize("one", PLANTED)
def test_what_contradicts_is_seen(one):
    """Pairs of sentences by themselves."""
    assert contradictions([one, "a sentence beside", PLANTED[one]])
    assert not contradictions([one, "a sentence beside"])


def test_a_planted_contradiction_is_seen(block):
    """Another verdict, another advice, another line of the page beside a good report: each is seen."""
    result = adjust(block)
    verdict, page, report = result.verdict, result.document(), result.report()
    assert not contradictions(sentences_of(verdict, page, report, result.to_json()))
    bad = adjust(BLOCKS["gross error"][0](block))
    for mixed in (
        (bad.verdict, page, report, None),
        (verdict, bad.document(), report, None),
        (verdict, page, bad.report(), None),
        (verdict, replace(page, advice=["Do not use any of these figures."]), report, None),
        (replace(verdict, lines=("gross errors likely: 1) a",)), page, report, None),
    ):
        with pytest.raises(AssertionError):
            assert_one_judgement(*mixed)


def test_a_remark_that_begins_with_none_is_a_remark():
    """Pages once took it for the word that there are none."""
    [part] = remarks_section(["none of the images of photo 7 fits"]).parts
    assert "none of the images of photo 7 fits" in str(part)
