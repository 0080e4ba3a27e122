"""`photogram absolute-orientation relative`: models of pairs of photos, joined to a strip."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from photogram.cli.console import print_sections
from photogram.cli.job import Job, Reads, Writes, with_job
from photogram.cli.options import Quiet
from photogram.cli.projects import NOTHING, Additions, Example, project_path, read_project, with_additions

__all__ = ["relative"]

NOT_CONVERGED, NOT_USABLE = 3, 4


@with_job
@with_additions()
def relative(
    job: Job,
    path: Annotated[
        Path | None,
        Reads.FILE,
        typer.Argument(metavar="PATH", help="A project: a folder or file.", show_default=False),
    ] = None,
    out: Annotated[
        Path | None,
        Writes.FILE,
        typer.Argument(
            metavar="OUT", help="CSV id,X,Y,Z,x,y,z: stations to be oriented.", show_default=False
        ),
    ] = None,
    example: Example = False,
    photos: Annotated[
        str | None,
        typer.Option(
            metavar="A,B,...", help="Photos in the order of the strip. Default: all.", show_default=False
        ),
    ] = None,
    added: Additions = NOTHING,
    quiet: Quiet = False,
) -> None:
    """Orient pairs of photos relatively, and join their models to a strip.

    Each pair of neighbours is adjusted by its common points in a minimum datum; models are joined by
    similarities over common points and the projection centre that both have. The control of the project
    stands beside its points. Exit code 3: a model that has not converged, 4: one that
    nothing checks.
    """
    assert out is not None
    with job:
        import numpy as np

        from photogram.absolute_orientation.models import strip_of
        from photogram.formats.reduced_coordinates import given_control
        from photogram.io.csv_text import csv_text

        project = read_project(job, project_path(job, path), added)
        names = project.block.photo_ids if photos is None else [each.strip() for each in photos.split(",")]
        strip = strip_of(project.block, names)
        control = given_control(project)
        unknown = np.full(3, np.nan), np.zeros(3, dtype=bool)
        ground = [
            np.where(held, at, np.nan) for at, held in (control.get(each, unknown) for each in strip.ids)
        ]
        columns = {"id": list(strip.ids)} | dict(zip("XYZ", np.array(ground).T, strict=True))
        columns |= dict(zip("xyz", strip.positions.T, strict=True))
        models = [
            f"{' '.join(each.result.block.photo_ids)}: {len(each.ids) - 2} points, {each.result.status},"
            f" weighted sum of squares {each.result.sums_of_squares.total:.4g},"
            f" {each.result.degrees_of_freedom} degrees of freedom"
            for each in strip.models
        ]
        joints = [f"after {names[k + 1]}: rms {rms:.3g}" for k, rms in enumerate(strip.rms)]
        sections = [
            ("Models", models),
            ("Joints, in bases of the first model", joints or ["none: one model"]),
        ]
        if strip.unchecked:
            text = f"nothing checks the models {', '.join(strip.unchecked)}: five points have no residuals"
            sections.insert(0, ("Not to be used as it is", [text]))
        job.finish(
            {out: csv_text(columns)},
            summary=lambda: print_sections(sections, "OUT"),
            code=NOT_USABLE if strip.unchecked else 0 if strip.converged else NOT_CONVERGED,
        )
