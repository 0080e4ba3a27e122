"""What a further view of the board would add to the knowledge of a calibration.

A view with the rows A_v of its pose and A_c of the common unknowns adds M = A_c' A_c - A_c' A_v (A_v' A_v)^-1
A_v' A_c to the inverse of their cofactors. Of functions J of the unknowns, with F = Q J',

    J (Q^-1 + M)^-1 J' = J Q J' - F' M (I + Q M)^-1 F,

where only the unknowns that the view touches, and those that J is of, count.
"""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.declared import dataclass
from photogram.show.brief import Brief, Rows
from photogram.targets.housing import Housing, transformed
from photogram.targets.imaging import rays
from photogram.targets.maps import distance_text
from photogram.targets.projection import of_functions, worst
from photogram.targets.view_rows import view_rows

__all__ = ["Added", "Candidate", "NewView", "Suggestions", "added_by", "best_views", "seen_from"]

FEWEST = 12
"""Corners that a picture must have to count."""
MARGIN = 5.0
"""Pixels about a corner that must be in the picture for a detector to find it."""
STRAIGHT = 1e-6
"""By how much the ray of an image may miss the point that it is of: more, and the lens has folded."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A view that may be taken.

    Attributes
    ----------
    name
        Where the board is to be held, in words.
    pose
        (4, 4) board -> camera 0.
    """

    name: str
    pose: Floats


@dataclass(frozen=True, eq=False)
class Added:
    """What a view adds.

    Attributes
    ----------
    touched
        (t,) common unknowns that it says something of.
    normal
        (t, t) M of these.
    corners
        (K,) corners in the picture of each camera.
    """

    touched: Indices
    normal: Floats
    corners: Indices

    def gain(self, cofactors: Floats, rows: Indices) -> Floats:
        """Return (k, k) what the cofactors of some unknowns lose: Q M (I + Q M)^-1 Q in these rows."""
        touched = cofactors[np.ix_(self.touched, self.touched)]
        across = cofactors[np.ix_(self.touched, rows)]
        found = across.T @ self.normal @ np.linalg.solve(np.eye(len(touched)) + touched @ self.normal, across)
        return np.asarray((found + found.T) / 2)


@dataclass(frozen=True, eq=False)
class NewView:
    """A view that is worth taking, and the map of uncertainty with it.

    Attributes
    ----------
    candidate
        The view.
    corners
        (K,) corners in the picture of each camera.
    sd
        (n,) standard deviations of the map in the worst direction, pixels.
    """

    candidate: Candidate
    corners: Indices
    sd: Floats

    @property
    def largest(self) -> float:
        """Of the map."""
        return float(self.sd.max())

    @property
    def rms(self) -> float:
        """Root mean square over the map."""
        return float(np.sqrt(np.mean(self.sd**2)))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Suggestions(Brief):
    """Views of the board that would help most, each with those before it.

    Attributes
    ----------
    camera, distance, unit
        Of the map of uncertainty in the datum `corners`, which is to become better.
    pixels
        (n, 2) of the map.
    before
        (n,) standard deviations in the worst direction as they are, pixels.
    views
        The views, in the order in which to take them.
    """

    camera: str
    distance: float
    unit: str
    pixels: Floats
    before: Floats
    views: tuple[NewView, ...]

    @property
    def sentences(self) -> list[str]:
        """What to do, and what comes of it, a line for each view."""
        largest, said = float(self.before.max()), []
        for each in self.views:
            said.append(f"{each.candidate.name}: largest {largest:.3g} -> {each.largest:.3g} px")
            largest = each.largest
        return said

    def brief(self) -> tuple[str, Rows]:
        """Return them in a few lines."""
        at = distance_text(self.distance, self.unit)
        title = f"Views to take next, for the uncertainty of {self.camera} {at}"
        return title, [(f"{number}", said) for number, said in enumerate(self.sentences, 1)]


def seen_from(housing: Housing, pose: Floats, sizes: Floats) -> tuple[Indices, Indices]:
    """Return cameras and points of the images that a view would have: those in pictures with 12 or more.

    Parameters
    ----------
    housing, pose
        The cameras, and the (4, 4) pose board -> camera 0.
    sizes
        (K, 2) width and height of pictures.
    """
    cameras, points = [], []
    for number, camera in enumerate(housing.cameras):
        places = transformed(housing.sensors[number] @ pose, housing.points)
        xy = camera.project(places * [1.0, -1.0, -1.0])
        with np.errstate(invalid="ignore"):
            inside = ((xy >= MARGIN) & (xy <= sizes[number] - 1 - MARGIN)).all(axis=1)
            back = rays(camera, np.where(inside[:, np.newaxis], xy, np.nan))
            towards = places / np.linalg.norm(places, axis=1)[:, np.newaxis]
            own = np.flatnonzero(inside & (np.linalg.norm(back - towards, axis=1) < STRAIGHT))
        if len(own) >= FEWEST:
            cameras.append(np.full(len(own), number))
            points.append(own)
    if not points:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return np.concatenate(cameras), np.concatenate(points)


def added_by(housing: Housing, pose: Floats, sizes: Floats, sd: float) -> Added | None:
    """Return what a view adds, with corners of a standard deviation in pixels; None where nothing is seen."""
    cameras, points = seen_from(housing, pose, sizes)
    if not len(points):
        return None
    rows = view_rows(housing, pose, cameras, points)
    by_common = rows.by_common.reshape(-1, housing.common) / sd
    touched = np.flatnonzero(by_common.any(axis=0))
    by_common = by_common[:, touched]
    basis = np.linalg.qr(rows.by_pose.reshape(-1, 6))[0]
    mixed = basis.T @ by_common
    counts = np.bincount(cameras, minlength=len(housing.cameras))
    return Added(touched, by_common.T @ by_common - mixed.T @ mixed, counts)


def best_views(
    housing: Housing, functions: Floats, candidates: list[Candidate], sizes: Floats, sd: float, count: int
) -> list[NewView]:
    """Return views that make the largest standard deviation of a map smallest, each with those before it.

    Parameters
    ----------
    housing
        The cameras.
    functions
        (n, 2, c) J of the map by the common unknowns, in a datum that stays as it is.
    candidates
        Views that may be taken, each once.
    sizes, sd
        (K, 2) of pictures, and the standard deviation of a corner in pixels.
    count
        How many views.
    """
    seen = [(each, added_by(housing, each.pose, sizes, sd)) for each in candidates]
    left = [(each, added) for each, added in seen if added is not None]
    rows, every = np.flatnonzero(functions.any(axis=(0, 1))), np.arange(housing.common)
    partials, cofactors = functions[:, :, rows], housing.cofactors[np.ix_(every, every)].copy()
    found: list[NewView] = []
    while left and len(found) < count:
        own = cofactors[np.ix_(rows, rows)]
        tried = [worst(of_functions(partials, own - added.gain(cofactors, rows))) for _, added in left]
        best = min(range(len(left)), key=lambda row: (tried[row].max(), np.mean(tried[row] ** 2)))
        candidate, added = left.pop(best)
        found.append(NewView(candidate, added.corners, np.sqrt(housing.variance) * tried[best]))
        cofactors -= added.gain(cofactors, every)
    return found
