"""The basis and the assumptions of a statement, as lines with values of the run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.network.refraction import Refraction
from photogram.results.statement.budget import Budget
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import Figures, root_mean
from photogram.results.statement.layout import Layout
from photogram.results.statement.leave_one_out import LeftOut
from photogram.results.statement.request import Asked
from photogram.results.statement.standards import Standards
from photogram.results.statement.texts import Texts
from photogram.words import Phrase

if TYPE_CHECKING:
    from photogram import Result

MAX_FIXED_VALUES = 20  # Number of fixed values in a sentence
Said = list[tuple[str, str]]  # Codes and texts


@dataclass(frozen=True)
class RemovedObservation:
    """An observation that was not used in the adjustment.

    Attributes
    ----------
    subject
        Its name as a message, such as `image of point C04 on photo 301`.
    reason
        `snooping`: data snooping removed it. `first values`: it does not fit the initial values. `earlier`:
        it was removed before.
    """

    subject: Phrase | str
    reason: str

    @property
    def name(self) -> str:
        """Its name in English."""
        return str(self.subject)


def removed_observations(result: Result, earlier: Sequence[Phrase | str]) -> tuple[RemovedObservation, ...]:
    """Return all removed observations, with those removed `earlier`."""
    snooped = () if result.snooped is None else [each["subject"] for each in result.snooped.removed]
    of_reason = {"snooping": snooped, "first values": result.set_aside, "earlier": earlier}
    return tuple(RemovedObservation(name, reason) for reason, names in of_reason.items() for name in names)


@dataclass(frozen=True, eq=False, repr=False)
class Grounds:
    """All findings on an adjusted block and its check points, with the request.

    Attributes
    ----------
    result, asked, texts
        The adjusted block, the request, and its texts.
    compared
        Check points with their joint covariance.
    of_all, of_rest, of_vegetated
        Figures of all check points, without excluded ones, and of heights in vegetation; None without any.
    left_out
        Control points predicted by the others.
    taken_apart
        Budgets of uncertainty.
    standards
        Results by standards.
    layout
        The distribution of check points; None without any.
    removed
        Observations that were not used in the adjustment.
    """

    result: Result
    asked: Asked
    texts: Texts
    compared: Compared
    of_all: Figures | None
    of_rest: Figures | None
    of_vegetated: Figures | None
    left_out: tuple[LeftOut, ...]
    taken_apart: tuple[Budget, ...]
    standards: Standards
    layout: Layout | None
    removed: tuple[RemovedObservation, ...]


def assumptions(found: Grounds, assumed: Sequence[Phrase | str]) -> Said:
    """Return the assumptions in reading files, and on removed observations."""
    asked, texts, layout, lengths = found.asked, found.texts, found.layout, found.standards.lengths
    said = [*_weights(found)]
    said += [texts.said("assume.read", said=each) for each in assumed]
    said += [*_adjustment(found)]
    if len(found.compared):
        said += _survey(found)
        if found.compared.step > 1:
            said.append(texts.said("assume.taken", all=found.compared.known, step=found.compared.step))
        said.append(texts.said("assume.heights"))
        if "asprs-2023" in asked.standards:
            said.append(texts.said("assume.slopes"))
    if layout is not None:
        quadrants, diagonal = map(texts.percent, layout.quadrants), texts.length(layout.diagonal, 3)
        fields = {"quadrants": " / ".join(quadrants), "spacing": layout.least_spacing, "diagonal": diagonal}
        said.append(texts.said("assume.layout", n=layout.count, **fields))
    if lengths is not None and lengths.expansion is not None:
        said.append(texts.said("lengths.reference", expansion=texts.significant(lengths.expansion, 3)))
    return [*said, texts.said("assume.not_covered")]


def _weights(found: Grounds) -> Said:
    result, texts, said = found.result, found.texts, Said()
    test, components = result.global_test, found.asked.components
    if components is not None:
        parts = [
            f"{texts.kind(each.name)} x {texts.number(each.factor_of_sd, 2)}"
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


def _adjustment(found: Grounds) -> Said:
    result, texts = found.result, found.texts
    total, out = int(result.used_images.sum()), len(found.removed)
    block = result.block
    held = fixed_values(texts, result)
    refraction = (block.refraction or Refraction()).phrase(block.linear_unit)
    frame = f"{texts.text(block.frame.phrase)}, {block.linear_unit}"
    return [
        texts.said("assume.removed", n=out, all=total + out, percent=out / (total + out))
        if out
        else texts.said("assume.none_removed"),
        texts.said("assume.held", held=held) if held else texts.said("assume.none_held"),
        texts.said("assume.datum", datum=result.datum.phrase, frame=frame),
        texts.said("assume.refraction", refraction=refraction),
    ]


def _survey(found: Grounds) -> Said:
    asked, texts, sd = found.asked, found.texts, found.compared.survey_sd
    if not sd[np.isfinite(sd)].any():
        said = [texts.said("assume.survey_exact")]
    else:
        east, north, height = (root_mean(column**2) for column in sd.T)
        said = [texts.said("assume.survey", east=east, north=north, height=height)]
    if any(asked.survey_common_sd):
        size = " / ".join(texts.length(each) for each in asked.survey_common_sd)
        key = "assume.common_cancels" if asked.survey_common_in_control else "assume.common"
        said.append(texts.said(key, size=size))
    said.append(texts.said(f"assume.independent.{asked.independent or 'undeclared'}"))
    return said


def fixed_values(texts: Texts, result: Result) -> str:
    """Return the names of fixed points, photos and parameters; empty without any."""
    block = result.block
    points = (block.point_sd == 0).any(axis=1)
    photos = (block.photo_position_sd == 0).any(axis=1) | (block.photo_attitude_sd == 0).any(axis=1)
    names = [texts("held.point", name=block.point_ids[row]) for row in np.flatnonzero(points)]
    names += [texts("held.photo", name=block.photo_ids[row]) for row in np.flatnonzero(photos)]
    for camera in result.cameras:
        fixed = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if not sd > 0]
        if fixed:
            names.append(texts("held.camera", parameters=", ".join(fixed), name=camera.name))
    return texts.listed(names, MAX_FIXED_VALUES) if names else ""
