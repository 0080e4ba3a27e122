"""Planning: what a network promises before it is flown, for several patterns of control side by side."""

from photogram.planning.pattern import Pattern
from photogram.planning.statistics import ControlQuality, MotionQuality, PhotoQuality, PointQuality

__all__ = ["ControlQuality", "MotionQuality", "Pattern", "PhotoQuality", "PointQuality"]
