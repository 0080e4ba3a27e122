"""Film and plates: certificates of their cameras, what years make of these, interior orientations."""

from photogram.arguments.on_demand import attach_checked

__getattr__, __dir__, __all__ = attach_checked(__name__, __file__)
