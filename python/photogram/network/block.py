"""Block of photos, points and image observations, built from arrays or tables."""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from photogram.arguments.arrays import text
from photogram.arguments.equality import Valued
from photogram.arguments.fields import array
from photogram.arguments.objects import kind_error
from photogram.arguments.types import (
    FREE,
    NONE,
    Array,
    Floats,
    IndexArray,
    Indices,
    NamedIndices,
    Names,
    OptionalArray,
)
from photogram.errors import InputError
from photogram.lazy_dataclasses import converting_dataclass, field, fields
from photogram.network.block_checks import (
    GEOGRAPHIC_COLUMNS,
    RECTANGULAR_COLUMNS,
    Table,
    check_block,
    known_poses,
    table_arguments,
    unsupported,
)
from photogram.network.cameras import Camera, CameraRow, camera_rows
from photogram.network.films import reads_pixels
from photogram.network.geometry import Frame, Spheroid
from photogram.network.moving_photos import Mount, Timed
from photogram.network.observations import Observation, Observations, all_trajectories, moments, of_records
from photogram.network.observations.columns import Group
from photogram.network.passages import Knots, Passage
from photogram.network.refraction import Refraction
from photogram.network.trajectories import Trajectory
from photogram.network.unknowns import Unknown, different_unknowns
from photogram.summaries import Brief, Rows, few
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.arguments.types import Converted

    Records = Converted[Sequence[Observation | Observations[Any]], Observations[Observation]]
else:
    Records = Sequence[Observation]

NO_RECORDS: Any = Observations()


@converting_dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Block(Valued, Brief):
    """Block of photographs with observations and prior information.

    P photos, n points, m image observations. Positions are X, Y, Z in the linear unit of the object space
    if `spheroid` is None (rectangular space). Otherwise they are longitude (rad, east positive), latitude
    (rad) and height (linear unit).

    Arrays are copied and read-only, so that a block and its results do not change. :meth:`replace` creates
    a changed block. Missing numbers are NaN, or masked.

    Parameters
    ----------
    photo_ids
        P unique names: printable strings, or whole numbers. None: 0, 1, 2 ...
    photo_positions, photo_attitudes
        (P, 3) initial positions, and omega, phi, kappa in radians: M = M_kappa M_phi M_omega (GIANT guide,
        section 5). Components with standard deviation 0 are fixed at these values. NaN if unknown:
        :func:`photogram.first_values` computes them.
    principal_distances
        (P,) in millimetres; negative for the positive (diapositive) plane, positive for the negative plane.
        The cameras are fixed and free of distortion. Image coordinates refer to the principal point. None if
        `cameras` are specified.
    point_ids
        n unique names; None: 0, 1, 2 ...
    point_positions
        (n, 3); NaN if unknown: intersected from the initial rays.
    image_photos, image_points
        (m,) indices of photos and points. A photo observes a point at most once; average repeated
        measurements first.
    image_xy, image_sd
        (m, 2) image coordinates and their standard deviations in millimetres, or in the unit of the cameras;
        `image_sd` may be one number.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations of the observed values, in their units: infinite (free, the default), 0
        (fixed) or between (weighted).
    point_sd
        (n, 3): finite for components of control points (0 fixes them), infinite (the default) for pass
        points and free components. A free component with a finite position is a check on the adjustment.
    point_check_sd
        (n, 3) standard deviations of the given coordinates of check points. They do not affect the
        adjustment, only tests of differences. NaN if unknown (None: all): the median of control is assumed.
    spheroid
        None for rectangular space, else the ellipsoid of geographic space.
    photo_to_ground
        Direction of the attitude angles: False (ground-to-photo) rotates object vectors into photo vectors.
    title
        One line for the report.
    linear_unit
        Linear unit of the object space, for the report; must be "m" or "ft" if there is refraction.
    refraction
        Refraction model, applied in every iteration; None for image coordinates without refraction.
    photo_positions_observed, photo_attitudes_observed
        (P, 3) observed values of the weighted components, e.g. GNSS and inertial measurements. The
        adjustment starts at the initial values. Angles may differ by full circles. NaN or any number for
        free components, the fixed value for fixed ones. None: the initial values.
    observations
        Additional observations: distances, differences of coordinates, heights, positions and attitudes of
        photos, relative poses, control with full covariance (:mod:`photogram.network`).
    cameras
        Cameras with distortion or unknown parameters, all of one image unit. They replace
        `principal_distances`.
    photo_cameras
        (P,) camera of each photo: an index, or its name. Photos of one camera share its unknowns. One value
        applies to all photos. None if there is one camera, or one for each photo.
    mounts
        Photos mounted on a common frame, with relative poses (:class:`photogram.network.Mount`).
    timed
        Photos on trajectories: rolling shutters, line scanners (:class:`photogram.network.Timed`).
    passages
        Image transformations in addition to pose, point and camera, e.g. boards that bend
        (:class:`photogram.network.Figure`).
    frame
        Reference frame of the coordinates, for maps and transformations; not used by the adjustment.

    Raises
    ------
    InputError
        If an array has a wrong shape or type, a value is not finite or is masked, or an index is invalid.
        If a name is repeated, empty or not printable, or a photo observes a point twice.
        If refraction is combined with a linear unit of unknown length.
        If an observation refers to an unknown point or photo.
        If both or neither of principal distances and cameras are specified.
    """

    photo_ids: Names = field(default=NONE)
    photo_positions: Array = field(metadata=array("photos", 3, rule="not-infinite", missing=True))
    photo_attitudes: Array = field(metadata=array("photos", 3, rule="angle", missing=True))
    principal_distances: OptionalArray = field(default=NONE, metadata=array("photos", rule="not-zero"))
    point_ids: Names = field(default=NONE)
    point_positions: Array = field(metadata=array("points", 3, rule="not-infinite", missing=True))
    image_photos: IndexArray = field(metadata=array("images", index="photos"))
    image_points: IndexArray = field(metadata=array("images", index="points"))
    image_xy: Array = field(metadata=array("images", 2, rule="finite"))
    image_sd: Array = field(metadata=array("images", 2, rule="positive"))
    photo_position_sd: Array = field(default=FREE, metadata=array("photos", 3, rule="sd"))
    photo_attitude_sd: Array = field(default=FREE, metadata=array("photos", 3, rule="sd"))
    point_sd: Array = field(default=FREE, metadata=array("points", 3, rule="sd"))
    spheroid: Spheroid | None = None
    photo_to_ground: bool = False
    title: str = field(default="", metadata={"check": text})
    linear_unit: str = field(default="m", metadata={"check": text})
    refraction: Refraction | None = None
    photo_positions_observed: OptionalArray = field(
        default=NONE, metadata=array("photos", 3, rule="not-infinite", missing=True)
    )
    photo_attitudes_observed: OptionalArray = field(
        default=NONE, metadata=array("photos", 3, rule="angle", missing=True)
    )
    observations: Records = field(default=NO_RECORDS)
    cameras: Sequence[Camera] = ()
    photo_cameras: NamedIndices = field(default=NONE, metadata=array("photos", index="cameras"))
    mounts: Sequence[Mount] = ()
    timed: Sequence[Timed] = ()
    passages: Sequence[Passage] = ()
    frame: Frame = field(default_factory=Frame)
    point_check_sd: OptionalArray = field(
        default=NONE, metadata=array("points", 3, rule="check-sd", missing=True)
    )
    rejected_points = frozenset[str]()
    """Points whose image observations were all rejected; copied with the block, but not a field."""

    def __post_init__(self) -> None:
        check_block(self, {each.name for each in fields(self)})

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the block, as shown by its `repr` and in notebooks."""
        held, known = np.isfinite(self.point_sd).any(axis=1), np.isfinite(self.point_positions).any(axis=1)
        counts = {"control": held.sum(), "with known coordinates": (known & ~held).sum()}
        kinds_of_points = ", ".join(f"{count:,} {name}" for name, count in counts.items())
        distances, spheroid = self.principal_distances, self.spheroid
        c, images = None if distances is None else span(distances), span(self.image_sd)
        kinds = {own.label: len(own.rows) for own in self.observations.columns}
        rows = [
            ("photos", few(self.photo_ids)),
            ("points", few(self.point_ids)),
            ("", kinds_of_points),
            ("images", str(phrase("brief.images", n=len(self.image_xy), unit=self.image_unit, sd=images))),
            ("cameras", few(self.camera_names) if c is None else str(phrase("brief.distances", c=c))),
            ("space", str(phrase("brief.geographic", a=spheroid.a) if spheroid else "rectangular")),
            ("unit", self.linear_unit),
        ]
        if kinds:
            # The label of smoothness observations contains the number of coefficients.
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
        """Trajectory of each entry of `timed`: the given one, or its own."""
        own: list[Trajectory] = vars(self)["_trajectories"]
        return own

    @property
    def all_trajectories(self) -> list[Trajectory]:
        """Trajectories of photos, then of observations, each once."""
        return all_trajectories(self.trajectories, self.observations)

    @property
    def all_passages(self) -> list[Passage]:
        """Image transformations: `passages`, then the splines of cameras with unknown knots."""
        splined = [(row, each.knot_unknowns) for row, each in enumerate(self.cameras) if each.knot_unknowns]
        return [*self.passages, *(Knots(row, knots) for row, knots in splined)]

    @cached_property
    def _photo_rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.photo_ids)}

    @cached_property
    def _point_rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.point_ids)}

    @cached_property
    def unknowns(self) -> list[Unknown]:
        """Unknowns shared by observations, mounted photos and trajectories, in order."""
        own_unknowns = dict.fromkeys(self.observations.column("unknowns"))
        of_observations = (each for own in own_unknowns for each in own if each is not None)
        sensors = [mount.sensor for mount in self.mounts]
        sensors += [each.sensor for each in self.timed if each.sensor is not None]
        of_times = [scalar for each in self.timed for scalar in each.scalars]
        coefficients = [each for own in self.trajectories for all_ in own.coefficients for each in all_]
        records = of_records(self.observations)
        passed = [own for each in self.all_passages for own in each.unknowns]
        return different_unknowns([*sensors, *of_times, *coefficients, *records, *passed, *of_observations])

    @cached_property
    def observation_groups(self) -> list[Group]:
        """Arrays for the core of the observations of each type, in `core_order`.

        Record times follow the photos. InputError if a point or photo is not in the block.
        """
        if not self.observations:
            return []
        records = enumerate(moments(self.observations), len(self.photo_ids))
        photos = self._photo_rows | {each.name: row for row, each in records}
        unknowns = {id(each): row for row, each in enumerate(self.unknowns)}
        return [own.group(self._point_rows, photos, unknowns) for own in self.observations.columns]

    @property
    def image_unit(self) -> str:
        """Unit of image coordinates, `mm` or `px`; for scanned films, the unit of readings."""
        if self.passages and reads_pixels(self.passages):
            return "px"
        return str(self.cameras[0].unit) if self.cameras else "mm"

    @property
    def camera_names(self) -> list[str]:
        """Camera names in reports; unnamed cameras are numbered."""
        return [each.name or f"camera {row}" for row, each in enumerate(self.cameras, 1)]

    def camera_scales(self) -> Floats:
        """Return (P,) absolute principal distances in the unit of image coordinates."""
        if self.principal_distances is not None:
            return np.abs(self.principal_distances)
        return np.array([each.scale for each in self.cameras])[self.photo_cameras]

    def core_cameras(self) -> tuple[list[CameraRow], Indices]:
        """Return the different cameras as rows for the core, and (P,) the row of each photo."""
        if self.photo_cameras is not None:
            return camera_rows(self.cameras), self.photo_cameras
        distances = self.known_distances("the adjustment").tolist()
        places = {distance: row for row, distance in enumerate(dict.fromkeys(distances))}
        rows: list[CameraRow] = [("perspective", [distance], [0.0], None, None) for distance in places]
        return rows, np.array([places[distance] for distance in distances], dtype=np.int64)

    def known_distances(self, what: str) -> Floats:
        """Return (P,) principal distances of fixed cameras without distortion, millimetres.

        Raises
        ------
        InputError
            If there are other cameras, which `what` does not support.
        """
        if self.principal_distances is not None:
            return self.principal_distances
        for name, each in zip(self.camera_names, self.cameras, strict=True):
            if each.model != "perspective" or not each.is_held or each.unit != "mm":
                raise unsupported(what, "camera", camera=name, model=each.model)
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
        """Build a block from tables: data frames (pandas, polars) or mappings of names to columns.

        Parameters
        ----------
        photos
            `photo` (default 0, 1, 2 ...); `X`, `Y`, `Z` (or `longitude_deg`, `latitude_deg`, `height` if a
            spheroid is given); `omega_deg`, `phi_deg`, `kappa_deg`. Optional: `principal_distance_mm` or,
            with cameras, `camera` (index or name). The six names may have the prefixes `sd_` (same units) and
            `observed_` (observed value, if it differs from the initial one).
        images
            `photo`, `point`, `x_mm`, `y_mm`. Optional: `sd_x_mm`, `sd_y_mm`. With cameras in pixels all four
            end in `_px`.
        points
            Control and check points: `point` and the three coordinates as for photos; NaN if unknown.
            Optional: `sd_` columns. Components are free if their standard deviation is missing, infinite or
            NaN. Image points without a row here are pass points.
        principal_distance
            Millimetres, signed, for all photos, if the column is missing.
        cameras
            As in the class; replaces principal distances.
        image_sd
            Standard deviation of image coordinates without `sd_` columns. None: 0.010 mm (not for pixels).
        spheroid, photo_to_ground, title, linear_unit, refraction
            As in the class.

        Raises
        ------
        InputError
            If a column is missing, an image refers to an unknown photo, or the class rejects a value.
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
        """Return a block with some fields replaced and validated; other fields are shared.

        `point_check_sd` is dropped if the number of points changes, unless it is replaced as well.

        Raises
        ------
        InputError
            If a name is not a field, or the class rejects a value.
        """
        names = [each.name for each in fields(self)]
        if unknown := sorted(changes.keys() - set(names)):
            raise InputError(phrase("error.unknown", kind="field", name=unknown[0], names=names))
        points = changes.get("point_ids")
        if points is not None and len(points) != len(self.point_ids):
            changes = {"point_check_sd": None} | changes
        own = self.kept()
        vars(own).update(changes)
        check_block(own, changes.keys())
        return own

    def with_fixed_photos(self) -> Self:
        """Return the block with fixed photo poses, so that points are independent.

        Raises
        ------
        InputError
            If photos or observations are on trajectories.
        """
        refuse_trajectories(self, "fixed photos")
        return self.replace(
            photo_position_sd=0.0,
            photo_attitude_sd=0.0,
            photo_positions_observed=None,
            photo_attitudes_observed=None,
        )

    def in_frame(self, frame: Frame) -> Self:
        """Return the block with another reference frame; the coordinates do not change."""
        own = copy.copy(self)
        own._set("frame", frame)
        return own

    def kept(self) -> Self:
        """Return a copy for a result, with its own lists of names and shared arrays."""
        own = copy.copy(self)
        own._set("photo_ids", list(self.photo_ids))
        own._set("point_ids", list(self.point_ids))
        return own


def span(values: Floats) -> Phrase:
    """Return the range of some values; a single number if they are equal."""
    low, high = (float(values.min()), float(values.max())) if values.size else (math.nan, math.nan)
    return phrase(f"brief.span{'.equal' if low == high else ''}", low=low, high=high)


def flown_by(block: Block) -> Phrase | None:
    """Return the message about the first photo or observation on a trajectory."""
    if block.timed:
        return phrase("block.moving.photo", photo=block.timed[0].photo)
    records = moments(block.observations)
    return phrase("block.moving.record", trajectory=records[0].trajectory.name) if records else None


def of_images_alone(block: Block, what: str) -> Block:
    """Return a block with image observations only; reject others."""
    refuse_trajectories(block, what)
    refuse_passages(block, what)
    if block.observations:
        raise unsupported(what, "observations")
    if block.mounts:
        raise unsupported(what, "mounts")
    return block


def refuse_trajectories(block: Block, what: str) -> None:
    if moving := flown_by(block):
        raise unsupported(what, "trajectories", reason=moving)


def refuse_passages(block: Block, what: str, *, but: type[Passage] | tuple[()] = ()) -> None:
    """Reject image transformations that are not of the type `but`."""
    if passages := [each for each in block.all_passages if not isinstance(each, but)]:
        raise unsupported(what, "passage", kind=passages[0].KIND)


def checked(block: Block) -> Block:
    """Return a block in which all photo poses are known; reject all others by name."""
    require_block(block)
    if (unknown := ~known_poses(block)).any():
        photos = [block.photo_ids[row] for row in np.flatnonzero(unknown)]
        raise InputError(phrase("block.poses-unknown", photos=photos))
    return block


def require_block(block: object) -> None:
    if not isinstance(block, Block):
        raise kind_error("block", "a Block", block)


def position_columns(block: Block) -> tuple[str, str, str]:
    return GEOGRAPHIC_COLUMNS if block.geographic else RECTANGULAR_COLUMNS
