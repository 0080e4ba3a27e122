"""The block: photographs, points and image observations, as arrays or as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from photogram.arrays import indices, shaped
from photogram.errors import InputError
from photogram.refraction import Refraction, metres_per_unit

if TYPE_CHECKING:
    from photogram.geometry import Spheroid

__all__ = ["Block"]

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

RECTANGULAR_COLUMNS = ("X", "Y", "Z")
GEOGRAPHIC_COLUMNS = ("longitude_deg", "latitude_deg", "height")
ATTITUDE_COLUMNS = ("omega_deg", "phi_deg", "kappa_deg")


@dataclass
class Block:
    """A block of photographs with its measurements and everything known beforehand.

    P photos, n points, m image observations. Positions are X, Y, Z in the linear unit of the object space
    when `spheroid` is None (rectangular space), else longitude (rad, east positive), latitude (rad) and
    height (linear unit).

    Parameters
    ----------
    photo_ids
        P names, all different.
    photo_positions, photo_attitudes
        (P, 3) initial positions, and omega, phi, kappa in radians: M = M_kappa M_phi M_omega (GIANT guide,
        section 5). They are the observed values too where their standard deviation is finite.
    principal_distances
        (P,) in millimetres; negative for the positive (diapositive) plane, positive for the negative plane.
    point_ids
        n names, all different.
    point_positions
        (n, 3); NaN where unknown: intersected from the initial rays.
    image_photos, image_points
        (m,) indices into photos and points.
    image_xy, image_sd
        (m, 2) image coordinates and their standard deviations in millimetres; `image_sd` may be a number.
    photo_position_sd, photo_attitude_sd
        (P, 3) standard deviations in the units of the values: infinite (free, the default), 0 (fixed) or
        between (weighted).
    point_sd
        (n, 3): finite for held components of control, 0 to fix them, infinite (the default) for pass points
        and unheld components. An unheld component with a finite position is a check on the adjustment.
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

    Raises
    ------
    InputError
        Arrays of the wrong shape, values that are not finite, indices out of range, names that repeat;
        refraction in a linear unit whose length is not known.
    """

    photo_ids: list[str]
    photo_positions: Floats
    photo_attitudes: Floats
    principal_distances: Floats
    point_ids: list[str]
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

    def __post_init__(self) -> None:
        self.photo_ids = _names("photo_ids", self.photo_ids)
        self.point_ids = _names("point_ids", self.point_ids)
        photos, points, images = len(self.photo_ids), len(self.point_ids), len(np.asarray(self.image_photos))
        shapes = {
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
        for name, shape in shapes.items():
            setattr(self, name, shaped(name, getattr(self, name), shape))
        for name, count in (("image_photos", photos), ("image_points", points)):
            setattr(self, name, indices(name, getattr(self, name), images, count))
        self._check_values()
        if self.refraction is not None:
            metres_per_unit(self.linear_unit)

    def _check_values(self) -> None:
        owners = {"photo": self.photo_ids, "princ": self.photo_ids, "point": self.point_ids}
        for name in ("photo_positions", "photo_attitudes", "principal_distances", "image_xy"):
            bad = ~np.isfinite(getattr(self, name))
            self._refuse(name, bad, "is not a finite number", owners.get(name[:5]))
        self._refuse("principal_distances", self.principal_distances == 0, "is zero", self.photo_ids)
        self._refuse("point_positions", np.isinf(self.point_positions), "is infinite", self.point_ids)
        for name in ("photo_position_sd", "photo_attitude_sd", "point_sd"):
            self._refuse(name, ~(getattr(self, name) >= 0), "is not a standard deviation", owners[name[:5]])
        bad = ~((self.image_sd > 0) & np.isfinite(self.image_sd))
        self._refuse("image_sd", bad, "is not a positive, finite standard deviation", None)
        held_unknown = np.isfinite(self.point_sd) & np.isnan(self.point_positions)
        self._refuse(
            "point_positions", held_unknown, "is unknown but held (its point_sd is finite)", self.point_ids
        )

    def _refuse(self, name: str, bad: NDArray[np.bool_], why: str, owners: list[str] | None) -> None:
        if bad.any():
            row = int(np.argwhere(bad)[0][0])
            if owners is not None:
                of = owners[row]
            else:
                point, photo = self.image_points[row], self.image_photos[row]
                of = f"{self.point_ids[point]} on photo {self.photo_ids[photo]}"
            raise InputError(f"{name} of {of} {why}: {getattr(self, name)[row].tolist()}")

    @property
    def geographic(self) -> bool:
        """Whether positions are longitude, latitude and height."""
        return self.spheroid is not None

    @classmethod
    def from_tables(
        cls,
        photos: Mapping[str, Any],
        images: Mapping[str, Any],
        points: Mapping[str, Any] | None = None,
        *,
        principal_distance: float | None = None,
        image_sd: float = 0.010,
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
            `photo`; `X`, `Y`, `Z` (or `longitude_deg`, `latitude_deg`, `height` when a spheroid is given);
            `omega_deg`, `phi_deg`, `kappa_deg`. Optional: `principal_distance_mm`, and `sd_` before any of
            the six names (same units).
        images
            `photo`, `point`, `x_mm`, `y_mm`. Optional: `sd_x_mm`, `sd_y_mm`.
        points
            Control and check points: `point` and the three coordinates as for photos; NaN where unknown.
            Optional: `sd_` columns; without them, or where they are infinite or NaN, components are not held.
            Image points without a row here are pass points.
        principal_distance
            Millimetres, signed, for all photos, when the column is not there.
        image_sd
            Millimetres, for image coordinates without a column of their own.
        spheroid, photo_to_ground, title, linear_unit, refraction
            As in the class.

        Raises
        ------
        InputError
            A column that is missing, a photo that `photos` does not name, or whatever the class refuses.
        """
        axes = RECTANGULAR_COLUMNS if spheroid is None else GEOGRAPHIC_COLUMNS
        photo_ids = [str(name) for name in _column(photos, "photos", "photo")]
        image_point_names = [str(name) for name in _column(images, "images", "point")]
        control_ids = _names("points", _column(points, "points", "point")) if points is not None else []
        point_ids = list(dict.fromkeys([*control_ids, *image_point_names]))

        positions = np.full((len(point_ids), 3), np.nan)
        sd = np.full((len(point_ids), 3), np.inf)
        if points is not None:
            positions[: len(control_ids)] = _columns(points, "points", axes)
            sd[: len(control_ids)] = _columns(points, "points", [f"sd_{axis}" for axis in axes], np.inf)
            sd[np.isnan(sd) | np.isnan(positions)] = np.inf
        if "principal_distance_mm" not in photos and principal_distance is None:
            raise InputError("photos has no column principal_distance_mm and no principal_distance was given")
        return cls(
            photo_ids=photo_ids,
            photo_positions=_columns(photos, "photos", axes),
            photo_attitudes=_columns(photos, "photos", ATTITUDE_COLUMNS),
            principal_distances=_columns(photos, "photos", ["principal_distance_mm"], principal_distance)[
                :, 0
            ],
            point_ids=point_ids,
            point_positions=positions,
            image_photos=_lookup("photo", photo_ids, _column(images, "images", "photo")),
            image_points=_lookup("point", point_ids, image_point_names),
            image_xy=_columns(images, "images", ["x_mm", "y_mm"]),
            image_sd=_columns(images, "images", ["sd_x_mm", "sd_y_mm"], image_sd),
            photo_position_sd=_columns(photos, "photos", [f"sd_{axis}" for axis in axes], np.inf),
            photo_attitude_sd=_columns(photos, "photos", [f"sd_{axis}" for axis in ATTITUDE_COLUMNS], np.inf),
            point_sd=sd,
            spheroid=spheroid,
            photo_to_ground=photo_to_ground,
            title=title,
            linear_unit=linear_unit,
            refraction=refraction,
        )

    def replace(self, **changes: Any) -> Block:
        """Return a copy with some fields replaced, checked anew."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return type(self)(**{**values, **changes})


def position_columns(block: Block) -> tuple[str, str, str]:
    """Names of the three columns of positions in tables."""
    return GEOGRAPHIC_COLUMNS if block.geographic else RECTANGULAR_COLUMNS


def _names(name: str, values: Sequence[str]) -> list[str]:
    names = [str(value) for value in values]
    if len(set(names)) != len(names):
        seen: set[str] = set()
        repeated = next(value for value in names if value in seen or seen.add(value))  # type: ignore[func-returns-value]
        raise InputError(f"{name}: {repeated!r} stands there more than once")
    return names


def _column(table: Mapping[str, Any], table_name: str, name: str) -> Sequence[Any]:
    if name not in table:
        raise InputError(f"{table_name} has no column {name}")
    column: Sequence[Any] = table[name]
    return column


def _columns(
    table: Mapping[str, Any], table_name: str, names: Sequence[str], default: float | None = None
) -> Floats:
    """Stack columns as (rows, len(names)), `_deg` ones in radians; absent ones get the default."""
    rows = len(_column(table, table_name, "photo" if table_name == "photos" else "point"))
    columns = []
    for name in names:
        if name not in table and default is not None:
            columns.append(np.full(rows, default))
            continue
        values = _column(table, table_name, name)
        try:
            column = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InputError(f"{table_name}, column {name}: {error}") from None
        if column.shape != (rows,):
            raise InputError(f"{table_name}, column {name} has the shape {column.shape}, not ({rows},)")
        columns.append(np.radians(column) if name.endswith("_deg") else column)
    return np.stack(columns, axis=1)


def _lookup(kind: str, ids: Sequence[str], names: Sequence[Any]) -> Indices:
    index = {name: i for i, name in enumerate(ids)}
    try:
        return np.array([index[str(name)] for name in names], dtype=np.int64)
    except KeyError as error:
        raise InputError(
            f"images names the {kind} {error.args[0]!r}, which the {kind}s do not list"
        ) from None
