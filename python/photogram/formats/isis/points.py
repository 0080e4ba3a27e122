"""Points of control networks as points of blocks, with prior values."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.formats.isis.network import ControlNetwork
from photogram.formats.isis.settings import Settings
from photogram.io.places import Place
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message
from photogram.network.geometry import Cartesian, Spheroid, local_frames
from photogram.network.observations import Control
from photogram.words import phrase

_LOCAL = [1, 0, 2]  # Longitude, latitude and radius in the order of jigsaw: latitude, longitude, radius


@dataclass(frozen=True, eq=False)
class KnownPoints:
    """Prior values of n points in the coordinates of a block.

    `positions` and `sd` are (n, 3) as in blocks: weighted or fixed values, otherwise NaN, and their standard
    deviations. `starts` are (n, 3) initial values; `controls` points with a full covariance matrix;
    `messages` remarks on values that differ from the network.
    """

    positions: Floats
    sd: Floats
    starts: Floats
    controls: list[Control]
    messages: list[Message]


def known_points(
    network: ControlNetwork,
    rows: Indices,
    starts: Floats,
    settings: Settings,
    spheroid: Spheroid | None,
    place: Place,
) -> KnownPoints:
    """Return the prior values of points from a network and the settings.

    Free points have the standard deviations of the settings, and a fixed radius unless it is to be estimated.
    Constrained points have their own covariance matrix or single standard deviations; fixed points have 0.
    `rows` are the points of the network in use, `starts` (n, 3) their initial X, Y, Z in metres. `spheroid`
    is a sphere if latitude, longitude and radius are adjusted, None if X, Y, Z are.
    """
    points = network.points
    coordinates = Cartesian(spheroid).from_cartesian(starts)
    metres = per_metre(coordinates, spheroid)
    order = _LOCAL if spheroid else [0, 1, 2]
    sigmas = np.array([np.inf if each is None else each for each in settings.point_sigmas])[order]
    sd = np.broadcast_to(sigmas, coordinates.shape) * metres
    if spheroid and not settings.radius:
        sd[:, 2] = np.where(points.is_constrained[rows], sd[:, 2], 0.0)
    sd[points.is_fixed[rows]] = 0.0
    known = KnownPoints(coordinates, sd, coordinates, [], [])
    _constrain(known, network, rows, metres, spheroid, place)
    return replace(known, positions=np.where(np.isfinite(sd), coordinates, np.nan))


def per_metre(coordinates: Floats, spheroid: Spheroid | None) -> Floats:
    """Return (n, 3) coordinate units per metre at (n, 3) coordinates."""
    if spheroid is None:
        return np.ones_like(coordinates)
    radius = spheroid.a + coordinates[:, 2]
    return np.column_stack([1 / (radius * np.cos(coordinates[:, 1])), 1 / radius, np.ones(len(coordinates))])


def full_matrices(packed: Floats) -> Floats:
    """Return (n, 3, 3) symmetric matrices of (n, 6) upper triangles, row by row."""
    return packed[:, [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


def _constrain(
    known: KnownPoints,
    network: ControlNetwork,
    rows: Indices,
    metres: Floats,
    spheroid: Spheroid | None,
    place: Place,
) -> None:
    """Apply the covariance matrices of constrained points."""
    points, own = network.points, np.flatnonzero(network.points.is_constrained[rows])
    covariances = full_matrices(points.apriori_covariance[rows[own]])
    given = np.isfinite(covariances).all(axis=(1, 2))
    _report(known, "isis.no-covariance", points.ids, rows[own[~given]])
    own, covariances = own[given], covariances[given]
    bad = np.flatnonzero(~(np.linalg.eigvalsh(covariances) > 0).all(axis=1))
    if len(bad):
        name = points.ids[rows[own[bad[0]]]]
        raise place.error(phrase("isis.covariance", point=name))
    if spheroid:
        axes = local_frames(known.starts[own])
        covariances = axes @ covariances @ axes.transpose(0, 2, 1)
    single = points.constrained[rows[own]][:, _LOCAL if spheroid else [0, 1, 2]]
    whole = single.all(axis=1) | ~single.any(axis=1)
    for row, covariance in zip(own[whole], covariances[whole], strict=True):
        known.sd[row] = np.inf
        known.controls.append(Control(points.ids[rows[row]], known.starts[row], covariance=covariance))
    deviations = np.sqrt(np.einsum("nkk->nk", covariances)) * metres[own]
    parts = np.flatnonzero(~whole)
    known.sd[own[parts]] = np.where(single[parts], deviations[parts], known.sd[own[parts]])
    _report(known, "isis.single-coordinates", points.ids, rows[own[parts]])


def _report(known: KnownPoints, code: str, ids: Sequence[str], rows: Indices) -> None:
    if len(rows):
        names = [ids[row] for row in rows.tolist()]
        known.messages.append(Message.of(code, n=len(rows), names=names))


def given_starts(network: ControlNetwork, rows: Indices, place: Place) -> Floats:
    """Return (n, 3) X, Y, Z of points, preferably a-priori ones; NaN without.

    They are required for fixed and constrained points.
    """
    points = network.points
    apriori, adjusted = points.apriori[rows], points.adjusted[rows]
    there = np.isfinite(apriori).all(axis=1, keepdims=True)
    found: Floats = np.where(there, apriori, adjusted)
    missing = ~np.isfinite(found).all(axis=1) & (points.is_fixed | points.is_constrained)[rows]
    if missing.any():
        raise place.error(phrase("isis.coordinates", point=points.ids[rows[np.argmax(missing)]]))
    return found
