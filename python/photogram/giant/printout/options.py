"""Page 0: what COMMON asks for, a line for each option (GIANT guide, sample printout, page 0)."""

from __future__ import annotations

from photogram.giant.common import Common
from photogram.giant.printout.formats import Space
from photogram.giant.printout.pages import Page
from photogram.network.refraction import Refraction

__all__ = ["options_page"]

UNIT_VARIANCE: dict[str, str] = {
    "free": "UNIT VARIANCE WILL BE BASED ON COMPLETELY FREE CAMERA PARAMETERS",
    "constrained": "UNIT VARIANCE WILL BE BASED ON CONSTRAINED CAMERA PARAMETERS",
    "unity": "UNIT VARIANCE WILL BE SET TO UNITY",
    "redundancy": "UNIT VARIANCE WILL BE BASED ON REDUNDANCY NUMBERS",
}


def options_page(
    common: Common,
    space: Space,
    refraction: Refraction | None,
    unit_variance: str | None = None,
    *,
    as_published: bool = False,
) -> Page:
    """Return the page of the options.

    The sample shows one choice of most options only; `docs/giant-listing.md` says which lines are ours.

    Parameters
    ----------
    common
        What is asked for.
    space
        The object space and its linear unit.
    refraction
        What is applied, which may be more than COMMON asks for.
    unit_variance
        What the unit variance is based on; as COMMON says when None.
    as_published
        Without the linear unit of a rectangular job.
    """
    air = refraction is not None and refraction.air is not None
    water = refraction is not None and refraction.water is not None
    lines = [
        f"OBJECT SPACE REFERENCE SYSTEM IS {'GEOGRAPHIC' if space.geographic else 'RECTANGULAR'}",
        f"ROTATION ANGLES ARE {'PHOTO-TO-GROUND' if common.photo_to_ground else 'GROUND-TO-PHOTO'}",
        f"{'INTERSECTION ONLY' if common.intersection_only else 'COMPLETE TRIANGULATION'}"
        " PROCESS IS REQUESTED",
        f"ERROR PROPAGATION IS {'' if common.error_propagation else 'NOT '}REQUESTED",
    ]
    if common.error_propagation:
        lines.append(UNIT_VARIANCE[unit_variance or common.unit_variance])
    for medium, applied in (("ATMOSPHERIC", air), ("WATER", water)):
        lines.append(f"{medium} REFRACTION WILL {'' if applied else 'NOT '}BE INCLUDED IN THE ADJUSTMENT")
    lines.append(_residuals(common.residual_limit))
    if common.strip:
        lines.append(f"LEADING '{common.strip}' WILL BE ELIMINATED FROM ALL IDENTIFICATIONS")
    if space.geographic or not as_published:
        lines += _lengths(common, space)
    if common.save_points:
        lines.append("TRIANGULATED GROUND COORDINATES WILL BE SAVED")
    if common.save_stations:
        lines.append("ADJUSTED CAMERA STATION PARAMETERS WILL BE SAVED")
    return ["", *(line for option in lines for line in (option, ""))]


def _lengths(common: Common, space: Space) -> list[str]:
    if not space.geographic:
        return [f"LINEAR UNIT OF OBJECT SPACE = {space.linear_unit}"]
    return [
        f"SEMI-{axis} AXIS OF SPHEROID = {length:.3f} {space.linear_unit}"
        for axis, length in (("MAJOR", common.semi_major), ("MINOR", common.semi_minor))
    ]


def _residuals(limit: float) -> str:
    if limit == 0:
        return "ALL IMAGE RESIDUALS WILL BE LISTED"
    if limit < 0:
        return "NO IMAGE RESIDUALS WILL BE LISTED"
    return f"IMAGE RESIDUALS GREATER THAN {limit:.3f} (MM) WILL BE LISTED"
