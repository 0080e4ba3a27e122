"""What the verdict on a calibration rests on: its block, how the board was shown, what other views say."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from typing import TYPE_CHECKING

from photogram.network.knots import KNOTTED
from photogram.results.findings import block_findings
from photogram.results.snooping_result import Snooped
from photogram.show.methods import findings_of
from photogram.statistics.findings import Findings, Systematic
from photogram.statistics.verdict import LARGEST_FACTOR, verdict
from photogram.targets.calibration_result import Calibrated, UnknownWeight, deviation_of_corners
from photogram.targets.coverage import showings
from photogram.targets.difference_test import EXPLAINED
from photogram.targets.first_camera import WIDEST, from_axis

if TYPE_CHECKING:
    from photogram.targets.appraisal_report import Worth
    from photogram.targets.cross_validation import CrossValidation

__all__ = ["findings", "judged"]

FREER = {"opencv8": 12, "opencv12": 16, KNOTTED: 10**6}
"""Lenses, and how many parameters of them are free."""


@findings_of.register(UnknownWeight)
def findings(result: UnknownWeight) -> Findings:
    """Return the tests of a block whose standard deviations of corners are ratios alone."""
    untested = "nobody has said how well corners are measured: --sd images=0.3"
    return replace(block_findings(result), untested=untested)


def judged(calibrated: Calibrated, worth: Worth | None = None) -> Calibrated:
    """Return a calibration whose parts all have the verdict on it as a calibration.

    Parameters
    ----------
    calibrated
        As adjusted.
    worth
        What it is worth, where that is known.
    """
    own = verdict(_findings(calibrated, worth))
    result, snooped = copy(calibrated.result), calibrated.snooped
    vars(result)["verdict"] = own
    if snooped is not None:
        snooped = copy(snooped)
        vars(snooped).pop("judged", None)
        vars(snooped)["verdict"] = own
    return replace(calibrated, result=result, snooped=snooped, worth=worth)


def _findings(calibrated: Calibrated, worth: Worth | None) -> Findings:
    """Return the tests of the block, with what is said of calibrations in the place of control."""
    judge: Snooped | object = calibrated.snooped or calibrated.result
    found = findings_of(judge)
    shown = showings(calibrated)
    cross = () if worth is None else worth.cross
    wrong = [_systematic(each) for each in cross if not each.explained]
    stiff = bool(wrong) or any(each.significant for each in found.systematic)
    other = _other_model(calibrated) if stiff else []
    unknown = [_deviation_asked(calibrated)] if isinstance(calibrated.result, UnknownWeight) else []
    missing = [line for each in shown for line in each.next]
    agreeing = [f"{', '.join(each.cameras)}: {each.verdict}" for each in cross if each.explained]
    return replace(
        found,
        systematic=[*found.systematic, *wrong],
        remarks=[*(each.sentence for each in shown), *agreeing, *found.remarks],
        weigh="--shape points",
        calibrate="",
        if_usable=[*unknown, *other, *missing],
        if_withheld=[*unknown, *other, *missing],
    )


def _other_model(calibrated: Calibrated) -> list[str]:
    """Return what to try where the model is too stiff: lenses with more freedom, and a board with more."""
    corners = calibrated.calibration.corners
    free, wide = 0, False
    for number, each in enumerate(calibrated.cameras):
        free = max(free, len(each.estimated) if each.camera.knots is None else FREER[KNOTTED])
        seen = corners.xy[corners.use & (corners.cameras[corners.picture] == number)]
        wide = wide or (bool(len(seen)) and from_axis(each.camera, seen) >= WIDEST)
    lenses = [f"`{name}`" for name, count in FREER.items() if count > free and (name == KNOTTED or not wide)]
    tried = []
    if lenses:
        named = " or ".join(filter(None, (", ".join(lenses[:-1]), lenses[-1])))
        tried.append(f"a lens with more freedom, `--model {named[1:]}")
    if calibrated.calibration.shape != "points":
        tried.append("a board whose points are unknowns, `--shape points`")
    return [f"Try {', or '.join(tried)}: cross-validation says whether it is better."] if tried else []


def _deviation_asked(calibrated: Calibrated) -> str:
    """Ask for the standard deviation of corners, and say which one their residuals have."""
    sd = calibrated.calibration.assumed * deviation_of_corners(calibrated.result)
    return (
        f"Say how well corners are measured: their residuals are those of `--sd images={sd:.2g}`. Until then"
        " what is known of the board is weighed against these, and nothing tests them."
    )


def _systematic(cross: CrossValidation) -> Systematic:
    """Return the test that rejects: of the split that agrees least."""
    test = min((each[-1] for each in cross.tests), key=lambda each: each.probability)
    names = ", ".join(cross.cameras)
    return Systematic(
        name=f"cross-validation of {names}",
        sentence=f"{names}: {cross.verdict}",
        statistic="chi2",
        distribution="chi2",
        dof=(float(test.dof),),
        value=test.chi2,
        probability=test.probability,
        level=EXPLAINED / len(cross.tests),
        large=cross.factor > LARGEST_FACTOR,
    )
