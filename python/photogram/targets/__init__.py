"""Calibration with targets: boards, their corners in pictures, and what these say of cameras and rigs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.arguments.annotations import check_arguments
from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.targets.appraisal import appraise, cross_validate
    from photogram.targets.board import Board
    from photogram.targets.calibration import Calibration, simulate_corners
    from photogram.targets.calibration_difference import CameraDifference
    from photogram.targets.calibration_result import Calibrated, Worth, WorthOptions
    from photogram.targets.conversion import Conversion, convert_lens
    from photogram.targets.corners import Corners
    from photogram.targets.cross_validation import CrossValidation
    from photogram.targets.drawing import (
        draw_cross_validation,
        draw_difference,
        draw_uncertainty,
        draw_uncertainty_curve,
    )
    from photogram.targets.first_calibration import FirstCalibration, first_values, nominal_camera
    from photogram.targets.grouping import corner_components, residual_groups
    from photogram.targets.maps import UncertaintyCurve, UncertaintyMap
    from photogram.targets.new_views import Candidate, NewView, Suggestions
    from photogram.targets.output.formats import camera_files
    from photogram.targets.plan_drawing import draw_planned_views
    from photogram.targets.reading import read
    from photogram.targets.residual_drawing import draw_board_residuals, draw_poorest_views
    from photogram.targets.suggestions import suggest_views
    from photogram.targets.triangulation import Triangulated, distance_uncertainty, triangulate
    from photogram.targets.uncertainty import (
        difference,
        projection_uncertainty,
        uncertainty_against_distance,
        uncertainty_map,
    )
    from photogram.targets.view_plan import plan_views
    from photogram.targets.view_plan_result import PlannedView, ViewPlan

__all__ = [
    "Board",
    "Calibrated",
    "Calibration",
    "CameraDifference",
    "Candidate",
    "Conversion",
    "Corners",
    "CrossValidation",
    "FirstCalibration",
    "NewView",
    "PlannedView",
    "Suggestions",
    "Triangulated",
    "UncertaintyCurve",
    "UncertaintyMap",
    "ViewPlan",
    "Worth",
    "WorthOptions",
    "appraise",
    "camera_files",
    "convert_lens",
    "corner_components",
    "cross_validate",
    "difference",
    "distance_uncertainty",
    "draw_board_residuals",
    "draw_cross_validation",
    "draw_difference",
    "draw_planned_views",
    "draw_poorest_views",
    "draw_uncertainty",
    "draw_uncertainty_curve",
    "first_values",
    "nominal_camera",
    "plan_views",
    "projection_uncertainty",
    "read",
    "residual_groups",
    "simulate_corners",
    "suggest_views",
    "triangulate",
    "uncertainty_against_distance",
    "uncertainty_map",
]

_GIVEN = {"Board", "Calibration", "Candidate", "Corners", "WorthOptions"}
_MADE = {name for name in __all__ if name[0].isupper()} - _GIVEN
"""What functions make, and users do not."""

_HOMES = {
    "appraise": "appraisal",
    "Board": "board",
    "Calibrated": "calibration_result",
    "Calibration": "calibration",
    "camera_files": "output.formats",
    "CameraDifference": "calibration_difference",
    "Candidate": "new_views",
    "Conversion": "conversion",
    "convert_lens": "conversion",
    "corner_components": "grouping",
    "Corners": "corners",
    "cross_validate": "appraisal",
    "CrossValidation": "cross_validation",
    "difference": "uncertainty",
    "distance_uncertainty": "triangulation",
    "draw_board_residuals": "residual_drawing",
    "draw_cross_validation": "drawing",
    "draw_difference": "drawing",
    "draw_planned_views": "plan_drawing",
    "draw_poorest_views": "residual_drawing",
    "draw_uncertainty": "drawing",
    "draw_uncertainty_curve": "drawing",
    "first_values": "first_calibration",
    "FirstCalibration": "first_calibration",
    "NewView": "new_views",
    "nominal_camera": "first_calibration",
    "plan_views": "view_plan",
    "PlannedView": "view_plan_result",
    "projection_uncertainty": "uncertainty",
    "read": "reading",
    "residual_groups": "grouping",
    "simulate_corners": "calibration",
    "suggest_views": "suggestions",
    "Suggestions": "new_views",
    "triangulate": "triangulation",
    "Triangulated": "triangulation",
    "uncertainty_against_distance": "uncertainty",
    "uncertainty_map": "uncertainty",
    "UncertaintyCurve": "maps",
    "UncertaintyMap": "maps",
    "ViewPlan": "view_plan_result",
    "Worth": "calibration_result",
    "WorthOptions": "calibration_result",
}
"""The module of each name, loaded when it is first asked for: most blocks are no boards."""

WAYS = {
    "document_of": {"Calibrated": ("document",), "ViewPlan": ("view_plan_report",)},
    "findings_of": ("findings",),
    "page_of": {"Calibrated": ("page",), "ViewPlan": ("view_plan_report",)},
    "report_of": {"Calibrated": ("report",), "ViewPlan": ("view_plan_report",)},
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""


__getattr__, __dir__ = on_demand(__name__, _HOMES, check_arguments, unchecked=_MADE)
