"""The observations of a collection as groups that may hold a gross error together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.collection.collection import POSE, Collection
from photogram.results.network_trial import CONTROL, IMAGE, KINDS, NamedSuspects, NetworkTrial

__all__ = ["collection_trial"]

ROUGH, EXACT = 1e-7, 1e-12
"""A step that lowers the sum of squares by less than this share ends a round; where R of all rows is used."""


def collection_trial(
    collection: Collection, core: _photocore.NetworkTrial, *, parts: bool = True
) -> NetworkTrial:
    """Return a collection as tests ask it."""
    return NetworkTrial(
        core=core,
        suspects=_Named(collection, core.suspects, parts).suspects(),
        supported=np.asarray(np.isfinite(collection.photo_sd).all(axis=1)),
        rough=ROUGH,
        exact=EXACT,
    )


class _Named(NamedSuspects):
    def __init__(self, collection: Collection, core: _photocore.NetworkSuspects, parts: bool) -> None:
        components = ("XYZ", POSE[3:], POSE[:3])
        super().__init__(collection, core, apart=parts, components=components, lengths=("",) * 3)
        self.parameters = collection.parameters[len(POSE) :]

    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return the rows that may go alone: of control single ones or all, of a station single ones."""
        size = int(self.starts[group + 1] - self.starts[group])
        if not self.apart or int(self.kinds[group]) == IMAGE or size < 2:
            return None
        single = [(row,) for row in range(size)]
        return [*single, tuple(range(size))] if int(self.kinds[group]) == CONTROL else single

    def other_loads(self, kind: int, subject: int) -> Indices:
        """Return the photo whose camera it is."""
        return np.array([subject])

    def other_name(self, kind: int, subject: int) -> str:
        """Return what the camera of a photo is called."""
        return f"{KINDS[kind]} of {self.photo_name(subject)}"

    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]:
        """Return a parameter of a camera."""
        return self.parameters[component], ""
