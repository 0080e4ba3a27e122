"""Evaluation of proposals by prediction: the misfit of a changed block relative to that of the given data.

Rough initial poses suffice; an adjustment would not converge, or would reject what is right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.diagnosis.mistakes import Proposal
from photogram.diagnosis.regression import UNKNOWN
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.words import Phrase, phrase

SUSPICION = 0.35  # Misfit m above which photos are examined
PASSES, PASSES_ROUGH, ROUGH = 0.2, 0.3, 0.1
"""Largest ratio of the median misfit if the result is below ROUGH; otherwise initial poses are rough."""
EACH = 0.5
"""Largest ratio for each photo that did not fit, and for the median residual of control."""
AS_GOOD = 1.5  # Another proposal is as good if its misfit is below this multiple of the least


@dataclass(frozen=True, eq=False)
class Predicted:
    """Proposals with which predictions fit, best first; several if the data do not decide."""

    best: list[Proposal]
    before: float  # Median misfit of the given and of the corrected data
    after: float
    photos: Sequence[str] = ()  # With the mistake; empty for all photos
    what: str = "images"
    distance: float | None = None  # Principal distance of these photos, if they are all photos with it

    @property
    def names(self) -> list[str]:
        """Names of the mistakes."""
        return [each.name for each in self.best]

    @property
    def message(self) -> Phrase:
        """The message on the mistakes."""
        photos = list(self.photos)
        return phrase(
            f"convention.{'likely' if len(self.best) == 1 else 'one-of'}",
            causes=[each.message for each in self.best],
            photos=phrase("convention.photos", n=len(photos), photos=photos) if photos else "",
            misfit=phrase(f"convention.misfit.{self.what}", misfit=self.after),
            before=phrase("convention.before", misfit=self.before) if self.before < UNKNOWN else "",
        )


def predict(
    proposals: Iterable[Proposal], block: Block, misfits_of: Callable[[Block], Floats], **of: Any
) -> Predicted | None:
    """Return the proposals with which the photos of a block fit, if they do not fit without.

    `misfits_of` returns the (k,) misfits of a changed block. `of` are members of :class:`Predicted`.
    """
    given = misfits_of(block)
    before = float(np.median(given)) if len(given) else 0.0
    if not before > SUSPICION:
        return None
    found: dict[str, tuple[float, Proposal]] = {}
    for proposal in proposals:
        left = misfits_of(proposal.change(block))
        ratio, median = left / given, float(np.median(left))
        limit = PASSES_ROUGH if median > ROUGH else PASSES
        each = (ratio < EACH) | (np.maximum(left, given) < SUSPICION)
        if np.median(ratio) < limit and each.all() and median < SUSPICION:
            # The same mistake may occur in several forms.
            key = str(proposal.message) if proposal.exact else proposal.name
            found[key] = min(found.get(key, (np.inf, proposal)), (median, proposal), key=lambda own: own[0])
    if not found:
        return None
    after = min(misfit for misfit, _ in found.values())
    best = sorted(found.values(), key=lambda own: own[0])
    return Predicted([own for misfit, own in best if misfit <= AS_GOOD * after], before, after, **of)
