"""What the stars do not determine, by name (errors 2 and 4 of NOAA TR NOS 55)."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from photogram.errors import AdjustmentError
from photogram.messages import listed
from photogram.stellar.parameters import NAMES

if TYPE_CHECKING:
    from photogram import _photocore
    from photogram.stellar.problem import Problem

__all__ = ["failure", "singular"]


def singular(parameters: Iterable[int]) -> AdjustmentError:
    """Return error 4 of the report, with the names of the parameters."""
    names = ", ".join(NAMES[i] for i in parameters)
    return AdjustmentError(
        f"ERROR 4: no inverse for the reduced normal equations: the stars do not determine {names}"
    )


def failure(problem: Problem, error: _photocore.StellarError) -> AdjustmentError:
    """Say which stars or parameters of a problem an error of the core tells of."""
    kind, message, indices = error.args
    if kind == "undetermined":
        return singular(indices)
    stars = [problem.star_ids[i] for i in indices]
    if kind == "undetermined stars":
        return AdjustmentError(f"ERROR 2: no inverse for the submatrix of star {', '.join(stars)}")
    if kind == "not finite":
        return AdjustmentError(f"below the horizon or behind the camera: star {listed(stars)}")
    return AdjustmentError(message)
