"""Tables of a statement as files with commas."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from photogram.io.csv_text import csv_text
from photogram.results.statement.budget import Budget
from photogram.results.statement.tables import check_points, left_out_points, removed_observations
from photogram.show.quantity import frame

if TYPE_CHECKING:
    from photogram import Statement


def files_of_statement(statement: Statement) -> dict[str, bytes]:
    """Return the tables of a statement as text of commas, by the names of files."""
    unit = statement.result.block.linear_unit
    files = {"check_points.csv": _check_file(statement), "budget.csv": _budget_file(statement.taken_apart)}
    if statement.left_out:
        about = f"lengths in {unit}; d: predicted by all others minus survey; no independent check"
        files["leave_one_out.csv"] = csv_text(
            frame(left_out_points(statement.texts, statement.left_out).columns), [about]
        )
    if statement.removed:
        files["removed.csv"] = removed_observations(statement).csv()
    return files


def _check_file(statement: Statement) -> bytes:
    columns = frame(check_points(statement).columns)
    for name, reason in statement.compared.not_usable:
        values = {"point": name, "used": "no", "reason": reason, "cover": ""}
        columns = {key: [*column, values.get(key, math.nan)] for key, column in columns.items()}
    about = "d: adjusted minus given, to the east, north and up"
    return csv_text(columns, [f"lengths in {statement.result.block.linear_unit}; {about}"])


def _budget_file(budgets: Sequence[Budget]) -> bytes:
    rows: list[tuple[Any, ...]] = []
    for each in budgets:
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
