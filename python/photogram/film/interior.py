"""Interior orientation of one photo from its fiducial marks: affine form and mirroring."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import frozen, one_of, shaped
from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.film_reduction import Affine as Affine
from photogram.network.film_reduction import affine_form
from photogram.network.films import (
    Film,
    FilmBend,
    FilmPlacement,
    FilmSize,
    Readings,
    Reseau,
    Scanner,
    ScannerCurve,
)
from photogram.statistics.fits import Fit
from photogram.words import phrase

FilmModel = Literal["conformal", "affine", "bilinear", "projective"]

UNKNOWNS: dict[str, tuple[str, ...]] = {
    "conformal": ("t1", "t2", "theta", "m"),
    "affine": ("t1", "t2", "theta", "m", "b1", "b2"),
    "bilinear": ("t1", "t2", "theta", "m", "b1", "b2", "h1", "h2"),
    "projective": ("t1", "t2", "theta", "m", "b1", "b2", "g1", "g2"),
}
"""Unknowns of each model."""
FAR = 5.0  # Residuals of both orientations above which mark names are wrong, millimetres
_MAX_STEPS = 20
_CONVERGED = 1e-12  # Largest step at convergence, relative to the format


@dataclass(frozen=True, eq=False)
class Interior:
    """Interior orientation of a photo: film parameters from its fiducial marks.

    Attributes
    ----------
    model
        Film model, which defines the unknowns.
    film
        (6,) t1, t2 (mm), theta (radians), m, b1, b2.
    bend
        (2,) h1, h2 or g1, g2 (1/mm); zero if the model does not contain them.
    unknowns
        (k,) names of the unknowns.
    cofactors
        (k, k) cofactors of the unknowns, a priori unit weight.
    residuals
        (n, 2) observed minus computed readings.
    redundancy
        (n, 2) redundancy numbers.
    omega
        Weighted sum of squares of the residuals.
    degrees_of_freedom
        2 n minus the number of unknowns.
    mirrored
        Whether the film was scanned mirrored (emulsion side).
    affine
        The same as six affine coefficients, if the model is affine or conformal.
    shifts
        (nodes, 2) mm, shifts of the reseau nodes; empty without a reseau.
    """

    model: FilmModel
    film: Floats
    bend: Floats
    unknowns: tuple[str, ...]
    cofactors: Floats
    residuals: Floats
    redundancy: Floats
    omega: float
    degrees_of_freedom: int
    mirrored: bool
    affine: Affine | None
    shifts: Floats

    @property
    def sd(self) -> Floats:
        """(k,) standard deviations a priori of the unknowns."""
        return np.asarray(np.sqrt(np.diagonal(self.cofactors)))

    @property
    def p(self) -> float:
        """Probability of a larger weighted sum of squares; NaN without redundancy."""
        if not self.degrees_of_freedom:
            return float("nan")
        return _photocore.chi_square(self.omega, self.degrees_of_freedom)


def is_mirrored(places: ArrayLike, true: ArrayLike) -> bool | None:
    """Return whether an affine map of design to true coordinates (n, 2) mirrors.

    None for fewer than three marks, or for collinear marks.
    """
    q, p = (np.asarray(each, dtype=float) for each in (places, true))
    if len(q) < 3:
        return None
    q, p = q - q.mean(axis=0), p - p.mean(axis=0)
    moments = q.T @ q
    if np.linalg.eigvalsh(moments)[0] < 1e-4 * np.trace(moments):
        return None
    return bool(np.linalg.det(np.linalg.solve(moments, q.T @ p)) < 0)


def conformal(places: ArrayLike, true: ArrayLike, *, mirrored: bool) -> tuple[float, float, float, float]:
    """Return t1, t2, theta, m of a conformal fit p = t + b q in complex numbers.

    For mirrored films q is -conj(q); b = (1 + m) exp(i theta). Coordinates in the camera frame and true
    coordinates on the scanner are (n, 2) mm, at least two.
    """
    q, p = (np.asarray(each, dtype=float) @ [1, 1j] for each in (places, true))
    if mirrored:
        q = -np.conj(q)
    centre, middle = q.mean(), p.mean()
    b = np.vdot(q - centre, p - middle) / np.vdot(q - centre, q - centre)
    t = middle - b * centre
    return float(t.real), float(t.imag), float(np.angle(b)), float(abs(b) - 1.0)


def interior_orientation(
    places: ArrayLike,
    readings: ArrayLike,
    model: FilmModel = "affine",
    *,
    sd: ArrayLike = 1.0,
    counted: Readings | None = None,
    scanner: Scanner | None = None,
    curves: Sequence[ScannerCurve] = (),
    mirrored: bool | None = None,
    reseau: Reseau | None = None,
) -> Interior:
    """Fit the film of a photo to its fiducial marks with fixed mark coordinates.

    Errors of certificate coordinates are common to all photos of a camera and do not affect the residuals of
    one photo. This fit does not test a certificate.

    Parameters
    ----------
    places
        (n, 2) coordinates of the marks in the camera frame, mm, x right and y up.
    readings
        (n, 2) readings of the marks.
    model
        `conformal`: t1, t2, theta, m; `affine`: with b1, b2; `bilinear`: with h1, h2; `projective`: with g1,
        g2.
    sd
        (n, 2) standard deviations of readings, or one for all.
    counted
        Unit and axes of the readings; None: mm, y up.
    scanner
        Scales and obliqueness of the scanner; None: an ideal scanner.
    curves
        Polynomial coefficients of the scanner, six of three, x first; or empty.
    mirrored
        Whether the film was scanned mirrored; None: determined from at least three marks.
    reseau
        Grid whose node shifts are estimated with the film, observed as 0 with their covariance; None: no
        reseau.

    Raises
    ------
    InputError
        If there are fewer marks than the model requires, or if the marks do not determine the side or
        contradict the given one.
    """
    one_of("model", model, get_args(FilmModel))
    q = shaped("places", places, (None, 2))
    xy = shaped("readings", readings, q.shape)
    variances = np.broadcast_to(np.square(np.asarray(sd, dtype=float)), xy.shape)
    if not (np.isfinite([q, xy, variances]).all() and (variances > 0).all()):
        raise InputError(phrase("films.finite-readings"))
    names = UNKNOWNS[model]
    if 2 * len(q) < len(names):
        fields = {"unknowns": len(names), "marks": len(q), "coordinates": 2 * len(q)}
        raise InputError(phrase("films.few-marks", model=model, **fields))
    own, machine = counted or Readings(), scanner or Scanner("scanner", sd=0.0)
    true = true_places(xy, own, machine, curves)
    if (side := film_side(q, true, mirrored)) is None:
        raise InputError(phrase("films.unknown-side"))
    nodes = 0 if reseau is None else len(reseau.weights)
    known, rows, size = len(names), xy.size, np.abs(q).max()
    values = np.zeros(8 + 2 * nodes)
    values[:4] = conformal(q, true, mirrored=side)
    columns = [*range(known), *range(8, len(values))]
    # Movements of a mark at the edge per unit of each unknown
    moves = np.array([1.0, 1.0, *[size] * 4, *[size**2] * 2, *np.ones(2 * nodes)])[columns]
    covariance = np.diag(np.concatenate([variances.ravel(), np.ones(2 * nodes)]))
    if reseau is not None:
        covariance[rows:, rows:] = reseau.covariance
    for _ in range(_MAX_STEPS):
        film = Film(
            FilmPlacement("p", values[:3]),
            FilmSize("p", values[3:6]),
            machine,
            own,
            bend=FilmBend("p", values[6:8]) if known > 6 else None,
            projective=model == "projective",
            curves=curves,
            mirrored=side,
            pattern=None if reseau is None else reseau.with_shifts(values[8:].reshape(-1, 2)),
        )
        misfits, matrix = _equations(film, values, known, q, xy, reseau)
        scale = np.linalg.norm(matrix, axis=0)
        if not (scale > 0).all() or np.linalg.matrix_rank(matrix / scale) < len(columns):
            raise InputError(phrase("films.undetermined", model=model))
        fit = Fit.of(misfits, covariance, matrix)
        values[columns] += fit.parameters
        if np.abs(fit.parameters * moves).max() < _CONVERGED * size:
            break
    else:
        raise InputError(phrase("films.not-converged", model=model))
    cofactors, of_film = fit.cofactors[:known, :known], np.zeros((6, 6))
    affine = None
    if known <= 6:
        of_film[:known, :known] = cofactors
        vectors = _vectors(film)
        vectors[0], vectors[1] = values[:3], values[3:6]
        affine = affine_form(film, [*vectors], of_film)
    return Interior(
        model=model,
        film=frozen(values[:6]),
        bend=frozen(values[6:8]),
        unknowns=names,
        cofactors=frozen(cofactors),
        residuals=frozen(fit.residuals[:rows].reshape(-1, 2)),
        redundancy=frozen(fit.redundancy[:rows].reshape(-1, 2)),
        omega=fit.omega,
        degrees_of_freedom=len(misfits) - len(columns),
        mirrored=side,
        affine=affine,
        shifts=frozen(values[8:].reshape(-1, 2)),
    )


def film_side(places: Floats, true: Floats, mirrored: bool | None) -> bool | None:
    """Return whether a film was scanned mirrored, by its marks or as given; None if unknown.

    ContradictionError: if the marks contradict the given side.
    """
    found = is_mirrored(places, true)
    if mirrored is None or found is None or found == mirrored:
        return found if mirrored is None else mirrored
    apart = []
    for side in (False, True):
        t1, t2, theta, m = conformal(places, true, mirrored=side)
        q = places @ np.array([-1.0 if side else 1.0, 1j])
        left = true @ np.array([1.0, 1j]) - (t1 + 1j * t2 + (1.0 + m) * np.exp(1j * theta) * q)
        apart.append(float(np.sqrt(np.mean(np.abs(left) ** 2))))
    code = "films.not-mirrored" if mirrored else "films.mirrored"
    code = "films.wrong-marks" if apart[found] > FAR else code
    raise ContradictionError(phrase(code, given=apart[mirrored], other=apart[found]))


def _equations(
    film: Film, values: Floats, known: int, places: Floats, readings: Floats, reseau: Reseau | None
) -> tuple[Floats, Floats]:
    """Return misfits and partials of the readings, and of observed node shifts, by all unknowns."""
    computed, partials = _photocore.film_readings(film.numbers(), _vectors(film), places)
    misfits = (readings - computed).ravel()
    matrix = partials[:, :, 2 : 2 + known].reshape(len(misfits), known)
    if reseau is None:
        return misfits, matrix
    cosine, sine = np.cos(values[2]), np.sin(values[2])
    turn = np.array([[cosine, -sine], [sine, cosine]]) * [-1.0 if film.mirrored else 1.0, 1.0]
    by_shifts = np.einsum("nij,nk->nikj", partials[:, :, 2:4] @ turn, _parts(reseau, places))
    matrix = np.hstack([matrix, by_shifts.reshape(len(misfits), -1)])
    observed = np.eye(matrix.shape[1])[known:]
    return np.concatenate([misfits, -values[8:]]), np.vstack([matrix, observed])


def true_places(
    readings: Floats, counted: Readings, scanner: Scanner, curves: Sequence[ScannerCurve] = ()
) -> Floats:
    """Return the true coordinates (n, 2) of readings on a scanner, mm, y up."""
    flat = Film(FilmPlacement("p", 0.0), FilmSize("p", 0.0), scanner, counted, curves=curves)
    return _photocore.film_places(flat.numbers(), _vectors(flat), readings)


def _vectors(film: Film) -> Floats:
    return np.array([each.position for each in film.unknowns])


def _parts(reseau: Reseau, places: Floats) -> Floats:
    """Return (n, nodes) weights of the node shifts at coordinates (n, 2)."""
    still = Film(FilmPlacement("still"), FilmSize("still"), Scanner("still"), Readings(), pattern=reseau)
    vectors, found = _vectors(still), []
    first = len(vectors) - len(reseau.weights)
    for row in range(first, len(vectors)):
        vectors[first:] = 0.0
        vectors[row, 0] = 1.0
        found.append((_photocore.film_readings(still.numbers(), vectors, places)[0] - places)[:, 0])
    return np.column_stack(found)
