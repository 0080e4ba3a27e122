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
from photogram.network.block import Block
from photogram.words import phrase

SUSPICION = 0.35  # Misfit m above which photos are examined
PASSES, PASSES_ROUGH, ROUGH = 0.2, 0.3, 0.1
"""Largest ratio of the median misfit if the result is below ROUGH; otherwise initial poses are rough."""
EACH = 0.5
"""Largest ratio for each photo that did not fit, and for the median residual of control."""
AS_GOOD = 1.5  # Another proposal is as good if its misfit is below this multiple of the least


class Predicted:
    """Proposals with which predictions fit, best first; several if the data do not decide.

    `photos` lists the photos with the mistake, empty for all photos; `distance` is their principal distance,
    if they are all photos with it. `change` and `exact` belong to the first proposal.
    """

    def __init__(
        self,
        found: list[tuple[float, Proposal]],
        given: float,
        photos: Sequence[str] = (),
        what: str = "images",
        distance: float | None = None,
    ) -> None:
        found.sort(key=lambda each: each[0])
        least = found[0][0]
        best = [each for misfit, each in found if misfit <= AS_GOOD * least]
        # The same mistake may occur in several forms.
        best = list({str(each.message): each for each in reversed(best)}.values())[::-1]
        self.names = [each.name for each in best]
        self.change, self.exact = best[0].change, best[0].exact
        self.photos, self.distance = photos, distance
        self.before, self.after = given, least
        self.message = phrase(
            f"convention.{'likely' if len(best) == 1 else 'one-of'}",
            causes=[each.message for each in best],
            photos=phrase("convention.photos", n=len(photos), photos=list(photos)) if photos else "",
            misfit=phrase(f"convention.misfit.{what}", misfit=least),
            before=phrase("convention.before", misfit=given) if given < UNKNOWN else "",
        )


def predict(
    proposals: Iterable[Proposal],
    block: Block,
    given: Floats,
    misfits_of: Callable[[Block], Floats],
    **of: Any,
) -> Predicted | None:
    """Return the proposals with which the photos of a block fit, if any.

    `given` are (k,) misfits of the photos. `misfits_of` returns the misfits of a changed block. `of` are
    arguments of :class:`Predicted`.
    """
    found: dict[str, tuple[float, Proposal]] = {}
    for proposal in proposals:
        left = misfits_of(proposal.change(block))
        ratio, median = left / given, float(np.median(left))
        limit = PASSES_ROUGH if median > ROUGH else PASSES
        each = (ratio < EACH) | (np.maximum(left, given) < SUSPICION)
        if np.median(ratio) < limit and each.all() and median < SUSPICION:
            now = (median, proposal)
            found[proposal.name] = min(found.get(proposal.name, now), now, key=lambda each: each[0])
    return Predicted([*found.values()], float(np.median(given)), **of) if found else None
