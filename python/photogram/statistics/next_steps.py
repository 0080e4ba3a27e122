"""What to do next, which follows from the condition that heads a verdict: for page, text and document."""

from __future__ import annotations

from photogram.statistics.findings import Findings

_NEXT = {
    "not-converged": (
        "Do not use any of these figures: they are those of the last iteration, not of a solution.",
        "{iterate}",
        "Look for mistakes of the input first: {check}. Poor first values are the usual cause.",
    ),
    "undetermined": (
        "Measure what determines the unknowns that are named, or hold them; {check} says more.",
    ),
    "hint": ("Correct what is named above, and adjust again.",),
    "identification": ("Look at the exposures that are named, and leave out those that are wrong.",),
    "changed": (
        "Values of before a change hold for what was measured before it, those of after it for what came"
        " after: one mean holds for neither.",
        "Look for the cause (wear, repair, temperature), and for what was measured in between.",
    ),
    "gross-errors": (
        "Look at the observations that are named: the first of them is the most likely, those after it"
        " often only follow from it.",
        "{lens}",
        "{take_out}",
    ),
    "usable-after-removal": (
        "Look at what was taken out, and measure it again if it matters.",
        "Standard deviations hold after the removal: the largest residuals are gone.",
    ),
    "set-aside": (
        "Look at the images that are named: they are probably of other points, or their photos of something"
        " else.",
    ),
    "too-much-set-aside": (
        "So many images are not wrong by themselves. Look for what they have in common: a camera, a lens"
        " that is not modelled, wrong control; {check}.",
    ),
    "too-much-removed": (
        "So many observations are not wrong by themselves. Look for what they have in common: a camera, a"
        " day, a wrong control system; {check}.",
    ),
    "check-points": (
        "Look at the check points that are named: their names, given coordinates, kind of heights, images. If"
        " they are right, the block is wrong there, where its own residuals cannot show it: look for control"
        " or a camera that bends it; {check}.",
        "Do not hand over the standard deviations before the cause is known.",
    ),
    "look-at-check-points": (
        "Look at the check points that are named. Among good ones as many as these are rare: their given"
        " coordinates, or what stands for their standard deviations, may be at fault.",
    ),
    "intersection": ("Adjust the photos too: give them standard deviations, or leave them free.",),
    "weights": (
        "{scaled}",
        "Give the observations standard deviations that are larger by the factor that is named, so that"
        " their tests are right too.",
    ),
    "weights-of-groups": (
        "Give the groups that are named standard deviations larger or smaller by their factors, and adjust"
        " again.",
    ),
    "model": (
        "{calibrate}",
        "Look at the residuals over the frame: what is alike in all photos is the camera, what is alike in"
        " one is the photo or its control. Do not take out observations before: where the model is wrong,"
        " good ones look bad.",
    ),
    "uncontrolled": (
        "Nothing checks these values. Measure more than is needed: more rays, control or distances.",
    ),
    "unexplained": (
        "Look at the largest tests and at the residuals over the frame; for mistakes of the input: {check}.",
        "{take_out}",
    ),
    "look-at": (
        "Look at the observations that are named. Among good observations as many as these are rare: keep"
        " them if the measurement is beyond doubt.",
    ),
    "weights-pessimistic": (
        "{scaled}",
        "Give smaller standard deviations, unless values were smoothed or used twice.",
    ),
    "accepted": (),
    "not-tested": (
        "No test says whether the standard deviations are right: compare with what took no part (known"
        " values, a second measurement), or give the observations standard deviations where the program takes"
        " them.",
    ),
}
"""What follows from the condition that gave the headline, in the words of a program."""


def next_steps(code: str, found: Findings, *, usable: bool, take_out: bool, lens: bool) -> tuple[str, ...]:
    """Return what to do next, in sentences.

    Parameters
    ----------
    code
        Of the condition that gave the headline.
    found
        What the verdict rests on.
    usable
        Whether nothing forbids the use.
    take_out
        Whether what was found can be taken out: neither held, nor what is left after that was done.
    lens
        Whether lens terms explain more of the residuals than any single observation.
    """
    words = {
        "scaled": "The covariances are scaled by the unit variance already." if found.scaled else "",
        "check": found.check,
        "take_out": found.take_out if take_out else "",
        "calibrate": _calibrated(found.calibrate),
        "lens": _calibrated(found.calibrate) if lens else "",
        "iterate": found.iterate,
    }
    sentences = [each.format(**words) for each in _NEXT.get(code, ())]
    sentences += found.if_usable if usable else found.if_withheld
    told = tuple(each for each in sentences if each)
    return told if told or not usable else ("Nothing needs to be done.",)


def _calibrated(how: str) -> str:
    if how.startswith("--"):
        return f"Let the cameras be estimated: `photogram adjust ... {how}`."
    return f"Give the block {how}." if how else ""
