"""The options that describe a simulated network, and how its cameras move, for commands that simulate one."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from photogram.cli.options import AirModel, WaterModel
from photogram.lazy_dataclasses import dataclass, fields

if TYPE_CHECKING:
    from photogram.network.simulated_motion import LineScanner, RollingShutter

Control = Literal["perimeter", "corners", "none"]
"""Where the control of a simulated block is."""


@dataclass(frozen=True)
class NetworkOptions:
    """The network of a simulated block: names and defaults are those of :func:`photogram.simulate`."""

    strips: int = 4
    photos_per_strip: int = 10
    forward_overlap: float = 0.6
    side_overlap: float = 0.3
    principal_distance: float = -152.74
    frame_size: float = 230.0
    flying_height: float = 4500.0
    relief: float = 150.0
    points_per_photo: float = 100.0
    crab: float = 0.03
    tilt: float = 0.01
    control: Control = "perimeter"
    control_spacing: int = 4
    control_sd: float = 0.05
    image_sd: float = 0.010
    position_sd: float = math.inf
    attitude_sd: float = math.inf
    position_error: float = 30.0
    attitude_error: float = 0.01
    spheroid: Literal["none", "clarke1866", "wgs84"] = "none"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    photo_to_ground: bool = False
    air_refraction: AirModel | None = None
    water_refraction: WaterModel | None = None
    water_level: float = 0.0
    water_index: Annotated[float, typer.Option(min=1)] = 1.340
    seed: Annotated[int, typer.Option(min=0)] = 0

    def arguments(self, moves: MotionOptions) -> dict[str, Any]:
        """Return the arguments of :func:`photogram.simulate`, of a network that moves so."""
        from photogram.network.geometry import Spheroid
        from photogram.network.refraction import Refraction

        arguments: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        spheroids = {"clarke1866": Spheroid.clarke_1866, "wgs84": Spheroid.wgs84}
        arguments["spheroid"] = spheroids[self.spheroid]() if self.spheroid in spheroids else None
        if arguments["spheroid"]:
            longitude, latitude, height = self.origin
            arguments["origin"] = (math.radians(longitude), math.radians(latitude), height)
        asked = arguments.pop("air_refraction"), arguments.pop("water_refraction")
        air, water = (None if model == "none" else model for model in asked)
        level, index = arguments.pop("water_level"), arguments.pop("water_index")
        if moving := moves.motion():
            arguments["motion"] = moving
        if air or water:
            arguments["refraction"] = Refraction(air, water, level, index)
        return arguments


@dataclass(frozen=True)
class MotionOptions:
    """What moves: names and defaults are those of :class:`RollingShutter` and :class:`LineScanner`."""

    readout: float | None = None
    readout_sd: float | None = None
    readout_direction: Literal["down", "up", "right", "left"] | None = None
    speed: float | None = None
    speed_sd: float | None = None
    rate: float | None = None
    rate_sd: float | None = None
    scanner: Annotated[int | None, typer.Option(min=1, max=3)] = None
    view_angle: float | None = None
    pitch: float | None = None
    every: float | None = None
    knots: float | None = None
    scenes: bool = False

    def motion(self) -> RollingShutter | LineScanner | None:
        """Return what these options say of motion; None: nothing."""
        given = {each.name: getattr(self, each.name) for each in fields(self)}
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
            direction = given.pop("readout_direction", "down")
            return RollingShutter(direction=direction, **given)
        if "knots" in given:
            given["position"] = given["rotation"] = Spline(every=given.pop("knots"))
        return LineScanner(lines=given.pop("scanner"), **given)


_OF_SHUTTERS = {"readout_sd", "readout_direction", "speed_sd", "rate", "rate_sd"}
_OF_SCANNERS = {"view_angle", "pitch", "every", "knots", "scenes"}


def _hint(names: set[str] | dict[str, Any]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in sorted(names))
