"""What writers ask of a block: photos with a pose, correlated control, what moves, what has no place."""

from __future__ import annotations

from collections import Counter

import numpy as np

from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.trajectories_written import shared_trajectories
from photogram.formats.project import Project
from photogram.messages import counted
from photogram.network.block import Block
from photogram.network.films import Scan
from photogram.network.observations import Control, Position
from photogram.network.trajectories import Basis, Coefficient, Polynomial, Trajectory

MOST_TOLD = 12
"""Trajectories that are told one by one."""


def posed(block: Block) -> Bools:
    """Return (P,) which photos have a position and an attitude."""
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    return np.asarray(np.isfinite(poses).all(axis=1))


def correlated_control(block: Block) -> dict[str, Control]:
    """Return control that is observed with correlations, by the names of its points."""
    return {each.point: each for each in block.observations if isinstance(each, Control)}


def lost_observations(block: Block, gnss: str) -> list[str]:
    """Return what a format with control and GNSS loses, in sentences; `gnss` says what of GNSS itself."""
    found = []
    if correlated_control(block):
        found.append("correlations between coordinates of control")
    others = sum(not isinstance(each, Position | Control) for each in block.observations)
    if others:
        found.append(f"{others} observations beside images, control and GNSS")
    if any(isinstance(each, Position) for each in block.observations):
        found.append(f"{gnss} of GNSS, lever arms, shifts and drifts")
    if block.mounts:
        found.append("rigs: photos have their poses")
    if block.passages:
        found.append("what images pass: boards are flat")
    return found


def check_images(block: Block, title: str) -> None:
    """Refuse to write what a file would have for images in the frame of a camera, and is something else."""
    scanned = [each.photo for each in block.passages if isinstance(each, Scan)]
    if scanned:
        raise InputError(
            f"{title}: the images of the photo {scanned[0]} are readings of a scanned film, which are not"
            " written; `photogram adjust` writes refined.csv, images in mm in the frame of the camera"
        )
    lines = [each.photo for each in block.timed if each.lines is not None]
    if lines:
        raise InputError(f"{title}: the photo {lines[0]} is of a line scanner, and takes no pictures")


def motions(project: Project) -> list[str]:
    """Return what of a project is on trajectories, a line each; nothing where nothing is."""
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
    """Return what a trajectory is, and what is on it."""
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
    """Return what corrections are, and what is known of their coefficients."""
    if basis is None:
        return "as given"
    kind = "polynomial" if isinstance(basis, Polynomial) else "spline"
    held = all(each.is_held for each in coefficients)
    known = ", known" if held else ""
    return f"{kind} of degree {basis.degree}, {counted(len(coefficients), 'coefficient')}{known}"


def lost_motions(block: Block) -> list[str]:
    """Return what a format without trajectories has no place for, in sentences."""
    found = []
    if block.timed:
        found.append(f"trajectories: {counted(len(block.timed), 'photo')} with the poses that they are about")
    records = sum(each.moment is not None for each in block.observations)
    if records:
        found.append(counted(records, "observation") + " of trajectories")
    return found
