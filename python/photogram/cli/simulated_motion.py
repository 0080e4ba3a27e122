"""The options that say how the cameras of a simulated network move, for every command that simulates one."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.lazy_dataclasses import dataclass, fields

if TYPE_CHECKING:
    from photogram.network.simulated_motion import LineScanner, RollingShutter

__all__ = ["MotionOptions"]


class Reading(StrEnum):
    """In which rows or columns a shutter is read."""

    DOWN = "down"
    UP = "up"
    RIGHT = "right"
    LEFT = "left"


_option = partial(typer.Option, show_default=False)


@dataclass(frozen=True)
class MotionOptions:
    """What moves: names and defaults are those of :class:`RollingShutter` and :class:`LineScanner`."""

    readout: Annotated[
        float | None,
        _option(help="A rolling shutter: seconds from its first row to its last. Default: all stand still."),
    ] = None
    readout_sd: Annotated[
        float | None,
        _option(help="How well the readout time is known, s; 0: it is known. Default: not at all."),
    ] = None
    readout_direction: Annotated[
        Reading | None,
        _option(help="Where to: right and left along the strips, down and up across them. Default: down."),
    ] = None
    speed: Annotated[
        float | None, _option(help="Of the flight, m/s. Default: 9 with --readout, 70 with --scanner.")
    ] = None
    speed_sd: Annotated[
        float | None,
        _option(help="Of observed velocities of photographs, m/s; inf: none are observed. Default: 0.05."),
    ] = None
    rate: Annotated[
        float | None, _option(help="Of turns of photographs, standard deviation, rad/s. Default: 0.1.")
    ] = None
    rate_sd: Annotated[
        float | None,
        _option(help="Of observed rates of photographs, rad/s; inf: none are observed. Default: 0.02."),
    ] = None
    scanner: Annotated[
        int | None,
        _option(help="A line scanner in the place of frames, with 1, 2 or 3 lines of sensors.", min=1, max=3),
    ] = None
    view_angle: Annotated[
        float | None, _option(help="How far its lines look ahead and back, rad. Default: 0.35.")
    ] = None
    pitch: Annotated[float | None, _option(help="From sample to sample, mm. Default: 0.01.")] = None
    every: Annotated[
        float | None,
        _option(
            help="From record to record of trajectories, and of GNSS and inertial unit with --position-sd and"
            " --attitude-sd, s. Default: 1."
        ),
    ] = None
    knots: Annotated[
        float | None, _option(help="From knot to knot of the errors of trajectories, s. Default: 4.")
    ] = None
    scenes: Annotated[
        bool,
        typer.Option("--scenes", help="Scenes as long as frames instead of whole strips."),
    ] = False

    def motion(self) -> RollingShutter | LineScanner | None:
        """Return what these options say of motion; None: nothing."""
        given = {each.name: getattr(self, each.name) for each in fields(MotionOptions)}
        given = {name: value for name, value in given.items() if value is not None and value is not False}
        if not given:
            return None
        if ("readout" in given) == ("scanner" in given):
            raise typer.BadParameter(
                "motion is that of a shutter, --readout, or of a scanner, --scanner", param_hint=_hint(given)
            )
        from photogram.network.simulated_motion import LineScanner, RollingShutter
        from photogram.network.trajectories import Spline

        rolling = "readout" in given
        strange = given.keys() & (_OF_SCANNERS if rolling else _OF_SHUTTERS)
        if strange:
            raise typer.BadParameter(
                f"says nothing of a {'shutter' if rolling else 'scanner'}", param_hint=_hint(strange)
            )
        if rolling:
            direction = given.pop("readout_direction", Reading.DOWN).value
            return RollingShutter(direction=direction, **given)
        if "knots" in given:
            given["position"] = given["rotation"] = Spline(every=given.pop("knots"))
        return LineScanner(lines=given.pop("scanner"), **given)


_OF_SHUTTERS = {"readout_sd", "readout_direction", "speed_sd", "rate", "rate_sd"}
_OF_SCANNERS = {"view_angle", "pitch", "every", "knots", "scenes"}


def _hint(names: set[str] | dict[str, Any]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in sorted(names))
