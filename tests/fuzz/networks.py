"""Random networks of every camera, kind of observation and datum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram import (
    Attitudes,
    Block,
    Camera,
    Distance,
    InnerConstraints,
    LeverArm,
    MinimumConstraints,
    Position,
    Spheroid,
    _photocore,
)
from photogram.network import (
    Attitude,
    Base,
    Boresight,
    Control,
    Difference,
    Drift,
    EqualHeight,
    Instrument,
    Level,
    Line,
    Mount,
    Observation,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
    Plane,
    PlumbLine,
    Prior,
    Relative,
    Sensor,
    Shift,
    geometry,
)
from photogram.network.passages import KNOTTED

__all__ = ["DATUMS", "KINDS", "MODELS", "RandomNetwork", "random_network"]

Floats = NDArray[np.float64]

MODELS = tuple(name for name in _photocore.CAMERAS if not name.endswith("_measured") and name != KNOTTED)
DATUMS = ("control", "control and poses", "positions", "minimum", "points", "points and photos", "attitudes")
KINDS = (
    "distance",
    "instrument",
    "difference",
    "equal height",
    "on level",
    "on plane",
    "on plumb line",
    "on line",
    "control",
    "position",
    "lever arm, shift and drift",
    "attitude",
    "boresight",
    "relative",
    "rig",
    "base",
    "prior",
)
"""Kinds of observations, and common unknowns that they may have."""

SPHEROID = Spheroid(6378137.0, 6356752.314)
PHOTOS, POINTS = 7, 26
HALF_FORMAT = {"px": 900.0, "mm": 27.0}
DISTANCE = {"px": 1500.0, "mm": 45.0}
SPECIAL = {
    "omega": 0.8,
    "alpha": 0.6,
    "beta": 1.05,
    "w": 2000.0,
    "h": 1500.0,
    "b": 25.0,
    "hx": 30.0,
    "hy": 30.0,
    "x0": 1.0,
    "y0": -1.0,
    "phi_T": 0.7,
    "axis_x": 0.05,
    "axis_y": -0.04,
}
SURELY_FREE = frozenset({"c", "f", "fx", "xp", "yp", "cx", "cy"})


@dataclass(frozen=True, eq=False)
class RandomNetwork:
    """A network as it is given, its datum, and what is in it."""

    block: Block
    datum: InnerConstraints | MinimumConstraints | None
    datum_name: str
    kinds: tuple[str, ...]
    models: tuple[str, ...]


def rotation(vector: Floats) -> Floats:
    """Return (3, 3) a rotation by its vector."""
    return np.asarray(Attitudes.of("rotation_vector", np.atleast_2d(vector)).matrices[0])


class _Scene:
    """Points, photos that look at them from all around, and what of them is measured without errors."""

    def __init__(self, random: np.random.Generator, models: tuple[str, ...]) -> None:
        self.random = random
        self.spheroid = SPHEROID if random.random() < 0.3 else None
        self.photo_to_ground = bool(random.random() < 0.5)
        middle = np.array([[random.uniform(-3, 3), random.uniform(-1.2, 1.2), random.uniform(0, 500)]])
        self.axes = np.eye(3) if self.spheroid is None else geometry.local_frames(middle)[0]
        self.origin = (
            np.array([500.0, -300.0, 80.0])
            if self.spheroid is None
            else geometry.geographic_to_geocentric(middle, self.spheroid)[0]
        )
        self.points = random.uniform(-1, 1, (POINTS, 3)) * [5.0, 5.0, 2.0]
        turns = 2 * np.pi * (np.arange(PHOTOS) + random.uniform(-0.2, 0.2, PHOTOS)) / PHOTOS
        tilts = random.uniform(0.3, 0.9, PHOTOS)
        distances = random.uniform(13.0, 17.0, PHOTOS)
        out = np.column_stack([np.sin(tilts) * np.cos(turns), np.sin(tilts) * np.sin(turns), np.cos(tilts)])
        self.centres = distances[:, None] * out
        self.attitudes = np.stack([self._looking(direction, k) for k, direction in enumerate(out)])
        self.cameras = tuple(self._camera(model, k) for k, model in enumerate(models))
        self.unit = str(self.cameras[0][0].unit)
        self.photo_cameras = random.integers(0, len(models), PHOTOS)
        self.photo_cameras[: len(models)] = np.arange(len(models))
        self.mounts: tuple[Mount, ...] = ()
        self.observations: list[Observation] = []

    def _looking(self, out: Floats, k: int) -> Floats:
        """Return an attitude that looks back to the middle, rolled by quarters."""
        side = np.cross([0.0, 0.0, 1.0], out)
        side /= np.linalg.norm(side)
        roll = rotation(np.array([0, 0, np.pi / 2 * (k % 4) + self.random.uniform(-0.3, 0.3)]))
        level = np.column_stack([side, np.cross(out, side), out])
        return np.asarray(level @ roll @ rotation(self.random.normal(0, 0.03, 3)))

    def noise(self, sd: Any, *shape: int) -> Floats:
        """Return errors."""
        return np.asarray(sd * self.random.standard_normal(shape))

    def _camera(self, model: str, k: int) -> tuple[Camera, Camera]:
        """Return a camera as it is, and as it is given."""
        names = dict(dict(_photocore.camera_models())[model][1])
        constants = Camera(model, _bare(names)).constants
        unit = "mm" if "c" in names else "px"
        truth, sizes = {}, {}
        for name, power in names.items():
            truth[name], sizes[name] = self._value(model, name, power, unit)
        sd = {}
        for name in names:
            if name in constants or (name == "c_y" and truth[name] == 0) or sizes[name] == 0:
                continue
            draw = self.random.random()
            if draw < 0.45:
                continue
            sd[name] = np.inf if name in SURELY_FREE and draw > 0.7 else sizes[name]
        given = {
            name: value + (self.noise(1.0)[()] * sizes[name] if sd.get(name, 0.0) > 0 else 0.0)
            for name, value in truth.items()
        }
        weighted = [name for name, own in sd.items() if np.isfinite(own)]
        covariance = None
        if len(weighted) > 1 and self.random.random() < 0.4:
            own = np.array([sd[name] for name in weighted])
            covariance = (weighted, self._correlated(own))
        weights = "measured" if self._is_backward(model) and self.random.random() < 0.5 else "corrected"
        true = Camera(model, truth, name=f"camera {k}")
        return true, Camera(model, given, sd=sd, covariance=covariance, name=f"camera {k}", weights=weights)

    @staticmethod
    def _is_backward(model: str) -> bool:
        return bool(dict(_photocore.camera_models())[model][3] == "backward")

    def _value(self, model: str, name: str, power: int, unit: str) -> tuple[float, float]:
        """Return a plausible value of a parameter, and how well it is known."""
        draw, f, reach = float(self.random.uniform(-1, 1)), DISTANCE[unit], HALF_FORMAT[unit]
        if model == "equirectangular" and name in ("w", "h"):
            return {"w": 9000.0, "h": 4500.0}[name], 0.0
        if name in SPECIAL:
            known = {
                "omega": 0.02,
                "alpha": 0.02,
                "beta": 0.02,
                "phi_T": 0.05,
                "axis_x": 0.01,
                "axis_y": 0.01,
            }
            return SPECIAL[name], known.get(name, 0.0)
        if name == "c0":
            return (f if draw > 0 else 0.0), 0.0
        if name == "r0" and power == 1:
            return (0.6 * reach if draw > 0 else 0.0), 0.0
        if name == "c_y" and draw < -0.3:
            return 0.0, 0.0
        if name in ("c", "f", "fx", "fy", "c_y"):
            sign = -1.0 if name == "c" and unit == "mm" and model != "plate" and draw > -0.7 else 1.0
            return sign * f * (1 + 0.01 * draw), 0.003 * f
        if power == 1:
            small = model == "on_comparator" and name[0] in "xy" and name[1] in "ABCDEFGHJ"
            return (1e-4 if small else 0.01) * reach * draw, (1e-4 if small else 3e-3) * reach
        size = {"k": 0.02, "r": 0.02, "K": 0.01, "A": 0.01}.get(name[0], 1e-3)
        size *= 1.0 if power == 0 else reach**power
        return size * draw, 0.3 * size

    def _correlated(self, sd: Floats) -> Floats:
        factor = np.tril(self.random.uniform(-0.5, 0.5, (len(sd), len(sd))), -1) + np.eye(len(sd))
        matrix = factor @ factor.T
        own = np.sqrt(np.diag(matrix))
        return np.asarray(matrix / np.outer(own, own) * np.outer(sd, sd))

    def spread(self, sd: Floats) -> dict[str, Any]:
        """Return precision of an observation: standard deviations, or a covariance matrix."""
        if self.random.random() < 0.5 or len(sd) == 1:
            return {"sd": sd if len(sd) > 1 else float(sd[0])}
        return {"covariance": self._correlated(sd)}

    def positions(self, local: Floats) -> Floats:
        """Return (n, 3) coordinates of the object space of places in local axes."""
        cartesian = self.origin + local @ self.axes
        if self.spheroid is None:
            return np.asarray(cartesian)
        return geometry.geocentric_to_geographic(cartesian, self.spheroid)

    def here(self, local: Floats) -> Floats:
        """Return (3, 3) the local axes at a place, as rows, in the local axes of the scene."""
        if self.spheroid is None:
            return np.eye(3)
        return np.asarray(geometry.local_frames(self.positions(local[None]))[0] @ self.axes.T)

    def angles(self, centres: Floats, attitudes: Floats) -> Floats:
        """Return (P, 3) omega, phi, kappa of attitudes in the local axes of the scene."""
        own = np.stack([self.here(at) @ a for at, a in zip(centres, attitudes, strict=True)])
        return geometry.rotation_angles(own if self.photo_to_ground else own.transpose(0, 2, 1))


def _bare(names: dict[str, int]) -> dict[str, float]:
    """Return the parameters that a camera cannot do without."""
    needed = ("c", "f", "fx", "fy", "cx", "cy", "w", "h", "b", "beta", "hx", "hy")
    return {name: 1.0 for name in needed if name in names}


def random_network(seed: int, number: int, first: str | None = None) -> RandomNetwork:
    """Return a random network: its cameras and its datum go through all there are as `number` grows.

    `first` is its first camera in the place of the one whose turn it is: so a network stays what it was when
    there are more cameras.
    """
    random = np.random.default_rng([seed, number])
    first = first or MODELS[number % len(MODELS)]
    same_unit = [model for model in MODELS if ("c" in _names(model)) == ("c" in _names(first))]
    models = (first, str(random.choice(same_unit))) if random.random() < 0.5 else (first,)
    datum = DATUMS[(number // 2) % len(DATUMS)]
    scene = _Scene(random, models)
    free = datum in DATUMS[3:]
    kinds = [kind for kind in KINDS if random.random() < 0.35]
    left_out: set[str] = set()
    if free:
        # What gives a datum, and what turns with the network where its unknown does not.
        left_out |= {"control", "position", "lever arm, shift and drift", "on line", "on plumb line"}
    if free and scene.spheroid is not None:
        # Heights above an ellipsoid say where on it ten metres are: to some kilometres.
        left_out |= {"equal height", "on level"}
    if datum == "positions":
        kinds = [*{*kinds, "position"}]
    kinds = [kind for kind in KINDS if kind in kinds and kind not in left_out]
    _rig(scene, kinds)
    # These move points to where they are measured.
    _on_surfaces(scene, kinds)
    _between_points(scene, kinds)
    _of_photos(scene, kinds)
    block = _block(scene, datum, kinds)
    return RandomNetwork(block, _datum(random, block, datum), datum, tuple(kinds), models)


def _names(model: str) -> list[str]:
    return [name for name, _ in dict(_photocore.camera_models())[model][1]]


def _rig(scene: _Scene, kinds: list[str]) -> None:
    """Mount the last two photos on the frames of the first two."""
    if not {"rig", "base"} & {*kinds}:
        return
    offset, turn = np.array([6.0, 0.5, -0.3]), rotation(np.array([0.05, 0.35, -0.1]))
    sd = float(scene.random.choice([0.02, np.inf]))
    given = offset + scene.noise(0.02, 3), turn @ rotation(scene.noise(0.005, 3))
    turns = min(sd, 0.01) if np.isfinite(sd) else np.inf
    sensor = Sensor("right", *given, sd=[sd] * 3 + [turns] * 3)
    mounts = []
    for frame in range(2):
        photo = PHOTOS - 2 + frame
        scene.centres[photo] = scene.centres[frame] + scene.attitudes[frame] @ offset
        scene.attitudes[photo] = scene.attitudes[frame] @ turn
        mounts.append(Mount(f"photo {photo}", f"photo {frame}", sensor))
    scene.mounts = tuple(mounts)
    if "base" in kinds:
        length = float(np.linalg.norm(offset)) + scene.noise(0.002)[()]
        scene.observations.append(Base(None, sensor, float(length), 0.002))


def _between_points(scene: _Scene, kinds: list[str]) -> None:
    add, points, name = scene.observations.append, scene.points, "point {}".format
    instrument = Instrument("tape", 1.001, 0.01, sd=[1e-3, 0.01])
    for row in range(4):
        p, q = points[[row, row + 5]]
        if "distance" in kinds:
            add(
                Distance(
                    name(row), name(row + 5), float(np.linalg.norm(q - p) + scene.noise(0.003)[()]), 0.003
                )
            )
        if "instrument" in kinds:
            length = 1.0015 * np.linalg.norm(points[row + 12] - p) + 0.005 + scene.noise(0.004)[()]
            add(Distance(name(row), name(row + 12), float(length), 0.004, instrument=instrument))
        if "difference" in kinds:
            vector = (points[row + 7] - p) @ scene.axes + scene.noise(0.004, 3)
            add(Difference(name(row), name(row + 7), vector, **scene.spread(np.array([0.004, 0.003, 0.005]))))
        if "equal height" in kinds:
            heights = scene.positions(points[[row, row + 9]])[:, 2]
            add(
                EqualHeight(
                    name(row), name(row + 9), 0.003, float(np.diff(heights)[0] + scene.noise(0.003)[()])
                )
            )


def _on_surfaces(scene: _Scene, kinds: list[str]) -> None:
    add, points, name = scene.observations.append, scene.points, "point {}".format
    if "on level" in kinds:
        level = Level("lake", float(scene.positions(points[[3]])[0, 2]) + 0.1, sd=np.inf)
        heights = scene.positions(points[3:8])[:, 2]
        for row in range(5):
            add(
                OnLevel(
                    name(3 + row), level, 0.004, float(heights[row] - heights[0] + scene.noise(0.004)[()])
                )
            )
    if "on plane" in kinds:
        points[8:14, 2] = 0.5 + 0.1 * points[8:14, 0]
        through = scene.positions(np.array([[0.0, 0.0, 0.6]]))[0]
        plane = Plane("wall", scene.here(np.array([0.0, 0.0, 0.6])) @ [-0.12, 0.01, 1.0], through)
        for row in range(8, 14):
            add(OnPlane(name(row), plane, 0.004, float(scene.noise(0.004)[()])))
    if "on plumb line" in kinds:
        points[14:16, :2] = points[14, :2]
        line = PlumbLine("edge", scene.positions(points[[14]] + [0.05, -0.02, 0.0])[0], sd=[np.inf, 0.1])
        for row in (14, 15):
            add(OnPlumbLine(name(row), line, **scene.spread(np.array([0.004, 0.006]))))
    if "on line" in kinds:
        along = np.array([0.5, 0.3, 0.8])
        points[16:20] = points[16] + np.linspace(0, 3, 4)[:, None] * along
        through = scene.positions(points[[17]] + 0.02)[0]
        line = Line("rail", scene.here(points[17]) @ (along + 0.01), through)
        for row in range(16, 20):
            add(OnLine(name(row), line, **scene.spread(np.array([0.004, 0.005]))))


def _of_photos(scene: _Scene, kinds: list[str]) -> None:
    add, photo = scene.observations.append, "photo {}".format
    arm = np.array([0.2, -0.3, 0.5]) if "lever arm, shift and drift" in kinds else np.zeros(3)
    lever, shift, drift = (
        LeverArm("antenna", arm + 0.01, sd=0.02),
        Shift("s", 0.0, sd=0.2),
        Drift("d", sd=0.05),
    )
    boresight = Boresight("unit", rotation(np.array([0.02, -0.01, 0.5])))
    if "prior" in kinds and "boresight" in kinds:
        add(Prior(boresight, **scene.spread(np.array([1e-3, 2e-3, 1e-3]))))
    free = PHOTOS - len(scene.mounts)
    for row in range(PHOTOS):
        centre, attitude = scene.centres[row], scene.attitudes[row]
        here = scene.here(centre)
        if ("position" in kinds or "lever arm, shift and drift" in kinds) and row < free:
            antenna = centre + attitude @ arm + scene.noise(0.02, 3)
            moving = "lever arm, shift and drift" in kinds
            parts = {"lever_arm": lever, "shift": shift, "drift": drift, "time": 2.0 * row} if moving else {}
            at = scene.positions(antenna[None])[0]
            add(Position(photo(row), at, **scene.spread(np.array([0.02, 0.02, 0.03])), **parts))
        if "attitude" in kinds or "boresight" in kinds:
            turn = boresight.attitude @ rotation(scene.noise(1e-3, 3)) if "boresight" in kinds else np.eye(3)
            observed = here @ attitude @ turn @ rotation(scene.noise(1e-3, 3))
            own = {"boresight": boresight} if "boresight" in kinds else {}
            add(Attitude(photo(row), observed, **scene.spread(np.array([1e-3, 1e-3, 2e-3])), **own))
        if "relative" in kinds and 0 < row < 3:
            before, place = scene.attitudes[row - 1], scene.centres[row - 1]
            moved = before.T @ (centre - place) + scene.noise(0.01, 3)
            turn = before.T @ attitude @ rotation(scene.noise(1e-3, 3))
            sd = np.array([0.01] * 3 + [1e-3] * 3)
            add(Relative(photo(row - 1), photo(row), moved, turn, **scene.spread(sd)))


def _block(scene: _Scene, datum: str, kinds: list[str]) -> Block:
    random = scene.random
    points = scene.positions(scene.points)
    image_sd = 3e-4 * DISTANCE[scene.unit]
    photos, names, images = [], [], []
    for photo in range(PHOTOS):
        u = (scene.points - scene.centres[photo]) @ scene.attitudes[photo]
        xy = scene.cameras[scene.photo_cameras[photo]][0].project(u)
        seen = np.isfinite(xy).all(axis=1) & (u[:, 2] < 0) & (random.random(POINTS) < 0.9)
        photos.append(np.full(seen.sum(), photo))
        names.append(np.flatnonzero(seen))
        images.append(xy[seen])
    xy = np.vstack(images)
    control = datum in DATUMS[:2]
    point_sd = np.full((POINTS, 3), np.inf)
    given = scene.positions(scene.points + scene.noise(0.02, POINTS, 3))
    metres = (
        np.ones(3) if scene.spheroid is None else 1.0 / np.array([scene.spheroid.a, scene.spheroid.a, 1.0])
    )
    if control:
        chosen = random.permutation(POINTS)[:6]
        point_sd[chosen] = 0.01 * metres
        point_sd[chosen[0]] = 0.0
        point_sd[chosen[5], :2] = np.inf
        exact = np.array(chosen[:1])
        given[exact] = points[exact]
        given[chosen[1:]] = scene.positions(scene.points[chosen[1:]] + scene.noise(0.01, 5, 3))
    start = scene.positions(scene.centres + scene.noise(0.05, PHOTOS, 3))
    turned = np.stack([a @ rotation(scene.noise(0.005, 3)) for a in scene.attitudes])
    angles = scene.angles(scene.centres, turned)
    position_sd, attitude_sd = np.full((PHOTOS, 3), np.inf), np.full((PHOTOS, 3), np.inf)
    observed = start.copy(), angles.copy()
    if datum == "control and poses":
        free = PHOTOS - len(scene.mounts)
        for photo in range(free):
            draw = random.random()
            if draw < 0.5:
                position_sd[photo] = 0.03 * metres
                observed[0][photo] = scene.positions(scene.centres[[photo]] + scene.noise(0.03, 1, 3))[0]
            if draw > 0.3:
                attitude_sd[photo] = [2e-3, 1e-3, np.inf] if draw > 0.8 else 2e-3
                noisy = scene.attitudes[photo] @ rotation(scene.noise(1e-3, 3))
                observed[1][photo] = scene.angles(scene.centres[[photo]], noisy[None])[0]
    observations = list(scene.observations)
    if control and "control" in kinds:
        for row in random.permutation(POINTS)[:3]:
            if not np.isfinite(point_sd[row]).any():
                at = scene.positions(scene.points[[row]] + scene.noise(0.01, 1, 3))[0]
                observations.append(Control(f"point {row}", at, **scene.spread(np.array([0.01, 0.01, 0.02]))))
    return Block(
        photo_ids=[f"photo {k}" for k in range(PHOTOS)],
        photo_positions=start,
        photo_attitudes=angles,
        photo_positions_observed=observed[0],
        photo_attitudes_observed=observed[1],
        photo_position_sd=position_sd,
        photo_attitude_sd=attitude_sd,
        cameras=[given_camera for _, given_camera in scene.cameras],
        photo_cameras=scene.photo_cameras,
        point_ids=[f"point {k}" for k in range(POINTS)],
        point_positions=given,
        point_sd=point_sd,
        image_photos=np.concatenate(photos),
        image_points=np.concatenate(names),
        image_xy=xy + scene.noise(image_sd, *xy.shape),
        image_sd=image_sd,
        spheroid=scene.spheroid,
        photo_to_ground=scene.photo_to_ground,
        observations=observations,
        mounts=list(scene.mounts),
    )


def _datum(
    random: np.random.Generator, block: Block, datum: str
) -> InnerConstraints | MinimumConstraints | None:
    if datum not in DATUMS[3:]:
        return None
    if datum == "minimum":
        return MinimumConstraints(photo=f"photo {random.integers(3)}") if random.random() < 0.5 else None
    free = [name for name in block.photo_ids if name not in {mount.photo for mount in block.mounts}]
    points = [str(name) for name in random.permutation(block.point_ids)[: random.integers(4, 12)]]
    photos = [str(name) for name in random.permutation(free)[: random.integers(2, 5)]]
    if datum == "points":
        return InnerConstraints(points=points)
    if datum == "points and photos":
        return InnerConstraints(points=points, photos=photos)
    return InnerConstraints(points=points[:2], photos=photos, attitudes=photos, radius=10.0)
