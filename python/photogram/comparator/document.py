"""The JSON document of a calibration; `docs/comparator.md` lists its members."""

from __future__ import annotations

from typing import Any

from photogram import _photocore
from photogram.comparator.calibration import Calibration, CaseResult, PlateResult
from photogram.comparator.closeout import Closeout
from photogram.comparator.correction import Correction
from photogram.comparator.fits import Decomposition, Residuals, RigidFit
from photogram.comparator.joint import JointFit
from photogram.comparator.pointing import Precision
from photogram.comparator.tables import precisions, terms
from photogram.io import json
from photogram.show.quantity import Quantity, of_each, records

CONVENTIONS = {
    "residuals_comparator_um": "grid transformed into the comparator system less measured: to be added to"
    " the measurement",
    "residuals_grid_um": "measured transformed into the grid system less given: to be added to the grid;"
    " X and Y of the plate are exchanged where left_handed is true",
    "grid_corrections_um": "averages of residuals_grid_um after all corrections, X and Y exchanged where"
    " left_handed is true; corrections_plate_um are the same in the axes of the plate",
    "rotation_rad": "grid = [[cos, sin], [-sin, cos]] corrected + translation_um",
    "linear": "x' = scale_x x + scale_y sin(nonorthogonality) y, y' = scale_y cos(nonorthogonality) y",
    "polynomial": "coefficients of x^4, y^4, x^3, y^3, x^2, y^2, x, y, 1; linearly corrected arguments and"
    " correction in metres",
    "sigma0_um": "of each case alone; sigma0_combined_um: after the combined adjustments",
    "variance_components_um": "standard deviations",
    "correlation_percent": "as the listing: 100 where one coordinate does not vary (correlation: null)",
    "correction": "linear parameters and polynomials; covariance of scale_x, scale_y, nonorthogonality_rad,"
    " nine coefficients of x, nine of y (micrometres, arguments (x - centre) / half range); null where"
    " the verdict forbids its use",
    "screening": "measured points that do not agree with the adjustment of the others; off_um: measured less"
    " expected; change_um: what they change corrected coordinates by",
}


def to_json(calibration: Calibration) -> bytes:
    """Return the whole calibration as JSON (UTF-8). What is not a number is null."""
    return json.to_json(_document(calibration))


def _document(calibration: Calibration) -> dict[str, Any]:
    session, linear, nonlinear = calibration.session, calibration.linear, calibration.nonlinear
    plates = list(calibration.plates.values())
    coefficients = nonlinear.polynomial.coefficients if nonlinear else [None, None]
    return {
        "program": f"photogram {_photocore.__version__}",
        "comparator": session.comparator,
        "secondary_stage": session.secondary,
        "date": session.date,
        "left_handed": calibration.cases[0].placed.orientation.left_handed,
        "options": calibration.options,
        "conventions": CONVENTIONS,
        "messages": [str(message) for message in calibration.messages],
        "usable": calibration.usable,
        "verdict": calibration.verdict.document(),
        "screening": calibration.screening,
        "far_pointings": calibration.far_pointings,
        "linear": {
            **_linear(linear.correction),
            "covariance": linear.covariance,
            "sigma0_um": linear.sigma0_um,
            "degrees_of_freedom": linear.degrees_of_freedom,
        },
        "cases": [_case(calibration, index) for index in range(len(calibration.cases))],
        "polynomial_x": coefficients[0],
        "polynomial_y": coefficients[1],
        "polynomial": _polynomial(calibration),
        "pointing": _pointing(calibration),
        "grid_points": plates[0].averages.points,
        "grid_corrections_um": plates[0].averages.grid_um,
        "sigma_grid_um": calibration.sigma_grid_um(plates[0].averages.plate),
        "plates": [_plate(calibration, result) for result in plates],
        "variance_components_um": calibration.variance.components_um,
        "variance_analysis_um": _variance(calibration),
        "case_variances": calibration.case_test,
        "joint": _joint(calibration.joint, usable=calibration.usable) if calibration.joint else None,
        "joint_check_sd": calibration.joint_check,
        "correction": calibration.correction.document() if calibration.usable else None,
    }


def _linear(found: Correction | Decomposition) -> dict[str, float]:
    return {
        "scale_x": found.scale_x,
        "scale_y": found.scale_y,
        "nonorthogonality_rad": found.nonorthogonality_rad,
    }


def _case(calibration: Calibration, index: int) -> dict[str, Any]:
    case, last = calibration.cases[index], calibration.last_fits[index]
    combined = calibration.linear.cases[index]
    placed = case.placed
    parameters = case.linear.parameters
    return {
        "case": case.number,
        "operator": placed.case.operator,
        "plate": placed.case.plate,
        "points": placed.points,
        "nearest_point": placed.orientation.nearest_point,
        "corner": placed.orientation.corner,
        "left_handed": placed.orientation.left_handed,
        "rotation_rad": combined.rotation_rad,
        "translation_um": combined.translation_um,
        "sigma0_um": {
            "free": case.free.residuals.sigma0_um,
            "linear": case.linear.residuals.sigma0_um,
            "nonlinear": case.polynomial.residuals.sigma0_um if case.polynomial else None,
        },
        "sigma0_combined_um": {
            "linear": combined.residuals.sigma0_um,
            "nonlinear": last.residuals.sigma0_um if calibration.nonlinear else None,
        },
        "means_um": placed.means_um,
        "corrected_um": last.residuals.xy_um,
        "residuals_comparator_um": last.residuals.comparator_um,
        "residuals_grid_um": last.residuals.grid_um,
        "stages": _stages(case, combined, last),
        "linear": {
            **_linear(parameters),
            "rotation_rad": parameters.rotation_rad,
            "translation_um": case.linear.translation_um,
            "covariance": case.linear.covariance,
        },
        "polynomial": {
            "coefficients_x": case.polynomial.polynomial.coefficients[0],
            "coefficients_y": case.polynomial.polynomial.coefficients[1],
            "covariance": case.polynomial.covariance,
        }
        if case.polynomial
        else None,
        "closeouts": [_closeout(closeout) for closeout in case.closeouts],
    }


def _stages(case: CaseResult, combined: RigidFit, last: RigidFit) -> dict[str, Any]:
    """Residuals of every stage by name."""
    stages = {
        "free": case.free.residuals,
        "linear": case.linear.residuals,
        "combined_linear": combined.residuals,
        "combined_last": last.residuals,
    }
    if case.polynomial:
        stages["nonlinear"] = case.polynomial.residuals
    return {name: _residuals(residuals) for name, residuals in stages.items()}


def _residuals(residuals: Residuals) -> dict[str, Any]:
    return {
        "comparator_um": residuals.comparator_um,
        "grid_um": residuals.grid_um,
        "sum_vv_um2": residuals.squares_um2,
        "sigma_um": residuals.sigma_um,
    }


def _closeout(closeout: Closeout) -> dict[str, Any]:
    return {
        "point": closeout.point,
        "pointings": closeout.counts,
        "sequential_shifts_um": closeout.sequential_shifts_um,
        "total_shift_um": closeout.total_shift_um,
        "verdict": closeout.verdict,
    }


def _polynomial(calibration: Calibration) -> dict[str, Any] | None:
    nonlinear, tests = calibration.nonlinear, calibration.polynomial_tests
    if nonlinear is None or tests is None:
        return None
    return {
        "sigma0_um": nonlinear.sigma0_um,
        "sigma_um": nonlinear.sigma_um,
        "degrees_of_freedom": nonlinear.degrees_of_freedom,
        "covariance": nonlinear.covariance,
        "f_ratio": tests.ratio,
        "f_degrees_of_freedom": tests.degrees_of_freedom,
        "f_probability": tests.probability,
        "terms": records(terms(tests.terms)),
    }


def _pointing(calibration: Calibration) -> dict[str, Any]:
    """Precision by point (of each case, and over all cases), by case, by operator, and in all."""
    pointing = calibration.pointing
    read = [(case.number, each) for case in calibration.cases for each in case.placed.readings]
    readings = [each for _, each in read]
    points = [
        Quantity([number for number, _ in read], member="case"),
        of_each(readings, "point"),
        of_each(readings, "mean_um"),
        *precisions([each.precision for each in readings]),
    ]
    own = [case.placed.precision for case in calibration.cases]
    return {
        "points": records(points),
        "cases": records([of_each(calibration.cases, "number", member="case"), *precisions(own)]),
        "operators": [
            {"operator": operator, **_precision(total), "points": _by_point(of_points)}
            for operator, (of_points, total) in pointing.operators.items()
        ],
        "total": {**_precision(pointing.total), "by_point": _by_point(pointing.points)},
    }


def _precision(precision: Precision) -> dict[str, Any]:
    return records(precisions([precision]))[0]


def _by_point(points: dict[int, Precision]) -> list[dict[str, Any]]:
    return records([Quantity([*points], member="point"), *precisions([*points.values()])])


def _plate(calibration: Calibration, result: PlateResult) -> dict[str, Any]:
    averages = result.averages
    grid = calibration.session.grids[averages.plate]
    given = grid.xy_um[grid.rows_of(averages.points)]
    corrections = averages.corrections_um
    return {
        "plate": averages.plate,
        "adopted": grid.adopted,
        "temperature_c": grid.temperature_c,
        "expansion_per_k": grid.expansion_per_k,
        "left_handed": averages.left_handed,
        "points": averages.points,
        "cases": averages.counts,
        "corrections_um": averages.grid_um,
        "corrections_plate_um": corrections,
        "corrected_plate_um": given + corrections,
        "sigma_um": {
            "a_priori": grid.sigma_um,
            "unbiased": result.unbiased_um,
            "text": result.text_um,
            "listing": result.listed.grid_um,
        },
        "standard_deviation_um": {
            "comparator": result.listed.mean_comparator_um,
            "grid": result.listed.mean_grid_um,
        },
        "random_um": result.listed.random_um,
        "by_location": averages.by_location,
    }


def _variance(calibration: Calibration) -> dict[str, Any]:
    """Return the lines of figure 30."""
    variance = calibration.variance
    lines = {
        "before": variance.before,
        "after_linear": variance.after_linear,
        "after_nonlinear": variance.after_nonlinear,
        "mean_pointing": variance.pointing,
    }
    document: dict[str, Any] = {
        name: None if line is None else {"x": line.x, "y": line.y, "total": line.total}
        for name, line in lines.items()
    }
    return {**document, "negative": variance.negative}


def _joint(joint: JointFit, *, usable: bool) -> dict[str, Any]:
    correction = joint.correction
    return {
        **_linear(correction),
        "covariance": joint.covariance,
        "sigma0": joint.sigma0,
        "degrees_of_freedom": joint.degrees_of_freedom,
        "sigma_random_um": joint.random_um,
        "cases": [
            {
                "case": case.number,
                "rotation_rad": case.rotation_rad,
                "translation_um": case.translation_um,
                "residuals_comparator_um": case.residuals.comparator_um,
                "standardized": case.standardized,
            }
            for case in joint.cases
        ],
        "plates": [
            {
                "plate": number,
                "points": plate.points,
                "corrections_plate_um": plate.corrections_um,
                "covariance_plate_um2": plate.covariance_um2,
                "sigma_um": plate.sigma_um,
                "sigma_estimated": plate.estimated,
                "variance_ratio": plate.variance_ratio,
                "test": plate.test,
            }
            for number, plate in joint.plates.items()
        ],
        "correction": correction.document() if usable else None,
    }
