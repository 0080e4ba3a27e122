"""Files of GIANT (Elassal and Malhotra, NOAA 1987)."""

from photogram.arguments.annotations import attach_checked

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Camera", "Common", "Frame", "GroundPoint", "Limits"}
)
