"""What the groups of observations of a block are called, and what may go alone of each."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from photogram import _photocore
from photogram.arguments.types import Indices
from photogram.network.block import Block
from photogram.network.observations import Observation, Smoothness
from photogram.network.trajectories import Trajectory
from photogram.results.network_trial import (
    ATTITUDE,
    CONTROL,
    KINDS,
    OBSERVATION,
    POSITION,
    NamedSuspects,
    NetworkTrial,
)
from photogram.results.observation_kinds import named_observation
from photogram.words import Phrase

ANGLES = ("omega", "phi", "kappa")


ROUGH = 2.0
"""Standard deviations: a step after which the next would move no unknown by more is the last of a round. The
rounds that follow start there, and the last takes nothing out: what it decides on is as good as exact."""
EXACT = 1e-7  # The same if R of all rows is used
LOOSE = 0.1  # Largest standard deviation of positions for a firm datum, as a part of the extent of the block


def network_trial(block: Block, core: _photocore.NetworkTrial, *, parts: bool = True) -> NetworkTrial:
    """Return a block as tests ask it."""
    deviations = np.hstack([block.photo_position_sd, block.photo_attitude_sd])
    # What others are on as well does not need the images of one photo.
    shared = {each.photo for each in block.timed if each.trajectory is not None}
    on_shared = np.array([name in shared for name in block.photo_ids], dtype=bool)
    return NetworkTrial(
        core=core,
        suspects=BlockSuspects(block, core.suspects, parts),
        supported=np.asarray(np.isfinite(deviations).all(axis=1) | on_shared),
        rough=EXACT if _datum_is_loose(block) else ROUGH,
        exact=EXACT,
    )


def _datum_is_loose(block: Block) -> bool:
    """Whether nothing but loose weights of photos places a block.

    Standard deviations of its unknowns are those of the datum then: a step may be small beside them and leave
    partials that contradict the cofactors by hundreds.
    """
    position_sd = block.photo_position_sd[:, :2]
    extent = np.ptp(block.photo_positions[:, :2], axis=0).max(initial=0.0)
    firm = np.isfinite(block.point_sd).any() or (position_sd < LOOSE * extent).any()
    return bool(np.isfinite(position_sd).any() and not firm)


def observations_of_core(block: Block) -> list[Observation]:
    """Return the observations beside images in the order of the core: kind by kind."""
    return [block.observations[row] for rows, _ in block.observation_groups for row in rows]


class BlockSuspects(NamedSuspects):
    """The groups of observations of a block; `parts` of some may go alone."""

    def __init__(self, block: Block, core: _photocore.NetworkSuspects, parts: bool = True) -> None:
        axes = ("longitude", "latitude", "height") if block.geographic else ("X", "Y", "Z")
        plan = "rad" if block.geographic else block.linear_unit
        super().__init__(
            block, core, apart=parts, components=(axes, axes, ANGLES), lengths=(plan, plan, block.linear_unit)
        )
        self.block = block
        self.observations = observations_of_core(block)

    @cached_property
    def point_row(self) -> dict[str, int]:
        """The row of each point: of large blocks it is made only where it is asked for."""
        return {name: row for row, name in enumerate(self.block.point_ids)}

    @cached_property
    def photo_row(self) -> dict[str, int]:
        """The row of each photo, likewise."""
        return {name: row for row, name in enumerate(self.block.photo_ids)}

    def parts(self, group: int) -> Sequence[Sequence[int]] | None:
        """Return what may go alone: plan, height or all of control, single components of stations."""
        if not self.apart:
            return None
        kind = int(self.kinds[group])
        components = self.components[self.row_starts[group] : self.row_starts[group + 1]].tolist()
        if kind == CONTROL and len(components) == 3:
            return [(0, 1, 2), (2,), (0, 1)]
        if kind in (CONTROL, POSITION, ATTITUDE) and len(components) > 1:
            return [(row,) for row in range(len(components))]
        return None

    def other_loads(self, kind: int, subject: int) -> Indices:
        """Return the photos that an observation beside images has to do with; of what is common, all."""
        if kind != OBSERVATION:
            return np.arange(len(self.block.photo_ids))
        observation = self.observations[subject]
        if observation.moment is not None:
            return self._flown(observation.moment.trajectory)
        if isinstance(observation, Smoothness):
            smoothed = self._of_coefficients.get(id(observation.unknowns[0]))
            return np.zeros(0, dtype=np.int64) if smoothed is None else self._flown(smoothed)
        seen = [self.photos_of_point(self.point_row[name]) for name in observation.points]
        own = np.array([self.photo_row[name] for name in observation.photos], dtype=np.int64)
        return np.unique(np.concatenate([own, *seen]))

    def _flown(self, trajectory: Trajectory) -> Indices:
        """Return the photos on a trajectory."""
        return self._on_trajectories.get(id(trajectory), np.zeros(0, dtype=np.int64))

    @cached_property
    def _on_trajectories(self) -> dict[int, Indices]:
        found: dict[int, list[int]] = {}
        for each, own in zip(self.block.timed, self.block.trajectories, strict=True):
            found.setdefault(id(own), []).append(self.photo_row[each.photo])
        return {key: np.array(sorted(rows), dtype=np.int64) for key, rows in found.items()}

    @cached_property
    def _of_coefficients(self) -> dict[int, Trajectory]:
        every = {id(each): each for each in self.block.trajectories}.values()
        return {id(one): each for each in every for all_ in each.coefficients for one in all_}

    def other_name(self, kind: int, subject: int) -> Phrase:
        """Return the name of an observation that is no image, of a camera or of a common unknown."""
        if kind == OBSERVATION:
            observation = self.observations[subject]
            return named_observation(observation.KIND, " - ".join(observation.of))
        if KINDS[kind] == "camera":
            return Phrase("named.camera", {"camera": self.block.camera_names[subject]})
        return Phrase("named.unknown", {"unknown": self.block.unknowns[subject].name})

    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]:
        """Return the name and unit of a component; parameters and common unknowns have numbers."""
        if kind != OBSERVATION:
            return str(component), ""
        observation = self.observations[subject]
        names = observation.components(geographic=self.block.geographic)
        return names[component], observation.units(self.block.linear_unit)[component]
