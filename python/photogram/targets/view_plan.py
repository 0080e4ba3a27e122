"""Planning of board views before images exist, by their effect on a nominal camera."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from photogram.adjustment.adjustment import adjust
from photogram.arguments.arrays import argument_error, whole_number
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.attitudes import Attitudes
from photogram.network.cameras import Camera
from photogram.network.point_sets import hull
from photogram.show.methods import Documented
from photogram.show.page import Document, Drawing, Judgement, Layers, Section, Tone
from photogram.show.quantity import Axis, Quantity, Table, column, members, of_each
from photogram.show.sketch.marks import Mark, Markers, Panel, Polygons, boxes
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, FAINT, VERMILION
from photogram.summaries import Rows
from photogram.targets.board import Board
from photogram.targets.calibration import Calibration
from photogram.targets.calibration_result import Calibrated
from photogram.targets.corners import Corners
from photogram.targets.cross_validation import Worth, median_distance
from photogram.targets.drawing import in_pixels
from photogram.targets.first_calibration import weakly_known
from photogram.targets.new_views import (
    GRID,
    TILTS,
    Candidate,
    NewView,
    effects_of,
    shown_of,
    suggest_views,
    views_over_picture,
    views_towards,
)
from photogram.targets.page import drawings, worth_facts, worth_members
from photogram.targets.regularisation import weighted_block
from photogram.targets.uncertainty import UncertaintyMap, at_distance, checked_distance, uncertainty_map
from photogram.targets.vision import rays, transformed
from photogram.words import phrase

BOARD_OF_PICTURE = (0.9, 0.6, 0.4)  # ratio of the longer side of the board and the shorter side of the image
FIRST_TILTS = tuple(name for name in TILTS if name)
MODEL = "planned: the lens is taken for one of this model"  # in titles of maps


def plan_views(
    camera: Camera,
    board: Board,
    size: tuple[int, int],
    distances: Sequence[float] = (),
    *,
    sd0: float = 0.3,
    views: int = 12,
    need: float = 0.0,
    away: Sequence[float] = (),
    progress: Callable[[str], None] | None = None,
) -> ViewPlan:
    """Plan views of a board that calibrate a camera, and predict its uncertainty.

    Images are not needed. The first four views show the board in the image centre, tilted to all sides. Each
    further view minimises the largest standard deviation over the image, in the datum `corners`.

    Parameters
    ----------
    camera
        Nominal camera (:func:`nominal_camera`, or a similar calibrated one). Its free parameters are the
        unknowns of the calibration.
    board, size
        The board, and image width and height.
    distances
        Distances of maps, in the unit of the board; views are chosen for the first. None: infinity, and the
        median distance of the views.
    sd0
        Standard deviation of a corner, pixels.
    views
        Maximum number of views.
    need
        Required standard deviation over the image, pixels, at which planning stops.
    away
        Possible board distances, in its unit. None: its longer side covers 0.9, 0.6 and 0.4 of the shorter
        image side.
    progress
        Called with the current step.

    Raises
    ------
    InputError
        If there are fewer than four views, if values are invalid, or if the board is not visible in an image.
    """
    if whole_number("views", views) < len(FIRST_TILTS):
        raise argument_error("views", "least", low=len(FIRST_TILTS), value=views)
    for each in (*distances, *away):
        checked_distance(each)
    report = progress or (lambda _: None)
    board = board.replace(shape=board.shape_of(views))
    centre = (np.array(size) - 1) / 2
    middle, beside = rays(camera, np.stack([centre, centre + np.array([1.0, 0.0])]))
    pixels = float(np.ptp(board.places, axis=0).max() / np.linalg.norm(beside - middle))  # times distance
    held = sorted(away or [pixels / (share * min(size)) for share in BOARD_OF_PICTURE])
    first = [held[len(held) // 2]]
    taken = views_towards(middle, "middle of the picture", board, first, FIRST_TILTS, [""])
    candidates = views_over_picture(camera, size, board, held, whole=board.found_whole)
    worst, sds = (distances or (math.inf,))[0], [np.array([math.nan])] * (len(FIRST_TILTS) - 1)
    known = weakly_known(camera, size)
    while True:
        found = _predicted(known, board, size, sd0, taken)
        sd = uncertainty_map(found, 0, worst, GRID).sd
        sds.append(sd[np.isfinite(sd)])
        largest = float(sds[-1].max())
        report(f"view {len(taken)}: largest standard deviation {largest:.3g} px")
        if len(taken) >= views or largest <= need:
            break
        taken.append(suggest_views(found, worst, candidates).views[0].candidate)
    maps = [
        uncertainty_map(found, 0, each, model=MODEL)
        for each in distances or (worst, median_distance(found, 0))
    ]
    corners = np.bincount(found.calibration.corners.picture)[:, np.newaxis]
    return ViewPlan(
        calibrated=found.with_worth(Worth(maps=tuple(maps))),
        views=tuple(map(NewView, taken, corners, sds)),
        distance=worst,
        need=need,
    )


def _predicted(
    camera: Camera, board: Board, size: tuple[int, int], sd0: float, views: Sequence[Candidate]
) -> Calibrated:
    shown = [shown_of(camera, np.array(size), transformed(each.pose, board.places)) for each in views]
    for each, (points, _) in zip(views, shown, strict=True):
        if not len(points):
            raise InputError(phrase("targets.not-shown", name=each.name))
    count = len(views)
    corners = Corners(
        pictures=[f"view {number}" for number in range(1, count + 1)],
        cameras=np.zeros(count, dtype=np.int64),
        views=np.arange(count),
        camera_names=["camera"],
        sizes=[size],
        picture=np.repeat(np.arange(count), [len(points) for points, _ in shown]),
        point=np.concatenate([points for points, _ in shown]),
        xy=np.concatenate([xy for _, xy in shown]),
    )
    poses = np.array([each.pose for each in views])
    start = Calibration(board=board, corners=corners, cameras=[camera], poses=poses, sd0=sd0)
    result = adjust(weighted_block(start), unit_variance="unity", covariance="verdict")
    return Calibrated.of(result, start)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ViewPlan(Documented):
    """Planned views of a board for the calibration of a camera.

    Attributes
    ----------
    calibrated
        Predicted calibration with error-free corners. Its `calibration` has the corners and poses, its
        `worth` the maps. Covariances are a priori, residuals are meaningless.
    views
        Views in order of benefit; the first three have no map.
    distance
        Distance of the map used for the choice, in the unit of the board; infinite: directions.
    need
        Required standard deviation over the image, pixels; 0: no requirement.
    """

    calibrated: Calibrated
    views: tuple[NewView, ...]
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
        return effects_of(self.views, math.nan)

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
        calibration, worth = self.calibrated.calibration, self.calibrated.worth
        assert worth is not None
        tone: Tone = "good" if self.need and self.enough else "" if self.enough else "bad"
        views = Drawing("planned-views", "Views", CAPTION, partial(plot_planned_views, self))
        camera, nominal = self.calibrated.cameras[0], calibration.cameras[0]
        free = camera.estimated
        names = np.array(camera.names, dtype=object)[free]
        parameters = [
            Quantity(names, (), "name", member="name", head="Parameter"),
            Quantity(nominal.values[free], member="nominal", head="Nominal", figures=6),
            Quantity(camera.sd[free], member="sd", head="Standard deviation", figures=2),
        ]
        maps = Layers("uncertainty", [views, *drawings(worth)])
        return Document(
            what="Plan of views of a board",
            title="",
            judgements=[Judgement("Plan", self.headline, [PREDICTED, *self.assumed], tone)],
            advice=self.next,
            highlights=worth_facts(worth),
            sections=[
                Section.of(_views(self)),
                Section("uncertainty", "Uncertainty of projection", [maps]),
                Section.of(Table("parameters", "Camera", parameters)),
            ],
            members={
                "board": calibration.board.described,
                "size": calibration.corners.sizes[0],
                "model": nominal.model,
                "sd_of_corners": calibration.sd0,
                "need": self.need or None,
                **members(self, "distance", "enough", "largest"),
                "maps": worth_members(worth)["maps"],
            },
        )


CAPTION = "Where the corners of the board are in each picture; red: its point 0."
PREDICTED = "This is a plan: the standard deviations follow from the planned board poses only."


def _views(plan: ViewPlan) -> Table:
    poses = np.array([view.candidate.pose for view in plan.views])
    turns = Attitudes.of("matrix_to_vision", poses[:, :3, :3]).values("rotation_vector_to_vision")
    unit, pixels = plan.calibrated.calibration.board.unit, (Axis.of("px", "px"),)
    columns = [
        Quantity(np.arange(1, len(poses) + 1), name="view", member="view", head="View"),
        of_each(plan.views, "candidate.name", (), "name", name="board", member="board", head="Board"),
        column("corners", np.concatenate([each.corners for each in plan.views]), "Corners"),
        of_each(
            plan.views, "largest", pixels, "value", name="largest_px", member="largest_px", head="Largest"
        ),
        Quantity(turns, tuple(Axis.of(f"r{axis}", "") for axis in "xyz"), name=""),
        Quantity(poses[:, :3, 3], tuple(Axis.of(f"t{axis}", unit) for axis in "xyz"), "value", ""),
        Quantity(poses, member="pose"),
    ]
    about = "Largest is the largest standard deviation over the picture with this view and those before it."
    return Table("views", "Views to take", columns, about=about)


PANELS_PER_ROW, PANEL_INCHES = 4, 2.2


def plot_planned_views(plan: ViewPlan) -> Plot:
    """Plot the corners of the planned board views in the image, with point 0 in red.

    Parameters
    ----------
    plan
        Plan of views.
    """
    corners = plan.calibrated.calibration.corners
    (size,) = corners.sizes
    assert size is not None
    rows = -(-len(plan.views) // PANELS_PER_ROW)
    panels = list[Panel]()
    for number in range(len(plan.views)):
        own = corners.xy[corners.picture == number]
        panel = in_pixels(size)
        marks: list[Mark] = [
            Polygons(boxes(panel.limits[:1], panel.limits[1:]), "white", 1.0, FAINT, 1.0, 1.6),
            Polygons(hull(own)[np.newaxis], FAINT, 0.5, BLUE, 0.5, 1.0),
            Markers(own, ".", 2.5, BLUE),
        ]
        if corners.point[corners.picture == number][0] == 0:
            marks.append(Markers(own[:1], "o", 5.0, VERMILION))
        panels.append(replace(panel, marks=marks, title=f"{number + 1}", across="", up="", bare=True))
    every = [*panels, *[None] * (rows * PANELS_PER_ROW - len(panels))]
    return Plot(
        PANEL_INCHES * PANELS_PER_ROW, rows * (0.3 + PANEL_INCHES * size[1] / size[0]), every, PANELS_PER_ROW
    )
