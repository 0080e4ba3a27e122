"""Members of the JSON document of a statement: figures, points, budgets. Lengths in the linear unit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from photogram.results.statement.budget import Budget
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import Figures, Sized
from photogram.results.statement.honest import PointTests, Prediction
from photogram.results.statement.leave_one_out import LeftOut
from photogram.show.quantity import members
from photogram.statistics.freedom import coverage_factor


def figures_member(found: Figures | None, nssda: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    """Return the figures of check points; None where there are none."""
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
"""What is called otherwise in the document."""


def _prediction(found: Prediction | None) -> dict[str, Any] | None:
    if found is None:
        return None
    own = {_PREDICTION.get(name, name): value for name, value in vars(found).items()}
    return own | {"rejected": "high" if found.rejected_high else "low" if found.rejected_low else None}


def point_rows(found: Compared, tests: PointTests | None) -> list[dict[str, Any]]:
    """Return the check points, one after the other."""
    if tests is None:
        return []
    columns = {
        "point": found.names,
        "cover": ["vegetated" if each else "open" for each in found.vegetated],
        "given": found.given.tolist(),
        "difference": found.differences,
        **members(tests, "sd_predicted", "sd_adjusted"),
        "sd_survey": found.survey_sd,
        **members(tests, "normalised", "T", "p", T_from_the_others="others", p_from_the_others="p_others"),
        **members(tests, ce90_predicted="ce90", le90_predicted="le90"),
    }
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def left_out_rows(found: Sequence[LeftOut]) -> list[dict[str, Any]]:
    """Return control points as the others predict them, one after the other."""
    return [
        members(each, "point", predicted_minus_survey="difference")
        | members(each, "sd", "covariance", "T", "rank", "p", "redundancy", "eigenvalues")
        for each in found
    ]


def budget_member(found: Budget) -> dict[str, Any]:
    """Return a budget: contributions are variances in the square of its unit."""
    freedom = found.freedom
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
            **_factors(found),
        },
    }


def _factors(found: Budget) -> dict[str, float]:
    """Return k of the coverage from untruncated degrees of freedom of components."""
    name = f"k{100 * found.coverage:g}_components"
    own = (("joint", found.freedom.joint), ("welch_satterthwaite", found.freedom.welch_satterthwaite))
    return {
        f"{name}_{what}": coverage_factor(found.coverage, nu, truncated=False) if nu > 0 else math.nan
        for what, nu in own
    }
