"""The verdict on an adjustment: whether its result can be used, and why not.

The first applicable rule of an ordered list (:data:`RULES`) defines the headline, the exit code and the next
steps. The other applicable rules follow as lines. The verdict contains every test with its distribution,
probability, level and number of tests.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from photogram.arguments.types import Bools
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.statistics import weight_rules
from photogram.statistics.evidence import GLOBAL, MISSING_LENS, SUSPECT, WITHHELD, Evidence, Test, part_of
from photogram.statistics.findings import IMAGES, Findings, Text
from photogram.words import Phrase

EXIT_NOT_CONVERGED, EXIT_NOT_USABLE = 3, 4
"""Exit codes of a command: values that are not results; results that must not be used."""

_GRAVITY = (0, EXIT_NOT_USABLE, EXIT_NOT_CONVERGED)  # Exit codes, the worst last

_LISTED = ("lines", "next", "outliers", "rivals", "hints")  # Members of a verdict that list messages


@dataclass(frozen=True, repr=False)
class Verdict:
    code: str  # Code of the first applicable rule; listed in `docs/command-line.md`
    message: Phrase  # Its message: a code with fields
    exit: int  # Exit code of the command: 0, 3 or 4
    warning: bool  # Whether a user should look although the exit code is 0; `--strict` makes it 4
    lines: tuple[Phrase, ...]  # Messages of the other rules, and remarks
    next: tuple[Phrase, ...]  # Messages on the next steps
    # The global test, the largest test value of every observation type, tests of patterns
    tests: tuple[Test, ...]
    # One message per observation type with outliers: their number, and the worst
    outliers: tuple[Phrase, ...] = ()
    # Removed observations, observations that are inseparable from them, accepted hypotheses
    removed: tuple[Any, ...] = ()
    rivals: tuple[Text, ...] = ()
    hints: tuple[Text, ...] = ()
    # The outliers by type, which tables and plots mark: row of an observation, or row and component
    outlying: Mapping[Text, Sequence[tuple[int, ...]]] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"Verdict {self.code}: {self.headline} (exit code {self.exit}, {len(self.tests)} tests)"

    @property
    def headline(self) -> str:
        """Message of the first applicable rule, as a sentence."""
        return str(self.message)

    @property
    def is_tested_as_a_whole(self) -> bool:
        """Whether all residuals are tested together."""
        return any(test.kind == GLOBAL for test in self.tests)

    @property
    def usable(self) -> bool:
        return self.exit == 0

    def marks(self, kind: Text, shape: tuple[int, ...]) -> Bools:
        """Return a mask of the outliers of one type, in the shape of their test values."""
        marks = np.zeros(shape, dtype=bool)
        for place in self.outlying.get(kind, ()):
            marks[place] = True
        return marks

    def exit_code(self, *, strict: bool = False) -> int:
        """Return the exit code of a command; `strict` includes warnings."""
        return EXIT_NOT_USABLE if strict and self.warning and self.exit == 0 else self.exit

    def document(self) -> dict[str, Any]:
        """Return the verdict for JSON: sentences, and `messages` with fields."""
        listed: dict[str, tuple[Text, ...]] = {name: getattr(self, name) for name in _LISTED}
        return {
            "code": self.code,
            "headline": self.headline,
            "exit": self.exit,
            "warning": self.warning,
            **{name: [str(each) for each in own] for name, own in listed.items()},
            "tests": [test.document() for test in self.tests],
            "removed": self.removed,
            "messages": [
                {"member": name, **each.document()}
                for name, own in {"headline": (self.message,), **listed}.items()
                for each in own
                if isinstance(each, Phrase)
            ],
        }


@dataclass(frozen=True)
class Rule:
    code: str
    message: Callable[[Any], Phrase | None]  # Message on the evidence; None if the rule is not applicable
    exit: int  # Exit code, if `grave` applies to the evidence
    advice: str = ""  # Codes of the next steps, if it defines the headline
    warning: bool = False  # Whether a user should look although the exit code is 0
    grave: Callable[[Any], bool] = lambda _: True  # Whether it forbids the use
    also: bool = False  # Whether the message has the variant `.also` for verdicts that forbid the use


def fitting_rules(
    rules: Iterable[Rule], evidence: Any, codes: list[str] | None = None
) -> list[tuple[Rule, Phrase, int]]:
    """Return applicable rules with messages and exit codes, forbidding ones first.

    `codes` receives the codes of these rules, for the conditions of later rules.
    """
    fitting: list[tuple[Rule, Phrase, int]] = []
    for rule in rules:
        if (message := rule.message(evidence)) is not None:
            if codes is not None:
                codes.append(rule.code)
            fitting.append((rule, message, rule.exit if rule.grave(evidence) else 0))
    return sorted(fitting, key=lambda each: each[2] == 0)


def verdict(found: Findings) -> Verdict:
    """Return the verdict on an adjustment from its findings."""
    evidence = Evidence(found)
    fitting = fitting_rules(RULES, evidence, evidence.codes)
    usable = not fitting[0][2]
    messages = [
        replace(message, code=f"verdict.{rule.code}.also") if rule.also and not usable else message
        for rule, message, _ in fitting
    ]
    lines: list[Text] = [*messages[1:], *evidence.remarks(), *found.remarks]
    if found.snooped:
        lines += found.snooped.kept
    fields = [value for message in messages for value in message.fields.values() if isinstance(value, list)]
    named = [each for value in fields for each in value]
    lines += [each for each in found.exchanged if each not in named]
    rule = fitting[0][0]
    return Verdict(
        code=rule.code,
        message=messages[0],
        exit=fitting[0][2],
        warning=any(each.warning for each, *_ in fitting) or any(code for *_, code in fitting[1:]),
        lines=tuple(map(as_phrase, lines)),
        next=_next_steps(rule, evidence, usable=usable),
        tests=tuple(evidence.tests()),
        outliers=tuple(evidence.outliers()),
        removed=tuple(found.snooped.removed) if found.snooped else (),
        rivals=tuple(found.snooped.rivals) if found.snooped else (),
        hints=tuple(found.hints),
        outlying=evidence.places(),
    )


def as_phrase(text: Text) -> Phrase:
    return text if isinstance(text, Phrase) else Phrase("part.text", {"text": text})


def worst(verdicts: Iterable[Verdict], *, strict: bool = False) -> int:
    """Return the worst exit code of several results."""
    return max((each.exit_code(strict=strict) for each in verdicts), key=_GRAVITY.index, default=0)


def _next_steps(rule: Rule, e: Evidence, *, usable: bool) -> tuple[Phrase, ...]:
    found = e.found
    # Fixed values are not observations, and a second snooping finds nothing more.
    snooping = (found.snooped is None or found.robust) and not (e.gross and e.gross[0][1].held)
    calibrate = found.calibrate and replace(
        found.calibrate, code=found.calibrate.code.replace("how", "advice")
    )
    of_program: Mapping[str, Phrase | None] = {
        "scaled": Phrase("advice.scaled") if found.scaled else None,
        "take-out": found.take_out if snooping else None,
        "calibrate": calibrate,
        "lens": calibrate if e.lens_first else None,
        "lens-in-common": calibrate if e.common_code == MISSING_LENS else None,
        "iterate": found.iterate,
    }
    steps: list[Text] = []
    for name in rule.advice.split():
        if name in of_program:
            steps += filter(None, [of_program[name]])
        else:
            steps.append(Phrase(f"advice.{name}", {"check": found.check} if name in _WITH_CHECK else {}))
    steps += found.if_usable if usable else found.if_withheld
    return tuple(map(as_phrase, steps)) or ((Phrase("advice.nothing"),) if usable else ())


def _look(
    code: str,
    message: Callable[[Any], Phrase | None],
    advice: str,
    *,
    grave: Callable[[Any], bool] | None = None,
    also: bool = False,
) -> Rule:
    """Return a rule with a warning, which forbids the use only if it is grave."""
    exit_code = EXIT_NOT_USABLE if grave else 0
    return Rule(code, message, exit_code, advice, warning=True, grave=grave or bool, also=also)


def _listing(code: str, name: str, attribute: str = "") -> Callable[[Evidence], Phrase | None]:
    """Return the function that creates a message with a list of findings, if any."""

    def message(e: Evidence) -> Phrase | None:
        listed = list(getattr(e.found, attribute or code))
        return Phrase(f"verdict.{code}", {name: listed}) if listed else None

    return message


def _not_converged(e: Evidence) -> Phrase | None:
    if e.found.status == "converged":
        return None
    return Phrase("verdict.not-converged", {"status": e.found.status, "exchanged": list(e.found.exchanged)})


def _gross_errors(e: Evidence) -> Phrase | None:
    if e.found.spoiled:
        code = "verdict.gross-errors.harmful"
        fields: dict[str, Any] = {"reason": e.found.spoiled}
        return (
            Phrase(f"{code}.named", {**fields, "tests": e.named(e.single)})
            if e.single
            else Phrase(code, fields)
        )
    if not e.gross or e.lens or {"common-error", "weights-of-types"} & set(e.codes):
        return None
    # Data snooping leaves gross errors if nothing else determines their points or photos.
    snooped = e.found.snooped is not None and not e.found.snooped.kept
    if "disputed" in e.codes or (not e.found.robust and (not e.rejected or snooped)):
        return None
    # A few gross errors increase s but not the median; a wrong model increases all residuals.
    if e.pattern and weight_rules.are_alike(e):
        return None
    suspects = [*e.found.exchanged, Phrase("part.tests", {"tests": e.named(e.gross)})]
    return Phrase("verdict.gross-errors", {"suspects": suspects, "remedy": _remedy(e)})


def _common_error(e: Evidence) -> Phrase | None:
    """Return common errors of sets, unless hints or a lens pattern explain better."""
    if not e.found.common or e.lens or {"hint", "weights-of-types"} & set(e.codes):
        return None
    code = "verdict.common-error" if _is_grave(e) else "verdict.common-error.look"
    return Phrase(code, {"errors": list(e.found.common)})


def _is_grave(e: Evidence) -> bool:
    """Whether a common error moves points, or causes that the result is refused."""
    removed = e.found.snooped is not None and e.found.snooped.excessive
    return bool(e.found.common_is_harmful or e.pattern or removed or e.disagreement(WITHHELD))


def _lack_control(e: Evidence) -> bool:
    return any(getattr(name, "code", "") == CONTROL for name in e.found.unsupported)


def _remedy(e: Evidence) -> Phrase | str:
    """Return the method to remove probable gross errors."""
    _, first, place = e.gross[0]
    if first.held:
        name = first.name(place)
        if e.found.weigh and isinstance(name, Phrase) and name.fields["named"].code == CONTROL:
            return Phrase("part.fixed.control", {"how": e.found.weigh})
        return Phrase("part.fixed")
    snoops = e.found.can_snoop and e.found.snooped is None and e.found.status == "converged"
    return Phrase("part.snoop") if snoops else ""


def _too_much_removed(e: Evidence) -> Phrase | None:
    found = e.found.snooped
    if found is None or not found.removed or not found.excessive or (e.high and weight_rules.are_alike(e)):
        return None
    shares = [
        Phrase("part.share", {"percent": 100 * found.share(kind), "kind": kind}) for kind in found.excessive
    ]
    fields = {"n": found.total, "shares": shares, "exchanged": list(found.exchanged)}
    return Phrase("verdict.too-much-removed", fields)


def _disputed(e: Evidence) -> Phrase | None:
    groups = list(e.found.snooped.disputed) if e.found.snooped else []
    return Phrase("verdict.disputed", {"groups": groups}) if groups else None


def _removed(e: Evidence) -> Phrase | None:
    found = e.found.snooped
    if found is None or not found.removed or e.high or "too-much-removed" in e.codes:
        return None
    names = [each.get("subject") or each.get("name", "") for each in found.removed]
    fields = {"n": found.total, "names": names, "exchanged": list(found.exchanged)}
    return Phrase("verdict.usable-after-removal", fields)


def _set_aside(much: bool, e: Evidence) -> Phrase | None:
    """Return observations rejected by initial orientation, for many or few."""
    found = e.found.set_aside
    if found is None or bool(found.excessive) is not much:
        return None
    fields = {"n": len(found.removed), "names": [each["name"] for each in found.removed]}
    fields["keep"] = Phrase("part.keep-all")
    if much:
        return Phrase("verdict.too-much-set-aside", {**fields, "images": 100 * found.share(IMAGES)})
    return Phrase("verdict.set-aside.also" if e.high else "verdict.set-aside", fields)


def _checks(e: Evidence) -> Phrase | None:
    points, errors = e.disagreement(WITHHELD), list(e.found.of_checks)
    if points and errors:
        return Phrase("verdict.check-points.named", {"points": points, "errors": errors})
    return Phrase("verdict.check-points", {"points": points}) if points else None


def _suspect_checks(e: Evidence) -> Phrase | None:
    if "check-points" in e.codes:
        return None
    if points := e.disagreement(SUSPECT):
        return Phrase("verdict.look-at-check-points", {"points": points})
    errors = [] if e.codes else list(e.found.of_checks)
    return Phrase("verdict.look-at-check-points.named", {"errors": errors}) if errors else None


def _model(e: Evidence) -> Phrase | None:
    wrong = [each.sentence for each in e.found.systematic if each.significant and each.large]
    # A lens includes the parameters of the common error that explains its pattern.
    if not wrong or "common-error" in e.codes:
        return None
    remedy: Phrase | str = ""
    if e.lens_first and e.found.calibrate and not e.found.spoiled:
        remedy = Phrase("part.calibrate.first" if e.lens else "part.calibrate", {"how": e.found.calibrate})
    return Phrase("verdict.model", {"patterns": wrong, "remedy": remedy})


def _uncontrolled(e: Evidence) -> Phrase | None:
    if e.found.degrees_of_freedom >= 1 and (e.number or not e.found.computed):
        return None
    return Phrase(f"verdict.uncontrolled{'.unknowns' if e.found.degrees_of_freedom < 1 else ''}")


def _unexplained(e: Evidence) -> Phrase | None:
    if not e.high or _EXPLAINING & set(e.codes):
        return None
    tests = [part_of(test.name, test.statistic, test.value) for test in e.tests() if test.kind != GLOBAL]
    fields = {"factor": e.interval(), "tests": tests or [Phrase("part.none")]}
    return Phrase("verdict.unexplained", fields)


def _look_at(e: Evidence) -> Phrase | None:
    if e.high or not e.single or "gross-errors" in e.codes:
        return None
    fields = {"tests": e.named(e.single)}
    if e.test is None:
        return Phrase("verdict.look-at.untested", {**fields, "reason": e.found.untested})
    return Phrase("verdict.look-at", fields)


def _accepted(e: Evidence) -> Phrase | None:
    if e.codes or e.test is None:
        return None
    low, high = e.test.limits
    fields = {"variance": e.test.variance, "low": low, "high": high}
    if e.test.rejected_high or e.test.rejected_low:
        return Phrase("verdict.accepted.harmless", {**fields, "factor": e.factor})
    return Phrase("verdict.accepted", fields)


def _not_tested(e: Evidence) -> Phrase | None:
    if e.codes:
        return None
    pattern = any(each.significant for each in e.found.systematic)
    return Phrase(f"verdict.not-tested{'.pattern' if pattern else ''}", {"reason": e.found.untested})


CONTROL = "named.control"  # Code of the name of a control point

_WITH_CHECK = frozenset(
    {
        "first-values",
        "determine",
        "common-of-images",
        "common-of-observations",
        "wrong-checks",
        "largest-tests",
    }
)
"""Advice that names how the program searches for mistakes of the input."""

_EXPLAINING = frozenset(
    {
        "common-error",
        "gross-errors",
        "too-much-removed",
        "usable-after-removal",
        "intersection",
        "weights",
        "weights-of-groups",
        "weights-of-types",
        "model",
    }
)
"""Rules that explain residuals that are too large."""

_unchecked = _listing("accepted-not-checked", "errors", "unchecked")

RULES = (
    Rule("not-converged", _not_converged, EXIT_NOT_CONVERGED, "no-results iterate first-values take-out"),
    Rule("undetermined", _listing("undetermined", "names"), EXIT_NOT_CONVERGED, "determine"),
    Rule("duplicates", _listing("duplicates", "duplicates"), EXIT_NOT_USABLE, "remove-duplicates"),
    Rule("hint", _listing("hint", "hints", "hints"), EXIT_NOT_USABLE, "correct"),
    Rule("identification", _listing("identification", "names", "doubtful"), EXIT_NOT_USABLE, "exposures"),
    Rule("changed", _listing("changed", "names"), EXIT_NOT_USABLE, "before-and-after cause-of-change"),
    Rule("weights-of-types", weight_rules.wrong_type, EXIT_NOT_USABLE, "sd-of-types"),
    _look("common-error", _common_error, "correct-common lens-in-common", grave=_is_grave),
    _look("unsupported", _listing("unsupported", "names"), "measure-again", grave=_lack_control),
    Rule("disputed", _disputed, EXIT_NOT_USABLE, "measure-again"),
    Rule("gross-errors", _gross_errors, EXIT_NOT_USABLE, "look-at-gross-errors lens take-out"),
    Rule("too-much-removed", _too_much_removed, EXIT_NOT_USABLE, "common-of-observations"),
    Rule("usable-after-removal", _removed, 0, "measure-again after-selection", also=True),
    Rule("model", _model, EXIT_NOT_USABLE, "calibrate frame"),
    Rule("too-much-set-aside", partial(_set_aside, True), EXIT_NOT_USABLE, "common-of-images"),
    _look("set-aside", partial(_set_aside, False), "look-at-images", also=True),
    Rule("check-points", _checks, EXIT_NOT_USABLE, "wrong-checks cause-first"),
    _look("look-at-check-points", _suspect_checks, "look-at-checks"),
    _look("intersection", weight_rules.intersected, "adjust-photos", grave=weight_rules.is_far),
    Rule("weights-of-types", weight_rules.types_with_common_factor, EXIT_NOT_USABLE, "sd-of-types"),
    Rule("weights", partial(weight_rules.common_factor, True), EXIT_NOT_USABLE, "scaled larger-sd"),
    _look("weights", partial(weight_rules.common_factor, False), "scaled larger-sd"),
    _look("weights-of-groups", weight_rules.components, "sd-of-groups", grave=weight_rules.has_far_groups),
    _look("uncontrolled", _uncontrolled, "measure-more"),
    _look("unexplained", _unexplained, "largest-tests take-out", grave=weight_rules.is_far),
    Rule("not-accurate-enough", lambda e: e.found.shortfall, EXIT_NOT_USABLE, "more-views"),
    _look("look-at", _look_at, "look-at", also=True),
    Rule("weights-pessimistic", weight_rules.too_low, 0, "scaled smaller-sd"),
    _look("accepted-not-checked", _unchecked, "check-undetected", also=True),
    Rule("accepted", _accepted, 0),
    Rule("not-tested", _not_tested, 0, "compare"),
)
"""The first applicable rule defines the headline; rules that forbid the use precede all others."""
