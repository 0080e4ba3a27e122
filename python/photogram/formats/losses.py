"""Parts of a project that formats other than the plain project cannot contain."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from photogram.formats.block_contents import posed
from photogram.formats.models import complete_positions
from photogram.formats.plain.writing import known_cameras
from photogram.formats.project import Project
from photogram.network.observations import Control, Observation, Position
from photogram.words import Phrase, phrase

Count = Callable[[Project], int | np.integer | bool]


def _other_than(*kinds: type[Observation]) -> Count:
    return lambda project: sum(not isinstance(each, kinds) for each in project.block.observations)


def _kind(kind: type[Observation]) -> Count:
    return lambda project: sum(isinstance(each, kind) for each in project.block.observations)


_COUNTS: Mapping[str, Count] = {
    "control": lambda project: _held(project) + len(project.checks),
    "control-list": lambda project: _held(project) + len(project.checks),
    "correlations": _kind(Control),
    "gnss": _kind(Position),
    "all-observations": _other_than(),
    "observations": _other_than(Control, Position),
    "observations-and-gnss": _other_than(Control),
    "observations-and-control": _other_than(Position),
    "rigs": lambda project: len(project.block.mounts),
    "boards": lambda project: len(project.block.passages),
    "unposed": lambda project: np.count_nonzero(~posed(project.block)),
    "unplaced": lambda project: np.count_nonzero(~np.isfinite(complete_positions(project)).all(axis=1)),
    "unknowns": lambda project: any(each.deviations.any() for each in known_cameras(project.block)[0]),
    "lenses": lambda project: any(each.model != "perspective" for each in known_cameras(project.block)[0]),
    "place": lambda project: project.frame.kind != "topocentric",
    "features": lambda project: len(project.features),
    "trajectories": lambda project: len(project.block.timed),
    "moments": lambda project: sum(each.moment is not None for each in project.block.observations),
}
"""Functions that count parts of a project by type; other types apply to every project."""


def _held(project: Project) -> int:
    return int(np.count_nonzero(np.isfinite(project.block.point_sd).any(axis=1)))


def losses(project: Project, *kinds: str) -> list[Phrase]:
    """Return the types of parts of a project, with counts."""
    counts = {kind: int(_COUNTS[kind](project)) if kind in _COUNTS else 1 for kind in kinds}
    fields = {"frame": project.frame.phrase, "held": _held(project), "checks": len(project.checks)}
    return [phrase(f"lost.{kind}", n=count, **fields) for kind, count in counts.items() if count]
