"""`photogram calibrate --plan K`: which views of a board to take before there is a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from photogram.cli.calibration_input import Seen
from photogram.cli.console import print_sections
from photogram.cli.documents import Documents
from photogram.cli.job import Job
from photogram.cli.uncertainty import NOT_GOOD_ENOUGH, Uncertainty, distances_of
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.targets import Board, ViewPlan

__all__ = ["UNPLANNED", "Planned"]

OUT = Path("planned-views")
CORNER_SD = 0.3
"""Pixels, where --sd says none."""


@dataclass(frozen=True)
class Planned:
    """Whether and for which camera views are planned, with the options that say it."""

    plan_views: Annotated[
        int | None,
        typer.Option(
            "--plan",
            min=4,
            metavar="K",
            help="Plan up to K views of --board for a nominal camera of --size and --field, without PATH;"
            " fewer where --need is reached.",
            show_default=False,
        ),
    ] = None
    view_field: Annotated[
        float | None,
        typer.Option(
            "--field", metavar="DEG", help="With --plan: horizontal field of view.", show_default=False
        ),
    ] = None
    focal: Annotated[
        float | None,
        typer.Option(metavar="PX", help="With --plan, for --field: focal length.", show_default=False),
    ] = None
    away: Annotated[
        str | None,
        typer.Option(
            metavar="D,D,..",
            help="With --plan: distances of the board. Default: where it fills 0.9, 0.6 and 0.4 of the"
            " picture.",
            show_default=False,
        ),
    ] = None

    @property
    def asked(self) -> bool:
        """Whether views are to be planned."""
        if self.plan_views is None and self != UNPLANNED:
            raise typer.BadParameter("go with --plan", param_hint="--field, --focal, --away")
        return self.plan_views is not None

    def made(self, job: Job, seen: Seen, uncertainty: Uncertainty) -> ViewPlan:
        """Return the plan of views of a board for a nominal camera."""
        from photogram.targets import nominal_camera, plan_views

        for name in job.given:
            if name not in TAKEN.split():
                raise typer.BadParameter("goes without --plan", param_hint=name)
        size = seen.size_of_pictures
        if size is None or (self.view_field is None) == (self.focal is None):
            raise typer.BadParameter("needs --size, and --field or --focal", param_hint="--plan")
        more = {} if (knots := seen.knots_of_lens) is None else {"knots": knots}
        camera = nominal_camera(size, seen.model, field=self.view_field, focal=self.focal, **more)
        with job.status("planning views") as status:
            return plan_views(
                camera,
                _board(seen),
                size,
                uncertainty.distances,
                sd0=seen.sd0() or CORNER_SD,
                views=self.plan_views or 0,
                need=uncertainty.need or 0.0,
                away=distances_of(self.away, "--away"),
                progress=None if status is None else status.update,
            )

    def run(
        self, job: Job, seen: Seen, uncertainty: Uncertainty, documents: Documents, out: Path | None
    ) -> None:
        """Plan views, and write and tell the plan."""
        target = out or OUT
        pictures = documents.pictures(job, target)
        plan = self.made(job, seen, uncertainty)
        from photogram.show.methods import page_of
        from photogram.targets.view_plan_report import plan_drawings, plan_files, plan_sections

        files = {target / name: content for name, content in plan_files(plan).items()}
        page = documents.page(job, "calibrate", target, lambda: page_of(plan))
        job.finish(
            files | pictures.of_drawings(lambda: plan_drawings(plan)) | page,
            documents.as_json(plan),
            summary=lambda: print_sections(plan_sections(plan), "report.txt"),
            code=0 if plan.enough else NOT_GOOD_ENOUGH,
        )


UNPLANNED = Planned()
"""There are pictures."""
TAKEN = (
    "--plan --field --focal --away --board --spacing --unit --shape --size --model --knots --sd --distance"
    " --need --out --json --html --no-html --plots --plot-format --quiet"
)
"""Options that go with `--plan`."""


def _board(seen: Seen) -> Board:
    """Return the board of `--board`, as a file or in numbers."""
    from photogram.targets.board_files import read_board

    given = seen.given_board()
    if given is None:
        raise typer.BadParameter("needs --board", param_hint="--plan")
    board = read_board(given) if isinstance(given, Path) else given
    changes = {"unit": seen.unit, "shape": seen.shape and seen.shape.value}
    return board.replace(**{name: value for name, value in changes.items() if value})
