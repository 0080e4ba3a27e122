"""Page 0: what COMMON asks for, a line for each option (GIANT guide, sample printout, page 0)."""

from __future__ import annotations

from photogram.giant.common import Common, UnitVariance
from photogram.giant.listing.formats import Space
from photogram.giant.listing.pages import Page

__all__ = ["options_page"]

UNIT_VARIANCE: dict[UnitVariance, str] = {
    "free": "UNIT VARIANCE WILL BE BASED ON COMPLETELY FREE CAMERA PARAMETERS",
    "constrained": "UNIT VARIANCE WILL BE BASED ON CONSTRAINED CAMERA PARAMETERS",
    "unity": "UNIT VARIANCE WILL BE SET TO UNITY",
}


def options_page(common: Common, space: Space) -> Page:
    """Return the page of the options.

    The sample shows one choice of most options only; `docs/giant-listing.md` says which lines are ours.
    """
    lines = [
        f"OBJECT SPACE REFERENCE SYSTEM IS {'GEOGRAPHIC' if space.geographic else 'RECTANGULAR'}",
        f"ROTATION ANGLES ARE {'PHOTO-TO-GROUND' if common.photo_to_ground else 'GROUND-TO-PHOTO'}",
        f"{'INTERSECTION ONLY' if common.intersection_only else 'COMPLETE TRIANGULATION'}"
        " PROCESS IS REQUESTED",
        f"ERROR PROPAGATION IS {'' if common.error_propagation else 'NOT '}REQUESTED",
    ]
    if common.error_propagation:
        lines.append(UNIT_VARIANCE[common.unit_variance])
    for medium, applied in (("ATMOSPHERIC", common.air_refraction), ("WATER", common.water_refraction)):
        lines.append(f"{medium} REFRACTION WILL {'' if applied else 'NOT '}BE INCLUDED IN THE ADJUSTMENT")
    lines.append(_residuals(common.residual_limit))
    if common.strip:
        lines.append(f"LEADING '{common.strip}' WILL BE ELIMINATED FROM ALL IDENTIFICATIONS")
    if space.geographic:
        for axis, length in (("MAJOR", common.semi_major), ("MINOR", common.semi_minor)):
            lines.append(f"SEMI-{axis} AXIS OF SPHEROID = {length:.3f} {space.linear_unit}")
    else:
        lines.append(f"LINEAR UNIT OF OBJECT SPACE = {space.linear_unit}")
    if common.save_points:
        lines.append("TRIANGULATED GROUND COORDINATES WILL BE SAVED")
    if common.save_stations:
        lines.append("ADJUSTED CAMERA STATION PARAMETERS WILL BE SAVED")
    return ["", *(line for option in lines for line in (option, ""))]


def _residuals(limit: float) -> str:
    if limit == 0:
        return "ALL IMAGE RESIDUALS WILL BE LISTED"
    if limit < 0:
        return "NO IMAGE RESIDUALS WILL BE LISTED"
    return f"IMAGE RESIDUALS GREATER THAN {limit:.3f} (MM) WILL BE LISTED"
