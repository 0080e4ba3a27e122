"""The block: photographs, points and image observations, as arrays or as tables."""

from __future__ import annotations

import copy
import math
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from photogram.arguments.arrays import (
    frozen,
    indices,
    length,
    repeated_pairs,
    shaped,
    shown,
    text,
    truth_value,
)
from photogram.arguments.equality import Valued
from photogram.arguments.objects import kind_error
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, fields
from photogram.messages import listed
from photogram.network.cameras import Camera, CameraRow, camera_rows
from photogram.network.films import check_scans, reads_pixels
from photogram.network.frame import Frame
from photogram.network.geometry import Spheroid
from photogram.network.knots import Knots
from photogram.network.moving_photos import Poses, Timed, checked_timed, own_trajectories
from photogram.network.observations import (
    Observation,
    Rate,
    Velocity,
    all_trajectories,
    moments,
    observation_rows,
    of_records,
)
from photogram.network.observations.observation import Group
from photogram.network.observations.unknowns import with_knots, with_smoothness
from photogram.network.passages import Figure, Passage, checked_passages
from photogram.network.refraction import Refraction, metres_per_unit
from photogram.network.rigs import Mount, checked_mounts
from photogram.network.tables import (
    GEOGRAPHIC_COLUMNS,
    RECTANGULAR_COLUMNS,
    Table,
    checked_cameras,
    different,
    numbered,
    photo_indices,
    table_arguments,
)
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown, different_unknowns
from photogram.show.summary import Brief, Rows, few

_NUMBERS: Any = None  # Names that are not given
_ANGLES = 1e6  # Radians: larger angles have lost the digits that an attitude needs


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Block(Valued, Brief):
    """A block of photographs with its measurements and everything known beforehand.

    P photos, n points, m image observations. Positions are X, Y, Z in the linear unit of the object space
    when `spheroid` is None (rectangular space), else longitude (rad, east positive), latitude (rad) and
    height (linear unit).

    Arrays are copied and cannot be written: a block, and a result made from it, stay what they are.
    :meth:`replace` makes another block. Where numbers may be missing they are NaN, or masked.

    Parameters
    ----------
    photo_ids
        P names, all different: strings that print, or whole numbers. None: 0, 1, 2 ...
    photo_positions, photo_attitudes
        (P, 3) initial positions, and omega, phi, kappa in radians: M = M_kappa M_phi M_omega (GIANT guide,
        section 5). Components whose standard deviation is 0 stay at these values. NaN where unknown:
        :func:`photogram.first_values` finds them.
    principal_distances
        (P,) in millimetres; negative for the positive (diapositive) plane, positive for the negative plane:
        cameras that are known and free of distortion, image coordinates counted from the principal point.
        None where there are `cameras`.
    point_ids
        n names, all different; None: 0, 1, 2 ...
    point_positions
        (n, 3); NaN where unknown: intersected from the initial rays.
    image_photos, image_points
        (m,) indices into photos and points. A photo has one image of a point: repeated pointings are averaged
        before.
    image_xy, image_sd
        (m, 2) image coordinates and their standard deviations in millimetres, or in the unit of the cameras;
        `image_sd` may be a number.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations of the observed values, in their units: infinite (free, the default), 0
        (fixed) or between (weighted).
    point_sd
        (n, 3): finite for held components of control, 0 to fix them, infinite (the default) for pass points
        and unheld components. An unheld component with a finite position is a check on the adjustment.
    point_check_sd
        (n, 3) standard deviations of the given coordinates of check points: no part of the adjustment, but of
        what differences are tested against. NaN where unknown (None: everywhere): as of control.
    spheroid
        None for rectangular space, else the ellipsoid of geographic space.
    photo_to_ground
        The sense of the attitude angles: False (ground-to-photo) turns object vectors into photo vectors.
    title
        One line for the report.
    linear_unit
        The linear unit of the object space, for the report; "m" or "ft" where there is refraction.
    refraction
        What bends the rays, applied in every iteration; None for image coordinates that are free of it.
    photo_positions_observed, photo_attitudes_observed
        (P, 3) observed values of the weighted components, as of GNSS and inertial measurements: the
        adjustment starts at the initial values and weights these. Whole turns of angles do not matter. NaN,
        or any number, where a component is free; the fixed value where it is fixed. None: the initial values.
    observations
        What else was observed: distances, differences of coordinates, heights, positions and attitudes of
        photos, relative poses, control with full covariance (:mod:`photogram.network`).
    cameras
        Cameras with distortion, or with unknown parameters, all of one image unit; in place of
        `principal_distances`.
    photo_cameras
        (P,) which camera each photo has: an index, or its name; photos with the same one share its unknowns.
        One for all photos; None where there is one camera, or one for each photo.
    mounts
        Which photos are on a frame with others, and in which pose (:class:`photogram.network.Mount`).
    timed
        Photos on trajectories: rolling shutters, line scanners (:class:`photogram.network.Timed`).
    passages
        What images pass beside pose, point and camera: boards that bend (:class:`photogram.network.Figure`).
    frame
        Where on the earth the coordinates are, for maps and other systems; the adjustment does not ask.

    Raises
    ------
    InputError
        Arrays of the wrong shape or type, values that are not finite or masked, indices out of range, names
        that repeat, are empty or are no names, a point with two images on a photo; refraction in a linear
        unit whose length is not known; observations of points or photos that are not there; both
        principal distances and cameras, or neither.
    """

    photo_ids: list[str] = _NUMBERS
    photo_positions: Floats
    photo_attitudes: Floats
    principal_distances: Floats | None = None
    point_ids: list[str] = _NUMBERS
    point_positions: Floats
    image_photos: Indices
    image_points: Indices
    image_xy: Floats
    image_sd: Floats
    photo_position_sd: Floats = field(default_factory=lambda: np.array(np.inf))
    photo_attitude_sd: Floats = field(default_factory=lambda: np.array(np.inf))
    point_sd: Floats = field(default_factory=lambda: np.array(np.inf))
    spheroid: Spheroid | None = None
    photo_to_ground: bool = False
    title: str = ""
    linear_unit: str = "m"
    refraction: Refraction | None = None
    photo_positions_observed: Floats | None = None
    photo_attitudes_observed: Floats | None = None
    observations: Sequence[Observation] = ()
    cameras: Sequence[Camera] = ()
    photo_cameras: Indices | None = None
    mounts: Sequence[Mount] = ()
    timed: Sequence[Timed] = ()
    passages: Sequence[Passage] = ()
    frame: Frame = field(default_factory=Frame)
    point_check_sd: Floats | None = None
    rejected_points = frozenset[str]()
    """Names of points whose image observations were all rejected; no field, but every copy has them."""
    if TYPE_CHECKING:
        # What checkers of types are told: more can be given than what the fields then hold.
        def __init__(
            self,
            *,
            photo_ids: Iterable[str | int] | None = None,
            photo_positions: ArrayLike,
            photo_attitudes: ArrayLike,
            principal_distances: ArrayLike | None = None,
            point_ids: Iterable[str | int] | None = None,
            point_positions: ArrayLike,
            image_photos: ArrayLike,
            image_points: ArrayLike,
            image_xy: ArrayLike,
            image_sd: ArrayLike,
            photo_position_sd: ArrayLike = ...,
            photo_attitude_sd: ArrayLike = ...,
            point_sd: ArrayLike = ...,
            spheroid: Spheroid | None = None,
            photo_to_ground: bool = False,
            title: str = "",
            linear_unit: str = "m",
            refraction: Refraction | None = None,
            photo_positions_observed: ArrayLike | None = None,
            photo_attitudes_observed: ArrayLike | None = None,
            observations: Sequence[Observation] = (),
            cameras: Sequence[Camera] = (),
            photo_cameras: ArrayLike | Sequence[str] | None = None,
            mounts: Sequence[Mount] = (),
            timed: Sequence[Timed] = (),
            passages: Sequence[Passage] = (),
            frame: Frame = ...,
            point_check_sd: ArrayLike | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name, of in (("photo_ids", "photo_positions"), ("point_ids", "point_positions")):
            given = getattr(self, name)
            given = numbered(length(of, getattr(self, of))) if given is None else given
            self._set(name, different(name, given))
        photos, points = len(self.photo_ids), len(self.point_ids)
        images = length("image_photos", self.image_photos)
        shapes: dict[str, tuple[int, ...]] = {
            "photo_positions": (photos, 3),
            "photo_attitudes": (photos, 3),
            "principal_distances": (photos,),
            "point_positions": (points, 3),
            "image_xy": (images, 2),
            "image_sd": (images, 2),
            "photo_position_sd": (photos, 3),
            "photo_attitude_sd": (photos, 3),
            "point_sd": (points, 3),
        }
        self._set("cameras", checked_cameras(self.cameras))
        if not self.cameras and self.photo_cameras is not None:
            raise InputError("photo_cameras is given, but no cameras")
        if self.cameras:
            if self.principal_distances is not None:
                raise InputError("principal_distances and cameras are both given: the cameras have them")
            self._set("photo_cameras", frozen(photo_indices(self.photo_cameras, self.cameras, photos)))
        for name, shape in shapes.items():
            if name == "principal_distances" and self.cameras:
                continue
            missing = name in ("point_positions", "photo_positions", "photo_attitudes")
            self._set(name, shaped(name, getattr(self, name), shape, missing=missing))
        for name in ("photo_positions_observed", "photo_attitudes_observed"):
            if getattr(self, name) is not None:
                self._set(name, shaped(name, getattr(self, name), (photos, 3), missing=True))
        if self.point_check_sd is not None:
            self._set(
                "point_check_sd", shaped("point_check_sd", self.point_check_sd, (points, 3), missing=True)
            )
        for name, count in (("image_photos", photos), ("image_points", points)):
            self._set(name, indices(name, getattr(self, name), images, count))
        self._check_values()
        self._check_observed()
        self._check_twice()
        self._check_conventions()
        self._check_observations()

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _check_values(self) -> None:
        owners = {"photo": self.photo_ids, "princ": self.photo_ids, "point": self.point_ids}
        for name in ("photo_positions", "photo_attitudes"):
            self._refuse(name, np.isinf(getattr(self, name)), "is not a finite number", self.photo_ids)
        given = ("principal_distances",) if self.principal_distances is not None else ()
        for name in (*given, "image_xy"):
            bad = ~np.isfinite(getattr(self, name))
            self._refuse(name, bad, "is not a finite number", owners.get(name[:5]))
        beyond = np.abs(self.photo_attitudes) > _ANGLES
        self._refuse("photo_attitudes", beyond, f"is beyond {_ANGLES:g} radians", self.photo_ids)
        if self.principal_distances is not None:
            self._refuse("principal_distances", self.principal_distances == 0, "is zero", self.photo_ids)
        self._refuse("point_positions", np.isinf(self.point_positions), "is infinite", self.point_ids)
        for name in ("photo_position_sd", "photo_attitude_sd", "point_sd"):
            self._refuse(name, ~(getattr(self, name) >= 0), "is not a standard deviation", owners[name[:5]])
        if self.point_check_sd is not None:
            bad = ~(np.isnan(self.point_check_sd) | (self.point_check_sd >= 0)) | np.isinf(
                self.point_check_sd
            )
            self._refuse("point_check_sd", bad, "is not a finite standard deviation", self.point_ids)
        bad = ~((self.image_sd > 0) & np.isfinite(self.image_sd))
        self._refuse("image_sd", bad, "is not a positive, finite standard deviation", None)
        held_unknown = np.isfinite(self.point_sd) & np.isnan(self.point_positions)
        self._refuse(
            "point_positions", held_unknown, "is unknown but held (its point_sd is finite)", self.point_ids
        )

    def _check_observed(self) -> None:
        for name, initial, sd in (
            ("photo_positions_observed", self.photo_positions, self.photo_position_sd),
            ("photo_attitudes_observed", self.photo_attitudes, self.photo_attitude_sd),
        ):
            observed = getattr(self, name)
            if observed is None:
                unknown = np.isnan(initial) & np.isfinite(sd)
                why = "is unknown but weighted or fixed (its sd is finite)"
                self._refuse(name.removesuffix("_observed"), unknown, why, self.photo_ids)
                continue
            self._refuse(name, np.isinf(observed), "is infinite", self.photo_ids)
            if initial is self.photo_attitudes:
                beyond = np.abs(observed) > _ANGLES
                self._refuse(name, beyond, f"is beyond {_ANGLES:g} radians", self.photo_ids)
            unknown = np.isnan(observed) & np.isfinite(sd)
            self._refuse(name, unknown, "is unknown but weighted (its sd is finite)", self.photo_ids)
            moved = (sd == 0) & (observed != initial)
            self._refuse(name, moved, "is fixed (its sd is 0), but not at the initial value", self.photo_ids)

    def _check_twice(self) -> None:
        """Refuse a second image of a point on a photo: it would count as an independent observation."""
        again = repeated_pairs(self.image_photos, self.image_points, len(self.point_ids))
        if again.size:
            second = again[0]
            photo, point = self.image_photos[second], self.image_points[second]
            first = np.flatnonzero((self.image_photos == photo) & (self.image_points == point))[0]
            point, photo = self.point_ids[point], self.photo_ids[photo]
            raise InputError(
                f"the point {point} has two images on the photo {photo} (rows {first} and {second}):"
                " average repeated pointings"
            )

    def _check_conventions(self) -> None:
        text("title", self.title)
        text("linear_unit", self.linear_unit)
        self._set("photo_to_ground", truth_value("photo_to_ground", self.photo_to_ground))
        if self.spheroid is not None and not isinstance(self.spheroid, Spheroid):
            raise InputError(f"spheroid is a Spheroid or None, not {shown(self.spheroid)}")
        if not isinstance(self.frame, Frame):
            raise InputError(f"frame is a Frame, not {shown(self.frame)}")
        if self.refraction is not None:
            if not isinstance(self.refraction, Refraction):
                raise InputError(f"refraction is a Refraction or None, not {shown(self.refraction)}")
            metres_per_unit(self.linear_unit)

    def _check_timed(self) -> None:
        self._set("timed", checked_timed(self.timed, self.photo_ids))
        self._check_own_poses()
        poses = Poses(
            self.photo_ids,
            self.photo_positions,
            self.photo_attitudes,
            self.photo_position_sd,
            self.photo_attitude_sd,
            self.photo_positions_observed,
            self.photo_to_ground,
            self.geographic,
        )
        self._set("_trajectories", own_trajectories(self.timed, poses))
        on_frames = {each.photo for each in self.mounts} | {each.frame for each in self.mounts}
        both = [each.photo for each in self.timed if each.photo in on_frames]
        if both:
            raise InputError(f"the photo {both[0]} is on a trajectory and on a frame: say so by its sensor")
        shared = [each.photo for each in self.timed if each.trajectory is not None]
        if shared:
            on_shared = np.isin(self.photo_ids, shared)[:, np.newaxis]
            why = "is weighted or fixed, but the photo is on a trajectory, whose coefficients may be"
            for name in ("photo_position_sd", "photo_attitude_sd"):
                self._refuse(name, on_shared & np.isfinite(getattr(self, name)), why, self.photo_ids)
        scanned = [each.photo for each in self.timed if each.lines is not None]
        if scanned and self.image_unit != "mm":
            raise InputError(
                f"the photo {scanned[0]} is a scanner's: its camera is in mm, not {self.image_unit}"
            )
        of_scanners = np.isin(self.photo_ids, scanned)
        own = [] if self.photo_cameras is None else np.unique(self.photo_cameras[of_scanners]).tolist()
        if measured := [self.cameras[row].title for row in own if self.cameras[row].weights == "measured"]:
            raise InputError(
                f"the camera {measured[0]} is a scanner's: standard deviations of its images are of the"
                " corrected place in the focal plane, not of what was measured (docs/moving.md#images)"
            )
        named = Counter(each.name for each in self.all_trajectories)
        twice = [name for name, count in named.items() if count > 1]
        if twice:
            raise InputError(
                f"two trajectories are called {twice[0]}: photos and records that are on one take one object"
            )

    def _check_own_poses(self) -> None:
        """Refuse photos with a trajectory of their own, which goes from their pose, without that."""
        if not (own := [each.photo for each in self.timed if each.trajectory is None]):
            return
        unknown = np.isnan(self.photo_positions).any(axis=1) | np.isnan(self.photo_attitudes).any(axis=1)
        for row in np.flatnonzero(unknown & np.isin(self.photo_ids, own)).tolist():
            raise InputError(
                f"the pose of the photo {self.photo_ids[row]}, from which it moves, is not known:"
                " photogram.first_values finds it of the block without what is timed"
            )

    def _check_motions(self) -> None:
        """Refuse motions of photos that have none of their own, and poses of scanners at no time."""
        sensors = {each.photo: each.sensor for each in self.timed}
        # The middle of their images is another where one of these is left out.
        strips = {each.photo for each in self.timed if each.lines is not None and each.time is None}
        for each in self.observations:
            if each.moment is None and not strips.isdisjoint(each.photos):
                name = next(photo for photo in each.photos if photo in strips)
                raise InputError(
                    f"the {each.KIND} of the photo {name}: a scanner has no one pose; give it a time, or take"
                    " the trajectory at one"
                )
            if not isinstance(each, Rate | Velocity) or each.moment is not None:
                continue
            photo = each.photos[0]
            if photo not in sensors and photo in self.photo_ids:
                raise InputError(f"the {each.KIND} of the photo {photo}: it is on no trajectory")
            if sensors.get(photo) is not None:
                raise InputError(
                    f"the {each.KIND} of the photo {photo}: it is a sensor on a trajectory; take the"
                    " trajectory at its time"
                )

    def _check_observations(self) -> None:
        if not isinstance(self.observations, Sequence):
            raise InputError(f"observations is no list: {shown(self.observations)}")
        self._set("observations", tuple(self.observations))
        for row, each in enumerate(self.observations):
            if not isinstance(each, Observation) or not each.KIND:
                raise InputError(f"observations[{row}] is no observation: {shown(each)}")
        self._set("mounts", checked_mounts(self.mounts, self.photo_ids))
        if self.mounts:
            mounted = np.isin(self.photo_ids, [mount.photo for mount in self.mounts])[:, np.newaxis]
            why = "is weighted or fixed, but the photo is on a frame, whose pose and sensor it has"
            for name in ("photo_position_sd", "photo_attitude_sd"):
                self._refuse(name, mounted & np.isfinite(getattr(self, name)), why, self.photo_ids)
        self._check_timed()
        self._check_motions()
        self._set("passages", checked_passages(self.passages, self.point_ids, self.photo_ids))
        self._set("observations", with_smoothness(self.observations, self.trajectories))
        self._set("observations", with_knots(self.observations, self.cameras))
        _ = self.observation_groups  # refuses what observations name and the block has not
        figures = {
            name: figure.title
            for figure in self.passages
            if isinstance(figure, Figure)
            for name in figure.points
        }
        touched = {name for row in self.observations for name in row.points} if figures else set()
        for row, name in enumerate(self.point_ids if figures else ()):
            if name in figures and (self.point_sd[row].any() or name in touched):
                raise InputError(
                    f"the point {name} of the {figures[name]} is free, weighted or observed beside images:"
                    " its coordinates are given, and point_sd is 0"
                )
        of_photos = self.photo_cameras if self.cameras else None
        check_scans(self.passages, self.photo_ids, self.cameras, of_photos, self.image_photos)

    def _refuse(self, name: str, bad: NDArray[np.bool_], why: str, owners: list[str] | None) -> None:
        if bad.any():
            row = int(np.argwhere(bad)[0][0])
            if owners is not None:
                of = owners[row]
            else:
                point, photo = self.image_points[row], self.image_photos[row]
                of = f"{self.point_ids[point]} on photo {self.photo_ids[photo]}"
            raise InputError(f"{name} of {of} {why}: {getattr(self, name)[row].tolist()}")

    def brief(self) -> tuple[str, Rows]:
        """Return what the block is in a few lines, as its `repr` and notebooks show it."""
        held, known = np.isfinite(self.point_sd).any(axis=1), np.isfinite(self.point_positions).any(axis=1)
        counts = {"control": held.sum(), "with known coordinates": (known & ~held).sum()}
        told = ", ".join(f"{count:,} {name}" for name, count in counts.items())
        distances = self.principal_distances
        spheroid = self.spheroid
        kinds = Counter(each.label for each in self.observations)
        rows = [
            ("photos", few(self.photo_ids)),
            ("points", few(self.point_ids)),
            ("", told),
            ("images", f"{len(self.image_xy):,}, {self.image_unit}, sd {_span(self.image_sd)}"),
            ("cameras", few(self.camera_names) if distances is None else f"c {_span(distances)} mm"),
            ("space", f"geographic, a = {spheroid.a:g}" if spheroid else "rectangular"),
            ("unit", self.linear_unit),
        ]
        if kinds:
            # A kind of smoothness says how many coefficients of what it is of.
            named = (f"{count} {name.replace(', ', ' of ')}" for name, count in kinds.items())
            rows.append(("observations", ", ".join(named)))
        if self.mounts:
            rows.append(("on frames", few([each.photo for each in self.mounts])))
        if self.timed:
            rows.append(("on trajectories", few([each.photo for each in self.timed])))
        if self.refraction is not None:
            rows.append(("refraction", str(self.refraction)))
        return f"Block: {self.title}" if self.title else "Block", rows

    @property
    def geographic(self) -> bool:
        """Whether positions are longitude, latitude and height."""
        return self.spheroid is not None

    @property
    def trajectories(self) -> list[Trajectory]:
        """The trajectory of each of `timed`: what it is given, or its own."""
        own: list[Trajectory] = vars(self)["_trajectories"]
        return own

    @property
    def all_trajectories(self) -> list[Trajectory]:
        """Those of photos, then those of records, each once."""
        return all_trajectories(self.trajectories, self.observations)

    @property
    def all_passages(self) -> list[Passage]:
        """What images pass: `passages`, then the splines of cameras with unknown knots."""
        splined = [(row, each.knot_unknowns) for row, each in enumerate(self.cameras) if each.knot_unknowns]
        return [*self.passages, *(Knots(row, knots) for row, knots in splined)]

    @cached_property
    def unknowns(self) -> list[Unknown]:
        """What observations, and photos on frames or trajectories, have in common, in order."""
        of_observations = (each for own in self.observations for each in own.unknowns if each is not None)
        sensors = [mount.sensor for mount in self.mounts]
        sensors += [each.sensor for each in self.timed if each.sensor is not None]
        of_times = [scalar for each in self.timed for scalar in each.scalars]
        coefficients = [each for own in self.trajectories for all_ in own.coefficients for each in all_]
        records = of_records(self.observations)
        passed = [own for each in self.all_passages for own in each.unknowns]
        return different_unknowns([*sensors, *of_times, *coefficients, *records, *passed, *of_observations])

    @cached_property
    def observation_groups(self) -> list[tuple[list[int], Group]]:
        """The observations kind by kind: their rows, and what the core takes."""
        return observation_rows(self.observations, self.point_ids, self.photo_ids, self.unknowns)

    @property
    def image_unit(self) -> str:
        """What image coordinates are measured in, `mm` or `px`; of scanned films what readings are."""
        if self.passages and reads_pixels(self.passages):
            return "px"
        return str(self.cameras[0].unit) if self.cameras else "mm"

    @property
    def camera_names(self) -> list[str]:
        """What reports call the cameras: their names, numbers for those without."""
        return [each.name or f"camera {row}" for row, each in enumerate(self.cameras, 1)]

    def camera_scales(self) -> Floats:
        """Return (P,) principal distances without sign, in the unit of image coordinates."""
        if self.principal_distances is not None:
            return np.abs(self.principal_distances)
        return np.array([each.scale for each in self.cameras])[self.photo_cameras]

    def core_cameras(self) -> tuple[list[CameraRow], Indices]:
        """Return the different cameras as the core takes them, and (P,) which one each photo has."""
        if self.photo_cameras is not None:
            return camera_rows(self.cameras), self.photo_cameras
        distances = self.known_distances("the adjustment").tolist()
        places = {distance: row for row, distance in enumerate(dict.fromkeys(distances))}
        rows: list[CameraRow] = [("perspective", [distance], [0.0], None, None) for distance in places]
        return rows, np.array([places[distance] for distance in distances], dtype=np.int64)

    def known_distances(self, what: str) -> Floats:
        """Return (P,) principal distances of cameras that are known and free of distortion, millimetres.

        Raises
        ------
        InputError
            There are others, which `what` does not take.
        """
        if self.principal_distances is not None:
            return self.principal_distances
        for name, each in zip(self.camera_names, self.cameras, strict=True):
            if each.model != "perspective" or not each.is_held or each.unit != "mm":
                raise InputError(
                    f"{what}: {name} has the model {each.model} or unknown parameters; only cameras that are"
                    " known and free of distortion, in mm, are taken there"
                )
        distances = np.array([each.values[0] for each in self.cameras])
        return np.asarray(distances[self.photo_cameras])

    @classmethod
    def from_tables(
        cls,
        photos: Table,
        images: Table,
        points: Table | None = None,
        *,
        principal_distance: float | None = None,
        cameras: Sequence[Camera] = (),
        image_sd: float | None = None,
        spheroid: Spheroid | None = None,
        photo_to_ground: bool = False,
        title: str = "",
        linear_unit: str = "m",
        refraction: Refraction | None = None,
    ) -> Block:
        """Build a block from tables: pandas or polars data frames, or any mapping of column names to columns.

        Parameters
        ----------
        photos
            `photo` (without it 0, 1, 2 ...); `X`, `Y`, `Z` (or `longitude_deg`, `latitude_deg`, `height` when
            a spheroid is given); `omega_deg`, `phi_deg`, `kappa_deg`. Optional: `principal_distance_mm` or,
            with cameras, `camera` (index or name), and before any of the six names `sd_` (same units) and
            `observed_`, the observed value where it is not the initial one.
        images
            `photo`, `point`, `x_mm`, `y_mm`. Optional: `sd_x_mm`, `sd_y_mm`. With cameras in pixels all four
            end in `_px`.
        points
            Control and check points: `point` and the three coordinates as for photos; NaN where unknown.
            Optional: `sd_` columns; without them, or where they are infinite or NaN, components are not held.
            Image points without a row here are pass points.
        principal_distance
            Millimetres, signed, for all photos, when the column is not there.
        cameras
            As in the class, in place of principal distances.
        image_sd
            For image coordinates without a column of their own: 0.010 mm when None, which pixels are not.
        spheroid, photo_to_ground, title, linear_unit, refraction
            As in the class.

        Raises
        ------
        InputError
            A column that is missing, a photo that `photos` does not name, or whatever the class refuses.
        """
        return cls(
            **table_arguments(photos, images, points, principal_distance, cameras, image_sd, spheroid),
            spheroid=spheroid,
            photo_to_ground=photo_to_ground,
            title=title,
            linear_unit=linear_unit,
            refraction=refraction,
        )

    def replace(self, **changes: Any) -> Self:
        """Return a block with some fields replaced, checked anew; the arrays of the others are shared.

        With another number of points `point_check_sd` is not kept, unless it is replaced too.

        Raises
        ------
        InputError
            A name that is no field, or whatever the class refuses.
        """
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        if unknown := changes.keys() - values.keys():
            raise InputError(f"a block has no {', '.join(sorted(unknown))}")
        points = changes.get("point_ids")
        if points is not None and len(points) != len(self.point_ids):
            values["point_check_sd"] = None
        own = type(self)(**{**values, **changes})
        own._set("rejected_points", self.rejected_points)
        return own

    def with_fixed_photos(self) -> Self:
        """Return the block with positions and attitudes that stay as they are: every point by itself.

        Raises
        ------
        InputError
            Photos or observations on trajectories.
        """
        refuse_trajectories(self, "fixed photos", "whose pose is not its own")
        return self.replace(
            photo_position_sd=0.0,
            photo_attitude_sd=0.0,
            photo_positions_observed=None,
            photo_attitudes_observed=None,
        )

    def in_frame(self, frame: Frame) -> Self:
        """Return the block with another frame; the coordinates are the same."""
        own = copy.copy(self)
        own._set("frame", frame)
        return own

    def kept(self) -> Self:
        """Return the block as a result keeps it: with lists of names of its own, the arrays shared."""
        own = copy.copy(self)
        own._set("photo_ids", list(self.photo_ids))
        own._set("point_ids", list(self.point_ids))
        return own


def _span(values: Floats) -> str:
    """Return a number that stands for all, or the least and the largest."""
    low, high = (float(values.min()), float(values.max())) if values.size else (math.nan, math.nan)
    return f"{low:.6g}" if low == high else f"{low:.6g} to {high:.6g}"


def flown_by(block: Block) -> str:
    """Return what of a block is on a trajectory, by name; nothing where nothing is."""
    if block.timed:
        return f"the photo {block.timed[0].photo} is on a trajectory"
    records = moments(block.observations)
    return f"observations are of the trajectory {records[0].trajectory.name}" if records else ""


def of_images_alone(block: Block, what: str) -> Block:
    """Return a block that has nothing but images; refuse others for what would leave the rest out."""
    refuse_trajectories(block, what)
    refuse_passages(block, what)
    if block.observations:
        raise InputError(f"{what}: the block has observations beside images, which are not taken there")
    if block.mounts:
        raise InputError(f"{what}: the block has photos on frames, which are not taken there")
    return block


def refuse_trajectories(block: Block, what: str, why: str = "which is not taken there") -> None:
    """Refuse a block with photos or observations on trajectories for what does not take them."""
    if flown := flown_by(block):
        raise InputError(f"{what}: {flown}, {why}")


def refuse_passages(block: Block, what: str, *, but: type[Passage] | tuple[()] = ()) -> None:
    """Refuse a block whose images pass something beside pose, point and camera, `but` what is of a kind."""
    if passed := [each for each in block.all_passages if not isinstance(each, but)]:
        raise InputError(f"{what}: images of the block pass a {passed[0].KIND}, which is not taken there")


def checked(block: Block) -> Block:
    """Return a block whose photos have positions and attitudes; refuse all else, by name."""
    require_block(block)
    unknown = np.isnan(block.photo_positions).any(axis=1) | np.isnan(block.photo_attitudes).any(axis=1)
    if unknown.any():
        photos = listed([block.photo_ids[row] for row in np.flatnonzero(unknown)])
        raise InputError(
            f"positions or attitudes of the photos {photos} are not known: photogram.first_values finds"
            " initial values"
        )
    return block


def require_block(block: object) -> None:
    """Refuse an argument that is not a block."""
    if not isinstance(block, Block):
        raise kind_error("block", "a Block", block)


def position_columns(block: Block) -> tuple[str, str, str]:
    """Names of the three columns of positions in tables."""
    return GEOGRAPHIC_COLUMNS if block.geographic else RECTANGULAR_COLUMNS
