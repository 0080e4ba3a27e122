"""What a statement assumes, each a line that is filled from the run."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.results.components import VarianceComponents
from photogram.results.result import Result
from photogram.results.statement import translation
from photogram.results.statement.comparison import Compared
from photogram.results.statement.layout import Layout
from photogram.results.statement.request import Asked
from photogram.results.statement.standards import Lengths
from photogram.results.statement.texts import Texts

__all__ = ["assumptions"]


def assumptions(
    result: Result,
    asked: Asked,
    texts: Texts,
    found: Compared,
    layout: Layout | None,
    assumed: Sequence[str],
    removed: Sequence[str],
    *,
    lengths: Lengths | None = None,
) -> list[tuple[str, str]]:
    """Return keys and texts."""
    said = [*_weights(result, asked.components, texts)]
    said += [_said(texts, "assume.read", said=translation.read(texts, each)) for each in assumed]
    said += [*_adjustment(result, texts, removed)]
    if len(found):
        said += _survey(asked, texts, found)
        if found.step > 1:
            said.append(_said(texts, "assume.taken", all=found.known, step=found.step))
        said.append(_said(texts, "assume.heights"))
        if "asprs-2023" in asked.standards:
            said.append(_said(texts, "assume.slopes"))
    if layout is not None:
        quadrants = " / ".join(texts.percent(each) for each in layout.quadrants)
        said.append(
            _said(
                texts,
                "assume.layout",
                n=layout.count,
                quadrants=quadrants,
                spacing=texts.percent(layout.least_spacing),
                diagonal=texts.length(layout.diagonal, 3),
            )
        )
    if lengths is not None and lengths.expansion is not None:
        said.append(_said(texts, "lengths.reference", expansion=texts.significant(lengths.expansion, 3)))
    return [*said, _said(texts, "assume.not_covered")]


def _said(texts: Texts, key: str, **fields: str | int | float) -> tuple[str, str]:
    return key, texts(key, **fields)


def _weights(result: Result, components: VarianceComponents | None, texts: Texts) -> list[tuple[str, str]]:
    said = []
    test = result.global_test
    if components is not None:
        parts = [
            f"{translation.kind(texts, each.name)} x {texts.number(each.factor_of_sd, 2)}"
            f" ({texts.number(each.interval[0] ** 0.5, 2)} – {texts.number(each.interval[1] ** 0.5, 2)})"
            for each in components.components
            if not each.held
        ]
        said.append(_said(texts, "weights.components", components=", ".join(parts)))
    elif test is not None:
        key = f"weights.{'high' if test.rejected_high else 'low' if test.rejected_low else 'given'}"
        low, high = (texts.number(each, 3) for each in test.limits)
        said.append(_said(texts, key, s2=texts.number(test.variance, 3), low=low, high=high))
    if math.isinf(result.freedom_of_scale):
        return [*said, _said(texts, "weights.known")]
    s2, f = texts.number(result.covariance_scale, 3), texts.number(result.degrees_of_freedom, 0)
    return [*said, _said(texts, "weights.posterior", s2=s2, f=f), _said(texts, "honest.approximate")]


def _adjustment(result: Result, texts: Texts, removed: Sequence[str]) -> list[tuple[str, str]]:
    total, out = int(result.used_images.sum()), len(removed) + len(result.set_aside)
    block = result.block
    held = translation.held(texts, result)
    refraction = translation.refraction(texts, block.refraction, block.linear_unit)
    frame = f"{translation.frame(texts, block.frame)}, {block.linear_unit}"
    return [
        _said(texts, "assume.removed", n=out, all=total + out, percent=texts.percent(out / (total + out)))
        if out
        else _said(texts, "assume.none_removed"),
        _said(texts, "assume.held", held=held) if held else _said(texts, "assume.none_held"),
        _said(texts, "assume.datum", datum=translation.datum(texts, result.datum), frame=frame),
        _said(texts, "assume.refraction", refraction=refraction),
    ]


def _survey(asked: Asked, texts: Texts, found: Compared) -> list[tuple[str, str]]:
    known = np.isfinite(found.survey_sd)
    sizes = [
        float(np.sqrt(np.mean(column[there] ** 2))) if there.any() else float("nan")
        for column, there in zip(found.survey_sd.T, known.T, strict=True)
    ]
    if not found.survey_sd[known].any():
        said = [_said(texts, "assume.survey_exact")]
    else:
        east, north, height = (texts.length(each) for each in sizes)
        said = [_said(texts, "assume.survey", east=east, north=north, height=height)]
    if any(asked.survey_common_sd):
        size = " / ".join(texts.length(each) for each in asked.survey_common_sd)
        key = "assume.common_cancels" if asked.survey_common_in_control else "assume.common"
        said.append(_said(texts, key, size=size))
    said.append(_said(texts, f"assume.independent.{asked.independent or 'undeclared'}"))
    return said
