"""The equations of a network written out once more, for real and imaginary steps of all unknowns."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import Attitudes, Block, Camera, Result, network
from photogram.network import Observation
from photogram.network import observations as kinds_of
from photogram.network import unknowns as commons

from .lenses import BACKWARD, FORWARD, Numbers, arctan2

__all__ = ["STEP", "Dense", "Part", "logarithm", "rotation"]

Floats = NDArray[np.float64]
STEP = 1e-30
"""Imaginary: its square vanishes."""
COMPONENTS = {
    "boresight": [3, 4, 5],
    "instrument": [0, 1],
    "level": [2],
    "plumb line": [0, 1],
    "line": [0, 1, 3, 4],
    "plane": [2, 3, 4],
    "sensor": [0, 1, 2, 3, 4, 5],
}
"""Which of offset and rotation are unknown; of all others the offset."""


@dataclass(frozen=True, eq=False)
class Part:
    """An observation: observed minus computed at a step, and its covariance matrix."""

    misclosure: Callable[[Numbers], Numbers]
    covariance: Floats


def cross(r: Numbers) -> Numbers:
    """Return [r]x."""
    x, y, z = r
    return np.array([[0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x]])


def logarithm(matrix: Numbers) -> Numbers:
    """Return the rotation vector of a rotation by less than a right angle."""
    twice = matrix - matrix.T
    v = np.array([twice[2, 1], twice[0, 2], twice[1, 0]]) / 2
    square = v @ v
    if square.real < 1e-6:
        # asin(s) / s of the sine s.
        return v * (1 + square / 6 + 3 * square**2 / 40 + 5 * square**3 / 112)
    sine = np.sqrt(square)
    return v * (np.arcsin(sine.real) + 1j * sine.imag / np.sqrt(1 - sine.real**2)) / sine


def rotation(vector: Floats) -> Floats:
    """Return (3, 3) a rotation by its vector."""
    return np.asarray(Attitudes.of("rotation_vector", np.atleast_2d(vector)).matrices[0])


def spin(r: Floats) -> Floats:
    """Return (2,) by how much axes R0 Exp(r1, r2, 0) turn about the third for turns about the first two.

    Lines and planes have two unknowns of rotation: axes of offsets and residuals spin by the rest of Jr dr.
    """
    t = np.linalg.norm(r)
    if t == 0:
        return np.zeros(2)
    own = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    jacobian = np.eye(3) - (1 - np.cos(t)) / t**2 * own + (t - np.sin(t)) / t**3 * own @ own
    return np.asarray(jacobian[2, :2] @ np.linalg.inv(jacobian[:2, :2]))


class Dense:
    """An adjusted network as one vector of steps from where it is, and all its equations."""

    def __init__(self, block: Block, result: Result) -> None:
        self.block = block
        self.mounts = {each.photo: each for each in block.mounts}
        self.photos = [k for k, name in enumerate(block.photo_ids) if name not in self.mounts]
        self.unknowns = block.unknowns
        self.places = {id(each): k for k, each in enumerate(self.unknowns)}
        self.of_photo = {name: k for k, name in enumerate(block.photo_ids)}
        self.of_point = {name: k for k, name in enumerate(block.point_ids)}
        self.centres, self.points = result.photo_positions.copy(), result.point_positions.copy()
        matrices = network.rotation_matrix(result.photo_attitudes)
        self.attitudes = (matrices if block.photo_to_ground else matrices.transpose(0, 2, 1)).copy()
        self.cameras = [each.values.copy() for each in result.cameras]
        self.offsets, self.turns, self.spins = [], [], []
        for unknown, adjusted in zip(self.unknowns, result.unknowns, strict=True):
            six = np.zeros(6)
            six[self.components(unknown)] = adjusted.change
            self.offsets.append(six[:3])
            self.turns.append(self.axes_of(unknown).T @ unknown.attitude @ rotation(six[3:]))
            self.spins.append(spin(six[3:]) if unknown.KIND in ("line", "plane") else np.zeros(2))
        self.first: dict[str, int] = {}
        self.slices: list[slice] = []
        for kind, widths in (
            ("photo", [6] * len(self.photos)),
            ("point", [3] * len(block.point_ids)),
            ("camera", [len(values) for values in self.cameras]),
            ("common", [len(self.components(each)) for each in self.unknowns]),
        ):
            self.first[kind] = len(self.slices)
            for width in widths:
                start = self.slices[-1].stop if self.slices else 0
                self.slices.append(slice(start, start + width))
        self.count = self.slices[-1].stop
        self.parts = list(self._parts())

    def of(self, kind: str, index: int) -> slice:
        """Return where the unknowns of something are."""
        return self.slices[self.first[kind] + index]

    def of_pose(self, photo: int) -> slice:
        """Return where the unknowns of a photo are that is not mounted."""
        return self.of("photo", self.photos.index(photo))

    @staticmethod
    def components(unknown: commons.Unknown) -> list[int]:
        """Return which of offset and rotation are unknown."""
        return COMPONENTS.get(unknown.KIND, [0, 1, 2])

    def selection(self) -> list[tuple[str, list[str]]]:
        """Return what the engine calls all unknowns, in their order."""
        block = self.block
        own = [block.photo_ids[k] for k in self.photos]
        found = [("step", own), ("point", block.point_ids), ("camera", block.camera_names)]
        return [*found, ("unknown", [each.name for each in self.unknowns])] if self.unknowns else found

    def free(self, result: Result) -> NDArray[np.int64]:
        """Return which unknowns are neither fixed nor held for the datum."""
        block, fixed = self.block, np.zeros(self.count, bool)
        for row, sd in enumerate(block.point_sd):
            fixed[self.of("point", row)] = sd == 0
        for row, camera in enumerate(block.cameras):
            fixed[self.of("camera", row)] = camera.deviations == 0
        for row, unknown in enumerate(self.unknowns):
            fixed[self.of("common", row)] = unknown.deviations == 0
        if result.datum.kind == "minimum constraints":
            position = ["longitude", "latitude", "height"] if block.geographic else ["X", "Y", "Z"]
            names = [*position, "omega", "phi", "kappa"]
            for photo, name in result.datum.held:
                fixed[self.of_pose(self.of_photo[photo]).start + names.index(name)] = True
        return np.flatnonzero(~fixed)

    def cartesian(self, at: Numbers) -> Numbers:
        """Return (3,) a place of the object space in cartesian axes."""
        spheroid = self.block.spheroid
        if spheroid is None:
            return at
        square = 1 - (spheroid.b / spheroid.a) ** 2
        longitude, latitude, height = at
        normal = spheroid.a / np.sqrt(1 - square * np.sin(latitude) ** 2)
        plane = (normal + height) * np.cos(latitude)
        up = (normal * (1 - square) + height) * np.sin(latitude)
        return np.array([plane * np.cos(longitude), plane * np.sin(longitude), up])

    def local(self, at: Numbers) -> Numbers:
        """Return (3, 3) east, north, up at a place, as rows; X, Y, Z in rectangular space."""
        if self.block.spheroid is None:
            return np.eye(3)
        (sl, sp, _), (cl, cp, _) = np.sin(at), np.cos(at)
        return np.array([[-sl, cl, 0 * sl], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]])

    def axes_of(self, unknown: commons.Unknown) -> Floats:
        """Return (3, 3) the axes that a common unknown is told in, as rows."""
        if isinstance(unknown, commons.Plane | commons.Line | commons.PlumbLine):
            return self.local(unknown.position)
        if isinstance(unknown, commons.Shift | commons.Drift):
            return self.local(np.median(self.block.photo_positions, axis=0))
        return np.eye(3)

    def photo(self, d: Numbers, index: int) -> tuple[Numbers, Numbers, Numbers]:
        """Return cartesian position and attitude of a photo, and its attitude in local axes."""
        name = self.block.photo_ids[index]
        if name in self.mounts:
            mount = self.mounts[name]
            centre, attitude, _ = self.photo(d, self.of_photo[mount.frame])
            offset, turn = self.common(d, mount.sensor)
            own = centre + attitude @ (mount.sensor.position + offset), attitude @ turn
            return *own, self._turned(*own)
        step = d[self.of_pose(index)]
        place = self.centres[index] + step[:3]
        local = self.attitudes[index] @ (np.eye(3) + cross(step[3:]))
        return self.cartesian(place), self.local(place).T @ local, local

    def _turned(self, centre: Numbers, attitude: Numbers) -> Numbers:
        """Return an attitude in the local axes at a cartesian position."""
        if self.block.spheroid is None:
            return attitude
        at = network.geocentric_to_geographic(centre.real[None], self.block.spheroid)[0]
        # One of Newton's steps carries over what is imaginary.
        partials = [self.cartesian(at + 1j * STEP * axis).imag / STEP for axis in np.eye(3)]
        return self.local(at + 1j * np.linalg.solve(np.stack(partials, axis=-1), centre.imag)) @ attitude

    def point(self, d: Numbers, name: str) -> Numbers:
        """Return (3,) coordinates of a point in the object space."""
        row = self.of_point[name]
        return self.points[row] + d[self.of("point", row)]

    def common(self, d: Numbers, unknown: commons.Unknown) -> tuple[Numbers, Numbers]:
        """Return (3,) the offset and (3, 3) the rotation of a common unknown.

        Steps of a line are how its place moves along the adjusted axes: its offset is along axes that spin.
        """
        row, six = self.places[id(unknown)], np.zeros(6, complex)
        six[self.components(unknown)] = d[self.of("common", row)]
        spun = self.spins[row] @ six[3:5]
        six[5] += spun
        offset = self.offsets[row] + six[:3] - np.cross([0.0, 0.0, 1.0], self.offsets[row]) * spun
        return offset, self.turns[row] @ (np.eye(3) + cross(six[3:]))

    def vector(self, d: Numbers, unknown: commons.Unknown) -> Numbers:
        """Return (3,) a lever arm, shift, drift, instrument or sensor."""
        return unknown.position + self.common(d, unknown)[0]

    def beside(self, d: Numbers, unknown: commons.Unknown, point: str) -> Numbers:
        """Return (3,) a point in the axes of a plane or line, less the offset of that."""
        offset, turn = self.common(d, unknown)
        return turn.T @ (self.cartesian(self.point(d, point)) - self.cartesian(unknown.position)) - offset

    def changed(self, d: Numbers, unknown: commons.Unknown) -> Numbers:
        """Return (k,) what an unknown has changed by: offsets, and the rotation vector from what is given."""
        offset, turn = self.common(d, unknown)
        given = self.axes_of(unknown).T @ unknown.attitude
        return np.concatenate([offset, logarithm(given.T @ turn)])[self.components(unknown)]

    def angles(self, d: Numbers, photo: int) -> Numbers:
        """Return (3,) omega, phi, kappa."""
        _, _, local = self.photo(d, photo)
        m = local if self.block.photo_to_ground else local.T
        level = np.sqrt(m[0, 0] ** 2 + m[1, 0] ** 2)
        return arctan2(np.array([-m[2, 1], m[2, 0], -m[1, 0]]), np.array([m[2, 2], level, m[0, 0]]))

    def images(self, d: Numbers) -> Numbers:
        """Return (m, 2) observed minus computed."""
        block, found = self.block, np.zeros((len(self.block.image_xy), 2), complex)
        places = np.array([self.cartesian(self.point(d, name)) for name in block.point_ids])
        for photo in range(len(block.photo_ids)):
            rows = np.flatnonzero(block.image_photos == photo)
            centre, attitude, _ = self.photo(d, photo)
            which = int(block.photo_cameras[photo])
            values = self.cameras[which] + d[self.of("camera", which)]
            u = (places[block.image_points[rows]] - centre) @ attitude
            found[rows] = seen(block.cameras[which], values, u, block.image_xy[rows])
        return found

    def _parts(self) -> Iterator[Part]:
        """Return all observations but images: those of the block in their order come first."""
        block = self.block
        positions = [each for each in block.observations if isinstance(each, kinds_of.Position)]
        times = {
            id(own): float(np.mean([each.time for each in positions if each.drift is own]))
            for own in (each.drift for each in positions)
        }
        for each in block.observations:
            equation = EQUATIONS[type(each)]
            yield Part(lambda d, each=each, of=equation: of(self, d, each, times), each.precision)
        for row, name in enumerate(block.point_ids):
            own, given = _weighted(block.point_sd[row]), block.point_positions[row]
            if own.size:
                yield Part(
                    lambda d, name=name, own=own, given=given: (given - self.point(d, name))[own],
                    np.diag(block.point_sd[row][own] ** 2),
                )
        for photo in self.photos:
            own, given = _weighted(block.photo_position_sd[photo]), block.photo_positions_observed[photo]
            if own.size:
                yield Part(
                    lambda d, photo=photo, own=own, given=given: (
                        given - self.centres[photo] - d[self.of_pose(photo)][:3]
                    )[own],
                    np.diag(block.photo_position_sd[photo][own] ** 2),
                )
            own, given = _weighted(block.photo_attitude_sd[photo]), block.photo_attitudes_observed[photo]
            if own.size:
                yield Part(
                    lambda d, photo=photo, own=own, given=given: _wrapped(given - self.angles(d, photo))[own],
                    np.diag(block.photo_attitude_sd[photo][own] ** 2),
                )
        for row, camera in enumerate(block.cameras):
            own, covariance = _weighted(camera.deviations), camera.prior_covariance
            if own.size:
                yield Part(
                    lambda d, row=row, own=own, given=camera.values: (
                        given - self.cameras[row] - d[self.of("camera", row)]
                    )[own],
                    np.diag(camera.deviations[own] ** 2) if covariance is None else covariance,
                )
        for unknown in self.unknowns:
            own = _weighted(unknown.deviations)
            if own.size:
                yield Part(
                    lambda d, unknown=unknown, own=own: -self.changed(d, unknown)[own],
                    np.diag(unknown.deviations[own] ** 2),
                )


def _weighted(sd: Floats) -> NDArray[np.int64]:
    return np.flatnonzero((sd > 0) & np.isfinite(sd))


def _wrapped(angles: Numbers) -> Numbers:
    return angles - 2 * np.pi * np.round(angles.real / (2 * np.pi))


def seen(camera: Camera, values: Numbers, u: Numbers, xy: Floats) -> Numbers:
    """Return (n, 2) observed minus computed of images of directions."""
    p = dict(zip(camera.names, values, strict=True))
    if camera.model in FORWARD:
        apart = xy - FORWARD[camera.model](u, p)
        if camera.model == "equirectangular":
            apart[:, 0] -= p["w"] * np.round((apart[:, 0] / p["w"]).real)
        return apart
    ideal = np.column_stack([p["c"] * u[:, 0] / u[:, 2], p["c"] * u[:, 1] / u[:, 2]])
    correct = BACKWARD[camera.model]
    if camera.weights == "corrected":
        return correct(xy.astype(complex), p) - ideal
    # What is corrected to the ideal position, by Newton's method; the imaginary part goes with it.
    real, at = {name: value.real for name, value in p.items()}, xy.astype(complex)
    for _ in range(12):
        partials = [correct(at.real + STEP * 1j * axis, real).imag / STEP for axis in np.eye(2)]
        gradient, apart = np.stack(partials, axis=-1), ideal - correct(at, p)
        at = at + np.linalg.solve(gradient, apart.real[..., None])[..., 0]
        at = at + 1j * np.linalg.solve(gradient, apart.imag[..., None])[..., 0]
    return xy - at


Times = dict[int, float]
Equation = Callable[[Dense, Numbers, Any, Times], Numbers]


def _distance(of: Dense, d: Numbers, each: kinds_of.Distance, _: Times) -> Numbers:
    p, q = (of.cartesian(of.point(d, name)) for name in each.points)
    m, k, _none = (1.0, 0.0, 0.0) if each.instrument is None else of.vector(d, each.instrument)
    return np.array([each.observed[0] - m * np.sqrt(((q - p) ** 2).sum()) - k])


def _difference(of: Dense, d: Numbers, each: Observation, _: Times) -> Numbers:
    p, q = (of.cartesian(of.point(d, name)) for name in each.points)
    return each.observed - (q - p)


def _equal_height(of: Dense, d: Numbers, each: Observation, _: Times) -> Numbers:
    p, q = (of.point(d, name)[2] for name in each.points)
    return np.array([each.observed[0] - (q - p)])


def _on_level(of: Dense, d: Numbers, each: kinds_of.OnLevel, _: Times) -> Numbers:
    return each.observed - (of.point(d, each.point) - of.vector(d, each.level))[[2]]


def _on_plane(of: Dense, d: Numbers, each: kinds_of.OnPlane, _: Times) -> Numbers:
    return each.observed - of.beside(d, each.plane, each.point)[[2]]


def _on_line(of: Dense, d: Numbers, each: kinds_of.OnLine, _: Times) -> Numbers:
    return -of.beside(d, each.line, each.point)[:2]


def _control(of: Dense, d: Numbers, each: kinds_of.Control, _: Times) -> Numbers:
    at = each.observed
    return of.local(at) @ (of.cartesian(at) - of.cartesian(of.point(d, each.point)))


def _position(of: Dense, d: Numbers, each: kinds_of.Position, times: Times) -> Numbers:
    at = each.observed[:3]
    centre, attitude, _ = of.photo(d, of.of_photo[each.photo])
    arm = each.lever_arm
    moved = centre + attitude @ (
        of.vector(d, arm) if isinstance(arm, commons.LeverArm) else each.observed[3:6]
    )
    for unknown, factor in ((each.shift, 1.0), (each.drift, each.time - times[id(each.drift)])):
        if unknown is not None:
            moved = moved + factor * of.axes_of(unknown).T @ of.vector(d, unknown)
    return of.local(at) @ (of.cartesian(at) - moved)


def _attitude(of: Dense, d: Numbers, each: kinds_of.Attitude, _: Times) -> Numbers:
    _centre, _cartesian, local = of.photo(d, of.of_photo[each.photo])
    own = each.boresight
    turn = of.common(d, own)[1] if isinstance(own, commons.Boresight) else np.eye(3)
    return logarithm((local @ turn).T @ each.observed[:9].reshape(3, 3))


def _relative(of: Dense, d: Numbers, each: kinds_of.Relative, _: Times) -> Numbers:
    (ci, ai, _i), (cj, aj, _j) = (of.photo(d, of.of_photo[name]) for name in each.photos)
    turn = logarithm((ai.T @ aj).T @ each.observed[3:].reshape(3, 3))
    return np.concatenate([each.observed[:3] - ai.T @ (cj - ci), turn])


def _base(of: Dense, d: Numbers, each: kinds_of.Base, _: Times) -> Numbers:
    first, second = (np.zeros(3) if own is None else of.vector(d, own) for own in (each.first, each.second))
    return np.array([each.observed[0] - np.sqrt(((second - first) ** 2).sum())])


def _prior(of: Dense, d: Numbers, each: kinds_of.Prior, _: Times) -> Numbers:
    return -of.changed(d, each.unknown)


EQUATIONS: dict[type[Observation], Equation] = {
    kinds_of.Distance: _distance,
    kinds_of.Difference: _difference,
    kinds_of.EqualHeight: _equal_height,
    kinds_of.OnLevel: _on_level,
    kinds_of.OnPlane: _on_plane,
    kinds_of.OnPlumbLine: _on_line,
    kinds_of.OnLine: _on_line,
    kinds_of.Control: _control,
    kinds_of.Position: _position,
    kinds_of.Attitude: _attitude,
    kinds_of.Relative: _relative,
    kinds_of.Base: _base,
    kinds_of.Prior: _prior,
}
"""Observed minus computed of each kind."""
