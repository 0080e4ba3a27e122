from typing import Literal, TypedDict

from photogram.adjustment.options import AsPublished, DatumName, Ordering, UnitVariance
from photogram.adjustment.robust import Loss
from photogram.network.datum import InnerConstraints, MinimumConstraints
from photogram.results.snooping_options import UnitWeight

class AdjustKeywords(TypedDict, total=False):
    """Fields of `AdjustOptions` as keywords of functions."""

    datum: DatumName | InnerConstraints | MinimumConstraints | None
    unit_variance: UnitVariance
    loss: Loss | None
    covariance: bool | Literal["verdict"]
    tolerance: float | AsPublished
    max_iterations: int | None
    ordering: Ordering
    max_bias_ratio: float | None

class SnoopKeywords(AdjustKeywords, total=False):
    """Fields of `SnoopOptions` as keywords of functions."""

    level: float
    fdr: float | None
    unit_weight: UnitWeight
    robust: bool | None
    parts: bool
    max_rounds: int
