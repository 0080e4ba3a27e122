"""Positions of photos with standard deviations in systems of coordinates, and as plain tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.metadata.merged import Metadata, PhotoRecord
from photogram.formats.metadata.record import ELLIPSOIDAL, SEA_LEVEL, Said
from photogram.formats.plain.schema import AXES, deviation_columns
from photogram.formats.plain.tables import covariances_of
from photogram.formats.project import Frame
from photogram.io.csv_text import csv_text
from photogram.lazy_dataclasses import dataclass
from photogram.network.geometry import Spheroid
from photogram.words import Phrase, phrase

SHIFT_SD = 0.05  # Metres: a priori standard deviation of the shift that positions of a flight have in common
LEVER_SD = 0.01  # Metres: that of a lever arm which is already applied
ABOVE = {False: "above the ellipsoid", True: "above the geoid"}
PHOTOS_CRS, GNSS_CRS = "--photos-crs", "--gnss-crs"  # Options that name the system of positions
_UNKNOWN = "above the geoid or above the ellipsoid"
GROUPS = "gnss_groups.csv"
_COMMENT = (
    "longitude and latitude (degrees), height above the ellipsoid (metres) of WGS 84, standard deviations of"
    f' east, north, height (metres); project.toml: [gnss] crs = "{ELLIPSOIDAL}"'
)
_WGS84 = (Spheroid.wgs84().a, Spheroid.wgs84().b)


@dataclass(frozen=True)
class Located:
    """Positions of n photos with the system of each.

    `xyz` are (n, 3) longitude (degrees) or easting, latitude or northing, height;
    `sd` are (n, 3) standard deviations of east, north and height, metres; NaN without.
    """

    records: tuple[PhotoRecord, ...]
    systems: tuple[str, ...]
    xyz: Floats
    sd: Floats

    @property
    def flights(self) -> list[str]:
        """The flight of each position that has a shift and a lever arm in common with others; else empty."""
        return [each.flight if each.rtk else "" for each in self.records]

    def in_frame(self, frame: Frame) -> tuple[Floats, Floats, list[Phrase]]:
        """Return (n, 3) positions and (n, 3, 3) covariances in a frame, and what is to be said of it."""
        from photogram.formats.crs import to_frame

        turned = covariances_of(self.sd)
        xyz, remarks = np.empty_like(self.xyz), list[Phrase]()
        for crs in dict.fromkeys(self.systems):
            own = np.array([each == crs for each in self.systems])
            xyz[own], turned[own], said = to_frame(crs, self.xyz[own], turned[own], frame)
            remarks += [each for each in said if each not in remarks]
        return xyz, turned, remarks

    def geographic(self) -> tuple[Floats, Floats]:
        """Return (n, 3) longitudes, latitudes (degrees), heights above the ellipsoid (WGS 84), and (n, 3) sd.

        What already is so stays as it stands.
        """
        if set(self.systems) <= {ELLIPSOIDAL}:
            return self.xyz, self.sd
        frame = Frame("geographic", ELLIPSOIDAL, ellipsoid=_WGS84)
        known = np.nan_to_num(self.sd)
        xyz, turned, _ = Located(self.records, self.systems, self.xyz, known).in_frame(frame)
        xyz[:, :2] = np.degrees(xyz[:, :2])
        sd = np.sqrt(np.maximum(np.diagonal(turned, axis1=1, axis2=2), 0.0))
        return xyz, np.where(np.isnan(self.sd), np.nan, sd)


def located(
    records: Sequence[PhotoRecord],
    crs: str | None = None,
    sd: Sequence[float] | None = None,
    option: str = PHOTOS_CRS,
) -> Located:
    """Return the positions of photos that have one; heights have to be of one kind.

    `crs` is the system of positions whose source does not say it, or not what heights are above; `sd` are
    standard deviations where no source has any: one number or three, metres. `option` names the system;
    positions of `--gnss` without any system are in the frame of the project, and their system is empty.
    """
    known = [each for each in records if each.position is not None]
    said = [each.position for each in known if each.position is not None]
    if option == GNSS_CRS and crs is None and not any(each.crs for each in said):
        systems = [""] * len(said)
    else:
        systems = _systems(said, crs, option)
        _check_heights(known, said, systems, option)
    default = np.broadcast_to(np.nan if sd is None else np.asarray(sd, dtype=float), 3)
    deviations = [each.deviations.sd if each.deviations is not None else default for each in known]
    return Located(
        tuple(known),
        tuple(systems),
        np.array([each.position for each in said], dtype=float).reshape(-1, 3),
        np.array(deviations, dtype=float).reshape(-1, 3),
    )


def _systems(said: Sequence[Said], crs: str | None, option: str) -> list[str]:
    """Return the system of each position: its own, else the one that a user names; empty without both."""
    from photogram.formats.crs import is_on

    if crs is not None and any(each.crs and each.heights for each in said) and not is_on(crs, _WGS84):
        first = next(each for each in said if each.crs and each.heights)
        raise first.place.error(phrase("photos.wgs84", crs=crs, option=option))
    for each in said:
        if not each.crs and crs is None:
            raise each.place.error(phrase("photos.crs", option=option))
    return [each.crs if each.crs and not each.heights else crs or "" for each in said]


def _check_heights(
    records: Sequence[PhotoRecord], said: Sequence[Said], systems: Sequence[str], option: str
) -> None:
    kinds: dict[str, list[str]] = {}
    for record, own, system in zip(records, said, systems, strict=True):
        kinds.setdefault(_kind(own, system), []).append(f"{record.photo} ({own.source})")
    if len(kinds) > 1:
        (one, first), (other, second), *_ = kinds.items()
        raise InputError(phrase("photos.heights", one=one, first=first, other=other, second=second))
    for own, system in zip(said, systems, strict=True):
        if own.heights == SEA_LEVEL and not _is_above_geoid(system):
            raise own.place.error(phrase("photos.sea-level", option=option))
    if "" in systems:
        raise said[0].place.error(phrase("photos.height-kind", option=option))


def _kind(said: Said, system: str) -> str:
    """Return what heights are above."""
    if said.heights == SEA_LEVEL:
        return ABOVE[True]
    return ABOVE[_is_above_geoid(system)] if system else _UNKNOWN


def _is_above_geoid(system: str) -> bool:
    from photogram.formats.crs import has_geoid_heights

    return system not in ("", ELLIPSOIDAL) and has_geoid_heights(system)


def gnss_files(
    metadata: Metadata, path: Path, crs: str | None = None, sd: Sequence[float] | None = None
) -> dict[Path, bytes]:
    """Return a table `gnss` of a plain project, and `gnss_groups` beside it where positions need it."""
    known = located(list(metadata.photos.values()), crs, sd)
    if not known.records:
        raise InputError(phrase("format.missing", what="positions of photos"), file=metadata.directory)
    files = {path: csv_text(_positions(known), [_COMMENT])}
    flights = list(dict.fromkeys(each for each in known.flights if each))
    if flights:
        files[path.with_name(GROUPS)] = csv_text(_groups(flights))
    return files


def _positions(known: Located) -> dict[str, Any]:
    """Return the columns: names of photos without their folders, where that is enough."""
    xyz, sd = known.geographic()
    names = {each.photo: PurePosixPath(each.photo).name for each in known.records}
    often = Counter(names.values())
    return {
        "photo": [photo if often[name] > 1 else name for photo, name in names.items()],
        **dict(zip(("longitude", "latitude", "height"), xyz.T, strict=True)),
        **dict(zip(deviation_columns(AXES), sd.T, strict=True)),
        "group": known.flights,
        "source": [each.position.source if each.position else "" for each in known.records],
        "sd_source": [each.deviations.source if each.deviations else "" for each in known.records],
    }


def _groups(flights: Sequence[str]) -> dict[str, Any]:
    """Return the columns of what positions of a flight have in common."""
    count = len(flights)
    columns: dict[str, Any] = {"group": list(flights), "shift": ["true"] * count}
    for kind, deviation in (("lever", LEVER_SD), ("shift", SHIFT_SD)):
        columns |= {f"sd_{kind}_{axis}": [deviation] * count for axis in AXES}
    return columns
