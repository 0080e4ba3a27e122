"""Plan of board views, with the predicted uncertainty of the camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Documented
from photogram.summaries import Rows
from photogram.targets.maps import UncertaintyMap, at_distance
from photogram.targets.new_views import Candidate
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.targets import Calibrated


@dataclass(frozen=True, eq=False)
class PlannedView:
    """Planned view of the board.

    Attributes
    ----------
    candidate
        Board position in words, and its pose: board -> camera.
    corners
        Number of corners in the image.
    largest
        Largest standard deviation over the image with this view and the previous ones, pixels; NaN for the
        first three.
    """

    candidate: Candidate
    corners: int
    largest: float


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ViewPlan(Documented):
    """Planned views of a board for the calibration of a camera.

    Attributes
    ----------
    calibrated
        Predicted calibration with error-free corners. Its `calibration` has the corners and poses, its
        `worth` the maps. Covariances are a priori, residuals are meaningless.
    views
        Views in order of benefit.
    distance
        Distance of the map used for the choice, in the unit of the board; infinite: directions.
    need
        Required standard deviation over the image, pixels; 0: no requirement.
    """

    calibrated: Calibrated
    views: tuple[PlannedView, ...]
    distance: float
    need: float

    @property
    def maps(self) -> tuple[UncertaintyMap, ...]:
        """Predicted uncertainty maps."""
        worth = self.calibrated.worth
        return () if worth is None else worth.maps

    @property
    def largest(self) -> float:
        """Largest standard deviation over the image after all views, pixels."""
        return self.views[-1].largest

    @property
    def enough(self) -> bool:
        """Whether the views meet the requirement."""
        return not self.need or self.largest <= self.need

    @property
    def headline(self) -> str:
        """Predicted accuracy in one sentence."""
        at = at_distance(self.distance, self.calibrated.calibration.board.unit)
        code = f"plan.{'views' if not self.need else 'enough' if self.enough else 'few'}"
        return str(phrase(code, n=len(self.views), largest=self.largest, at=at, need=float(self.need or 0)))

    @property
    def sentences(self) -> list[str]:
        """Views in order, with the effect of each."""
        said, before = [], math.nan
        for each in self.views:
            code = "smaller" if math.isfinite(before) else "first"
            code = "unknown" if math.isnan(each.largest) else code
            sizes = {"before": before, "largest": each.largest}
            said.append(str(phrase(f"views.{code}", view=each.candidate.name, **sizes)))
            before = each.largest
        return said

    @property
    def assumed(self) -> list[str]:
        """Assumptions of the plan, in sentences."""
        given = self.calibrated.calibration
        lens = given.cameras[0]
        (size,) = given.corners.sizes
        wide, high = size or (0, 0)
        camera = {"width": wide, "height": high, "model": lens.model, "focal": float(lens.scale)}
        return [
            str(phrase("plan.board", board=given.board.described, sd=given.sd0)),
            str(phrase("plan.camera", **camera)),
        ]

    @property
    def next(self) -> list[str]:
        """Next steps, in sentences."""
        given = self.calibrated.calibration
        board, chess = given.board, given.board.kind == "chessboard"
        sizes = {"columns": board.columns, "rows": board.rows, "spacing": float(board.pitch[0])}
        found = [] if self.enough else [phrase("plan.more", n=len(self.views), need=float(self.need or 0))]
        command = phrase(f"plan.calibrate.{'chessboard' if chess else 'board'}", **sizes, sd=given.sd0)
        return [*map(str, (*found, phrase("plan.hold"), command))]

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the plan."""
        return f"Plan of {self.headline}", [
            (f"{number}", said) for number, said in enumerate(self.sentences, 1)
        ]

    def document(self) -> Document:
        """Return the plan as a document (JSON members: `docs/json.md`)."""
        from photogram.targets.view_plan_document import document

        return document(self)
