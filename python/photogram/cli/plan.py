"""`photogram plan`: predict the accuracy of a network, two patterns of control side by side."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.check import GALVESTON
from photogram.cli.console import print_remark
from photogram.cli.documents import TEXT, OfPrograms
from photogram.cli.job import Job, with_job
from photogram.cli.options import Reads, Without, misuse
from photogram.cli.simulate import Bent, MotionOptions, OfPython, SpaceOptions
from photogram.lazy_dataclasses import replace
from photogram.network.simulation_options import ControlPattern, SimulationOptions

if TYPE_CHECKING:
    from photogram import Block

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
    from photogram.network.simulation import simulate
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
        patterns = _adjusted(projects)
    else:
        second = replace(
            network,
            control=against,
            control_spacing=network.control_spacing if against_spacing is None else against_spacing,
            position_sd=network.position_sd if against_position_sd is None else against_position_sd,
        )
        options = [space.of(each, bent, moves) for each in (network, second)]
        patterns = {_name(each): simulate(each, check_points=0).truth for each in options}
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


def _adjusted(projects: list[Path]) -> dict[str, Block]:
    """Read and adjust projects, so that all points have positions."""
    from photogram import adjust
    from photogram.adjustment.prediction import at_adjusted
    from photogram.giant import read_project

    patterns = {}
    for name, directory in _names(projects).items():
        project = read_project(directory)
        block = project.to_block()
        for message in project.messages:
            print_remark(message)
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
