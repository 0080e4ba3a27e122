"""The verdict of a statement: headline, exit code, sentences, messages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.lazy_dataclasses import dataclass
from photogram.network.refraction import Refraction
from photogram.results.statement.budget import budget_fields
from photogram.results.statement.comparison import LEVEL, limit_of
from photogram.results.statement.figures import Figures, Prediction, Surface
from photogram.results.statement.standards import Asprs, LengthTest, wording
from photogram.results.statement.texts import Texts
from photogram.show.page import Tone
from photogram.show.quantity import members
from photogram.statistics.distributions import critical_normal
from photogram.statistics.freedom import root_mean

if TYPE_CHECKING:
    from photogram import Result, Statement

NOT_USABLE = 4  # Exit code
HEIGHT_KINDS = 10.0  # Mean difference between two height systems (sd)
NAMED = 10
MAX_FIXED_VALUES = 20  # Number of fixed values in a sentence
Said = list[tuple[str, str]]  # Codes and texts
Sentence = tuple[str, dict[str, Any]]  # A code with its fields
_CASES = {
    "missed": "missed",
    "met with confidence": "tested",
    "met": "tested",
    "produced to meet": "produced",
    "not decided": "undecided",
}
"""Sentences of the verdicts on a class with check points."""


@dataclass(frozen=True)
class Judged:
    # Exit code, severity of the headline
    exit: int
    tone: Tone
    headline: str  # A sentence
    # Keys and texts
    sentences: Said
    assumptions: Said
    remarks: list[str]  # Messages that do not change the exit code


def judged(found: Statement) -> Judged:
    texts, asprs, test, of_all = found.texts, found.standards.asprs, found.standards.lengths, found.of_all
    verdict, strict, whole = found.result.verdict, found.strict, None if test is None else test.together
    overall = of_all and _whole(of_all)
    side = overall and overall.rejected
    met = test is not None and bool(test.met)
    lengths = whole is not None and (whole.rejected_high or whole.rejected_low)
    control = [each for each in found.left_out if each.p < limit_of(found.left_out)]
    classes = set[str]() if asprs is None else {*asprs.verdicts.values()}
    # The first true rule gives the headline; those of `grave` also the exit code.
    grave = {
        "verdict": not verdict.usable,
        "missed": "missed" in classes or (test is not None and test.met is False),
        "high": side == "high",
        "unchecked": verdict.code == "accepted-not-checked",
        "warning": strict and verdict.warning,
        "control": strict and bool(control),
        "lengths": strict and lengths,
        "low": side == "low",
    }
    others = {
        "none": of_all is None and (not met or "not tested" in classes),
        "found": not classes.isdisjoint({"not decided", "not tested"}),
        "produced": "produced to meet" in classes,
        "met": bool(classes) or met,
    }
    name = next((name for name, holds in (grave | others).items() if holds), "found")
    exit_code = NOT_USABLE if name in grave and (strict or name != "low") else 0
    headline = {
        "verdict": texts.text(verdict.message),
        "points": texts.listed([each.point for each in control], NAMED),
        "n": 0 if of_all is None else of_all.n,
    }
    remarks = [texts(code, **fields) for code, fields in _remarks(found)]
    remarks += [texts("control.wrong", point=each.point, p=each.p) for each in control[:NAMED]]
    doubtful = bool(control) or verdict.warning or side == "low" or lengths or _doubtful(of_all)
    return Judged(
        exit=exit_code,
        tone="bad" if exit_code else "look" if remarks or doubtful else "good",
        headline=texts(f"headline.{name}", **headline),
        sentences=[
            (code, texts(code, **fields))
            for part in (_asprs, _nssda, _lengths, _honest)
            for code, fields in part(found)
        ]
        + [("budget.line", texts("budget.line", **budget_fields(texts, each))) for each in found.taken_apart],
        assumptions=[(code, texts(code, **fields)) for code, fields in _assumptions(found)],
        remarks=remarks,
    )


def _whole(of_all: Figures) -> Prediction | None:
    return of_all.prediction["all"] or of_all.prediction["h"] or of_all.prediction["plan"]


def _doubtful(of_all: Figures | None) -> bool:
    """Return whether check points are missing, or some test does not agree."""
    if of_all is None:
        return True
    tests = (*of_all.prediction.values(), *of_all.bias.values(), of_all.surface)
    return any(test and test.rejected for test in tests) or bool(of_all.points.wrong.any())


def _asprs(of: Statement) -> Iterator[Sentence]:
    found = of.standards.asprs
    if found is None:
        return
    for name in ("h", "v", "3d"):
        figure, size = found.figures[name], of.asked.classes.get(name)
        own = {} if figure is None else {"n": figure.count, f"rmse_{name}": figure.rmse}
        if size is None:
            if figure is not None and name != "3d":
                yield f"asprs.found.{name}", own
        elif figure is not None:
            yield f"asprs.{_CASES[found.verdicts[name]]}.{name}", {**own, "class": size}
        elif name != "3d":
            yield f"asprs.none.{name}", {"class": size, f"loo_{name}": found.leave_one_out[name]}
    if (vegetated := found.figures["vva"]) is not None:
        yield f"asprs.{wording(vegetated.count)}.vva", {"n": vegetated.count, "rmse_v": vegetated.rmse}


def _nssda(of: Statement) -> Iterator[Sentence]:
    found = of.standards.nssda
    if found is None or "nssda" not in of.asked.standards:
        return
    if found.accuracy_r_unequal is not None:
        yield f"nssda.{found.wording}.h", {"accuracy_r": found.accuracy_r_unequal, "n": found.count}
    elif found.ce95 is not None and found.ratio is not None:
        yield "nssda.ce95", members(found, "ratio", "ce95")
    if found.accuracy_z is not None:
        yield f"nssda.{found.wording}.v", {"accuracy_z": found.accuracy_z, "n": found.count}
    if not found.enough:
        yield "nssda.few", {"n": found.count}


def _lengths(of: Statement) -> Iterator[Sentence]:
    texts, found = of.texts, of.standards.lengths
    if found is None:
        return
    own = {"n": len(found.errors), **members(found, "lines", "largest", "rms")}
    if found.limit is None or found.within is None:
        yield "lengths.found", own
    else:
        constant, slope, most = found.limit
        limit = f"{texts.length(constant)} + {texts.significant(slope, 2)} L"
        if math.isfinite(most):
            limit += f" ≤ {texts.length(most)}"
        beyond = int((~found.within).sum())
        yield f"lengths.{'missed' if beyond else 'met'}", {**own, "limit": limit, "beyond": beyond}
    if (whole := found.together) is not None:
        side = "high" if whole.rejected_high else "low" if whole.rejected_low else "agree"
        yield f"lengths.{side}", _factor(whole.factor, whole.interval)


def _honest(found: Statement) -> Iterator[Sentence]:
    texts, of_all = found.texts, found.of_all
    if of_all is None:
        yield "honest.none", {}
        return
    if (whole := _whole(of_all)) is not None:
        fields = {"n": whole.points, **_factor(whole.factor_of_sd, whole.factor_interval_95)}
        yield f"honest.{whole.rejected or 'yes'}", fields
    for part in ("e", "n", "h", "plan"):
        own = of_all.prediction[part]
        if own is not None and own.rejected:
            fields = _factor(own.factor_of_sd, own.factor_interval_95)
            yield "honest.part", {"component": texts(f"component.{part}"), **fields}
    shifts = [(part, own) for part, own in of_all.bias.items() if own is not None]
    for part, shift in shifts:
        if shift.rejected:
            sizes = {"mean": shift.mean, "expanded": shift.expanded, "k": shift.expanded / shift.sd_of_mean}
            component, p = texts(f"component.{part}"), texts.percent(found.asked.coverage)
            yield "bias.found", {"component": component, **sizes, "p": p}
    if shifts and not any(shift.rejected for _, shift in shifts):
        yield "bias.none", {}
    yield from _surface(of_all.surface)
    tests, without = of_all.points, found.asked.without
    for row in np.flatnonzero(tests.wrong).tolist()[:NAMED]:
        yield "point.wrong", {"point": found.compared.names[row], "p": float(tests.least[row])}
    if without:
        reasons = "; ".join(f"{point}: {reason}" for point, reason in without.items())
        yield "point.left", {"points": texts.listed(list(without)), "reasons": reasons}


def _surface(found: Surface | None) -> Iterator[Sentence]:
    if found is None:
        yield "surface.few", {}
        return
    yield f"surface.{'found' if found.rejected else 'none'}", {"p": found.p}
    largest = 1 if abs(found.t[1]) > abs(found.t[2]) else 2
    for name, field, k in (("shift", "shift", 0), ("tilt", "rise", largest), ("dome", "bend", 3)):
        if found.rejected and abs(found.t[k]) > critical_normal(LEVEL):
            yield f"surface.{name}", {field: float(found.estimate[k]), "sd": float(found.sd[k])}


def _factor(factor: float, interval: tuple[float, float]) -> dict[str, Any]:
    return {"factor": factor, "low": interval[0], "high": interval[1]}


def _remarks(found: Statement) -> Iterator[Sentence]:
    texts, of_all, standards = found.texts, found.of_all, found.standards
    for name, code in found.compared.not_usable[:NAMED]:
        yield "unusable", {"point": name, "reason": texts(f"reason.{code}")}
    for key in texts.missing:
        yield "language.missing", {"sentence": key}
    if not found.result.photo_given_sd.any():
        yield "assume.fixed", {}
    if standards.asprs is not None:
        yield from _asprs_remarks(found, standards.asprs)
    if standards.lengths is not None:
        yield from _lengths_remarks(texts, standards.lengths)
    if (layout := found.layout) is not None:
        for holds, name, fields in (
            (not layout.even, "quadrants", {}),
            (not layout.apart, "spacing", {"spacing": layout.least_spacing_over_diagonal}),
            (layout.share_of_area_far > 0, "far", {"percent": layout.share_of_area_far}),
            (layout.outside_control > 0, "outside", {"n": layout.outside_control}),
        ):
            if holds:
                yield f"layout.{name}", fields
    shift = None if of_all is None else of_all.bias["h"]
    heights = None if of_all is None else of_all.parts["h"]
    if shift is not None and heights is not None and heights.n > 2:
        # Two height systems: all differences have the same sign, are far from 0, and similar.
        signs = np.sign(found.compared.differences[found.compared.counted[:, 2], 2])
        alike = heights.sd < abs(shift.mean) / 3
        if abs(signs.sum()) == len(signs) and abs(shift.z) > HEIGHT_KINDS and alike:
            yield "bias.heights", {"mean": shift.mean, "sd": heights.sd}


def _lengths_remarks(texts: Texts, test: LengthTest) -> Iterator[Sentence]:
    if not test.enough:
        yield "lengths.few", members(test, "lines", "least")
    if not math.isfinite(test.longest):
        yield "lengths.diagonal", {}
    elif not test.long_enough:
        yield "lengths.short", {"share": test.longest}
    if not test.along_diagonal:
        yield "lengths.direction", {"angle": texts.number(math.degrees(test.off_diagonal), 0)}
    if test.expansion is None:
        yield "lengths.warm", {}


def _asprs_remarks(found: Statement, own: Asprs) -> Iterator[Sentence]:
    asked, texts, of_all, of_vegetated = found.asked, found.texts, found.of_all, found.of_vegetated
    counts = [0 if of_all is None else of_all.n] if asked.classes else []
    for n in [*counts, *([] if of_vegetated is None else [of_vegetated.n])]:
        if n < own.points_asked:
            yield "asprs.points", {"asked": own.points_asked, "n": n}
    for name, good in own.survey_good_enough.items():
        figure = own.figures[name]
        if not good and figure is not None:
            yield "asprs.survey", {"survey": figure.survey, "class": asked.classes[name]}
    for name, good in own.control_good_enough.items():
        rmse = own.control_rmse[name]
        if not good and math.isfinite(rmse):
            yield f"asprs.control.{name}", {"sd": rmse, "limit": texts.size(own.control_limits[name])}
    for each in own.remarks[:NAMED]:
        fields = {"component": texts(f"component.{each.component}"), **members(each, "value", "limit")}
        if each.point is None:
            yield "asprs.mean", fields
        else:
            yield "asprs.difference", {"point": found.compared.names[each.point], **fields}


def _assumptions(found: Statement) -> Iterator[Sentence]:
    """Yield the assumptions in reading files, and on removed observations."""
    asked, texts, layout, lengths = found.asked, found.texts, found.layout, found.standards.lengths
    yield from _weights(found)
    for each in found.assumed:
        yield "assume.read", {"said": each}
    yield from _adjustment(found)
    if len(found.compared):
        sd = found.compared.survey_sd
        if not sd[np.isfinite(sd)].any():
            yield "assume.survey_exact", {}
        else:
            roots = (root_mean(column**2) for column in sd.T)
            yield "assume.survey", dict(zip(("east", "north", "height"), roots, strict=True))
        if any(asked.survey_common_sd):
            size = " / ".join(texts.length(each) for each in asked.survey_common_sd)
            yield f"assume.common{'_cancels' if asked.survey_common_in_control else ''}", {"size": size}
        yield f"assume.independent.{asked.independent or 'undeclared'}", {}
        if found.compared.step > 1:
            yield "assume.taken", {"all": found.compared.known, "step": found.compared.step}
        yield "assume.heights", {}
        if "asprs-2023" in asked.standards:
            yield "assume.slopes", {}
    if layout is not None:
        quadrants = " / ".join(map(texts.percent, layout.share_in_quadrants))
        fields = {"spacing": layout.least_spacing_over_diagonal, "diagonal": texts.length(layout.diagonal, 3)}
        yield "assume.layout", {"n": layout.count, "quadrants": quadrants, **fields}
    if lengths is not None and lengths.expansion is not None:
        yield "lengths.reference", {"expansion": texts.significant(lengths.expansion, 3)}
    yield "assume.not_covered", {}


def _weights(found: Statement) -> Iterator[Sentence]:
    result, texts = found.result, found.texts
    test, components = result.global_test, found.asked.components
    if components is not None:
        parts = [
            f"{texts.kind(each.name)} x {texts.number(each.factor_of_sd, 2)}"
            f" ({' – '.join(texts.number(end, 2) for end in each.interval_of_sd)})"
            for each in components.components
            if not each.held
        ]
        yield "weights.components", {"components": ", ".join(parts)}
    elif test is not None:
        low, high = (texts.number(each, 3) for each in test.limits)
        side = "high" if test.rejected_high else "low" if test.rejected_low else "given"
        yield f"weights.{side}", {"s2": texts.number(test.variance, 3), "low": low, "high": high}
    if math.isinf(result.freedom_of_scale):
        yield "weights.known", {}
        return
    s2, f = texts.number(result.covariance_scale, 3), texts.number(result.degrees_of_freedom, 0)
    yield "weights.posterior", {"s2": s2, "f": f}
    yield "honest.approximate", {}


def _adjustment(found: Statement) -> Iterator[Sentence]:
    result, texts, block = found.result, found.texts, found.result.block
    total, out = int(result.used_images.sum()), len(found.removed)
    removed = {"n": out, "all": total + out, "percent": out / (total + out)} if out else {}
    yield f"assume.{'removed' if out else 'none_removed'}", removed
    held = fixed_values(texts, result)
    yield f"assume.{'held' if held else 'none_held'}", {"held": held}
    frame = f"{texts.text(block.frame.phrase)}, {block.linear_unit}"
    yield "assume.datum", {"datum": result.datum.phrase, "frame": frame}
    yield "assume.refraction", {"refraction": (block.refraction or Refraction()).phrase(block.linear_unit)}


def fixed_values(texts: Texts, result: Result) -> str:
    """Return the names of fixed points, photos and parameters; empty without any."""
    block = result.block
    points = (block.point_sd == 0).any(axis=1)
    photos = (block.photo_position_sd == 0).any(axis=1) | (block.photo_attitude_sd == 0).any(axis=1)
    names = [texts("held.point", name=block.point_ids[row]) for row in np.flatnonzero(points)]
    names += [texts("held.photo", name=block.photo_ids[row]) for row in np.flatnonzero(photos)]
    for camera in result.cameras:
        fixed = [name for name, sd in zip(camera.names, camera.sd.tolist(), strict=True) if not sd > 0]
        if fixed:
            names.append(texts("held.camera", parameters=", ".join(fixed), name=camera.name))
    return texts.listed(names, MAX_FIXED_VALUES) if names else ""
