"""Ground control as it was given (sample, page 21)."""

from __future__ import annotations

from collections.abc import Iterable

from photogram.giant.ground import GroundPoint
from photogram.giant.printout.formats import Space
from photogram.giant.printout.pages import Page, headed, paginate

__all__ = ["control_pages"]


def control_pages(
    space: Space, ground: Iterable[GroundPoint], default_sd: tuple[float, float, float]
) -> list[Page]:
    """Return the pages of the control: ten points each, whether they are photographed or not.

    Parameters
    ----------
    space
        How positions are written.
    ground
        The points; components that are not held are listed as they stand.
    default_sd
        What stands for a standard deviation of zero.
    """
    return paginate(headed("GROUND CONTROL DATA"), (_entry(space, point, default_sd) for point in ground))


def _entry(space: Space, point: GroundPoint, default_sd: tuple[float, float, float]) -> list[str]:
    sd = [given or default for given, default in zip(point.sd, default_sd, strict=True)]
    first, second, third = (
        f"{name} = {value}     ST. D. = {deviation}"
        for name, value, deviation in zip(
            space.names, space.values(point.position, 4), space.values(sd, 4), strict=True
        )
    )
    return [
        f"{'':10}{first}",
        f"{point.name:<10}{second}     TYPE = {point.type_code}",
        f"{'':10}{third}",
        "",
        "",
    ]
