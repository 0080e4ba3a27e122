"""A network that permits every hypothesis of the catalogue, and a dense program for it.

The dense program has no factor and no elimination: partials by complex steps, a full matrix of coefficients.
An error of the catalogue displaces parts of the network as some observations see them, such as the points of
the control, so its partials come from the same model.
"""

from __future__ import annotations

import numpy as np

from photogram import Block, Camera, Distance, Position
from photogram.network import Attitude, rotation_matrix

F, CX, CY, WIDTH, HEIGHT = 3600.0, 2010.0, 1480.0, 4000.0, 3000.0
SD = {
    "images": 0.5,
    "control": 0.02,
    "positions": 0.03,
    "attitudes": 1e-4,
    "distances": 0.005,
    "cameras": 5.0,
}
SMALL = 1e-30  # Complex step
VISIBLE = 1e-6  # Least redundancy of an error that the observations show
AXES = np.eye(3)


def turned(angles):
    """Return (n, 3, 3) M = M_kappa M_phi M_omega, ground to photo, of real or complex angles."""
    (so, sp, sk), (co, cp, ck) = np.sin(angles).T, np.cos(angles).T
    rows = [
        [ck * cp, ck * sp * so + sk * co, sk * so - ck * sp * co],
        [-sk * cp, ck * co - sk * sp * so, sk * sp * co + ck * so],
        [sp, -cp * so, cp * co],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def skew(turns):
    """Return (n, 3, 3) matrices of the vector products with (n, 3) vectors."""
    return -np.cross(turns[:, np.newaxis], AXES[np.newaxis])


class Survey:
    """Three strips of photos over hilly ground: observed poses, or `weighted` photos and camera.

    No point has more than `rays` images.
    """

    def __init__(self, *, weighted, photos_per_strip=4, points=30, rays=12):
        rng = np.random.default_rng(5)
        photos = 3 * photos_per_strip
        self.weighted = weighted
        self.strips = np.arange(photos) // photos_per_strip
        x, y = 25.0 * (np.arange(photos) % photos_per_strip), 45.0 * self.strips
        centres = np.column_stack([x, y, 100.0 + 0 * x]) + rng.normal(size=(photos, 3))
        angles = rng.normal(size=(photos, 3)) * 0.05 + [0, 0, np.pi / 2]
        self.poses = np.hstack([centres, angles])
        low, high = [-15, -20, -9], [x.max() + 15, 110, 9]
        self.points = np.column_stack([rng.uniform(*ends, points) for ends in zip(low, high, strict=True)])
        self.cameras = np.tile([F, CX, CY, 0.0 if weighted else -0.05], (1 if weighted else 2, 1))
        self.of_camera = np.zeros(photos, dtype=np.int64) if weighted else np.arange(photos) % 2
        photo, seen = (each.ravel() for each in np.indices((photos, points)))
        rows = {
            "centre": self.poses[photo, :3],
            "angles": self.poses[photo, 3:],
            "point": self.points[seen],
        }
        xy = images({**rows, "camera": self.cameras[self.of_camera[photo]], "shift": 0.0})
        inside = (xy > 0).all(axis=1) & (xy < [WIDTH, HEIGHT]).all(axis=1)
        inside &= np.bincount(seen[inside], minlength=points)[seen] > 1
        earlier = np.cumsum(inside.reshape(photos, points), axis=0).ravel()
        inside &= earlier <= rays
        self.photos, self.seen, self.xy = photo[inside], seen[inside], xy[inside]
        often = np.argsort(-np.bincount(self.seen, minlength=points), kind="stable").tolist()
        self.control = np.sort(often[:7])
        self.ends = [(often[0], often[8]), (often[0], often[9]), (often[8], often[10])]
        self.control_sd = np.where(np.arange(7) % 2, 0.05, SD["control"])
        self.sets = dict(zip(self.control.tolist(), (np.arange(7) % 2).tolist(), strict=True))
        way = np.where(self.strips[:, np.newaxis] % 2, -1, 1) * [25.0, 0.5, 0.1]
        self.velocities = way + rng.normal(size=(photos, 3))

    def block(self, rng):
        """Return a block with noise."""
        noise, points, shape = rng.normal, len(self.points), (len(self.poses), 3)
        centres = self.poses[:, :3] + noise(size=shape) * SD["positions"]
        sd = np.full((points, 3), np.inf)
        places = np.full((points, 3), np.nan)
        sd[self.control] = self.control_sd[:, np.newaxis]
        places[self.control] = self.points[self.control] + noise(size=(7, 3)) * sd[self.control]
        names, ids = [f"i{row}" for row in range(len(self.poses))], [f"p{row}" for row in range(points)]
        photos, observations, parameters = {}, [], {"f": F, "cx": CX, "cy": CY}
        if self.weighted:
            angles = self.poses[:, 3:] + noise(size=shape) * SD["attitudes"]
            photos = {"photo_position_sd": SD["positions"], "photo_attitude_sd": SD["attitudes"]}
            photos |= {"photo_positions_observed": centres, "photo_attitudes_observed": angles}
            parameters["f"] += noise() * SD["cameras"]
        else:
            matrices = rotation_matrix(self.poses[:, 3:]).transpose(0, 2, 1)
            turns = rotation_matrix(noise(size=shape) * SD["attitudes"])
            parameters["k"] = -0.05
            observations = [
                *(Position(*own, SD["positions"]) for own in zip(names, centres, strict=True)),
                *(Attitude(*own, SD["attitudes"]) for own in zip(names, matrices @ turns, strict=True)),
            ]
        lengths = [np.linalg.norm(self.points[i] - self.points[j]) for i, j in self.ends]
        observations += [
            Distance(ids[i], ids[j], length + noise() * SD["distances"], SD["distances"])
            for (i, j), length in zip(self.ends, lengths, strict=True)
        ]
        model, camera_sd = (
            ("simple_pinhole", {"f": SD["cameras"]}) if self.weighted else ("simple_radial", 0.0)
        )
        return Block(
            photo_ids=names,
            photo_positions=self.poses[:, :3],
            photo_attitudes=self.poses[:, 3:],
            point_ids=ids,
            point_positions=places,
            point_sd=sd,
            image_photos=self.photos,
            image_points=self.seen,
            image_xy=self.xy + noise(size=self.xy.shape) * SD["images"],
            image_sd=SD["images"],
            cameras=[Camera(model, parameters, sd=camera_sd) for _ in self.cameras],
            photo_cameras=self.of_camera,
            observations=observations,
            **photos,
        )

    def facts(self, block, **changes):
        """Return the facts of the core beside the network."""
        observed = [each.position for each in block.observations if isinstance(each, Position)]
        return {
            "velocities": self.velocities,
            "times": np.arange(float(len(self.poses))).tolist(),
            "observed": block.photo_positions_observed if self.weighted else np.array(observed),
            "position_sets": self.strips.tolist(),
            "control_sets": [self.sets.get(point) for point in range(len(self.points))],
            "readouts": [[[0.0, 1 / HEIGHT, -0.5], [1 / WIDTH, 0.0, -0.5]] for _ in self.cameras],
            "widths": [WIDTH for _ in self.cameras],
            "photos": [0, 5],
            "checks": [],
            "centre": [40.0, 45.0, 0.0],
            "estimated": None,
            "detection": (0.001, 0.8),
            "limit": 4.0,
            "effects": 100,
        } | changes


def images(rows):
    """Return (n, 2) pixels of rows of the network: centre, angles, point, camera, shift of images."""
    u = np.einsum("nij,nj->ni", turned(rows["angles"]), rows["point"] - rows["centre"])
    a, b = -u[:, 0] / u[:, 2], -u[:, 1] / u[:, 2]
    f, cx, cy, k = rows["camera"].T
    g = f * (1 + k * (a**2 + b**2))
    return np.column_stack([cx + g * a, cy - g * b]) + rows["shift"]


def attitudes(rows):
    """Return (n, 3) rotations of photos relative to observed attitudes, about the axes of the photo."""
    own = turned(rows["angles"]).transpose(0, 2, 1) @ (AXES + skew(rows["turn"]))
    own = np.einsum("nji,njk->nik", rows["observed"], own)
    turns = np.column_stack([own[:, i, j] - own[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))]) / 2
    return turns + rows["shift"]


def angles(rows):
    """Return (n, 3) omega, phi, kappa of the photos after a rotation about their axes."""
    own = turned(rows["angles"]).transpose(0, 2, 1) @ (AXES + skew(rows["turn"]))
    omega, phi = np.arctan(-own[:, 1, 2] / own[:, 2, 2]), np.arcsin(own[:, 0, 2])
    kappa = np.pi / 2 - np.arctan(-own[:, 0, 0] / own[:, 0, 1])  # Near pi / 2
    return np.column_stack([omega, phi, kappa]) + rows["shift"]


def distances(rows):
    """Return (n, 1) lengths between rows of points."""
    between = rows["second"] - rows["first"]
    return np.sqrt((between**2).sum(axis=1, keepdims=True)) + rows["shift"]


MODELS = {
    "images": images,
    "control": lambda rows: rows["point"] + rows["shift"],
    "positions": lambda rows: rows["centre"] + rows["shift"],
    "attitudes": attitudes,
    "angles": angles,
    "distances": distances,
    "cameras": lambda rows: rows["camera"][:, :1] + rows["shift"],
}


class Dense:
    """The dense program, at the adjusted values of a result."""

    def __init__(self, survey, block, result):
        self.survey, self.block = survey, block
        self.matrices = np.array([each.attitude for each in block.observations if isinstance(each, Attitude)])
        self.state = {
            "poses": np.hstack([result.photo_positions, result.photo_attitudes]),
            "points": np.where(result.used_points[:, np.newaxis], result.point_positions, survey.points),
            "cameras": survey.cameras.copy(),
        }
        if survey.weighted:
            self.state["cameras"][:, 0] = result.cameras[0].camera.parameters["f"]
        self.observed, self.sd = self._observations()
        self.rows = self._rows(self.state)
        self.starts = np.cumsum([0, *(self.sd[group].size for group in self.sd)])
        columns = [("poses", range(6)), ("points", range(3))]
        columns += [("cameras", range(1))] if survey.weighted else []
        seen = set(survey.seen.tolist())
        self.unknowns = [
            (name, row, k)
            for name, range_ in columns
            for row in range(len(self.state[name]))
            for k in range_
            if name != "points" or row in seen
        ]
        self.a = np.column_stack([self._by_unknown(*own) for own in self.unknowns])
        self.q = np.linalg.inv(self.a.T @ self.a)
        computed = self._weighted(self.rows)
        observed = np.concatenate([(self.observed[group] / self.sd[group]).ravel() for group in self.sd])
        self.v = observed - computed.real
        self.point_sd = self._by_point(np.sqrt(np.diag(self.q)), np.inf)
        # A step of the solution of these partials is zero at the adjusted values.
        self.step = self.q @ self.a.T @ self.v / np.sqrt(np.diag(self.q))

    def _observations(self):
        survey, block = self.survey, self.block
        observed = {"images": block.image_xy, "control": block.point_positions[survey.control]}
        if survey.weighted:
            observed |= {
                "positions": block.photo_positions_observed,
                "angles": block.photo_attitudes_observed,
            }
            observed["cameras"] = np.array([[block.cameras[0].parameters["f"]]])
        else:
            observed |= {
                "positions": survey.facts(block)["observed"],
                "attitudes": np.zeros((len(survey.poses), 3)),
            }
        lengths = [each.length for each in block.observations if isinstance(each, Distance)]
        observed["distances"] = np.array(lengths)[:, np.newaxis]
        sd = {
            group: np.full(values.shape, SD.get(group, SD["attitudes"])) for group, values in observed.items()
        }
        sd["control"] = np.repeat(survey.control_sd[:, np.newaxis], 3, axis=1)
        return observed, sd

    def _rows(self, state):
        """Return what each row of observations sees of the network."""
        survey, poses, points = self.survey, state["poses"], state["points"]
        photos, (first, second) = survey.photos, np.array(survey.ends).T
        rows = {
            "images": {
                "centre": poses[photos, :3],
                "angles": poses[photos, 3:],
                "point": points[survey.seen],
                "camera": state["cameras"][survey.of_camera[photos]],
            },
            "control": {"point": points[survey.control]},
            "positions": {"centre": poses[:, :3]},
            "attitudes": {
                "angles": poses[:, 3:],
                "observed": self.matrices,
                "turn": np.zeros((len(poses), 3)),
            },
            "angles": {"angles": poses[:, 3:], "turn": np.zeros((len(poses), 3))},
            "distances": {"first": points[first], "second": points[second]},
            "cameras": {"camera": state["cameras"]},
        }
        return {group: {**rows[group], "shift": np.zeros(self.observed[group].shape)} for group in self.sd}

    def _weighted(self, rows):
        return np.concatenate([(MODELS[group](own) / self.sd[group]).ravel() for group, own in rows.items()])

    def _by_unknown(self, name, row, k):
        state = {key: values.astype(complex) for key, values in self.state.items()}
        state[name][row, k] += 1j * SMALL
        return self._weighted(self._rows(state)).imag / SMALL

    def column(self, error):
        """Return the partials of the observations by an error: displacements of what groups of them see."""
        rows = {group: dict(own) for group, own in self.rows.items()}
        for group, changes in error.items():
            for name, change in changes.items():
                rows[group][name] = rows[group][name] + 1j * SMALL * change
        return self._weighted(rows).imag / SMALL

    def tested(self, errors):
        """Return the test and the internal reliability of a hypothesis whose parameters are these errors."""
        c = np.column_stack([self.column(own) for own in errors])
        residual = c - self.a @ (self.q @ (self.a.T @ c))  # Q_vv P C
        score, redundancy, squares = c.T @ self.v, c.T @ residual, c.T @ c
        root = np.linalg.inv(np.linalg.cholesky(squares))
        values, vectors = np.linalg.eigh(root @ redundancy @ root.T)
        directions = root.T @ vectors
        seen = values > VISIBLE
        cofactors = (directions[:, seen] / values[seen]) @ directions[:, seen].T
        direction = directions[:, 0] * np.sign(directions[np.abs(directions[:, 0]).argmax(), 0])
        return {
            "rank": np.count_nonzero(seen),
            "cofactors": cofactors,
            "T": score @ cofactors @ score,
            "estimate": cofactors @ score,
            "r": values[0],
            "direction": direction / np.sqrt(values[0]) if seen.all() else None,  # d^T R d = 1
            "c": c,
        }

    def effect(self, change):
        """Return the changes of the points by one of the observations, and its bias-to-noise ratio."""
        right = self.a.T @ change
        dx = self.q @ right
        return self._by_point(dx, 0.0), float(np.sqrt(right @ dx))

    def _by_point(self, values, missing):
        points = np.full(self.state["points"].shape, missing)
        for value, (name, row, k) in zip(values, self.unknowns, strict=True):
            if name == "points":
                points[row, k] = value
        return points
