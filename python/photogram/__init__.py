"""Photogrammetric least-squares adjustment with the covariance of every result."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from photogram._photocore import __version__
    from photogram.absolute_orientation import Orientation, orient
    from photogram.adjusted import Iteration
    from photogram.adjustment import AsPublished, Progress, adjust
    from photogram.block import Block
    from photogram.errors import AdjustmentError, InputError, OutOfMemoryError, PhotogramError, RankError
    from photogram.geometry import Spheroid
    from photogram.messages import Message
    from photogram.planning import Plan, plan
    from photogram.prediction import predict
    from photogram.refraction import Refraction
    from photogram.resection import Pose, Resection, resect
    from photogram.result import Result
    from photogram.simulation import Simulation, simulate

__all__ = [
    "AdjustmentError",
    "AsPublished",
    "Block",
    "InputError",
    "Iteration",
    "Message",
    "Orientation",
    "OutOfMemoryError",
    "PhotogramError",
    "Plan",
    "Pose",
    "Progress",
    "RankError",
    "Refraction",
    "Resection",
    "Result",
    "Simulation",
    "Spheroid",
    "__version__",
    "adjust",
    "orient",
    "plan",
    "predict",
    "resect",
    "simulate",
]

_HOMES = {
    "AdjustmentError": "errors",
    "AsPublished": "adjustment",
    "Block": "block",
    "InputError": "errors",
    "Iteration": "adjusted",
    "Message": "messages",
    "Orientation": "absolute_orientation",
    "OutOfMemoryError": "errors",
    "PhotogramError": "errors",
    "Plan": "planning",
    "Pose": "resection",
    "Progress": "adjustment",
    "RankError": "errors",
    "Refraction": "refraction",
    "Resection": "resection",
    "Result": "result",
    "Simulation": "simulation",
    "Spheroid": "geometry",
    "__version__": "_photocore",
    "adjust": "adjustment",
    "orient": "absolute_orientation",
    "plan": "planning",
    "predict": "prediction",
    "resect": "resection",
    "simulate": "simulation",
}
"""The module of each name, loaded when it is first asked for.

NumPy and the engine take a while, in which the command line could not yet end cleanly by a signal.
"""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
