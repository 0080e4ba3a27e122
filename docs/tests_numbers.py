"""The figures of tests.md: critical values, sizes by simulation, a verdict (`docs/regenerate.py`)."""

from __future__ import annotations

import math
import textwrap

import numpy as np

from photogram import Block, adjust, simulate
from photogram.show.forms import table_text, written
from photogram.show.judgement import verdict_table
from photogram.statistics import (
    b_method,
    bonferroni,
    critical_normal,
    critical_student,
    critical_tau,
    externally_studentized,
    global_test,
    group_tests,
    lambda0,
    log_fisher,
    normal_limit,
    studentized_limit,
)

__all__ = ["BLOCKS"]

DRAWS = 20_000


def limits() -> list[str]:
    """Show the limits of single observations for a family level of 5 percent."""
    lines = [f"{'f':>6}{'tests':>8}{'root of f':>12}{'tau':>9}{'t':>12}{'w':>9}"]
    for f, tests in ((2, 6), (4, 10), (8, 15), (9, 16), (20, 40), (81, 258), (1000, 3000)):
        level = bonferroni(0.05, tests)
        lines.append(
            f"{f:6d}{tests:8d}{math.sqrt(f):12.4f}{critical_tau(level, f):9.4f}"
            f"{critical_student(level, f - 1):12.3f}{critical_normal(level):9.3f}"
        )
    return lines


def detectable() -> list[str]:
    """Show Baarda's lambda0 and the levels of tests of the same power."""
    lines = [f"{'alpha0':>8}{'power':>7}{'m = 1':>10}{'m = 2':>10}{'m = 3':>10}{'f = 8':>10}{'f = 50':>10}"]
    for level, power in ((0.05, 0.8), (0.01, 0.8), (0.001, 0.8), (0.001, 0.9)):
        known = [lambda0(level, power, m) for m in (1, 2, 3)]
        unknown = [lambda0(level, power, 1, f) for f in (8, 50)]
        lines.append(f"{level:8g}{power:7.2f}" + "".join(f"{each:10.4f}" for each in [*known, *unknown]))
    levels = ", ".join(f"{b_method(m)[0]:.4f} (m = {m})" for m in (2, 3, 81))
    return [*lines, f"B-method, 0.001 and 0.80: the level of one observation is 0.001; others {levels}"]


def sizes() -> list[str]:
    """Show how often good adjustments of 20 observations and 6 unknowns are rejected."""
    rng = np.random.default_rng(15)
    design = rng.normal(size=(20, 6))
    projector = np.eye(20) - design @ np.linalg.pinv(design)
    f, root = 14, np.sqrt(np.diag(projector))
    draws = projector @ rng.normal(size=(20, DRAWS))
    omegas = (draws**2).sum(axis=0)
    tests = [global_test(omega, f) for omega in omegas.tolist()]
    w = draws / root[:, np.newaxis]
    t = np.stack([externally_studentized(own, omega, f) for own, omega in zip(w.T, omegas, strict=True)])
    shares = {
        "global test, too high (2.5 %)": np.mean([test.rejected_high for test in tests]),
        "global test, too low (2.5 %)": np.mean([test.rejected_low for test in tests]),
        "one w beyond its limit of 1 %": np.mean(np.abs(w[0]) > normal_limit(1, 0.01)),
        "one t beyond its limit of 1 %": np.mean(np.abs(t[:, 0]) > studentized_limit(f, 1, 0.01)),
        "any of 20 w (at most 5 %)": np.mean(np.abs(w).max(axis=0) > normal_limit(20)),
        "any of 20 t (at most 5 %)": np.mean(np.abs(t).max(axis=1) > studentized_limit(f, 20)),
    }
    for rows in ([3, 4], [7, 8, 9]):
        m = len(rows)
        blocks = np.broadcast_to(projector[np.ix_(rows, rows)], (DRAWS, m, m))
        found = group_tests(blocks, draws[rows].T)
        fisher = (found.statistic / m) / ((omegas - found.statistic) / (f - m))
        shares[f"group of {m}, T (1 %)"] = np.mean(found.log_probability < math.log(0.01))
        shares[f"group of {m}, F (1 %)"] = np.mean(log_fisher(fisher, m, f - m) < math.log(0.01))
    return [f"{what:<36}{100 * share:6.2f} %" for what, share in shares.items()]


def _block() -> Block:
    return simulate(strips=2, photos_per_strip=4, seed=5).block


def _verdict(block: Block) -> list[str]:
    verdict, title = adjust(block).verdict, "What to do next"
    told = [f"{line}." for line in (verdict.headline, *verdict.lines)]
    lines = [
        *told,
        "",
        *table_text(written(verdict_table(verdict))),
        "",
        title,
        "-" * len(title),
        *map(str, verdict.next),
    ]
    return [part for line in lines for part in textwrap.wrap(line, 130, subsequent_indent="  ") or [""]]


def accepted() -> list[str]:
    """Show the verdict on a good block."""
    return _verdict(_block())


def blunder() -> list[str]:
    """Show the verdict on the block with the best checked image coordinate wrong by 0.2 mm."""
    block = _block()
    xy = block.image_xy.copy()
    xy[int(adjust(block).redundancy[:, 0].argmax()), 0] += 0.2
    return _verdict(block.replace(image_xy=xy))


def optimistic() -> list[str]:
    """Show the verdict on the block with standard deviations of half the size."""
    block = _block()
    return _verdict(block.replace(image_sd=block.image_sd / 2))


BLOCKS = {
    "limits": limits,
    "detectable": detectable,
    "sizes": sizes,
    "accepted": accepted,
    "blunder": blunder,
    "optimistic": optimistic,
}
