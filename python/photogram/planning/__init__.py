"""Planning: predicted quality of a network for patterns of control."""

from photogram.planning.pattern import ControlQuality, Pattern, PointQuality, UnknownQuality

__all__ = ["ControlQuality", "Pattern", "PointQuality", "UnknownQuality"]
