"""Films of photos and their fiducial marks after an adjustment."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.arrays import frozen
from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.network.films import Film, Mark, Scan
from photogram.network.observations import FILM, Fiducial
from photogram.results.kinds import ObservedKind
from photogram.results.unknowns import AdjustedUnknown
from photogram.show.quantity import Axis, Quantity

__all__ = ["OnFilm", "film_members", "film_table", "mark_table"]

_UNITS = ("mm", "mm", "rad", "", "", "")


class OnFilm:
    """What a result says of scanned films and plates, and of their fiducial marks."""

    block: Block
    kinds: Mapping[str, ObservedKind]
    unknowns: tuple[AdjustedUnknown, ...]
    covariance_scale: float

    @property
    def _films(self) -> list[tuple[int, Film]]:
        rows = {name: row for row, name in enumerate(self.block.photo_ids)}
        return [(rows[each.photo], each.film) for each in self.block.passages if isinstance(each, Scan)]

    @property
    def film(self) -> Floats:
        """(P, 6) t1, t2 (mm), theta (radians), m, b1, b2 of the photos; NaN of those that are no films."""
        own = {id(each.given): each for each in self.unknowns}
        found = np.full((len(self.block.photo_ids), 6), np.nan)
        for row, film in self._films:
            found[row] = [*own[id(film.placement)].position, *own[id(film.size)].position]
            if film.roll is not None:
                found[row, 3] += own[id(film.roll)].position[0]
        return frozen(found)

    @property
    def film_cofactors(self) -> Floats:
        """(P, 6, 6) cofactors of the same; of an m that is its roll's, with the others, NaN."""
        own = {id(each.given): each for each in self.unknowns}
        found = np.full((len(self.block.photo_ids), 6, 6), np.nan)
        for row, film in self._films:
            placement, size = own[id(film.placement)], own[id(film.size)]
            found[row, :3, :3], found[row, 3:, 3:] = placement.cofactors, size.cofactors
            mixed = size.with_former if size.with_former.size else np.zeros((3, 3))
            found[row, 3:, :3], found[row, :3, 3:] = mixed, mixed.T
            if film.roll is not None:
                found[row, 3], found[row, :, 3] = np.nan, np.nan
                found[row, 3, 3] = own[id(film.roll)].cofactors[0, 0]
        return frozen(found)

    @property
    def film_sd(self) -> Floats:
        """(P, 6) standard deviations of the same; 0 of what is held."""
        with np.errstate(invalid="ignore"):
            variances = np.diagonal(self.film_cofactors, axis1=1, axis2=2) * self.covariance_scale
            return frozen(np.sqrt(variances))

    @property
    def fiducials(self) -> dict[str, AdjustedUnknown]:
        """The fiducial marks by their names, camera and mark: places in the camera's frame, mm."""
        return {each.name: each for each in self.unknowns if isinstance(each.given, Mark)}

    @property
    def fiducial_residuals(self) -> Floats:
        """(k, 2) observed minus computed readings of marks, in the order of the block."""
        return self._of_readings("residuals")

    @property
    def fiducial_redundancy(self) -> Floats:
        """(k, 2) their redundancy numbers."""
        return self._of_readings("redundancy")

    @property
    def fiducial_standardized(self) -> Floats:
        """(k, 2) their standardized residuals."""
        return self._of_readings("standardized")

    def _of_readings(self, what: str) -> Floats:
        kind = self.kinds.get(Fiducial.KIND)
        found: Floats = np.zeros((0, 2)) if kind is None else getattr(kind, what)
        return found


def film_table(result: OnFilm) -> list[Quantity]:
    """Return the films of photos: values, standard deviations, marks, the largest test value of these."""
    rows = [row for row, _ in result._films]
    axes = tuple(Axis.of(name, unit) for name, unit in zip(FILM, _UNITS, strict=True))
    names = [result.block.photo_ids[row] for row in rows]
    counts, largest = np.zeros(len(rows)), np.full(len(rows), np.nan)
    of_photo = {name: k for k, name in enumerate(names)}
    kind = result.kinds.get(Fiducial.KIND)
    for row, own in zip([] if kind is None else kind.rows.tolist(), _tests(kind), strict=True):
        k = of_photo[result.block.observations[row].of[0]]
        counts[k] += 1
        largest[k] = np.fmax(largest[k], own)
    return [
        Quantity(names, kind="name", name="photo", about="name of the photo", head="Photo"),
        Quantity(result.film[rows], axes, "value", "value", "value", "{} of the film", "value", figures=7),
        Quantity(result.film_sd[rows], axes, "deviation", "sd", "sd", "sd of {}", "sd", head="sd {}"),
        Quantity(
            counts, kind="number", name="marks", member="marks", about="marks read", head="Marks", decimals=0
        ),
        Quantity(
            *(largest, (), "number", "largest", "largest_standardized"),
            about="largest standardized residual of a mark",
            head="Largest w",
            decimals=2,
        ),
    ]


def _tests(kind: ObservedKind | None) -> list[float]:
    return [] if kind is None else np.abs(np.nan_to_num(kind.standardized)).max(axis=1).tolist()


def mark_table(result: OnFilm) -> list[Quantity]:
    """Return the marks of cameras: adjusted minus certificate, and mean residuals of their readings."""
    marks = list(result.fiducials.values())
    kind = result.kinds.get(Fiducial.KIND)
    sums = {each.name: np.zeros(2) for each in marks}
    counts = dict.fromkeys(sums, 0)
    for k, row in enumerate([] if kind is None else kind.rows.tolist()):
        name = result.block.observations[row].of[1]
        assert kind is not None
        sums[name] += kind.residuals[k]
        counts[name] += 1
    means = np.array([sums[name] / max(counts[name], 1) for name in sums]).reshape(-1, 2)
    unit = kind.units[0] if kind is not None else ""
    axes = tuple(Axis.of(name, "mm") for name in "xy")
    values, changes, sd = (
        np.array([getattr(each, what) for each in marks]).reshape(-1, 2)
        for what in ("values", "change", "sd")
    )
    return [
        Quantity(list(sums), kind="name", name="fiducial", about="camera and mark", head="Fiducial"),
        Quantity(values, axes, "value", "value", "value", "adjusted {}", "value", head="{}", decimals=4),
        Quantity(
            changes,
            axes,
            "difference",
            "change",
            "change",
            "{} less the certificate's",
            "change",
            head="d {}",
        ),
        Quantity(sd, axes, "deviation", "sd", "sd", "sd of {}", "sd", head="sd {}"),
        Quantity(
            *(means, tuple(Axis.of(name, unit) for name in "xy"), "difference", "mean", "mean_residual"),
            about="mean residual of its readings in {}",
            label="mean residual",
            head="Mean residual {}",
        ),
    ]


def film_members(result: OnFilm) -> list[dict[str, object]]:
    """Return the films of photos for documents: values, cofactors, the side, the scanner."""
    values, sd, cofactors = result.film, result.film_sd, result.film_cofactors
    return [
        {
            "photo": result.block.photo_ids[row],
            "components": list(FILM),
            "film": values[row].tolist(),
            "sd": sd[row].tolist(),
            "film_cofactors": cofactors[row].tolist(),
            "mirrored": film.mirrored,
            "scanner": film.scanner.name,
        }
        for row, film in result._films
    ]
