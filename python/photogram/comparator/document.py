"""Document of a calibration (JSON members: `docs/comparator.md`), and tests of its verdict."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.comparator.joint import JointFit
from photogram.comparator.pictures import plotters
from photogram.comparator.readings import Precision
from photogram.comparator.tables import (
    LINEAR,
    cases,
    coefficients,
    far_pointings,
    linear,
    outliers,
    plate_points,
    terms,
    variance,
)
from photogram.io.numbers import ARCSEC
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Layers, Part, Section, about, conventions
from photogram.show.quantity import members
from photogram.statistics.findings import Findings, Systematic, Tested
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.comparator import Calibration, PlateResult


UM = "µm"


def calibration_document(calibration: Calibration) -> Document:
    session, verdict, screening = calibration.session, calibration.verdict, calibration.screening
    own, nonlinear, tests = calibration.linear, calibration.nonlinear, calibration.polynomial_tests
    by_variance, of_cases = variance(calibration), cases(calibration)
    polynomials = (
        [terms(tests), coefficients(nonlinear.polynomial, nonlinear.sigma0_um**2)]
        if nonlinear and tests
        else []
    )
    disagreeing = [outliers(screening), far_pointings(calibration.far_pointings)]
    date = f", {session.date}" if session.date else ""
    drawings = [
        Drawing(f"picture-{name}", name.replace("-", " ").capitalize(), "", sketch)
        for name, sketch in plotters(calibration).items()
    ]
    return verdict_document(
        verdict,
        f"Calibration of comparator {session.comparator}",
        f"{len(calibration.cases)} cases{date}",
        highlights=_highlights(calibration),
        sections=[
            Section("variance", "Where the errors come from", [by_variance], by_variance.about),
            Section("pictures", "Pictures", [Layers("picture-layers", drawings)]),
            Section.of(linear(own.correction, own.covariance, own.degrees_of_freedom)),
            Section("polynomials", "Polynomials", polynomials, about("comparator.polynomials")),
            Section.of(of_cases),
            Section("outliers", "Readings that do not agree", disagreeing),
            Section("joint", "Joint adjustment", _joint(calibration), about("comparator.joint")),
            Section.of(verdict_table(verdict)),
            remarks_section(calibration.messages),
        ],
        members=partial(_members, calibration),
    )


def _highlights(calibration: Calibration) -> list[Fact]:
    variance, joint = calibration.variance, calibration.joint
    after = variance.after_nonlinear or variance.after_linear
    lack = calibration.linear.correction.nonorthogonality_rad / ARCSEC
    found = [
        Fact.of("A coordinate before", variance.before.total, UM, "sd of one axis", figures=3),
        Fact.of("After the calibration", after.total, UM, figures=3),
        Fact.of("Random comparator", variance.random, UM, figures=3),
        Fact.of("Pointing, mean of a point", variance.pointing.total, UM, figures=3),
        Fact.of("Lack of orthogonality", lack, "″", figures=3),
    ]
    return found + ([Fact.of("Joint adjustment, unit weight", joint.sigma0, decimals=4)] if joint else [])


def _joint(calibration: Calibration) -> list[Part]:
    if (joint := calibration.joint) is None:
        return []
    freedom, polynomial = joint.degrees_of_freedom, joint.correction.polynomial
    facts = [
        Fact.of(
            "Standard deviation of unit weight",
            joint.sigma0,
            note=f"{freedom} degrees of freedom",
            decimals=4,
        ),
        Fact.of("Random comparator, estimated", joint.random_um, UM, figures=4),
    ]
    for plate, own in joint.plates.items():
        how = "estimated" if own.estimated else "given"
        if own.variance_ratio is not None:
            how += f", variance ratio {own.variance_ratio:.3f}"
        facts.append(Fact.of(f"Grid {plate}, standard deviation", own.sigma_um, UM, how, figures=4))
    if calibration.joint_check is not None:
        name, note = (
            "Weighted mean of the report",
            "largest difference from a joint adjustment that assumes the same",
        )
        facts.append(Fact.of(name, calibration.joint_check, "sd", note, figures=2))
    parts: list[Part] = [
        Facts("Joint adjustment", facts),
        linear(joint.correction, joint.covariance, freedom, "joint_parameters"),
    ]
    if calibration.nonlinear and polynomial:
        parts.append(coefficients(polynomial, joint.sigma0**2, "joint_coefficients"))
    return parts + [
        plate_points(calibration.adjusted_grid(plate), own.points, own.corrections_um, own.sd_um)
        for plate, own in joint.plates.items()
    ]


def _members(calibration: Calibration) -> dict[str, Any]:
    own, usable, joint = calibration.linear, calibration.usable, calibration.joint
    plates = [_plate(calibration, result) for result in calibration.plates.values()]
    lines = {
        "before": calibration.variance.before,
        "after_linear": calibration.variance.after_linear,
        "after_nonlinear": calibration.variance.after_nonlinear,
        "mean_pointing": calibration.variance.pointing,
    }
    nonlinear, tests = calibration.nonlinear, calibration.polynomial_tests
    polynomial = (
        nonlinear
        and tests
        and {
            **members(nonlinear, "sigma0_um", "sigma_um", "degrees_of_freedom", "covariance"),
            **members(
                tests, f_ratio="ratio", f_degrees_of_freedom="degrees_of_freedom", f_probability="probability"
            ),
        }
    )
    x, y = nonlinear.polynomial.coefficients if nonlinear else (None, None)
    return {
        **members(calibration.session, "comparator", "date", secondary_stage="secondary"),
        **members(
            calibration,
            "options",
            "usable",
            variance_components_um="variance.components_um",
            case_variances="case_test",
            joint_check_sd="joint_check",
        ),
        "left_handed": calibration.cases[0].placed.orientation.left_handed,
        "conventions": conventions("comparator"),
        "messages": [*map(str, calibration.messages)],
        "screening": members(calibration.screening, "limit", "change_um", "sigma_um", "ratios", "freedom"),
        "linear": {
            **members(own.correction, *LINEAR),
            **members(own, "covariance", "sigma0_um", "degrees_of_freedom"),
        },
        "polynomial_x": x,
        "polynomial_y": y,
        "polynomial": polynomial,
        "pointing": _pointing(calibration),
        "grid_points": plates[0]["points"],
        "grid_corrections_um": plates[0]["corrections_um"],
        "sigma_grid_um": calibration.sigma_grid_um(plates[0]["plate"]),
        "plates": plates,
        "variance_analysis_um": {
            "negative": calibration.variance.negative,
            **{name: line and members(line, "x", "y", "total") for name, line in lines.items()},
        },
        "joint": joint and _joint_members(joint, usable=usable),
        "correction": calibration.correction.document() if usable else None,
    }


def _pointing(calibration: Calibration) -> dict[str, Any]:
    pointing, placed = calibration.pointing, [case.placed for case in calibration.cases]
    return {
        "points": [
            {"case": case.number, **members(each, "point", "mean_um"), **_precision(each.precision)}
            for case in placed
            for each in case.readings
        ],
        "cases": [{"case": case.number, **_precision(case.precision)} for case in placed],
        "operators": [
            {"operator": operator, **_precision(total), "points": _by_point(points)}
            for operator, (points, total) in pointing.operators.items()
        ],
        "total": {**_precision(pointing.total), "by_point": _by_point(pointing.points)},
    }


def _precision(found: Precision) -> dict[str, Any]:
    own = members(
        found,
        *(
            "readings",
            "points",
            "degrees_of_freedom",
            "sd_um",
            "sd_point_um",
            "covariance_um2",
            "correlation",
        ),
        correlation_percent="listed_correlation_percent",
        sd_mean_um="mean_sd_um",
        sd_mean_point_um="mean_sd_point_um",
    )
    return {**own, "ellipse": None if np.isnan(found.sd_point_um) else found.ellipse}


def _by_point(points: dict[int, Precision]) -> list[dict[str, Any]]:
    return [{"point": point, **_precision(own)} for point, own in points.items()]


def _plate(calibration: Calibration, result: PlateResult) -> dict[str, Any]:
    averages = result.averages
    grid = calibration.session.grids[averages.plate]
    given, corrections = grid.xy_um[grid.rows_of(averages.points)], averages.corrections_um
    return {
        **members(grid, "adopted", "temperature_c", "expansion_per_k"),
        **members(averages, "plate", "left_handed", "points", "by_location"),
        **members(averages, cases="counts", corrections_um="grid_um"),
        "corrections_plate_um": corrections,
        "corrected_plate_um": given + corrections,
        "sigma_um": {
            "a_priori": grid.sigma_um,
            **members(result, unbiased="unbiased_um", text="text_um", listing="listed.grid_um"),
        },
        "standard_deviation_um": members(result.listed, comparator="mean_comparator_um", grid="mean_grid_um"),
        "random_um": result.listed.random_um,
    }


def _joint_members(joint: JointFit, *, usable: bool) -> dict[str, Any]:
    return {
        **members(joint.correction, *LINEAR),
        **members(joint, "covariance", "sigma0", "degrees_of_freedom", sigma_random_um="random_um"),
        "cases": [
            members(
                case,
                *("rotation_rad", "translation_um", "standardized"),
                case="number",
                residuals_comparator_um="residuals.comparator_um",
            )
            for case in joint.cases
        ],
        "plates": [
            members(
                own,
                *("points", "sigma_um", "variance_ratio", "test"),
                corrections_plate_um="corrections_um",
                covariance_plate_um2="covariance_um2",
                sigma_estimated="estimated",
            )
            | {"plate": plate}
            for plate, own in joint.plates.items()
        ],
        "correction": joint.correction.document() if usable else None,
    }


FAR = 3.0  # larger differences indicate another grid, in standard deviations


def comparator_findings(calibration: Calibration) -> Findings:
    """Return the tests of a calibration. They are t tests without prior deviations."""
    screening = calibration.screening
    places = [
        (case.number, point, axis)
        for case in calibration.cases
        for point in case.placed.points.tolist()
        for axis in "xy"
    ]

    def name(index: tuple[int, ...]) -> Phrase:
        case, point, axis = places[index[0]]
        return phrase("comparators.axis", axis=axis, point=point, case=case)

    values, kind = np.vstack(screening.ratios).ravel(), phrase("comparators.readings")
    readings = Tested(kind, values, name, "t", second=max(screening.freedom - 1, 1))
    tests = calibration.pointing_tests
    rows = [(each.case, row, axis) for each in tests for row in range(len(each.ratios)) for axis in "xy"]

    def pointing(index: tuple[int, ...]) -> Phrase:
        case, row, axis = rows[index[0]]
        fields = {"axis": axis, "pointing": row + 1, "point": int(case.points[row]), "case": case.number}
        return phrase("comparators.pointing", **fields)

    ratios = np.concatenate([each.ratios.ravel() for each in tests])
    freedom = np.repeat([each.freedom for each in tests], [each.ratios.size for each in tests])
    pointings = Tested(
        phrase("comparators.pointings"), ratios, pointing, "t", second=np.maximum(freedom - 1.0, 1.0)
    )
    return Findings(
        status="converged",
        observations=[readings, pointings],
        degrees_of_freedom=screening.freedom,
        untested=phrase("untested.readings"),
        spoiled=phrase("harmful.comparator", change=screening.change_um, sd=screening.sigma_um)
        if screening.harmful
        else "",
        systematic=_grids(calibration.joint) if calibration.joint else [],
        if_usable=[phrase("advice.correct-measurements"), phrase("advice.keep-calibration")],
        if_withheld=[phrase("advice.correction-withheld")],
    )


def _grids(joint: JointFit) -> list[Systematic]:
    return [
        Systematic(
            kind=phrase("test.plate", plate=str(plate)),
            sentence=phrase("pattern.plate", plate=str(plate), factor=float(test.factor)),
            statistic="s^2",
            distribution="chi2/f",
            dof=(test.degrees_of_freedom,),
            value=test.variance,
            probability=test.probability_above,
            level=test.level / 2,
            large=test.factor > FAR,
        )
        for plate, result in joint.plates.items()
        if (test := result.test) is not None
    ]
