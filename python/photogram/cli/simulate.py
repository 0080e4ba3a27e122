"""`photogram simulate`: write a simulated block as a GIANT project, or as tables where it moves."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.markup import escape

from photogram.cli.console import output, print_remark
from photogram.cli.job import Job, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.simulation_options import MotionOptions, NetworkOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from photogram.giant.common import Common
    from photogram.messages import Message
    from photogram.network.block import Block
    from photogram.network.simulation import Simulation


@with_job
def simulate(
    job: Job,
    *,
    out: Annotated[Path, Writes.DIRECTORY],
    network: NetworkOptions,
    moves: MotionOptions,
    check_points: int = 20,
    blunders: int = 0,
    blunder_size: float = 0.2,
    overwrite: bool = False,
    quiet: Quiet = False,
) -> None:
    """Write a simulated block as a GIANT project, or as tables if cameras move, with its truth.

    The GIANT files contain simulated measurements. truth.json contains true positions and attitudes (rad) of
    photographs, true positions of points, and gross errors. FRAMES has one set of stations. With --position-
    sd or --attitude-sd these are the observed values; components that are not observed have initial values
    with their errors as standard deviations. Every weight counts in the unit variance (COMMON column 12).
    Otherwise FRAMES has initial values with the weak default standard deviations.

    With --readout or --scanner the cameras move during the exposure. GIANT files cannot contain motion, so
    the command writes tables for `photogram adjust DIR`; truth.json contains true motions and trajectories.
    """
    with job:
        from photogram.giant import Project
        from photogram.giant.project import project_files
        from photogram.network.simulation import simulate as make

        simulation = make(
            check_points=check_points,
            blunders=blunders,
            blunder_size=blunder_size,
            **network.arguments(moves),
        )
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
        if not quiet:
            for message in remarks:
                print_remark(message)
        job.finish(written, summary=lambda: output.print(escape(size)))


def _filed(block: Block, position_error: float, attitude_error: float) -> tuple[Block, Common]:
    """Return a simulated block as files can state it, and the job: no initial value is free in them."""
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
        raise InputError("holds a project; --overwrite allows it to be replaced", file=out)
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
    """Make the document of what is true in a simulated block."""
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
    """Return readout times, motions and trajectories of a simulated block; nothing where nothing moves."""
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
