"""`photogram simulate`: write a simulated block; `photogram plan`: predict the accuracy of networks."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from rich.markup import escape

from photogram.cli.check import GALVESTON
from photogram.cli.console import output
from photogram.cli.documents import TEXT, OfPrograms
from photogram.cli.job import Job, with_job
from photogram.cli.options import Changes, Reads, Without, Writes, misuse
from photogram.lazy_dataclasses import asdict, dataclass, fields, replace
from photogram.network.refraction import Refraction
from photogram.network.simulation_options import (
    ControlPattern,
    LineScanner,
    RollingShutter,
    SimulationOptions,
)
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Block

Bent = Annotated[Mapping[str, Any], Changes(Refraction, "air", "water", "water_level", "refractive_index")]


@dataclass(frozen=True)
class SpaceOptions:
    """Object space of a simulated block."""

    spheroid: Literal["none", "clarke1866", "wgs84"] = "none"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def of(
        self, network: SimulationOptions, bent: Mapping[str, Any], moves: MotionOptions
    ) -> SimulationOptions:
        """Return the options of a network in this space, with this refraction and motion."""
        from photogram.network.geometry import Spheroid

        spheroid, (x, y, z) = None, self.origin
        if self.spheroid != "none":
            spheroid = Spheroid.wgs84() if self.spheroid == "wgs84" else Spheroid.clarke_1866()
            x, y = math.radians(x), math.radians(y)
        bends = bent.get("air") or bent.get("water")
        refraction, motion = Refraction(**bent) if bends else None, moves.motion()
        return replace(network, spheroid=spheroid, origin=(x, y, z), refraction=refraction, motion=motion)


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
        given = {name: each for name, each in asdict(self).items() if each is not None and each is not False}
        if not given:
            return None
        if ("readout" in given) == ("scanner" in given):
            raise misuse(_hint(given), "requires", options="either --readout or --scanner")
        kind: Any = RollingShutter if "readout" in given else LineScanner
        names = {"readout_direction": "direction", "scanner": "lines", "knots": "position"}
        own = {each.name for each in fields(kind)}
        if strange := [name for name in given if names.get(name, name) not in own]:
            option = "--readout" if kind is RollingShutter else "--scanner"
            raise misuse(_hint(strange), "conflict", options=option)
        if "knots" in given:
            from photogram.network.trajectories import Spline

            given["knots"] = given["rotation"] = Spline(every=given["knots"])
        return kind(**{names.get(name, name): value for name, value in given.items()})  # type: ignore[no-any-return]


def _hint(names: Iterable[str]) -> str:
    return ", ".join(f"--{name.replace('_', '-')}" for name in sorted(names))


@with_job("simulate", json=False)
def simulate(
    job: Job,
    *,
    out: Annotated[Path, Writes.DIRECTORY],
    network: Annotated[SimulationOptions, OfPython],
    space: SpaceOptions,
    bent: Bent,
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
    from photogram.network.simulation import simulate as make

    simulation = make(space.of(network, bent, moves))
    block = simulation.block
    if block.timed:
        files = _tables(block, out, overwrite=overwrite)
    else:
        files = _giant_files(job, block, out, network, overwrite=overwrite)
    size = (
        f"{out}: {len(block.photo_ids)} photographs, {len(block.point_ids)} points,"
        f" {len(block.image_xy)} image points"
    )
    job.finish(
        {**files, out / "truth.json": simulation.to_json()}, summary=lambda: output.print(escape(size))
    )


def _giant_files(
    job: Job, block: Block, out: Path, network: SimulationOptions, *, overwrite: bool
) -> dict[Path, bytes]:
    """Return the files of a GIANT project; initial values without observations get standard deviations."""
    import numpy as np

    from photogram.giant import Project
    from photogram.giant.common import Common
    from photogram.giant.project import project_files
    from photogram.network.geometry import lengths_of_units

    common = Common(error_propagation=True)
    weighted = [np.isfinite(sd).all() for sd in (block.photo_position_sd, block.photo_attitude_sd)]
    if any(weighted):
        common = replace(common, unit_variance="constrained")
        if not weighted[0] and network.position_error:
            metres = lengths_of_units(block.photo_positions, block.spheroid)
            block = block.replace(photo_position_sd=network.position_error / metres)
        if not weighted[1] and network.attitude_error:
            block = block.replace(photo_attitude_sd=network.attitude_error)
    project = Project.from_block(block, common)
    job.remark(*project.messages)
    return dict(project_files(project, out, overwrite=overwrite))


def _tables(block: Block, out: Path, *, overwrite: bool) -> dict[Path, bytes]:
    from photogram.errors import InputError
    from photogram.formats.plain.writing import write
    from photogram.formats.project import Project

    if (out / "project.toml").exists() and not overwrite:
        raise InputError(phrase("command.project-exists"), file=out)
    project = Project(block=block, path=out, title="simulated")
    return {out / name: content for name, content in write(project).items()}


OfPlans = Without(*OfPython.names, "check_points", "blunders", "blunder_size")


@with_job("plan")
def plan(
    job: Job,
    *,
    network: Annotated[SimulationOptions, OfPlans],
    space: SpaceOptions,
    bent: Bent,
    moves: MotionOptions,
    projects: Annotated[list[Path] | None, Reads.PROJECT] = None,
    packaged: Annotated[bool, typer.Option("--example")] = False,
    against: ControlPattern = "corners",
    against_spacing: int | None = None,
    against_position_sd: float | None = None,
    documents: OfPrograms,
) -> None:
    """Predict the accuracy of a network before the flight for two patterns of control.

    No measurements are necessary. The report contains expected standard deviations of points by number of
    rays and by location, of photographs, and the detectable gross errors.
    """
    from photogram.network.simulation import simulate as make
    from photogram.planning.networks import plan as predict

    if packaged:
        if projects:
            raise misuse("--example", "conflict", options="DIR")
        projects = [job.packaged(GALVESTON)]
        if documents.plots:
            documents = replace(documents, out=documents.out or Path("example-planned"))
    documents.declare(job, TEXT, pictures=["plan"])
    if projects:
        simulated = network, space, bent, moves, against, against_spacing, against_position_sd
        if simulated != (SimulationOptions(), SpaceOptions(), {}, MotionOptions(), "corners", None, None):
            raise misuse("DIR", "simulation")
        patterns = _adjusted(job, projects)
    else:
        second = replace(
            network,
            control=against,
            control_spacing=network.control_spacing if against_spacing is None else against_spacing,
            position_sd=network.position_sd if against_position_sd is None else against_position_sd,
        )
        options = [space.of(each, bent, moves) for each in (network, second)]
        patterns = {_name(each): make(each, check_points=0).truth for each in options}
        if len(patterns) < len(options):
            raise misuse("--against", "same-pattern", pattern=next(iter(patterns)))
    made = predict(patterns)
    documents.conclude(job, made, plots=lambda: {"plan": made.plot()}, code=0)


def _name(network: SimulationOptions) -> str:
    """Return a name of a pattern from its distinctive properties."""
    spacing = network.control_spacing
    names = {
        "perimeter": f"perimeter, {spacing} base{'s' * (spacing != 1)}",
        "corners": "corners",
        "none": "no control",
    }
    weighted = math.isfinite(network.position_sd)
    return names[network.control] + (f", positions {network.position_sd:g} m" if weighted else "")


def _adjusted(job: Job, projects: list[Path]) -> dict[str, Block]:
    """Read and adjust projects, so that all points have positions."""
    from photogram import adjust
    from photogram.adjustment.prediction import at_adjusted
    from photogram.giant import read_project

    patterns = {}
    for name, directory in _names(projects).items():
        project = read_project(directory)
        block = project.to_block()
        job.remark(*job.told(project.messages))
        if project.common.intersection_only:
            block = block.with_fixed_photos()
        patterns[name] = at_adjusted(adjust(block, covariance=False))
    return patterns


def _names(projects: list[Path]) -> dict[str, Path]:
    """Name projects by the last part of their paths, if these differ."""
    places = [Path(os.path.realpath(directory)) for directory in projects]
    if repeated := [str(place) for place in dict.fromkeys(places) if places.count(place) > 1]:
        raise misuse("DIR", "project-repeated", names=repeated)
    short = len({place.name for place in places}) == len(places)
    return {place.name if short else str(place): given for place, given in zip(places, projects, strict=True)}
