"""Tables of a statement for its page and CSV files, and its JSON document (docs/statement.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.io.csv_text import csv_text
from photogram.results.grouping import sums_by_kind
from photogram.results.statement.budget import Budget, kind_of
from photogram.results.statement.comparison import LeftOut, limit_of
from photogram.results.statement.figures import Figures, Sized, point_tests
from photogram.results.statement.request import lengths_in
from photogram.results.statement.standards import MEASURES, Asprs, LengthTest
from photogram.results.statement.texts import Texts
from photogram.show.page import Part, Section, about, decimals_of
from photogram.show.quantity import Axis, Quantity, Table, column, frame, members, members_of_each
from photogram.statistics.freedom import coverage_factor
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result, Statement

DIRECTIONS = ("e", "n", "h")
BLANK = " "  # Header of a column without a name
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
    return Section(f"annex-{letter}", texts(f"annex.{letter}"), parts, intro, annex=True)


def check_points(statement: Statement) -> Table:
    texts, own, columns = statement.texts, statement.compared, Columns(statement.texts)
    names, unit = own.names, statement.result.block.linear_unit
    tests = point_tests(own) if statement.of_all is None else statement.of_all.points
    decimals = decimals_for(tests.sd_adjusted)
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
        columns.directions("sd", tests.sd_predicted, decimals, unit, name="sd", member="sd_predicted"),
        Quantity(tests.sd_adjusted, axes, "deviation", "sd_adjusted", "sd_adjusted"),
        Quantity(own.survey_sd, axes, "deviation", "sd_survey", "sd_survey"),
        columns.directions("normalised", tests.normalised, 1, name="normalised"),
        columns.number("T", tests.T, 1, name="T"),
        columns.number("p", tests.p, kind="probability", name="p", marked=tests.p < tests.limit),
        columns.number(
            "others", tests.others, 1, name="T_from_the_others", marked=tests.p_others < tests.limit
        ),
        Quantity(tests.p_others, member="p_from_the_others"),
        columns.number("CE90", tests.ce90, decimals, unit, name="ce90_predicted"),
        columns.number("LE90", tests.le90, decimals, unit, name="le90_predicted"),
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
    names, reasons = zip(*statement.removed, strict=True) if count else ((), ())
    shown = MAX_REMOVED_OBSERVATIONS
    quantities = [
        Quantity([*map(str, names)], kind="name", name="observation", member="name"),
        column("reason", [*reasons], kind="name"),
        columns.text("observation", [*map(texts.text, names)]),
        columns.text("reason", [texts(f"removed.{reason}") for reason in reasons]),
    ]
    note = texts("table.removed.note", shown=shown, all=count) if count > shown else ""
    rows = np.arange(min(count, shown))
    return Table("removed", texts("table.removed"), quantities, note, shown=rows)


def test_lengths(texts: Texts, test: LengthTest) -> Table:
    columns, decimals = Columns(texts), decimals_for(test.sd)
    number = partial(columns.number, decimals=decimals, unit=texts.unit)
    limits = np.full(len(test.names), math.nan) if test.limits is None else test.limits
    labels = [f"{line}: {' – '.join(ends)}" for line, ends in zip(test.names, test.ends, strict=True)]
    quantities = [
        columns.text("line", labels),
        Quantity([*test.names], kind="name", member="line"),
        Quantity([first for first, _ in test.ends], kind="name", member="from"),
        Quantity([last for _, last in test.ends], kind="name", member="to"),
        number("length", test.calibrated, member="calibrated"),
        number("error", test.errors, member="error"),
        number("sd", test.sd, member="sd"),
        columns.number("normalised", test.normalised, 2, member="normalised"),
        number("limit", limits, member="limit"),
    ]
    return Table("lengths.lengths", texts("table.lengths"), quantities)


def quality_measures(statement: Statement) -> Table:
    texts, columns, rows = statement.texts, Columns(statement.texts), statement.standards.iso_19157
    keys, elements, values, scopes = zip(*rows, strict=True) if rows else ((),) * 4
    listed = [own if isinstance(own, list) else [own] for own in values]
    figures = [["–" if one is None else texts.significant(one, 3) for one in own] for own in listed]
    units, days = ([own] * len(rows) for own in (statement.result.block.linear_unit, statement.asked.date))
    quantities = [
        column("element", [*elements], kind="name"),
        columns.text("measure", [MEASURES[key][1] for key in keys], name="measure"),
        columns.number("id", [MEASURES[key][0] for key in keys], member="measure_id"),
        Quantity([*values], member="value"),
        columns.text("value", [*map(" / ".join, figures)]),
        columns.text(BLANK, units),
        column("unit", units, kind="name"),
        column("evaluation", ["direct external"] * len(rows), kind="name"),
        column("date", days, kind="name"),
        column("scope", [*scopes], kind="name"),
    ]
    return Table("iso_19157", texts("table.iso"), quantities)


def files_of_statement(statement: Statement) -> dict[str, bytes]:
    unit = statement.result.block.linear_unit
    columns = frame(check_points(statement).columns)
    for name, code in statement.compared.not_usable:
        values = {"point": name, "used": "no", "reason": str(phrase(f"reason.{code}")), "cover": ""}
        columns = {key: [*column, values.get(key, math.nan)] for key, column in columns.items()}
    rows = list[dict[str, Any]]()
    for each in statement.taken_apart:
        head = {"quantity": each.quantity, "unit": each.unit, "value": each.value, "u": each.sd}
        basis = "estimated" if each.freedom.basis == "components" else "given"
        for own in (*each.sources, *each.largest):
            dof = each.freedom.of_kind.get(own.name, math.nan) if own.level == "kind" else math.nan
            known = own.level == "observation" or own.name in each.freedom.of_kind
            found = members(own, "level", "number", "share", "sensitivity", "sd", source="name", u_k="u")
            rows.append({**head, **found, "dof": dof, "taken_from": basis if known else "given"})
    budgets = {name: [row.get(name, math.nan) for row in rows] for name in _OF_BUDGET}
    files = {
        "check_points.csv": csv_text(columns, [about("statement.check-points", unit=unit)]),
        "budget.csv": csv_text(budgets, []),
    }
    if statement.left_out:
        left_out = frame(left_out_points(statement.texts, statement.left_out).columns)
        files["leave_one_out.csv"] = csv_text(left_out, [about("statement.leave-one-out", unit=unit)])
    if statement.removed:
        files["removed.csv"] = removed_observations(statement).csv()
    return files


_OF_BUDGET = (
    *("quantity", "unit", "value", "u", "level", "source", "number", "u_k", "share"),
    *("sensitivity", "sd", "dof", "taken_from"),
)


def statement_members(found: Statement) -> dict[str, Any]:
    asked, result, standards = found.asked, found.result, found.standards
    unit = result.block.linear_unit
    return {
        "title": asked.title or result.block.title,
        **{name: own or None for name, own in members(asked, *_HEAD).items()},
        "language": found.texts.language,
        "units": {"length": unit, "angle": "rad", "image": result.block.image_unit},
        "headline": found.headline,
        "exit": found.exit,
        "sentences": found.sentences,
        "figures": found.figures,
        "vegetated": figures_member(found.of_vegetated),
        "without": {"points": dict(asked.without), "figures": figures_member(found.of_rest)}
        if asked.without
        else None,
        "not_usable": [
            {"point": name, "code": code, "reason": str(phrase(f"reason.{code}"))}
            for name, code in found.compared.not_usable
        ],
        "budgets": {each.quantity: budget_member(each) for each in found.taken_apart},
        "asprs": standards.asprs and _asprs(standards.asprs, asked.classes, lengths_in(unit)),
        "nssda": standards.nssda_member if "nssda" in asked.standards else None,
        "lengths": standards.lengths and _lengths(standards.lengths),
        "iso_19157": None,
        "layout": found.layout and vars(found.layout),
        "camera": [
            members(each, "name", parameters="names", value="values") | members(each, "sd", "correlations")
            for each in result.cameras
        ],
        "adjustment": _adjustment(result),
        "assumptions": found.assumptions,
        "remarks": found.judged.remarks,
        "files": [{"name": each.path.name, "sha256": each.sha256} for each in found.inputs],
        "command": found.command or None,
    }


_HEAD = ("client", "firm", "project", "surveyor", "date")


def kinds_of(result: Result) -> dict[str, tuple[int, float, float]]:
    return {kind_of(name): sums for name, sums in sums_by_kind(result).items()}


def _adjustment(result: Result) -> dict[str, Any]:
    total, freedom = result.sum_and_freedom
    return {
        "status": result.status,
        "photos": len(result.block.photo_ids),
        "points": int(result.used_points.sum()),
        "images": int(result.used_images.sum()),
        "by_kind": {
            name: {"number": count, "redundancy": redundancy, "sum_of_squares": squares}
            for name, (count, redundancy, squares) in kinds_of(result).items()
        },
        "omega": total,
        "dof": freedom,
        "s2": result.covariance_scale,
        "unit_variance": result.unit_variance,
        "verdict": result.verdict.document(),
        "datum": str(result.datum),
    }


def figures_member(found: Figures | None, nssda: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    if found is None:
        return None
    parts = [found.parts[each] for each in ("e", "n", "h")]
    names = {name: name for name in ("mean", "sd", "rmse", "largest")} | {"largest_point": "point"}
    return {
        "n": found.n,
        **{name: [each and getattr(each, own) for each in parts] for name, own in names.items()},
        **found.rmse,
        "horizontal": _radial(found.parts["plan"]),
        "spatial": _radial(found.parts["all"]),
        "without_survey": {part: found.without_survey(part) for part in ("h", "v")},
        "nssda": None if nssda is None else dict(nssda),
        "prediction": {
            part: each and {**vars(each), "rejected": each.rejected}
            for part, each in found.prediction.items()
        },
        "bias": {part: each and vars(each) for part, each in found.bias.items()},
        "inside_95": found.inside,
        "circular_linear": {
            **found.radii,
            "from_moments": {"matrix": found.moments, **found.of_moments},
            "predicted_mixture": found.mixture,
        },
        "surface": found.surface and {"columns": ["1", "x", "y", "x^2+y^2"], **vars(found.surface)},
    }


def _radial(own: Sized | None) -> dict[str, Any] | None:
    return None if own is None else members(own, "n", "rmse", "largest", largest_point="point")


def budget_member(found: Budget) -> dict[str, Any]:
    """Return a budget: contributions are variances in the square of its unit."""
    freedom, name = found.freedom, f"k{100 * found.coverage:g}_components"
    own = (("joint", freedom.joint), ("welch_satterthwaite", freedom.welch_satterthwaite))
    return {
        **members(found, "unit", "value", "cofactor", "sd", "coverage", "k", "expanded"),
        "by_kind": {
            each.name: members(each, "contribution", sd="u") | members(each, "share", "number")
            for each in found.at("kind")
        },
        **{
            member: {each.name: each.contribution for each in found.at(level)}
            for member, level in (
                ("images_by_strip", "strip"),
                ("images_by_camera", "camera"),
                ("images_by_photo", "photo"),
                ("control_by_point", "point"),
                ("camera_by_parameter", "parameter"),
            )
        },
        "largest": [
            members(each, observation="subject") | members(each, "sd", "sensitivity", "contribution", "share")
            for each in found.largest
        ],
        "degrees_of_freedom": {
            "basis": freedom.basis,
            "used": freedom.used if math.isfinite(freedom.used) else None,
            "weights_given": None,
            "common_unit_variance": freedom.common,
            "nu_of_kind": freedom.of_kind,
            "components_joint": freedom.joint,
            "components_welch_satterthwaite": freedom.welch_satterthwaite,
            **{
                f"{name}_{what}": coverage_factor(found.coverage, nu, truncated=False) if nu > 0 else math.nan
                for what, nu in own
            },
        },
    }


def _asprs(found: Asprs, classes: Mapping[str, float], metre: float) -> dict[str, Any]:
    names = {"h": "horizontal", "v": "vertical", "3d": "three_d"}
    own: dict[str, Any] = {
        f"class_{name}_m": classes[name] * metre if name in classes else None for name in names
    }
    for name, each in found.figures.items():
        own |= {f"upper_{name}": each and each.upper, f"rmse_{name}": each and each.rmse}
    own |= {member: found.verdicts.get(name) for name, member in names.items()}
    return own | {
        **members(found, "words", "survey_good_enough", "control_good_enough", "control_rmse"),
        "enough_points": found.words == "tested",
        "points_asked_for": {f"{found.area:g} km2": found.points_asked},
        "remarks": [vars(each) for each in found.remarks],
        "leave_one_out": found.leave_one_out,
    }


def _lengths(test: LengthTest) -> dict[str, Any]:
    together = test.together
    return {
        **members(test, "largest", rmse="rms", met="met", lines="lines"),
        "arrangement": test.enough and test.long_enough and test.along_diagonal,
        "angle_to_diagonal": test.off_diagonal,
        "at_reference_temperature": test.expansion is not None,
        "T": together and together.weighted_sum_of_squares,
        "rank": together and together.degrees_of_freedom,
        "p_high": together and together.probability_above,
    }
