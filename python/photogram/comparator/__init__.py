"""Complete calibration of a measuring comparator from a grid plate (Fritz, NOAA TR NOS 57, 1973).

session = comparator.read(["measurements.csv"])[0]
calibration = comparator.calibrate(session)
calibration.correction.apply(xy_um)
"""

from typing import TYPE_CHECKING

from photogram.arguments.annotations import check_arguments
from photogram.comparator.calibration import Calibration, CaseResult, PlateResult, Pointing, calibrate
from photogram.comparator.cards import read_cards, to_cards
from photogram.comparator.correction import Correction, Identity
from photogram.comparator.document import to_json
from photogram.comparator.fits import Decomposition
from photogram.comparator.grid import Grid, built_in_grid, find_grid, read_grid
from photogram.comparator.listing import listing
from photogram.comparator.measurements import read, read_csv, to_csv
from photogram.comparator.options import Options
from photogram.comparator.polynomial import Frame, Polynomial
from photogram.comparator.readings import Case, Reading, Session, collect_cases
from photogram.comparator.simulation import Simulation, simulate_calibration
from photogram.comparator.years import Comparison, RecordedCalibration, RecordedCase, compare
from photogram.io.places import Place
from photogram.on_demand import on_demand

if TYPE_CHECKING:
    from photogram.comparator import pictures as pictures

__all__ = [
    "Calibration",
    "Case",
    "CaseResult",
    "Comparison",
    "Correction",
    "Decomposition",
    "Frame",
    "Grid",
    "Identity",
    "Options",
    "Place",
    "PlateResult",
    "Pointing",
    "Polynomial",
    "Reading",
    "RecordedCalibration",
    "RecordedCase",
    "Session",
    "Simulation",
    "built_in_grid",
    "calibrate",
    "collect_cases",
    "compare",
    "find_grid",
    "listing",
    "read",
    "read_cards",
    "read_csv",
    "read_grid",
    "simulate_calibration",
    "to_cards",
    "to_csv",
    "to_json",
]

check_arguments(
    globals(),
    set(__all__)
    - {
        "Calibration",
        "Case",
        "CaseResult",
        "Comparison",
        "Decomposition",
        "Identity",
        "Place",
        "PlateResult",
        "Pointing",
        "Reading",
        "RecordedCalibration",
        "RecordedCase",
        "Session",
        "Simulation",
        "collect_cases",
    },
)

WAYS = {"findings_of": ("tables",), "page_of": ("page",)}
"""The files that show a result, by the names of the ways: see `photogram.show.methods`."""

MODULES = ("pictures",)
"""The package that users know by name: loaded when it is first asked for."""

__getattr__, __dir__ = on_demand(__name__, dict.fromkeys(MODULES, ""))
