"""Contents of a block for writers: poses, control, trajectories."""

from __future__ import annotations

from collections import Counter

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.trajectories import shared_trajectories
from photogram.formats.project import Project
from photogram.messages import counted
from photogram.network.block import Block
from photogram.network.films import Scan
from photogram.network.observations import Control
from photogram.network.trajectories import Basis, Coefficient, Polynomial, Trajectory
from photogram.words import phrase

MOST_TOLD = 12  # Largest number of trajectories that are described one by one


def posed(block: Block) -> Bools:
    """Return (P,) which photos have a position and an attitude."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def correlated_control(block: Block) -> dict[str, Control]:
    """Return control with correlated coordinates by point name."""
    return {each.point: each for each in block.observations.of_type(Control)}


def check_images(block: Block, title: str) -> None:
    """Reject image coordinates of films or line scanners."""
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(phrase("format.film", title=title, photo=scanned[0]))
    lines = [each.photo for each in block.timed if each.lines is not None]
    if lines:
        raise InputError(phrase("format.scanner", photo=lines[0]))


def motions(project: Project) -> list[str]:
    """Describe the trajectories of a project, one per line."""
    block = project.block
    shared = shared_trajectories(block)
    if not block.timed and not shared:
        return []
    found = []
    if block.timed:
        kinds = {
            "with a rolling shutter": sum(each.shutter is not None for each in block.timed),
            "of a line scanner": sum(each.lines is not None for each in block.timed),
            "with a motion of their own": sum(each.trajectory is None for each in block.timed),
        }
        told = ", ".join(f"{count} {what}" for what, count in kinds.items() if count)
        found.append(
            ": ".join([f"{counted(len(block.timed), 'photo')} on trajectories", *([told] if told else [])])
        )
    found += [_told(each, block) for each in shared[:MOST_TOLD]]
    if len(shared) > MOST_TOLD:
        found.append(f"and {len(shared) - MOST_TOLD} more trajectories")
    settings = project.details.get("settings")
    if isinstance(settings, Settings) and settings.times:
        found.append(f"times: {settings.times}")
    return found


def _told(trajectory: Trajectory, block: Block) -> str:
    """Describe a trajectory and its photos and observations."""
    table = trajectory.table
    photos = sum(each.trajectory is trajectory for each in block.timed)
    kinds = Counter(
        each.label
        for each in block.observations
        if each.moment is not None and each.moment.trajectory is trajectory
    )
    on = [counted(photos, "photo")] if photos else []
    on += [f"{counted(count, 'observation')} of the kind {kind}" for kind, count in kinds.items()]
    first, last = table.span
    bases = [
        f"{what}: {_basis(basis, own)}"
        for what, basis, own in zip(
            ("position", "rotation"),
            (trajectory.position, trajectory.rotation),
            trajectory.coefficients,
            strict=True,
        )
    ]
    records = f"{counted(len(table.times), 'record')} of positions, {len(table.attitude_times)} of attitudes"
    return f"{trajectory.name}: {records}, {first!r} to {last!r} s; {'; '.join(bases)}; {', '.join(on)}"


def _basis(basis: Basis | None, coefficients: tuple[Coefficient, ...]) -> str:
    """Describe the corrections of a trajectory."""
    if basis is None:
        return "as given"
    kind = "polynomial" if isinstance(basis, Polynomial) else "spline"
    held = all(each.is_held for each in coefficients)
    known = ", known" if held else ""
    return f"{kind} of degree {basis.degree}, {counted(len(coefficients), 'coefficient')}{known}"
