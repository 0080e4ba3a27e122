"""Planning: predicted quality of a network for patterns of control."""

from photogram.planning.pattern import ControlQuality, MotionQuality, Pattern, PhotoQuality, PointQuality

__all__ = ["ControlQuality", "MotionQuality", "Pattern", "PhotoQuality", "PointQuality"]
