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

    strips: Annotated[int, typer.Option(help="Number of strips.")] = 4
    photos_per_strip: Annotated[int, typer.Option(help="Photographs in a strip.")] = 10
    forward_overlap: Annotated[
        float, typer.Option(help="Of neighbouring photographs, as part of the frame.")
    ] = 0.6
    side_overlap: Annotated[float, typer.Option(help="Of neighbouring strips, as part of the frame.")] = 0.3
    principal_distance: Annotated[
        float, typer.Option(help="mm; negative for the positive plane, positive for the negative plane.")
    ] = -152.74
    frame_size: Annotated[float, typer.Option(help="Side of the frame, mm.")] = 230.0
    flying_height: Annotated[float, typer.Option(help="Above the mean terrain, m.")] = 4500.0
    relief: Annotated[
        float, typer.Option(help="Largest height of the terrain above or below its mean, m.")
    ] = 150.0
    points_per_photo: Annotated[float, typer.Option(help="Mean number of image points on a photograph.")] = (
        100.0
    )
    crab: Annotated[float, typer.Option(help="Largest deviation of kappa from the heading, rad.")] = 0.03
    tilt: Annotated[float, typer.Option(help="Largest omega and phi, rad.")] = 0.01
    control: Annotated[Control, typer.Option(help="Where the control points are.")] = "perimeter"
    control_spacing: Annotated[int, typer.Option(help="Distance of perimeter control, in bases.")] = 4
    control_sd: Annotated[float, typer.Option(help="Standard deviation of control, m.")] = 0.05
    image_sd: Annotated[float, typer.Option(help="Standard deviation of image coordinates, mm.")] = 0.010
    position_sd: Annotated[
        float,
        typer.Option(
            help="Of observed positions of photographs (GNSS), standard deviation, m; inf: none are observed."
        ),
    ] = math.inf
    attitude_sd: Annotated[
        float, typer.Option(help="Of observed attitudes, standard deviation, rad; inf: none are observed.")
    ] = math.inf
    position_error: Annotated[
        float,
        typer.Option(
            help="Of the initial positions, standard deviation, m; of trajectories of a scanner it is their"
            " weight."
        ),
    ] = 30.0
    attitude_error: Annotated[float, typer.Option(help="The same of the initial attitudes, rad.")] = 0.01
    spheroid: Annotated[
        Literal["none", "clarke1866", "wgs84"],
        typer.Option(help="Geographic space on this spheroid; none: rectangular."),
    ] = "none"
    origin: Annotated[
        tuple[float, float, float],
        typer.Option(
            help="Centre of the block: X Y Z in m, or longitude and latitude in degrees and height in m."
        ),
    ] = (0.0, 0.0, 0.0)
    photo_to_ground: Annotated[
        bool, typer.Option("--photo-to-ground", help="Photo-to-ground angles instead of ground-to-photo.")
    ] = False
    air_refraction: Annotated[
        AirModel | None, typer.Option(help="What bends the rays in air. Default: nothing.")
    ] = None
    water_refraction: Annotated[
        WaterModel | None, typer.Option(help="What bends the rays in water. Default: nothing.")
    ] = None
    water_level: Annotated[float, typer.Option(help="Height of the water, m.")] = 0.0
    water_index: Annotated[float, typer.Option(min=1, help="Refractive index of the water.")] = 1.340
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal blocks.")] = 0

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

    readout: Annotated[
        float | None,
        typer.Option(
            help="A rolling shutter: seconds from its first row to its last. Default: all stand still."
        ),
    ] = None
    readout_sd: Annotated[
        float | None,
        typer.Option(help="How well the readout time is known, s; 0: it is known. Default: not at all."),
    ] = None
    readout_direction: Annotated[
        Literal["down", "up", "right", "left"] | None,
        typer.Option(
            help="Where to: right and left along the strips, down and up across them. Default: down."
        ),
    ] = None
    speed: Annotated[
        float | None, typer.Option(help="Of the flight, m/s. Default: 9 with --readout, 70 with --scanner.")
    ] = None
    speed_sd: Annotated[
        float | None,
        typer.Option(
            help="Of observed velocities of photographs, m/s; inf: none are observed. Default: 0.05."
        ),
    ] = None
    rate: Annotated[
        float | None, typer.Option(help="Of turns of photographs, standard deviation, rad/s. Default: 0.1.")
    ] = None
    rate_sd: Annotated[
        float | None,
        typer.Option(help="Of observed rates of photographs, rad/s; inf: none are observed. Default: 0.02."),
    ] = None
    scanner: Annotated[
        int | None,
        typer.Option(
            help="A line scanner in the place of frames, with 1, 2 or 3 lines of sensors.", min=1, max=3
        ),
    ] = None
    view_angle: Annotated[
        float | None, typer.Option(help="How far its lines look ahead and back, rad. Default: 0.35.")
    ] = None
    pitch: Annotated[float | None, typer.Option(help="From sample to sample, mm. Default: 0.01.")] = None
    every: Annotated[
        float | None,
        typer.Option(
            help="From record to record of trajectories, and of GNSS and inertial unit with --position-sd and"
            " --attitude-sd, s. Default: 1."
        ),
    ] = None
    knots: Annotated[
        float | None, typer.Option(help="From knot to knot of the errors of trajectories, s. Default: 4.")
    ] = None
    scenes: Annotated[
        bool, typer.Option("--scenes", help="Scenes as long as frames instead of whole strips.")
    ] = False

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
