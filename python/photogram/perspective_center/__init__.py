"""Perspective centre of a projector (USGS Computer Contribution 2, 1969)."""

from photogram.perspective_center.deck import Run, Stop, read_deck, run_deck
from photogram.perspective_center.grid import Coordinatograph, Grid, joined, reduce
from photogram.perspective_center.solution import Cycle, PerspectiveCenter, determine

__all__ = [
    "Coordinatograph",
    "Cycle",
    "Grid",
    "PerspectiveCenter",
    "Run",
    "Stop",
    "determine",
    "joined",
    "read_deck",
    "reduce",
    "run_deck",
]
