"""Observations of fiducial marks, and priors of films, marks and scanners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import names, object_name, shaped
from photogram.arguments.fields import check_fields
from photogram.arguments.objects import kind_error, require
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import listed
from photogram.network.films import Film, FilmPlacement, FilmSize, Mark, Roll
from photogram.network.observations.observation import Observation
from photogram.network.unknowns import Unknown

FILM = ("t1", "t2", "theta", "m", "b1", "b2")  # Unknowns of the film of a photo: mm, radians, ratios


@dataclass(frozen=True, eq=False)
class Fiducial(Observation):
    """Observed reading of a fiducial mark on a photo.

    Parameters
    ----------
    photo
        Name of the photo, for reports.
    mark
        Position of the mark in the camera frame, one object for all photos of the camera.
    film
        Film of the photo.
    reading
        (2,) reading in the unit of the scanner.
    sd
        (2,) standard deviations of the reading, or one for both.
    covariance
        (2, 2) covariance matrix of the reading, instead of `sd`.

    Raises
    ------
    InputError
        If mark or film is invalid, a value is not finite, or standard deviations are invalid.
    """

    KIND = "fiducial"
    VALUES = (("reading", (2,)),)
    COMPONENTS = ("x", "y")

    photo: str = field(metadata={"check": object_name})
    mark: Mark
    film: Film
    reading: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        check_fields(self, "a fiducial")
        super().__post_init__()
        self._set("unknowns", (self.mark, *self.film.unknowns))
        near = self.mark.position[:2]
        self._set("observed", np.concatenate([self.observed, near, self.film.numbers()]))

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the photo and the mark."""
        return self.photo, self.mark.name

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the readings."""
        return ("mm" if self.film.readings.pitch == 1.0 else "px",) * 2


@dataclass(frozen=True, eq=False)
class KnownFilm(Observation):
    """Prior of t1, t2, theta, m, b1 or b2 of the film of a photo; m may refer to its roll.

    Parameters
    ----------
    photo
        Name of the photo, for reports.
    placement, size
        Placement and size of the film; standard deviations of the observed components must be infinite.
    roll
        Roll to which m refers; None: m is the whole size change.
    known
        (k,) names of the observed components.
    values
        (k,) observed values.
    sd
        (k,) standard deviations of the values, or one for all.
    covariance
        (k, k) covariance matrix of the values, instead of `sd`.

    Raises
    ------
    InputError
        If a name is invalid, a value is not finite, or standard deviations are invalid.
    """

    KIND = "film"
    UNKNOWNS = (("placement", FilmPlacement), ("size", FilmSize), ("roll", Roll))
    NEEDS = frozenset({"placement", "size"})

    photo: str
    placement: FilmPlacement
    size: FilmSize
    roll: Roll | None
    known: Sequence[str]
    values: ArrayLike
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._set("photo", names("film", [self.photo])[0])
        known = tuple(self.known)
        if not set(known) <= set(FILM) or len(set(known)) < len(known) or not known:
            raise kind_error(f"known of the film of {self.photo}", f"some of {', '.join(FILM)}", known)
        self._set("known", known)
        super().__post_init__()
        values = shaped(f"values of {self.name}", self.values, (len(known),), "finite")
        self._set("observed", np.concatenate([[FILM.index(name) for name in known], values]))

    @property
    def of(self) -> tuple[str, ...]:
        """Name of the photo."""
        return (self.photo,)

    @property
    def label(self) -> str:
        """Group of the priors with the same components."""
        same = self.known == FILM[3:]
        return self.KIND if same else f"{self.KIND}, {' '.join(self.known)}"

    @property
    def own_components(self) -> tuple[str, ...]:
        """Names of the observed components; m may refer to the roll."""
        about = "m" if self.roll is None else "m - roll"
        return tuple(about if name == "m" else name for name in self.known)

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the observed components."""
        return tuple({"t1": "mm", "t2": "mm", "theta": "rad"}.get(name, "") for name in self.known)


@dataclass(frozen=True, eq=False)
class KnownTogether(Observation):
    """Joint prior of several unknowns with full covariance, e.g. from a certificate or calibration.

    Parameters
    ----------
    title
        Name of the group in results, e.g. `certificate` or `scanner`.
    joined
        The unknowns; their own standard deviations must be infinite.
    sd
        (k,) standard deviations of all components.
    covariance
        (k, k) covariance matrix of all components, instead of `sd`.

    Raises
    ------
    InputError
        If an unknown is invalid, or weights are invalid: exactly one of `sd` and `covariance` is required.
    """

    KIND = "prior"

    title: str
    joined: Sequence[Unknown]
    sd: ArrayLike | None = None
    covariance: ArrayLike | None = None

    def __post_init__(self) -> None:
        self._set("title", names("prior", [self.title])[0])
        own = tuple(self.joined)
        if not own or not all(isinstance(each, Unknown) for each in own):
            raise kind_error(f"joined of {self.title}", "a list of unknowns", self.joined)
        different = len({id(each) for each in own}) == len(own)
        require(different, f"joined of {self.title}", "repeated", kind="unknown", name=own[0].name)
        self._set("joined", own)
        super().__post_init__()
        self._set("unknowns", own)
        widths = [len(each.components) for each in own] if len(own) > 1 else []
        self._set("observed", np.array(widths, dtype=float))

    @property
    def of(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(each.name for each in self.joined)

    @property
    def name(self) -> str:
        """Title and names of the unknowns."""
        return f"{self.title} {listed(list(self.of), 4)}"

    @property
    def label(self) -> str:
        """Title of the prior."""
        return self.title

    def units(self, linear_unit: str) -> tuple[str, ...]:
        """Return the units of the unknowns."""
        return tuple(unit for each in self.joined for unit in each.units(linear_unit))

    @property
    def own_components(self) -> tuple[str, ...]:
        """Components of the unknowns, with names of the unknowns if there are several."""
        if len(self.joined) == 1:
            return self.joined[0].components
        return tuple(f"{each.name} {name}" for each in self.joined for name in each.components)
