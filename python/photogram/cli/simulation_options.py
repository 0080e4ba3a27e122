"""The options that describe a simulated network, for every command that simulates one."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum
from functools import wraps
from inspect import Parameter, signature
from typing import Annotated, Any, get_type_hints

import typer

from photogram.cli.refraction import AirModel, WaterModel
from photogram.cli.simulated_motion import MotionOptions
from photogram.lazy_dataclasses import dataclass, fields

__all__ = ["Control", "Ellipsoid", "NetworkOptions", "takes_network"]


class Control(StrEnum):
    """Where the control of a simulated block is."""

    PERIMETER = "perimeter"
    CORNERS = "corners"
    NONE = "none"


class Ellipsoid(StrEnum):
    """The spheroid of a simulated block."""

    NONE = "none"
    CLARKE_1866 = "clarke1866"
    WGS84 = "wgs84"


@dataclass(frozen=True)
class NetworkOptions(MotionOptions):
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
    control: Annotated[Control, typer.Option(help="Where the control points are.")] = Control.PERIMETER
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
        float,
        typer.Option(help="Of observed attitudes, standard deviation, rad; inf: none are observed."),
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
        Ellipsoid, typer.Option(help="Geographic space on this spheroid; none: rectangular.")
    ] = Ellipsoid.NONE
    origin: Annotated[
        tuple[float, float, float],
        typer.Option(
            help="Centre of the block: X Y Z in m, or longitude and latitude in degrees and height in m."
        ),
    ] = (0.0, 0.0, 0.0)
    photo_to_ground: Annotated[
        bool,
        typer.Option("--photo-to-ground", help="Photo-to-ground angles instead of ground-to-photo."),
    ] = False
    air_refraction: Annotated[
        AirModel | None,
        typer.Option(help="What bends the rays in air. Default: nothing.", show_default=False),
    ] = None
    water_refraction: Annotated[
        WaterModel | None,
        typer.Option(help="What bends the rays in water. Default: nothing.", show_default=False),
    ] = None
    water_level: Annotated[float, typer.Option(help="Height of the water, m.")] = 0.0
    water_index: Annotated[float, typer.Option(min=1, help="Refractive index of the water.")] = 1.340
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal blocks.")] = 0

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of :func:`photogram.simulate`."""
        from photogram.network.geometry import Spheroid
        from photogram.network.refraction import Refraction

        arguments: dict[str, Any] = {field.name: getattr(self, field.name) for field in fields(self)}
        arguments["control"] = self.control.value
        spheroids = {Ellipsoid.CLARKE_1866: Spheroid.clarke_1866, Ellipsoid.WGS84: Spheroid.wgs84}
        arguments["spheroid"] = spheroids[self.spheroid]() if self.spheroid in spheroids else None
        if arguments["spheroid"]:
            longitude, latitude, height = self.origin
            arguments["origin"] = (math.radians(longitude), math.radians(latitude), height)
        asked = arguments.pop("air_refraction"), arguments.pop("water_refraction")
        air, water = (None if model in (None, "none") else model.value for model in asked)
        level, index = arguments.pop("water_level"), arguments.pop("water_index")
        for each in fields(MotionOptions):
            del arguments[each.name]
        if moving := self.motion():
            arguments["motion"] = moving
        if air or water:
            arguments["refraction"] = Refraction(air, water, level, index)
        return arguments


def takes_network(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of a network in the place of its parameter `network`.

    typer reads the signature of a command: each field of :class:`NetworkOptions` becomes a parameter, and the
    command gets them as one value.
    """
    hints = get_type_hints(NetworkOptions, include_extras=True)
    # What moves stands below the rest.
    moving = {field.name for field in fields(MotionOptions)}
    options = [
        Parameter(field.name, Parameter.KEYWORD_ONLY, default=field.default, annotation=hints[field.name])
        for field in sorted(fields(NetworkOptions), key=lambda field: field.name in moving)
    ]
    own = [
        parameter.replace(kind=Parameter.KEYWORD_ONLY)
        for parameter in signature(command, eval_str=True).parameters.values()
    ]
    place = [parameter.name for parameter in own].index("network")

    @wraps(command)
    def with_options(**values: Any) -> None:
        network = NetworkOptions(**{option.name: values.pop(option.name) for option in options})
        command(network=network, **values)

    parameters = [*own[:place], *options, *own[place + 1 :]]
    with_options.__dict__["__signature__"] = signature(command).replace(parameters=parameters)
    with_options.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return with_options
