"""Which view of the board to take next: candidates in words, ranked by the map that they would leave."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from photogram import _photocore
from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.targets.calibrated import Calibrated
from photogram.targets.datums import datum_rows
from photogram.targets.housing import Housing
from photogram.targets.housings import camera_number, housed_with, housing_of, size_of
from photogram.targets.imaging import rays
from photogram.targets.maps import image_grid
from photogram.targets.new_views import Candidate, Suggestions, best_views
from photogram.targets.picture_parts import parts_of
from photogram.targets.projection import common_partials, worst
from photogram.targets.uncertainty import checked_distance
from photogram.targets.vision import composed, inverted

__all__ = ["candidate_views", "suggest_views"]

DISTANCES = (0.1, 0.5, 0.9)
"""Quantiles of how far boards were, which are the distances of candidates."""
TILT, TURN = 30.0, 90.0
"""Degrees."""
TILTS = {
    "": (0.0, 0.0),
    f"tilted {TILT:g} degrees about x": (TILT, 0.0),
    f"tilted {-TILT:g} degrees about x": (-TILT, 0.0),
    f"tilted {TILT:g} degrees about y": (0.0, TILT),
    f"tilted {-TILT:g} degrees about y": (0.0, -TILT),
}
TURNS = {"": 0.0, f"turned by {TURN:g} degrees": TURN}
GRID = (12, 8)
"""Pixels whose uncertainty is compared."""


def suggest_views(
    result: Calibrated,
    distance: float = np.inf,
    candidates: Sequence[Candidate] | None = None,
    *,
    camera: int | str = 0,
    views: int = 1,
) -> Suggestions:
    """Return the views of the board that would make the largest uncertainty over a picture smallest.

    Parameters
    ----------
    result
        The adjusted calibration. The board stays as large as it is, and corners as good as the best.
    distance
        At which the map of uncertainty counts, in the unit of the board; infinite: directions.
    candidates
        Views that may be taken; None: the board in 5 x 4 places of the picture, at three distances as it was
        seen, frontal and tilted by 30 degrees, upright and turned.
    camera
        Whose map counts: number or name. On a rig all cameras see the board.
    views
        How many, each chosen with those before it.

    Raises
    ------
    InputError
        A camera that there is not, pictures whose size nobody knows, no candidate that shows the board.
    """
    number = camera_number(result, camera)
    checked_distance(distance)
    housing, own = housing_of(result, number)
    sizes = np.array([size_of(result, each) for each in housed_with(result, number)])
    pixels = image_grid(size_of(result, number), GRID)[2]
    functions = common_partials(housing, own, pixels, distance, datum_rows(housing, own, "corners"))
    known = np.isfinite(functions).all(axis=(1, 2))
    common = housing.cofactors[: housing.common, : housing.common]
    before = worst(housing.variance * functions[known] @ common @ functions[known].transpose(0, 2, 1))
    if candidates is None:
        candidates = candidate_views(housing, own, size_of(result, number), result.calibration.board.unit)
    found = best_views(
        housing, functions[known], list(candidates), sizes, float(housing.seen.sd.min()), views
    )
    if not found:
        raise InputError("none of the candidates shows the board to a camera")
    return Suggestions(
        camera=result.cameras[number].name,
        distance=float(distance),
        unit=result.calibration.board.unit,
        pixels=pixels[known],
        before=before,
        views=tuple(found),
    )


def candidate_views(housing: Housing, camera: int, size: tuple[int, int], unit: str) -> list[Candidate]:
    """Return views of the board all over the picture of a camera, at three distances, tilted and turned.

    Parameters
    ----------
    housing, camera
        The cameras, and the number of the one to which the board is shown.
    size, unit
        Width and height of its pictures, and the unit of lengths.
    """
    middle = (housing.points.max(axis=0) + housing.points.min(axis=0)) / 2
    to_camera = housing.sensors[camera]
    own = np.unique(housing.seen.views[housing.seen.cameras == camera])
    places = (to_camera @ housing.poses[own] @ [*middle, 1.0])[:, :3]
    away = np.quantile(np.linalg.norm(places, axis=1), DISTANCES)
    to_first = inverted(to_camera)
    found = []
    for place, towards in _cells(housing, camera, size):
        for distance, tilt, turn in product(
            dict.fromkeys(f"{float(f'{each:.2g}'):g}" for each in away), TILTS, TURNS
        ):
            rotation = _facing(towards) @ _turned(*TILTS[tilt], TURNS[turn])
            pose = composed(rotation, float(distance) * towards - rotation @ middle)
            name = ", ".join(filter(None, (place, f"{distance} {unit}", tilt, turn)))
            found.append(Candidate(name, to_first @ pose))
    return found


def _cells(housing: Housing, camera: int, size: tuple[int, int]) -> Iterator[tuple[str, Floats]]:
    """Yield places of the picture in words, and where they look; none where nothing is seen."""
    for part in parts_of(size):
        towards = rays(housing.cameras[camera], np.array([part.middle]))[0]
        if np.isfinite(towards).all():
            yield part.name, towards


def _facing(towards: Floats) -> Floats:
    """Return the shortest rotation that turns z to a direction: a board whose normal it is."""
    axis = np.cross([0.0, 0.0, 1.0], towards)
    sine = float(np.linalg.norm(axis))
    angle = np.arctan2(sine, towards[2])
    vector = axis * angle / sine if sine > 0 else axis
    return np.asarray(_photocore.vector_rotations(vector[np.newaxis])[0])


def _turned(about_x: float, about_y: float, about_z: float) -> Floats:
    """Return a tilt about x or y behind a turn about z (degrees)."""
    tilt, turn = _photocore.vector_rotations(np.radians([[about_x, about_y, 0.0], [0.0, 0.0, about_z]]))
    return np.asarray(tilt @ turn)


check_arguments(globals(), ["suggest_views"])
