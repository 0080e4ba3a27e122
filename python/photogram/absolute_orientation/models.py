"""Models before absolute orientation: relative orientation, and strips.

A model is a network of two photos with a minimum datum. A strip is a chain of similarities between models.
Both use the adjustment and `orient`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from photogram.absolute_orientation.adjust import orient
from photogram.absolute_orientation.stations import Stations
from photogram.adjustment.adjustment import adjust
from photogram.adjustment.first_values import first_values
from photogram.arguments.types import Floats
from photogram.errors import InputError, RankError, message_of
from photogram.lazy_dataclasses import dataclass
from photogram.messages import coded
from photogram.network.block import Block, refuse_trajectories
from photogram.network.datum import MinimumConstraints
from photogram.network.motion import kept_images, of_photos
from photogram.results.result import Result
from photogram.show.judgement import remarks_section
from photogram.show.methods import Documented
from photogram.show.page import Document, Section
from photogram.show.quantity import Table, column, of_each
from photogram.words import phrase

LEAST = 5  # Points needed for the relative orientation of two photos


@dataclass(frozen=True, eq=False)
class Model:
    """A model of two photos after relative orientation.

    Attributes
    ----------
    ids
        Names of its n positions: points, then the projection centres, as names of their photos in brackets.
    positions
        (n, 3) in model axes, from the first projection centre; the base is 1.
    result
        The adjustment of the two photos in a minimum datum, with residuals and tests.
    """

    ids: tuple[str, ...]
    positions: Floats
    result: Result


@dataclass(frozen=True, eq=False)
class Strip(Documented):
    """Models joined by similarities, in the units and axes of the first.

    Attributes
    ----------
    ids, positions
        As in a model; positions in several models are averaged.
    models
        The joined models.
    rms
        Root mean square difference of common positions at each joint, in units of the strip.
    """

    ids: tuple[str, ...]
    positions: Floats
    models: tuple[Model, ...]
    rms: tuple[float, ...]

    @property
    def converged(self) -> bool:
        """Whether the adjustments of all models converged."""
        return all(each.result.converged for each in self.models)

    def document(self) -> Document:
        """Return the document: models, differences at their joints, models without redundancy."""
        results = [each.result for each in self.models]
        names = [" ".join(each.block.photo_ids) for each in results]
        squares = [each.sums_of_squares.total for each in results]
        models = [
            column("photos", names, "Photos", kind="name"),
            column("points", [len(each.ids) - 2 for each in self.models], "Points"),
            of_each(results, "status", kind="name", head="Status"),
            column("weighted_sum_of_squares", squares, "Weighted sum of squares", figures=4),
            of_each(results, "degrees_of_freedom", head="Degrees of freedom", decimals=0),
        ]
        joints = [
            column("model", names[1:], "Model", kind="name"),
            column("rms", self.rms, "rms, bases of the first model", figures=3),
        ]
        unchecked = [phrase("orientation.unchecked", names=self.unchecked)] if self.unchecked else []
        return Document(
            "Strip of models",
            "",
            sections=[
                remarks_section(unchecked),
                Section.of(Table("models", "Models", models)),
                Section.of(Table("joints", "Joints", joints)),
            ],
            members={"messages": coded(unchecked)},
        )

    @property
    def unchecked(self) -> list[str]:
        """Models of five points, which have zero degrees of freedom."""
        return [
            " ".join(each.result.block.photo_ids)
            for each in self.models
            if not each.result.degrees_of_freedom
        ]


def relative_model(block: Block, first: str, second: str) -> Model:
    """Compute the relative orientation of two photos from common points, in a minimum datum.

    Raises
    ------
    InputError
        If a photo does not exist or is on a trajectory, or the object space is geographic.
    RankError
        If there are fewer than five common points.
    AdjustmentError
        If the adjustment results in values that are not finite.
    """
    missing = [name for name in (first, second) if name not in block.photo_ids]
    if missing or first == second:
        raise InputError(phrase("orientation.model-photos", photo=missing[0] if missing else first))
    if block.geographic:
        raise InputError(phrase("orientation.geographic"))
    refuse_trajectories(block, "a model of two photos")
    pair = of_photos(block, np.isin(np.array(block.photo_ids, dtype=object), [first, second]))
    twice = np.bincount(pair.image_points, minlength=len(pair.point_ids)) == 2
    if np.count_nonzero(twice) < LEAST:
        counts = {"n": int(np.count_nonzero(twice)), "least": LEAST}
        raise RankError(
            phrase("orientation.common-points", first=first, second=second, **counts), [first, second], []
        )
    rows = np.flatnonzero(twice)
    number = np.cumsum(twice) - 1
    pair = kept_images(pair, twice[pair.image_points])
    free = np.full((len(rows), 3), np.inf)
    pair = pair.replace(
        point_ids=[block.point_ids[row] for row in rows.tolist()],
        point_positions=np.full((len(rows), 3), np.nan),
        point_sd=free,
        image_points=number[pair.image_points],
        observations=(),
        mounts=(),
        photo_positions=np.full((2, 3), np.nan),
        photo_attitudes=np.full((2, 3), np.nan),
        photo_positions_observed=None,
        photo_attitudes_observed=None,
        photo_position_sd=np.inf,
        photo_attitude_sd=np.inf,
        refraction=None,
    )
    result = adjust(first_values(pair).usable(), datum=MinimumConstraints())
    centres, own = result.photo_positions, result.block
    base = np.linalg.norm(centres[1] - centres[0])
    places = np.vstack([result.point_positions, centres])
    start = own.photo_ids.index(first)
    ids = [*own.point_ids, *(f"[{name}]" for name in own.photo_ids)]
    # Observations rejected by the initial orientation are without position.
    rows = np.flatnonzero(np.isfinite(places).all(axis=1))
    return Model(tuple(ids[row] for row in rows.tolist()), (places[rows] - centres[start]) / base, result)


def strip_of(block: Block, photos: Sequence[str]) -> Strip:
    """Compute models of neighbouring photos and join them by similarities.

    Parameters
    ----------
    block
        The block; its control, its poses and its additional observations are not used.
    photos
        At least two names in the order of the strip.

    Raises
    ------
    InputError
        If there are fewer than two photos, or :func:`relative_model` raises it.
    RankError
        If models have too few common positions, or all of them are on a line.
    """
    if len(photos) < 2:
        raise InputError(phrase("orientation.strip", count=len(photos)))
    models = [relative_model(block, *pair) for pair in pairwise(photos)]
    places = dict(zip(models[0].ids, models[0].positions, strict=True))
    counts = dict.fromkeys(places, 1)
    rms: list[float] = []
    for model, name in zip(models[1:], photos[1:], strict=False):
        rows = [row for row, place in enumerate(model.ids) if place in places]
        common = [model.ids[row] for row in rows]
        ground = np.array([places[each] for each in common]).reshape(-1, 3)
        try:
            found = orient(Stations(common, ground, model.positions[rows].reshape(-1, 3)))
        except RankError as error:
            raise RankError(
                phrase("orientation.join", photo=name, error=message_of(error)), [name], common
            ) from None
        carried = found.similarity.transform(model.positions)[0]
        rms.append(found.rms / found.similarity.scale)
        for place, position in zip(model.ids, carried, strict=True):
            count = counts[place] = counts.get(place, 0) + 1
            places[place] = position if count == 1 else places[place] + (position - places[place]) / count
    return Strip(tuple(places), np.array(list(places.values())), tuple(models), tuple(rms))
