"""Tables of a statement: files of commas, and cells of the page as its language writes numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.csv_text import csv_text
from photogram.results.statement.budget import Budget
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import Figures
from photogram.results.statement.leave_one_out import LeftOut
from photogram.results.statement.texts import Texts
from photogram.show.page import Cell, Column, decimals_of

if TYPE_CHECKING:
    from photogram import Statement

_AXES = ("e", "n", "h")
decimals_for = partial(decimals_of, smallest=True, unknown=3, most=6)
"""With how many decimals a table is written: no value in it loses the digits of its standard deviation."""


def files_of_statement(found: Statement) -> dict[str, bytes]:
    """Return the tables of a statement as text of commas, by the names of files."""
    unit = found.result.block.linear_unit
    files = {
        "check_points.csv": _check_file(
            found.compared, found.of_all, found.survey.checks, dict(found.asked.without), unit
        ),
        "budget.csv": _budget_file(found.taken_apart),
    }
    if found.left_out:
        files["leave_one_out.csv"] = _left_out_file(found.left_out, unit)
    if found.removed:
        columns = {"observation": [each.name for each in found.removed]}
        columns["reason"] = [each.reason for each in found.removed]
        files["removed.csv"] = csv_text(columns, [])
    return files


def _check_file(
    found: Compared, of_all: Figures | None, coordinates: Floats, without: dict[str, str], unit: str
) -> bytes:
    """Return `check_points.csv`: a row for each check point, and for known points that say nothing."""
    n = len(found)
    columns: dict[str, Any] = {"point": list(found.names)}
    columns["cover"] = ["vegetated" if each else "open" for each in found.vegetated]
    columns |= dict(zip(("east", "north", "up"), coordinates.T, strict=True))
    tests = None if of_all is None else of_all.points
    nothing = np.full((n, 3), np.nan)
    for name, values in (
        ("d", found.differences),
        ("sd", nothing if tests is None else tests.sd_predicted),
        ("sd_adjusted", nothing if tests is None else tests.sd_adjusted),
        ("sd_survey", found.survey_sd),
        ("normalised", nothing if tests is None else tests.normalised),
    ):
        columns |= _along_axes(name, values)
    single = ("T", "p", "others", "ce90", "le90")
    titles = ("T", "p", "T_from_the_others", "ce90_predicted", "le90_predicted")
    for title, name in zip(titles, single, strict=True):
        columns[title] = np.full(n, np.nan) if tests is None else getattr(tests, name)
    columns["used"] = ["no" if name in without else "yes" for name in found.names]
    columns["reason"] = [without.get(name, "") for name in found.names]
    for name, reason in found.not_usable:
        for key, values in columns.items():
            own = {"point": name, "used": "no", "reason": reason, "cover": ""}.get(key, math.nan)
            columns[key] = [*list(values), own]
    return csv_text(columns, [f"lengths in {unit}; d: adjusted minus given, to the east, north and up"])


def _along_axes(name: str, values: Floats) -> dict[str, Floats]:
    return {f"{name}_{axis}": column for axis, column in zip(_AXES, values.T, strict=True)}


def _left_out_file(found: Sequence[LeftOut], unit: str) -> bytes:
    """Return `leave_one_out.csv`: control points as the others predict them."""
    columns: dict[str, Any] = {"point": [each.point for each in found]}
    for name, values in (("d", [each.difference for each in found]), ("sd", [each.sd for each in found])):
        columns |= _along_axes(name, np.array(values).reshape(len(found), 3))
    columns |= {name: [getattr(each, name) for each in found] for name in ("T", "rank", "p")}
    columns["least_eigenvalue"] = [float(each.eigenvalues.min(initial=math.nan)) for each in found]
    return csv_text(
        columns, [f"lengths in {unit}; d: predicted by all others minus survey; no independent check"]
    )


def _budget_file(found: Sequence[Budget]) -> bytes:
    """Return `budget.csv`: a row for each source of each quantity at each level."""
    rows: list[tuple[Any, ...]] = []
    for each in found:
        head = (each.quantity, each.unit, each.value, each.sd)
        basis = "estimated" if each.freedom.basis == "components" else "given"
        for own in each.sources:
            nu = each.freedom.of_kind.get(own.name, math.nan) if own.level == "kind" else math.nan
            named = basis if own.name in each.freedom.of_kind or basis == "given" else "given"
            rows.append(
                (*head, own.level, own.name, own.number, own.u, own.share, math.nan, math.nan, nu, named)
            )
        for one in each.largest:
            source = " ".join(one.observation)
            u = math.sqrt(one.contribution)
            alone = (1, u, one.share, one.sensitivity, one.sd, math.nan, basis)
            rows.append((*head, "observation", source, *alone))
    names = (
        *("quantity", "unit", "value", "u", "level", "source", "number", "u_k", "share"),
        *("sensitivity", "sd", "dof", "taken_from"),
    )
    return csv_text({name: [row[k] for row in rows] for k, name in enumerate(names)}, [])


class Written:
    """Cells and columns in the words and numbers of a language."""

    def __init__(self, texts: Texts) -> None:
        self._texts = texts

    def column(self, key: str, unit: str = "", *, text: bool = False) -> Column:
        """Return a column by the key of its head."""
        return Column(self._texts(f"column.{key}"), unit, text=text)

    def numbers(
        self, key: str, values: Floats | Sequence[float], decimals: int, unit: str = ""
    ) -> tuple[Column, Callable[[int], Cell]]:
        """Return a column by the key of its head, with the number of each row."""
        return self.column(key, unit), lambda row: self.number(float(values[row]), decimals)

    def along_axes(
        self, key: str, values: Floats, decimals: int, unit: str = ""
    ) -> list[tuple[Column, Callable[[int], Cell]]]:
        """Return columns for east, north and height, with the numbers of each row of (n, 3) values."""
        head = self._texts(f"column.{key}")
        columns = [Column(f"{head} {self._texts(f'component.{axis}')}", unit) for axis in _AXES]
        return [
            (column, lambda row, own=own: self.number(float(own[row]), decimals))  # type: ignore[misc]
            for column, own in zip(columns, np.reshape(values, (-1, 3)).T, strict=True)
        ]

    def number(self, value: float | None, decimals: int) -> Cell:
        """Return a number with so many decimals; what there is not as a dash."""
        if value is None:
            return Cell("")
        return Cell(self._texts.number(value, decimals), sorts=value if math.isfinite(value) else None)

    def looked(self, value: float, decimals: int, *, bad: bool) -> Cell:
        """Return a number that is to be looked at where it is bad."""
        return replace(self.number(value, decimals), tone="look" if bad else "")

    def figures(self, value: float | None, figures: int = 3) -> Cell:
        """Return a number with so many significant figures."""
        if value is None:
            return Cell("")
        return Cell(self._texts.significant(value, figures), sorts=value if math.isfinite(value) else None)

    def p(self, value: float, level: float = 0.05) -> Cell:
        """Return a probability; one below its level is to be looked at."""
        if not math.isfinite(value):
            return Cell("")
        return Cell(self._texts.probability(value), tone="look" if value < level else "", sorts=value)
