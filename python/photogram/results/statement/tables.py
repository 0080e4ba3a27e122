"""Tables of a statement, declared once for the page, JSON and CSV files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.csv_text import csv_text
from photogram.results.statement.budget import Budget
from photogram.results.statement.comparison import LeftOut, limit_of
from photogram.results.statement.standards import Lengths
from photogram.results.statement.texts import Texts
from photogram.show.page import Part, Section, decimals_of
from photogram.show.quantity import Axis, Quantity, Table, column, frame, members, members_of_each

if TYPE_CHECKING:
    from photogram import Statement

DIRECTIONS = ("e", "n", "h")
MAX_REMOVED_OBSERVATIONS = 1000  # Limit of the page; the file lists all
decimals_for = partial(decimals_of, smallest=True, unknown=3, most=6)


class Columns:
    """Columns with headers in a language; file names as in JSON documents."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts

    def head(self, key: str) -> str:
        """Return the header of a column; texts without a sentence are unchanged."""
        return self.texts(f"column.{key}") if self.texts.has(f"column.{key}") else key

    def text(self, key: str, values: Sequence[str], name: str | None = None, **more: Any) -> Quantity:
        return Quantity([*values], kind="name", name=name, member=name or "", head=self.head(key), **more)

    def number(
        self, key: str, values: Any, decimals: int | None = None, unit: str = "", **more: Any
    ) -> Quantity:
        """Return a column of numbers: in fixed point, or with significant figures."""
        own = {"kind": "deviation" if unit else "number", "head": self.head(key), "decimals": decimals}
        axes = (Axis.of("", unit),) if unit else ()
        return Quantity(values, axes, **{**own, "member": more.get("name", ""), **more})

    def directions(self, key: str, values: Floats, decimals: int, unit: str = "", **more: Any) -> Quantity:
        """Return columns for east, north and height of (n, 3) values."""
        own = {"head": f"{self.head(key)} {{}}", "decimals": decimals, "member": more.get("name", "")}
        axes = tuple(
            Axis(name, unit, small=unit, label=self.texts(f"component.{name}")) for name in DIRECTIONS
        )
        return Quantity(np.reshape(values, (-1, 3)), axes, "deviation", **{**own, **more})


def annex(texts: Texts, letter: str, parts: Sequence[Part], intro: str = "") -> Section:
    """Return an annex with the title and the key of its letter."""
    return Section(f"annex-{letter}", texts(f"annex.{letter}"), parts, intro, annex=True)


def check_points(statement: Statement) -> Table:
    """Return the check points with their differences and tests."""
    texts, own, columns = statement.texts, statement.compared, Columns(statement.texts)
    names, unit, n = own.names, statement.result.block.linear_unit, len(own)
    tests = None if statement.of_all is None else statement.of_all.points
    sd, adjusted, normalised = (
        np.full((n, 3), np.nan) if tests is None else getattr(tests, name)
        for name in ("sd_predicted", "sd_adjusted", "normalised")
    )
    T, p, others, p_others, ce90, le90 = (
        np.full(n, np.nan) if tests is None else getattr(tests, name)
        for name in ("T", "p", "others", "p_others", "ce90", "le90")
    )
    limit, decimals = 0.0 if tests is None else tests.limit, decimals_for(adjusted)
    left_out = np.array([name in statement.asked.without for name in names], dtype=bool)
    covers = ["vegetated" if each else "open" for each in own.vegetated]
    plain, axes = partial(Quantity, kind="name"), tuple(map(Axis, DIRECTIONS))
    quantities = [
        columns.text("point", names, name="point", marked=left_out),
        column("cover", covers, kind="name"),
        columns.text("cover", [texts(f"cover.{cover}") for cover in covers]),
        Quantity(own.given, member="given"),
        Quantity(statement.survey.checks, tuple(map(Axis, ("east", "north", "up"))), name=""),
        columns.directions("difference", own.differences, decimals, unit, name="d", member="difference"),
        columns.directions("sd", sd, decimals, unit, name="sd", member="sd_predicted"),
        Quantity(adjusted, axes, "deviation", "sd_adjusted", "sd_adjusted"),
        Quantity(own.survey_sd, axes, "deviation", "sd_survey", "sd_survey"),
        columns.directions("normalised", normalised, 1, name="normalised"),
        columns.number("T", T, 1, name="T"),
        columns.number("p", p, kind="probability", name="p", marked=p < limit),
        columns.number("others", others, 1, name="T_from_the_others", marked=p_others < limit),
        Quantity(p_others, member="p_from_the_others"),
        columns.number("CE90", ce90, decimals, unit, name="ce90_predicted"),
        columns.number("LE90", le90, decimals, unit, name="le90_predicted"),
        plain(["no" if each else "yes" for each in left_out], name="used"),
        plain([statement.asked.without.get(name, "") for name in names], name="reason"),
    ]
    return Table("check_points", texts("annex.a"), quantities)


def left_out_points(texts: Texts, own: Sequence[LeftOut]) -> Table:
    columns, unit = Columns(texts), texts.unit
    sd, difference = (np.array([getattr(each, name) for each in own]) for name in ("sd", "difference"))
    p, decimals = np.array([each.p for each in own]), decimals_for(sd)
    least = [float(each.eigenvalues.min(initial=math.nan)) for each in own]
    quantities = [
        columns.text("point", [each.point for each in own], name="point"),
        columns.directions(
            "difference", difference, decimals, unit, name="d", member="predicted_minus_survey"
        ),
        columns.directions("sd", sd, decimals, unit, name="sd"),
        columns.number("T", [each.T for each in own], 1, name="T"),
        column("rank", [each.rank for each in own]),
        columns.number("p", p, kind="probability", name="p", marked=p < limit_of(own)),
        Quantity(least, name="least_eigenvalue"),
        *members_of_each(own, "covariance", "redundancy", "eigenvalues"),
    ]
    return Table("leave_one_out", texts("annex.b"), quantities)


def removed_observations(statement: Statement) -> Table:
    """Return the removed observations; the page lists the first ones."""
    texts, columns, count = statement.texts, Columns(statement.texts), len(statement.removed)
    reasons, shown = [each.reason for each in statement.removed], MAX_REMOVED_OBSERVATIONS
    quantities = [
        Quantity([each.name for each in statement.removed], kind="name", name="observation", member="name"),
        column("reason", reasons, kind="name"),
        columns.text("observation", [texts.text(each.subject) for each in statement.removed]),
        columns.text("reason", [texts(f"removed.{reason}") for reason in reasons]),
    ]
    note = texts("table.removed.note", shown=shown, all=count) if count > shown else ""
    rows = np.arange(min(count, shown))
    return Table("removed", texts("table.removed"), quantities, note, shown=rows)


def test_lengths(texts: Texts, own: Lengths) -> Table:
    columns, test, decimals = Columns(texts), own.test, decimals_for(own.test.sd)
    number = partial(columns.number, decimals=decimals, unit=texts.unit)
    limits = np.full(len(own.lines), math.nan) if test.limits is None else test.limits
    labels = [f"{line}: {' – '.join(ends)}" for line, ends in zip(own.lines, own.ends, strict=True)]
    quantities = [
        columns.text("line", labels),
        Quantity([*own.lines], kind="name", member="line"),
        Quantity([first for first, _ in own.ends], kind="name", member="from"),
        Quantity([last for _, last in own.ends], kind="name", member="to"),
        number("length", own.calibrated, member="calibrated"),
        number("error", test.errors, member="error"),
        number("sd", test.sd, member="sd"),
        columns.number("normalised", test.normalised, 2, member="normalised"),
        number("limit", limits, member="limit"),
    ]
    return Table("lengths", texts("table.lengths"), quantities)


def files_of_statement(statement: Statement) -> dict[str, bytes]:
    """Return the tables of a statement as CSV text, by the names of files."""
    unit = statement.result.block.linear_unit
    columns = frame(check_points(statement).columns)
    for name, reason in statement.compared.not_usable:
        values = {"point": name, "used": "no", "reason": reason, "cover": ""}
        columns = {key: [*column, values.get(key, math.nan)] for key, column in columns.items()}
    about = f"lengths in {unit}; d: adjusted minus given, to the east, north and up"
    files = {
        "check_points.csv": csv_text(columns, [about]),
        "budget.csv": _budget_file(statement.taken_apart),
    }
    if statement.left_out:
        about = f"lengths in {unit}; d: predicted by all others minus survey; no independent check"
        files["leave_one_out.csv"] = csv_text(
            frame(left_out_points(statement.texts, statement.left_out).columns), [about]
        )
    if statement.removed:
        files["removed.csv"] = removed_observations(statement).csv()
    return files


def _budget_file(budgets: Sequence[Budget]) -> bytes:
    rows: list[dict[str, Any]] = []
    for each in budgets:
        head = {"quantity": each.quantity, "unit": each.unit, "value": each.value, "u": each.sd}
        basis = "estimated" if each.freedom.basis == "components" else "given"
        for own in each.sources:
            dof = each.freedom.of_kind.get(own.name, math.nan) if own.level == "kind" else math.nan
            named = basis if own.name in each.freedom.of_kind else "given"
            found = members(own, "level", "number", "share", source="name", u_k="u")
            rows.append({**head, **found, "dof": dof, "taken_from": named})
        for one in each.largest:
            found = {"level": "observation", "source": " ".join(one.observation), "number": 1}
            found |= {"u_k": math.sqrt(one.contribution), **members(one, "share", "sensitivity", "sd")}
            rows.append({**head, **found, "taken_from": basis})
    names = (
        *("quantity", "unit", "value", "u", "level", "source", "number", "u_k", "share"),
        *("sensitivity", "sd", "dof", "taken_from"),
    )
    return csv_text({name: [row.get(name, math.nan) for row in rows] for name in names}, [])
