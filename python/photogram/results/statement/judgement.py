"""The one judgement of a statement: headline, exit code, sentences, assumptions and remarks."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.results.statement.asprs import wording
from photogram.results.statement.budget import budget_line
from photogram.results.statement.comparison import Compared
from photogram.results.statement.figures import Figures, Sized
from photogram.results.statement.grounds import Grounds, Said, assumptions
from photogram.results.statement.honest import LEVEL, Bias, PointTests, Prediction, Surface
from photogram.results.statement.layout import Layout
from photogram.results.statement.leave_one_out import LeftOut, limit_of
from photogram.results.statement.standards import Asprs, Lengths, Standards
from photogram.results.statement.texts import Texts
from photogram.show.page import Tone
from photogram.statistics.distributions import critical_normal
from photogram.words import Phrase

NOT_USABLE = 4
"""Exit code of a statement that must not be handed over as it is."""
HEIGHT_KINDS = 10.0
"""Standard deviations of a mean difference beyond which heights of two kinds may have been compared."""
NAMED = 10
_CASES = {
    "missed": "missed",
    "met with confidence": "tested",
    "met": "tested",
    "produced to meet": "produced",
    "not decided": "undecided",
}
"""Sentences of the verdicts on a class that has check points."""


@dataclass(frozen=True)
class Judged:
    """What a statement says."""

    # Exit code, severity of the headline
    exit: int
    tone: Tone
    headline: str  # A sentence
    # Keys and texts
    sentences: Said
    assumptions: Said
    remarks: list[str]  # Remarks that do not change the exit code


@dataclass(frozen=True)
class _Against:
    """What speaks against handing a statement over, `high` and `low` differences at check points among it."""

    spoilt: bool
    missed: bool
    high: bool
    warning: bool
    low: bool
    control: Sequence[LeftOut]
    lengths: bool

    @property
    def always(self) -> bool:
        """Whether it must not be handed over as it is."""
        return self.spoilt or self.missed or self.high

    @property
    def strictly(self) -> bool:
        """Whether `strict` says so, too."""
        return self.warning or self.low or bool(self.control) or self.lengths


def judged(found: Grounds, *, assumed: Sequence[Phrase | str] = (), strict: bool = False) -> Judged:
    """Return what the statement says of all that was found."""
    texts, of_all, standards = found.texts, found.of_all, found.standards
    against = _against(found)
    bad = against.always or (strict and against.strictly)
    doubtful = against.strictly or _doubtful(of_all)
    remarks = _remarks(found)
    remarks += [
        texts("control.wrong", point=each.point, p=texts.probability(each.p))
        for each in against.control[:NAMED]
    ]
    named = texts.listed([each.point for each in against.control], NAMED)
    n, verdict = 0 if of_all is None else of_all.n, texts.text(found.result.verdict.message)
    return Judged(
        exit=NOT_USABLE if bad else 0,
        tone="bad" if bad else "look" if remarks or doubtful else "good",
        headline=texts(
            _headline(against, of_all, standards, strict=strict), verdict=verdict, points=named, n=n
        ),
        sentences=[
            *_asprs(found),
            *(_nssda(found) if "nssda" in found.asked.standards else []),
            *_lengths(found),
            *_honest(found),
            *(("budget.line", budget_line(texts, each)) for each in found.taken_apart),
        ],
        assumptions=assumptions(found, assumed),
        remarks=remarks,
    )


def _against(found: Grounds) -> _Against:
    high, low = _rejected(found.of_all)
    verdict, standards = found.result.verdict, found.standards
    lengths = None if standards.lengths is None else standards.lengths.test.together
    return _Against(
        spoilt=not verdict.usable,
        missed=_missed(standards),
        high=high,
        warning=verdict.warning,
        low=low,
        control=[each for each in found.left_out if each.p < limit_of(found.left_out)],
        lengths=lengths is not None and (lengths.rejected_high or lengths.rejected_low),
    )


def _whole(of_all: Figures) -> Prediction | None:
    """Return the test of as many components together as there are points with all of them."""
    return of_all.prediction["all"] or of_all.prediction["h"] or of_all.prediction["plan"]


def _rejected(of_all: Figures | None) -> tuple[bool, bool]:
    """Return whether the whole test finds differences larger, or smaller, than predicted."""
    whole = None if of_all is None else _whole(of_all)
    return (False, False) if whole is None else (whole.rejected_high, whole.rejected_low)


def _doubtful(of_all: Figures | None) -> bool:
    """Return whether there are no check points, or some component, mean, surface or point does not agree."""
    if of_all is None:
        return True
    parts = [each for each in of_all.prediction.values() if each is not None]
    shifts = [each for each in of_all.bias.values() if each is not None]
    return (
        any(each.rejected_high or each.rejected_low for each in parts)
        or any(each.rejected for each in shifts)
        or (of_all.surface is not None and of_all.surface.rejected)
        or bool(of_all.points.wrong.any())
    )


def _missed(standards: Standards) -> bool:
    classes = () if standards.asprs is None else standards.asprs.verdicts.values()
    return "missed" in classes or (standards.lengths is not None and standards.lengths.test.met is False)


def _headline(against: _Against, of_all: Figures | None, standards: Standards, *, strict: bool) -> str:
    verdicts = [] if standards.asprs is None else list(standards.asprs.verdicts.values())
    met = standards.lengths is not None and standards.lengths.test.met
    for holds, name in (
        (against.spoilt, "verdict"),
        (against.missed, "missed"),
        (against.high, "high"),
        (strict and against.warning, "warning"),
        (strict and against.control, "control"),
        (strict and against.lengths, "lengths"),
        (against.low, "low"),
        (of_all is None and (not met or "not tested" in verdicts), "none"),
        ("not decided" in verdicts or "not tested" in verdicts, "found"),
        ("produced to meet" in verdicts, "produced"),
        (bool(verdicts) or bool(met), "met"),
    ):
        if holds:
            return f"headline.{name}"
    return "headline.found"


def _asprs(of: Grounds) -> Said:
    texts, found = of.texts, of.standards.asprs
    if found is None:
        return []
    said: Said = []
    for name in ("h", "v", "3d"):
        figure, size = found.figures[name], of.asked.classes.get(name)
        own = {f"rmse_{name}": texts.length(figure.rmse)} if figure is not None else {}
        if size is None:
            if figure is not None and name != "3d":
                said.append(texts.said(f"asprs.found.{name}", n=figure.count, **own))
        elif figure is not None:
            key = f"asprs.{_CASES[found.verdicts[name]]}.{name}"
            said.append(texts.said(key, n=figure.count, **{"class": texts.size(size)}, **own))
        elif name != "3d":
            left = {f"loo_{name}": texts.length(found.left_out[name])}
            said.append(texts.said(f"asprs.none.{name}", **{"class": texts.size(size)}, **left))
    vegetated = found.figures["vva"]
    if vegetated is not None:
        key = f"asprs.{wording(vegetated.count)}.vva"
        said.append(texts.said(key, n=vegetated.count, rmse_v=texts.length(vegetated.rmse)))
    return said


def _nssda(of: Grounds) -> Said:
    texts, found = of.texts, of.standards.nssda
    if found is None:
        return []
    said: Said = []
    if found.accuracy_r is not None:
        accuracy = texts.length(found.accuracy_r)
        said.append(texts.said(f"nssda.{found.wording}.h", accuracy_r=accuracy, n=found.count))
    elif found.ce95 is not None and found.ratio is not None:
        ratio = texts.number(found.ratio, 2)
        said.append(texts.said("nssda.ce95", ratio=ratio, ce95=texts.length(found.ce95)))
    if found.accuracy_z is not None:
        accuracy = texts.length(found.accuracy_z)
        said.append(texts.said(f"nssda.{found.wording}.v", accuracy_z=accuracy, n=found.count))
    return said if found.enough else [*said, texts.said("nssda.few", n=found.count)]


def _lengths(of: Grounds) -> Said:
    texts, found = of.texts, of.standards.lengths
    if found is None:
        return []
    test = found.test
    own: dict[str, str | int] = {
        "n": len(test.errors),
        "lines": test.lines,
        "largest": texts.length(test.largest),
        "rms": texts.length(test.rms),
    }
    if found.limit is None or test.within is None:
        said = [texts.said("lengths.found", **own)]
    else:
        limit = f"{texts.length(found.limit.constant)} + {texts.significant(found.limit.slope, 2)} L"
        if math.isfinite(found.limit.most):
            limit += f" ≤ {texts.length(found.limit.most)}"
        beyond = int((~test.within).sum())
        key, more = ("lengths.missed", {"beyond": beyond}) if beyond else ("lengths.met", {})
        said = [texts.said(key, limit=limit, **own, **more)]
    if test.together is not None:
        whole = test.together
        key = f"lengths.{'high' if whole.rejected_high else 'low' if whole.rejected_low else 'agree'}"
        said.append(texts.said(key, **_factor(texts, whole.factor, whole.interval)))
    return said


def _honest(found: Grounds) -> Said:
    texts, of_all = found.texts, found.of_all
    if of_all is None:
        return [texts.said("honest.none")]
    said: Said = []
    whole = _whole(of_all)
    high, low = _rejected(of_all)
    if whole is not None:
        key = f"honest.{'high' if high else 'low' if low else 'yes'}"
        said.append(texts.said(key, n=whole.points, **_factor(texts, whole.factor, whole.factor_interval)))
    for part in ("e", "n", "h", "plan"):
        own = of_all.prediction[part]
        if own is not None and (own.rejected_high or own.rejected_low):
            fields = _factor(texts, own.factor, own.factor_interval)
            said.append(texts.said("honest.part", component=texts(f"component.{part}"), **fields))
    shifts = [(part, own) for part, own in of_all.bias.items() if own is not None]
    for part, shift in shifts:
        if shift.rejected:
            fields = {
                "component": texts(f"component.{part}"),
                "mean": texts.length(shift.mean),
                "expanded": texts.length(shift.expanded),
                "k": texts.number(shift.expanded / shift.sd_of_mean, 2),
                "p": texts.percent(found.asked.coverage),
            }
            said.append(texts.said("bias.found", **fields))
    if shifts and not any(shift.rejected for _, shift in shifts):
        said.append(texts.said("bias.none"))
    return [*said, *_surface(texts, of_all.surface), *_points(found, of_all.points)]


def _surface(texts: Texts, found: Surface | None) -> Said:
    if found is None:
        return [texts.said("surface.few")]
    p = texts.probability(found.p)
    if not found.rejected:
        return [texts.said("surface.none", p=p)]
    said = [texts.said("surface.found", p=p)]
    largest = 1 if abs(found.t[1]) > abs(found.t[2]) else 2
    for name, field, k in (("shift", "shift", 0), ("tilt", "rise", largest), ("dome", "bend", 3)):
        if abs(found.t[k]) > critical_normal(LEVEL):
            size, sd = texts.length(float(found.estimate[k])), texts.length(float(found.sd[k]))
            said.append(texts.said(f"surface.{name}", **{field: size, "sd": sd}))
    return said


def _factor(texts: Texts, factor: float, interval: tuple[float, float]) -> dict[str, str]:
    return {
        "factor": texts.number(factor, 2),
        "low": texts.number(interval[0], 2),
        "high": texts.number(interval[1], 2),
    }


def _points(found: Grounds, tests: PointTests) -> Said:
    """Return which single points disagree, and which were set beside."""
    texts, names, without = found.texts, found.compared.names, found.asked.without
    said = [
        texts.said("point.wrong", point=names[row], p=texts.probability(float(tests.least[row])))
        for row in np.flatnonzero(tests.wrong).tolist()[:NAMED]
    ]
    if without:
        reasons = "; ".join(f"{point}: {reason}" for point, reason in without.items())
        said.append(texts.said("point.left", points=texts.listed(list(without)), reasons=reasons))
    return said


def _remarks(found: Grounds) -> list[str]:
    texts, of_all, standards = found.texts, found.of_all, found.standards
    said = [
        texts("unusable", point=name, reason=texts.word("reason", reason))
        for name, reason in found.compared.not_usable[:NAMED]
    ]
    said += [texts("language.missing", sentence=key) for key in texts.missing]
    if not found.result.photo_given_sd.any():
        said.append(texts("assume.fixed"))
    if standards.asprs is not None:
        said += _asprs_remarks(found, standards.asprs)
    if standards.lengths is not None:
        said += _lengths_remarks(texts, standards.lengths)
    if found.layout is not None:
        said += _layout(texts, found.layout)
    shift = None if of_all is None else of_all.bias["h"]
    heights = None if of_all is None else of_all.parts["h"]
    if shift is not None and heights is not None and _two_heights(found.compared, shift, heights):
        said.append(texts("bias.heights", mean=texts.length(shift.mean), sd=texts.length(heights.sd)))
    return said


def _lengths_remarks(texts: Texts, found: Lengths) -> list[str]:
    test, said = found.test, list[str]()
    if not test.enough:
        said.append(texts("lengths.few", lines=test.lines, least=test.least))
    if not math.isfinite(test.longest):
        said.append(texts("lengths.diagonal"))
    elif not test.long_enough:
        said.append(texts("lengths.short", share=texts.percent(test.longest)))
    if not test.along_diagonal:
        said.append(texts("lengths.direction", angle=texts.number(math.degrees(test.off_diagonal), 0)))
    if found.expansion is None:
        said.append(texts("lengths.warm"))
    return said


def _asprs_remarks(found: Grounds, own: Asprs) -> list[str]:
    asked, texts, of_all, of_vegetated = found.asked, found.texts, found.of_all, found.of_vegetated
    said = []
    counts = [0 if of_all is None else of_all.n] if asked.classes else []
    counts += [of_vegetated.n] if of_vegetated is not None else []
    said += [texts("asprs.points", asked=own.points_asked, n=n) for n in counts if n < own.points_asked]
    for name, good in own.survey.items():
        figure = own.figures[name]
        if not good and figure is not None:
            size = {"class": texts.size(asked.classes[name])}
            said.append(texts("asprs.survey", survey=texts.length(figure.survey), **size))
    for name, good in own.control.items():
        rmse = own.control_rmse["hv".index(name)]
        if not good and math.isfinite(rmse):
            # Half a class holds; where heights are no product, the whole horizontal one.
            limit = asked.classes[name] / 2 if name in asked.classes else asked.classes["h"]
            said.append(texts(f"asprs.control.{name}", sd=texts.length(rmse), limit=texts.size(limit)))
    for each in own.remarks[:NAMED]:
        fields = {
            "component": texts(f"component.{each.component}"),
            "value": texts.length(each.value),
            "limit": texts.length(each.limit),
        }
        if each.point is None:
            said.append(texts("asprs.mean", **fields))
        else:
            said.append(texts("asprs.difference", point=found.compared.names[each.point], **fields))
    return said


def _layout(texts: Texts, found: Layout) -> list[str]:
    told: list[tuple[bool, str, dict[str, str | int]]] = [
        (not found.even, "quadrants", {}),
        (not found.apart, "spacing", {"spacing": texts.percent(found.least_spacing)}),
        (found.far > 0, "far", {"percent": texts.percent(found.far)}),
        (found.beyond_control > 0, "outside", {"n": found.beyond_control}),
    ]
    return [texts(f"layout.{name}", **fields) for holds, name, fields in told if holds]


def _two_heights(found: Compared, shift: Bias, own: Sized) -> bool:
    """Return whether heights of two kinds may have been compared: all of one sign, far from 0, and alike."""
    heights = found.differences[found.counted[:, 2], 2]
    one_sign = bool((heights > 0).all() or (heights < 0).all())
    return own.n > 2 and one_sign and abs(shift.z) > HEIGHT_KINDS and own.sd < abs(shift.mean) / 3
