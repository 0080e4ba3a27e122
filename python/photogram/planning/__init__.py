"""Planning: what a network promises before it is flown, for several patterns of control side by side."""

from photogram.planning.pattern import Pattern
from photogram.planning.statistics import ControlQuality, MotionQuality, PhotoQuality, PointQuality

__all__ = ["ControlQuality", "MotionQuality", "Pattern", "PhotoQuality", "PointQuality"]

WAYS = {"page_of": ("page",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""
