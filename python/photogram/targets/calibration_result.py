"""Adjusted calibration: cameras, sensors, views and board, with joint cofactors.

It can contain an assessment: uncertainty maps, cross-validation and suggested views.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import fields
from functools import cached_property
from typing import TYPE_CHECKING, Literal, Self, get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.attitudes import Attitudes
from photogram.network.passages import Bend
from photogram.network.trajectories import Clock
from photogram.results.parts import AdjustedUnknown
from photogram.results.result import Result
from photogram.show.page import Document
from photogram.statistics.limits import GlobalTest
from photogram.summaries import Rows
from photogram.targets.motion import CLOCK
from photogram.targets.vision import sensor_pose, sensor_steps, view_steps, vision_poses

if TYPE_CHECKING:
    from photogram.statistics.findings import Findings
    from photogram.targets import Calibration, Worth
    from photogram.targets.housing import Housing

Part = Literal["cameras", "sensors", "board", "views"]
# Names of unknowns, their identifiers in the result, and their partials by steps of the block, or the numbers
# of unknowns that are such steps
Chosen = tuple[list[str], list[tuple[str, list[str]]], list[Floats | int]]
STEPS = ("tx", "ty", "tz", "wx", "wy", "wz")  # R <- Exp(w) R, t <- t + dt in vision axes


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Calibrated(Result):
    """Adjusted block of a calibration: K cameras in V views of a board of n points.

    Attributes
    ----------
    calibration
        Calibration input, without removed outliers.
    unregularised
        Adjustment without camera priors, if any, which shows their effect.
    worth
        Assessment with uncertainty maps and cross-validation for reports.
    need
        Largest accepted standard deviation of projection, pixels; None: any.
    """

    calibration: Calibration
    unregularised: Result | None = None
    worth: Worth | None = None
    need: float | None = None

    @classmethod
    def of(cls, result: Result, calibration: Calibration, unregularised: Result | None = None) -> Self:
        """Return the adjusted block of a calibration with its board."""
        adjusted = {each.name: getattr(result, each.name) for each in fields(Result)}
        return cls(**adjusted, calibration=calibration, unregularised=unregularised)

    def with_worth(self, worth: Worth, need: float | None = None) -> Self:
        """Return the calibration with an assessment, which its verdict and document contain."""
        found = copy(self)  # with all covariances that have been computed
        vars(found).pop("verdict", None)
        vars(found).update(worth=worth, need=need)
        return found

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the adjustment."""
        title, rows = super().brief()
        return title, [*self.calibration.brief()[1], *rows]

    def document(self) -> Document:
        """Return the document with verdict, board, views and block."""
        from photogram.targets.page import calibration_page

        return calibration_page(self, super().document())

    @property
    def known_weight(self) -> bool:
        """Whether the standard deviation of corners is given, or assumed by data snooping."""
        return self.calibration.sd0 is not None or self.snooped is not None

    @property
    def global_test(self) -> GlobalTest | None:
        """The test of all residuals; None if the standard deviation of corners is unknown."""
        return super().global_test if self.known_weight else None

    def _findings(self) -> Findings:
        from photogram.targets.findings import calibration_findings

        return calibration_findings(self, super()._findings())

    @cached_property
    def sensors(self) -> Floats:
        """(K, 4, 4) adjusted: camera 0 -> camera k; the identity for separate cameras."""
        found = np.tile(np.eye(4), (len(self.cameras), 1, 1))
        for each in self.unknowns:
            if each.kind == "sensor":
                found[self._numbers[each.name]] = sensor_pose(each.position, each.attitude)
        return found

    @cached_property
    def _housings(self) -> dict[int, Housing]:
        return {}

    @cached_property
    def _numbers(self) -> dict[str, int]:
        return {each.name: k for k, each in enumerate(self.cameras)}

    @cached_property
    def photos(self) -> Indices:
        """(V,) the photo of the block with the pose of each view."""
        return self.calibration.frames()[1]

    @cached_property
    def poses(self) -> Floats:
        """(V, 4, 4) adjusted: board -> camera 0, or the camera of unsynchronised images."""
        rows = self.photos
        attitudes = Attitudes.of("omega_phi_kappa", self.photo_attitudes[rows])
        return vision_poses(self.photo_positions[rows], attitudes)

    @cached_property
    def picture_poses(self) -> Floats:
        """(P, 4, 4) adjusted: board -> the camera of each image, at its time."""
        own = slice(len(self.calibration.corners.pictures))
        attitudes = Attitudes.of("omega_phi_kappa", self.photo_attitudes[own])
        return vision_poses(self.photo_positions[own], attitudes)

    @property
    def offsets(self) -> dict[str, AdjustedUnknown]:
        """Adjusted clock offsets between cameras, by camera name, in seconds."""
        clocks = [each for each in self.unknowns if each.kind == Clock.KIND]
        return {each.name.removeprefix(CLOCK): each for each in clocks}

    @property
    def points(self) -> Floats:
        """(n, 3) adjusted points of the board; nominal for points without observations."""
        found, board = self.point_positions, self.calibration.board
        given = board.places if self.bend is None else board.bent(*self.bend.position[:2])
        return np.where(np.isnan(found), given, found)

    @property
    def bend(self) -> AdjustedUnknown | None:
        """Centre deflections of the board, if estimated."""
        return next((each for each in self.unknowns if each.kind == Bend.KIND), None)

    def sensors_adjusted(self) -> list[int]:
        """Return the cameras with an adjusted sensor pose."""
        return [self._numbers[each.name] for each in self.unknowns if each.kind == "sensor"]

    def restarted_calibration(self) -> Calibration:
        """Return the calibration with adjusted free values; other values are as given."""
        own, bend, found = self.calibration, self.bend, self.offsets
        late = np.array([found[each.name].values[0] if each.name in found else 0.0 for each in self.cameras])
        free = np.isinf(np.asarray(own.sd_sensors)).all(axis=1)[:, np.newaxis, np.newaxis]
        bends = own.bend if bend is None else np.where(np.isinf(own.sd_bend), bend.position[:2], own.bend)
        # Priors of the mrcal type are added again to free parameters; initial knots do not matter.
        given = [
            each if each.camera.knots is not None else replace(each, given=before)
            for each, before in zip(self.cameras, own.cameras, strict=True)
        ]
        return own.replace(
            cameras=[each.restarted() for each in given],
            poses=self.poses,
            sensors=np.where(free, self.sensors, np.asarray(own.sensors)),
            bend=(float(bends[0]), float(bends[1])),
            offsets=np.where(np.isinf(np.asarray(own.sd_offsets)), late, own.offsets),
        )

    def cofactors(self, parts: Sequence[Part] = ("cameras", "sensors")) -> tuple[list[str], Floats]:
        """Return the joint cofactors of some parts: covariances for a priori unit weight.

        Parameters
        ----------
        parts
            Parts in the order of rows. `cameras`: all parameters and free knots (fixed ones have zeros).
            `sensors` and `views`: six steps each, R <- Exp(w) R, t <- t + dt in vision axes, ordered dt, w.
            `board`: x, y, z of the observed points, or `bend_x` and `bend_y`.

        Returns
        -------
        Names of the q unknowns (`left fx`, `right tx`, `17.z`, `view 3 wx`), and their (q, q) cofactors.

        Raises
        ------
        InputError, OutOfMemoryError, KeyboardInterrupt
            As in :meth:`photogram.Result.covariance`, or if a part does not exist.
        """
        names, _, _ = self._selected(parts)
        return names, self.combined(np.eye(len(names)), parts)

    def combined(self, partials: Floats, parts: Sequence[Part]) -> Floats:
        """Return the (m, m) cofactors of linear combinations of some parts: J Q J'.

        Parameters
        ----------
        partials
            (m, q) J: a column for each of the q unknowns of :meth:`cofactors`.
        parts
            As in :meth:`cofactors`.

        Raises
        ------
        InputError, OutOfMemoryError, KeyboardInterrupt
            As in :meth:`cofactors`.
        """
        _, wanted, steps = self._selected(parts)
        own, start = partials.copy(), 0
        for each in steps:
            columns = slice(start, start + (each if isinstance(each, int) else len(each)))
            if not isinstance(each, int):
                own[:, columns] = own[:, columns] @ each
            start = columns.stop
        return self.covariances().combined(own, wanted) / self.covariance_scale

    def _selected(self, parts: Sequence[Part]) -> Chosen:
        names: list[str] = []
        wanted: list[tuple[str, list[str]]] = []
        steps: list[Floats | int] = []
        for part in parts:
            one_of("part of a calibration", part, get_args(Part))
            before = len(names)
            if part == "cameras":
                for each, given in zip(self.cameras, self.block.cameras, strict=True):
                    knots = [knot.name for knot in given.knot_unknowns]
                    names += [f"{each.name} {name}" for name in each.names + given.knot_names * bool(knots)]
                    wanted += [("camera", [each.name]), ("unknown", knots)]
                steps.append(len(names) - before)
            elif part == "sensors":
                rows = self.sensors_adjusted()
                own = [self.cameras[row].name for row in rows]
                names += [f"{name} {step}" for name in own for step in STEPS]
                wanted.append(("unknown", own))
                steps += [sensor_steps(self.sensors[row]) for row in rows]
            elif part == "views":
                photos = [self.block.photo_ids[row] for row in self.photos.tolist()]
                names += [f"view {view} {step}" for view in range(len(photos)) for step in STEPS]
                wanted.append(("step", photos))
                steps += [view_steps(pose) for pose in self.poses]
            else:
                own = [self.calibration.board.names[row] for row in np.flatnonzero(self.used_points).tolist()]
                points = [f"{name}.{axis}" for name in own for axis in "xyz"]
                names += points if self.bend is None else ["bend_x", "bend_y"]
                wanted.append(("point", own) if self.bend is None else ("unknown", [self.bend.name]))
                steps.append(len(names) - before)
        return names, [each for each in wanted if each[1]], steps
