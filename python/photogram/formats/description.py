"""Description of a project without adjustment: sizes, cameras, rays, units, missing data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Indices
from photogram.formats.block_contents import motions
from photogram.formats.plain.writing import known_cameras
from photogram.formats.project import Project
from photogram.formats.self_check import agreement, doubts
from photogram.messages import counted, listed
from photogram.network.block import Block
from photogram.network.film_reduction import camera_unit
from photogram.network.observations import Control
from photogram.results.datum import point_kinds

if TYPE_CHECKING:
    from photogram.show.forms import TitledLines


def described(project: Project) -> list[TitledLines]:
    """Return a description of a project as titled sections."""
    block = project.block
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    posed = int(np.count_nonzero(np.isfinite(block.photo_positions).all(axis=1)))
    size = [
        f"{len(block.photo_ids)} photos, {posed} with a position; {len(block.image_xy)} images of"
        f" {np.count_nonzero(rays)} points",
        "rays of points: "
        + ", ".join(f"{count} with {k}{' or more' if k == _MANY else ''}" for k, count in _ray_counts(rays)),
        _control_line(block, rays),
    ]
    kinds: dict[str, int] = {}
    for each in block.observations:
        kinds[each.label] = kinds.get(each.label, 0) + 1
    size += [f"{counted(count, 'observation')} of the kind {kind}" for kind, count in kinds.items()]
    if project.features:
        size.append(f"{counted(len(project.features), 'feature')}: {listed(list(project.features))}")
    if block.mounts:
        size.append(f"{len(block.mounts)} photos on frames with others")
    cameras = []
    known, which = known_cameras(block)
    for row, camera in enumerate(known):
        pictures = project.sizes[row] if row < len(project.sizes) else None
        extent = "" if pictures is None else f", {pictures[0]} x {pictures[1]} pixels"
        values = ", ".join(f"{name} {value:.7g}" for name, value in camera.parameters.items() if value)
        cameras.append(
            f"{camera.title}: {camera.model}{extent}, {which.count(row)} photos: {values} ({camera.unit})"
        )
    found = agreement(project)
    conventions = [
        f"frame: {project.frame}, unit {block.linear_unit}",
        f"image coordinates in {block.image_unit}"
        + (", pixels from the upper-left corner" if {each.image_y for each in known} == {"down"} else ""),
    ]
    if found.images:
        conventions.append(
            f"median residual of {found.images} images with the positions of the file: {found.median:.3g}"
            f" {camera_unit(block)}"
        )
    remarks = [str(each) for each in (*project.messages, *doubts(project))]
    return [
        each
        for each in (
            ("Read", [f"{project.path}: {project.title}"]),
            ("Size", size),
            ("Cameras", cameras),
            ("Trajectories", motions(project)),
            ("Units and axes", conventions),
            ("Lacking", list(map(str, project.lacks))),
            ("Remarks", remarks),
        )
        if each[1]
    ]


def _control_line(block: Block, rays: Indices) -> str:
    """Return numbers of control and check points, and names of unobserved ones."""
    others = {name for each in block.observations if not isinstance(each, Control) for name in each.points}
    measured = (rays > 0) | np.isin(block.point_ids, list(others))
    kinds = point_kinds(block)
    control, checks = (int(np.count_nonzero(measured & (kinds == kind))) for kind in ("control", "check"))
    idle = [block.point_ids[row] for row in np.flatnonzero(~measured & (kinds != "pass")).tolist()]
    rest = f"; without image observations: {listed(idle)}" if idle else ""
    return f"control: {counted(control, 'point')} held, {counted(checks, 'check point')}{rest}"


_MANY = 10


def _ray_counts(rays: Indices) -> list[tuple[int, int]]:
    """Return pairs of a number of rays and the number of points with it."""
    counts = np.bincount(np.minimum(rays[rays > 0], _MANY), minlength=_MANY + 1)
    return [(k, int(count)) for k, count in enumerate(counts.tolist()) if count]
