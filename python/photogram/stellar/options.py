"""Options of a calibration; the numbers are those of the report's option card."""

from __future__ import annotations

import math

from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, fields
from photogram.show.angles import ARCSEC
from photogram.stellar.sky import Site
from photogram.words import phrase

__all__ = ["Options"]

_DAYS = 20 * math.pi  # A time of ten days, in radians
_STEPS = 10_000  # Rows of the table of a curve at most


def core_threads(threads: int | None) -> int:
    """Return the number of threads for the core; 0 leaves it to the core."""
    if threads is not None and threads < 1:
        raise InputError(phrase("error.at", what="threads", message=phrase("error.positive", value=threads)))
    return threads or 0


@dataclass(frozen=True)
class Options:
    """How to adjust, and what to compute.

    Attributes
    ----------
    common_scale
        One principal distance for both axes (option 1).
    refraction
        Estimate the coefficients of refraction after the camera (option 5).
    minimum_stars
        Numbers of the stars of the minimum solution, which gives the initial values (option 6).
    pre_run
        Stop after the minimum solution with the residuals of all images (option 7).
    curves
        Compute distortion curves (option 8).
    reference, pole
        Station to which attitudes are transformed, and the pole's x (towards the prime meridian) and y
        (towards 90 degrees west) in radians (option 9).
    plate_list
        Write plate coordinates and residuals as the program punched them (option 11).
    max_iterations_minimum, max_iterations
        Limits (options 12 and 13); 0 for none.
    mean_error
        Mean error of unit weight to use instead of the computed one (option 14); 0 for none.
    histogram
        Histogram of residuals.
    tolerance
        Of the level of discrepancies, metres.
    refraction_tolerance, distortion_tolerance
        Of the inner iterations: radians, metres.
    movement_factor
        Attitudes are combined when their directions differ by less than this multiple of its mean error.
    movement_time
        Sidereal time of the fictitious points, radians.
    crossover, interval, extent
        Radius at which the transformed distortion vanishes; step and end of the curves; metres.
    comparator_angle
        From the axes of the plate coordinates to those of the comparator, from x towards y, radians: scales
        and nonperpendicularity are given in the latter, too (equation 42). None where they are the same.
    distortion_first
        Scale after distortion, at this principal distance (metres), as the report prefers for calibration
        (equations 40 and 41); 0 for scale before distortion, as programmed.
    as_published
        Iterate with the report's partials and stop rules.
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
        """What the core calls the kind of a camera: reference distance, Brown's decentering, common scale."""
        return (self.distortion_first or None, False, self.common_scale)
