"""Input of a job: options, frames, control, warnings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from photogram.giant.common import Common
from photogram.giant.contents import IMAGE_SD, GroundPoint, ImageFrame
from photogram.giant.limits import ErrorWarning
from photogram.giant.printout.forms import (
    Page,
    Space,
    Values,
    attitude,
    attitude_name,
    dms,
    fixed,
    headed,
    paginate,
)
from photogram.network.refraction import Refraction

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
    """Return the page of the options; the default unit variance is as in COMMON.

    The sample shows one choice of most options; `docs/giant-listing.md` lists our lines. As published, the
    linear unit of a rectangular job is omitted. `refraction` may exceed the request of COMMON.
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
    if space.geographic:
        for axis, length in (("MAJOR", common.semi_major), ("MINOR", common.semi_minor)):
            lines.append(f"SEMI-{axis} AXIS OF SPHEROID = {length:.3f} {space.linear_unit}")
    elif not as_published:
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


def control_pages(
    space: Space, ground: Iterable[GroundPoint], default_sd: tuple[float, float, float]
) -> list[Page]:
    """Return the pages of the control, ten points each.

    Unheld components are listed unchanged; `default_sd` replaces standard deviations of zero.
    """
    entries = []
    for point in ground:
        deviations = [sd or default for sd, default in zip(point.sd, default_sd, strict=True)]
        rows = zip(space.names, space.values(point.position, 4), space.values(deviations, 4), strict=True)
        first, second, third = (f"{axis} = {value}     ST. D. = {sd}" for axis, value, sd in rows)
        middle = f"{point.name:<10}{second}     TYPE = {point.type_code}"
        entries.append([f"{'':10}{first}", middle, f"{'':10}{third}", "", ""])
    return paginate(headed("GROUND CONTROL DATA"), entries)


ACROSS = 4  # Plate coordinates, or names of points, per line


def frame_pages(
    space: Space,
    photo_to_ground: bool,
    pose: Sequence[Values],
    principal_distance: float,
    images: ImageFrame,
    *,
    parameters: bool = True,
    plates: bool = True,
) -> list[Page]:
    """Return the requested pages of a frame: station, plate coordinates.

    The pose is position and attitude in block units, then their standard deviations.
    """
    x_sd, y_sd = (sd or IMAGE_SD for sd in images.sd)
    frame = ["", f"FRAME  {images.name}", ""]
    heading = [
        *frame,
        f"PRINCIPAL DISTANCE ={fixed(principal_distance, 12, 4)}"
        f"     ST. D. OF X ={fixed(x_sd, 10, 4)}     ST. D. OF Y ={fixed(y_sd, 10, 4)}",
        "",
    ]
    if parameters:
        heading += _parameters(space, photo_to_ground, pose)
    columns = headed("PLATE COORDINATES", f"{'ID':<8}{'X':>10}{'Y':>11}    " * ACROSS)[1:] if plates else []
    return paginate([*heading, *columns], _plates(images) if plates else [], again=[*frame, *columns])


def _parameters(space: Space, photo_to_ground: bool, pose: Sequence[Values]) -> Page:
    position, angles, position_sd, angles_sd = pose
    sense = attitude_name(photo_to_ground)
    lines = headed(
        "CAMERA STATION PARAMETERS", f"{'P O S I T I O N':^49}{f'A T T I T U D E  ({sense})':^49}".rstrip()
    )[1:]
    rows = zip(
        space.names,
        space.values(position, 4),
        space.values(position_sd, 4),
        ("OMEGA", "PHI", "KAPPA"),
        attitude(angles),
        (dms(each) for each in angles_sd),
        strict=True,
    )
    for name, value, sd, angle, turn, turn_sd in rows:
        lines.append(f"{name} = {value}   ST. D. = {sd}     {angle:<5} = {turn}   ST. D. = {turn_sd}")
    return [*lines, ""]


def _plates(images: ImageFrame) -> list[Sequence[str]]:
    cells = [
        f"{name:<8}{fixed(x, 10, 4)}{fixed(y, 11, 4)}    "
        for name, (x, y) in zip(images.points, images.xy.tolist(), strict=True)
    ]
    return [["".join(cells[row : row + ACROSS])] for row in range(0, len(cells), ACROSS)]


def warning_pages(warnings: Iterable[ErrorWarning]) -> list[Page]:
    """Return the pages of the warnings; empty without warnings."""
    entries: list[list[str]] = []
    for warning in warnings:
        # The first page of a warning contains its heading and the first names.
        heading = [*(["ERROR WARNINGS", ""] if warning.general else []), warning.heading, ""]
        for row in range(0, len(warning.names), ACROSS):
            names = "".join(f"{name:<20}" for name in warning.names[row : row + ACROSS])
            entries.append([names] if row else [*heading, names])
        entries.append(["", ""])
    return paginate([""], entries) if entries else []
