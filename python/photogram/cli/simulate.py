"""`photogram simulate`: write a simulated block as a GIANT project."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from photogram.cli.console import errors, failures, output
from photogram.cli.refraction import AirModel, WaterModel

if TYPE_CHECKING:
    from photogram.simulation import Simulation

__all__ = ["simulate"]


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


def simulate(
    out: Annotated[
        Path, typer.Argument(metavar="OUT", help="Directory for the project; it is made if need be.")
    ],
    strips: Annotated[int, typer.Option(help="Number of strips.")] = 4,
    photos_per_strip: Annotated[int, typer.Option(help="Photographs in a strip.")] = 10,
    forward_overlap: Annotated[
        float, typer.Option(help="Of neighbouring photographs, as part of the frame.")
    ] = 0.6,
    side_overlap: Annotated[float, typer.Option(help="Of neighbouring strips, as part of the frame.")] = 0.3,
    principal_distance: Annotated[
        float, typer.Option(help="mm; negative for the positive plane, positive for the negative plane.")
    ] = -152.74,
    frame_size: Annotated[float, typer.Option(help="Side of the frame, mm.")] = 230.0,
    flying_height: Annotated[float, typer.Option(help="Above the mean terrain, m.")] = 4500.0,
    relief: Annotated[
        float, typer.Option(help="Largest height of the terrain above or below its mean, m.")
    ] = 150.0,
    points_per_photo: Annotated[
        float, typer.Option(help="Mean number of image points on a photograph.")
    ] = 100.0,
    crab: Annotated[float, typer.Option(help="Largest deviation of kappa from the heading, rad.")] = 0.03,
    tilt: Annotated[float, typer.Option(help="Largest omega and phi, rad.")] = 0.01,
    control: Annotated[Control, typer.Option(help="Where the control points are.")] = Control.PERIMETER,
    control_spacing: Annotated[int, typer.Option(help="Distance of perimeter control, in bases.")] = 4,
    control_sd: Annotated[float, typer.Option(help="Standard deviation of control, m.")] = 0.05,
    check_points: Annotated[int, typer.Option(help="Points with known positions that are not held.")] = 20,
    image_sd: Annotated[float, typer.Option(help="Standard deviation of image coordinates, mm.")] = 0.010,
    position_error: Annotated[
        float, typer.Option(help="Of the initial positions, standard deviation, m.")
    ] = 30.0,
    attitude_error: Annotated[
        float, typer.Option(help="Of the initial attitudes, standard deviation, rad.")
    ] = 0.01,
    position_sd: Annotated[
        float, typer.Option(help="That the files state for the initial positions, m; inf: the weak default.")
    ] = math.inf,
    attitude_sd: Annotated[
        float,
        typer.Option(help="That the files state for the initial attitudes, rad; inf: the weak default."),
    ] = math.inf,
    blunders: Annotated[int, typer.Option(help="Image points with a gross error.")] = 0,
    blunder_size: Annotated[float, typer.Option(help="Size of the gross errors, mm.")] = 0.2,
    spheroid: Annotated[
        Ellipsoid, typer.Option(help="Geographic space on this spheroid; none: rectangular.")
    ] = Ellipsoid.NONE,
    origin: Annotated[
        tuple[float, float, float],
        typer.Option(
            help="Centre of the block: X Y Z in m, or longitude and latitude in degrees and height in m."
        ),
    ] = (0.0, 0.0, 0.0),
    photo_to_ground: Annotated[
        bool,
        typer.Option("--photo-to-ground", help="Write photo-to-ground angles instead of ground-to-photo."),
    ] = False,
    air_refraction: Annotated[
        AirModel | None,
        typer.Option(help="What bends the rays in air. Default: nothing.", show_default=False),
    ] = None,
    water_refraction: Annotated[
        WaterModel | None,
        typer.Option(help="What bends the rays in water. Default: nothing.", show_default=False),
    ] = None,
    water_level: Annotated[float, typer.Option(help="Height of the water, m.")] = 0.0,
    water_index: Annotated[float, typer.Option(min=1, help="Refractive index of the water.")] = 1.340,
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal blocks.")] = 0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a project that is there already.")
    ] = False,
) -> None:
    """Write a simulated block as a GIANT project, and the truth behind it as truth.json.

    The GIANT files hold what would have been measured; truth.json holds the true positions and attitudes
    (rad) of the photographs, the true positions of the points, and the gross errors.
    """
    with failures():
        from photogram import Refraction
        from photogram.files import write_whole
        from photogram.geometry import Spheroid
        from photogram.giant import Project
        from photogram.giant.project import project_files
        from photogram.simulation import simulate as make

        spheroids = {Ellipsoid.CLARKE_1866: Spheroid.clarke_1866, Ellipsoid.WGS84: Spheroid.wgs84}
        if spheroid in spheroids:
            origin = (math.radians(origin[0]), math.radians(origin[1]), origin[2])
        simulation = make(
            strips=strips,
            photos_per_strip=photos_per_strip,
            forward_overlap=forward_overlap,
            side_overlap=side_overlap,
            principal_distance=principal_distance,
            frame_size=frame_size,
            flying_height=flying_height,
            relief=relief,
            points_per_photo=points_per_photo,
            crab=crab,
            tilt=tilt,
            control=control.value,
            control_spacing=control_spacing,
            control_sd=control_sd,
            check_points=check_points,
            image_sd=image_sd,
            position_error=position_error,
            attitude_error=attitude_error,
            position_sd=position_sd,
            attitude_sd=attitude_sd,
            blunders=blunders,
            blunder_size=blunder_size,
            spheroid=spheroids[spheroid]() if spheroid in spheroids else None,
            origin=origin,
            photo_to_ground=photo_to_ground,
            refraction=Refraction(
                air_refraction.value if air_refraction else None,
                water_refraction.value if water_refraction else None,
                water_level,
                water_index,
            )
            if air_refraction or water_refraction
            else None,
            seed=seed,
        )
        project = Project.from_block(simulation.block)
        written = {**project_files(project, out, overwrite=overwrite), out / "truth.json": _truth(simulation)}
        write_whole(written)
        for message in project.messages:
            errors.print(f"[yellow]remark:[/] {escape(str(message))}")
        block = simulation.block
        output.print(
            f"{escape(str(out))}: {len(block.photo_ids)} photographs, {len(block.point_ids)} points,"
            f" {len(block.image_xy)} image points"
        )


def _truth(simulation: Simulation) -> bytes:
    """Make the document of what is true in a simulated block."""
    import numpy as np
    import orjson

    truth, blunders = simulation.truth, simulation.blunders
    degrees = np.array([math.degrees(1), math.degrees(1), 1.0]) if truth.geographic else np.ones(3)
    document = {
        "units": {
            "position": "longitude and latitude in degrees, height in m"
            if truth.geographic
            else "X, Y, Z in m",
            "attitude_rad": "omega, phi, kappa, "
            + ("photo-to-ground" if truth.photo_to_ground else "ground-to-photo"),
            "error_mm": "what was added to x and y",
        },
        "photos": [
            {"id": name, "position": position, "attitude_rad": attitude}
            for name, position, attitude in zip(
                truth.photo_ids,
                (truth.photo_positions * degrees).tolist(),
                truth.photo_attitudes.tolist(),
                strict=True,
            )
        ],
        "points": [
            {"id": name, "position": position}
            for name, position in zip(
                truth.point_ids, (truth.point_positions * degrees).tolist(), strict=True
            )
        ],
        "blunders": [
            {
                "photo": truth.photo_ids[truth.image_photos[row]],
                "point": truth.point_ids[truth.image_points[row]],
                "error_mm": amount,
            }
            for row, amount in zip(blunders.images.tolist(), blunders.amounts.tolist(), strict=True)
        ],
    }
    return orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)
