"""Observations beside images: distances, differences, heights, positions and attitudes of photos, control.

Each kind is a class with names of points or photos, what was observed, and its standard deviations `sd` or,
where components are correlated, their covariance matrix `covariance`. Residuals are observed minus computed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import names, shaped
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError

__all__ = [
    "Attitude",
    "Control",
    "Difference",
    "Distance",
    "EqualHeight",
    "Observation",
    "Position",
    "Relative",
    "observation_rows",
]

Group = tuple[str, Indices, Floats, Floats]
"""The name of a kind, (k, p) indices of points or photos, (k, v) values and (k, r, r) covariance matrices."""

_AXES = ("X", "Y", "Z")
_ROTATIONS = ("rotation x", "rotation y", "rotation z")
_SYMMETRIC = 1e-9
"""What a covariance matrix may be unsymmetric by, relative to its diagonal."""
_ORTHONORMAL = 1e-6


@dataclass(frozen=True, eq=False)
class Observation:
    """What all kinds have in common.

    Attributes
    ----------
    of
        Names of its points or photos.
    observed
        (v,) what was observed, as the core takes it.
    precision
        (r, r) covariance matrix of its r components.
    """

    KIND: ClassVar[str] = ""
    """The name under which results know the kind."""
    OF_PHOTOS: ClassVar[bool] = False
    """Whether it is of photos; else of points."""
    COMPONENTS: ClassVar[tuple[str, ...]] = ()
    """What its components are called: rotations are in radians, all others in the linear unit."""

    of: tuple[str, ...] = field(init=False, repr=False)
    observed: Floats = field(init=False, repr=False)
    precision: Floats = field(init=False, repr=False)

    @property
    def name(self) -> str:
        """Its kind and what it is of, for reports."""
        return f"{self.KIND} {' - '.join(self.of)}"

    @classmethod
    def components(cls, *, geographic: bool) -> tuple[str, ...]:
        """Return the names of its components; of positions in geographic space those of local axes."""
        local = geographic and cls.KIND in ("control", "position")
        return ("east", "north", "up") if local else cls.COMPONENTS

    def _set(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    def _take(
        self,
        of: tuple[object, ...],
        values: Mapping[str, tuple[int, ...]],
        sd: ArrayLike | None,
        covariance: ArrayLike | None,
    ) -> None:
        """Check what was given: names, arrays by the names of their fields with their shapes, precision."""
        self._set("of", tuple(names(self.KIND, of)))
        if len(set(self.of)) < len(self.of):
            raise InputError(f"{self.name} is of one {'photo' if self.OF_PHOTOS else 'point'} alone")
        missing = self.KIND == "difference"
        for name, shape in values.items():
            array = shaped(f"{name} of {self.name}", getattr(self, name), shape, missing=missing)
            if (np.isinf(array) if missing else ~np.isfinite(array)).any():
                raise InputError(f"{name} of {self.name} is not finite: {array.tolist()}")
            if shape == (3, 3):
                self._check_rotation(name, array)
            self._set(name, array if shape else float(array))
        self._set("observed", np.concatenate([np.ravel(getattr(self, name)) for name in values]))
        use = ~np.isnan(self.observed) if missing else np.ones(len(self.COMPONENTS), dtype=bool)
        if not use.any():
            raise InputError(f"{self.name} has no component that was observed")
        self._set("precision", self._covariance(sd, covariance, use))

    def _check_rotation(self, name: str, matrix: Floats) -> None:
        if not np.abs(matrix.T @ matrix - np.eye(3)).max() < _ORTHONORMAL:
            raise InputError(f"{name} of {self.name} is no rotation matrix: {matrix.tolist()}")
        if np.linalg.det(matrix) < 0:
            raise InputError(f"{name} of {self.name} is mirrored: its determinant is -1")

    def _covariance(
        self,
        sd: ArrayLike | None,
        covariance: ArrayLike | None,
        use: np.ndarray[tuple[int], np.dtype[np.bool_]],
    ) -> Floats:
        """Return the covariance matrix; `use` says which components were observed."""
        r = len(self.COMPONENTS)
        if sd is not None and covariance is None:
            deviations = shaped(f"sd of {self.name}", sd, (r,), missing=True)
            own = deviations[use]
            if not ((own > 0) & np.isfinite(own)).all():
                raise InputError(f"sd of {self.name} is not positive and finite: {deviations.tolist()}")
            return np.asarray(np.diag(np.where(use, deviations, 1.0) ** 2))
        if sd is not None or covariance is None:
            raise InputError(f"{self.name} needs either sd or covariance")
        matrix = shaped(f"covariance of {self.name}", covariance, (r, r), missing=True)
        if not _definite(matrix[np.ix_(use, use)]):
            raise InputError(
                f"covariance of {self.name} is not symmetric and positive definite: {matrix.tolist()}"
            )
        return matrix


def _definite(matrix: Floats) -> bool:
    """Whether a matrix is that of covariances."""
    variances = np.diag(matrix)
    if not (np.isfinite(matrix).all() and (variances > 0).all()):
        return False
    correlations = matrix / np.sqrt(np.outer(variances, variances))
    symmetric = np.abs(correlations - correlations.T).max() <= _SYMMETRIC
    return bool(symmetric and np.linalg.eigvalsh(correlations).min() > 0)


@dataclass(frozen=True, eq=False)
class Distance(Observation):
    """The distance between two points: a tape, a rangefinder, the ends of a scale bar.

    The norm of Q - P.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    length
        Observed, in the linear unit of the object space.
    sd
        Its standard deviation in the same unit.

    Raises
    ------
    InputError
        A point with itself, a length or a standard deviation that is not positive and finite.
    """

    KIND = "distance"
    COMPONENTS = ("length",)

    first: str
    second: str
    length: float
    sd: float

    def __post_init__(self) -> None:
        self._take((self.first, self.second), {"length": ()}, self.sd, None)
        if not self.observed[0] > 0:
            raise InputError(f"length of {self.name} is not positive: {self.length}")


@dataclass(frozen=True, eq=False)
class EqualHeight(Observation):
    """Two points at one height, or with the difference of heights that was levelled.

    h = Z_Q - Z_P; heights above the ellipsoid where the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    sd
        Standard deviation in the linear unit of the object space.
    difference
        Observed height of Q above P in the same unit.

    Raises
    ------
    InputError
        A point with itself, a difference that is not finite, a standard deviation that is not positive and
        finite.
    """

    KIND = "equal height"
    COMPONENTS = ("height",)

    first: str
    second: str
    sd: float
    difference: float = 0.0

    def __post_init__(self) -> None:
        self._take((self.first, self.second), {"difference": ()}, self.sd, None)


@dataclass(frozen=True, eq=False)
class Difference(Observation):
    """The vector from one point to another, or some of its components: a GNSS baseline, taped offsets.

    Q - P along X, Y, Z; geocentric axes where the object space is geographic.

    Parameters
    ----------
    first, second
        Names of the points P and Q.
    vector
        (3,) observed components in the linear unit of the object space; NaN where not observed.
    sd
        (3,) their standard deviations, or one for all; what stands where nothing was observed does not count.
    covariance
        (3, 3) their covariance matrix, in place of `sd`.

    Raises
    ------
    InputError
        A point with itself, no component, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "difference"
    COMPONENTS = _AXES

    first: str
    second: str
    vector: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._take((self.first, self.second), {"vector": (3,)}, self.sd, self.covariance)


@dataclass(frozen=True, eq=False)
class Control(Observation):
    """The position of a point with its full covariance, as from an adjustment of its own.

    Parameters
    ----------
    point
        Its name.
    position
        (3,) observed X, Y, Z; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "control"
    COMPONENTS = _AXES

    point: str
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._take((self.point,), {"position": (3,)}, self.sd, self.covariance)


@dataclass(frozen=True, eq=False)
class Position(Observation):
    """The position of the GNSS antenna of a photo: C + A l.

    Parameters
    ----------
    photo
        Its name.
    position
        (3,) observed X, Y, Z of the antenna; or longitude (rad), latitude (rad), height.
    sd
        (3,) standard deviations in the linear unit, or one for all: of X, Y, Z; or of east, north, up.
    covariance
        (3, 3) covariance matrix of the same, in place of `sd`.
    lever_arm
        (3,) l, from the projection centre to the antenna in the axes of the photo (x right, y up, z back
        towards the viewer), in the linear unit; known.

    Raises
    ------
    InputError
        Values that are not finite, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "position"
    OF_PHOTOS = True
    COMPONENTS = _AXES

    photo: str
    position: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    lever_arm: ArrayLike = 0.0

    def __post_init__(self) -> None:
        self._take((self.photo,), {"position": (3,), "lever_arm": (3,)}, self.sd, self.covariance)


@dataclass(frozen=True, eq=False)
class Attitude(Observation):
    """The attitude of the body that carries a camera, as an inertial unit gives it: A B.

    Parameters
    ----------
    photo
        Its name.
    attitude
        (3, 3) observed, body to object: its columns are the axes of the body in X, Y, Z; or in east, north,
        up at the photo where the object space is geographic.
    sd
        (3,) standard deviations of rotations about the axes of the body in radians, or one for all.
    covariance
        (3, 3) covariance matrix of the same in square radians, in place of `sd`.
    boresight
        (3, 3) B, body to the axes of the photo (x right, y up, z back towards the viewer); known. None where
        what is observed is the attitude of the photo itself.

    Raises
    ------
    InputError
        Matrices that are no rotations, both or none of `sd` and `covariance`, or such as give no weight.
    """

    KIND = "attitude"
    OF_PHOTOS = True
    COMPONENTS = _ROTATIONS

    photo: str
    attitude: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None
    boresight: ArrayLike | None = None

    def __post_init__(self) -> None:
        if self.boresight is None:
            self._set("boresight", np.eye(3))
        matrices = {"attitude": (3, 3), "boresight": (3, 3)}
        self._take((self.photo,), matrices, self.sd, self.covariance)


@dataclass(frozen=True, eq=False)
class Relative(Observation):
    """The pose of one photo in the axes of another: odometry, a calibrated stereo rig.

    t = A_i' (C_j - C_i) and R = A_i' A_j, A being the matrix from photo to object.

    Parameters
    ----------
    first, second
        Names of the photos i and j.
    translation
        (3,) observed t in the axes of photo i (x right, y up, z back towards the viewer), in the linear unit.
    rotation
        (3, 3) observed R: its columns are the axes of photo j in those of photo i.
    sd
        (6,) standard deviations of the components of t in the linear unit, then of rotations about the axes
        of photo j in radians.
    covariance
        (6, 6) covariance matrix of the same, in place of `sd`.

    Raises
    ------
    InputError
        A photo with itself, values that are not finite, a matrix that is no rotation, both or none of `sd`
        and `covariance`, or such as give no weight.
    """

    KIND = "relative"
    OF_PHOTOS = True
    COMPONENTS = (*_AXES, *_ROTATIONS)

    first: str
    second: str
    translation: ArrayLike
    rotation: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        values = {"translation": (3,), "rotation": (3, 3)}
        self._take((self.first, self.second), values, self.sd, self.covariance)


def observation_rows(
    observations: Sequence[Observation], points: Sequence[str], photos: Sequence[str]
) -> list[tuple[list[int], Group]]:
    """Return observations kind by kind: their rows among the given ones, and what the core takes.

    Raises
    ------
    InputError
        A point or photo that is not there.
    """
    if not observations:
        return []
    places = [{name: row for row, name in enumerate(each)} for each in (points, photos)]

    def place(each: Observation, name: str) -> int:
        found = places[each.OF_PHOTOS].get(name)
        if found is None:
            what = "photo" if each.OF_PHOTOS else "point"
            raise InputError(f"the observation {each.name} is of the {what} {name}, which the block has not")
        return found

    by_kind: dict[str, list[int]] = {}
    for row, each in enumerate(observations):
        by_kind.setdefault(each.KIND, []).append(row)
    groups: list[tuple[list[int], Group]] = []
    for kind, rows in by_kind.items():
        own = [observations[row] for row in rows]
        of = np.array([[place(each, name) for name in each.of] for each in own], dtype=np.int64)
        values = np.stack([each.observed for each in own])
        groups.append((rows, (kind, of, values, np.stack([each.precision for each in own]))))
    return groups
