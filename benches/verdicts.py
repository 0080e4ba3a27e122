"""Whether a green verdict means checked: python benches/verdicts.py [--blocks N] [--seed N] [--clean] ...

Further options: `--snoop` removes gross errors, `--loss huber` or `cauchy` adjusts robustly, `--strict`
counts results as accepted whose exit code is 0 with `--strict`, `--only TEXT` selects mistakes by name,
`--large` has one flight of 500 photos, `--table` prints which mistakes plant each code of the catalogue.

Blocks with one practical mistake each (`planted_mistakes.py`) are adjusted, and the verdict is compared with
the truth: a result is wrong if the mistake moved two other points by more than 5 standard deviations. No
block may be accepted without reserve then. The blocks come from a generator that uses numpy only and not the
simulator of the package (`surveys.py`): `--blocks` of them are controlled by points or positions, and one of
another datum follows each. The same noise is adjusted with and without the mistake, so that the difference is
the mistake's.
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from photogram import PhotogramError, Result, adjust, snoop
from photogram.results.hypotheses import MARGIN
from planted_mistakes import ACCURACY, GIVEN, LARGEST, MISTAKES, TWICE, target
from surveys import Survey, aerial, surveys

WRONG = 5.0  # Standard deviations by which a mistake moves points of a wrong result
SIZES = 0.5, 1.0, 3.0, 10.0  # of planted errors, in minimal detectable biases
MARGINS = 0.25, 0.5, MARGIN, 1.0, 1.25, 1.5  # Standard deviations, see `least_margin`
LENS = "camera-f", "camera-point", "camera-size", "camera-term", "camera-radial"


def codes_of(result: Result) -> np.ndarray:
    """Return the codes of hypotheses; observations have the code of their kind."""
    every = result.reliability_summary.hypotheses
    suspects = every.suspects
    return np.array(
        [
            suspects.observations[int(suspects.subjects[group])].KIND if code == "observation" else code
            for code, group in zip(every.code.tolist(), every.group.tolist(), strict=True)
        ],
        dtype=object,
    )


def size_of(result: Result, hypothesis: str, survey: Survey) -> float:
    """Return the largest component of the MDB of a mistake; NaN if an error of any size is undetected."""
    if result.reliability_summary is None:
        return math.nan
    code, _, axis = hypothesis.partition(" ")
    every, component = result.reliability_summary.hypotheses, "XYZ".index(axis) if axis else -1
    own = (codes_of(result) == code) & (every.component == component) & np.isfinite(every.mdb[:, 0])
    if code == "object-point":
        own &= every.index == target(survey)
    return float(np.nanmax(np.abs(every.mdb[own][:1]), initial=0.0)) if own.any() else math.nan


def least_margin(result: Result) -> float:
    """Return the margin from which on an accepted result would be accepted with reserve only; else -infinity.

    An error is reported if its estimate and so many standard deviations of it move two points too far.
    """
    summary = result.reliability_summary
    if result.verdict.code not in ("accepted", "accepted-not-checked") or summary is None:
        return -math.inf
    return min(map(summary.hypotheses.margin, summary.hypotheses.effects), default=math.inf)


def touched(survey: Survey, wrong: Survey) -> list[int]:
    """Return control points with the mistake, and points whose images have it if these are one or two."""
    control = [int(row) for row in survey.control[(survey.coordinates != wrong.coordinates).any(axis=1)]]
    images = [
        set(zip(own.photos.tolist(), own.seen.tolist(), *own.xy.T.tolist(), strict=True))
        for own in (survey, wrong)
    ]
    points = {int(point) for _, point, _, _ in images[0] ^ images[1] if point < len(survey.points)}
    return [*control, *(points if len(points) <= 2 else [])]


def moved(clean: Result, wrong: Result, own: list[int]) -> float:
    """Return by how many standard deviations two points, that the mistake is not in, have moved at least."""
    count = len(clean.point_positions)
    with np.errstate(all="ignore"):
        ratio = np.abs(wrong.point_positions[:count] - clean.point_positions) / wrong.point_sd[:count]
    largest = np.where(np.isfinite(ratio), ratio, 0.0).max(axis=1)
    largest[own] = 0.0
    return float(np.sort(largest)[-2])


def sharpened(clean: Result, wrong: Result) -> float:
    """Return the factor by which standard deviations of points are too small, median."""
    with np.errstate(all="ignore"):
        return float(np.nanmedian(clean.point_sd / wrong.point_sd[: len(clean.point_sd)]))


def single_error(survey: Survey, hypothesis: str) -> str:
    """Return the name of the observation that has a single error; empty for errors in common."""
    code, first = hypothesis.partition(" ")[0], next(iter(survey.control), -1)
    if code == "distance":
        return "distance p{} - p{}".format(*survey.bars[0])
    of_photo = "of photo " if survey.weighted else ""
    names = {
        "control-point": f"control point p{first}",
        "position": f"position {of_photo}i1",
        "attitude": f"attitude {of_photo}i1",
        "image": f"image of point p{survey.seen[0]} on photo i{survey.photos[0]}",
        "camera": "parameters of camera 1",
    }
    if code == "object-point":
        return f"control point p{target(survey)}"
    return names.get(code, "")


def is_cause(result: Result, hypothesis: str, single: str) -> bool | None:
    """Whether the headline names the true cause, or inseparable ones with it; None if the result is usable.

    `single` is the name of the observation with a single error. A lens model includes the parameters of the
    camera.
    """
    code = result.verdict.code
    fields = result.verdict.message.fields
    if code == "common-error" and result.reliability_summary:
        # Errors whose statistics differ by less than odds of 20 : 1 are inseparable by the data.
        named = [each.fields["named"].code.partition(".")[2] for each in fields["errors"]]
        named += [
            each.code.partition(".")[2]
            for line in result.verdict.lines
            if line.code == "line.inseparable"
            for each in line.fields["others"]
        ]
        true, first = hypothesis.partition(" ")[0], named[0]
        if true == "control-point" and "fixed-point" in named:  # Fixed, and the end of a distance
            return True
        largest: dict[str, float] = defaultdict(float)
        statistics = result.reliability_summary.hypotheses.statistic
        for code, statistic in zip(codes_of(result), statistics.tolist(), strict=True):
            largest[code] = max(largest[code], statistic)
        return true in named or largest[true] > largest[first] - 2 * math.log(20)
    if single and code == "gross-errors":
        return single in str(fields["suspects"][0])
    if single and not hypothesis.startswith("object-point"):
        return None  # Other messages do not name single observations.
    return None if result.verdict.usable else code == "model" and hypothesis in LENS


def print_table() -> None:
    """Print the codes of hypotheses that mistakes have."""
    codes: dict[str, list[str]] = defaultdict(list)
    for name, (hypothesis, _, _) in MISTAKES.items():
        codes[hypothesis.partition(" ")[0] or "-"].append(name)
    for code, names in sorted(codes.items()):
        print(f"{code:22s} {', '.join(names)}")


def main() -> None:
    """Print how verdicts agree with the truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--blocks", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--clean", action="store_true", help="only clean blocks")
    parser.add_argument("--snoop", action="store_true", help="remove gross errors")
    parser.add_argument("--strict", action="store_true", help="exit codes with warnings")
    parser.add_argument("--loss", choices=("huber", "cauchy"), help="adjust robustly")
    parser.add_argument("--only", default="", help="only mistakes with this text in their name")
    parser.add_argument("--large", action="store_true", help="one flight of 500 photos instead of blocks")
    parser.add_argument("--table", action="store_true", help="list the mistakes of each hypothesis")
    options = parser.parse_args()
    if options.table:
        print_table()
        return
    rng = np.random.default_rng(options.seed)
    counts: dict[tuple[str, str], dict[str, int]] = defaultdict(lambda: defaultdict(int))
    causes: dict[str, list[bool]] = defaultdict(list)
    bad, others = list[str](), list[str]()
    margins: dict[str, list[float]] = {"clean": [], "wrong": []}

    def adjusted(survey: Survey) -> Result:
        datum: Mapping[str, Any] = {"datum": "inner"} if survey.is_free else {}
        if options.snoop:
            return snoop(survey.block(), **datum).result  # type: ignore[return-value]
        return adjust(survey.block(), loss=options.loss, **datum)

    chosen = (
        [aerial(rng, 10, 50, 12, True, attitudes=True)] if options.large else surveys(rng, options.blocks)
    )
    for number, survey in enumerate(chosen):
        try:
            clean = adjust(survey.block(), datum="inner" if survey.is_free else None)
            same = adjusted(survey) if options.snoop or options.loss else clean
        except PhotogramError as error:
            print(f"block {number}, {survey.kind}: {error.code}")
            continue
        control = "7 or more control" if len(survey.control) >= 7 else "fewer control"
        counts[f"clean, {survey.kind}", control][same.verdict.code] += 1
        if len(survey.control) >= 7 and len(survey.checks) >= 3:
            margins["clean"].append(least_margin(same))
        if options.clean:
            continue
        for name, (hypothesis, possible, mistake) in MISTAKES.items():
            if not possible(survey) or options.only not in name:
                continue
            unit = size_of(clean, hypothesis, survey) if hypothesis else 1.0
            if math.isnan(unit):
                unit = GIVEN.get(hypothesis, 0.005 if survey.close else 0.1)
            largest = LARGEST.get(hypothesis, math.inf)
            for size in [own for own in SIZES if own * unit <= largest] if hypothesis else (1.0,):
                wrong = mistake(survey, size * unit)
                try:
                    result = adjusted(wrong)
                except PhotogramError as error:
                    counts[name, f"{size:g}"][f"error {error.code}"] += 1
                    continue
                of = f"{survey.kind}, {len(survey.control)} control, {len(survey.bars)} bars"
                verdict = result.verdict
                counts[name, f"{size:g}"][verdict.code] += 1
                good = not verdict.exit_code(strict=True) if options.strict else verdict.code == "accepted"
                off = math.inf if name in TWICE else moved(clean, result, touched(survey, wrong))
                if name in ACCURACY:
                    off = 10 if sharpened(clean, result) > 1.5 or sharpened(result, clean) > 1.5 else 0
                    good = verdict.usable and verdict.code != "accepted-not-checked"
                if off > WRONG and name not in ACCURACY:
                    margins["wrong"].append(least_margin(result))
                if off > WRONG and good:
                    bad.append(f"block {number} ({of}), {name} {size:g}: {off:.1f} sd, {verdict.code}")
                if size >= 3 and hypothesis:
                    first = is_cause(result, hypothesis, single_error(survey, hypothesis))
                    causes[name] += [] if first is None else [first]
                    if first is False:
                        others.append(f"block {number} ({of}), {name} {size:g}: {verdict.headline}")

    for (name, what), found in counts.items():
        print(f"{name:28s} {what:18s}", ", ".join(f"{code} {n}" for code, n in sorted(found.items())))
    for name, found in causes.items():
        print(f"{name:28s} the true cause is named in {sum(found)} of {len(found)} messages")
    print("\nmargin, sd   clean, well controlled, reserved   wrong, accepted")
    for margin in MARGINS:
        clean, wrong = (np.array(margins[kind]) <= margin for kind in ("clean", "wrong"))
        reserved, accepted = f"{clean.sum()} of {len(clean)}", f"{(~wrong).sum()} of {len(wrong)}"
        print(f"{margin:10g}   {reserved:>32s}   {accepted:>15s}")
    print(f"\n{len(bad)} results accepted without reserve; two points are wrong by more than {WRONG:g} sd")
    print(*bad[:60], sep="\n")
    print(f"\n{len(others)} results with another cause")
    print(*others[:60], sep="\n")


if __name__ == "__main__":
    main()
