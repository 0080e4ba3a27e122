"""What the commands on projects of any format share: options, reading, telling what was found."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from photogram.cli.job import Job, Reads
from photogram.cli.photographs import MrkAntenna, PhotosCrs, PhotosFolder
from photogram.cli.planetary import CubesFile, JigsawSettings
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted, listed

if TYPE_CHECKING:
    from photogram.arguments.types import Indices
    from photogram.formats import Project
    from photogram.show.sections import Section

__all__ = [
    "EXAMPLE",
    "NOTHING",
    "Additions",
    "Deviations",
    "Example",
    "ProjectPath",
    "described",
    "project_path",
    "read_project",
    "with_additions",
    "with_options",
]

EXAMPLE = ("project",)
"""The packaged example, a directory of photogram.examples."""


class OriginName(StrEnum):
    """Which place of the first pixel is 0, 0."""

    CORNER = "corner"
    CENTER = "center"


class AngleName(StrEnum):
    """Units of angles."""

    DEG = "deg"
    GON = "gon"
    RAD = "rad"


ProjectPath = Annotated[
    Path | None,
    Reads.FILE,
    typer.Argument(
        metavar="PATH",
        help="A project: a folder or file of any format that docs/formats.md lists.",
        show_default=False,
    ),
]
Example = Annotated[
    bool,
    typer.Option("--example", help="Take the packaged example instead, that of `photogram new`."),
]
FormatName = Annotated[
    str | None,
    typer.Option("--format", metavar="NAME", help="Format of PATH. Default: found out.", show_default=False),
]
ControlFile = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option("--control", metavar="FILE", help="Table of control and check points.", show_default=False),
]
ControlCrs = Annotated[
    str | None,
    typer.Option(
        "--control-crs",
        metavar="CRS",
        help="CRS of --control (EPSG:25832 ...), where it is not that of PATH.",
        show_default=False,
    ),
]
ControlColumns = Annotated[
    str | None,
    typer.Option(
        "--columns",
        metavar="COLUMN=HEADING,..",
        help="What the columns of control are: point=Name,x=East,y=-South; -=Heading is not read;"
        " point,y,x,z or PNEZD without a header.",
        show_default=False,
    ),
]
ControlRoles = Annotated[
    str | None,
    typer.Option(
        "--roles",
        metavar="WORD=ROLE,..",
        help="What words of control mean: KP=check, PP=control, X=off.",
        show_default=False,
    ),
]
ImagesFile = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option(
        "--images",
        metavar="FILE",
        help="Further measurements: photo, point, column, row.",
        show_default=False,
    ),
]
NamesFile = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option("--names", metavar="FILE", help="Other names of points: point, name.", show_default=False),
]
CamerasFile = Annotated[
    Path | None,
    Reads.FILE,
    typer.Option(
        "--camera", metavar="FILE", help="Table of cameras, for formats that have none.", show_default=False
    ),
]
Deviations = Annotated[
    list[str] | None,
    typer.Option(
        "--sd",
        metavar="TABLE=S[,S,S]",
        help="Standard deviations where PATH has none: images=0.5, control=0.02,0.02,0.03, gnss=...",
        show_default=False,
    ),
]
ProjectSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="What project.toml is to say: film.model=affine, adjust.loss=huber.",
        show_default=False,
    ),
]
PixelOrigin = Annotated[
    OriginName | None,
    typer.Option(
        help="Corner or center of the first pixel is 0, 0, in tables of pixels.", show_default=False
    ),
]
Model = Annotated[
    int | None,
    typer.Option(
        min=0,
        metavar="N",
        help="Which of several models of a file, from 0. Default: the largest.",
        show_default=False,
    ),
]
Angles = Annotated[
    AngleName | None, typer.Option(help="Unit of angles in files that do not say it.", show_default=False)
]


KeepRepeated = Annotated[
    bool,
    typer.Option(
        "--keep-repeated",
        help="Second images of a point on a photo count too: their mean with the first.",
    ),
]


@dataclass(frozen=True)
class Additions:
    """What a user adds to a project, with the options that say it; see :func:`with_additions`."""

    file_format: FormatName = None
    control: ControlFile = None
    control_crs: ControlCrs = None
    columns: ControlColumns = None
    roles: ControlRoles = None
    images: ImagesFile = None
    names: NamesFile = None
    camera: CamerasFile = None
    sd: Deviations = None
    settings: ProjectSettings = None
    photos_dir: PhotosFolder = None
    photos_crs: PhotosCrs = None
    mrk_antenna: MrkAntenna = False
    pixel_origin: PixelOrigin = None
    model: Model = None
    angles: Angles = None
    keep_repeated: KeepRepeated = False
    cubes: CubesFile = None
    jigsaw: JigsawSettings = None


NOTHING = Additions()


def with_additions(*omitted: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of :class:`Additions`, but for some, in place of its parameter `added`."""
    return with_options("added", Additions, *omitted)


def with_options(
    name: str, kind: Callable[..., Any], *omitted: str
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of a class, but for some, in place of its parameter of a name."""
    options = [
        each for each in signature(kind, eval_str=True).parameters.values() if each.name not in omitted
    ]

    def decorated(command: Callable[..., None]) -> Callable[..., None]:
        own = signature(command, eval_str=True)
        parameters = [
            each for one in own.parameters.values() for each in (options if one.name == name else [one])
        ]

        @wraps(command)
        def with_them(**values: Any) -> None:
            given = {each.name: values.pop(each.name) for each in options if each.name in values}
            command(**{name: kind(**given)}, **values)

        with_them.__dict__["__signature__"] = own.replace(parameters=parameters)
        return with_them

    return decorated


def project_path(job: Job, path: Path | None) -> Path:
    """Return the path that a user gives, or that of the packaged example."""
    return job.packaged(*EXAMPLE) if path is None else path


def read_project(job: Job, path: Path, added: Additions) -> Project:
    """Read what lies at a path, with what a user adds; its files are inputs of the job from now on."""
    from photogram.formats import PhotoFiles, Wishes, read
    from photogram.formats.columns import columns_given
    from photogram.formats.names import with_names
    from photogram.formats.supplements import deviations, with_control, with_images, with_repeated, with_sd

    if added.photos_dir is None and (added.photos_crs or added.mrk_antenna):
        raise typer.BadParameter("says something of --photos-dir", param_hint="--photos-crs, --mrk-antenna")
    if added.cubes is None and added.jigsaw is not None:
        raise typer.BadParameter("says how the images of --cubes are adjusted", param_hint="--jigsaw")
    if path.is_dir():
        job.reads(*(each for each in sorted(path.iterdir()) if each.is_file()))
    sd = deviations(added.sd or [])
    columns = columns_given(added.columns, added.roles)
    origin = None if added.pixel_origin is None else added.pixel_origin.value
    wishes = Wishes(
        cameras=added.camera,
        pixel_origin=origin,
        model=added.model,
        angles=None if added.angles is None else added.angles.value,
        sd=sd,
        columns=columns,
        photos=None
        if added.photos_dir is None
        else PhotoFiles(added.photos_dir, added.photos_crs, added.mrk_antenna),
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


def described(project: Project) -> list[Section]:
    """Return what was read, as titled sections."""
    import numpy as np

    from photogram.formats.block_contents import motions
    from photogram.formats.plain.writing import known_cameras
    from photogram.formats.self_check import agreement, doubts
    from photogram.network.film_reduction import camera_unit

    block = project.block
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    held = int(np.count_nonzero(np.isfinite(block.point_sd).any(axis=1)))
    posed = int(np.count_nonzero(np.isfinite(block.photo_positions).all(axis=1)))
    size = [
        f"{len(block.photo_ids)} photos, {posed} with a position; {len(block.image_xy)} images of"
        f" {np.count_nonzero(rays)} points",
        "rays of points: "
        + ", ".join(f"{count} with {k}{' or more' if k == _MANY else ''}" for k, count in _ray_counts(rays)),
        f"control: {counted(held, 'point')} held, {counted(len(project.checks), 'check point')}",
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
            ("Lacking", list(project.lacks)),
            ("Remarks", remarks),
        )
        if each[1]
    ]


_MANY = 10


def _ray_counts(rays: Indices) -> list[tuple[int, int]]:
    """Return how many points have one, two, ... rays."""
    import numpy as np

    counts = np.bincount(np.minimum(rays[rays > 0], _MANY), minlength=_MANY + 1)
    return [(k, int(count)) for k, count in enumerate(counts.tolist()) if count]
