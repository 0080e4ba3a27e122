"""Options of a plate calibration, numbered as on the option card of the report."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from photogram.arguments.arrays import number
from photogram.arguments.fields import check_fields, option
from photogram.arguments.objects import require
from photogram.errors import InputError
from photogram.io.angles import ARCSEC
from photogram.lazy_dataclasses import dataclass, field
from photogram.stellar.sky import Site
from photogram.words import phrase

_DAYS = 20 * math.pi  # A time of ten days, in radians
_STEPS = 10_000  # Largest number of rows of a curve table


def _number(default: float | None, rule: str = "not-negative") -> Any:
    """Return a field of finite numbers with a rule."""
    return field(default=default, metadata={"check": partial(number, rule=rule)})


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core; 0: default of the core."""
    require(threads is None or threads >= 1, "threads", "positive", value=threads)
    return threads or 0


@dataclass(frozen=True)
class Options:
    """Options of a plate calibration and its computations.

    Attributes
    ----------
    common_scale
        Use one principal distance for both axes (option 1).
    refraction
        Estimate the coefficients of refraction after the camera (option 5).
    minimum_stars
        Numbers of the stars of the minimum solution, which computes the initial values (option 6).
    pre_run
        Stop after the minimum solution, with the residuals of all images (option 7).
    curves
        Compute distortion curves (option 8).
    reference, pole
        Station to which attitudes are transformed (option 9). `pole` contains x (towards the prime meridian)
        and y (towards 90 degrees west) of the pole in radians.
    plate_list
        Write plate coordinates and residuals in the punched format of the program (option 11).
    max_iterations_minimum, max_iterations
        Iteration limits (options 12 and 13); 0: unlimited.
    mean_error
        Prior mean error of unit weight that replaces the computed one (option 14); 0: use the computed one.
    histogram
        Compute a histogram of residuals.
    tolerance
        Tolerance of the level of discrepancies, metres.
    refraction_tolerance, distortion_tolerance
        Tolerances of the inner iterations: radians, metres.
    movement_factor
        Attitudes are combined if their directions differ by less than this multiple of the mean error.
    movement_time
        Sidereal time of the fictitious points, radians.
    crossover, interval, extent
        Radius of zero transformed distortion; step and end of the curves; metres.
    comparator_angle
        Angle from the axes of the plate coordinates to the comparator axes, from x towards y, radians. Scales
        and nonperpendicularity are also given in comparator axes (equation 42). None for equal axes.
    distortion_first
        Principal distance (metres) of the form with scale after distortion, which the report prefers for
        calibration (equations 40 and 41). 0 is scale before distortion, as programmed.
    as_published
        Iterate with the partials and stop rules of the report.
    """

    common_scale: bool = False
    refraction: bool = False
    minimum_stars: tuple[str, ...] = ()
    pre_run: bool = False
    curves: bool = False
    reference: Site | None = None
    pole: tuple[float, float] = (0.0, 0.0)
    plate_list: bool = False
    max_iterations_minimum: int = option(0, 0)
    max_iterations: int = option(0, 0)
    mean_error: float = _number(0.0)
    histogram: bool = False
    tolerance: float = _number(1e-10)
    refraction_tolerance: float = _number(1e-4 * ARCSEC, "positive")
    distortion_tolerance: float = _number(1e-10)
    movement_factor: float = _number(0.0, "finite")
    movement_time: float = option(0.0, -_DAYS, _DAYS)
    crossover: float = _number(0.0)
    interval: float = _number(0.005, "positive")
    extent: float = _number(0.1)
    comparator_angle: float | None = _number(None, "finite")
    distortion_first: float = _number(0.0, "finite")
    as_published: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if self.pre_run and not self.minimum_stars:
            raise InputError(phrase("error.requires", name="pre_run", other="minimum_stars"))
        if self.curves and self.extent > _STEPS * self.interval:
            raise InputError(
                phrase("stars.curve-steps", extent=self.extent, interval=self.interval, most=_STEPS)
            )

    @property
    def camera_kind(self) -> tuple[float | None, bool, bool]:
        """Camera type of the core: reference distance, Brown's decentring, common scale."""
        return (self.distortion_first or None, False, self.common_scale)
