"""Findings for the verdict: block, views of the board, cross-validation.

Views of the board are described by covered image parts, distance and tilt.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.network.passages import KNOTTED
from photogram.results.result import Result
from photogram.statistics.findings import Findings, Systematic
from photogram.statistics.weight_rules import LARGEST_FACTOR
from photogram.targets.calibration_difference import MIN_PROBABILITY
from photogram.targets.first_camera import WIDEST, from_axis
from photogram.targets.housing import middle_of
from photogram.targets.uncertainty import PARTS, at_distance, parts_of
from photogram.targets.vision import rays
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.targets import Calibrated, CrossValidation

MIN_TILT_DEG, MIN_TILTED_VIEWS = 15.0, 3  # separate focal length and distance
MIN_DISTANCE_RATIO = 1.3  # ratio of farthest and nearest view


@dataclass(frozen=True, eq=False)
class Showing:
    camera: str  # Camera name, and the unit of distances
    unit: str
    # Number of the 5 x 4 image parts visible through the lens, and names of those without corners; None if
    # the image size is unknown
    parts: int
    empty: tuple[str, ...] | None
    distances: Floats  # (n,) of the board centre, in the views of the camera
    tilts: Floats  # (n,) of the board relative to the image plane, degrees

    @property
    def line(self) -> Phrase:
        fields: dict[str, Any] = {"camera": self.camera, "n": len(self.distances), "unit": self.unit}
        fields |= {"near": _rounded(self.distances.min()), "far": _rounded(self.distances.max())}
        fields |= {"flat": float(self.tilts.min()), "steep": float(self.tilts.max()), "corners": ""}
        if self.empty is not None:
            parts = {"reached": self.parts - len(self.empty), "all": self.parts, "empty": list(self.empty)}
            fields["corners"] = Phrase(f"part.corners{'.but' if self.empty else ''}", parts)
        return Phrase("line.board", fields)

    @property
    def next(self) -> list[Phrase]:
        advice = []
        if self.empty:
            advice.append(phrase("advice.board-parts", camera=self.camera, parts=list(self.empty)))
        if np.count_nonzero(self.tilts >= MIN_TILT_DEG) < MIN_TILTED_VIEWS:
            advice.append(phrase("advice.tilt", camera=self.camera))
        if self.distances.max() < MIN_DISTANCE_RATIO * self.distances.min():
            distance = _rounded(np.median(self.distances))
            fields = {"camera": self.camera, "distance": distance, "unit": self.unit}
            advice.append(phrase("advice.distances", **fields))
        return advice


def _rounded(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def showings(calibrated: Calibrated) -> list[Showing]:
    corners, board = calibrated.calibration.corners, calibrated.calibration.board
    middle = [*middle_of(calibrated.points), 1.0]
    # Images whose corners were all removed or excluded are not counted.
    shows = np.bincount(corners.picture[corners.use], minlength=len(corners.pictures)) > 0
    found = []
    for number, camera in enumerate(calibrated.cameras):
        views = np.unique(corners.views[shows & (corners.cameras == number)])
        if not len(views):
            continue
        poses = calibrated.sensors[number] @ calibrated.poses[views]
        distances = np.linalg.norm((poses @ middle)[:, :3], axis=1)
        tilts = np.degrees(np.arccos(np.clip(np.abs(poses[:, 2, 2]), 0.0, 1.0)))
        parts, empty, size = 0, None, corners.sizes[number]
        if size is not None:
            own = corners.xy[corners.use & (corners.cameras[corners.picture] == number)]
            cells = np.clip(((own + 0.5) / size * PARTS).astype(int), 0, np.array(PARTS) - 1)
            reached = {(column, row) for column, row in cells.tolist()}
            places = list(parts_of(size))
            looks = rays(camera.camera, np.array([each.middle for each in places]))
            there = [each for each, ray in zip(places, looks, strict=True) if np.isfinite(ray).all()]
            parts = len(there)
            empty = tuple(each.name.replace(",", "") for each in there if each.cell not in reached)
        found.append(Showing(camera.name, board.unit, parts, empty, distances, tilts))
    return found


FREE_PARAMETERS_OF_LENS = {"opencv8": 12, "opencv12": 16, KNOTTED: 10**6}


def calibration_findings(calibrated: Calibrated, found: Findings) -> Findings:
    """Return the findings of a block with those of its board, views and assessment."""
    worth, need, shortfall = calibrated.worth, calibrated.need, found.shortfall
    if worth is not None and need is not None and not worth.largest <= need:
        worst = max(worth.maps, key=lambda found: found.largest)
        distance = at_distance(worst.distance, worst.unit)
        fields = {"camera": worst.camera, "sd": worst.largest, "distance": distance, "need": need}
        shortfall = phrase("verdict.not-accurate-enough", **fields)
    shown = showings(calibrated)
    cross = () if worth is None else worth.cross
    wrong = [_systematic(each) for each in cross if not each.explained]
    stiff = bool(wrong) or any(each.significant for each in found.systematic)
    other = _other_model(calibrated) if stiff else []
    unknown, untested = [], found.untested
    if not calibrated.known_weight:
        sd = calibrated.calibration.assumed * deviation_of_corners(calibrated)
        unknown, untested = [phrase("advice.corner-sd", sd=float(sd))], phrase("untested.corners")
    missing = [line for each in shown for line in each.next]
    agreeing = [f"{', '.join(each.cameras)}: {each.verdict}" for each in cross if each.explained]
    return replace(
        found,
        shortfall=shortfall,
        untested=untested,
        systematic=[*found.systematic, *wrong],
        remarks=[*(each.line for each in shown), *agreeing, *found.remarks],
        weigh=phrase("how.board"),
        calibrate=None,
        if_usable=[*unknown, *other, *missing],
        if_withheld=[*unknown, *other, *missing],
    )


def _other_model(calibrated: Calibrated) -> list[Phrase]:
    corners = calibrated.calibration.corners
    free, wide = 0, False
    for number, each in enumerate(calibrated.cameras):
        free = max(
            free, len(each.estimated) if each.camera.knots is None else FREE_PARAMETERS_OF_LENS[KNOTTED]
        )
        seen = corners.xy[corners.use & (corners.cameras[corners.picture] == number)]
        wide = wide or (bool(len(seen)) and from_axis(each.camera, seen) >= WIDEST)
    lenses = [
        name
        for name, count in FREE_PARAMETERS_OF_LENS.items()
        if count > free and (name == KNOTTED or not wide)
    ]
    ways = [phrase("part.free-lens", models=lenses)] if lenses else []
    if calibrated.calibration.shape != "points":
        ways.append(phrase("part.free-board", how=phrase("how.board")))
    return [phrase("advice.try", ways=ways)] if ways else []


def _systematic(cross: CrossValidation) -> Systematic:
    test = min((each[-1] for each in cross.tests), key=lambda each: each.probability)
    names = ", ".join(cross.cameras)
    return Systematic(
        kind=f"cross-validation of {names}",
        sentence=f"{names}: {cross.verdict}",
        statistic="chi2",
        distribution="chi2",
        dof=(float(test.dof),),
        value=test.chi2,
        probability=test.probability,
        level=MIN_PROBABILITY / len(cross.tests),
        large=cross.factor > LARGEST_FACTOR,
    )


def deviation_of_corners(result: Result) -> float:
    """Return the ratio of the corner sd from residuals to the given one."""
    used = result.used_images
    weighted = (result.residuals[used] / result.image_given_sd[used]) ** 2
    return float(np.sqrt(weighted.sum() / np.nansum(result.redundancy[used])))
