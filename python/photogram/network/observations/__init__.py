"""Observations beside images: distances, heights, surfaces, positions and attitudes of photos, control.

Each kind is a class with names of points or photos, perhaps unknowns that it has in common with others
(:mod:`photogram.network.unknowns`), what was observed, and its standard deviations `sd` or, where components
are correlated, their covariance matrix `covariance`. Residuals are observed minus computed.
"""

from photogram.network.observations.attitude import Attitude
from photogram.network.observations.base import Base
from photogram.network.observations.control import Control
from photogram.network.observations.difference import Difference
from photogram.network.observations.distance import Distance
from photogram.network.observations.equal_height import EqualHeight
from photogram.network.observations.fiducial import FILM, Fiducial, KnownFilm, KnownTogether
from photogram.network.observations.observation import (
    Observation,
    all_trajectories,
    moments,
    observation_rows,
    of_records,
)
from photogram.network.observations.on_level import OnLevel
from photogram.network.observations.on_line import OnLine, OnPlumbLine
from photogram.network.observations.on_plane import OnPlane
from photogram.network.observations.position import Position
from photogram.network.observations.prior import Prior
from photogram.network.observations.rate import Rate
from photogram.network.observations.relative import Relative
from photogram.network.observations.smoothness import Smoothness
from photogram.network.observations.velocity import Velocity

__all__ = [
    "FILM",
    "Attitude",
    "Base",
    "Control",
    "Difference",
    "Distance",
    "EqualHeight",
    "Fiducial",
    "KnownFilm",
    "KnownTogether",
    "Observation",
    "OnLevel",
    "OnLine",
    "OnPlane",
    "OnPlumbLine",
    "Position",
    "Prior",
    "Rate",
    "Relative",
    "Smoothness",
    "Velocity",
    "all_trajectories",
    "moments",
    "observation_rows",
    "of_records",
]
