"""The worst of all observations in a table of a page."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.results.network import AdjustedNetwork
from photogram.results.network_tables import terms_of
from photogram.show.cells import unit_written
from photogram.show.page import Cell, Column, Table
from photogram.statistics.distributions import LEVEL, bonferroni, critical_normal, critical_student
from photogram.statistics.findings import Tested

__all__ = ["Worst", "limit_of", "worst_images", "worst_of", "worst_table"]

WORST = 25
"""Observations in the table of the worst."""
Worst = tuple[float, Tested, tuple[int, ...]]
"""The size of a test value, its kind, and its place there."""


def worst_of(groups: Sequence[Tested], count: int = WORST) -> list[Worst]:
    """Return the observations of least probability, with |test value| as the measure of what is alike."""
    found: list[Worst] = []
    for tested in groups:
        sizes = np.where(np.isnan(tested.values), -1.0, np.abs(tested.values))
        flat = sizes.ravel()
        if not flat.size:
            continue
        few = np.argpartition(-flat, min(count, flat.size - 1))[:count]
        for index in few[flat[few] > 0].tolist():
            place = tuple(int(each) for each in np.unravel_index(index, sizes.shape))
            found.append((float(flat[index]), tested, place))
    found.sort(key=lambda each: (-each[0], each[1].kind, each[2]))
    return found[:count]


def worst_images(result: AdjustedNetwork, worst: Sequence[Worst]) -> tuple[list[int], list[int]]:
    """Return photos and points of the images among the worst observations."""
    own = [place[0] for _, tested, place in worst if tested.kind == "image coordinates"]
    return result.given.image_photos[own].tolist(), result.image_points[own].tolist()


def worst_table(result: AdjustedNetwork, limit: float | None, worst: Sequence[Worst]) -> Table:
    """Return the observations whose test values are the largest, of all kinds."""
    terms = terms_of(result)
    rows: list[list[Cell | str | float | None]] = []
    for size, tested, place in worst:
        beyond = limit is not None and size > limit
        value = Cell(float(tested.values[place]), tone="look" if beyond else "")
        if tested.kind == "image coordinates":
            image, k = place
            photo, point, axis = (
                result.given.image_photos[image],
                result.image_points[image],
                terms.image_axes[k],
            )
            rows.append(
                [
                    f"image {axis.name}",
                    Cell(str(terms.photos[photo]), goes_to=f"photo-{photo}"),
                    Cell(str(terms.points[point]), goes_to=f"point-{point}"),
                    float(result.residuals[place]) * axis.factor,
                    float(result.image_given_sd[place]) * axis.factor,
                    float(result.redundancy[place]),
                    value,
                ]
            )
        else:
            rows.append([tested.name(place), None, None, None, None, None, value])
    unit = unit_written(terms.image_axes[0].small)
    statistic = worst[0][1].statistic if worst else "w"
    columns = (
        Column("Observation", text=True),
        Column("Photo", text=True),
        Column("Point", text=True),
        Column("Residual", unit, decimals=2),
        Column("sd given", unit, decimals=2),
        Column("Redundancy", decimals=3),
        Column(f"Test value {statistic}", decimals=2),
    )
    said = "" if limit is None else f" Beyond {limit:.2f} the test of a single observation rejects."
    others = " Residuals of other kinds stand in their own tables."
    note = f"The {len(rows)} of the largest test values.{said}{others}"
    return Table("Worst observations", columns, rows, note)


def limit_of(groups: Sequence[Tested]) -> float | None:
    """Return what a test value of a single observation may be at most, 5 percent for all together."""
    number = sum(int(np.count_nonzero(~np.isnan(each.values))) for each in groups)
    if not number:
        return None
    level, second = bonferroni(LEVEL, number), float(np.asarray(groups[0].second))
    return critical_normal(level) if np.isinf(second) else critical_student(level, second)
