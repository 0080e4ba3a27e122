"""A calibration as users have it: corners of a board with values to start from, adjusted or simulated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from photogram.adjustment.adjustment import Progress, adjust, adjusted_again
from photogram.adjustment.robust import Loss
from photogram.adjustment.snooping import snoop
from photogram.arguments.annotations import check_arguments
from photogram.arguments.arrays import argument_error, one_of
from photogram.arguments.types import Bools, Floats
from photogram.errors import InputError, RankError
from photogram.messages import Message
from photogram.network.cameras import images_of
from photogram.results.result import Result
from photogram.targets.calibration_result import Calibrated
from photogram.targets.findings import judged
from photogram.targets.housing import transformed
from photogram.targets.motion import dated, errors_of_speeds
from photogram.targets.regularisation import weighted_block
from photogram.targets.start import Start
from photogram.targets.unknown_weight import deviation_of_corners, with_unknown_weight
from photogram.targets.vision import FLIP, photo_poses
from photogram.words import phrase


class Calibration(Start):
    """Corners of a board in pictures of K cameras, with values to start from: what is adjusted.

    Parameters
    ----------
    board
        The board.
    corners
        Its corners in P pictures, in V views. Pictures with fewer than 6, or whose corners lie on one line,
        are left out; `messages` name them.
    cameras
        K cameras in pixels, counted from 0 at the centre of the first; free parameters start where they are.
    poses
        (V, 4, 4) of the views: board -> reference of the cameras that took the pictures of the view. Vision
        axes: x right, y down, z forward.
    sensors
        (K, 4, 4) reference -> camera k; None: one camera, or none that is tied to another.
    references
        (K,) the camera that each one's sensor counts from. None: camera 0. Where images are not synchronised,
        each itself.
    sd0
        Standard deviation of a corner of level 0, pixels. None: it is not known; the adjustment estimates it,
        and nothing tests it.
    sync
        `known`: pictures of one view were taken at one time. `none`: every picture has a pose of its own.
        `offset`: corners have times, by the clock of each camera; a picture of camera k that is dated t shows
        the board where it is at t + tau_k by the clock of its reference (docs/targets.md).
    regularise
        `mrcal`: the weak priors that mrcal 2.2 gives lens terms and centres. None: no priors.
    bend
        Deflections in the middle of the board along x and y that `bend` starts from, and with which a board
        of the shape `held` is held.
    messages
        Remarks of whoever read it.
    assumed
        Where `sd0` is None: the standard deviation of a corner, pixels, that weighted points of the board are
        weighed against; the adjustment finds it.
    offsets, sd_offsets
        (K,) of `offset`: what is given of tau_k, and its standard deviations, seconds; infinite: free.
    motion
        (V, 4, 6) of `offset`: how photos of the reference move about the time of each view, as coefficients
        of powers 1 to 4 of time: positions in the axes of the board, rotation vectors about those of the
        photo. None: through the poses of the views before and after.
    sd_sensors, sd_bend
        (K, 6) and (2,) standard deviations with which `sensors` and `bend` are known, infinite: free. Of
        sensors those of :class:`photogram.network.Sensor`: its position in the axes of the
        reference, rotations about its own axes in radians.

    Raises
    ------
    InputError
        Arrays of other shapes, points that the board does not have, pictures without corners that count,
        several cameras on a rig without sensors; of `offset`, pictures without times, no view between others
        within 0.2 s.
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
            As of :func:`photogram.adjust`.
        outliers
            `mrcal`: corners are taken out, and all is adjusted again, as mrcal does it (docs/targets.md).

        Raises
        ------
        RankError
            The corners do not determine all unknowns: names them. Of offsets: the board hardly moves.
        AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As of :func:`photogram.adjust`.
        InputError
            Priors without the size of pictures.
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
            # Knots that no image touches are determined by priors alone.
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

    def snoop(self, **options: Any) -> Calibrated:
        """Take gross errors out one after the other, and adjust what is left.

        Parameters
        ----------
        options
            Those of :func:`photogram.snoop`.

        Raises
        ------
        InputError
            Priors of cameras, which snooping does not take.
        RankError, AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As of :func:`photogram.snoop`.
        """
        if self.regularise is not None and not _has_knots(self):
            raise InputError(phrase("targets.priors"))
        start = self.adjust().calibration if self.sync == "offset" else self
        snooped = snoop(weighted_block(start), **options)
        result = snooped.result
        assert isinstance(result, Result)
        rest = start.with_images_of(result.block)
        result = replace(result, messages=[*rest.messages, *result.messages])
        return judged(Calibrated(calibration=rest, result=result, snooped=snooped))


MAX_ROUNDS = 8
MIN_CHANGE = 0.01  # of the standard deviation of corners, and of poses in standard deviations
SPLINE_TOLERANCE = 1e-6  # convergence limit of splined lenses, in standard deviations


def _better(start: Start, result: Result) -> Start | None:
    """Return a start with another sd of corners or motion of the board; None if neither changes."""
    better = start if start.sync != "offset" or not result.converged else _in_motion(start, result)
    if start.sd0 is None and start.shape == "points" and result.converged:
        change = deviation_of_corners(result)
        sd = start.assumed * change
        if abs(change - 1) > MIN_CHANGE and sd > 1e-6:  # corners that fit to the last digit are simulated
            better = better.replace(assumed=sd)
    return None if better is start else better


def _in_motion(start: Start, result: Result) -> Start:
    """Return a calibration whose board moves as its adjusted poses say; itself where this changes nothing."""
    ended = Calibrated(calibration=start, result=result)
    again = ended.restarted().replace(motion=None)
    # Where the new motion has pictures, with everything else as adjusted.
    late = {name: each.values[0] for name, each in ended.offsets.items()}
    there = again.replace(
        sensors=ended.sensors, offsets=[late.get(each.name, 0.0) for each in ended.cameras]
    ).picture_poses()
    pictures = slice(len(start.corners.pictures))
    gaps = np.abs(photo_poses(there)[0] - result.photo_positions[pictures])
    return start if (gaps <= MIN_CHANGE * result.photo_sd[pictures, :3]).all() else again


def _has_knots(start: Start) -> bool:
    return any(each.knot_unknowns for each in start.cameras)


NOTABLE_POSE_ERROR, MAX_POSE_ERROR = 0.01, 0.2  # shares of the motion: remark, error if an offset is free


def checked_clocks(calibrated: Calibrated) -> list[Message]:
    """Return what is to be said of the motion of a board by which offsets between cameras are known.

    Its speeds follow from poses that have errors: v = v_true + e. An offset comes out too small by the share
    of E(e'e) in v'v, all by the weights of the poses, and has too small a standard deviation.
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
    """Return (2, V): squared speeds that errors of poses make on average, and those that are there."""
    start, result = calibrated.calibration, calibrated.result
    steps = ("step", [result.block.photo_ids[row] for row in calibrated.photos.tolist()])
    joint = result.covariance([steps]) / result.covariance_scale
    count = len(calibrated.photos)
    own = joint.reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count)]
    speeds = np.nan_to_num(np.asarray(start.motion)[:, 0])
    there = np.einsum("vi,vi->v", speeds, np.linalg.solve(own, speeds[..., np.newaxis])[..., 0])
    by_errors = errors_of_speeds(dated(start.corners, start.tied), start.references_of_views())
    return np.stack([6 * np.nan_to_num(by_errors) * result.covariance_scale, there])


REMOVAL_FACTOR, OUTLIER_FACTOR = 5.0, 4.0  # times the rms: start of removal, removed corners


def marked_as_mrcal(result: Result) -> Bools:
    """Return (m,) which images mrcal takes out: only to reproduce its results.

    None, unless a weighted residual is beyond 5 rms of all; then those with one beyond 4. Snooping tests each
    corner by its own accuracy.
    """
    weighted = np.abs(result.residuals / result.image_given_sd)
    rms = np.sqrt(np.nanmean(weighted**2))
    far = np.nanmax(weighted, axis=1, initial=0.0)
    return (
        far > OUTLIER_FACTOR * rms if (far > REMOVAL_FACTOR * rms).any() else np.zeros(len(far), dtype=bool)
    )


def simulate_corners(calibration: Calibration, seed: int = 1) -> Calibration:
    """Return a calibration whose corners are images of its own values, with errors as large as it says.

    The points of a board whose shape is `points` are drawn about their nominal places, once for all views.

    Parameters
    ----------
    calibration
        Its cameras, poses and sensors are taken for true; which corners there are stays as it is.
    seed
        The same seed gives the same errors.

    Raises
    ------
    InputError
        Nobody has said how well corners are measured, or one has no image by these values.
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


check_arguments(globals(), ["simulate_corners"])
