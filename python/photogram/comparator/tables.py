"""Tables of a calibration for document and listing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.comparator.correction import Correction
from photogram.comparator.fits import TERMS, Decomposition, Polynomial, Residuals
from photogram.comparator.grid import Grid
from photogram.comparator.outliers import FarPointing, Screening
from photogram.comparator.variance import PolynomialTest
from photogram.show.page import about, probability_written
from photogram.show.quantity import Axis, Quantity, Table, component, members, members_of_each, of_each

if TYPE_CHECKING:
    from photogram.comparator import Calibration, CaseResult

UM = (Axis.of("", "um"),)
XY = (Axis.of("x", "um"), Axis.of("y", "um"))
LINEAR = ("scale_x", "scale_y", "nonorthogonality_rad")
LINEAR_AXES = (
    Axis("Scale x"),
    Axis("Scale y"),
    Axis("Scale x over scale y"),
    Axis.turned("Lack of orthogonality α"),
)


def variance(calibration: Calibration) -> Table:
    own, plates = calibration.variance, calibration.plates
    stages = {
        "Before the calibration, everything": own.before,
        "After the linear parameters": own.after_linear,
        "After linear parameters and polynomials": own.after_nonlinear,
        "Pointing, mean of a point": own.pointing,
    }
    totals: dict[str, float | None] = {
        **{f"Grid {plate}, given": calibration.session.grids[plate].sigma_um for plate in plates},
        **{f"Grid {plate}, computed without bias": calibration.sigma_grid_um(plate) for plate in plates},
        "Systematic comparator, linear": own.linear,
        "Systematic comparator, polynomials": own.nonlinear,
        "Random comparator": own.random,
    }
    rows = [(each.x, each.y, each.total) if each else (None,) * 3 for each in stages.values()]
    values = np.array([*rows, *((None, None, total) for total in totals.values())], dtype=float)
    columns = [
        Quantity([*stages, *totals], kind="name", head="Standard deviation"),
        Quantity(values, (*XY, Axis.of("Total", "um")), "deviation", head="{}", decimals=3),
    ]
    note = f"Negative variances, set to 0: {', '.join(own.negative)}." if own.negative else ""
    return Table("variance", "Analysis of variance", columns, note, about("comparator.variance"))


def linear(
    found: Correction | Decomposition, covariance: Floats, freedom: int = 0, key: str = "linear"
) -> Table:
    """Return scales, their ratio and lack of orthogonality, with sd from the covariance of all three."""
    x, y, lean = (getattr(found, name) for name in LINEAR)
    of_ratio = np.array([1 / y, -x / y**2])
    sd = np.sqrt([*np.diag(covariance)[:2], of_ratio @ covariance[:2, :2] @ of_ratio, covariance[2, 2]])
    values, of = np.array([x, y, x / y, lean]), np.arange(4)
    less_one = np.array([*(1e6 * (values[:3] - 1)), np.nan])
    columns = [
        component(LINEAR_AXES, of)[0],
        Quantity(values, LINEAR_AXES, "difference", head="Value", of=of),
        Quantity(sd, LINEAR_AXES, "deviation", head="sd", of=of),
        Quantity(less_one, (Axis.of("", "um/m"),), "deviation", head="Less one", decimals=2),
    ]
    note = f"{freedom} degrees of freedom"
    return Table(key, "Linear parameters", columns, note, about("comparator.linear"), sd)


def terms(test: PolynomialTest) -> Table:
    found, (first, second) = test.terms, test.degrees_of_freedom
    columns = [
        of_each(found, "axis", kind="name", head="Axis"),
        of_each(found, "term", kind="name"),
        _powers([each.term for each in found]),
        of_each(found, "coefficient_um", UM, "deviation", head="Coefficient", decimals=3),
        of_each(found, "sd_um", UM, "deviation", head="sd", decimals=3),
        of_each(found, "ratio", head="t", decimals=2),
        of_each(found, "probability", head="p", figures=2),
    ]
    note = about("polynomial", ratio=test.ratio, first=first, second=second, p=_probability(test.probability))
    return Table("polynomial.terms", "Terms and their tests", columns, note)


def coefficients(polynomial: Polynomial, variance: float, key: str = "coefficients") -> Table:
    """Return the coefficients of polynomials, arguments in metres, with a variance of unit weight (um^2)."""
    axis, sd = (Axis.of("", "m"),), np.sqrt(variance * np.diag(polynomial.cofactors)).reshape(2, -1)
    columns = [_powers(TERMS)]
    for name, values, own in zip("xy", polynomial.coefficients, sd, strict=True):
        columns += [
            Quantity(values, axis, "value", head=f"In {name}", figures=6),
            Quantity(own, axis, "deviation", head="sd"),
        ]
    return Table(key, "Coefficients, arguments in metres", columns)


def plate_points(grid: Grid, points: Indices, corrections_um: Floats, sd_um: Floats) -> Table:
    """Return points of an adjusted plate with corrections and standard deviations, in its axes."""
    axes = tuple(Axis.of(name, "um") for name in "XY")
    columns = [
        Quantity(points, head="Point"),
        Quantity(grid.xy_um[grid.rows_of(points)], axes, "value", head="{}", decimals=3),
        Quantity(corrections_um, axes, "deviation", head="Correction of {}", decimals=3),
        Quantity(sd_um, axes, "deviation", head="sd {}", decimals=3),
    ]
    return Table(f"grid-{grid.number}", f"Grid {grid.number}, {grid.adopted}", columns)


def _probability(value: float | None) -> str:
    return "-" if value is None else probability_written(value)


def _powers(names: Sequence[str]) -> Quantity:
    raised = str.maketrans({"^": "", "2": "²", "3": "³", "4": "⁴"})
    return Quantity([each.translate(raised) for each in names], kind="name", head="Term")


def cases(calibration: Calibration) -> Table:
    found, last, combined = calibration.cases, calibration.last_fits, calibration.linear.cases
    heads = {"free": "Unit weight, free", "linear": "after linear", "nonlinear": "after polynomials"}
    stages, alone, together, lines, closeouts = [], [], [], [], []
    of_closeout = ("point", "sequential_shifts_um", "total_shift_um", "verdict")
    for case, one, two in zip(found, combined, last, strict=True):
        own = {"free": case.free.residuals, "linear": case.linear.residuals}
        if case.polynomial:
            own["nonlinear"] = case.polynomial.residuals
        of_last = two.residuals.sigma0_um if calibration.nonlinear else None
        alone.append({stage: own[stage].sigma0_um if stage in own else None for stage in heads})
        together.append({"linear": one.residuals.sigma0_um, "nonlinear": of_last})
        own |= {"combined_linear": one.residuals, "combined_last": two.residuals}
        stages.append({name: _residuals(residuals) for name, residuals in own.items()})
        line = members(case.linear, "translation_um", "covariance")
        lines.append(members(case.linear.parameters, *LINEAR, "rotation_rad") | line)
        closeouts.append([members(each, *of_closeout, pointings="counts") for each in case.closeouts])
    columns = [
        of_each(found, "number", kind="name", member="case", head="Case"),
        of_each(found, "placed.case.plate", kind="name", member="plate", head="Plate"),
        of_each(found, "placed.case.operator", kind="name", member="operator", head="Operator"),
        Quantity([len(each.placed.points) for each in found], head="Points"),
        *(
            Quantity(
                np.array([each[stage] for each in alone], dtype=float), UM, "deviation", head=head, decimals=3
            )
            for stage, head in heads.items()
        ),
        *members_of_each(
            found,
            points="placed.points",
            means_um="placed.means_um",
            nearest_point="placed.orientation.nearest_point",
            corner="placed.orientation.corner",
            left_handed="placed.orientation.left_handed",
        ),
        *members_of_each(combined, "rotation_rad", "translation_um"),
        *members_of_each(
            last,
            corrected_um="residuals.xy_um",
            residuals_comparator_um="residuals.comparator_um",
            residuals_grid_um="residuals.grid_um",
        ),
        Quantity(alone, member="sigma0_um"),
        Quantity(together, member="sigma0_combined_um"),
        Quantity(stages, member="stages"),
        Quantity(lines, member="linear"),
        Quantity([_polynomial(case) for case in found], member="polynomial"),
        Quantity(closeouts, member="closeouts"),
    ]
    note, test = "", calibration.case_test
    if test is not None and test.f_max_limit is not None:
        code = f"cases.{'alike' if test.f_max <= test.f_max_limit else 'different'}"
        p = {
            name: _probability(getattr(test, f"{name}_probability"))
            for name in ("f_max", "bartlett", "levene")
        }
        note = about(code, **members(test, "f_max_limit", "degrees_of_freedom", value="f_max"), **p)
    return Table("cases", "Cases", columns, note)


def _residuals(found: Residuals) -> dict[str, object]:
    return members(found, "comparator_um", "grid_um", "sigma_um", sum_vv_um2="squares_um2")


def _polynomial(case: CaseResult) -> dict[str, object] | None:
    if case.polynomial is None:
        return None
    x, y = case.polynomial.polynomial.coefficients
    return {"coefficients_x": x, "coefficients_y": y, "covariance": case.polynomial.covariance}


def outliers(screening: Screening) -> Table:
    found = screening.outliers
    instead = ["none" if each.instead is None else str(each.instead) for each in found]
    columns = [
        of_each(found, "case", kind="name", head="Case"),
        of_each(found, "point", kind="name", head="Point"),
        of_each(found, "off_um", XY, "deviation", head="Off in {}", decimals=2),
        of_each(found, "ratio", head="Test value t", decimals=2),
        of_each(found, "instead", kind="name"),
        Quantity(instead, kind="name", head="Point that is expected there"),
    ]
    note = about("screening.outliers", limit=screening.limit, change=screening.change_um)
    return Table("screening.outliers", "Points", columns, note)


def far_pointings(found: Sequence[FarPointing]) -> Table:
    columns = [
        of_each(found, "case", kind="name", head="Case"),
        of_each(found, "point", kind="name", head="Point"),
        Quantity([each.row + 1 for each in found], head="Pointing"),
        of_each(found, "deviation_um", UM, "deviation", head="Deviation from the mean", decimals=2),
        of_each(found, "ratio", head="Over its sd", decimals=2),
        *members_of_each(found, "row", "limit"),
    ]
    return Table("far_pointings", "Single pointings", columns)
