"""Planning: what a network promises before it is flown, for several patterns of control side by side."""

from photogram.planning.pattern import ControlQuality, MotionQuality, Pattern, PhotoQuality, PointQuality

__all__ = ["ControlQuality", "MotionQuality", "Pattern", "PhotoQuality", "PointQuality"]
