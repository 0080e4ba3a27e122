"""The JSON document of a statement; `docs/statement.md` lists its members."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from photogram import _photocore
from photogram.results.group_sums import observables, sums_of
from photogram.results.grouping import grouped
from photogram.results.statement.budget import kind_of
from photogram.results.statement.members import budget_member, figures_member, left_out_rows, point_rows
from photogram.results.statement.request import lengths_in
from photogram.show.quantity import members

if TYPE_CHECKING:
    from photogram import Result, Statement


def statement_members(found: Statement) -> dict[str, Any]:
    """Return the members of the document."""
    asked, result, standards = found.asked, found.result, found.standards
    unit = result.block.linear_unit
    return {
        "program": f"photogram {_photocore.__version__}",
        "title": asked.title or result.block.title,
        **{name: own or None for name, own in members(asked, *_HEAD).items()},
        "language": found.texts.language,
        "units": {"length": unit, "angle": "rad", "image": result.block.image_unit},
        "headline": found.headline,
        "exit": found.exit,
        "sentences": found.sentences,
        "figures": found.figures,
        "vegetated": figures_member(found.of_vegetated),
        "check_points": point_rows(found.compared, None if found.of_all is None else found.of_all.points),
        "without": {"points": dict(asked.without), "figures": figures_member(found.of_rest)}
        if asked.without
        else None,
        "not_usable": [{"point": name, "reason": reason} for name, reason in found.compared.not_usable],
        "leave_one_out": left_out_rows(found.left_out),
        "budgets": {each.quantity: budget_member(each) for each in found.taken_apart},
        "asprs": None if standards.asprs is None else standards.asprs.member(asked, lengths_in(unit)),
        "nssda": standards.nssda_member if "nssda" in asked.standards else None,
        "lengths": None if standards.lengths is None else standards.lengths.member(),
        "iso_19157": standards.iso_19157 or None,
        "layout": found.layout and members(found.layout, **_LAYOUT),
        "camera": [
            members(each, "name", parameters="names", value="values") | members(each, "sd", "correlations")
            for each in result.cameras
        ],
        "adjustment": _adjustment(result),
        "assumptions": found.assumptions,
        "remarks": found.judged.remarks,
        "removed": [members(each, "name", "reason") for each in found.removed],
        "files": [{"name": each.path.name, "sha256": each.sha256} for each in found.inputs],
        "command": found.command or None,
    }


_HEAD = ("client", "firm", "project", "surveyor", "date")
_LAYOUT = {
    "count": "count",
    "diagonal": "diagonal",
    "share_in_quadrants": "quadrants",
    "least_spacing_over_diagonal": "least_spacing",
    "share_of_area_far": "far",
    "share_of_heights": "heights",
    "outside_control": "beyond_control",
}


def kinds_of(result: Result) -> dict[str, tuple[int, float, float]]:
    """Return number, redundancy and weighted sum of squares of every kind, cameras among them."""
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    found = {
        kind_of(name): (int(counts[k]), float(redundancy[k]), float(squares[k]))
        for k, name in enumerate(grouping.groups.names)
    }
    for unknown in result.unknowns:
        _add(found, unknown.kind, unknown.given.deviations, unknown.redundancy, unknown.standardized)
    for camera in result.cameras:
        weighted = camera.weighted
        sd = camera.given.deviations[weighted]
        own = camera.redundancy[weighted]
        v = camera.given.values[weighted] - camera.values[weighted]
        if weighted:
            count, r, q = found.get("camera", (0, 0.0, 0.0))
            found["camera"] = (count + len(weighted), r + float(own.sum()), q + float(((v / sd) ** 2).sum()))
    return found


def _add(found: dict[str, tuple[int, float, float]], kind: str, sd: Any, redundancy: Any, w: Any) -> None:
    """Add weighted components of a common unknown: w = v / (sd sqrt(r))."""
    for deviation, r, value in zip(sd.tolist(), redundancy.tolist(), w.tolist(), strict=True):
        if 0 < deviation < float("inf"):
            count, total, squares = found.get(kind, (0, 0.0, 0.0))
            square = value**2 * r if value == value else 0.0
            found[kind] = (count + 1, total + r, squares + square)


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
