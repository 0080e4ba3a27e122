"""The report of a calibrated night as text, problems first, and as JSON (`docs/stellar-camera.md`)."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.io import json
from photogram.show.angles import ARCSEC
from photogram.show.lines import Field, fact_lines, field, table_lines
from photogram.show.quantity import Quantities, chosen, records
from photogram.show.sections import Section, composed, headline, problems_or_none, verdict_sections
from photogram.stellar.lens_choice import DECISIVE, POSITIVE, LensTest
from photogram.stellar.night_result import CalibratedNight
from photogram.stellar.night_tables import (
    attitudes,
    exposures,
    facts,
    fit,
    images,
    inertial,
    largest,
    lens_tests,
    lenses,
    stars,
)
from photogram.stellar.odds import ACCEPTED, LOG_ODDS
from photogram.stellar.parameters import GRAD


def to_json(result: CalibratedNight) -> bytes:
    """Return the whole result as JSON (UTF-8). What is not a number is null."""
    found, night = result.calibration, result.night
    errors = np.sqrt(np.diag(result.camera.covariance))
    return json.to_json(
        {
            "program": f"photogram {_photocore.__version__}",
            "title": night.title,
            "conventions": {
                "frame": "north, east, zenith (left-handed); azimuth from south, positive west",
                "pixels": "right and down",
                "residual": "measured minus computed; of stars adjusted minus catalogue",
                "standardized": "residual over its mean error",
                "covariance": "cofactors times m squared, in the units of the parameters",
                "icrs": "quaternion w, x, y, z from ICRS to the camera (x right, y down, z along the axis);"
                " covariance of the turn about these axes, radians squared",
            },
            "m": found.mean_error,
            "m_unit": "standard deviation of an image coordinate",
            "sd_px": night.pixel_sd,
            "degrees_of_freedom": found.degrees_of_freedom,
            "iterations": found.iterations,
            "stop": found.status,
            "converged": result.converged,
            "usable": result.usable,
            "verdict": result.verdict.document(),
            "global_test": None
            if result.test is None
            else {
                "variance_of_unit_weight": result.test.variance,
                "limits": result.test.limits,
                "probability": result.test.probability,
            },
            "doubtful": result.doubtful,
            "falsely_identified": result.falsely_identified,
            "lens": {
                "name": result.camera.lens,
                "model": result.camera.facts.model,
                "formula": result.camera.facts.formula,
                "common_scale": result.camera.common_scale,
                "tried": result.lenses,
                "scale_test": _test(result.scale_test),
                "term_tests": [_test(test) for test in result.term_tests],
            },
            "effects": night.site.effects,
            "standstill": None if result.standstill is None else _standstill(result),
            "messages": [str(message) for message in result.messages],
            "parameters": {
                name: {
                    "value": float(value),
                    "mean_error": float(error),
                    "unit": "pixel" if name[0] in "fc" else "",
                }
                for name, value, error in zip(result.camera.names, result.camera.values, errors, strict=True)
            },
            "covariance": {"order": result.camera.names, "matrix": result.camera.covariance},
            "correlated": [{"parameters": [a, b], "correlation": r} for a, b, r in result.correlated()],
            "significance": result.significance(),
            "exposures": records(exposures(result)),
            "stars": records(stars(result)),
            "images": records(images(result)),
        }
    )


def _test(test: LensTest | None) -> dict[str, Any] | None:
    return None if test is None else asdict(test) | {"verdict": test.verdict}


def _standstill(result: CalibratedNight) -> dict[str, Any]:
    test = result.standstill
    assert test is not None
    return {
        "chi_square": test.statistic,
        "degrees_of_freedom": test.dimension,
        "probability": test.probability,
        "own_probability": test.own,
        "turn_arcsec": test.turns / ARCSEC,
        "moved": [result.names[k] for k in test.moved],
    }


_LARGEST = 10


def report(result: CalibratedNight) -> str:
    """Return the report of a calibration."""
    sections = [
        *summary(result),
        ("Exposures", _exposures(result)),
        ("Identification", _identification(result)),
        ("Attitudes in ICRS", _inertial(result)),
        ("Tests of the lens", _lens_tests(result)),
        ("Lenses that were tried", _lenses(result)),
        ("Correlations of the camera", _correlations(result)),
        ("Largest standardized residuals", _images(largest(result, _LARGEST))),
        ("Largest corrections of stars", _stars(result)),
        ("Images and their stars", _images(images(result))),
    ]
    return composed(headline("stellar camera, exposures", result.night.title), sections)


def summary(result: CalibratedNight) -> list[Section]:
    """Return what a reader wants first: verdict, problems, figures, the camera."""
    return [
        *verdict_sections(result.verdict),
        ("Problems", problems_or_none(result.messages, result.verdict)),
        ("Adjustment", _adjustment(result)),
        ("Camera", _camera(result)),
    ]


def _adjustment(result: CalibratedNight) -> list[str]:
    much, good = facts(result)
    return fact_lines([*much, *good])


def _camera(result: CalibratedNight) -> list[str]:
    camera, prior = result.camera, result.night.prior
    errors, significance = np.sqrt(np.diag(camera.covariance)), result.significance()
    lines = [f"{'':<8}{'value':>18}{'mean error':>16}{'over it':>10}"]
    if prior is not None:
        lines[0] += f"{'prior':>18}{'mean error':>16}"
    for i, name in enumerate(result.camera.names):
        held = "as fx" if camera.common_scale and name == "fy" and errors[0] > 0 else "held"
        after = f"{errors[i]:16.4G}" if errors[i] > 0 else f"{held:>16}"
        ratio = f"{significance[name]:10.1f}" if name in significance else f"{'':10}"
        before = ""
        if prior is not None and prior.known[i]:
            sd = math.sqrt(prior.covariance[i, i])
            before = _shown(prior.values[i], sd) + f"{sd:16.4G}"
        lines.append(f"{name:<8}{_shown(camera.values[i], errors[i])}{after}{ratio}{before}".rstrip())
    return [*lines, "fx, fy, cx, cy in pixels; the tests of the lens decide which terms are significant"]


def _shown(value: float, error: float) -> str:
    """Write a value to the second digit of its mean error."""
    return f"{value:18.{max(0, 1 - math.floor(math.log10(error)))}f}" if error > 0 else f"{value:18.9G}"


def _exposures(result: CalibratedNight) -> list[str]:
    names, utc, count, identified, rejected, rms, *_ = fit(result)
    _, azimuth, elevation, angles, errors, *_ = attitudes(result)
    grads = replace(angles, values=angles.values / GRAD, kind="number")
    row = [*field(names, 10, head="name"), *field(utc, 26, head="utc"), *field(count, 7, ".0f", "images")]
    row += [*field(identified, 7, ".0f", "found"), *field(rejected, 9, ".0f", "left out")]
    row += [*field(azimuth, 11, ".5f", "azimuth S"), *field(elevation, 11, ".5f", "elevation")]
    row += [*field(grads, 13, ".6f", "{name}"), *field(errors, 10, ".2f", "sd {name}")]
    said = "azimuth S: from south, positive west; elevation in degrees; angles in grads, sd in arcsec"
    return [*table_lines([*row, *field(rms, 8, ".3f", "rms {unit}")]), said]


def _identification(result: CalibratedNight) -> list[str]:
    """List the odds of exposures, and of the stars that are least certain."""
    names, *_, odds, probabilities, log_odds, least = fit(result)
    lines = table_lines(
        [
            *field(names, 10, head="exposure"),
            _right("by chance", 12, map(_odds, odds.values)),
            _right("probability", 16, map(_probability, probabilities.values)),
            *field(log_odds, 11, ".1f", "log odds"),
            _right("least certain star", 20, map(_probability, least.values)),
        ]
    )
    lines += [
        f"{name:<10}{_odds(expected):>12}{'doubtful':>16}" for name, expected in result.doubtful.items()
    ]
    return [
        *lines,
        "by chance: expected number of wrong attitudes under which as many images have a star; accepted below"
        f" {ACCEPTED:.0E}",
        f"log odds: natural logarithm, by the distances of images and stars; accepted above {LOG_ODDS:.1f}",
    ]


def _right(head: str, width: int, texts: Iterable[str]) -> Field:
    return Field(f"{head:>{width}}", [f"{text:>{width}}" for text in texts])


def _probability(value: float) -> str:
    """Write a probability near 1 by what it misses; nothing for named stars."""
    if math.isnan(value):
        return ""
    return f"1 - {1 - value:.0E}" if 1e-15 < 1 - value < 0.01 else f"{value:.6f}"


def _inertial(result: CalibratedNight) -> list[str]:
    names, ra, dec, quaternions, errors, *_ = inertial(result)
    row = [*field(names, 10, head="exposure"), *field(ra, 12, ".6f", "ra {unit}")]
    row += [*field(dec, 12, ".6f", "dec {unit}"), *field(quaternions, 14, ".9f", "{name}")]
    said = "quaternion w, x, y, z from ICRS to the camera: x right, y down, z along the axis; sd in arcsec"
    return [*table_lines([*row, *field(errors, 12, ".2f", "sd {name}")]), said]


def _lens_tests(result: CalibratedNight) -> list[str]:
    names, f, degrees, p, level, effect, verdict = lens_tests(result)
    lines = table_lines(
        [
            *field(names, 10, head="zero?"),
            *field(f, 12, ".2f", "F"),
            *field(degrees, 8, head="degrees", gap="    "),
            *field(p, 14, ".2G", "probability"),
            *field(level, 10, ".2G", "level"),
            *field(effect, 11, ".3f", "effect {unit}"),
            *field(verdict, 0, head="verdict", gap="  "),
        ]
    )
    order = "terms in the order in which they may be left out, each without those above it"
    return [*lines, order] if lines else []


def _lenses(result: CalibratedNight) -> list[str]:
    names, parameters, images_, unit_weight, over, remarks = lenses(result)
    row = [*field(names, 16, head="lens"), *field(parameters, 11, ".0f", "parameters")]
    row += [*field(images_, 8, ".0f", "images"), *field(unit_weight, 13, ".4f", "unit weight")]
    lines = table_lines([*row, *field(over, 12, ".1f", "BIC - best"), *field(remarks, 0, gap="  ")])
    taken = f"the first is taken; a difference above {DECISIVE:g} is decisive, above {POSITIVE:g} positive"
    return [*lines, taken] if lines else []


def _odds(expected: float) -> str:
    return "named" if math.isnan(expected) else "<1E-99" if expected < 1e-99 else f"{expected:.0E}"


def _correlations(result: CalibratedNight) -> list[str]:
    sd = np.sqrt(np.diag(result.camera.covariance))
    free = np.flatnonzero(sd > 0)
    names = result.camera.names
    lines = [f"{'':<6}" + "".join(f"{names[j]:>8}" for j in free)]
    for i in free:
        values = [result.camera.covariance[i, j] / (sd[i] * sd[j]) for j in free[free <= i]]
        lines.append(f"{names[i]:<6}" + "".join(f"{value:8.3f}" for value in values))
    return lines


def _images(table: Quantities) -> list[str]:
    exposures, stars_, xy, residuals, _, tests, probabilities = table
    return table_lines(
        [
            *field(exposures, 10, head="exposure"),
            *field(stars_, 10, head="star"),
            *field(xy, 11, ".3f"),
            *field(residuals, 9, ".3f", "v{name} {unit}"),
            *field(tests, 8, ".2f", "w {name}"),
            _right("probability", 14, map(_star, probabilities.values)),
        ]
    )


def _star(probability: float) -> str:
    return "named" if math.isnan(probability) else _probability(probability)


def _stars(result: CalibratedNight) -> list[str]:
    table = stars(result)
    size = np.nan_to_num(np.abs(table[3].values)).max(axis=1, initial=0.0)
    names, residuals, _, tests = chosen(table, np.argsort(-size, kind="stable")[:_LARGEST])
    row = [*field(names, 10, head="star"), *field(residuals, 12, ".5f")]
    return table_lines([*row, *field(tests, 8, ".2f", "w {name}")])
