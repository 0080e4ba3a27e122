"""Simulated models: stations of every kind, with their truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from photogram.absolute_orientation import Similarity, Stations

FULL, HORIZONTAL, HEIGHT = "XYZ", "XY", "Z"
MIXED = (FULL, HORIZONTAL, HEIGHT, HEIGHT, HORIZONTAL, HEIGHT, FULL, HEIGHT)
SIZE = np.array([1000.0, 800.0, 200.0])


@dataclass(frozen=True, eq=False)
class Model:
    """A model without errors, and what of its control is known."""

    truth: Similarity
    ground: np.ndarray
    kinds: tuple[str, ...]

    @property
    def known(self) -> np.ndarray:
        """(n, 3) which control coordinates are known."""
        return np.array([[axis in kind for axis in "XYZ"] for kind in self.kinds])

    @property
    def exact(self) -> np.ndarray:
        """(n, 3) model coordinates."""
        return self.truth.to_model(self.ground)

    def stations(self, control_error: Any = 0.0, model_error: Any = 0.0, **options: Any) -> Stations:
        """Make stations with errors."""
        control = np.where(self.known, self.ground + control_error, np.nan)
        return Stations(range(len(self.kinds)), control, self.exact + model_error, **options)


def simulate(
    generator: np.random.Generator, kinds: tuple[str, ...] = MIXED, *, angles: Any = None, scale: float = 0.2
) -> Model:
    """Simulate a model at any attitude, or that of given angles."""
    if angles is None:
        rotation = Rotation.random(random_state=generator).as_matrix()
    else:
        omega, phi, kappa = angles
        # scipy's rotations turn vectors, the bulletin's turn axes.
        rotation = Rotation.from_euler("xyz", [-omega, -phi, -kappa]).as_matrix()
    ground = generator.uniform(-0.5, 0.5, (len(kinds), 3)) * SIZE
    translation = 100 * scale * generator.standard_normal(3)
    return Model(Similarity.from_parameters(scale, rotation, translation), ground, kinds)
