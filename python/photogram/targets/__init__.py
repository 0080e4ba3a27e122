"""Calibration with targets: boards, their corners in pictures, and what these say of cameras and rigs."""

from photogram.arguments.on_demand import attach_checked

WAYS = {
    "findings_of": ("findings",),
}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

__getattr__, __dir__, __all__ = attach_checked(
    __name__, __file__, given={"Board", "Calibration", "Candidate", "Corners", "WorthOptions"}
)
