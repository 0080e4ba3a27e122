"""How a board was shown to a camera: which parts of the picture it reached, how far away, how tilted."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats
from photogram.lazy_dataclasses import dataclass
from photogram.messages import counted, listed
from photogram.targets.calibration_result import Calibrated
from photogram.targets.imaging import rays
from photogram.targets.picture_parts import PARTS, parts_of

__all__ = ["Showing", "showings"]

TILTED, FEWEST = 15.0, 3
"""Degrees from which a view tells focal length and distance apart, and how many such views are enough."""
FARTHER = 1.3
"""How many times as far as the nearest the farthest view should be."""
NAMED = 6
"""Parts of the picture that a sentence names."""


@dataclass(frozen=True, eq=False)
class Showing:
    """How a board was shown to a camera.

    Attributes
    ----------
    camera, unit
        Its name, and the unit of distances.
    parts, empty
        How many of the 5 x 4 parts of its picture show anything through the lens, and the names of those
        where no corner was; None where nobody knows the size of the picture.
    distances
        (n,) of the middle of the board, in the views of the camera.
    tilts
        (n,) of the board against the picture, degrees.
    """

    camera: str
    unit: str
    parts: int
    empty: tuple[str, ...] | None
    distances: Floats
    tilts: Floats

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
        parts, empty = _parts(calibrated, number)
        found.append(
            Showing(
                camera.name,
                board.unit,
                parts,
                empty,
                np.linalg.norm((poses @ middle)[:, :3], axis=1),
                np.degrees(np.arccos(np.clip(np.abs(poses[:, 2, 2]), 0.0, 1.0))),
            )
        )
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
