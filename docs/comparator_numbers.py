"""The numbers of docs/comparator.md: `python docs/regenerate.py comparator.md`."""

from __future__ import annotations

import math
from functools import cache
from importlib.resources import as_file, files
from textwrap import wrap

import numpy as np

from photogram import comparator
from photogram.comparator.fits import fit_rigid
from photogram.comparator.listing import combined_linear_page, variance_lines
from photogram.comparator.simulation import simulated_years
from photogram.show.forms import part_lines, table_text, written


@cache
def calibration() -> comparator.Calibration:
    """Calibrate the packaged example."""
    with as_file(files("photogram") / "examples" / "comparator" / "comparator-3.txt") as path:
        return comparator.calibrate(comparator.read([path])[0])


def joint_lines() -> list[str]:
    """Compare the parameters of the report's method with those of the joint adjustment."""
    own, joint = calibration().correction, calibration().joint
    if joint is None:
        raise RuntimeError("the example has a joint adjustment")
    plate = joint.plates[1320]
    sd = joint.covariance.diagonal() ** 0.5
    return [
        f"{'':26}{'report':>12}{'joint':>12}{'sd':>10}",
        f"{'scale x - 1, um/m':26}{1e6 * (own.scale_x - 1):12.3f}"
        f"{1e6 * (joint.correction.scale_x - 1):12.3f}{1e6 * sd[0]:10.3f}",
        f"{'scale y - 1, um/m':26}{1e6 * (own.scale_y - 1):12.3f}"
        f"{1e6 * (joint.correction.scale_y - 1):12.3f}{1e6 * sd[1]:10.3f}",
        f"{'random comparator, um':26}{calibration().variance.random:12.3f}{joint.random_um:12.3f}",
        f"{'sigma of unit weight':26}{'':12}{joint.sigma0:12.4f}",
        f"{'grid variance ratio':26}{'':12}{plate.variance_ratio:12.3f}",
        f"corrected coordinates of both differ by {_difference(own, joint.correction):.2f} um"
        " (rms, after a rigid fit)",
        f"weighted mean and joint adjustment under the report's assumptions agree within {_check()} sd",
    ]


def _difference(first: comparator.Correction, second: comparator.Correction) -> float:
    """Return the root mean square difference of corrected coordinates at all places measured."""
    places = np.vstack([case.placed.means_um for case in calibration().cases])
    fit = fit_rigid(np.arange(len(places)), first.apply(places), second.apply(places))
    return float(np.sqrt((fit.residuals.grid_um**2).mean()))


def _check() -> str:
    """Return the next power of ten: the digits of a difference that small are chance."""
    return f"{10.0 ** math.ceil(math.log10(calibration().joint_check or 1.0)):g}"


def grid_lines() -> list[str]:
    """Show the estimates of the grid's standard deviation, and what corrections leave of it."""
    result = calibration().plates[1320]
    return [
        f"listing      {result.listed.grid_um:.3f} um",
        f"equation 64  {result.text_um:.3f} um",
        f"unbiased     {result.unbiased_um:.3f} um",
        f"a priori     {calibration().session.grids[1320].sigma_um:.3f} um",
        f"coordinates corrected by averages            {calibration().corrected_grid(1320).sigma_um:.3f} um",
        f"coordinates corrected by joint adjustment    {calibration().adjusted_grid(1320).sigma_um:.3f} um",
    ]


def tests_lines() -> list[str]:
    """Show the tests of the polynomials and of the cases."""
    tables = [calibration().document().table(key) for key in ("polynomial.terms", "cases")]
    return [line for table in tables for line in ("", *part_lines(written(table)))][1:]


def years_lines() -> list[str]:
    """Compare the simulated calibrations of the example of `comparator compare`."""
    found = comparator.compare(simulated_years())
    tables = [found.document().table(key) for key in ("calibrations", "series")]
    lines = [line for table in tables for line in ("", *table_text(written(table)))]
    return [*wrap(found.verdict.headline, 118), *lines]


BLOCKS = {
    "years": years_lines,
    "variance": lambda: variance_lines(calibration()),
    "linear": lambda: combined_linear_page(calibration())[2:],
    "tests": tests_lines,
    "joint": joint_lines,
    "grid": grid_lines,
}
