"""Options of a plate calibration, numbered as on the option card of the report."""

from __future__ import annotations

import math

from photogram.arguments.fields import check_fields
from photogram.errors import InputError
from photogram.io.angles import ARCSEC
from photogram.lazy_dataclasses import dataclass, fields
from photogram.stellar.sky import Site
from photogram.words import phrase

__all__ = ["Options"]

_DAYS = 20 * math.pi  # A time of ten days, in radians
_STEPS = 10_000  # Largest number of rows of a curve table


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core; 0: default of the core."""
    if threads is not None and threads < 1:
        raise InputError(phrase("error.at", what="threads", message=phrase("error.positive", value=threads)))
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
    max_iterations_minimum: int = 0
    max_iterations: int = 0
    mean_error: float = 0.0
    histogram: bool = False
    tolerance: float = 1e-10
    refraction_tolerance: float = 1e-4 * ARCSEC
    distortion_tolerance: float = 1e-10
    movement_factor: float = 0.0
    movement_time: float = 0.0
    crossover: float = 0.0
    interval: float = 0.005
    extent: float = 0.1
    comparator_angle: float | None = None
    distortion_first: float = 0.0
    as_published: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if self.pre_run and not self.minimum_stars:
            raise InputError(phrase("error.requires", name="pre_run", other="minimum_stars"))
        largest = {"movement_time": _DAYS}
        positive = ("refraction_tolerance", "interval")
        signed = ("movement_factor", "movement_time", "comparator_angle", "distortion_first")
        for field in fields(self):
            name, value = field.name, getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                continue
            code = ""
            if not math.isfinite(value):
                code = "error.finite"
            elif not abs(value) <= largest.get(name, math.inf):
                code = "error.range"
            elif name in positive and not value > 0:
                code = "error.positive"
            elif name not in signed and value < 0:
                code = "error.not-negative"
            if code:
                limits = {"low": -_DAYS, "high": _DAYS, "value": value}
                raise InputError(phrase("error.at", what=name, message=phrase(code, **limits)))
        if self.curves and self.extent > _STEPS * self.interval:
            raise InputError(
                phrase("stars.curve-steps", extent=self.extent, interval=self.interval, most=_STEPS)
            )

    @property
    def camera_kind(self) -> tuple[float | None, bool, bool]:
        """Camera type of the core: reference distance, Brown's decentring, common scale."""
        return (self.distortion_first or None, False, self.common_scale)
