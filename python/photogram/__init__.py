"""Photogrammetric least-squares adjustment with the covariance of every result."""

from __future__ import annotations

from typing import TYPE_CHECKING

from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram import absolute_orientation as absolute_orientation
    from photogram import collection as collection
    from photogram import comparator as comparator
    from photogram import diagnosis as diagnosis
    from photogram import distributed as distributed
    from photogram import film as film
    from photogram import formats as formats
    from photogram import giant as giant
    from photogram import network as network
    from photogram import perspective_center as perspective_center
    from photogram import planning as planning
    from photogram import plots as plots
    from photogram import results as results
    from photogram import statistics as statistics
    from photogram import stellar as stellar
    from photogram import targets as targets
    from photogram._photocore import __version__
    from photogram.absolute_orientation.adjust import orient
    from photogram.absolute_orientation.orientation import Orientation
    from photogram.adjustment.adjustment import AsPublished, Progress, adjust
    from photogram.adjustment.cleaning import Cleaned, clean
    from photogram.adjustment.components import variance_components
    from photogram.adjustment.elimination import eliminate_terms
    from photogram.adjustment.first_values import FirstValues, first_values
    from photogram.adjustment.prediction import predict
    from photogram.adjustment.reconsidered import adjust_started
    from photogram.adjustment.resection import Pose, Resection, resect
    from photogram.adjustment.snooping import snoop
    from photogram.adjustment.variance_function import variance_function
    from photogram.diagnosis.diagnose import diagnose
    from photogram.distributed.adjust import adjust_in_parts
    from photogram.errors import AdjustmentError, InputError, OutOfMemoryError, PhotogramError, RankError
    from photogram.formats.results import read_result
    from photogram.messages import Message
    from photogram.network.attitudes import Attitudes
    from photogram.network.block import Block
    from photogram.network.cameras import Camera
    from photogram.network.datum import InnerConstraints, MinimumConstraints
    from photogram.network.geometry import Spheroid
    from photogram.network.observations import Distance, Position
    from photogram.network.refraction import Refraction
    from photogram.network.simulation import Simulation, simulate
    from photogram.network.unknowns import LeverArm
    from photogram.planning.networks import Plan, plan
    from photogram.results.components import VarianceComponents
    from photogram.results.differences import Differences, differences
    from photogram.results.features import Feature, Features
    from photogram.results.fitting import features
    from photogram.results.group_sums import GroupSums, group_sums
    from photogram.results.iteration import Iteration
    from photogram.results.model_tests import compare, score_test, terms_test
    from photogram.results.result import Result
    from photogram.results.snooping_result import Snooped
    from photogram.results.statement.statement import Statement, statement
    from photogram.results.variance_function import VarianceFunction
    from photogram.stellar.cameras import camera_from

__all__ = [
    "AdjustmentError",
    "AsPublished",
    "Attitudes",
    "Block",
    "Camera",
    "Cleaned",
    "Differences",
    "Distance",
    "Feature",
    "Features",
    "FirstValues",
    "GroupSums",
    "InnerConstraints",
    "InputError",
    "Iteration",
    "LeverArm",
    "Message",
    "MinimumConstraints",
    "Orientation",
    "OutOfMemoryError",
    "PhotogramError",
    "Plan",
    "Pose",
    "Position",
    "Progress",
    "RankError",
    "Refraction",
    "Resection",
    "Result",
    "Simulation",
    "Snooped",
    "Spheroid",
    "Statement",
    "VarianceComponents",
    "VarianceFunction",
    "__version__",
    "adjust",
    "adjust_in_parts",
    "adjust_started",
    "camera_from",
    "clean",
    "compare",
    "diagnose",
    "differences",
    "eliminate_terms",
    "features",
    "first_values",
    "group_sums",
    "orient",
    "plan",
    "predict",
    "read_result",
    "resect",
    "score_test",
    "simulate",
    "snoop",
    "statement",
    "terms_test",
    "variance_components",
    "variance_function",
]

_HOMES = {
    "AdjustmentError": "errors",
    "AsPublished": "adjustment.adjustment",
    "Attitudes": "network.attitudes",
    "Block": "network.block",
    "Camera": "network.cameras",
    "VarianceComponents": "results.components",
    "VarianceFunction": "results.variance_function",
    "Differences": "results.differences",
    "Distance": "network.observations",
    "Feature": "results.features",
    "Features": "results.features",
    "FirstValues": "adjustment.first_values",
    "GroupSums": "results.group_sums",
    "InnerConstraints": "network.datum",
    "InputError": "errors",
    "Iteration": "results.iteration",
    "LeverArm": "network.unknowns",
    "Message": "messages",
    "MinimumConstraints": "network.datum",
    "Orientation": "absolute_orientation.orientation",
    "OutOfMemoryError": "errors",
    "PhotogramError": "errors",
    "Plan": "planning.networks",
    "Pose": "adjustment.resection",
    "Position": "network.observations",
    "Progress": "adjustment.adjustment",
    "RankError": "errors",
    "Refraction": "network.refraction",
    "Resection": "adjustment.resection",
    "Result": "results.result",
    "Simulation": "network.simulation",
    "Snooped": "results.snooping_result",
    "Statement": "results.statement.statement",
    "statement": "results.statement.statement",
    "Spheroid": "network.geometry",
    "__version__": "_photocore",
    "adjust": "adjustment.adjustment",
    "adjust_in_parts": "distributed.adjust",
    "adjust_started": "adjustment.reconsidered",
    "camera_from": "stellar.cameras",
    "Cleaned": "adjustment.cleaning",
    "clean": "adjustment.cleaning",
    "compare": "results.model_tests",
    "diagnose": "diagnosis.diagnose",
    "differences": "results.differences",
    "eliminate_terms": "adjustment.elimination",
    "features": "results.fitting",
    "score_test": "results.model_tests",
    "terms_test": "results.model_tests",
    "first_values": "adjustment.first_values",
    "group_sums": "results.group_sums",
    "orient": "absolute_orientation.adjust",
    "plan": "planning.networks",
    "predict": "adjustment.prediction",
    "read_result": "formats.results",
    "resect": "adjustment.resection",
    "simulate": "network.simulation",
    "snoop": "adjustment.snooping",
    "variance_components": "adjustment.components",
    "variance_function": "adjustment.variance_function",
}
"""The module of each name, loaded when it is first asked for.

NumPy and the engine take a while, in which the command line could not yet end cleanly by a signal.
"""

MODULES = (
    "absolute_orientation",
    "collection",
    "comparator",
    "diagnosis",
    "distributed",
    "film",
    "formats",
    "giant",
    "network",
    "perspective_center",
    "planning",
    "plots",
    "results",
    "statistics",
    "stellar",
    "targets",
)
"""The packages that users know by name: loaded when they are first asked for, too."""

__getattr__, __dir__ = on_demand(__name__, {**_HOMES, **dict.fromkeys(MODULES, "")})
