"""Collections of photos of unknown cameras: bundle adjustment "in the large"."""

from photogram.collection.adjust import adjust
from photogram.collection.collection import Collection
from photogram.collection.formats import read, to_bytes
from photogram.collection.parameters import PARAMETERS
from photogram.collection.result import AdjustedCollection
from photogram.collection.simulation import Simulation, simulate, simulate_turntable

__all__ = [
    "PARAMETERS",
    "AdjustedCollection",
    "Collection",
    "Simulation",
    "adjust",
    "read",
    "simulate",
    "simulate_turntable",
    "to_bytes",
]
