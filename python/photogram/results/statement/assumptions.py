"""What a statement assumes, each a line that is filled from the run."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.results.components import VarianceComponents
from photogram.results.result import Result
from photogram.results.statement import translation
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import root_mean
from photogram.results.statement.layout import Layout
from photogram.results.statement.request import Asked
from photogram.results.statement.standards import Lengths
from photogram.results.statement.texts import Texts


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
    said += [texts.said("assume.read", said=translation.read(texts, each)) for each in assumed]
    said += [*_adjustment(result, texts, removed)]
    if len(found):
        said += _survey(asked, texts, found)
        if found.step > 1:
            said.append(texts.said("assume.taken", all=found.known, step=found.step))
        said.append(texts.said("assume.heights"))
        if "asprs-2023" in asked.standards:
            said.append(texts.said("assume.slopes"))
    if layout is not None:
        fields = {
            "quadrants": " / ".join(texts.percent(each) for each in layout.quadrants),
            "spacing": texts.percent(layout.least_spacing),
            "diagonal": texts.length(layout.diagonal, 3),
        }
        said.append(texts.said("assume.layout", n=layout.count, **fields))
    if lengths is not None and lengths.expansion is not None:
        said.append(texts.said("lengths.reference", expansion=texts.significant(lengths.expansion, 3)))
    return [*said, texts.said("assume.not_covered")]


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
        said.append(texts.said("weights.components", components=", ".join(parts)))
    elif test is not None:
        key = f"weights.{'high' if test.rejected_high else 'low' if test.rejected_low else 'given'}"
        low, high = (texts.number(each, 3) for each in test.limits)
        said.append(texts.said(key, s2=texts.number(test.variance, 3), low=low, high=high))
    if math.isinf(result.freedom_of_scale):
        return [*said, texts.said("weights.known")]
    s2, f = texts.number(result.covariance_scale, 3), texts.number(result.degrees_of_freedom, 0)
    return [*said, texts.said("weights.posterior", s2=s2, f=f), texts.said("honest.approximate")]


def _adjustment(result: Result, texts: Texts, removed: Sequence[str]) -> list[tuple[str, str]]:
    total, out = int(result.used_images.sum()), len(removed) + len(result.set_aside)
    block = result.block
    held = translation.held(texts, result)
    refraction = translation.refraction(texts, block.refraction, block.linear_unit)
    frame = f"{translation.frame(texts, block.frame)}, {block.linear_unit}"
    return [
        texts.said("assume.removed", n=out, all=total + out, percent=texts.percent(out / (total + out)))
        if out
        else texts.said("assume.none_removed"),
        texts.said("assume.held", held=held) if held else texts.said("assume.none_held"),
        texts.said("assume.datum", datum=translation.datum(texts, result.datum), frame=frame),
        texts.said("assume.refraction", refraction=refraction),
    ]


def _survey(asked: Asked, texts: Texts, found: Compared) -> list[tuple[str, str]]:
    known = np.isfinite(found.survey_sd)
    if not found.survey_sd[known].any():
        said = [texts.said("assume.survey_exact")]
    else:
        east, north, height = (texts.length(root_mean(column**2)) for column in found.survey_sd.T)
        said = [texts.said("assume.survey", east=east, north=north, height=height)]
    if any(asked.survey_common_sd):
        size = " / ".join(texts.length(each) for each in asked.survey_common_sd)
        key = "assume.common_cancels" if asked.survey_common_in_control else "assume.common"
        said.append(texts.said(key, size=size))
    said.append(texts.said(f"assume.independent.{asked.independent or 'undeclared'}"))
    return said
