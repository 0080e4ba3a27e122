"""Lenses that are given wrongly: radial terms with the wrong sign or of another unit, half a pixel."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from photogram.diagnosis.adjusting import Adjuster, put_right
from photogram.diagnosis.findings import Finding
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.wider_models import calibrated, calibration_words, freed
from photogram.results.result import Result
from photogram.statistics.evidence import Evidence

RADIAL = re.compile(r"[Kk]([1-6])")
SIGNIFICANT = 5.0
PITCH = (1e-3, 3e-2)
"""Sizes of a pixel that cameras have, millimetres."""
HALF, NEARLY = 0.5, 0.1
"""Pixels."""


def lenses_put_right(block: Block, findings: list[Finding], adjusted: Adjuster) -> Block:
    """Return a block with the radial terms that were meant, where those given do not fit.

    Tried are the other sign, and terms of image coordinates in another unit: divided by the principal
    distance, or pixels whose size is told by K1 as the block has it from zero. One that explains the
    residuals is added to the findings.
    """
    if not any(_given_terms(camera) for camera in block.cameras):
        return block
    first = adjusted.tried(block)
    test = None if first is None or not first.converged else first.global_test
    if test is not None and not test.rejected_high:
        return block
    found = put_right(first, _hypotheses(block, adjusted), adjusted)
    if found is None:
        return block
    text, changed, verdict = found
    values = {"likelihood_ratio": verdict.likelihood, "times_smaller": verdict.fall}
    said = f"probably {text}: residuals would be {verdict.fall:.3g} times smaller"
    findings.append(Finding("lens", "grave", said, values=values))
    return changed


def lenses_estimated(block: Block, findings: list[Finding], adjusted: Adjuster) -> Block:
    """Return a block whose lenses are unknown, as they come out, where that explains the residuals.

    Good observations look gross where the lens is wrong, those of the positions of photos and control first.
    """
    can_be = any(calibration_words(camera) for camera in block.cameras)
    first = adjusted.converged(block) if can_be else None
    if first is None or first.global_test is None or not first.global_test.problem():
        return block
    found = first._findings()
    if not Evidence(found).lens:
        return block
    result = adjusted.converged(block.replace(cameras=[calibrated(camera) for camera in block.cameras]))
    if result is None or result.global_test is None:
        return block
    times = first.global_test.factor / result.global_test.factor
    largest = max((each for each in found.systematic if each.large), key=lambda each: each.fall)
    text = f"{largest.sentence}; {found.calibrate} estimates it: residuals would be {times:.3g} times smaller"
    findings.append(Finding("lens", "grave", text, values={"times_smaller": times}))
    return block.replace(cameras=[each.restarted() for each in result.cameras])


def _given_terms(camera: Camera) -> dict[str, int]:
    """Return the radial terms of a camera that are given and not free, with their numbers."""
    sd = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
    return {
        name: int(match[1])
        for name in camera.names
        if (match := RADIAL.fullmatch(name)) and camera.parameters[name] and math.isfinite(sd[name])
    }


def _hypotheses(block: Block, adjusted: Adjuster) -> Iterator[tuple[str, Block]]:
    """Return what may be wrong with the radial terms of all cameras, and the block that was meant."""
    yield "the radial terms of the lens have the wrong sign", _scaled(block, [-1.0] * len(block.cameras), 0)
    scales = [camera.scale for camera in block.cameras]
    yield (
        "the radial terms of the lens are those of coordinates divided by the principal distance",
        _scaled(block, [1 / each for each in scales], 2),
    )
    yield (
        f"the radial terms of the lens are those of coordinates in {block.image_unit}, and are taken for"
        " those of coordinates divided by the principal distance",
        _scaled(block, scales, 2),
    )
    ratio = _free_ratio(block, adjusted)
    if ratio > 0:
        factor = math.sqrt(ratio)
        pitch = factor if block.image_unit == "px" else 1 / factor
        if PITCH[0] < pitch < PITCH[1]:
            what = "millimetres" if block.image_unit == "px" else "pixels"
            yield (
                f"the radial terms of the lens are those of coordinates in {what} (a pixel of about"
                f" {pitch:.3g} mm)",
                _scaled(block, [factor] * len(block.cameras), 2),
            )


def _scaled(block: Block, factors: list[float], power: int) -> Block:
    """Return a block whose radial terms are multiplied by factor^(power number); by the factor when 0."""
    cameras = []
    for camera, factor in zip(block.cameras, factors, strict=True):
        changed = dict(camera.parameters)
        for name, number in _given_terms(camera).items():
            changed[name] *= factor ** (power * number) if power else factor
        cameras.append(replace(camera, parameters=changed))
    return block.replace(cameras=cameras)


def _free_ratio(block: Block, adjusted: Adjuster) -> float:
    """Return the first radial term as the block has it from zero, in that given; 0 where it is not known."""
    row = next(row for row, camera in enumerate(block.cameras) if _given_terms(camera))
    camera, terms = block.cameras[row], _given_terms(block.cameras[row])
    name = min(terms, key=lambda each: terms[each])
    cameras = list(block.cameras)
    without = {**camera.parameters, **dict.fromkeys(terms, 0.0)}
    cameras[row] = replace(freed(camera, [name.lower()]), parameters=without)
    result = adjusted.converged(block.replace(cameras=cameras))
    if result is None:
        return 0.0
    found = result.cameras[row]
    place = camera.names.index(name)
    if not abs(found.values[place]) > SIGNIFICANT * found.sd[place]:
        return 0.0
    return float(found.values[place] / camera.parameters[name])


def half_pixel(result: Result, adjusted: Adjuster) -> list[Finding]:
    """Look for principal points that are given half a pixel off: pixels counted from their middle or edge."""
    block = result.block
    if block.image_unit != "px":
        return []
    findings = []
    for row, camera in enumerate(block.cameras):
        sd = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
        if {"cx", "cy"} - {*sd} or not all(math.isfinite(sd[name]) for name in ("cx", "cy")):
            continue
        if "w" in camera.names:
            continue
        cameras = list(block.cameras)
        cameras[row] = freed(camera, ["cx", "cy"])
        found = adjusted.converged(block.replace(cameras=cameras))
        if found is None:
            continue
        places = [camera.names.index(name) for name in ("cx", "cy")]
        changes = found.cameras[row].values[places] - camera.values[places]
        deviations = found.cameras[row].sd[places]
        if (np.abs(np.abs(changes) - HALF) < NEARLY).all() and (
            np.abs(changes) > SIGNIFICANT * deviations
        ).all():
            text = (
                f"the principal point of {block.camera_names[row]} is half a pixel off ({changes[0]:+.2f},"
                f" {changes[1]:+.2f} px): are pixels counted from their middle or from their edge?"
            )
            values = {"cx_px": float(changes[0]), "cy_px": float(changes[1])}
            findings.append(Finding("half-pixel", "look", text, values=values))
    return findings
