"""What is known of a calibration, quantity by quantity, and what the verdict on it rests on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats
from photogram.comparator.calibration import Calibration
from photogram.comparator.combined_solution import CombinedPolynomial
from photogram.comparator.correction import Correction
from photogram.comparator.joint import JointFit
from photogram.comparator.outliers import FarPointing, Outlier
from photogram.comparator.pointing import Precision
from photogram.comparator.polynomial import TERMS
from photogram.comparator.variance import TermTest
from photogram.show.angles import ARCSEC
from photogram.show.methods import findings_of
from photogram.show.quantity import Axis, Quantity, component, of_each
from photogram.statistics.findings import Findings, Systematic, Tested

UM = (Axis.of("", "um"),)
XY = (Axis.of("x", "um"), Axis.of("y", "um"))
_LINEAR = (
    Axis.of("Scale x", ""),
    Axis.of("Scale y", ""),
    Axis.of("Scale x over scale y", ""),
    Axis.of("Lack of orthogonality α", "arcsec"),
)


def variance(calibration: Calibration) -> list[Quantity]:
    """Return the analysis of variance: standard deviations of each axis and of both, line by line."""
    own = calibration.variance
    stages = {
        "Before the calibration, everything": own.before,
        "After the linear parameters": own.after_linear,
        "After linear parameters and polynomials": own.after_nonlinear,
        "Pointing, mean of a point": own.pointing,
    }
    rows = {name: (each.x, each.y, each.total) for name, each in stages.items() if each is not None}
    totals: dict[str, float | None] = {}
    for plate in calibration.plates:
        totals[f"Grid {plate}, given"] = calibration.session.grids[plate].sigma_um
        totals[f"Grid {plate}, computed without bias"] = calibration.sigma_grid_um(plate)
    totals["Systematic comparator, linear"] = own.linear
    totals["Systematic comparator, polynomials"] = own.nonlinear
    totals["Random comparator"] = own.random
    values = np.array([*rows.values(), *((None, None, total) for total in totals.values())], dtype=float)
    axes = (*XY, Axis.of("Total", "um"))
    return [
        Quantity([*rows, *totals], kind="name", head="Standard deviation"),
        Quantity(values, axes, "deviation", head="{}", decimals=3),
    ]


def linear(correction: Correction, covariance: Floats) -> list[Quantity]:
    """Return scales, their ratio and the lack of orthogonality, each in a row, with standard deviations.

    Parameters
    ----------
    correction
        What has them.
    covariance
        (3, 3) of scale x, scale y, lack of orthogonality (rad).
    """
    x, y, lean = correction.scale_x, correction.scale_y, correction.nonorthogonality_rad
    of_ratio = np.array([1 / y, -x / y**2])
    variances = [*np.diag(covariance)[:2], of_ratio @ covariance[:2, :2] @ of_ratio]
    sd = np.array([*np.sqrt(variances), np.sqrt(covariance[2, 2]) / ARCSEC])
    scales, of = np.array([x, y, x / y]), np.arange(4)
    less_one = np.array([*(1e6 * (scales - 1)), np.nan])
    axis = (Axis.of("", "um/m"),)
    return [
        component(_LINEAR, of)[0],
        Quantity(np.array([*scales, lean / ARCSEC]), _LINEAR, "value", head="Value", of=of),
        Quantity(sd, _LINEAR, "deviation", head="sd", of=of),
        Quantity(less_one, axis, "deviation", head="Less one", decimals=2),
    ]


def terms(found: Sequence[TermTest]) -> list[Quantity]:
    """Return the terms of the polynomials with their tests."""
    return [
        of_each(found, "axis", kind="name", head="Axis"),
        of_each(found, "term", kind="name"),
        _powers([each.term for each in found]),
        of_each(found, "coefficient_um", UM, "deviation", head="Coefficient", decimals=3),
        of_each(found, "sd_um", UM, "deviation", head="sd", decimals=3),
        of_each(found, "ratio", head="t", decimals=2),
        of_each(found, "probability", head="p", figures=2),
    ]


def coefficients(found: CombinedPolynomial) -> list[Quantity]:
    """Return the coefficients of the polynomials, arguments in metres."""
    axis, sd = (Axis.of("", "m"),), np.sqrt(np.diag(found.covariance)).reshape(2, -1)
    table = [_powers(TERMS)]
    for name, values, own in zip("xy", found.polynomial.coefficients, sd, strict=True):
        table += [
            Quantity(values, axis, "value", head=f"In {name}", figures=6),
            Quantity(own, axis, "deviation", head="sd"),
        ]
    return table


def _powers(terms: Sequence[str]) -> Quantity:
    raised = str.maketrans({"^": "", "2": "²", "3": "³", "4": "⁴"})
    return Quantity([each.translate(raised) for each in terms], kind="name", head="Term")


def cases(calibration: Calibration) -> list[Quantity]:
    """Return the cases with what each adjustment of them alone left."""
    found = calibration.cases
    stages = {"Unit weight, free": "free", "after linear": "linear", "after polynomials": "polynomial"}
    fits = {head: [getattr(each, name) for each in found] for head, name in stages.items()}
    sigmas = {
        head: np.array([each.residuals.sigma0_um if each else np.nan for each in own])
        for head, own in fits.items()
    }
    measured = [each.placed.case for each in found]
    return [
        of_each(found, "number", kind="name", head="Case"),
        of_each(measured, "plate", kind="name", head="Plate"),
        of_each(measured, "operator", kind="name", head="Operator"),
        Quantity([len(each.placed.points) for each in found], head="Points"),
        *(Quantity(own, UM, "deviation", head=head, decimals=3) for head, own in sigmas.items()),
    ]


def outliers(found: Sequence[Outlier]) -> list[Quantity]:
    """Return measured points that do not agree with the adjustment of the others."""
    instead = ["none" if each.instead is None else str(each.instead) for each in found]
    return [
        of_each(found, "case", kind="name", head="Case"),
        of_each(found, "point", kind="name", head="Point"),
        of_each(found, "off_um", XY, "deviation", head="Off in {}", decimals=2),
        of_each(found, "ratio", head="Test value t", decimals=2),
        Quantity(instead, kind="name", head="Point that is expected there"),
    ]


def far_pointings(found: Sequence[FarPointing]) -> list[Quantity]:
    """Return single pointings that do not agree with the others of their case."""
    return [
        of_each(found, "case", kind="name", head="Case"),
        of_each(found, "point", kind="name", head="Point"),
        Quantity([each.row + 1 for each in found], head="Pointing"),
        of_each(found, "deviation_um", UM, "deviation", head="Deviation from the mean", decimals=2),
        of_each(found, "ratio", head="Over its sd", decimals=2),
    ]


def precisions(found: Sequence[Precision]) -> list[Quantity]:
    """Return precisions of pointing, of whatever they are."""
    ellipses = [None if np.isnan(each.sd_point_um) else each.ellipse for each in found]
    return [
        of_each(found, "readings"),
        of_each(found, "points"),
        of_each(found, "degrees_of_freedom"),
        of_each(found, "sd_um"),
        of_each(found, "sd_point_um"),
        of_each(found, "covariance_um2"),
        of_each(found, "correlation"),
        of_each(found, "listed_correlation_percent", member="correlation_percent"),
        of_each(found, "mean_sd_um", member="sd_mean_um"),
        of_each(found, "mean_sd_point_um", member="sd_mean_point_um"),
        Quantity(ellipses, member="ellipse"),
    ]


FAR = 3.0
"""A grid that differs from its values by so many times their standard deviation is another grid."""


@findings_of.register(Calibration)
def comparator_findings(calibration: Calibration) -> Findings:
    """Return the tests of a calibration: readings have no standard deviation of their own, t decides."""
    screening = calibration.screening
    places = [
        (case.number, point, axis)
        for case in calibration.cases
        for point in case.placed.points.tolist()
        for axis in "xy"
    ]

    def name(index: tuple[int, ...]) -> str:
        case, point, axis = places[index[0]]
        return f"{axis} of point {point} of case {case}"

    values = np.vstack(screening.ratios).ravel()
    readings = Tested("readings of the grid", values, name, "t", second=max(screening.freedom - 1, 1))
    tests = calibration.pointing_tests
    rows = [(each.case, row, axis) for each in tests for row in range(len(each.ratios)) for axis in "xy"]

    def pointing(index: tuple[int, ...]) -> str:
        case, row, axis = rows[index[0]]
        return f"{axis} of pointing {row + 1}, point {case.points[row]} of case {case.number}"

    ratios = np.concatenate([each.ratios.ravel() for each in tests])
    freedom = np.repeat([each.freedom for each in tests], [each.ratios.size for each in tests])
    pointings = Tested("pointings", ratios, pointing, "t", second=np.maximum(freedom - 1.0, 1.0))
    return Findings(
        status="converged",
        observations=[readings, pointings],
        degrees_of_freedom=screening.freedom,
        untested="readings have no standard deviation of their own",
        spoiled=f"outliers change corrected coordinates by {screening.change_um:.1f} um (root mean square),"
        f" and a coordinate is uncertain by {screening.sigma_um:.3f} um"
        if screening.harmful
        else "",
        systematic=_grids(calibration.joint) if calibration.joint else [],
        if_usable=[
            "Correct measurements with `photogram comparator correct correction.json FILE`.",
            "Keep the document of `--json`: `photogram comparator compare` finds what changes over years.",
        ],
        if_withheld=[
            "The correction is withheld: measure the readings that are named again, or leave them out."
        ],
    )


def _grids(joint: JointFit) -> list[Systematic]:
    """Return the tests of the corrections of the plates against their standard deviations."""
    return [
        Systematic(
            name=f"corrections of plate {plate}",
            sentence=f"the grid of plate {plate} is off by {own.test.factor:.3g} standard deviations",
            statistic="s^2",
            distribution="chi2/f",
            dof=(own.test.degrees_of_freedom,),
            value=own.test.variance,
            probability=own.test.probability_above,
            level=own.test.level / 2,
            large=own.test.factor > FAR,
        )
        for plate, own in joint.plates.items()
        if own.test is not None
    ]
