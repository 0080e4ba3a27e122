"""Absolute orientation of a model (C&GS Technical Bulletin 19, 1962)."""

from photogram.absolute_orientation.models import Model, Strip, relative_model, strip_of
from photogram.absolute_orientation.similarity import Similarity, read_similarity
from photogram.absolute_orientation.stations import Stations, read_cards, read_csv
from photogram.absolute_orientation.stream import transform_file

__all__ = [
    "Model",
    "Similarity",
    "Stations",
    "Strip",
    "read_cards",
    "read_csv",
    "read_similarity",
    "relative_model",
    "strip_of",
    "transform_file",
]
