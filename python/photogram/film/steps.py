"""One step against two: films inside the adjustment beside films that were fitted to their marks before."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.show.methods import Paged, document_of, report_of
from photogram.show.summary import Brief, Rows

if TYPE_CHECKING:
    from photogram.results.result import Result

__all__ = ["StepsCompared", "compare_steps"]


@dataclass(frozen=True, eq=False, repr=False)
class StepsCompared(Paged, Brief):
    """Points of one block from one step and from two. Standard deviations are a priori: unit weight is 1.

    Attributes
    ----------
    inside, before
        The results, films inside the adjustment and fitted before it.
    rows
        (n,) the points of both that have a covariance in both.
    sd
        (2, n, 3) standard deviations of X, Y, Z: one step, two steps.
    difference
        (n, 3) two steps less one step.
    """

    inside: Result
    before: Result
    rows: Indices
    sd: Floats
    difference: Floats

    @property
    def median_sd(self) -> Floats:
        """(2, 3) medians of standard deviations."""
        found: Floats = np.median(self.sd, axis=1)
        return found

    @property
    def percent(self) -> Floats:
        """(3,) by how much those of two steps are larger than those of one: the median of single points."""
        found: Floats = 100.0 * (np.median(self.sd[1] / self.sd[0], axis=0) - 1.0)
        return found

    @property
    def sentence(self) -> str:
        """What the comparison says."""
        axes = ", ".join(f"{own:+.1f} % in {axis}" for axis, own in zip("XYZ", self.percent, strict=True))
        return f"films fitted before change standard deviations of points by {axes} (median)"

    def brief(self) -> tuple[str, Rows]:
        """Return the comparison in a line."""
        return "Films inside the adjustment, and fitted before", [("points", self.sentence)]

    def report(self) -> str:
        """Return the comparison as text."""
        return report_of(self)

    def to_json(self) -> bytes:
        """Return the comparison as a JSON document (UTF-8); docs/film.md lists the members."""
        return document_of(self)


def compare_steps(inside: Result, before: Result) -> StepsCompared:
    """Compare films inside the adjustment with films that are fitted before, and then errorless.

    Parameters
    ----------
    inside, before
        Results of one project, `interior = "inside"` and `"before"`.

    Raises
    ------
    InputError
        Results of another kind, of different points, or without covariances.
    """
    for name, result, held in (("inside", inside, False), ("before", before, True)):
        if not result.films or any(film.placement.is_held != held for _, film in result.films):
            raise InputError(f'the films of one result are not such of interior = "{name}"')
    if list(inside.block.point_ids) != list(before.block.point_ids):
        raise InputError("the results are of different points")
    variances = np.array([np.diagonal(each.point_cofactors, axis1=1, axis2=2) for each in (inside, before)])
    rows = np.flatnonzero((variances > 0).all(axis=(0, 2)))
    if not len(rows):
        raise InputError("the results have no covariances of points")
    difference = (before.point_positions - inside.point_positions)[rows]
    return StepsCompared(inside, before, rows, np.sqrt(variances[:, rows]), difference)
