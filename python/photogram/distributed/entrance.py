"""Where `photogram.adjust` finds how to adjust in parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from photogram.adjustment.adjustment import UnitVariance
from photogram.adjustment.elsewhere import Division
from photogram.adjustment.started import started
from photogram.network.block import Block, checked
from photogram.network.core import CoreOptions
from photogram.results.result import Result

if TYPE_CHECKING:
    from photogram.distributed.planned import PartsPlan

__all__ = ["adjusted_in_parts", "plan_in_parts"]


def plan_in_parts(
    block: Block,
    division: Division,
    *,
    unit_variance: UnitVariance = "constrained",
    tolerance: float = 1e-5,
) -> PartsPlan:
    """Plan the adjustment of a block in parts: what it takes, before anything is adjusted.

    The parts are written; in the folder of the run, where the division has one, they wait for the adjustment.

    Parameters
    ----------
    block, unit_variance, tolerance
        As of :func:`photogram.adjust`.
    division
        Cluster, workers, parts, memory and folder.

    Raises
    ------
    InputError, AdjustmentError
        As of :func:`photogram.adjust`.
    """
    from photogram.distributed.running import planned

    options = CoreOptions("fraction", tolerance, 50, True, None, "auto", unit_variance, None)
    return planned(started(checked(block)), options, division)


def adjusted_in_parts(
    block: Block,
    options: CoreOptions,
    division: Division,
    threads: int | None,
    progress: Callable[[Any], None] | None,
) -> Result | None:
    """Load what does it when it is asked for: nobody else waits for it."""
    from photogram.distributed import running

    return running.adjusted_in_parts(block, options, division, threads, progress)
