"""Photogrammetric least-squares adjustment with the covariance of every result."""

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
