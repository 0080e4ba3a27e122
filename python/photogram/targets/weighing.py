"""Whether corners are as good as they are said to be: variance components by camera, level, picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from photogram.adjustment.components import variance_components
from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.results.components import VarianceComponents
from photogram.results.grouping import GroupsArgument
from photogram.targets.adjusting import weighted_block
from photogram.targets.calibration_result import Calibrated

__all__ = ["CornerBasis", "corner_components"]

CornerBasis = Literal["kind", "camera", "level", "photo", "component", "rays"]


def corner_components(
    result: Calibrated,
    by: Sequence[CornerBasis] = ("camera",),
    *,
    threads: int | None = None,
    progress: Callable[[int, Floats], None] | None = None,
) -> VarianceComponents:
    """Estimate by which factors standard deviations of groups of corners are wrong (docs/weights.md).

    Parameters
    ----------
    result
        The adjusted calibration. Weak priors of cameras, those of knots apart, do not take part.
    by
        What groups are made by: `camera`, `level` of the detector, both, or those of
        :func:`photogram.variance_components`. Points of a board that have weights are a group.
    threads, progress
        As of :func:`photogram.variance_components`.

    Raises
    ------
    InputError
        Another word, or levels together with anything but cameras.
    RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
        As of :func:`photogram.variance_components`.
    """
    start = result.restarted()
    if not any(each.knot_unknowns for each in start.cameras):
        start = start.replace(regularise=None)
    block = weighted_block(start)
    groups: GroupsArgument = list(by)
    if "level" in by:
        if others := [each for each in by if each not in ("level", "camera")]:
            raise InputError(f"groups by level go with those by camera, not by {', '.join(others)}")
        levels = np.log2(block.image_sd[:, 0] / block.image_sd.min()).round().astype(int).tolist()
        names = [f"level {level}" for level in levels]
        if "camera" in by:
            assert block.photo_cameras is not None
            own = block.photo_cameras[block.image_photos].tolist()
            names = [f"{block.camera_names[k]}, {name}" for k, name in zip(own, names, strict=True)]
        groups = {"images": names}
    return variance_components(block, groups, threads=threads, progress=progress)


check_arguments(globals(), ["corner_components"])
