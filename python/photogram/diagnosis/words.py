"""What a program calls the things that a check speaks of."""

from __future__ import annotations

from photogram.arguments.types import Bools

__all__ = ["Words", "small_unit"]


def small_unit(unit: str) -> tuple[str, float]:
    """Return the unit in which errors of images are told, and how many of it a unit of images has."""
    return ("um", 1000.0) if unit == "mm" else (unit, 1.0)


class Words:
    """Words for any block; a program with words of its own has a class above this one.

    Attributes
    ----------
    sense
        What tells the sense of the angles.
    order
        What gives the order of the photos.
    usual_um
        Between which standard deviations of image coordinates are usual, micrometres; None where nothing is.
    bandwidth
        Whether the bandwidths of the normal equations in that order are of interest.
    iterations
        Whether every iteration is one of the key numbers, as in Appendix H of the guide.
    """

    sense: str = "`photo_to_ground`"
    order: str = "the photos"
    usual_um: tuple[float, float] | None = None
    bandwidth: bool = False
    iterations: bool = False

    def unhold(self, kept: Bools) -> str:
        """Return what is done about a control point of which only some components are to be held."""
        axes = [name for name, held in zip(("first", "second", "third"), kept.tolist(), strict=True) if held]
        if not axes:
            return "hold nothing of it"
        return f"hold its {' and '.join(axes)} coordinate{'s' if len(axes) > 1 else ''} only"

    def values(self, kept: Bools) -> dict[str, float]:
        """Return further figures of such a finding."""
        del kept
        return {}
