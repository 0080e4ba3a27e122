"""Wrong lens parameters: sign or unit of radial terms, half-pixel offsets."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.diagnosis.findings import Finding, finding
from photogram.diagnosis.mistakes import Adjuster, Explained, Proposal, explain
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.results.result import Result
from photogram.words import Phrase, phrase

RADIAL = re.compile(r"[AKk]([1-6])")
SIGNIFICANT = 5.0
HALF, NEARLY = 0.5, 0.1  # Pixels


def wrong_terms(block: Block, adjusted: Adjuster) -> Explained | None:
    """Return the mistake in given radial terms that explains the residuals, if any.

    Proposals are the opposite sign, and terms for image coordinates divided by the principal distance or not.
    """
    if not any(_given_terms(camera) for camera in block.cameras):
        return None
    first = adjusted.converged(block)
    if first is not None and not (first.global_test and first.global_test.rejected_high):
        return None
    found = explain(block, _proposals(block), adjusted)
    return found if found is not None and found.is_certain else None


def _given_terms(camera: Camera) -> dict[str, int]:
    """Return the given, not free, radial terms of a camera, with their numbers."""
    sd = dict(zip(camera.names, camera.deviations.tolist(), strict=True))
    return {
        name: int(match[1])
        for name in camera.names
        if (match := RADIAL.fullmatch(name)) and camera.parameters[name] and math.isfinite(sd[name])
    }


def _proposals(block: Block) -> Iterator[Proposal]:
    scales = [camera.scale for camera in block.cameras]
    causes: list[tuple[Phrase, list[float], int]] = [
        (phrase("mistake.lens.sign"), [-1.0] * len(scales), 0),
        (phrase("mistake.lens.divided"), [1 / scale for scale in scales], 2),
        (phrase("mistake.lens.measured", unit=block.image_unit), scales, 2),
    ]
    for message, factors, power in causes:
        yield Proposal(message.code, message, partial(_scaled, factors=factors, power=power))


def _scaled(block: Block, factors: list[float], power: int) -> Block:
    """Multiply the radial terms of all cameras; see :func:`radial_scaled`."""
    pairs = zip(block.cameras, factors, strict=True)
    return block.replace(cameras=[radial_scaled(camera, factor, power) for camera, factor in pairs])


def radial_scaled(camera: Camera, factor: float, power: int = 0) -> Camera:
    """Multiply radial terms by factor^(power number), or the factor if `power` is 0."""
    changed = dict(camera.parameters)
    for name, number in _given_terms(camera).items():
        changed[name] *= factor ** (power * number) if power else factor
    return replace(camera, parameters=changed)


def half_pixel(result: Result) -> list[Finding]:
    """Find fixed principal points with half-pixel offsets by different pixel origins."""
    summary = result.reliability_summary
    if result.block.image_unit != "px" or summary is None:
        return []
    errors, findings = summary.hypotheses, []
    for row in np.flatnonzero(errors.code == "camera-point").tolist():
        error, camera = errors.sets[row], result.block.camera_names[errors.index[row]]
        if error["parameters"] != ["cx", "cy"] or not error["estimate"]:
            continue
        changes = np.array(error["estimate"])
        deviations = np.sqrt(np.diag(np.reshape(error["cofactors"], (2, 2))))
        half = np.abs(np.abs(changes) - HALF) < NEARLY
        if half.all() and (np.abs(changes) > SIGNIFICANT * deviations).all():
            x, y = changes.tolist()
            message = phrase("check.half-pixel", camera=camera, x=x, y=y)
            findings.append(finding("look", message, values={"cx_px": x, "cy_px": y}))
    return findings
