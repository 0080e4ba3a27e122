"""Uncertainty of a calibration: maps, cross-validation, views to take next."""

from __future__ import annotations

import math
from collections.abc import Sequence

from photogram.lazy_dataclasses import dataclass, field
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.cross_validation import CrossValidation, Into
from photogram.targets.maps import UncertaintyMap, distance_text
from photogram.targets.new_views import Suggestions
from photogram.targets.projection import DatumName
from photogram.words import Phrase


@dataclass(frozen=True)
class WorthOptions:
    """What is asked of a calibration.

    Attributes
    ----------
    distances
        At which maps are drawn, in the unit of the board; none: infinity, and the boards' median distance.
    datum, noise_only
        Of maps.
    cross_validate
        How views are split; None: they are not.
    suggest
        How many views to take next are looked for.
    grid
        Of maps, pixels across and down.
    """

    distances: Sequence[float] = ()
    datum: DatumName = "corners"
    noise_only: bool = False
    cross_validate: Into | None = "odd"
    suggest: int = 0
    grid: tuple[int, int] = (60, 40)


@dataclass(frozen=True, eq=False, kw_only=True)
class Worth:
    """What a calibration is worth.

    Attributes
    ----------
    maps
        Of each camera at each distance.
    cross
        Cross-validations, one for each housing.
    suggestions
        Views to take next, for the first camera.
    differences
        From another calibration, camera by camera.
    remarks
        What could not be computed, and why.
    """

    maps: tuple[UncertaintyMap, ...] = ()
    cross: tuple[CrossValidation, ...] = ()
    suggestions: tuple[Suggestions, ...] = ()
    differences: tuple[CameraDifference, ...] = ()
    remarks: tuple[Phrase, ...] = field(default=())

    @property
    def largest(self) -> float:
        """Largest standard deviation of all maps where the board was seen, pixels; NaN without maps."""
        return max((each.largest for each in self.maps), default=math.nan)

    @property
    def sentences(self) -> list[str]:
        """What a reader wants first, a line for each thing."""
        lines = []
        for camera in dict.fromkeys(each.camera for each in self.maps):
            maps = [each for each in self.maps if each.camera == camera]
            largest = ", ".join(
                f"{each.largest:.2g} px {distance_text(each.distance, each.unit)}" for each in maps
            )
            lines.append(f"{camera}: worst where the board was seen {largest}; {maps[0].model}")
        lines += [line for each in self.differences for line in each.sentences]
        for each in self.suggestions:
            lines += [f"view to take next: {line}" for line in each.sentences]
        return [*lines, *map(str, self.remarks)]
