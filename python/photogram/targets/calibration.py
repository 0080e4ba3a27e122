"""Target calibration with initial values, its adjustment and simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from photogram.adjustment.adjustment import Progress, adjust, adjusted_again
from photogram.adjustment.robust import Loss
from photogram.adjustment.snooping import snoop
from photogram.arguments.arrays import argument_error, one_of
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError, RankError
from photogram.messages import Message
from photogram.network.cameras import images_of
from photogram.results.result import Result
from photogram.results.snooping_options import SnoopOptions
from photogram.targets.calibration_result import Calibrated
from photogram.targets.findings import deviation_of_corners, judged, with_unknown_weight
from photogram.targets.housing import transformed
from photogram.targets.motion import dated, errors_of_speeds
from photogram.targets.regularisation import weighted_block
from photogram.targets.start import Start
from photogram.targets.vision import FLIP, photo_poses
from photogram.words import phrase


class Calibration(Start):
    """Board corners in images of K cameras with initial values: the adjustment input.

    Parameters
    ----------
    board
        The board.
    corners
        Its corners in P images and V views. Images with fewer than 6 corners, or with collinear ones, are
        omitted and listed in `messages`.
    cameras
        K cameras in pixels, with origin at the centre of the first. Free parameters have initial values.
    poses
        (V, 4, 4) of the views: board -> reference of the cameras that took the images of the view. Vision
        axes: x right, y down, z forward.
    sensors
        (K, 4, 4) reference -> camera k; None: one camera, or independent cameras.
    references
        (K,) the reference camera of each sensor. None: camera 0. For unsynchronised images, each camera is
        its own reference.
    sd0
        Standard deviation of a corner of level 0, pixels. None: unknown; the adjustment estimates it, and
        global tests are omitted.
    sync
        `known`: images of one view are simultaneous. `none`: every image has its own pose. `offset`: corners
        have times by the clock of each camera. An image of camera k with time t shows the board pose at t +
        tau_k by the clock of its reference (docs/targets.md).
    regularise
        `mrcal`: the weak priors of mrcal 2.2 on lens terms and centres. None: no priors.
    bend
        Initial centre deflections of the board along x and y for the shape `bend`, and fixed ones for the
        shape `held`.
    messages
        Warnings of the reader.
    assumed
        If `sd0` is None: standard deviation of a corner, pixels, relative to weighted board points. The
        adjustment estimates it.
    offsets, sd_offsets
        (K,) for `offset`: prior values of tau_k and their standard deviations, seconds; infinite: free.
    motion
        (V, 4, 6) for `offset`: motion of reference photos at the time of each view, as coefficients of powers
        1 to 4 of time. Positions are in the board axes, rotation vectors in the photo axes. None:
        interpolated from the poses of the views before and after.
    sd_sensors, sd_bend
        (K, 6) and (2,) standard deviations of `sensors` and `bend`; infinite: free. The sensor components
        follow :class:`photogram.network.Sensor`: position in the axes of the reference, rotations about its
        own axes in radians.

    Raises
    ------
    InputError
        If arrays have other shapes, if points are missing on the board, or if images lack used corners. If
        several cameras of a rig lack sensors. For `offset`, if image times are missing, or if all views lack
        neighbours within 0.2 s.
    """

    def adjust(
        self,
        *,
        loss: Loss | None = None,
        outliers: Literal["mrcal"] | None = None,
        threads: int | None = None,
        progress: Callable[[Progress], None] | None = None,
    ) -> Calibrated:
        """Adjust cameras, sensors, views and the board together.

        Parameters
        ----------
        loss, threads, progress
            As in :func:`photogram.adjust`.
        outliers
            `mrcal`: remove outlying corners and readjust as in mrcal (docs/targets.md).

        Raises
        ------
        RankError
            If the corners do not determine all unknowns, which the message names. With offsets, if the board
            hardly moves.
        AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As in :func:`photogram.adjust`.
        InputError
            If priors require an unknown image size.
        """
        if outliers is not None:
            one_of("outliers", outliers, ("mrcal",))
        how: dict[str, Any] = {
            "loss": loss,
            "threads": threads,
            "progress": progress,
            "covariance": "verdict",
        }
        start: Start = self
        rounds = 0
        while True:
            # Only priors determine knots without image observations.
            free = None if _has_knots(start) else adjust(start.block(), **how)
            if free is None:
                result = adjust(weighted_block(start), **how, tolerance=SPLINE_TOLERANCE)
            elif start.regularise is None:
                result = free
            else:
                again = adjusted_again(weighted_block(start), free.options, free.state, threads=threads)
                assert isinstance(again, Result)
                result = again
            worse = marked_as_mrcal(result) if outliers else np.zeros(len(result.residuals), dtype=bool)
            if worse.any() and result.converged:
                start = start.without(worse)
            elif rounds < MAX_ROUNDS and (better := _better(start, result)) is not None:
                start, rounds = better, rounds + 1
            else:
                break
        messages = [*start.messages, *result.messages]
        if start.sync == "offset":
            messages += checked_clocks(Calibrated(calibration=start, result=result))
        result = replace(result, messages=messages)
        if start.sd0 is None:
            result = with_unknown_weight(result)
        before = free if start.regularise else None
        return judged(Calibrated(calibration=start, result=result, unregularised=before))

    def snoop(self, options: SnoopOptions | None = None, **changes: Any) -> Calibrated:
        """Remove gross errors one by one by data snooping, and adjust the rest.

        Parameters
        ----------
        options, changes
            As in :func:`photogram.snoop`.

        Raises
        ------
        InputError
            If cameras have priors, which data snooping does not support.
        RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As in :func:`photogram.snoop`.
        """
        if self.regularise is not None and not _has_knots(self):
            raise InputError(phrase("targets.priors"))
        start = self.adjust().calibration if self.sync == "offset" else self
        snooped = snoop(weighted_block(start), options, **changes)
        result = snooped.result
        assert isinstance(result, Result)
        rest = start.with_images_of(result.block)
        result = replace(result, messages=[*rest.messages, *result.messages])
        return judged(Calibrated(calibration=rest, result=result, snooped=snooped))


MAX_ROUNDS = 8
MIN_CHANGE = 0.01  # relative change of corner sd, and pose change in standard deviations
SPLINE_TOLERANCE = 1e-6  # convergence limit of splined lenses, in standard deviations


def _better(start: Start, result: Result) -> Start | None:
    """Return a start with updated corner sd or board motion; None if both are stable."""
    better = start if start.sync != "offset" or not result.converged else _in_motion(start, result)
    if start.sd0 is None and start.shape == "points" and result.converged:
        change = deviation_of_corners(result)
        sd = start.assumed * change
        if abs(change - 1) > MIN_CHANGE and sd > 1e-6:  # else simulated without errors
            better = better.replace(assumed=sd)
    return None if better is start else better


def _in_motion(start: Start, result: Result) -> Start:
    """Return the calibration with motion from adjusted poses, if that changes it."""
    ended = Calibrated(calibration=start, result=result)
    again = ended.restarted().replace(motion=None)
    # Image positions with the new motion, everything else as adjusted.
    late = {name: each.values[0] for name, each in ended.offsets.items()}
    there = again.replace(
        sensors=ended.sensors, offsets=[late.get(each.name, 0.0) for each in ended.cameras]
    ).picture_poses()
    pictures = slice(len(start.corners.pictures))
    gaps = np.abs(photo_poses(there)[0] - result.photo_positions[pictures])
    return start if (gaps <= MIN_CHANGE * result.photo_sd[pictures, :3]).all() else again


def _has_knots(start: Start) -> bool:
    return any(each.knot_unknowns for each in start.cameras)


NOTABLE_POSE_ERROR, MAX_POSE_ERROR = 0.01, 0.2  # relative motion errors: warning, error for a free offset


def checked_clocks(calibrated: Calibrated) -> list[Message]:
    """Return messages on the accuracy of the motion that determines clock offsets.

    Speeds follow from poses with errors: v = v_true + e. The offset is too small by the ratio of E(e'e) to
    v'v, weighted by the poses. Its standard deviation is too small as well.
    """
    messages = []
    start, result = calibrated.calibration, calibrated.result
    corners, sd = start.corners, np.asarray(start.sd_offsets)
    shares = _shares(calibrated)
    for camera, each in enumerate(calibrated.cameras):
        if each.name not in calibrated.offsets or sd[camera] == 0:
            continue
        views = np.unique(corners.views[corners.cameras == camera])
        share = float(shares[0, views].sum() / shares[1, views].sum())
        if share > MAX_POSE_ERROR and np.isinf(sd[camera]):
            photos = [result.block.photo_ids[row] for row in calibrated.photos[views].tolist()]
            what = str(phrase("targets.offset", camera=each.name))
            message = phrase("targets.offset.weigh", camera=each.name, share=share)
            raise RankError(message, photos, [], [each.name], what)
        if share > NOTABLE_POSE_ERROR:
            messages.append(Message(phrase("targets.offset.small", camera=each.name, share=share)))
    return messages


def _shares(calibrated: Calibrated) -> Floats:
    """Return (2, V): expected squared speeds from pose errors, and observed ones."""
    start, result = calibrated.calibration, calibrated.result
    steps = ("step", [result.block.photo_ids[row] for row in calibrated.photos.tolist()])
    joint = result.covariance([steps]) / result.covariance_scale
    count = len(calibrated.photos)
    own = joint.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count)]
    speeds = np.nan_to_num(np.asarray(start.motion)[:, 0])
    there = np.einsum("vi,vi->v", speeds, np.linalg.solve(own, speeds[..., np.newaxis])[..., 0])
    by_errors = errors_of_speeds(dated(start.corners, start.tied), start.references_of_views())
    return np.stack([6 * np.nan_to_num(by_errors) * result.covariance_scale, there])


REMOVAL_FACTOR, OUTLIER_FACTOR = 5.0, 4.0  # multiples of the rms: start of removal, removed corners


def marked_as_mrcal(result: Result) -> Bools:
    """Return (m,) the images that mrcal removes, to reproduce its results.

    If a weighted residual exceeds 5 rms, all above 4 rms are removed. Data snooping tests each corner by its
    own precision.
    """
    weighted = np.abs(result.residuals / result.image_given_sd)
    rms = np.sqrt(np.nanmean(weighted**2))
    far = np.nanmax(weighted, axis=1, initial=0.0)
    return (
        far > OUTLIER_FACTOR * rms if (far > REMOVAL_FACTOR * rms).any() else np.zeros(len(far), dtype=bool)
    )


def simulate_corners(calibration: Calibration, seed: int = 1) -> Calibration:
    """Simulate corners from the values of a calibration, with random errors.

    For the shape `points`, board points are drawn about their nominal positions, once for all views.

    Parameters
    ----------
    calibration
        True cameras, poses and sensors. The set of corners is unchanged.
    seed
        The same seed gives the same errors.

    Raises
    ------
    InputError
        If the corner standard deviation is unknown, or if a corner is not imaged with these values.
    """
    if calibration.sd0 is None:
        raise argument_error("sd0", "empty")
    random = np.random.default_rng(seed)
    corners = calibration.corners
    places = calibration.places().copy()
    if calibration.shape == "points":
        places += calibration.board.deviations(corners.view_count) * random.standard_normal(places.shape)
    poses = calibration.picture_poses()
    seen = transformed(poses[corners.picture], places[corners.point])
    xy = images_of(calibration.cameras, corners.cameras[corners.picture], seen @ FLIP)
    if not np.isfinite(xy).all():
        row = int(np.argmin(np.isfinite(xy).all(axis=1)))
        raise InputError(phrase("targets.no-image", corner=corners.title(row)))
    errors = calibration.sd0 * corners.sd[:, np.newaxis] * random.standard_normal(xy.shape)
    return calibration.replace(corners=corners.replace(xy=xy + errors))
