"""A calibration as users have it: corners of a board with values to start from, and its adjustment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

from photogram.adjustment.adjustment import Progress
from photogram.adjustment.robust import Loss
from photogram.targets.adjusting import adjusted_start, snooped_start
from photogram.targets.calibration_result import Calibrated
from photogram.targets.start import Start

__all__ = ["Calibration"]


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
        sensors those of :class:`photogram.network.unknowns.Sensor`: its position in the axes of the
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
        return adjusted_start(self, loss=loss, outliers=outliers, threads=threads, progress=progress)

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
        return snooped_start(self, **options)
