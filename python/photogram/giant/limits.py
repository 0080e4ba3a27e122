"""The installation parameters N1 to N6 of the 1987 program (GIANT guide, section I.E)."""

from __future__ import annotations

from dataclasses import dataclass, fields

from photogram.errors import InputError

__all__ = ["Limits"]


@dataclass(frozen=True)
class Limits:
    """Limits of a job; None, the default of each, is no limit.

    Parameters
    ----------
    stations
        N1: camera stations.
    points
        N2: different points with images.
    control
        N3: records of GROUND.
    photos_per_point
        N4: photographs on which one point may appear; of the others its images are dropped.
    cameras
        N5: camera systems.
    bandwidth
        N6: effective bandwidth of the normal equations, in sets of three parameters.

    Raises
    ------
    InputError
        A limit that is not a positive whole number.
    """

    stations: int | None = None
    points: int | None = None
    control: int | None = None
    photos_per_point: int | None = None
    cameras: int | None = None
    bandwidth: int | None = None

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if value is not None and (not isinstance(value, int) or value < 1):
                raise InputError(f"the limit of {each.name} must be a positive whole number, not {value!r}")
