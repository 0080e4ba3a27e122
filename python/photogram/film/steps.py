"""Comparison of simultaneous and sequential interior orientation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import counted
from photogram.show.judgement import judged, verdict_table
from photogram.show.methods import Documented
from photogram.show.page import Document, Fact, Section, about
from photogram.show.quantity import Axis, Quantity, Table
from photogram.summaries import Rows
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.results.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class StepsCompared(Documented):
    """Points of one block from simultaneous and sequential interior orientation.

    Standard deviations are a priori: unit weight is 1.

    Attributes
    ----------
    inside, before
        Results with films estimated inside the adjustment, and fitted before it.
    rows
        (n,) the points with a covariance in both results.
    sd
        (2, n, 3) standard deviations of X, Y, Z: simultaneous, sequential.
    difference
        (n, 3) sequential minus simultaneous coordinates.
    """

    inside: Result
    before: Result
    rows: Indices
    sd: Floats
    difference: Floats

    @property
    def median_sd(self) -> Floats:
        """(2, 3) medians of standard deviations."""
        return np.asarray(np.median(self.sd, axis=1))

    @property
    def percent(self) -> Floats:
        """(3,) median increase of standard deviations in the sequential result, percent."""
        return np.asarray(100.0 * (np.median(self.sd[1] / self.sd[0], axis=0) - 1.0))

    @property
    def sentence(self) -> str:
        """Comparison as a sentence."""
        axes = [phrase("films.percent", axis=a, percent=p) for a, p in zip("XYZ", self.percent, strict=True)]
        return str(phrase("films.steps", axes=axes))

    def brief(self) -> tuple[str, Rows]:
        """Return the comparison in a line."""
        return about("films.compared"), [("points", self.sentence)]

    def document(self) -> Document:
        """Return the document of the comparison (JSON members: docs/film.md)."""
        results, facts = {"inside": self.inside, "before": self.before}, []
        for name, own in (("one step", self.inside), ("two steps", self.before)):
            if (test := own.global_test) is not None:
                expected = about("expected", low=test.limits[0], high=test.limits[1])
                facts.append(Fact.of(f"Unit variance, {name}", test.variance, note=expected, figures=4))
        of_axes = replace(_axes(self), note=f"{self.sentence[:1].upper()}{self.sentence[1:]}.")
        return Document(
            what=WHAT,
            title=self.inside.block.title,
            judgements=[judged(self.inside.verdict, "films inside the adjustment")],
            highlights=[*facts, Fact("Points compared", counted(len(self.rows), "point"))],
            sections=[
                Section("points", of_axes.title, [of_axes], _WHY),
                Section.of(verdict_table(self.inside.verdict)),
            ],
            members={
                "kind": "film",
                "verdict": self.inside.verdict.document(),
                "said": self.sentence,
                "unit": self.inside.block.linear_unit,
                "points": len(self.rows),
                "sums": {
                    name: {
                        "sum_of_squares": own.sum_and_freedom[0],
                        "degrees_of_freedom": own.sum_and_freedom[1],
                    }
                    for name, own in results.items()
                },
            },
        )


def compare_steps(inside: Result, before: Result) -> StepsCompared:
    """Compare simultaneous interior orientation with fixed films fitted before.

    Parameters
    ----------
    inside, before
        Results of one project, `interior = "inside"` and `"before"`.

    Raises
    ------
    InputError
        If results are of another type, of different points, or without covariances.
    """
    for name, result, held in (("inside", inside, False), ("before", before, True)):
        if not result.films or any(film.placement.is_held != held for _, film in result.films):
            raise InputError(phrase("films.other-interior", interior=name))
    if list(inside.block.point_ids) != list(before.block.point_ids):
        raise InputError(phrase("films.different-points"))
    variances = np.array([np.diagonal(each.point_cofactors, axis1=1, axis2=2) for each in (inside, before)])
    rows = np.flatnonzero((variances > 0).all(axis=(0, 2)))
    if not len(rows):
        raise InputError(phrase("films.no-covariances"))
    difference = (before.point_positions - inside.point_positions)[rows]
    return StepsCompared(inside, before, rows, np.sqrt(variances[:, rows]), difference)


WHAT = "Films inside the adjustment, and fitted before"
_WHY = (
    "Fitted before, films are taken as errorless, and so are marks, certificate and scanner: standard"
    " deviations leave these errors out, and tests of marks there are none. The figures are a priori."
)


def _axes(found: StepsCompared) -> Table:
    unit = (Axis.of("", found.inside.block.linear_unit),)
    own = found.sd[0]
    size = found.difference / own
    worst = np.abs(size).argmax(axis=0)
    names = [found.inside.block.point_ids[found.rows[row]] for row in worst.tolist()]
    rms = np.sqrt(np.mean(found.difference**2, axis=0))
    columns = [
        Quantity([*"XYZ"], kind="name", member="axis", head="Axis"),
        Quantity(found.median_sd[0], unit, "value", member="sd_inside", head="sd, one step"),
        Quantity(found.median_sd[1], unit, "value", member="sd_before", head="sd, two steps"),
        Quantity(found.percent, member="percent", head="Two steps, %", decimals=2),
        Quantity(rms, unit, "value", member="rms_difference", head="rms difference"),
        Quantity(
            size[worst, range(3)], member="largest_in_sd", head="Largest, in sd of one step", decimals=2
        ),
        Quantity(names, kind="name", member="largest_at", head="At"),
    ]
    return Table("axes", "Medians of standard deviations, and differences of points", columns)
