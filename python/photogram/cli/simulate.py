"""`photogram simulate`: write a simulated block as a GIANT project, or as tables if it moves."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.markup import escape

from photogram.cli.command_classes import misuse
from photogram.cli.console import output, print_remark
from photogram.cli.job import Job, Without, Writes, with_job
from photogram.cli.options import AirModel, WaterModel
from photogram.lazy_dataclasses import asdict, dataclass, replace
from photogram.network.simulation_options import LineScanner, RollingShutter, SimulationOptions
from photogram.words import phrase

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from photogram.giant.common import Common
    from photogram.messages import Message
    from photogram.network.block import Block
    from photogram.network.simulation import Simulation


@dataclass(frozen=True)
class SpaceOptions:
    """Object space of a simulated block, and its refraction."""

    spheroid: Literal["none", "clarke1866", "wgs84"] = "none"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    air_refraction: AirModel | None = None
    water_refraction: WaterModel | None = None
    water_level: float = 0.0
    water_index: Annotated[float, typer.Option(min=1)] = 1.340

    def of(self, network: SimulationOptions, moves: MotionOptions) -> SimulationOptions:
        """Return the options of a network in this space, of cameras that move so."""
        from photogram.network.geometry import Spheroid
        from photogram.network.refraction import Refraction

        spheroid, (x, y, z) = None, self.origin
        if self.spheroid != "none":
            spheroid = Spheroid.wgs84() if self.spheroid == "wgs84" else Spheroid.clarke_1866()
            x, y = math.radians(x), math.radians(y)
        air = None if self.air_refraction == "none" else self.air_refraction
        water = None if self.water_refraction == "none" else self.water_refraction
        bent = Refraction(air, water, self.water_level, self.water_index) if air or water else None
        return replace(network, spheroid=spheroid, origin=(x, y, z), refraction=bent, motion=moves.motion())


OfPython = Without("spheroid", "origin", "refraction", "cameras", "start_cameras", "motion")


@dataclass(frozen=True)
class MotionOptions:
    """Motion of cameras; see :class:`RollingShutter` and :class:`LineScanner`."""

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
        """Return the motion of these options, if any."""
        given = {name: value for name, value in asdict(self).items() if value is not None}
        given |= {"scenes": True} if given.pop("scenes") else {}
        if not given:
            return None
        if ("readout" in given) == ("scanner" in given):
            raise misuse(_hint(given), "requires", options="either --readout or --scanner")
        rolling = "readout" in given
        strange = given.keys() & (_OF_SCANNERS if rolling else _OF_SHUTTERS)
        if strange:
            raise misuse(_hint(strange), "conflict", options="--readout" if rolling else "--scanner")
        if rolling:
            direction = given.pop("readout_direction", "down")
            return RollingShutter(direction=direction, **given)
        if "knots" in given:
            from photogram.network.trajectories import Spline

            given["position"] = given["rotation"] = Spline(every=given.pop("knots"))
        return LineScanner(lines=given.pop("scanner"), **given)


_OF_SHUTTERS = {"readout_sd", "readout_direction", "speed_sd", "rate", "rate_sd"}
_OF_SCANNERS = {"view_angle", "pitch", "every", "knots", "scenes"}


def _hint(names: Iterable[str]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in sorted(names))


@with_job()
def simulate(
    job: Job,
    *,
    out: Annotated[Path, Writes.DIRECTORY],
    network: Annotated[SimulationOptions, OfPython],
    space: SpaceOptions,
    moves: MotionOptions,
    overwrite: bool = False,
) -> None:
    """Write a simulated block as a GIANT project, or as tables if cameras move, with its truth.

    The GIANT files contain simulated measurements. truth.json contains true positions and attitudes (rad)
    of photographs, true positions of points, and gross errors. FRAMES has one set of stations. With
    --position-sd or --attitude-sd these are the observed values; components that are not observed have
    initial values with their errors as standard deviations. Every weight counts in the unit variance
    (COMMON column 12). Otherwise FRAMES has initial values with the weak default standard deviations.

    With --readout or --scanner the cameras move during the exposure. GIANT files cannot contain motion, so
    the command writes tables for `photogram adjust DIR`; truth.json contains true motions and trajectories.
    """
    from photogram.giant import Project
    from photogram.giant.project import project_files
    from photogram.network.simulation import simulate as make

    simulation = make(space.of(network, moves))
    block = simulation.block
    remarks: Sequence[Message] = ()
    if block.timed:
        files = _tables(simulation, out, overwrite=overwrite)
    else:
        block, common = _filed(block, network.position_error, network.attitude_error)
        project = Project.from_block(block, common)
        files = project_files(project, out, overwrite=overwrite)
        remarks = project.messages
    written = {**files, out / "truth.json": _truth(simulation)}
    size = (
        f"{out}: {len(block.photo_ids)} photographs, {len(block.point_ids)} points,"
        f" {len(block.image_xy)} image points"
    )
    if not job.quiet:
        for message in remarks:
            print_remark(message)
    job.finish(written, summary=lambda: output.print(escape(size)))


def _filed(block: Block, position_error: float, attitude_error: float) -> tuple[Block, Common]:
    """Return a simulated block in the form of GIANT files, and its job."""
    import numpy as np

    from photogram.giant.common import Common
    from photogram.network.geometry import lengths_of_units

    weighted = [np.isfinite(sd).all() for sd in (block.photo_position_sd, block.photo_attitude_sd)]
    if not any(weighted):
        return block, Common(error_propagation=True)
    if not weighted[0] and position_error:
        metres = lengths_of_units(block.photo_positions, block.spheroid)
        block = block.replace(photo_position_sd=position_error / metres)
    if not weighted[1] and attitude_error:
        block = block.replace(photo_attitude_sd=attitude_error)
    return block, Common(error_propagation=True, unit_variance="constrained")


def _tables(simulation: Simulation, out: Path, *, overwrite: bool) -> dict[Path, bytes]:
    """Return the tables of a block that moves."""
    from photogram.errors import InputError
    from photogram.formats.plain.writing import write
    from photogram.formats.project import Project

    if (out / "project.toml").exists() and not overwrite:
        raise InputError(phrase("command.project-exists"), file=out)
    block = simulation.block
    unknown = (None,) * max(1, len(block.cameras))
    project = Project(
        block=block,
        path=out,
        title="simulated",
        sizes=unknown,
        pixel_mm=unknown,
        starts=block.point_positions,
    )
    return {out / name: content for name, content in write(project).items()}


def _truth(simulation: Simulation) -> bytes:
    import numpy as np

    from photogram.io import json

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
            **({"motion": "s, m/s, rad/s; axes of the photo as columns"} if truth.timed else {}),
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
        **_true_motion(truth),
        "blunders": [
            {
                "photo": truth.photo_ids[truth.image_photos[row]],
                "point": truth.point_ids[truth.image_points[row]],
                "error_mm": amount,
            }
            for row, amount in zip(blunders.images.tolist(), blunders.amounts.tolist(), strict=True)
        ],
    }
    return json.to_json(document)


def _true_motion(truth: Block) -> dict[str, object]:
    """Return times, motions and trajectories of a moving simulated block."""
    import numpy as np

    from photogram.network.motion import given_poses
    from photogram.network.trajectories import Readout

    if not truth.timed:
        return {}
    motions, trajectories = [], []
    for own in truth.timed:
        if own.trajectory is None:
            velocity, rate = (np.asarray(each).tolist() for each in (own.velocity, own.rotation_rate))
            motions.append({"photo": own.photo, "velocity": velocity, "rate": rate})
    shared = {id(each.trajectory): each.trajectory for each in truth.timed if each.trajectory is not None}
    for each in shared.values():
        times = each.table.times
        places, axes = given_poses(each, times)
        poses = {"times": times.tolist(), "positions": places.tolist(), "axes": axes.tolist()}
        trajectories.append({"trajectory": each.name, **poses})
    readouts = [each for each in truth.unknowns if isinstance(each, Readout)]
    found = {
        "readouts": [{"shutter": each.name, "seconds": each.value} for each in readouts],
        "motions": motions,
        "trajectories": trajectories,
    }
    return {name: rows for name, rows in found.items() if rows}
