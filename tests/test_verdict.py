"""The verdict: the first condition that fits gives the headline and the exit code."""

import json
import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from contradictions import contradictions, sentences_of
from photogram import adjust, resect, simulate
from photogram.network import project
from photogram.show.forms import table_text, written
from photogram.show.forms import text as report_of
from photogram.show.judgement import judged, verdict_table
from photogram.show.page import Document
from photogram.statistics import global_test, group_tests
from photogram.statistics.findings import (
    CONTROL_POINTS,
    IMAGES,
    Agreement,
    Findings,
    GroupFactor,
    Removed,
    Systematic,
)
from photogram.statistics.findings import Tested as Group
from photogram.statistics.verdict import verdict, worst
from photogram.words import Phrase

F = 81
A = {"name": "a"}


def named(index):
    return f"{'xy'[index[1]]} of point {index[0]}"


def good(seed=1, factor=1.0):
    return factor * np.random.default_rng(seed).normal(size=(120, 2))


def findings(w, variance=1.0, **more):
    kinds = [Group("image coordinates", w, named)]
    test = global_test(variance * F, F)
    return Findings(
        **{"status": "converged", "observations": kinds, "degrees_of_freedom": F, "global_test": test} | more
    )


def pattern(probability=1e-9, *, large=True):
    return Systematic("over the frame", "the lens", "B", "chi2", (40.0,), 99.0, probability, 0.001, large)


def component(factor, significant=True):
    return GroupFactor("strip 1", factor, (0.9 * factor, 1.1 * factor), significant)


with_blunder = good()
with_blunder[7, 1] = 9.0

CASES = {
    "accepted": (findings(good()), 0, False, "Accepted: the residuals agree"),
    "not tested": (findings(good(), global_test=None), 0, False, "Not tested as a whole (no a-priori unit"),
    "not converged": (findings(good(), status="diverged"), 3, False, "Not converged (diverged)"),
    "undetermined": (findings(good(), undetermined=["kappa of photo 3"]), 3, False, "Unknowns that the"),
    "hint": (findings(with_blunder, 2.0, hints=["probably feet"]), 4, False, "Probably feet"),
    "stars": (findings(good(), doubtful=["exposure 2"]), 4, False, "The identification of stars is doubtful"),
    "blunder": (findings(with_blunder, 2.0), 4, False, "Gross errors likely: 1) y of point 7 (w = 9)"),
    "removed": (findings(good(), snooped=Removed([{"name": "a"}])), 0, False, "Usable after removal of 1"),
    "too much": (findings(good(), snooped=Removed([A], {IMAGES: (6, 100)})), 4, False, "Too much had"),
    "control": (findings(good(), snooped=Removed([A], {CONTROL_POINTS: (4, 10)})), 4, False, "Too much had"),
    "factor": (findings(good(factor=2.0), 4.0), 0, True, "Weights too optimistic: standard deviations are"),
    "far": (findings(good(factor=200.0), 4e4), 4, False, "Weights too optimistic"),
    "group": (findings(good(), components=[component(2.0)]), 0, True, "Standard deviations are wrong: those"),
    "far group": (findings(good(), components=[component(4.0)]), 4, True, "Standard deviations are wrong"),
    "uniform": (findings(good(), components=[component(1.1, False)]), 0, False, "Accepted"),
    "model": (findings(good(factor=2), 4.0, systematic=[pattern()]), 4, False, "The model is likely wrong"),
    "small pattern": (findings(good(), systematic=[pattern(large=False)]), 0, False, "Accepted"),
    "chance": (findings(good(), systematic=[pattern(0.01)]), 0, False, "Accepted"),
    "no freedom": (findings(good()[:0], degrees_of_freedom=0, global_test=None), 0, True, "Nothing is"),
    "unexplained": (findings(good(), 2.0), 0, True, "Residuals are 1.41 (95 percent: 1.23 to 1.67) times"),
    "far unexplained": (findings(good(), 16.0), 4, True, "Residuals are 4 "),
    "look": (findings(with_blunder, 1.1), 0, True, "Accepted, but look at: 1) y of point 7 (w = 9)"),
    "low": (findings(good(factor=0.5), 0.25), 0, False, "Weights too pessimistic"),
    "spoiled": (findings(good(), spoiled="it changes"), 4, False, "Gross errors: it changes"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_conditions(case):
    found, code, warning, headline = CASES[case]
    made = verdict(found)
    assert made.headline.startswith(headline)
    assert (made.exit, made.exit_code()) == (code, code)
    assert made.exit_code(strict=True) == (4 if warning and not code else code)
    assert made.warning >= warning
    assert made.usable == (code == 0)


def test_a_variance_of_thousands_is_never_without_problems():
    """Whatever else is known or not."""
    for w in (good(), good(factor=189.0), with_blunder, np.full((120, 2), math.nan)):
        for more in ({}, {"snooped": Removed([])}, {"systematic": [pattern()]}, {"computed": False}):
            made = verdict(findings(w, 35_820.0, **more))
            assert made.exit == 4, (made.headline, more)


def test_what_does_not_give_the_headline_follows():
    found = findings(with_blunder, 2.0, hints=["probably feet"], systematic=[pattern()], remarks=["a remark"])
    made = verdict(found)
    assert made.code == "hint"
    codes = [line.code for line in made.lines]
    assert codes[0] == "verdict.gross-errors"
    assert "verdict.model" in codes
    assert made.lines[-1].fields == {"text": "a remark"}


def test_gross_errors_beside_a_common_factor():
    """A blunder among standard deviations that are all too small; and these alone, which have none."""
    w = good(factor=2.0)
    w[3, 0] = 30.0
    assert verdict(findings(w, 12.0)).code == "gross-errors"
    # A blunder among few: the factor is that of the others.
    few = np.array([[0.3, -1.2], [0.8, 9.0], [-0.5, 1.1]])
    made = findings(few, global_test=global_test(84.0, 4), degrees_of_freedom=4)
    assert verdict(made).code == "gross-errors"
    assert "line.few" in {line.code for line in verdict(made).lines}
    alike = findings(few * [1.0, 0.4], global_test=global_test(4 * 4.5, 4), degrees_of_freedom=4)
    assert verdict(alike).code == "weights"


def test_a_few_gross_errors_that_spoil_everything_are_no_model():
    """A control point wrong by 500 m bends the block: all residuals show it, a few of them most of it."""
    w = good(factor=5.0)
    w[:3] *= 60.0
    few = findings(w, 400.0, systematic=[pattern()])
    assert verdict(few).code == "gross-errors"
    assert "verdict.model" in {line.code for line in verdict(few).lines}
    w[:3] = good(factor=5.0)[:3]
    w[0, 0] = 30.0
    assert verdict(findings(w, 27.0, systematic=[pattern()])).code == "model"


def test_the_order_is_that_of_the_probabilities():
    w = good()
    w[5, 0], w[9, 1], w[2, 0] = -7.0, 40.0, 6.0
    text = verdict(findings(w, 22.0)).headline
    assert text.index("y of point 9") < text.index("x of point 5") < text.index("x of point 2")


def test_groups_and_singles_are_tested_together():
    blocks = np.tile(0.4 * np.eye(2), (30, 1, 1))
    v = np.random.default_rng(3).normal(size=(30, 2)) * math.sqrt(0.4)
    v[11] = [4.0, -4.0]
    tests = group_tests(blocks, v)
    groups = Group("images", tests.statistic, lambda index: f"image {index[0]}", "T", tests.dimension)
    single = Group("control", good()[:4], named)
    made = verdict(findings(good(), 2.0, observations=[groups, single]))
    largest = {test.name.partition(":")[0]: test for test in made.tests}
    assert largest["images"].statistic == "T"
    assert largest["images"].dof == (2.0,)
    assert not largest["images"].accepted
    assert largest["images"].tests == largest["control"].tests == 38
    assert made.headline == "Gross errors likely: 1) image 11 (T = 80)"


def test_the_level_is_shared_and_stated():
    made = verdict(findings(good()))
    single = made.tests[1]
    assert single.level == pytest.approx(0.05 / 240)
    assert single.limits == (pytest.approx(-3.7089, abs=1e-3), pytest.approx(3.7089, abs=1e-3))
    assert statistics_of(made) == ["judged.w"]
    by_others = findings(good(), observations=[Group("images", good(), named).studentized(F, F)])
    assert statistics_of(verdict(by_others)) == ["judged.t"]


def statistics_of(made):
    """Return codes of the statistics by which single observations are judged."""
    line = next(line for line in made.lines if line.code == "line.tests")
    return [each.code for each in line.fields["statistics"]]


def test_one_observation_that_makes_up_everything_is_found():
    """Internally studentized it would be the root of 8, 2.83: below 3 whatever its size."""
    w = np.zeros((15, 1))
    w[4] = 1000.0
    tested = Group("stations", w, lambda index: f"station {index[0]}").studentized(1e6, 8)
    made = verdict(findings(w, observations=[tested], global_test=None, degrees_of_freedom=8))
    assert made.headline.startswith(
        "Not tested as a whole (no a-priori unit weight), but look at: 1) station 4"
    )
    assert made.warning


def test_no_probability_is_lost():
    w = good()
    w[0, 0] = 400.0
    made = verdict(findings(w, 2000.0))
    assert made.tests[1].p == 0.0
    assert made.tests[1].log10_p == pytest.approx(-(400**2) / 2 / math.log(10), rel=1e-3)
    assert math.isfinite(made.tests[0].log10_p)
    # The report shows that it is tiny, the JSON document how tiny.
    outcome = table_text(written(verdict_table(made)))[2]
    assert "< 1e-99" in outcome
    assert "rejects" in outcome


def test_the_worst_of_several_results():
    verdicts = {
        code: verdict(CASES[name][0]) for name, code in (("accepted", 0), ("blunder", 4), ("undetermined", 3))
    }
    assert worst(verdicts.values()) == 3
    assert worst([verdicts[0], verdicts[4]]) == 4
    assert worst([]) == 0
    assert worst([verdict(CASES["look"][0])], strict=True) == 4


def test_global_test_against_another_adjustment():
    test = global_test(30.0, 10, reference_dof=20)
    # F of 10 and 20 degrees of freedom: 2.774 and 1 / 3.419 in the tables at 2.5 percent.
    assert test.limits == pytest.approx((1 / 3.4185, 2.7737), rel=1e-4)
    assert test.rejected_high
    assert test.probability_above + test.probability_below == pytest.approx(1.0)
    low, high = test.interval
    assert low**2 * test.limits[1] == pytest.approx(3.0)
    assert high**2 * test.limits[0] == pytest.approx(3.0)
    distribution = verdict(findings(good(), global_test=test)).tests[0]
    assert (distribution.distribution, distribution.dof) == ("F", (10.0, 20.0))


@pytest.fixture(scope="module")
def simulated():
    return simulate(strips=2, photos_per_strip=4, seed=5).block


def test_a_good_block(simulated):
    result = adjust(simulated)
    assert result.verdict.code == "accepted"
    assert {test.name.partition(":")[0] for test in result.verdict.tests} >= {
        "global", "images", "control points",
        "pattern over the frame of the camera", "normality of image residuals",
    }  # fmt: skip
    document = json.loads(result.to_json())["verdict"]
    assert document["code"] == "accepted"
    assert set(document) == {
        "code",
        "headline",
        "exit",
        "warning",
        "lines",
        "next",
        "messages",
        "tests",
        "removed",
        "outliers",
        "rivals",
        "hints",
    }
    assert document["tests"][0]["name"] == "global"
    assert all(
        {"p", "level", "tests", "limits", "accepted", "dof"} <= set(test) for test in document["tests"]
    )
    assert pickle.loads(pickle.dumps(result.verdict)) == result.verdict


def test_a_block_with_a_blunder_and_one_with_bad_weights(simulated):
    xy = simulated.image_xy.copy()
    image = int(np.argmax(adjust(simulated).redundancy[:, 0]))
    xy[image, 0] += 0.2
    wrong = adjust(simulated.replace(image_xy=xy)).verdict
    assert wrong.code == "gross-errors"
    photo = simulated.photo_ids[simulated.image_photos[image]]
    point = simulated.point_ids[simulated.image_points[image]]
    assert wrong.headline.startswith(f"Gross errors likely: 1) image of point {point} on photo {photo} (T = ")
    optimistic = adjust(simulated.replace(image_sd=simulated.image_sd / 2)).verdict
    assert (optimistic.code, optimistic.exit, optimistic.warning) == ("weights", 0, True)
    assert " 1.9" in optimistic.headline or " 2.0" in optimistic.headline
    assert adjust(simulated.replace(image_sd=simulated.image_sd / 8)).verdict.exit == 4


def test_an_image_is_tested_with_both_its_coordinates(simulated):
    """T is what the sum of squares falls by without the image, of as many dimensions as show."""
    result = adjust(simulated)
    largest = next(test for test in result.verdict.tests if test.name.startswith("images: "))
    summary = result.reliability_summary
    assert largest.tests == int(summary.testable.sum()) < summary.tests.residual.size / 1.5
    assert (largest.statistic, largest.distribution) == ("T", "chi2")
    name = largest.name.removeprefix("images: image of point ")
    point, photo = name.split(" on photo ")
    block = simulated
    kept = ~(
        (block.image_points == block.point_ids.index(point))
        & (block.image_photos == block.photo_ids.index(photo))
    )
    without = adjust(
        block.replace(
            image_points=block.image_points[kept],
            image_photos=block.image_photos[kept],
            image_xy=block.image_xy[kept],
            image_sd=block.image_sd[kept],
        )
    )
    fall = result.sums_of_squares.total - without.sums_of_squares.total
    assert fall == pytest.approx(largest.value, rel=1e-3)
    freedom = result.degrees_of_freedom - without.degrees_of_freedom
    assert largest.dof == (freedom,)


def test_reliability_stands_in_report_and_document(simulated):
    result = pickle.loads(pickle.dumps(adjust(simulated)))
    every = result.reliability()
    document = json.loads(result.to_json())["reliability"]
    kinds = {each["kind"]: each for each in document["kinds"]}
    assert sum(each["redundancy"] for each in kinds.values()) == pytest.approx(
        result.degrees_of_freedom, abs=1e-6
    )
    assert kinds["image"]["groups"] == len(simulated.image_xy)
    images = [each for each in document["weakest"] if each["kind"] == "image"]
    checked = (every.suspects.kinds == 0) & (every.tests.least > 0.01)
    assert images[0]["external_sd"] == pytest.approx(np.nanmax(every.group_external[checked]))
    group = [str(every.suspects.name(each)) for each in range(len(checked))].index(images[0]["name"])
    moved = np.linalg.norm(every.own_point_effect[every.suspects.rows(group)], axis=1)
    assert images[0]["own_point"] == pytest.approx(moved.max())
    assert all(0.9 < pair["correlation"] <= 1 for pair in document["inseparable"])
    weakest = result.document().table("reliability.weakest")
    assert images[0]["name"] in weakest.frame()["name"].tolist()
    assert list(weakest.frame()["name"]) == [each["name"] for each in document["weakest"]]
    again = pickle.loads(pickle.dumps(result)).document().table("reliability.weakest")
    assert again.frame().equals(weakest.frame())


def test_a_lens_that_is_not_modelled(simulated):
    """Waves of 20 micrometres over the frame, twice the standard deviation: no camera follows them."""
    xy = simulated.image_xy
    made = adjust(simulated.replace(image_xy=xy + 0.020 * np.sin(xy[:, ::-1] / 30))).verdict
    assert made.code == "model", made.headline
    assert made.exit == 4
    assert "the lens model of the camera is incomplete" in made.headline
    assert " um near x " in made.headline


def test_a_robust_loss_keeps_the_tests(simulated):
    plain, robust = adjust(simulated).verdict, adjust(simulated, loss="huber").verdict
    assert robust.code == plain.code
    assert robust.is_tested_as_a_whole


def photo(noise):
    ground = np.array(
        [[0.0, 0, 10], [800, 50, 20], [750, 900, 0], [30, 820, 40], [400, 420, 5], [200, 700, 30]]
    )

    pose = np.array([390.0, 430.0, 1500.0]), np.array([0.02, -0.03, 1.5])
    xy = project(ground, *(np.tile(each, (6, 1)) for each in pose), np.full(6, -152.0))
    return ground, xy + noise


def test_a_resection():
    rng = np.random.default_rng(8)
    ground, xy = photo(0.005 * rng.normal(size=(6, 2)))
    result = resect(ground, xy, -152.0, image_sd=0.005, object_sd=0.05)
    assert result.verdict.code == "accepted"
    assert [test.name.partition(":")[0] for test in result.verdict.tests] == [
        "global", "image coordinates", "components of control",
    ]  # fmt: skip
    xy[4, 1] += 0.5
    wrong = resect(ground, xy, -152.0, image_sd=0.005, object_sd=0.05, point_ids=list("ABCDEF")).verdict
    assert wrong.code == "gross-errors"
    assert "of point E" in wrong.headline
    assert resect(ground[:3], xy[:3], -152.0).verdict.code == "uncontrolled"


# Situations that come together: no two sentences of a page contradict each other.


def lens(fall=1e9):
    return Systematic(
        "over the frame", "the lens model is incomplete", "B", "chi2", (40.0,), 99.0, 1e-9, 0.001, True, fall
    )


def checks(*, error=0.0, together=1.0):
    """Return check points of which the second is wrong by so many standard deviations."""
    values = np.array([1.0, 3.0 + error**2, 2.0])
    own = Group("check points", values, lambda place: f"K{place[0]}")
    points = replace(own, statistic="T", dimension=np.full(3, 3.0))
    return Agreement(
        points,
        global_test(9 * together, 9),
        np.ones((3, 3)),
        lambda place, sd: {"difference": 2.0, "unit": "m", "axis": "Z", "sd": float(sd[0])},
    )


SITUATIONS = {
    "nothing": {},
    "blunder": {"observations": findings(with_blunder).observations, "global_test": global_test(2 * F, F)},
    "single": {"observations": findings(with_blunder).observations},
    "factor 2": {
        "observations": findings(good(factor=2.0)).observations,
        "global_test": global_test(4 * F, F),
    },
    "factor 9": {
        "observations": findings(good(factor=9.0)).observations,
        "global_test": global_test(81 * F, F),
    },
    "too small": {
        "observations": findings(good(factor=0.5)).observations,
        "global_test": global_test(F / 4, F),
    },
    "unexplained": {"global_test": global_test(2 * F, F)},
    "untested": {"global_test": None},
    "no freedom": {"degrees_of_freedom": 0, "global_test": None, "observations": []},
    "pattern": {"systematic": [pattern()]},
    "lens": {"systematic": [lens()]},
    "groups": {"components": [component(2.0)]},
    "groups far": {"components": [component(5.0)]},
    "few out": {"snooped": Removed([{"name": "a"}])},
    "many out": {"snooped": Removed([{"name": "a"}], {IMAGES: (30, 100)})},
    "few aside": {"set_aside": Removed([{"name": "a"}])},
    "many aside": {"set_aside": Removed([{"name": "a"}], {IMAGES: (30, 100)})},
    "check wrong": {"checks": checks(error=9.0)},
    "check to look at": {"checks": checks(error=3.6)},
    "checks together": {"checks": checks(together=6.0)},
    "checks good": {"checks": checks()},
    "hint": {"hints": ["probably feet"]},
    "stars": {"doubtful": ["exposure 2"]},
    "spoiled": {"spoiled": "it changes"},
    "exchanged": {"exchanged": ["1 and 2 are exchanged on photo 7"]},
    "diverged": {"status": "diverged"},
    "open": {"undetermined": ["kappa of photo 3"]},
}


def test_an_exchange_is_named_although_another_sentence_contains_it():
    short, long = "1 and 2 are exchanged on photo 7", "1 and 2 are exchanged on photo 71"
    base = vars(findings(good()))
    snooped = Removed([{"name": "a"}], exchanged=[long])
    for exchanged, alone in ((short, True), (long, False)):
        made = verdict(Findings(**{**base, "snooped": snooped, "exchanged": [exchanged]}))
        assert ({"text": exchanged} in [line.fields for line in made.lines]) == alone


@pytest.mark.parametrize("first", SITUATIONS)
def test_no_two_sentences_contradict_each_other(first):
    """Findings that come together, three at a time; whole reports are in `test_contradictions.py`."""
    for second, third in [
        (each, other) for each in SITUATIONS for other in ("nothing", "check wrong", "lens")
    ]:
        situation = {**SITUATIONS[first], **SITUATIONS[second], **SITUATIONS[third]}
        ways = {
            "can_snoop": True,
            "take_out": Phrase("advice.snoop"),
            "calibrate": Phrase("how.calibrate", {"names": "c"}),
        }
        base = {**vars(findings(good())), **ways}
        made = verdict(Findings(**{**base, **situation}))
        told = judged(made)
        text = report_of(Document("a report", "", [told], made.next, [], []))
        sentences = [*sentences_of(made, None, text, None), f"mark {told.mark}"]
        case = (first, second, third, sentences)
        assert not contradictions(sentences), (first, second, third, contradictions(sentences))
        assert (told.tone == "bad") == (made.exit != 0), case
        if not made.exit:
            assert (told.tone == "good") == (told.mark == "Usable") == (not made.warning and "global" in
                   {test.name for test in made.tests}), case  # fmt: skip
        assert made.next, case
        # The headline is of the gravest.
        assert made.exit or "model is likely wrong" not in text, case
        if made.code == "model" and situation.get("systematic") == SITUATIONS["lens"]["systematic"]:
            assert made.next[0].code == "advice.calibrate", case
            assert "photogram.snoop" not in text, case
