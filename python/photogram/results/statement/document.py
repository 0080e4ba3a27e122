"""The JSON document of a statement; `docs/statement.md` lists its members."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Bools, Floats
from photogram.results.group_sums import observables, sums_of
from photogram.results.grouping import grouped
from photogram.results.statement.budget import Budget, kind_of
from photogram.results.statement.figures import Figures, Prediction, Sized
from photogram.results.statement.request import lengths_in
from photogram.results.statement.standards import Lengths
from photogram.results.statement.tables import removed_observations, test_lengths
from photogram.results.statement.texts import Texts
from photogram.show.quantity import members
from photogram.statistics.freedom import coverage_factor

if TYPE_CHECKING:
    from photogram import Result, Statement


def statement_members(found: Statement) -> dict[str, Any]:
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
        "check_points": found.check_points,
        "without": {"points": dict(asked.without), "figures": figures_member(found.of_rest)}
        if asked.without
        else None,
        "not_usable": [{"point": name, "reason": reason} for name, reason in found.compared.not_usable],
        "leave_one_out": found.leave_one_out,
        "budgets": {each.quantity: budget_member(each) for each in found.taken_apart},
        "asprs": None if standards.asprs is None else standards.asprs.member(asked, lengths_in(unit)),
        "nssda": standards.nssda_member if "nssda" in asked.standards else None,
        "lengths": standards.lengths and _lengths(found.texts, standards.lengths),
        "iso_19157": standards.iso_19157 or None,
        "layout": found.layout and members(found.layout, **_LAYOUT),
        "camera": [
            members(each, "name", parameters="names", value="values") | members(each, "sd", "correlations")
            for each in result.cameras
        ],
        "adjustment": _adjustment(result),
        "assumptions": found.assumptions,
        "remarks": found.judged.remarks,
        "removed": removed_observations(found).record(),
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
    """Return number, redundancy and sum of squares of every type and cameras."""
    grouping = grouped(observables(result), "kind")
    counts, squares, redundancy = sums_of(result, grouping)
    found = {
        kind_of(name): (int(counts[k]), float(redundancy[k]), float(squares[k]))
        for k, name in enumerate(grouping.groups.names)
    }
    for unknown in result.unknowns:
        sd, w = unknown.given.deviations, unknown.standardized  # w = v / (sd sqrt(r))
        _add(found, unknown.kind, (sd > 0) & np.isfinite(sd), unknown.redundancy, w**2 * unknown.redundancy)
    for camera in result.cameras:
        weighted = np.isin(np.arange(len(camera.names)), camera.weighted)
        with np.errstate(all="ignore"):
            squares = ((camera.given.values - camera.values) / camera.given.deviations) ** 2
        _add(found, "camera", weighted, camera.redundancy, squares)
    return found


def _add(
    found: dict[str, tuple[int, float, float]],
    kind: str,
    weighted: Bools,
    redundancy: Floats,
    squares: Floats,
) -> None:
    """Add the weighted components of a camera or common unknown."""
    if weighted.any():
        count, r, q = found.get(kind, (0, 0.0, 0.0))
        total = float(np.nansum(squares[weighted]))
        found[kind] = (count + int(weighted.sum()), r + float(redundancy[weighted].sum()), q + total)


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
    roots = ("rmse_h1", "rmse_v1", "rmse_h2", "rmse_v2", "rmse_h", "rmse_v", "rmse_3d")
    return {
        "n": found.n,
        **{name: [each and getattr(each, own) for each in parts] for name, own in names.items()},
        **members(found, *roots),
        "horizontal": _radial(found.parts["plan"]),
        "spatial": _radial(found.parts["all"]),
        "without_survey": {part: found.without_survey(part) for part in ("h", "v")},
        "nssda": None if nssda is None else dict(nssda),
        "prediction": {part: _prediction(each) for part, each in found.prediction.items()},
        "bias": {part: each and vars(each) for part, each in found.bias.items()},
        "inside_95": found.inside,
        "circular_linear": {
            **{name: each and vars(each) for name, each in found.radii.items()},
            "from_moments": {"matrix": found.moments, **found.of_moments},
            "predicted_mixture": found.mixture,
        },
        "surface": found.surface and {"columns": ["1", "x", "y", "x^2+y^2"], **vars(found.surface)},
    }


def _radial(own: Sized | None) -> dict[str, Any] | None:
    return None if own is None else members(own, "n", "rmse", "largest", largest_point="point")


_PREDICTION = {
    "rmse_interval": "rmse_interval_95",
    "factor": "factor_of_sd",
    "factor_interval": "factor_interval_95",
}


def _prediction(found: Prediction | None) -> dict[str, Any] | None:
    if found is None:
        return None
    own = {_PREDICTION.get(name, name): value for name, value in vars(found).items()}
    return own | {"rejected": "high" if found.rejected_high else "low" if found.rejected_low else None}


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
        "largest": [vars(each) for each in found.largest],
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


def _lengths(texts: Texts, found: Lengths) -> dict[str, Any]:
    test, together = found.test, found.test.together
    return {
        "lengths": test_lengths(texts, found).record(),
        **members(test, "largest", rmse="rms", met="met", lines="lines"),
        "arrangement": test.enough and test.long_enough and test.along_diagonal,
        "angle_to_diagonal": test.off_diagonal,
        "at_reference_temperature": found.expansion is not None,
        "T": together and together.weighted_sum_of_squares,
        "rank": together and together.degrees_of_freedom,
        "p_high": together and together.probability_above,
    }
