"""The figures of statement.md: what neighbours owe to the same error of the block (`docs/regenerate.py`)."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path

import numpy as np

from photogram import adjust, formats
from photogram.results.statement.comparison import Compared, compared
from photogram.results.statement.request import Asked
from photogram.statistics import effective_freedom, rmse_interval

__all__ = ["BLOCKS"]

DRAWS = 20_000
LIMIT = 1.959964
"""Of a normal variable, 5 percent on both sides."""
NAMES = {"e": "east", "n": "north", "h": "height"}


def example() -> Compared:
    """Return the check points of the packaged survey with their joint covariance."""
    project = formats.read(Path(str(files("photogram") / "examples" / "survey")))
    result = adjust(project.block, unit_variance="unity")
    return compared(result, Asked(), result.covariances())


def correlations() -> list[str]:
    """Show how often tests of good blocks are right with the joint covariance, and without."""
    found, random = example(), np.random.default_rng(7)
    heads = ("points", "effective", "sd of mean, mm", "alone", "shift found", "alone", "RMSE inside", "alone")
    widths = (8, 11, 17, 8, 14, 9, 14, 9)
    lines = [" " * 8 + "".join(f"{head:>{width}}" for head, width in zip(heads, widths, strict=True))]
    for part, name in NAMES.items():
        d, covariance = found.of(part)
        n, freedom = len(d), effective_freedom(covariance)
        joint = math.sqrt(float(covariance.sum())) / n
        alone = math.sqrt(float(np.trace(covariance))) / n
        draws = random.standard_normal((DRAWS, n)) @ np.linalg.cholesky(covariance).T
        means, rmse = draws.mean(axis=1), np.sqrt((draws**2).mean(axis=1))
        truth = math.sqrt(float(np.trace(covariance)) / n)
        shares = [100 * float((np.abs(means) > LIMIT * sd).mean()) for sd in (joint, alone)]
        for k in (freedom, float(n)):
            low, high = rmse_interval(1.0, k)
            shares.append(100 * float(((low * rmse <= truth) & (truth <= high * rmse)).mean()))
        lines.append(
            f"{name:8}{n:8d}{freedom:11.1f}{1000 * joint:17.1f}{1000 * alone:8.1f}"
            f"{shares[0]:12.1f} %{shares[1]:7.1f} %{shares[2]:12.1f} %{shares[3]:7.1f} %"
        )
    return lines


BLOCKS = {"correlations": correlations}
