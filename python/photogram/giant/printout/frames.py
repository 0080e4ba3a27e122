"""Camera stations and plate coordinates as they were given, a page for each frame (sample, page 1)."""

from __future__ import annotations

from collections.abc import Sequence

from photogram.giant.images import IMAGE_SD, ImageFrame
from photogram.giant.printout.formats import Space, Values, attitude, attitude_name, dms, fixed
from photogram.giant.printout.pages import Page, headed, paginate
from photogram.lazy_dataclasses import dataclass

__all__ = ["Station", "frame_pages"]

ACROSS = 4
"""Plate coordinates on a line."""


@dataclass(frozen=True)
class Station:
    """A camera station as it was given, with the standard deviations in force.

    Attributes
    ----------
    position, attitude, position_sd, attitude_sd
        Three values each, in the units of the block.
    principal_distance
        Millimetres, signed.
    """

    position: Values
    attitude: Values
    position_sd: Values
    attitude_sd: Values
    principal_distance: float


def frame_pages(
    space: Space,
    photo_to_ground: bool,
    station: Station,
    images: ImageFrame,
    *,
    parameters: bool = True,
    plates: bool = True,
) -> list[Page]:
    """Return the pages of a frame.

    Parameters
    ----------
    space, photo_to_ground
        How positions and angles are written.
    station, images
        What is listed.
    parameters, plates
        Whether the station (COMMON column 3) and the plate coordinates (column 4) are.
    """
    x_sd, y_sd = (sd or IMAGE_SD for sd in images.sd)
    frame = ["", f"FRAME  {images.name}", ""]
    heading = [
        *frame,
        f"PRINCIPAL DISTANCE ={fixed(station.principal_distance, 12, 4)}"
        f"     ST. D. OF X ={fixed(x_sd, 10, 4)}     ST. D. OF Y ={fixed(y_sd, 10, 4)}",
        "",
    ]
    if parameters:
        heading += _parameters(space, photo_to_ground, station)
    columns = _columns() if plates else []
    return paginate([*heading, *columns], _plates(images) if plates else [], again=[*frame, *columns])


def _parameters(space: Space, photo_to_ground: bool, station: Station) -> Page:
    sense = attitude_name(photo_to_ground)
    lines = headed(
        "CAMERA STATION PARAMETERS", f"{'P O S I T I O N':^49}{f'A T T I T U D E  ({sense})':^49}".rstrip()
    )[1:]
    rows = zip(
        space.names,
        space.values(station.position, 4),
        space.values(station.position_sd, 4),
        ("OMEGA", "PHI", "KAPPA"),
        attitude(station.attitude),
        (dms(each) for each in station.attitude_sd),
        strict=True,
    )
    for name, value, sd, angle, turn, turn_sd in rows:
        lines.append(f"{name} = {value}   ST. D. = {sd}     {angle:<5} = {turn}   ST. D. = {turn_sd}")
    return [*lines, ""]


def _columns() -> Page:
    return headed("PLATE COORDINATES", f"{'ID':<8}{'X':>10}{'Y':>11}    " * ACROSS)[1:]


def _plates(images: ImageFrame) -> list[Sequence[str]]:
    cells = [
        f"{name:<8}{fixed(x, 10, 4)}{fixed(y, 11, 4)}    "
        for name, (x, y) in zip(images.points, images.xy.tolist(), strict=True)
    ]
    return [["".join(cells[row : row + ACROSS])] for row in range(0, len(cells), ACROSS)]
