"""What an adjustment gives, as arrays, tables, text and JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.results.calibration import Calibration, calibrations
    from photogram.results.calibration_picture import draw_distortion, draw_lens_field
    from photogram.results.components_picture import draw_components
    from photogram.results.covariance import Covariances, Propagated
    from photogram.results.distortion import DistortionCurve, LensField, distortion_curve, lens_field
    from photogram.results.pattern_pictures import DrawnPattern, drawn_patterns
    from photogram.results.variance_function import draw_variance_function

__all__ = [
    "Calibration",
    "Covariances",
    "DistortionCurve",
    "DrawnPattern",
    "LensField",
    "Propagated",
    "calibrations",
    "distortion_curve",
    "draw_components",
    "draw_distortion",
    "draw_lens_field",
    "draw_variance_function",
    "drawn_patterns",
    "lens_field",
]

_HOMES = {
    "Calibration": "calibration",
    "calibrations": "calibration",
    "Covariances": "covariance",
    "distortion_curve": "distortion",
    "DistortionCurve": "distortion",
    "draw_components": "components_picture",
    "draw_distortion": "calibration_picture",
    "draw_lens_field": "calibration_picture",
    "draw_variance_function": "variance_function",
    "drawn_patterns": "pattern_pictures",
    "DrawnPattern": "pattern_pictures",
    "lens_field": "distortion",
    "LensField": "distortion",
    "Propagated": "covariance",
}
"""The module of each name, loaded when it is first asked for."""

WAYS = {
    "axes_of": ("components_picture",),
    "columns_of": ("tables",),
    "document_of": ("document",),
    "files_of": ("block_files",),
    "findings_of": ("findings", "snooping_result"),
    "page_of": {
        "Result": ("page.block",),
        "Snooped": ("page.cleaning",),
        "VarianceComponents": ("page.cleaning",),
    },
    "pictured": ("picture_data",),
    "report_of": ("report",),
    "statement_of": ("statement.statement",),
    "terms_of": ("tables",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__ = on_demand(__name__, _HOMES)
