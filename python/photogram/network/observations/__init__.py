"""Additional observations: distances, heights, surfaces, positions and attitudes of photos, control.

Each type is a class with names of points or photos, shared unknowns (:mod:`photogram.network.unknowns`),
observed values, and their standard deviations `sd` or covariance matrix `covariance`. Residuals are observed
minus computed.
"""

from photogram.network.observations.columns import Observations, all_trajectories, moments, of_records
from photogram.network.observations.observation import Observation
from photogram.network.observations.photos import Attitude, Position, Range, Rate, Relative, Velocity
from photogram.network.observations.points import (
    Control,
    Difference,
    Distance,
    EqualHeight,
    OnLevel,
    OnLine,
    OnPlane,
    OnPlumbLine,
)
from photogram.network.observations.unknowns import (
    FILM,
    Base,
    Fiducial,
    KnownFilm,
    KnownTogether,
    Prior,
    Smoothness,
)

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
    "Observations",
    "OnLevel",
    "OnLine",
    "OnPlane",
    "OnPlumbLine",
    "Position",
    "Prior",
    "Range",
    "Rate",
    "Relative",
    "Smoothness",
    "Velocity",
    "all_trajectories",
    "moments",
    "of_records",
]
