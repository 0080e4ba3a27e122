"""Common parts of commands on projects: options, reading, description."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from photogram.cli.command_classes import misuse
from photogram.cli.job import InputFile, Job
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted, listed

if TYPE_CHECKING:
    from photogram import Block
    from photogram.arguments.types import Indices
    from photogram.formats import Project
    from photogram.show.forms import TitledLines

EXAMPLE = ("project",)  # The packaged example, a directory of photogram.examples

OriginName = Literal["corner", "center"]


@dataclass(frozen=True)
class Additions:
    """Options for additional data of a project."""

    file_format: Annotated[str | None, typer.Option("--format")] = None
    control: InputFile = None
    control_crs: str | None = None
    columns: str | None = None
    roles: str | None = None
    images: InputFile = None
    names: InputFile = None
    camera: InputFile = None
    sd: list[str] | None = None
    settings: Annotated[list[str] | None, typer.Option("--set")] = None
    photos_dir: InputFile = None
    photos_crs: str | None = None
    gnss: InputFile = None
    gnss_crs: str | None = None
    gnss_antenna: str | None = None
    mrk_antenna: bool = False
    pixel_origin: OriginName | None = None
    model: Annotated[int | None, typer.Option(min=0)] = None
    angles: Literal["deg", "gon", "rad"] | None = None
    keep_repeated: bool = False
    cubes: InputFile = None
    jigsaw: str | None = None


NOTHING = Additions()


def read_project(job: Job, path: Path, added: Additions) -> Project:
    """Read a project with additional data; its files become inputs of the job."""
    from photogram.formats import GnssFile, PhotoFiles, Wishes, read
    from photogram.formats.columns import columns_given
    from photogram.formats.names import with_names
    from photogram.formats.supplements import deviations, with_control, with_images, with_repeated, with_sd

    if added.photos_dir is None and added.photos_crs:
        raise misuse("--photos-crs", "requires", options="--photos-dir DIR")
    if added.photos_dir is None and added.gnss is None and added.mrk_antenna:
        raise misuse("--mrk-antenna", "requires", options="--photos-dir DIR or --gnss FILE")
    if added.gnss is None and (added.gnss_crs or added.gnss_antenna):
        option = "--gnss-crs" if added.gnss_crs else "--gnss-antenna"
        raise misuse(option, "requires", options="--gnss FILE")
    if added.cubes is None and added.jigsaw is not None:
        raise misuse("--jigsaw", "requires", options="--cubes LIST")
    job.reads_inside(path)
    sd = deviations(added.sd or [])
    columns = columns_given(added.columns, added.roles)
    origin = None if added.pixel_origin is None else added.pixel_origin
    wishes = Wishes(
        cameras=added.camera,
        pixel_origin=origin,
        model=added.model,
        angles=None if added.angles is None else added.angles,
        sd=sd,
        columns=columns,
        photos=None
        if added.photos_dir is None
        else PhotoFiles(added.photos_dir, added.photos_crs, added.mrk_antenna),
        gnss=None
        if added.gnss is None
        else GnssFile(added.gnss, added.gnss_crs, _antenna(added.gnss_antenna), added.mrk_antenna),
        cubes=added.cubes,
        jigsaw=added.jigsaw,
        settings=added.settings or (),
    )
    project = with_sd(read(path, added.file_format, wishes), sd)
    job.reads(*project.details.get("further inputs", ()))
    job.spares(*project.details.get("photo pictures", ()))
    if added.keep_repeated:
        project = with_repeated(project)
    if added.images is not None:
        project = with_images(project, added.images, origin)
    if added.names is not None:
        project = with_names(project, added.names)
    if added.control is not None:
        project = with_control(project, added.control, sd, added.control_crs, columns)
    return project.replace(path=job.shown(project.path), messages=tuple(job.told(project.messages)))


def _antenna(text: str | None) -> tuple[float, float, float, float] | None:
    """Return antenna position and standard deviation of `X,Y,Z` or `X,Y,Z,SD`."""
    if text is None:
        return None
    try:
        x, y, z, sd = map(float, (text if text.count(",") == 3 else f"{text},0").split(","))
    except ValueError:
        sd = x = y = z = math.nan
    if not (math.isfinite(x + y + z) and sd >= 0):
        form = "3 or 4 numbers in metres, such as 0.0,0.08,0.1,0.01"
        raise misuse("--gnss-antenna", "form", form=form, value=text)
    return x, y, z, sd


def described(project: Project) -> list[TitledLines]:
    """Return a description of a project as titled sections."""
    import numpy as np

    from photogram.formats.block_contents import motions
    from photogram.formats.plain.writing import known_cameras
    from photogram.formats.self_check import agreement, doubts
    from photogram.network.film_reduction import camera_unit

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
    import numpy as np

    from photogram.network.observations import Control
    from photogram.results.datum import point_kinds

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
    import numpy as np

    counts = np.bincount(np.minimum(rays[rays > 0], _MANY), minlength=_MANY + 1)
    return [(k, int(count)) for k, count in enumerate(counts.tolist()) if count]
