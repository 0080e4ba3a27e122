"""`photogram convert-lens`: fit a lens of another model to a camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.arguments.fields import option
from photogram.cli.console import NOT_USABLE
from photogram.cli.documents import Documents
from photogram.cli.job import Job, with_job
from photogram.cli.options import Only, Reads, misuse
from photogram.lazy_dataclasses import dataclass, replace
from photogram.targets.options import distances_of, pair
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.network.cameras import Camera


@dataclass(frozen=True)
class LensFit:
    radius: Annotated[float, typer.Option(min=1.0, show_default=False)] = math.inf
    distances: Sequence[float] = option((), kind=str, parse=distances_of, name="--distance")
    intrinsics_only: bool = False
    knots: tuple[int, int] | None = option(None, kind=str, parse=pair)
    size: tuple[int, int] | None = option(None, kind=str, parse=pair)


@with_job("convert-lens")
def convert_lens(
    job: Job,
    *,
    path: Annotated[Path, Reads.FILE],
    to: str,
    camera: str | None = None,
    fit: LensFit,
    tolerance: float | None = None,
    documents: Annotated[Documents, Only("out", "plots")],
) -> None:
    """Fit a lens of another model to a camera and report the differences.

    The report contains root mean square and largest difference of 60 x 40 pixels, the largest one's position,
    and the motion of the axes. If the camera has covariances, the new camera has covariances, too.
    """
    documents = replace(documents, no_html=True)
    documents.declare(job, pictures=["difference"])
    from photogram.errors import InputError
    from photogram.targets import convert_lens as fitted
    from photogram.targets.camera_formats import CAMERA_FORMATS
    from photogram.targets.drawing import plot_difference
    from photogram.targets.lens_fit import KNOTS

    source, known = _camera(job, path, camera)
    extent = fit.size or known
    if extent is None:
        raise misuse("--size", "no-size", file=path)
    with job.status("fitting the lens"):
        found = fitted(
            source,
            to,
            extent,
            radius=fit.radius,
            distances=fit.distances or (math.inf,),
            intrinsics_only=fit.intrinsics_only,
            knots=fit.knots or KNOTS,
        )
    files = {"difference.csv": found.to_csv()}
    for name, make in CAMERA_FORMATS.items() if documents.out is not None else ():
        with suppress(InputError):  # The format has no such lens
            files |= {f"{name}/{file}": content for file, content in make(found.rig()).items()}
    documents.conclude(
        job,
        found,
        files,
        plots=lambda: {"difference": plot_difference(found.difference)},
        tables=(),
        code=0 if tolerance is None or found.within(tolerance) else NOT_USABLE,
    )


def _camera(job: Job, path: Path, name: str | None) -> tuple[Camera, tuple[int, int] | None]:
    """Return a camera that counts from the centre of the first pixel, and its size."""
    from photogram.errors import InputError
    from photogram.formats import read
    from photogram.formats.targets import MIDDLE, shifted
    from photogram.targets.mrcal import read_lens

    if path.suffix == ".cameramodel":
        return read_lens(path)
    job.reads_inside(path)
    project = read(path)
    names = project.block.camera_names
    if name is None and len(names) != 1:
        raise misuse("--camera", "several", names=names)
    if name is not None and name not in names:
        raise InputError(phrase("command.no-camera", camera=name, names=names), file=path)
    row = 0 if name is None else names.index(name)
    return shifted(project.block.cameras[row], -MIDDLE), project.sizes[row]
