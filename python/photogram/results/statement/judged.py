"""The one judgement of a statement: headline, exit code, sentences, assumptions and remarks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogram.messages import listed
from photogram.results.result import Result
from photogram.results.statement.asked import Asked
from photogram.results.statement.assumed import assumptions
from photogram.results.statement.budget import Budget, written
from photogram.results.statement.compared import Compared
from photogram.results.statement.figures import Figures
from photogram.results.statement.layout import Layout
from photogram.results.statement.standards import Asprs, Lengths, Standards
from photogram.results.statement.texts import Texts
from photogram.show.page import Tone

__all__ = ["Judged", "Said", "judged"]

NOT_USABLE = 4
"""Exit code of a statement that must not be handed over as it is."""
Said = list[tuple[str, str]]
"""Keys of the table of words, and texts."""
HEIGHT_KINDS = 10.0
"""Standard deviations of a mean difference of heights beyond which heights of two kinds may have been compared."""
NAMED = 10


@dataclass(frozen=True)
class Judged:
    """What a statement says.

    Attributes
    ----------
    exit, tone
        Exit code, and how the headline is to be taken.
    headline
        A sentence.
    sentences, assumptions
        Keys and texts.
    remarks
        What is to be looked at, without an exit code of its own.
    """

    exit: int
    tone: Tone
    headline: str
    sentences: Said
    assumptions: Said
    remarks: list[str]


def judged(
    result: Result,
    asked: Asked,
    texts: Texts,
    found: Compared,
    of_all: Figures | None,
    of_vegetated: Figures | None,
    taken_apart: Sequence[Budget],
    standards: Standards,
    layout: Layout | None,
    *,
    removed: Sequence[str] = (),
    strict: bool = False,
) -> Judged:
    """Return what the statement says of all that was found."""
    high, low = _rejected(of_all)
    missed = _missed(standards)
    verdict = result.verdict
    spoilt = verdict.exit_code(strict=strict) == NOT_USABLE
    bad = spoilt or missed or high or (low and strict)
    remarks = _remarks(asked, texts, found, of_all, of_vegetated, standards, layout)
    key = _headline(spoilt, missed, high, low, of_all, standards)
    headline = texts(key, verdict=verdict.headline) if spoilt else texts(key, n=0 if of_all is None else of_all.n)
    return Judged(
        exit=NOT_USABLE if bad else 0,
        tone="bad" if bad else "look" if low or remarks or of_all is None else "good",
        headline=headline,
        sentences=[
            *_asprs(asked, texts, of_all, standards.asprs),
            *(_nssda(texts, standards) if "nssda" in asked.standards else []),
            *_lengths(texts, standards.lengths),
            *_honest(texts, of_all),
            *_points(asked, texts, found, of_all),
            *(("budget.line", _budget(texts, each)) for each in taken_apart),
        ],
        assumptions=assumptions(result, asked, texts, found, layout, removed),
        remarks=remarks,
    )


def _rejected(of_all: Figures | None) -> tuple[bool, bool]:
    """Return whether the whole test finds differences larger, or smaller, than predicted."""
    whole = None if of_all is None else of_all.prediction["all"] or of_all.prediction["h"] or of_all.prediction["plan"]
    return (False, False) if whole is None else (whole.rejected_high, whole.rejected_low)


def _missed(standards: Standards) -> bool:
    classes = () if standards.asprs is None else standards.asprs.verdicts.values()
    return "missed" in classes or (standards.lengths is not None and standards.lengths.test.met is False)


def _headline(
    spoilt: bool, missed: bool, high: bool, low: bool, of_all: Figures | None, standards: Standards
) -> str:
    verdicts = [] if standards.asprs is None else list(standards.asprs.verdicts.values())
    met = standards.lengths is not None and standards.lengths.test.met
    for holds, name in (
        (spoilt, "verdict"),
        (missed, "missed"),
        (high, "high"),
        (low, "low"),
        (of_all is None and not met, "none"),
        ("produced to meet" in verdicts or "not decided" in verdicts, "produced"),
        (bool(verdicts) or bool(met), "met"),
    ):
        if holds:
            return f"headline.{name}"
    return "headline.found"


def _asprs(asked: Asked, texts: Texts, of_all: Figures | None, found: Asprs | None) -> Said:
    if found is None:
        return []
    said: Said = []
    for name in ("h", "v", "3d"):
        figure, size = found.figures[name], asked.classes.get(name)
        own = {f"rmse_{name}": texts.length(figure.rmse)} if figure is not None else {}
        if size is None:
            if figure is not None and name != "3d":
                said.append((f"asprs.found.{name}", texts(f"asprs.found.{name}", n=figure.count, **own)))
        elif figure is not None:
            case = "missed" if found.verdicts[name] == "missed" else found.words
            key = f"asprs.{case}.{name}"
            said.append((key, texts(key, n=figure.count, **{"class": texts.size(size)}, **own)))
        elif name != "3d":
            key = f"asprs.none.{name}"
            left = {f"loo_{name}": texts.length(found.left_out[name])}
            said.append((key, texts(key, **{"class": texts.size(size)}, **left)))
    vegetated = found.figures["vva"]
    if vegetated is not None:
        text = texts("asprs.found.vva", n=vegetated.count, rmse_v=texts.length(vegetated.rmse))
        said.append(("asprs.found.vva", text))
    del of_all
    return said


def _nssda(texts: Texts, standards: Standards) -> Said:
    found = standards.nssda
    if found is None:
        return []
    case = "tested" if found.enough else "compiled"
    said: Said = []
    if found.accuracy_r is not None:
        key = f"nssda.{case}.h"
        said.append((key, texts(key, accuracy=texts.length(found.accuracy_r), n=found.count)))
    elif found.ce95 is not None and found.ratio is not None:
        text = texts("nssda.unequal", ratio=texts.number(found.ratio, 2), ce95=texts.length(found.ce95))
        said.append(("nssda.unequal", text))
    if found.accuracy_z is not None:
        key = f"nssda.{case}.v"
        said.append((key, texts(key, accuracy=texts.length(found.accuracy_z), n=found.count)))
    return said


def _lengths(texts: Texts, found: Lengths | None) -> Said:
    if found is None:
        return []
    test = found.test
    n, largest = len(test.errors), texts.length(test.largest)
    if found.limit is None or test.within is None:
        text = texts("lengths.found", n=n, largest=largest, rmse=texts.length(test.rms))
        return [("lengths.found", text)]
    limit = {
        "a": texts.length(found.limit.constant),
        "k": texts.significant(found.limit.slope, 2),
        "b": texts.length(found.limit.most),
    }
    if test.met:
        return [("lengths.met", texts("lengths.met", n=n, largest=largest, **limit))]
    count = int((~test.within).sum())
    return [("lengths.missed", texts("lengths.missed", n=n, count=count, largest=largest, **limit))]


def _honest(texts: Texts, of_all: Figures | None) -> Said:
    if of_all is None:
        return [("honest.none", texts("honest.none"))]
    said: Said = []
    whole = of_all.prediction["all"] or of_all.prediction["h"] or of_all.prediction["plan"]
    high, low = _rejected(of_all)
    if whole is not None:
        key = f"honest.{'high' if high else 'low' if low else 'yes'}"
        said.append((key, texts(key, n=whole.points, **_factor(texts, whole.factor, whole.factor_interval))))
    for part in ("e", "n", "h", "plan"):
        own = of_all.prediction[part]
        if own is not None and (own.rejected_high or own.rejected_low):
            fields = _factor(texts, own.factor, own.factor_interval)
            text = texts("honest.part", component=texts(f"component.{part}"), **fields)
            said.append(("honest.part", text))
    for part in ("e", "n", "h"):
        shift = of_all.bias[part]
        if shift is not None and shift.rejected:
            text = texts(
                "bias.shift",
                component=texts(f"component.{part}"),
                mean=texts.length(shift.mean),
                expanded=texts.length(shift.expanded),
                p=texts.significant(shift.p, 2),
            )
            said.append(("bias.shift", text))
    return [*said, *_surface(texts, of_all)]


def _factor(texts: Texts, factor: float, interval: tuple[float, float]) -> dict[str, str]:
    return {
        "factor": texts.number(factor, 2),
        "low": texts.number(interval[0], 2),
        "high": texts.number(interval[1], 2),
    }


def _surface(texts: Texts, of_all: Figures) -> Said:
    found = of_all.surface
    if found is None or not found.rejected:
        return []
    k = int(np.argmax(np.abs(found.t)))
    name = ("shift", "x", "y", "dome")[k]
    fields = {"value": texts.length(float(found.estimate[k])), "sd": texts.length(float(found.sd[k]))}
    if name != "shift":
        fields["length"] = texts.length(found.scale, 3)
    text = texts(
        "surface.bent", p=texts.significant(found.p, 2), largest=texts(f"surface.{name}", **fields)
    )
    return [("surface.bent", text)]


def _points(asked: Asked, texts: Texts, found: Compared, of_all: Figures | None) -> Said:
    """Return which single points disagree, and which were set beside."""
    said: Said = []
    if of_all is not None:
        tests = of_all.points
        least = np.fmin(tests.p, tests.p_others)
        for row in np.flatnonzero(least < tests.limit).tolist()[:NAMED]:
            text = texts("point.wrong", point=found.names[row], p=texts.significant(float(least[row]), 2))
            said.append(("point.wrong", text))
    if asked.without:
        reasons = "; ".join(f"{point}: {reason}" for point, reason in asked.without.items())
        said.append(("point.left", texts("point.left", points=listed(list(asked.without)), reasons=reasons)))
    return said


def _budget(texts: Texts, found: Budget) -> str:
    value, u, expanded = written(texts, found)
    return texts(
        "budget.line",
        quantity=found.quantity,
        value=value,
        u=u,
        expanded=expanded,
        k=texts.number(found.k, 2),
        p=texts.percent(found.coverage),
    )


def _remarks(
    asked: Asked,
    texts: Texts,
    found: Compared,
    of_all: Figures | None,
    of_vegetated: Figures | None,
    standards: Standards,
    layout: Layout | None,
) -> list[str]:
    said = [texts("unusable", point=name, reason=reason) for name, reason in found.not_usable[:NAMED]]
    said += [f"{key}: en" for key in texts.missing]
    if standards.asprs is not None:
        said += _asprs_remarks(asked, texts, found, of_all, of_vegetated, standards.asprs)
    if standards.lengths is not None:
        test = standards.lengths.test
        if not (test.enough and test.long_enough):
            lacking = f"{test.lines} x {test.least}, {texts.percent(test.longest)} %"
            said.append(texts("lengths.arrangement", lacking=lacking))
        if not standards.lengths.at_reference:
            said.append(texts("lengths.temperature"))
    if layout is not None:
        said += _layout(texts, layout)
    if _two_heights(of_all) and of_all is not None and of_all.bias["h"] is not None:
        said.append(texts("assume.height_kinds", mean=texts.length(of_all.bias["h"].mean)))
    return said


def _asprs_remarks(
    asked: Asked,
    texts: Texts,
    found: Compared,
    of_all: Figures | None,
    of_vegetated: Figures | None,
    own: Asprs,
) -> list[str]:
    said = []
    area = f"{texts.significant(own.area, 3)} km²"
    n = 0 if of_all is None else of_all.n
    if asked.classes and n < own.points_asked:
        said.append(texts("asprs.number", asked=own.points_asked, area=area, n=n))
    if of_vegetated is not None and of_vegetated.n < own.points_asked:
        said.append(texts("asprs.number.vva", asked=own.points_asked, area=area, n=of_vegetated.n))
    for name, good in own.survey.items():
        figure = own.figures[name]
        if not good and figure is not None:
            size = {"class": texts.size(asked.classes[name])}
            said.append(texts(f"asprs.survey.{name}", survey=texts.length(figure.survey), **size))
    for name, good in own.control.items():
        rmse = own.control_rmse["hv".index(name)]
        if not good and math.isfinite(rmse):
            limit = asked.classes.get("v", asked.classes["h"]) if name == "v" else asked.classes["h"]
            said.append(
                texts(f"asprs.control.{name}", survey=texts.length(rmse), **{"class": texts.size(limit)})
            )
    for each in own.remarks[:NAMED]:
        component, value = texts(f"component.{each.component}"), texts.length(each.value)
        if each.point is None:
            said.append(texts("asprs.mean", component=component, mean=value))
        else:
            point = found.names[each.point]
            said.append(texts("asprs.blunder", component=component, difference=value, point=point))
    return said


def _layout(texts: Texts, found: Layout) -> list[str]:
    said = []
    if not found.even:
        said.append(texts("layout.quadrants"))
    if not found.apart:
        said.append(texts("layout.spacing", spacing=texts.percent(found.least_spacing)))
    if found.far > 0:
        said.append(texts("layout.far", percent=texts.percent(found.far)))
    if found.beyond_control:
        said.append(texts("layout.outside", n=found.beyond_control))
    return said


def _two_heights(of_all: Figures | None) -> bool:
    """Return whether heights of two kinds may have been compared: all of one sign, far from 0, and alike."""
    if of_all is None:
        return False
    shift, own = of_all.bias["h"], of_all.parts["h"]
    if shift is None or own is None or own.n < 3 or not abs(shift.z) > HEIGHT_KINDS:
        return False
    return own.sd < abs(shift.mean) / 3
