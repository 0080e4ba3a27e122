"""`photogram convert-lens`: the lens of another model that shows what a camera shows."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.console import output
from photogram.cli.job import Job, OutputFolder, Reads, with_job
from photogram.cli.options import JsonFile, Plots, Quiet, out_option, pair
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.network.cameras import Camera
    from photogram.targets import Conversion

BEYOND_TOLERANCE = 4
"""The exit code of a difference that is larger than asked."""


@dataclass(frozen=True)
class Fit:
    """How a lens is fitted, with the options that say it."""

    radius: Annotated[
        float,
        typer.Option(
            min=1.0,
            metavar="PX",
            help="Pixels farther from the middle do not count. Default: all count.",
            show_default=False,
        ),
    ] = math.inf
    distances: Annotated[
        str,
        typer.Option(
            "--distance",
            metavar="D,...",
            help="Where both are compared, m: inf fits a rotation of the axes, 1,100 a translation too.",
        ),
    ] = "inf"
    intrinsics_only: Annotated[
        bool, typer.Option("--intrinsics-only", help="The axes of the camera stay where they are.")
    ] = False
    knot_grid: Annotated[
        str,
        typer.Option(
            "--knots", metavar="NXxNY", help="Of --to splined_stereographic: along columns and rows."
        ),
    ] = "30x20"

    def converted(self, camera: Camera, to: str, size: tuple[int, int]) -> Conversion:
        """Fit the lens."""
        from photogram.targets import convert_lens

        try:
            distances = [float(each) for each in self.distances.split(",")]
        except ValueError:
            raise typer.BadParameter("is numbers with commas between them", param_hint="--distance") from None
        return convert_lens(
            camera,
            to,
            size,
            radius=self.radius,
            distances=distances,
            intrinsics_only=self.intrinsics_only,
            knots=pair(self.knot_grid, "--knots"),
        )


@with_job
def convert_lens(
    job: Job,
    *,
    path: Annotated[
        Path,
        Reads.FILE,
        typer.Argument(
            metavar="IN",
            help="A camera: a .cameramodel of mrcal, or any project; a calibration with its covariances.",
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help="opencv4, opencv5, opencv8, opencv12, opencv_fisheye, splined_stereographic, or another"
            " model of docs/cameras.md.",
        ),
    ],
    camera: Annotated[
        str | None, typer.Option(metavar="NAME", help="Which camera, where there are several.")
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(metavar="WxH", help="Width and height of the pictures, where no file says it."),
    ] = None,
    fit: Fit,
    tolerance: Annotated[
        float | None, typer.Option(metavar="PX", help="Exit code 4 where a difference is larger.")
    ] = None,
    out: Annotated[
        OutputFolder,
        out_option("Directory for the report, differences, and the camera in the formats that can hold it."),
    ] = None,
    json: JsonFile = None,
    plots: Plots = False,
    quiet: Quiet = False,
) -> None:
    """Fit a lens of another model to what a camera shows, and say what it misses.

    Over 60 x 40 pixels: rms and largest difference, where it is, and the motion of the axes. Where the camera
    has covariances the new one has them too.
    """
    from photogram.show.forms import summary

    if plots and out is None:
        raise typer.BadParameter("goes with --out DIR", param_hint="--plots")
    with job:
        source, known = _camera(job, path, camera)
        extent = known if size is None else pair(size, "--size")
        if extent is None:
            raise typer.BadParameter(f"is needed: {path} does not say it", param_hint="--size")
        with job.status("fitting the lens"):
            found = fit.converted(source, to, extent)
        job.finish(
            {} if out is None else {out / name: content for name, content in _files(found, plots).items()},
            {} if json is None else {json: found.to_json()},
            summary=lambda: output.print("\n".join(summary(found.document())), markup=False),
            code=0 if tolerance is None or found.within(tolerance) else BEYOND_TOLERANCE,
        )


def _camera(job: Job, path: Path, name: str | None) -> tuple[Camera, tuple[int, int] | None]:
    """Read a camera whose pixels count from the centre of the first, and the size of its pictures."""
    from photogram.errors import InputError
    from photogram.formats import read
    from photogram.formats.targets.calibrations import MIDDLE, shifted
    from photogram.targets.mrcal_model import read_lens

    if path.suffix == ".cameramodel":
        return read_lens(path)
    job.reads_inside(path)
    project = read(path)
    names = project.block.camera_names
    if name is None and len(names) != 1:
        raise typer.BadParameter(f"is one of {', '.join(names)}", param_hint="--camera")
    if name is not None and name not in names:
        raise InputError(f"there is no camera {name}, but {', '.join(names)}", file=path)
    row = 0 if name is None else names.index(name)
    return shifted(project.block.cameras[row], -MIDDLE), project.sizes[row]


def _files(found: Conversion, plots: bool) -> dict[str, bytes]:
    """Make what goes to the directory: the camera in each format that can hold it."""
    from photogram.errors import InputError
    from photogram.targets.drawing import plot_difference
    from photogram.targets.output.formats import CAMERA_FORMATS

    files = {"report.txt": found.report().encode(), "difference.csv": found.to_csv()}
    for name, make in CAMERA_FORMATS.items():
        try:
            files |= {f"{name}/{file}": content for file, content in make(found.rig()).items()}
        except InputError:
            continue
    if plots:
        files["difference.png"] = plot_difference(found.difference).render("png")
    return files
