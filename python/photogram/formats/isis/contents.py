"""What a control network and its images are beyond their block."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.csm.photos import SupportedImage
from photogram.formats.isis.network import ControlNetwork
from photogram.formats.isis.settings import Settings
from photogram.formats.isis.solving import Solving
from photogram.lazy_dataclasses import dataclass

DETAILS = "control network"
PITCHES = 1.4
"""Standard deviation of image coordinates, in pixels of the detector."""


@dataclass(frozen=True, eq=False)
class Image:
    """An image of a network: its serial number, file, support data with photos, and what is adjusted."""

    serial: str
    path: Path
    supported: SupportedImage
    solving: Solving

    @property
    def pitch(self) -> float:
        """The side of a pixel of the detector in millimetres."""
        (x, y), _ = self.supported.isd.detector.planes["isis"].matrix.T
        return float((x * x + y * y) ** 0.5)


@dataclass(frozen=True, eq=False)
class PlanetaryContents:
    """A network as it was read, its images that have measures by the names of photos, and how it is adjusted.

    `starts` are (N, 3) X, Y, Z in metres where all its points begin; NaN for those that do not count.
    """

    network: ControlNetwork
    path: Path
    images: Mapping[str, Image]
    settings: Settings
    starts: Floats

    @property
    def different(self) -> list[Image]:
        """The images, each once: a push frame camera has several photos in one."""
        return list(dict.fromkeys(self.images.values()))


def rows_of_each(values: NDArray[np.integer[Any]], count: int) -> list[Indices]:
    """Return where each of the whole numbers below `count` stands among values."""
    order = np.argsort(values, kind="stable")
    return np.split(order, np.searchsorted(values[order], np.arange(1, count)))


def contents_of(details: Mapping[str, Any]) -> PlanetaryContents:
    """Return the contents of a project; an error where it was not read from a control network."""
    found = details.get(DETAILS)
    if not isinstance(found, PlanetaryContents):
        raise InputError("the project was not read from a control network")
    return found
