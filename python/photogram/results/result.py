"""The result of the adjustment of a block: arrays, covariances, tables, documents."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram import _photocore
from photogram.arguments.objects import require_kind
from photogram.arguments.types import Floats, Indices
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.attitudes import angles_form
from photogram.network.block import Block, refuse_trajectories
from photogram.network.core_arrays import CoreOptions, block_network
from photogram.network.datum import DatumRow, InnerConstraints, datum_row
from photogram.network.motion import timed_photos
from photogram.results import datum as references
from photogram.results import parts
from photogram.results import trajectories as motion
from photogram.results.covariance import Adjusted, Failure, adjusted
from photogram.results.films import OnFilm
from photogram.results.network import AdjustedNetwork
from photogram.statistics.limits import GlobalTest, global_test
from photogram.words import Phrase

if TYPE_CHECKING:
    import pandas as pd

    from photogram import Features
    from photogram.io.writing import Content
    from photogram.results.calibration import Calibration
    from photogram.results.network_trial import NetworkTrial
    from photogram.results.parts import Terms
    from photogram.results.reliability import ReliabilitySummary
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings

NOT_PHOTOGRAPHED, REJECTED = "not-photographed", "rejected"
"""Reasons for excluding a point without image observations: without any, or none was used."""


_OF_DATUM = ("photo_positions", "photo_attitudes", "photo_cofactors", "point_positions", "point_cofactors")


def dropped_points(block: Block, solution: _photocore.BlockSolution) -> dict[str, str]:
    """Return the excluded points by name, with the codes of the reasons."""
    reasons = {block.point_ids[point]: reason for point, reason in solution.dropped}
    rejected = [name for name in block.rejected_points if reasons.get(name) == NOT_PHOTOGRAPHED]
    return reasons | dict.fromkeys(rejected, REJECTED)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Result(OnFilm, AdjustedNetwork):
    """An adjusted block; see also `AdjustedNetwork`, with k = 6.

    The unknowns of a photo are its position and omega, phi, kappa. Positions are X, Y, Z or longitude (rad),
    latitude (rad), height; angles are radians, image coordinates millimetres or the unit of the cameras.

    Attributes
    ----------
    block
        The adjusted block: a copy, independent of later changes of the caller's lists.
    sums_of_squares
        Weighted sums by group.
    redundancies
        Sums of redundancy numbers of the same groups; None without covariances.
    unit_variance
        The basis of degrees of freedom and variance of unit weight: `free`, `constrained`, `unity` or
        `redundancy`.
    photo_corrections
        (i, P, 6) corrections of position and attitude in each of the i iterations, from the initial to the
        adjusted values.
    photo_positions, photo_attitudes
        (P, 3) adjusted.
    photo_order
        (P,) indices of the photos in elimination order.
    point_last_corrections
        (n, 3) corrections in the last iteration.
    kinds
        Additional observations: arrays for each type, by its name.
    cameras
        The adjusted cameras of the block, in its order; empty for blocks with principal distances.
    unknowns
        The adjusted common unknowns of observations, and of photos on frames, in the order of
        `block.unknowns`.
    dropped
        Excluded points, with the code of the reason: `not-photographed`, `rejected` (no image observation was
        used), `pass-point-on-one-photo`, `control-point-on-one-photo`, `not-determined` (by its rays),
        `ran-off`, `ran-into-station`, `at-station`, `near-station`.
    datum
        The datum of coordinates and standard deviations.
    hints
        Mistakes in conventions (units, axes, signs, angles) that would explain misfitting images, as
        sentences of :func:`photogram.diagnose`; empty without a diagnosis. They are first in the verdict.
    exchanged
        Names of points that are probably exchanged on a photo, as sentences, if there are gross errors.
    set_aside
        Photos and images, by name, that the initial values removed and that do not fit the adjusted block;
        see :func:`photogram.adjust_started`.
    features
        Features through adjusted points for reports and tables, from :func:`photogram.features`, in the datum
        of the result; None without.
    """

    block: Block
    sums_of_squares: parts.SumsByKind
    redundancies: parts.SumsByKind | None
    unit_variance: str
    photo_corrections: Floats
    photo_positions: Floats
    photo_attitudes: Floats
    photo_order: Indices
    point_last_corrections: Floats
    kinds: Mapping[str, parts.ObservedKind]
    cameras: tuple[parts.AdjustedCamera, ...]
    unknowns: tuple[parts.AdjustedUnknown, ...]
    dropped: Mapping[str, str]
    datum: references.ResultDatum
    hints: tuple[str, ...] = ()
    exchanged: tuple[Phrase | str, ...] = ()
    set_aside: tuple[Phrase | str, ...] = ()
    features: Features | None = None

    WHOLE: ClassVar[bool] = True
    """Whether the normal equations of the complete block are available."""

    @classmethod
    def from_solution(
        cls,
        block: Block,
        solution: _photocore.BlockSolution,
        options: CoreOptions,
        datum: references.ResultDatum,
        messages: list[Message],
        freedom: float,
    ) -> Self:
        """Return the result of a core solution; `freedom`: degrees of freedom of the unit variance."""
        variance = solution.variance_of_unit_weight
        scale = 1.0 if variance is None else variance
        return cls.taken_over(
            solution,
            block=block.kept(),
            messages=messages,
            loss=options.loss,
            options=options,
            datum=datum,
            sums_of_squares=parts.SumsByKind(*solution.sums_of_squares),
            redundancies=solution.redundancies and parts.SumsByKind(*solution.redundancies),
            degrees_of_freedom=freedom,
            unit_variance=options.unit_variance,
            kinds=parts.observed_kinds(block, solution),
            cameras=parts.adjusted_cameras(block, solution, scale),
            unknowns=parts.adjusted_unknowns(block, solution, scale),
            dropped=dropped_points(block, solution),
        )

    def document(self) -> Document:
        """Return the document: verdict, sections, tables."""
        from photogram.results.document import block_document

        return block_document(self)

    def _findings(self) -> Findings:
        from photogram.results.findings import block_findings

        return block_findings(self)

    def _files(self) -> Mapping[str, Content]:
        from photogram.results.block_files import block_files

        return block_files(self)

    @property
    def given(self) -> Block:
        """The adjusted block."""
        return self.block

    @property
    def sum_and_freedom(self) -> tuple[float, float]:
        """The weighted sum of squares, and the degrees of freedom of the unit weight."""
        return self.sums_of_squares.total, self.degrees_of_freedom

    @property
    def freedom_of_scale(self) -> float:
        """The degrees of freedom of `covariance_scale`; infinite if given."""
        known = self.unit_variance == "unity" or self.variance_of_unit_weight is None
        return math.inf if known else self.degrees_of_freedom

    def _adjusted(self) -> Adjusted:
        return adjusted(self)

    def _refused(self, error: Failure) -> Exception:
        return references.refused(self.block, self._core_network(), self.state, error)

    def _core_network(self) -> _photocore.BlockNetwork:
        return block_network(self.block, self.options)

    @cached_property
    def _terms(self) -> Terms:
        from photogram.results.network_tables import block_terms

        return block_terms(self)

    @cached_property
    def _calibrations(self) -> list[Calibration]:
        from photogram.results.calibration import calibrations

        return calibrations(self)

    @cached_property
    def reliability_summary(self) -> ReliabilitySummary | None:
        """The reliability summary of reports; see `AdjustedNetwork`."""
        from photogram.results.evaluation import reliability_summary

        return reliability_summary(self)

    def _plot_data(self) -> Any:
        from photogram.results.picture_data import PicturedBlock

        return PicturedBlock(self)

    def _trial(self) -> NetworkTrial:
        from photogram.results.network_trial import network_trial

        core = self._core_network().trial(self.state, threads=0, kept=True)
        return network_trial(self.block, core)

    def _hypothesis_facts(self) -> dict[str, Any]:
        from photogram.results.network_trial import block_facts

        checks, facts = self.check_points, block_facts(self.block, self.photo_positions)
        return facts | {"agreement": checks.agreement, "checks": checks.rows.tolist()}

    def restarted(self, turns: Mapping[str, Floats] | None = None) -> Block:
        """Return the given block with adjusted values of free unknowns.

        These are poses of photos, parameters of cameras, and coefficients of trajectories. Observed and fixed
        values remain as given.

        `photogram.adjust(result.restarted())` continues the adjustment with other options, or with other
        weights after :meth:`photogram.Block.replace`.

        Parameters
        ----------
        turns
            By names of trajectories (3,) rotation vectors about the axes of the photo, which are added to
            their tables: corrections of their rotations then begin at zero.
        """
        block = self.block
        free = {name: np.isinf(getattr(block, f"photo_{name}_sd")) for name in ("position", "attitude")}
        if block.all_trajectories:
            block = motion.restarted_motion(block, self.trajectories.values(), turns)
        return block.replace(
            cameras=[each.restarted() for each in self.cameras] or block.cameras,
            photo_positions=np.where(free["position"], self.photo_positions, block.photo_positions),
            photo_attitudes=np.where(free["attitude"], self.photo_attitudes, block.photo_attitudes),
        )

    def in_datum(self, datum: InnerConstraints) -> Self:
        """Return the result in another datum (S-transformation, docs/datum.md).

        Residuals, redundancy numbers, test values and the variance of unit weight do not depend on the datum.

        Raises
        ------
        InputError
            If points or photos do not exist or cannot define the datum, such as photos on trajectories.
        AdjustmentError
            If the block is not free: the message describes its datum.
        OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariances`.
        """
        require_kind("datum", datum, InnerConstraints)
        return self._in(datum_row(self.block, datum))

    def relative_to(self, *, photo: str | None = None, points: Sequence[str] | None = None) -> Self:
        """Return the result with covariances relative to a photo or to points.

        The covariances are those for a fixed pose of the photo, or a fixed mean position and orientation of
        the points. Scale and adjusted values remain unchanged.

        Raises
        ------
        InputError
            If both or neither are given, names do not exist, points are on one line, or photos are on
            trajectories.
        OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariances`.
        """
        refuse_trajectories(self.block, "relative_to")
        return self._in(references.relative_datum(self.block, photo, points))

    def _in(self, row: DatumRow) -> Self:
        block = self.block
        network = self._core_network()
        try:
            solution = network.in_datum(self.state, row, threads=0, progress=None)
        except _photocore.BlockError as error:
            raise references.refused(block, network, self.state, error) from None
        datum = references.datum_of(block, solution, row)
        before = references.datum_messages(block, self.datum, self.point_rays)
        kept = [message for message in self.messages if message not in before]
        return replace(
            self,
            **{name: getattr(solution, name) for name in _OF_DATUM},
            cameras=parts.adjusted_cameras(block, solution, self.covariance_scale),
            unknowns=parts.adjusted_unknowns(block, solution, self.covariance_scale),
            datum=datum,
            state=solution.state,
            features=None,
            messages=[*references.datum_messages(block, datum, self.point_rays), *kept],
        )

    def _table(self, what: str) -> pd.DataFrame:
        from photogram.results.tables import table_frame

        table = table_frame(self, what)
        table.attrs["datum"] = str(self.datum)
        return table

    @property
    def global_test(self) -> GlobalTest | None:
        """The test of all residuals; None without degrees of freedom.

        With `constrained` it includes all observations and weighted values. Otherwise, weights of photos and
        cameras may be nominal: the test uses all others with the sum of their redundancy numbers, and is None
        without covariances (docs/tests.md).
        """
        if self.unit_variance == "constrained":
            return super().global_test
        if self.redundancies is None:
            return None
        return global_test(self.sums_of_squares.measured, self.redundancies.measured)

    @property
    def photo_residuals(self) -> Floats:
        """(P, 6) observed minus adjusted position and attitude; 0 if fixed, NaN if free.

        Differences of longitudes and attitudes are at most half a rotation.
        """
        block = self.block
        positions, attitudes = block.photo_positions_observed, block.photo_attitudes_observed
        observed = [
            block.photo_positions if positions is None else positions,
            block.photo_attitudes if attitudes is None else attitudes,
        ]
        residuals = np.hstack(observed) - np.hstack([self.photo_positions, self.photo_attitudes])
        turning = [0, 3, 4, 5] if self.block.geographic else [3, 4, 5]
        residuals[:, turning] = least_turns(residuals[:, turning])
        return np.where(np.isfinite(self.photo_given_sd), residuals, np.nan)

    @property
    def photo_rotation_covariances(self) -> Floats:
        """(P, 6, 6) scaled covariances of positions and rotation vectors of photos.

        The order is X, Y, Z (longitude, latitude, height), then the three components of rho in radians. A
        photo rotates by rho about its own axes (x right, y up, z towards the viewer): its true attitude is A
        Exp(rho), A the adjusted one (docs/conventions.md). NaN if phi is 90 degrees.
        """
        kind = angles_form(self.block.photo_to_ground)
        _, rates = _photocore.attitudes_from_numbers(kind, self.photo_attitudes, np.eye(3))
        jacobian = np.tile(np.eye(6), (len(rates), 1, 1))
        jacobian[:, 3:, 3:] = rates
        found: Floats = jacobian @ self.photo_covariances @ jacobian.transpose(0, 2, 1)
        return found

    @property
    def photo_given_sd(self) -> Floats:
        """(P, 6) a priori sd of positions and attitudes: infinite if free, zero if fixed.

        Given values of a photo with its own trajectory refer to the coefficients of the trajectory.
        """
        given = np.hstack([self.block.photo_position_sd, self.block.photo_attitude_sd])
        return np.where(timed_photos(self.block)[:, np.newaxis], np.inf, given)

    @cached_property
    def point_kinds(self) -> NDArray[np.str_]:
        """(n,) `control` if observed, `check` if known only, else `pass`."""
        return references.point_kinds(self.block)

    @property
    def point_differences(self) -> Floats:
        """(n, 3) adjusted minus given coordinates; NaN if not given.

        Differences of longitudes are at most half a rotation, on either side of the antimeridian.
        """
        differences = super().point_differences
        if self.block.geographic:
            differences[:, 0] = least_turns(differences[:, 0])
        return differences

    @cached_property
    def check_points(self) -> references.CheckPoints:
        """Check points with differences, standard deviations, and single and joint tests."""
        return references.check_points(self)

    def statement(self, **asked: Any) -> Any:
        """Return the accuracy statement for a client (docs/statement.md).

        It has `figures`, `sentences`, `assumptions`, `exit`, `budget(..)`, `check_points`, `leave_one_out`,
        `to_html()`, `to_pdf()` and `to_json()`; for options and errors see :func:`photogram.statement`.
        """
        import photogram  # avoids a circular import

        return photogram.statement(self, **asked)

    def check_table(self) -> pd.DataFrame:
        """Return check points as a data frame: adjusted minus given coordinates, standard deviations."""
        return self._table("check")

    @property
    def trajectories(self) -> dict[str, motion.AdjustedTrajectory]:
        """Trajectories of photos and records by name: coefficients, poses."""
        return motion.adjusted_trajectories(self)

    def project(self, photo: str, points: ArrayLike) -> Floats:
        """Return image coordinates of points on a photo on a trajectory.

        Parameters
        ----------
        photo
            Its name.
        points
            (n, 3) in the object space of the block.

        Returns
        -------
        (n, 2) image coordinates, samples and lines for scanners; NaN for points outside the recorded time.

        Raises
        ------
        InputError
            If the photo is not on a trajectory, or is a scanner on a trajectory with one record.
        """
        return motion.project(self, photo, points)

    def camera_table(self) -> pd.DataFrame:
        """Return adjusted cameras as a data frame: a row with unit for each parameter."""
        return self._table("camera")

    def unknown_table(self) -> pd.DataFrame:
        """Return common unknowns as a data frame: a row with unit for each component."""
        return self._table("unknown")

    def observation_table(self) -> pd.DataFrame:
        """Return additional observations as a data frame: a row for each component."""
        return self._table("observation")


def least_turns(angles: Floats) -> Floats:
    """Return angles without full rotations."""
    return np.asarray(angles - math.tau * np.round(angles / math.tau))
