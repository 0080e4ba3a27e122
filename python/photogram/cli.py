"""The command line: `photogram giant`, `photogram simulate`.

Results go to files and standard output, errors and progress to standard error. Heavy modules are imported by
the commands that need them, so that `photogram --help` is quick.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from enum import StrEnum
from importlib.metadata import version as version_of
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from rich.status import Status

    from photogram import Block, Progress, Result
    from photogram.giant import Project
    from photogram.simulate import Simulation

__all__ = ["app", "main"]

INPUT_ERROR = 1
NOT_CONVERGED = 3
EXAMPLE = "galveston"
"""The packaged example, a directory of photogram.examples."""

app = typer.Typer(
    name="photogram",
    help="Photogrammetric least-squares adjustment with the covariance of every result.",
    epilog="Exit codes: 0 converged, 1 input or output at fault, 2 usage, 3 not converged or diverged.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
errors = Console(stderr=True, highlight=False, soft_wrap=True)
output = Console(highlight=False, soft_wrap=True)


class Ordering(StrEnum):
    """How the photographs are ordered in the normal equations."""

    AUTO = "auto"
    INPUT = "input"
    RCM = "rcm"


class Control(StrEnum):
    """Where the control of a simulated block is."""

    PERIMETER = "perimeter"
    CORNERS = "corners"
    NONE = "none"


class Ellipsoid(StrEnum):
    """The spheroid of a simulated block."""

    NONE = "none"
    CLARKE_1866 = "clarke1866"
    WGS84 = "wgs84"


def main() -> None:
    """Run the command line."""
    app()


@contextmanager
def _failures() -> Iterator[None]:
    """Turn errors of the input and of the adjustment into a message and an exit code."""
    from photogram.errors import AdjustmentError, PhotogramError

    try:
        yield
    except AdjustmentError as error:
        _fail(str(error), NOT_CONVERGED)
    except PhotogramError as error:
        _fail(str(error), INPUT_ERROR)
    except OSError as error:
        _fail(f"{error.filename}: {error.strerror}", INPUT_ERROR)


def _fail(text: str, code: int) -> None:
    errors.print(f"[bold red]error:[/] {escape(text)}")
    raise typer.Exit(code)


def _version(asked: bool) -> None:
    if asked:
        output.print(f"photogram {version_of('photogram')}")
        raise typer.Exit


@app.callback()
def _photogram(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Photogrammetric least-squares adjustment with the covariance of every result."""


@app.command()
def giant(
    directory: Annotated[
        Path | None,
        typer.Argument(
            metavar="DIR",
            help="Directory of COMMON, CAMERAS, IMAGES, FRAMES, GROUND (any letter case, any extension).",
            show_default=False,
        ),
    ] = None,
    example: Annotated[
        bool,
        typer.Option(
            "--example", help="Adjust the packaged example instead: 20 photographs at Galveston Bay."
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT",
            help="Directory for adjusted stations and points, and report. Default: DIR-adjusted beside DIR.",
            show_default=False,
        ),
    ] = None,
    json: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write the whole result as one JSON document.", show_default=False),
    ] = None,
    as_published: Annotated[
        bool,
        typer.Option(
            "--as-published", help="Stop by the percent criterion and the limit of iterations of COMMON."
        ),
    ] = False,
    ordering: Annotated[
        Ordering, typer.Option(help="Order of the photographs in the normal equations.")
    ] = Ordering.AUTO,
    threads: Annotated[
        int | None,
        typer.Option(
            min=1, help="Threads; the results do not depend on it. Default: all.", show_default=False
        ),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")] = False,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Allow OUT to be a directory with another GIANT project in it."),
    ] = False,
) -> None:
    """Adjust a GIANT project: photographs, points and their covariances.

    Writes FRAMES and GROUND (adjusted, when converged), RESTART (stations of the last iteration), report.txt.
    """
    if example == (directory is not None):
        raise typer.BadParameter("give a directory, or --example", param_hint="DIR")
    with _failures(), ExitStack() as resources:
        from photogram.giant import read_project
        from photogram.giant.files import write_whole
        from photogram.summary import summarize

        if directory is None:
            directory = resources.enter_context(as_file(files("photogram") / "examples" / EXAMPLE))
            out = out or Path(f"{EXAMPLE}-adjusted")
        out = _output_directory(directory, out, overwrite)
        project = read_project(directory)
        block = project.to_block()
        result = _adjust(project, block, as_published, ordering, threads, quiet)
        written = _result_files(project, block, result, out)
        if json is not None:
            written[json] = result.to_json()
        write_whole(written)
        if not quiet:
            summarize(result, output)
            output.print("written: " + escape(", ".join(str(path) for path in written)))
    if not result.converged:
        raise typer.Exit(NOT_CONVERGED)


def _output_directory(directory: Path, out: Path | None, overwrite: bool) -> Path:
    """Choose where results go: never over the input, and not over another project unless told."""
    from photogram.errors import InputError
    from photogram.giant.files import present_files

    if out is None:
        place = directory.resolve()
        # Published data are often read-only: then the results go where the command is given.
        parent = place.parent if os.access(place.parent, os.W_OK) else Path()
        return parent / f"{place.name}-adjusted"
    if out.exists() and not out.is_dir():
        raise InputError("is not a directory", file=out)
    if out.exists() and out.samefile(directory):
        raise InputError("the results would be written over the input", file=out)
    if out.exists() and not overwrite:
        inputs = [path.name for name in ("COMMON", "CAMERAS", "IMAGES") for path in present_files(out)[name]]
        if inputs:
            raise InputError(f"holds another project ({', '.join(inputs)}); --overwrite allows it", file=out)
    return out


def _adjust(
    project: Project, block: Block, as_published: bool, ordering: Ordering, threads: int | None, quiet: bool
) -> Result:
    """Adjust the block as COMMON asks, with the progress on standard error."""
    from photogram import AsPublished, adjust

    common = project.common
    with errors.status("reading", spinner="line") if not quiet else nullcontext() as status:
        result = adjust(
            block,
            unit_variance=common.unit_variance,
            ordering=ordering.value,
            as_published=AsPublished(common.convergence_percent, common.max_iterations)
            if as_published
            else None,
            fix_photos=common.intersection_only,
            progress=_progress(status) if status is not None else None,
            threads=threads,
        )
    return replace(result, messages=[*project.messages, *result.messages])


def _progress(status: Status) -> Callable[[Progress], None]:
    """Return a function that keeps the status line at the phase and the last iteration."""
    last = ""

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.iteration is not None:
            size = progress.iteration.weighted_sum_of_squares
            last = f"iteration {progress.iteration.number}: weighted sum of squares {size:.6g}; "
        elif progress.total:
            status.update(f"{last}{progress.phase} {100 * progress.done // progress.total} %")

    return show


def _result_files(project: Project, block: Block, result: Result, out: Path) -> dict[Path, bytes]:
    """Make everything that goes to the output directory, before anything is written."""
    from photogram.giant.export import adjusted_records
    from photogram.giant.files import to_bytes

    records = adjusted_records(
        project,
        block,
        photo_positions=result.photo_positions,
        photo_attitudes=result.photo_attitudes,
        point_positions=result.point_positions,
        converged=result.converged,
    )
    made = {out / name: to_bytes(lines) for name, lines in records.items()}
    return {**made, out / "report.txt": result.report().encode()}


@app.command()
def simulate(
    out: Annotated[
        Path, typer.Argument(metavar="OUT", help="Directory for the project; it is made if need be.")
    ],
    strips: Annotated[int, typer.Option(help="Number of strips.")] = 4,
    photos_per_strip: Annotated[int, typer.Option(help="Photographs in a strip.")] = 10,
    forward_overlap: Annotated[
        float, typer.Option(help="Of neighbouring photographs, as part of the frame.")
    ] = 0.6,
    side_overlap: Annotated[float, typer.Option(help="Of neighbouring strips, as part of the frame.")] = 0.3,
    principal_distance: Annotated[
        float, typer.Option(help="mm; negative for the positive plane, positive for the negative plane.")
    ] = -152.74,
    frame_size: Annotated[float, typer.Option(help="Side of the frame, mm.")] = 230.0,
    flying_height: Annotated[float, typer.Option(help="Above the mean terrain, m.")] = 4500.0,
    relief: Annotated[
        float, typer.Option(help="Largest height of the terrain above or below its mean, m.")
    ] = 150.0,
    points_per_photo: Annotated[
        float, typer.Option(help="Mean number of image points on a photograph.")
    ] = 100.0,
    crab: Annotated[float, typer.Option(help="Largest deviation of kappa from the heading, rad.")] = 0.03,
    tilt: Annotated[float, typer.Option(help="Largest omega and phi, rad.")] = 0.01,
    control: Annotated[Control, typer.Option(help="Where the control points are.")] = Control.PERIMETER,
    control_spacing: Annotated[int, typer.Option(help="Distance of perimeter control, in bases.")] = 4,
    control_sd: Annotated[float, typer.Option(help="Standard deviation of control, m.")] = 0.05,
    check_points: Annotated[int, typer.Option(help="Points with known positions that are not held.")] = 20,
    image_sd: Annotated[float, typer.Option(help="Standard deviation of image coordinates, mm.")] = 0.010,
    position_error: Annotated[
        float, typer.Option(help="Of the initial positions, standard deviation, m.")
    ] = 30.0,
    attitude_error: Annotated[
        float, typer.Option(help="Of the initial attitudes, standard deviation, rad.")
    ] = 0.01,
    position_sd: Annotated[
        float, typer.Option(help="That the files state for the initial positions, m; inf: the weak default.")
    ] = math.inf,
    attitude_sd: Annotated[
        float,
        typer.Option(help="That the files state for the initial attitudes, rad; inf: the weak default."),
    ] = math.inf,
    blunders: Annotated[int, typer.Option(help="Image points with a gross error.")] = 0,
    blunder_size: Annotated[float, typer.Option(help="Size of the gross errors, mm.")] = 0.2,
    spheroid: Annotated[
        Ellipsoid, typer.Option(help="Geographic space on this spheroid; none: rectangular.")
    ] = Ellipsoid.NONE,
    origin: Annotated[
        tuple[float, float, float],
        typer.Option(
            help="Centre of the block: X Y Z in m, or longitude and latitude in degrees and height in m."
        ),
    ] = (0.0, 0.0, 0.0),
    photo_to_ground: Annotated[
        bool,
        typer.Option("--photo-to-ground", help="Write photo-to-ground angles instead of ground-to-photo."),
    ] = False,
    seed: Annotated[int, typer.Option(min=0, help="Equal seeds give equal blocks.")] = 0,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace a project that is there already.")
    ] = False,
) -> None:
    """Write a simulated block as a GIANT project, and the truth behind it as truth.json.

    The GIANT files hold what would have been measured; truth.json holds the true positions and attitudes
    (rad) of the photographs, the true positions of the points, and the gross errors.
    """
    with _failures():
        from photogram.geometry import Spheroid
        from photogram.giant import Project
        from photogram.giant.files import write_whole
        from photogram.giant.project import project_files
        from photogram.simulate import simulate as make

        spheroids = {Ellipsoid.CLARKE_1866: Spheroid.clarke_1866, Ellipsoid.WGS84: Spheroid.wgs84}
        if spheroid in spheroids:
            origin = (math.radians(origin[0]), math.radians(origin[1]), origin[2])
        simulation = make(
            strips=strips,
            photos_per_strip=photos_per_strip,
            forward_overlap=forward_overlap,
            side_overlap=side_overlap,
            principal_distance=principal_distance,
            frame_size=frame_size,
            flying_height=flying_height,
            relief=relief,
            points_per_photo=points_per_photo,
            crab=crab,
            tilt=tilt,
            control=control.value,
            control_spacing=control_spacing,
            control_sd=control_sd,
            check_points=check_points,
            image_sd=image_sd,
            position_error=position_error,
            attitude_error=attitude_error,
            position_sd=position_sd,
            attitude_sd=attitude_sd,
            blunders=blunders,
            blunder_size=blunder_size,
            spheroid=spheroids[spheroid]() if spheroid in spheroids else None,
            origin=origin,
            photo_to_ground=photo_to_ground,
            seed=seed,
        )
        project = Project.from_block(simulation.block)
        written = {**project_files(project, out, overwrite=overwrite), out / "truth.json": _truth(simulation)}
        write_whole(written)
        for message in project.messages:
            errors.print(f"[yellow]remark:[/] {escape(str(message))}")
        block = simulation.block
        output.print(
            f"{escape(str(out))}: {len(block.photo_ids)} photographs, {len(block.point_ids)} points,"
            f" {len(block.image_xy)} image points"
        )


def _truth(simulation: Simulation) -> bytes:
    """Make the document of what is true in a simulated block."""
    import numpy as np
    import orjson

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
        "blunders": [
            {
                "photo": truth.photo_ids[truth.image_photos[row]],
                "point": truth.point_ids[truth.image_points[row]],
                "error_mm": amount,
            }
            for row, amount in zip(blunders.images.tolist(), blunders.amounts.tolist(), strict=True)
        ],
    }
    return orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE)


if __name__ == "__main__":
    main()
