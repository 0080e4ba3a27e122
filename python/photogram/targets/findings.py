"""What the verdict on a calibration rests on: its block, how the board was shown, what other views say.

Of the board: which parts of the picture it reached, how far away, how tilted.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted, listed
from photogram.network.knots import KNOTTED
from photogram.results.findings import block_findings
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Systematic
from photogram.statistics.verdict import LARGEST_FACTOR, verdict
from photogram.targets.calibration_result import Calibrated, UnknownWeight, Worth, deviation_of_corners
from photogram.targets.cross_validation import EXPLAINED, CrossValidation
from photogram.targets.first_camera import WIDEST, from_axis
from photogram.targets.picture_parts import PARTS, parts_of
from photogram.targets.vision import rays

TILTED, FEWEST = 15.0, 3
"""Degrees from which a view tells focal length and distance apart, and how many such views are enough."""
FARTHER = 1.3
"""How many times as far as the nearest the farthest view should be."""
NAMED = 6
"""Parts of the picture that a sentence names."""


@dataclass(frozen=True, eq=False)
class Showing:
    """How a board was shown to a camera."""

    camera: str  # Its name, and the unit of distances
    unit: str
    # How many of the 5 x 4 parts of its picture show anything through the lens, and the names of those
    # where no corner was; None where nobody knows the size of the picture
    parts: int
    empty: tuple[str, ...] | None
    distances: Floats  # (n,) of the middle of the board, in the views of the camera
    tilts: Floats  # (n,) of the board against the picture, degrees

    @property
    def sentence(self) -> str:
        """What was seen of the board, in a line."""
        near, far = (_rounded(each) for each in (self.distances.min(), self.distances.max()))
        flat, steep = (f"{each:.0f}" for each in (self.tilts.min(), self.tilts.max()))
        said = [f"{counted(len(self.distances), 'view')}, {near} to {far} {self.unit} away"]
        said.append(f"tilted by {flat} to {steep} degrees")
        if self.empty is not None:
            reached = self.parts - len(self.empty)
            nowhere = f", none in {listed(list(self.empty), NAMED)}" if self.empty else ""
            said.append(f"corners in {reached} of {self.parts} parts of the picture{nowhere}")
        return f"{self.camera}: {'; '.join(said)}"

    @property
    def next(self) -> list[str]:
        """Views that are missing, in sentences."""
        found = []
        if self.empty:
            where = listed(list(self.empty), NAMED)
            found.append(
                f"Take pictures with {self.camera} that show the board here: {where}. Where no corner was,"
                " the lens is not measured but continued."
            )
        if np.count_nonzero(self.tilts >= TILTED) < FEWEST:
            found.append(
                f"Tilt the board by 20 to 45 degrees before {self.camera}, about x and about y: seen from the"
                " front it cannot tell the focal length from its distance."
            )
        if self.distances.max() < FARTHER * self.distances.min():
            found.append(
                f"Show {self.camera} the board from nearer and from farther too: all views are from"
                f" {_rounded(np.median(self.distances))} {self.unit}, and what is nearer or farther is not"
                " tested."
            )
        return found


def _rounded(value: float) -> str:
    """Return a length in two figures."""
    return f"{float(f'{value:.2g}'):g}"


def showings(calibrated: Calibrated) -> list[Showing]:
    """Return how the board was shown to each camera that saw it."""
    corners, board = calibrated.calibration.corners, calibrated.calibration.board
    points = calibrated.points
    middle = [*(points.max(axis=0) + points.min(axis=0)) / 2, 1.0]
    # A picture whose corners were all taken out, or left out, shows nothing.
    shows = np.bincount(corners.picture[corners.use], minlength=len(corners.pictures)) > 0
    found = []
    for number, camera in enumerate(calibrated.cameras):
        views = np.unique(corners.views[shows & (corners.cameras == number)])
        if not len(views):
            continue
        poses = calibrated.sensors[number] @ calibrated.poses[views]
        distances = np.linalg.norm((poses @ middle)[:, :3], axis=1)
        tilts = np.degrees(np.arccos(np.clip(np.abs(poses[:, 2, 2]), 0.0, 1.0)))
        found.append(Showing(camera.name, board.unit, *_parts(calibrated, number), distances, tilts))
    return found


def _parts(calibrated: Calibrated, number: int) -> tuple[int, tuple[str, ...] | None]:
    """Return how many parts of a picture there are, and which no corner reached."""
    corners = calibrated.calibration.corners
    size = corners.sizes[number]
    if size is None:
        return 0, None
    own = corners.xy[corners.use & (corners.cameras[corners.picture] == number)]
    cells = np.clip(((own + 0.5) / size * PARTS).astype(int), 0, np.array(PARTS) - 1)
    reached = {(column, row) for column, row in cells.tolist()}
    places = list(parts_of(size))
    looks = rays(calibrated.cameras[number].camera, np.array([each.middle for each in places]))
    there = [each for each, ray in zip(places, looks, strict=True) if np.isfinite(ray).all()]
    return len(there), tuple(each.name.replace(",", "") for each in there if each.cell not in reached)


FREER = {"opencv8": 12, "opencv12": 16, KNOTTED: 10**6}
"""Lenses, and how many parameters of them are free."""


@findings_of.register(UnknownWeight)
def findings(result: UnknownWeight) -> Findings:
    """Return the tests of a block whose standard deviations of corners are ratios alone."""
    untested = "nobody has said how well corners are measured: --sd images=0.3"
    return replace(block_findings(result), untested=untested)


def judged(calibrated: Calibrated, worth: Worth | None = None) -> Calibrated:
    """Return a calibration whose parts all have the verdict on it, by what it is worth if that is known."""
    own = verdict(_findings(calibrated, worth))
    result, snooped = copy(calibrated.result), calibrated.snooped
    vars(result)["verdict"] = own
    if snooped is not None:
        snooped = replace(snooped, result=copy(snooped.result))
        vars(snooped.result)["verdict"] = own
    return replace(calibrated, result=result, snooped=snooped, worth=worth)


def _findings(calibrated: Calibrated, worth: Worth | None) -> Findings:
    """Return the tests of the block, with what is said of calibrations in the place of control."""
    found = findings_of(calibrated.result)
    shown = showings(calibrated)
    cross = () if worth is None else worth.cross
    wrong = [_systematic(each) for each in cross if not each.explained]
    stiff = bool(wrong) or any(each.significant for each in found.systematic)
    other = _other_model(calibrated) if stiff else []
    unknown = [_deviation_asked(calibrated)] if isinstance(calibrated.result, UnknownWeight) else []
    missing = [line for each in shown for line in each.next]
    agreeing = [f"{', '.join(each.cameras)}: {each.verdict}" for each in cross if each.explained]
    return replace(
        found,
        systematic=[*found.systematic, *wrong],
        remarks=[*(each.sentence for each in shown), *agreeing, *found.remarks],
        weigh="--shape points",
        calibrate="",
        if_usable=[*unknown, *other, *missing],
        if_withheld=[*unknown, *other, *missing],
    )


def _other_model(calibrated: Calibrated) -> list[str]:
    """Return what to try where the model is too stiff: lenses with more freedom, and a board with more."""
    corners = calibrated.calibration.corners
    free, wide = 0, False
    for number, each in enumerate(calibrated.cameras):
        free = max(free, len(each.estimated) if each.camera.knots is None else FREER[KNOTTED])
        seen = corners.xy[corners.use & (corners.cameras[corners.picture] == number)]
        wide = wide or (bool(len(seen)) and from_axis(each.camera, seen) >= WIDEST)
    lenses = [f"`{name}`" for name, count in FREER.items() if count > free and (name == KNOTTED or not wide)]
    tried = []
    if lenses:
        named = " or ".join(filter(None, (", ".join(lenses[:-1]), lenses[-1])))
        tried.append(f"a lens with more freedom, `--model {named[1:]}")
    if calibrated.calibration.shape != "points":
        tried.append("a board whose points are unknowns, `--shape points`")
    return [f"Try {', or '.join(tried)}: cross-validation says whether it is better."] if tried else []


def _deviation_asked(calibrated: Calibrated) -> str:
    """Ask for the standard deviation of corners, and say which one their residuals have."""
    sd = calibrated.calibration.assumed * deviation_of_corners(calibrated.result)
    return (
        f"Say how well corners are measured: their residuals are those of `--sd images={sd:.2g}`. Until then"
        " what is known of the board is weighed against these, and nothing tests them."
    )


def _systematic(cross: CrossValidation) -> Systematic:
    """Return the test that rejects: of the split that agrees least."""
    test = min((each[-1] for each in cross.tests), key=lambda each: each.probability)
    names = ", ".join(cross.cameras)
    return Systematic(
        name=f"cross-validation of {names}",
        sentence=f"{names}: {cross.verdict}",
        statistic="chi2",
        distribution="chi2",
        dof=(float(test.dof),),
        value=test.chi2,
        probability=test.probability,
        level=EXPLAINED / len(cross.tests),
        large=cross.factor > LARGEST_FACTOR,
    )
