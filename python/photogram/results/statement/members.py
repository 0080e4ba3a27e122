"""Members of the JSON document of a statement: figures, points, budgets. Lengths in the linear unit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from photogram.results.statement.budget import Budget
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import Figures, Radius
from photogram.results.statement.honest import Bias, PointTests, Prediction, Surface
from photogram.results.statement.leave_one_out import LeftOut

__all__ = ["budget_member", "figures_member", "left_out_rows", "point_rows"]


def figures_member(found: Figures | None, nssda: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    """Return the figures of check points; None where there are none."""
    if found is None:
        return None
    parts = [found.parts[each] for each in ("e", "n", "h")]
    return {
        "n": found.n,
        **{
            name: [None if each is None else getattr(each, name) for each in parts]
            for name in ("mean", "sd", "rmse", "largest")
        },
        "largest_point": [None if each is None else each.point for each in parts],
        **{
            name: getattr(found, name)
            for name in ("rmse_h1", "rmse_v1", "rmse_h2", "rmse_v2", "rmse_h", "rmse_v", "rmse_3d")
        },
        "horizontal": _radial(found, "plan"),
        "spatial": _radial(found, "all"),
        "without_survey": {part: found.without_survey(part) for part in ("h", "v")},
        "nssda": None if nssda is None else dict(nssda),
        "prediction": {part: _prediction(each) for part, each in found.prediction.items()},
        "bias": {part: _bias(each) for part, each in found.bias.items()},
        "inside_95": found.inside,
        "circular_linear": _circular(found),
        "surface": _surface(found.surface),
    }


def _radial(found: Figures, part: str) -> dict[str, Any] | None:
    own = found.parts[part]
    if own is None:
        return None
    return {"n": own.n, "rmse": own.rmse, "largest": own.largest, "largest_point": own.point}


def _prediction(found: Prediction | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "rows": found.rows,
        "points": found.points,
        "rank": found.rank,
        "predicted_rmse": found.predicted_rmse,
        "predicted_rmse_of_product": found.predicted_rmse_of_product,
        "found_rmse": found.found_rmse,
        "effective_dof": found.effective_dof,
        "rmse_interval_95": found.rmse_interval,
        "T": found.T,
        "p_high": found.p_high,
        "p_low": found.p_low,
        "p_high_f": found.p_high_f,
        "factor_of_sd": found.factor,
        "factor_interval_95": found.factor_interval,
        "sum_of_squares_without_correlations": found.sum_of_squares_without_correlations,
        "rejected": "high" if found.rejected_high else "low" if found.rejected_low else None,
    }


def _bias(found: Bias | None) -> dict[str, Any] | None:
    return None if found is None else vars(found)


def _circular(found: Figures) -> dict[str, Any]:
    radii = {name: None if each is None else _radius(each) for name, each in found.radii.items()}
    moments = {"matrix": found.moments, **found.of_moments}
    return {**radii, "from_moments": moments, "predicted_mixture": found.mixture}


def _radius(found: Radius) -> dict[str, Any]:
    return vars(found)


def _surface(found: Surface | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {"columns": ["1", "x", "y", "x^2+y^2"], **vars(found)}


def point_rows(found: Compared, tests: PointTests | None) -> list[dict[str, Any]]:
    """Return the check points, one after the other."""
    if tests is None:
        return []
    given = found.given.tolist()
    return [
        {
            "point": name,
            "cover": "vegetated" if found.vegetated[k] else "open",
            "given": given[k],
            "difference": found.differences[k],
            "sd_predicted": tests.sd_predicted[k],
            "sd_adjusted": tests.sd_adjusted[k],
            "sd_survey": found.survey_sd[k],
            "normalised": tests.normalised[k],
            "T": tests.T[k],
            "p": tests.p[k],
            "T_from_the_others": tests.others[k],
            "p_from_the_others": tests.p_others[k],
            "ce90_predicted": tests.ce90[k],
            "le90_predicted": tests.le90[k],
        }
        for k, name in enumerate(found.names)
    ]


def left_out_rows(found: Sequence[LeftOut]) -> list[dict[str, Any]]:
    """Return control points as the others predict them, one after the other."""
    return [
        {
            "point": each.point,
            "predicted_minus_survey": each.difference,
            "sd": each.sd,
            "covariance": each.covariance,
            "T": each.T,
            "rank": each.rank,
            "p": each.p,
            "redundancy": each.redundancy,
            "eigenvalues": each.eigenvalues,
        }
        for each in found
    ]


def budget_member(found: Budget) -> dict[str, Any]:
    """Return a budget: contributions are variances in the square of its unit."""
    freedom = found.freedom
    return {
        "unit": found.unit,
        "value": found.value,
        "cofactor": found.cofactor,
        "sd": found.sd,
        "coverage": found.coverage,
        "k": found.k,
        "expanded": found.expanded,
        "by_kind": {
            each.name: {
                "contribution": each.contribution,
                "sd": each.u,
                "share": each.share,
                "number": each.number,
            }
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
            **_factors(found),
        },
    }


def _factors(found: Budget) -> dict[str, float]:
    """Return k of the coverage from untruncated degrees of freedom of components."""
    from photogram.statistics.freedom import coverage_factor

    name = f"k{100 * found.coverage:g}_components"
    own = (("joint", found.freedom.joint), ("welch_satterthwaite", found.freedom.welch_satterthwaite))
    return {
        f"{name}_{what}": coverage_factor(found.coverage, nu, truncated=False) if nu > 0 else np.nan
        for what, nu in own
    }
