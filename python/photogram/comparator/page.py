"""The page of a calibrated comparator: what it says, before the listing of 1973 (listing.txt) repeats it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.calibration import Calibration
from photogram.comparator.polynomial import TERMS
from photogram.comparator.variance import AxisSigma
from photogram.show.angles import ARCSEC
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.page import (
    Cell,
    Column,
    Drawing,
    Fact,
    Facts,
    Layers,
    Page,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
    fixed,
    significant,
)
from photogram.show.ways import page_of

if TYPE_CHECKING:
    from photogram.arguments.types import Floats
    from photogram.comparator.joint import JointFit

__all__ = ["calibration_page"]

UM = "µm"


@page_of.register(Calibration)
def calibration_page(calibration: Calibration) -> Page:
    """Return the report of a calibration for the browser."""
    session = calibration.session
    date = f", {session.date}" if session.date else ""
    sections = [
        Section("variance", "Where the errors come from", [_variance(calibration)], _VARIANCE),
        Section("pictures", "Pictures", _pictures(calibration)),
        Section("linear", "Linear parameters", [_linear(calibration)], _LINEAR),
        Section("polynomials", "Polynomials", _polynomials(calibration), _POLYNOMIALS),
        Section("cases", "Cases", _cases(calibration)),
        Section("outliers", "Readings that do not agree", _outliers(calibration)),
        Section("joint", "Joint adjustment", _joint(calibration.joint) if calibration.joint else [], _JOINT),
        tests_section(calibration.verdict),
        remarks_section(calibration.messages),
    ]
    return Page(
        what="Calibration of a comparator",
        title=f"Comparator {session.comparator}, {len(calibration.cases)} cases{date}",
        judgements=[judged(calibration.verdict)],
        advice=calibration.verdict.next,
        highlights=_highlights(calibration),
        sections=sections,
    )


_VARIANCE = (
    "Standard deviations of a coordinate, stage by stage, and what of them is whose. Systematic shares"
    " are what the"
    " calibration takes away; the random one is what stays in every corrected measurement."
)
_LINEAR = (
    "x′ = scale x · x + scale y · sin α · y, y′ = scale y · cos α · y. α is the lack of orthogonality of the"
    " axes."
)
_POLYNOMIALS = (
    "What is added to linearly corrected coordinates: polynomials of fourth degree in metres. Each term"
    " is tested with"
    " its argument from -1 to 1 over the measured range, so that its coefficient is its effect at the edge."
)
_JOINT = "All cases, comparator, polynomials and grid in one adjustment, with the accuracy of the grid."


def _highlights(calibration: Calibration) -> list[Fact]:
    variance = calibration.variance
    after = variance.after_nonlinear or variance.after_linear
    found = [
        Fact(
            "A coordinate before", significant(variance.before.total, 3), UM, "standard deviation of one axis"
        ),
        Fact("After the calibration", significant(after.total, 3), UM),
        Fact("Random comparator", significant(variance.random, 3), UM),
        Fact("Pointing, mean of a point", significant(variance.pointing.total, 3), UM),
    ]
    own = calibration.linear.correction
    lack = own.nonorthogonality_rad / ARCSEC
    found.append(Fact("Lack of orthogonality", significant(lack, 3), "″"))
    return found


def _variance(calibration: Calibration) -> Table:
    variance = calibration.variance
    stages: list[tuple[str, AxisSigma | None]] = [
        ("Before the calibration, everything", variance.before),
        ("After the linear parameters", variance.after_linear),
        ("After linear parameters and polynomials", variance.after_nonlinear),
        ("Pointing, mean of a point", variance.pointing),
    ]
    rows: list[Row] = [[name, each.x, each.y, each.total] for name, each in stages if each is not None]
    for plate in calibration.plates:
        given = calibration.session.grids[plate].sigma_um
        rows.append([f"Grid {plate}, given", None, None, given])
        rows.append([f"Grid {plate}, computed without bias", None, None, calibration.sigma_grid_um(plate)])
    rows += [
        ["Systematic comparator, linear", None, None, variance.linear],
        ["Systematic comparator, polynomials", None, None, variance.nonlinear],
        ["Random comparator", None, None, variance.random],
    ]
    columns = (
        Column("Standard deviation", text=True),
        Column("x", UM, decimals=3),
        Column("y", UM, decimals=3),
        Column("Total", UM, decimals=3),
    )
    note = f"Negative variances, set to 0: {', '.join(variance.negative)}." if variance.negative else ""
    return Table("Analysis of variance", columns, rows, note)


def _linear(calibration: Calibration) -> Table:
    own, linear = calibration.linear.correction, calibration.linear
    return _linear_table(
        own.scale_x, own.scale_y, own.nonorthogonality_rad, linear.covariance, linear.degrees_of_freedom
    )


def _linear_table(x: float, y: float, lean: float, covariance: Floats, freedom: int) -> Table:
    sd = np.sqrt(np.diag(covariance))
    rows: list[Row] = [
        ["Scale x", _written(x, sd[0]), float(sd[0]), Cell(f"{1e6 * (x - 1):.2f}", sorts=x - 1), "µm/m"],
        ["Scale y", _written(y, sd[1]), float(sd[1]), Cell(f"{1e6 * (y - 1):.2f}", sorts=y - 1), "µm/m"],
        ["Scale x over scale y", _written(x / y, sd[0]), None, Cell(f"{1e6 * (x / y - 1):.2f}"), "µm/m"],
        ["Lack of orthogonality α, ″", _written(lean / ARCSEC, sd[2] / ARCSEC), sd[2] / ARCSEC, None, ""],
    ]
    columns = (
        Column("Parameter", text=True),
        Column("Value"),
        Column("sd", figures=3),
        Column("Less one"),
        Column("Unit", text=True),
    )
    return Table("Linear parameters", columns, rows, f"{freedom} degrees of freedom")


def _written(value: float, sd: float) -> Cell:
    return Cell(fixed(float(value), decimals_of(np.array([float(sd)]))), sorts=float(value))


def _polynomials(calibration: Calibration) -> list[Part]:
    nonlinear, test = calibration.nonlinear, calibration.polynomial_tests
    if nonlinear is None:
        return []
    parts: list[Part] = []
    if test is not None:
        first, second = test.degrees_of_freedom
        p = "" if test.probability is None else f", p = {significant(test.probability, 3)}"
        note = f"All terms together: F = {test.ratio:.2f} with {first} and {second} degrees of freedom{p}."
        columns = (
            Column("Axis", text=True),
            Column("Term", text=True),
            Column("Coefficient", UM, decimals=3),
            Column("sd", UM, decimals=3),
            Column("t", decimals=2),
            Column("p", decimals=4),
        )
        rows: list[Row] = [
            [each.axis, _powers(each.term), each.coefficient_um, each.sd_um, each.ratio, each.probability]
            for each in test.terms
        ]
        parts.append(Table("Terms and their tests", columns, rows, note))
    x, y = nonlinear.polynomial.coefficients
    sd = np.sqrt(np.diag(nonlinear.covariance))
    coefficients: list[Row] = [
        [_powers(term), float(x[k]), float(sd[k]), float(y[k]), float(sd[len(TERMS) + k])]
        for k, term in enumerate(TERMS)
    ]
    heads = (
        Column("Term", text=True),
        Column("In x", "m", figures=6),
        Column("sd", "m", figures=3),
        Column("In y", "m", figures=6),
        Column("sd", "m", figures=3),
    )
    parts.append(Table("Coefficients, arguments in metres", heads, coefficients))
    return parts


def _powers(term: str) -> str:
    return term.replace("^4", "⁴").replace("^3", "³").replace("^2", "²")


def _cases(calibration: Calibration) -> list[Part]:
    columns = (
        Column("Case", text=True),
        Column("Plate", text=True),
        Column("Operator", text=True),
        Column("Points"),
        Column("Unit weight, free", UM, decimals=3),
        Column("after linear", UM, decimals=3),
        Column("after polynomials", UM, decimals=3),
    )
    rows: list[Row] = []
    for case in calibration.cases:
        placed = case.placed
        rows.append(
            [
                str(case.number),
                str(placed.case.plate),
                str(placed.case.operator),
                len(placed.points),
                case.free.residuals.sigma0_um,
                case.linear.residuals.sigma0_um,
                case.polynomial.residuals.sigma0_um if case.polynomial else None,
            ]
        )
    note, test = "", calibration.case_test
    if test is not None and test.f_max_limit is not None:
        same = "are" if test.f_max <= test.f_max_limit else "are not"
        note = (
            f"F-max = {test.f_max:.2f}, limit {test.f_max_limit:.2f}: the cases {same} of one population"
            " (95 percent)."
        )
    return [Table("Cases", columns, rows, note)]


def _outliers(calibration: Calibration) -> list[Part]:
    parts: list[Part] = []
    found = calibration.screening.outliers
    if found:
        columns = (
            Column("Case", text=True),
            Column("Point", text=True),
            Column("Off in x", UM, decimals=2),
            Column("Off in y", UM, decimals=2),
            Column("Test value t", decimals=2),
            Column("Point that is expected there", text=True),
        )
        rows: list[Row] = [
            [
                str(each.case),
                str(each.point),
                *each.off_um,
                each.ratio,
                "none" if each.instead is None else str(each.instead),
            ]
            for each in found
        ]
        screening = calibration.screening
        note = (
            f"Beyond {screening.limit:.2f} the test rejects. They change corrected coordinates by"
            f" {screening.change_um:.2f} {UM} (root mean square)."
        )
        parts.append(Table("Points", columns, rows, note))
    if calibration.far_pointings:
        heads = (
            Column("Case", text=True),
            Column("Point", text=True),
            Column("Pointing"),
            Column("Deviation from the mean", UM, decimals=2),
            Column("Over its sd", decimals=2),
        )
        rows = [
            [str(each.case), str(each.point), each.row + 1, each.deviation_um, each.ratio]
            for each in calibration.far_pointings
        ]
        parts.append(Table("Single pointings", heads, rows))
    return parts


def _joint(joint: JointFit) -> list[Part]:
    facts = [
        Fact(
            "Standard deviation of unit weight",
            f"{joint.sigma0:.4f}",
            note=f"{joint.degrees_of_freedom} degrees of freedom",
        ),
        Fact("Random comparator, estimated", significant(joint.random_um, 4), UM),
    ]
    for plate, own in joint.plates.items():
        how = "estimated" if own.estimated else "given"
        facts.append(Fact(f"Grid {plate}, standard deviation", significant(own.sigma_um, 4), UM, how))
    correction = joint.correction
    return [
        Facts("Joint adjustment", facts),
        _linear_table(
            correction.scale_x,
            correction.scale_y,
            correction.nonorthogonality_rad,
            joint.covariance,
            joint.degrees_of_freedom,
        ),
    ]


def _pictures(calibration: Calibration) -> list[Part]:
    """Return the pictures of the calibration, one shown at a time."""
    from photogram.comparator.pictures.book import figures

    layers = [
        Drawing(f"picture-{name}", _title(name), "", lambda figure=figure: figure)  # type: ignore[misc]
        for name, figure in figures(calibration)
    ]
    return [Layers("picture-layers", layers)]


def _title(name: str) -> str:
    words = name.replace("-", " ")
    return words[:1].upper() + words[1:]
