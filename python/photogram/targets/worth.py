"""Assessment of a calibration: uncertainty maps, cross-validation, suggested views."""

from __future__ import annotations

import math

from photogram.lazy_dataclasses import dataclass, field
from photogram.targets.calibration_difference import CameraDifference
from photogram.targets.cross_validation import CrossValidation
from photogram.targets.maps import UncertaintyMap, at_distance
from photogram.targets.new_views import Suggestions
from photogram.words import Phrase, phrase


@dataclass(frozen=True, eq=False, kw_only=True)
class Worth:
    """Assessment of a calibration.

    Attributes
    ----------
    maps
        Uncertainty maps of each camera at each distance.
    cross
        Cross-validations, one for each housing.
    suggestions
        Suggested views for the first camera.
    differences
        Differences from another calibration, by camera.
    remarks
        Results that could not be computed, and reasons.
    """

    maps: tuple[UncertaintyMap, ...] = ()
    cross: tuple[CrossValidation, ...] = ()
    suggestions: tuple[Suggestions, ...] = ()
    differences: tuple[CameraDifference, ...] = ()
    remarks: tuple[Phrase, ...] = field(default=())

    @property
    def largest(self) -> float:
        """Largest standard deviation of all maps in the observed board region, pixels.

        NaN without maps.
        """
        return max((each.largest for each in self.maps), default=math.nan)

    @property
    def sentences(self) -> list[str]:
        """Summary of the assessment, one line per topic."""
        lines = []
        for camera in dict.fromkeys(each.camera for each in self.maps):
            maps = [each for each in self.maps if each.camera == camera]
            sizes = [
                phrase("map.size", size=each.largest, at=at_distance(each.distance, each.unit))
                for each in maps
            ]
            lines.append(str(phrase("map.worst", camera=camera, sizes=sizes, model=maps[0].model)))
        lines += [line for each in self.differences for line in each.sentences]
        for each in self.suggestions:
            lines += [str(phrase("views.line", line=line)) for line in each.sentences]
        return [*lines, *map(str, self.remarks)]
