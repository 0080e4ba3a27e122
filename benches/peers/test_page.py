"""The page of figures: what is computed from the records of the runs."""

import math
import subprocess
from pathlib import Path
from typing import Any

import page
import pytest
from phases import operations
from runs import Measured, Plan, Runs, Size

from targets import Target, growth, targets

SMALL = {"import": 0.1, "small block": 0.005}


def photogram_record(seconds: float, **others: Any) -> dict[str, Any]:
    """Return a record of photogram whose phases take a tenth of the time each."""
    phases = dict.fromkeys(("form", "factor", "solve", "invert", "cofactors"), seconds / 10)
    record = {
        "seconds": {"everything": seconds},
        "peak": {"everything": 2**30},
        "converged": True,
        "iterations": 5,
        "weighted_sum_of_squares": 400.0,
        "degrees_of_freedom": 100,
        "ordering": "dissection",
        "phases": phases,
        "operations": {"reduction": 1e9, "factor": 2e9, "inverse": 4e9},
        "formations": 5,
        "version": "1.2.3",
        "rays": [1e5, 4e5],
    }
    return record | others


def measured(size: str, seconds: float, **peers: dict[str, Any]) -> Measured:
    """Return the runs on a block in which photogram took some seconds."""
    of_size = Size.parse(size)
    records = {"photogram": photogram_record(seconds), **peers}
    return Measured(of_size, of_size.photos, 10, 20, 1e10, records, {})


def test_growth_is_the_exponent_of_blocks_and_of_strips() -> None:
    """Whatever the order of the sizes."""
    results = [measured(size, 3.0 * Size.parse(size).photos ** 1.2) for size in ("50x100", "20x50", "30x60")]
    results += [measured(size, Size.parse(size).photos) for size in ("1x10", "1x1000")]
    blocks, strips = growth(results)
    assert (str(blocks.smallest), str(blocks.largest)) == ("20x50", "50x100")
    assert math.isclose(blocks.exponent, 1.2)
    assert math.isclose(strips.exponent, 1.0)


def test_targets_are_judged_by_the_peers_and_by_the_product_rate() -> None:
    """The ratios, the rates and whether they are met."""
    peers = {
        "gtsam": {"seconds": {"solution": 20.0}},
        "pycolmap": {"seconds": {"solution": 30.0, "covariances": 20.0}},
    }
    found = {target.name: target for target in targets([measured("20x50", 2.0, **peers)], SMALL)}
    everything = found["20x50: everything / gtsam's bare solution"]
    assert (everything.reached, everything.met) == (0.1, True)
    assert found["20x50: everything / pycolmap's bare solution"].met
    # 5 (2e7 + 3e9) + 4e9 + 5.32e7 multiply-adds would take 1.91532 s.
    limit = found["20x50: everything, times its operations at the product rate"]
    assert math.isclose(limit.reached, 2.0 / 1.91532)
    rest = found["20x50: outside the numerical phases, share of the time"]
    assert (rest.reached, rest.met) == (0.5, False)
    covariances = found["20x50: covariances / pycolmap's covariances"]
    assert (covariances.reached, covariances.met) == (0.02, True)
    # 10^10 multiply-adds in 0.2 s are five times the product rate.
    factor = found["20x50: factor, part of the product rate"]
    assert (factor.reached, factor.met) == (5.0, True)


@pytest.mark.parametrize(("reached", "above", "met"), [(0.4, True, False), (0.4, False, True)])
def test_a_target_is_met_from_its_own_side(reached: float, above: bool, met: bool) -> None:
    """At least, or at most."""
    assert Target("", 0.5, reached, above).met == met


def test_operations_that_the_result_counts_are_taken_from_it() -> None:
    """The harness counts what the result does not."""
    counted = {"reduction": 1e9, "factor": 2e9, "inverse": 4e9, "formation": 7e9, "cofactors": 9e9}
    ours = operations(photogram_record(1.0))
    assert ours["form"] == 5 * (200 * 1e5 + 1e9)
    assert ours["cofactors"] == 108 * 4e5 + 100 * 1e5
    theirs = operations(photogram_record(1.0, operations=counted))
    assert (theirs["form"], theirs["cofactors"]) == (5 * 8e9, 9e9)


def test_the_page_names_what_failed_and_why_a_target_is_missed() -> None:
    """A side that was stopped is a row; a missed target has its reason."""
    slow = measured("20x50", 2.0, gtsam={"seconds": {"solution": 4.0}, "failed": "more than 600 s"})
    lost = measured("50x100", 2.0)
    lost.records["photogram"] = {"failed": "exit status -9"}  # type: ignore[index]
    name = "blocks from 10x10 to 20x50: exponent of time"
    results = [measured("10x10", 0.01), slow, lost]
    text = page.page(results, SMALL, "the command", "about", {name: "for a reason", "met": "nothing"})
    assert "| gtsam | solution: more than 600 s |" in text
    assert "| photogram | everything: exit status -9 |" in text
    assert f"* {name}\n\nfor a reason\n" in text
    assert ", photogram 1.2.3, numpy " in text
    assert "nothing" not in text


def test_what_has_been_run_is_not_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even for another page."""
    plan = Plan(tmp_path, 1, ["photogram"], 5000, 2, 60.0, 0.0)
    first = Runs(plan, Size(2, 3)).measured()
    assert first.photos == 6
    assert first.ours is not None

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("something was run")

    monkeypatch.setattr(subprocess, "run", refuse)
    assert Runs(plan, Size(2, 3)).measured() == first


def test_a_side_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    """And said so in its record."""
    plan = Plan(tmp_path, 1, ["photogram"], 5000, 2, 0.01, 0.0)
    record = Runs(plan, Size(2, 3)).measured().records["photogram"]
    assert record == {"failed": "more than 0.01 s"}
