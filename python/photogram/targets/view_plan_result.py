"""Plan of board views, with the predicted uncertainty of the camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted
from photogram.show.methods import Documented
from photogram.summaries import Rows
from photogram.targets.maps import UncertaintyMap, distance_text
from photogram.targets.new_views import Candidate

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
        at = distance_text(self.distance, self.calibrated.calibration.board.unit)
        said = f"{counted(len(self.views), 'view')}: largest standard deviation {self.largest:.2g} px {at}"
        if not self.need:
            return said
        return f"{said}, {'as good as' if self.enough else 'above'} the {self.need:g} px that are needed"

    @property
    def sentences(self) -> list[str]:
        """Views in order, with the effect of each."""
        said, before = [], math.nan
        for each in self.views:
            brings = (
                f"largest {each.largest:.3g} px"
                if math.isnan(before)
                else f"largest {before:.3g} -> {each.largest:.3g} px"
            )
            said.append(each.candidate.name + ("" if math.isnan(each.largest) else f": {brings}"))
            before = each.largest
        return said

    @property
    def assumed(self) -> list[str]:
        """Assumptions of the plan, in sentences."""
        given = self.calibrated.calibration
        lens = given.cameras[0]
        (size,) = given.corners.sizes
        wide, high = size or (0, 0)
        return [
            f"Board: {given.board.described}; corners good to {given.sd0:g} px (--sd images=).",
            f"Camera: {wide} x {high} px, {lens.model} with a focal length of {lens.scale:.5g} px, each free"
            " parameter known to a tenth of the width of the picture.",
        ]

    @property
    def next(self) -> list[str]:
        """Next steps, in sentences."""
        given = self.calibrated.calibration
        board, own = given.board, "--board board.toml"
        if board.kind == "chessboard":
            own = f"--board {board.columns}x{board.rows} --spacing {board.pitch[0]:g}"
        found = []
        if not self.enough:
            found.append(
                f"Plan more views, a larger board, or nearer ones (--away): {len(self.views)} of these do not"
                f" reach {self.need:g} px."
            )
        return [
            *found,
            "Hold the board about so, still while each picture is taken, and take some views more than are"
            " planned: cross-validation needs them to test the lens, which a plan takes for right.",
            f"Calibrate with `photogram calibrate PHOTOGRAPHS {own} --sd images={given.sd0:g}`.",
        ]

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the plan."""
        return f"Plan of {self.headline}", [
            (f"{number}", said) for number, said in enumerate(self.sentences, 1)
        ]

    def document(self) -> Document:
        """Return the plan as a document (JSON members: `docs/json.md`)."""
        from photogram.targets.view_plan_document import document

        return document(self)
