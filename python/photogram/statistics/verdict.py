"""The verdict on an adjustment: whether its result can be used, and if not, what is wrong.

One table of conditions, in order: the first that fits gives the headline and the exit code, all others that
fit follow as lines. No figure is hidden: every test stands in the verdict with its distribution, probability,
level and number of tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

from photogram.lazy_dataclasses import asdict, dataclass
from photogram.messages import counted, listed
from photogram.statistics.evidence import NAMED, WITHHELD, Evidence, Test
from photogram.statistics.findings import Findings
from photogram.statistics.limits import NOTABLE_FACTOR
from photogram.statistics.next_steps import next_steps

EXIT_NOT_CONVERGED, EXIT_NOT_USABLE = 3, 4
"""How a command ends: figures that are no results; results that must not be used as they are."""

WRONG_ALIKE = 1.5
"""Where the median is larger than expected by more, and the mean square by no more than this beside it, all
residuals are too large, not a few."""

MOST_IMAGES, MOST_CONTROL = 0.05, 1 / 3
"""Shares of images and of control without which a network may be used."""

_GRAVITY = (0, EXIT_NOT_USABLE, EXIT_NOT_CONVERGED)
"""Exit codes, the worst last."""

LARGEST_FACTOR = 3.0
"""Standard deviations wrong by more than this are no matter of weights."""


@dataclass(frozen=True, repr=False)
class Verdict:
    """Whether a result can be used.

    Attributes
    ----------
    code
        Name of the condition that fits first: the table is in `docs/tests.md`.
    headline
        A sentence.
    exit
        Exit code of the command: 0, 3 or 4.
    warning
        Whether a user should look although the exit code is 0; `--strict` makes it 4.
    lines
        What else is to be said.
    next
        What to do next, in sentences.
    tests
        The global test, the largest test value of every kind of observation, tests of patterns.
    outliers
        Sentences on the kinds of observations whose tests reject: how many, and the worst.
    removed, rivals, hints
        What snooping took out, what cannot be told apart from it, and accepted hypotheses.
    """

    code: str
    headline: str
    exit: int
    warning: bool
    lines: tuple[str, ...]
    next: tuple[str, ...]
    tests: tuple[Test, ...]
    outliers: tuple[str, ...] = ()
    removed: tuple[Any, ...] = ()
    rivals: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Verdict {self.code}: {self.headline} (exit code {self.exit}, {len(self.tests)} tests)"

    @property
    def usable(self) -> bool:
        """Whether the result can be used."""
        return self.exit == 0

    def exit_code(self, *, strict: bool = False) -> int:
        """Return the exit code of a command; `strict` lets warnings count."""
        return EXIT_NOT_USABLE if strict and self.warning and self.exit == 0 else self.exit

    def document(self) -> dict[str, Any]:
        """Return the verdict as it stands in JSON documents."""
        return asdict(self)


@dataclass(frozen=True)
class _Line:
    """A sentence of a condition; `praise` goes before it where nothing forbids the use.

    `exchanged` are the sentences on exchanged names that it contains.
    """

    code: str
    text: str
    exit: int = 0
    warning: bool = False
    praise: str = ""
    exchanged: Sequence[str] = ()

    def said(self, usable: bool) -> str:
        text = f"{self.praise} {self.text}" if usable and self.praise else self.text
        return f"{text[:1].upper()}{text[1:]}"


def verdict(found: Findings) -> Verdict:
    """Judge an adjustment by all that was found about it."""
    evidence = Evidence(found)
    fitting = [line for condition in _CONDITIONS if (line := condition(evidence)) is not None]
    # What forbids the use comes first: no green headline above a line that says so.
    fitting.sort(key=lambda line: line.exit == 0)
    first, *others = fitting or [_Line(*evidence.accepted())]
    usable = first.exit == 0
    return Verdict(
        code=first.code,
        headline=first.said(usable),
        exit=first.exit,
        warning=first.warning or any(line.warning or line.exit for line in others),
        lines=(
            *(line.said(usable) for line in others),
            *evidence.remarks(),
            *found.remarks,
            *(found.snooped.kept if found.snooped else ()),
            *_exchanged(found, fitting),
        ),
        next=next_steps(
            first.code, found, usable=usable, take_out=_can_be_taken_out(evidence), lens=evidence.lens_first
        ),
        tests=tuple(evidence.tests()),
        outliers=tuple(evidence.outliers()),
        removed=tuple(found.snooped.removed) if found.snooped else (),
        rivals=tuple(found.snooped.rivals) if found.snooped else (),
        hints=tuple(found.hints),
    )


def _can_be_taken_out(e: Evidence) -> bool:
    """Return whether what looks gross is an observation, and nothing was taken out yet."""
    return e.found.snooped is None and not (e.gross and e.gross[0][1].held)


def _exchanged(found: Findings, lines: list[_Line]) -> list[str]:
    """Return names that are probably exchanged, unless a line has them."""
    return [each for each in found.exchanged if not any(each in line.exchanged for line in lines)]


def worst(verdicts: Iterable[Verdict], *, strict: bool = False) -> int:
    """Return the exit code of a command with several results: that of the worst."""
    return max((each.exit_code(strict=strict) for each in verdicts), key=_GRAVITY.index, default=0)


def _not_converged(e: Evidence) -> _Line | None:
    if e.found.status == "converged":
        return None
    text = "; ".join([f"Not converged ({e.found.status}): the figures are no results", *e.found.exchanged])
    return _Line("not-converged", text, EXIT_NOT_CONVERGED, exchanged=e.found.exchanged)


def _rank_defect(e: Evidence) -> _Line | None:
    if not e.found.undetermined:
        return None
    names = listed(list(e.found.undetermined))
    return _Line(
        "undetermined",
        f"Unknowns that the observations do not determine, or hardly: {names}",
        EXIT_NOT_CONVERGED,
    )


def _hint(e: Evidence) -> _Line | None:
    if not e.found.hints:
        return None
    first, *others = e.found.hints
    text = "; ".join([f"{first[:1].upper()}{first[1:]}", *others])
    return _Line("hint", text, EXIT_NOT_USABLE)


def _identification(e: Evidence) -> _Line | None:
    if not e.found.doubtful:
        return None
    named = listed(list(e.found.doubtful))
    return _Line("identification", f"The identification of stars is doubtful: {named}", EXIT_NOT_USABLE)


def _changed(e: Evidence) -> _Line | None:
    if not e.found.changed:
        return None
    return _Line("changed", f"Changed: {listed(list(e.found.changed), NAMED)}", EXIT_NOT_USABLE)


def _gross_errors(e: Evidence) -> _Line | None:
    if e.found.spoiled:
        named = f": {e.named(e.single)}" if e.single else ""
        return _Line("gross-errors", f"Gross errors: {e.found.spoiled}{named}", EXIT_NOT_USABLE)
    if not e.rejected or e.found.snooped or not e.gross or e.lens:
        return None
    # A few gross errors make s larger than the median says; a wrong model spoils all residuals alike.
    if e.pattern and e.robust is not None and e.robust > WRONG_ALIKE and e.factor <= WRONG_ALIKE * e.robust:
        return None
    text = f"Gross errors likely: {'; '.join([*e.found.exchanged, e.named(e.gross)])}"
    _, first, place = e.gross[0]
    if first.held:
        text += "; what is held without error is no observation: give it a standard deviation"
        text += f" ({e.found.weigh})" if e.found.weigh and "control point" in first.name(place) else ""
    elif e.found.snoop and e.found.status == "converged":
        text += f"; {e.found.snoop} takes them out"
    return _Line("gross-errors", text, EXIT_NOT_USABLE, exchanged=e.found.exchanged)


def _snooped(e: Evidence) -> _Line | None:
    found = e.found.snooped
    if found is None or not found.removed:
        return None
    count = len(found.removed)
    if found.images > MOST_IMAGES or found.control > MOST_CONTROL:
        return _Line(
            "too-much-removed",
            f"Too much had to be removed ({count} observations: {100 * found.images:.3g} percent of the"
            f" images, {100 * found.control:.3g} of the control): model or identification is wrong"
            + "".join(f"; {each}" for each in found.exchanged),
            EXIT_NOT_USABLE,
            exchanged=found.exchanged,
        )
    if e.high:
        return None
    names = listed([str(each.get("name", "")) for each in found.removed], NAMED)
    removed = counted(count, "observation")
    text = "; ".join([f"after removal of {removed}: {names}", *found.exchanged])
    return _Line("usable-after-removal", text, praise="Usable", exchanged=found.exchanged)


def _set_aside(e: Evidence) -> _Line | None:
    found = e.found.set_aside
    if found is None:
        return None
    names = listed([str(each["name"]) for each in found.removed], NAMED)
    text = f"{names}; --keep-all (keep_all=True) takes all images in"
    if found.images > MOST_IMAGES:
        share = f"{100 * found.images:.3g} percent of the images fit neither the start nor the adjusted block"
        return _Line(
            "too-much-set-aside", f"{share}: model or identification is wrong: {text}", EXIT_NOT_USABLE
        )
    start = f"without {len(found.removed)} that fit neither the start nor the adjusted block"
    return _Line("set-aside", f"{start}: {text}", warning=True, praise="" if e.high else "Usable, but")


def _checks(e: Evidence) -> _Line | None:
    if said := e.disagreement(WITHHELD):
        return _Line("check-points", f"Check points disagree with the adjustment: {said}", EXIT_NOT_USABLE)
    if said := e.disagreement(e.found.level):
        return _Line("look-at-check-points", f"Look at the check points: {said}", warning=True)
    return None


def _intersected(e: Evidence) -> _Line | None:
    if not e.high or e.gross or not e.found.intersected:
        return None
    text = (
        "Intersection only: photos stay where they are given, and residuals, which have the errors of that,"
        f" are {e.interval()} times larger than images and control explain; none stands out from the others."
        " The adjustment of the photos judges"
    )
    return _Line("intersection", text, EXIT_NOT_USABLE if e.factor > LARGEST_FACTOR else 0, warning=True)


def _common_factor(e: Evidence) -> _Line | None:
    if not e.high or e.gross or e.pattern or e.found.intersected:
        return None
    if any(each.significant for each in e.found.components):
        return None
    if e.robust is not None and e.robust < e.factor / NOTABLE_FACTOR:
        return None
    text = f"Weights too optimistic: standard deviations are too small by about {e.interval()}"
    if e.factor <= LARGEST_FACTOR:
        scaled = "; covariances are scaled by the unit variance" if e.found.scaled else ""
        return _Line("weights", f"{text}{scaled}", warning=True)
    return _Line("weights", text, EXIT_NOT_USABLE)


def _components(e: Evidence) -> _Line | None:
    wrong = [each for each in e.found.components if each.significant]
    if not wrong:
        return None
    named = [
        f"of {each.group} by about {each.factor:.3g} ({each.interval[0]:.3g} to {each.interval[1]:.3g})"
        for each in wrong
    ]
    far = any(not 1 / LARGEST_FACTOR <= each.factor <= LARGEST_FACTOR for each in wrong)
    text = f"Standard deviations are wrong: those {listed(named)}"
    return _Line("weights-of-groups", text, EXIT_NOT_USABLE if far else 0, warning=True)


def _model(e: Evidence) -> _Line | None:
    wrong = [each.sentence for each in e.found.systematic if each.significant and each.large]
    if not wrong:
        return None
    text = f"The model is likely wrong: {'; '.join(wrong)}"
    if e.lens_first and e.found.calibrate and not e.found.spoiled:
        text += f". {e.found.calibrate} estimates it"
        text += "; observations are not to be taken out before" if e.lens else ""
    return _Line("model", text, EXIT_NOT_USABLE)


def _uncontrolled(e: Evidence) -> _Line | None:
    if e.found.degrees_of_freedom >= 1 and (e.number or not e.found.computed):
        return None
    reason = (
        "as many unknowns as observations" if e.found.degrees_of_freedom < 1 else "no observation has a test"
    )
    return _Line("uncontrolled", f"Nothing is checked: {reason}", warning=True)


def _unexplained(e: Evidence) -> _Line | None:
    explained = (_gross_errors, _snooped, _intersected, _common_factor, _components, _model)
    if not e.high or any(condition(e) is not None for condition in explained):
        return None
    largest = [test for test in e.tests() if test.name != "global"]
    named = "; ".join(f"{test.name} ({test.statistic} = {test.value:.4g})" for test in largest)
    return _Line(
        "unexplained",
        f"Residuals are {e.interval()} times larger than the standard deviations allow; no single cause"
        f" found. Largest tests: {named or 'none'}",
        EXIT_NOT_USABLE if e.factor > LARGEST_FACTOR else 0,
        warning=True,
    )


def _look_at(e: Evidence) -> _Line | None:
    if e.high or not e.single or _gross_errors(e) is not None:
        return None
    whole = "Accepted, but" if e.test is not None else f"Not tested as a whole ({e.found.untested}), but"
    return _Line("look-at", f"look at: {e.named(e.single)}", warning=True, praise=whole)


def _too_low(e: Evidence) -> _Line | None:
    if not e.low:
        return None
    return _Line(
        "weights-pessimistic",
        "Weights too pessimistic: the residuals are smaller than the given standard deviations allow."
        f" These are too large by about {1 / e.factor:.3g}, or residuals are not independent"
        " (repeated or smoothed values)",
    )


_CONDITIONS: tuple[Callable[[Evidence], _Line | None], ...] = (
    _not_converged,
    _rank_defect,
    _hint,
    _identification,
    _changed,
    _gross_errors,
    _snooped,
    _model,
    _set_aside,
    _checks,
    _intersected,
    _common_factor,
    _components,
    _uncontrolled,
    _unexplained,
    _look_at,
    _too_low,
)
"""The first that fits gives the headline."""
