"""Cross-validation of an adjusted calibration: parts of its views adjusted by themselves, and compared."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, cast

import numpy as np

from photogram.adjustment.adjustment import adjust, adjusted_again
from photogram.arguments.annotations import check_arguments
from photogram.arguments.types import Bools
from photogram.errors import InputError
from photogram.network.cameras import Camera
from photogram.targets.calibration_result import Calibrated
from photogram.targets.cross_validation import CrossValidation, Into, parts_agree, splits
from photogram.targets.housings import camera_number, housed_with, housing_of

if TYPE_CHECKING:
    from photogram.adjustment.robust import Loss
    from photogram.results.result import Result

__all__ = ["cross_validate"]

FEWEST = 3
"""Views of a part."""


def cross_validate(
    result: Calibrated,
    into: Into = "odd",
    camera: int | str = 0,
    *,
    progress: Callable[[str], None] | None = None,
) -> CrossValidation:
    """Adjust parts of the views by themselves, and test whether they agree (docs/targets.md).

    Parameters
    ----------
    result
        The adjusted calibration.
    into
        `odd`: views of even against those of odd numbers. `halves`: the first against the last. A number K:
        each K-th part against the rest.
    camera
        Of cameras that are not tied to each other, the one whose views are split; of a rig any.
    progress
        Is told which part is adjusted.

    Raises
    ------
    InputError
        Fewer than three views in a part; a camera that there is not.
    RankError
        The views of a part do not determine all unknowns.
    """
    if isinstance(into, int) and into < 2:
        raise InputError(f"views are cross-validated in 2 parts or more, not {into}")
    number = camera_number(result, camera)
    cameras = housed_with(result, number)
    names = tuple(result.cameras[each].name for each in cameras)
    corners = result.calibration.corners
    mine = np.isin(corners.cameras, cameras)
    views = np.unique(corners.views[mine])
    parts, tests, housings = [], [], []
    for pair in splits(len(views), into):
        if min(map(len, pair)) < FEWEST:
            raise InputError(f"{len(views)} views are too few for cross-validation by {into}")
        adjusted = []
        for part in pair:
            if progress is not None:
                progress(f"cross-validation: {len(part)} of {len(views)} views")
            adjusted.append(_adjusted(result, mine & np.isin(corners.views, views[part]), cameras))
        a, b = (housing_of(each)[0] for each in adjusted)
        parts.append((tuple(views[pair[0]].tolist()), tuple(views[pair[1]].tolist())))
        tests.append(tuple(parts_agree(a, b, names, _unit(adjusted))))
        housings.append((a, b))
    return CrossValidation(
        into=str(into),
        cameras=names,
        parts=tuple(parts),
        tests=tuple(tests),
        whole=housing_of(result, number)[0],
        housings=tuple(housings),
    )


def _adjusted(whole: Calibrated, pictures: Bools, cameras: list[int]) -> Calibrated:
    """Adjust some pictures by themselves, from the values of the whole and with its priors."""
    given, restarted, priors = whole.calibration, whole.restarted(), whole.result.block.cameras
    corners = given.corners.of_pictures(pictures)
    views = np.unique(given.corners.views[pictures])
    part = given.replace(
        board=given.board.replace(shape=given.shape),
        corners=corners.replace(
            cameras=[cameras.index(each) for each in corners.cameras.tolist()],
            camera_names=[given.corners.camera_names[each] for each in cameras],
            sizes=[given.corners.sizes[each] for each in cameras],
        ),
        cameras=[_freed(whole.cameras[each].camera) for each in cameras],
        sensors=np.asarray(restarted.sensors)[cameras],
        poses=whole.poses[views],
        references=None,
        bend=restarted.bend,
        sd_sensors=np.asarray(given.sd_sensors)[cameras],
        offsets=np.asarray(given.offsets)[cameras],
        sd_offsets=np.asarray(given.sd_offsets)[cameras],
        motion=None if given.motion is None else np.asarray(given.motion)[views],
        regularise=None,
    )
    result = adjust(part.block(), loss=cast("Loss | None", whole.result.options.loss))
    own = [priors[each] for each in cameras]
    if any(_is_weighted(each) for each in own):
        result = cast("Result", adjusted_again(part.block(own), result.options, result.state, threads=None))
    return Calibrated(calibration=part, result=result)


def _freed(camera: Camera) -> Camera:
    """Return a camera whose unknown parameters are free: priors come once it has arrived."""
    unknown = [name for name, sd in zip(camera.names, camera.deviations, strict=True) if sd > 0]
    return camera.replace(sd=dict.fromkeys(unknown, np.inf), covariance=None)


def _is_weighted(camera: Camera) -> bool:
    sd = camera.deviations
    return bool((np.isfinite(sd) & (sd > 0)).any())


def _unit(parts: list[Calibrated]) -> tuple[float, float]:
    """Return the pooled variance of unit weight of parts, and its degrees of freedom."""
    sums, freedoms = zip(*(each.result.sum_and_freedom for each in parts), strict=True)
    return sum(sums) / sum(freedoms), sum(freedoms)


check_arguments(globals(), ["cross_validate"])
