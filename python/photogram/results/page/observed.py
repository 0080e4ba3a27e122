"""Observations in the tables of a page: the worst of all, and those of one kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.results.network import AdjustedNetwork, Observed
from photogram.results.page.frame import Frame
from photogram.show.page import Cell, Column, Table
from photogram.statistics.distributions import LEVEL, bonferroni, critical_normal, critical_student
from photogram.statistics.findings import Tested

__all__ = ["Images", "Links", "Worst", "observed_table", "worst_images", "worst_of", "worst_table"]

WORST = 25
"""Observations in the table of the worst."""
LISTED = 120
"""Rows of observations of one kind."""

Worst = tuple[float, Tested, tuple[int, ...]]
"""The size of a test value, its kind, and its place there."""


@dataclass(frozen=True)
class Images:
    """What the images of a network are called and measured in.

    Attributes
    ----------
    photos
        (m,) the photo of each image.
    photo_names, point_names
        Names.
    unit, factor
        Of residuals, and what leads to it.
    xy
        (m, 2) measured.
    """

    photos: Indices
    photo_names: Sequence[str]
    point_names: Sequence[str]
    unit: str
    factor: float
    xy: Floats


@dataclass(frozen=True)
class Links:
    """Which photos and points have rows on the page: names lead there."""

    @staticmethod
    def photo(name: str, number: int) -> Cell:
        """Return the name of a photo."""
        return Cell(name, goes_to=f"photo-{number}")

    @staticmethod
    def point(name: str, number: int) -> Cell:
        """Return the name of a point."""
        return Cell(name, goes_to=f"point-{number}")


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


def worst_images(worst: Sequence[Worst]) -> Indices:
    """Return the images among the worst observations."""
    own = [place[0] for _, tested, place in worst if tested.kind == "image coordinates"]
    return np.array(own, dtype=np.int64)


def worst_table(
    result: AdjustedNetwork, images: Images, limit: float | None, worst: Sequence[Worst]
) -> Table:
    """Return the observations whose test values are the largest, of all kinds."""
    rows: list[list[Cell | str | float | None]] = []
    for size, tested, place in worst:
        beyond = limit is not None and size > limit
        value = Cell(float(tested.values[place]), tone="look" if beyond else "")
        if tested.kind == "image coordinates":
            image, axis = place
            photo, point = int(images.photos[image]), int(result.image_points[image])
            rows.append(
                [
                    f"image {'xy'[axis]}",
                    Links.photo(images.photo_names[photo], photo),
                    Links.point(images.point_names[point], point),
                    float(result.residuals[place]) * images.factor,
                    float(result.image_given_sd[place]) * images.factor,
                    float(result.redundancy[place]),
                    value,
                ]
            )
        else:
            rows.append([tested.name(place), None, None, None, None, None, value])
    statistic = worst[0][1].statistic if worst else "w"
    columns = (
        Column("Observation", text=True),
        Column("Photo", text=True),
        Column("Point", text=True),
        Column("Residual", images.unit, decimals=2),
        Column("sd given", images.unit, decimals=2),
        Column("Redundancy", decimals=3),
        Column(f"Test value {statistic}", decimals=2),
    )
    said = "" if limit is None else f" Beyond {limit:.2f} the test of a single observation rejects."
    others = " Residuals of other kinds stand in their own tables."
    note = f"The {len(rows)} of the largest test values.{said}{others}"
    return Table("Worst observations", columns, rows, note)


def observed_table(
    caption: str,
    what: str,
    names: Sequence[str],
    frame: Frame,
    given: Observed,
    observed: Floats,
    adjusted: Floats,
    deviations: Floats,
) -> Table | None:
    """Return prior, posterior, difference and test of every observed component; None where there are none.

    Parameters
    ----------
    caption, what
        Of the table; `photo` or `point`.
    names
        Of all photos or points.
    frame
        How components are written.
    given
        The observations.
    observed, adjusted, deviations
        (n, k) values that were observed, adjusted values and their standard deviations, of all photos or
        points.
    """
    places = np.argwhere(np.isfinite(given.sd))
    if not len(places):
        return None
    tests = np.nan_to_num(np.abs(given.standardized[tuple(places.T)]), nan=-1.0)
    chosen = np.sort(np.argsort(-tests, kind="stable")[:LISTED])
    own = np.where(np.isfinite(given.sd), deviations[given.rows], np.nan)
    decimals, few = frame.value_decimals(own), [count + 1 for count in frame.decimals(own)]
    units = dict.fromkeys(frame.units)
    rows: list[list[Cell | str | float | None]] = []
    for row, component in places[chosen].tolist():
        number = int(given.rows[row])
        fixed = given.sd[row, component] == 0
        factor = float(frame.factors[component])
        rows.append(
            [
                Cell(names[number], goes_to=f"{what}-{number}"),
                frame.names[component]
                if len(units) == 1
                else f"{frame.names[component]}, {frame.units[component]}",
                frame.cell(component, float(observed[number, component]), decimals[component]),
                frame.cell(component, float(adjusted[number, component]), decimals[component]),
                frame.difference(component, float(given.differences[row, component]), few[component]),
                "fixed" if fixed else float(given.sd[row, component]) * factor,
                float(deviations[number, component]) * factor,
                None if fixed else float(given.redundancy[row, component]),
                None if fixed else float(given.tests[row, component]),
            ]
        )
    unit = next(iter(units)) if len(units) == 1 else ""
    value = max(decimals)
    written = {"dms": "° ′ ″", "deg": "°"}.get(frame.angles[0], unit) if unit else ""
    columns = (
        Column(what.capitalize(), text=True),
        Column("Component", text=True),
        Column("Given", written, decimals=value),
        Column("Adjusted", written, decimals=value),
        Column("Adjusted - given", unit, decimals=max(few)),
        Column("sd given", unit, figures=3),
        Column("sd adjusted", unit, figures=3),
        Column("Redundancy", decimals=3),
        Column("Test value w", decimals=2),
    )
    note = (
        ""
        if len(rows) == len(places)
        else f"The {len(rows)} of {len(places)} components with the largest test values."
    )
    return Table(caption, columns, rows, note)


def limit_of(groups: Sequence[Tested]) -> float | None:
    """Return what a test value of a single observation may be at most, 5 percent for all together."""
    number = sum(int(np.count_nonzero(~np.isnan(each.values))) for each in groups)
    if not number:
        return None
    level, second = bonferroni(LEVEL, number), float(np.asarray(groups[0].second))
    return critical_normal(level) if np.isinf(second) else critical_student(level, second)
