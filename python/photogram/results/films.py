"""Adjusted films of photos and fiducial marks; `film_report` has the tables."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import frozen, standard_deviations
from photogram.arguments.types import Floats
from photogram.network.block import Block
from photogram.network.film_reduction import Affine, affine_form
from photogram.network.films import Film, Mark, Scan
from photogram.results.parts import AdjustedUnknown, ObservedKind


class OnFilm:
    """Results for scanned films and plates, and their fiducial marks."""

    block: Block
    kinds: Mapping[str, ObservedKind]
    unknowns: tuple[AdjustedUnknown, ...]
    covariance_scale: float

    @cached_property
    def _by_given(self) -> dict[int, AdjustedUnknown]:
        return {id(each.given): each for each in self.unknowns}

    @property
    def films(self) -> list[tuple[int, Film]]:
        """The films of scanned photos, with the rows of these photos."""
        rows = {name: row for row, name in enumerate(self.block.photo_ids)}
        return [(rows[each.photo], each.film) for each in self.block.passages if isinstance(each, Scan)]

    @property
    def film(self) -> Floats:
        """(P, 6) t1, t2 (mm), theta (radians), m, b1, b2 of the photos; NaN for photos without film."""
        own = self._by_given
        found = np.full((len(self.block.photo_ids), 6), np.nan)
        for row, film in self.films:
            found[row] = [*own[id(film.placement)].position, *own[id(film.size)].position]
            if film.roll is not None:
                found[row, 3] += own[id(film.roll)].position[0]
        return frozen(found)

    @property
    def film_cofactors(self) -> Floats:
        """(P, 6, 6) cofactors of `film`; NaN for an m that is common to a roll."""
        own = self._by_given
        found = np.full((len(self.block.photo_ids), 6, 6), np.nan)
        for row, film in self.films:
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
        """(P, 6) standard deviations of `film`; 0 if fixed."""
        return frozen(standard_deviations(self.film_cofactors, self.covariance_scale))

    @property
    def fiducials(self) -> dict[str, AdjustedUnknown]:
        """Fiducial marks by name of camera and mark: positions in the camera's frame, mm."""
        return {each.name: each for each in self.unknowns if isinstance(each.given, Mark)}

    @property
    def refined(self) -> tuple[Floats, Floats]:
        """(m, 2) images in camera frames by adjusted films, mm, and standard deviations.

        Distortion is not removed. Standard deviations are those of the readings only, without the common
        errors of film, marks and scanner. NaN for photos without film.
        """
        block = self.block
        places, sd = np.full(block.image_xy.shape, np.nan), np.full(block.image_xy.shape, np.nan)
        for row, film in self.films:
            own = block.image_photos == row
            given = film.numbers(), np.array(numbers_of_film(self, film))
            places[own] = _photocore.film_places(*given, block.image_xy[own])
            _, partials = _photocore.film_readings(*given, places[own])
            by_reading = np.linalg.inv(partials[:, :, :2])
            sd[own] = np.sqrt(((by_reading * block.image_sd[own][:, np.newaxis]) ** 2).sum(axis=2))
        return frozen(places), frozen(sd)

    @property
    def film_forms(self) -> dict[str, Affine]:
        """Affine form of each photo's film, `reading = a0 + a1 x + a2 y`, by photo name.

        Other deformations of films are omitted, and the scanner is assumed to be without error. Standard
        deviations are NaN if m is common to a roll.
        """
        cofactors = self.film_cofactors * self.covariance_scale
        return {
            self.block.photo_ids[row]: affine_form(film, numbers_of_film(self, film), cofactors[row])
            for row, film in self.films
        }


def numbers_of_film(result: OnFilm, film: Film) -> list[Floats]:
    """Return (3,) adjusted numbers of each unknown of a film."""
    own = result._by_given
    return [own[id(each)].position for each in film.unknowns]
