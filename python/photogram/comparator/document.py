"""The JSON document of a calibration; `docs/comparator.md` lists its members."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from photogram import _photocore
from photogram.io import json

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration, CaseResult, PlateResult
    from photogram.comparator.closeout import Closeout
    from photogram.comparator.joint import JointFit
    from photogram.comparator.pointing import Ellipse, PointReadings, Precision
    from photogram.comparator.residuals import Residuals
    from photogram.comparator.rigid import RigidFit

__all__ = ["to_document", "to_json"]

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
    return json.to_json(to_document(calibration))


def to_document(calibration: Calibration) -> dict[str, Any]:
    """Return the calibration as plain values, units in the names of the members."""
    session, linear, nonlinear = calibration.session, calibration.linear, calibration.nonlinear
    plates = list(calibration.plates.values())
    coefficients = nonlinear.polynomial.coefficients.tolist() if nonlinear else [None, None]
    return {
        "program": f"photogram {_photocore.__version__}",
        "comparator": session.comparator,
        "secondary_stage": session.secondary,
        "date": session.date,
        "left_handed": calibration.cases[0].placed.orientation.left_handed,
        "options": asdict(calibration.options),
        "conventions": CONVENTIONS,
        "messages": [str(message) for message in calibration.messages],
        "usable": calibration.usable,
        "verdict": calibration.verdict.document(),
        "screening": asdict(calibration.screening),
        "far_pointings": [asdict(pointing) for pointing in calibration.far_pointings],
        "linear": {
            "scale_x": linear.correction.scale_x,
            "scale_y": linear.correction.scale_y,
            "nonorthogonality_rad": linear.correction.nonorthogonality_rad,
            "covariance": linear.covariance.tolist(),
            "sigma0_um": linear.sigma0_um,
            "degrees_of_freedom": linear.degrees_of_freedom,
        },
        "cases": [_case(calibration, index) for index in range(len(calibration.cases))],
        "polynomial_x": coefficients[0],
        "polynomial_y": coefficients[1],
        "polynomial": _polynomial(calibration),
        "pointing": _pointing(calibration),
        "grid_points": plates[0].averages.points.tolist(),
        "grid_corrections_um": plates[0].averages.grid_um.tolist(),
        "sigma_grid_um": calibration.sigma_grid_um(plates[0].averages.plate),
        "plates": [_plate(calibration, result) for result in plates],
        "variance_components_um": calibration.variance.components_um,
        "variance_analysis_um": _variance(calibration),
        "case_variances": asdict(calibration.case_test) if calibration.case_test else None,
        "joint": _joint(calibration.joint, usable=calibration.usable) if calibration.joint else None,
        "joint_check_sd": calibration.joint_check,
        "correction": calibration.correction.document() if calibration.usable else None,
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
        "points": placed.points.tolist(),
        "nearest_point": placed.orientation.nearest_point,
        "corner": placed.orientation.corner,
        "left_handed": placed.orientation.left_handed,
        "rotation_rad": combined.rotation_rad,
        "translation_um": combined.translation_um.tolist(),
        "sigma0_um": {
            "free": case.free.residuals.sigma0_um,
            "linear": case.linear.residuals.sigma0_um,
            "nonlinear": case.polynomial.residuals.sigma0_um if case.polynomial else None,
        },
        "sigma0_combined_um": {
            "linear": combined.residuals.sigma0_um,
            "nonlinear": last.residuals.sigma0_um if calibration.nonlinear else None,
        },
        "means_um": placed.means_um.tolist(),
        "corrected_um": last.residuals.xy_um.tolist(),
        "residuals_comparator_um": last.residuals.comparator_um.tolist(),
        "residuals_grid_um": last.residuals.grid_um.tolist(),
        "stages": _stages(case, combined, last),
        "linear": {
            "scale_x": parameters.scale_x,
            "scale_y": parameters.scale_y,
            "nonorthogonality_rad": parameters.nonorthogonality_rad,
            "rotation_rad": parameters.rotation_rad,
            "translation_um": case.linear.translation_um.tolist(),
            "covariance": case.linear.covariance.tolist(),
        },
        "polynomial": {
            "coefficients_x": case.polynomial.polynomial.coefficients[0].tolist(),
            "coefficients_y": case.polynomial.polynomial.coefficients[1].tolist(),
            "covariance": case.polynomial.covariance.tolist(),
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
        "comparator_um": residuals.comparator_um.tolist(),
        "grid_um": residuals.grid_um.tolist(),
        "sum_vv_um2": list(residuals.squares_um2),
        "sigma_um": list(residuals.sigma_um),
    }


def _closeout(closeout: Closeout) -> dict[str, Any]:
    total = closeout.total_shift_um
    return {
        "point": closeout.point,
        "pointings": list(closeout.counts),
        "sequential_shifts_um": closeout.sequential_shifts_um.tolist(),
        "total_shift_um": None if total is None else total.tolist(),
        "verdict": closeout.verdict,
    }


def _polynomial(calibration: Calibration) -> dict[str, Any] | None:
    nonlinear, tests = calibration.nonlinear, calibration.polynomial_tests
    if nonlinear is None or tests is None:
        return None
    return {
        "sigma0_um": nonlinear.sigma0_um,
        "sigma_um": list(nonlinear.sigma_um),
        "degrees_of_freedom": nonlinear.degrees_of_freedom,
        "covariance": nonlinear.covariance.tolist(),
        "f_ratio": tests.ratio,
        "f_degrees_of_freedom": list(tests.degrees_of_freedom),
        "f_probability": tests.probability,
        "terms": [{**asdict(term), "ratio": term.ratio} for term in tests.terms],
    }


def _precision(precision: Precision) -> dict[str, Any]:
    return {
        "readings": precision.readings,
        "points": precision.points,
        "degrees_of_freedom": precision.degrees_of_freedom,
        "sd_um": list(precision.sd_um),
        "sd_point_um": precision.sd_point_um,
        "covariance_um2": precision.covariance_um2,
        "correlation": precision.correlation,
        "correlation_percent": precision.listed_correlation_percent,
        "sd_mean_um": list(precision.mean_sd_um),
        "sd_mean_point_um": precision.mean_sd_point_um,
        "ellipse": None if math.isnan(precision.sd_point_um) else _ellipse(precision.ellipse),
    }


def _ellipse(ellipse: Ellipse) -> dict[str, float]:
    return {
        "major_um": ellipse.major_um,
        "minor_um": ellipse.minor_um,
        "angle_rad": ellipse.angle_rad,
    }


def _pointing(calibration: Calibration) -> dict[str, Any]:
    """Precision by point (of each case, and over all cases), by case, by operator, and in all."""
    pointing = calibration.pointing

    def point(case: CaseResult, readings: PointReadings) -> dict[str, Any]:
        head = {"case": case.number, "point": readings.point, "mean_um": readings.mean_um.tolist()}
        return {**head, **_precision(readings.precision)}

    return {
        "points": [point(case, readings) for case in calibration.cases for readings in case.placed.readings],
        "cases": [{"case": case.number, **_precision(case.placed.precision)} for case in calibration.cases],
        "operators": [
            {
                "operator": operator,
                **_precision(total),
                "points": [{"point": number, **_precision(own)} for number, own in points.items()],
            }
            for operator, (points, total) in pointing.operators.items()
        ],
        "total": {
            **_precision(pointing.total),
            "by_point": [{"point": number, **_precision(own)} for number, own in pointing.points.items()],
        },
    }


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
        "points": averages.points.tolist(),
        "cases": averages.counts.tolist(),
        "corrections_um": averages.grid_um.tolist(),
        "corrections_plate_um": corrections.tolist(),
        "corrected_plate_um": (given + corrections).tolist(),
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
        "random_um": list(result.listed.random_um),
        "by_location": [
            {
                "cases": list(place.cases),
                "locations": place.locations.tolist(),
                "xy_um": place.xy_um.tolist(),
                "residuals_um": place.residuals_um.tolist(),
            }
            for place in averages.by_location
        ],
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
    return {**document, "negative": list(variance.negative)}


def _joint(joint: JointFit, *, usable: bool) -> dict[str, Any]:
    correction = joint.correction
    return {
        "scale_x": correction.scale_x,
        "scale_y": correction.scale_y,
        "nonorthogonality_rad": correction.nonorthogonality_rad,
        "covariance": joint.covariance.tolist(),
        "sigma0": joint.sigma0,
        "degrees_of_freedom": joint.degrees_of_freedom,
        "sigma_random_um": joint.random_um,
        "cases": [
            {
                "case": case.number,
                "rotation_rad": case.rotation_rad,
                "translation_um": case.translation_um.tolist(),
                "residuals_comparator_um": case.residuals.comparator_um.tolist(),
                "standardized": case.standardized.tolist(),
            }
            for case in joint.cases
        ],
        "plates": [
            {
                "plate": number,
                "points": plate.points.tolist(),
                "corrections_plate_um": plate.corrections_um.tolist(),
                "covariance_plate_um2": plate.covariance_um2.tolist(),
                "sigma_um": plate.sigma_um,
                "sigma_estimated": plate.estimated,
                "variance_ratio": plate.variance_ratio,
                "test": asdict(plate.test) if plate.test else None,
            }
            for number, plate in joint.plates.items()
        ],
        "correction": correction.document() if usable else None,
    }
