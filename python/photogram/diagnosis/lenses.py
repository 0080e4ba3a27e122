"""Wrong lens parameters: sign or unit of radial terms, principal points, half-pixel offsets."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from photogram.diagnosis.findings import Finding, finding
from photogram.diagnosis.mistakes import MOST, Adjuster, Explained, Proposal, explain
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.results.network_trial import KINDS, type_name
from photogram.results.result import Result
from photogram.results.tables import Tests
from photogram.words import Phrase, phrase

RADIAL = re.compile(r"[AKk]([1-6])")
SIGNIFICANT = 5.0
HALF, NEARLY = 0.5, 0.1  # Pixels
POINT = ("xp", "yp")
CHANCE = 1e-4  # Probability of any message on a certificate in correct data
WITHIN = 3.0  # Standard deviations of an error that equals twice the given value
INDICATED = 1e-3  # Largest distance of an indicated principal point from the origin, mm


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
    """Multiply radial terms of all cameras by factor^(power number), or the factor if `power` is 0."""
    cameras = []
    for camera, factor in zip(block.cameras, factors, strict=True):
        terms = {
            name: camera.parameters[name] * factor ** (power * number or 1)
            for name, number in _given_terms(camera).items()
        }
        cameras.append(replace(camera, parameters={**camera.parameters, **terms}))
    return block.replace(cameras=cameras)


def certificate_hints(result: Result) -> list[Message]:
    """Return mistakes in weighted lenses of films whose test as a group rejects."""
    of_photos, summary = result.block.photo_cameras, result.reliability_summary
    if of_photos is None or summary is None or result.loss is not None or not result.films:
        return []
    films, found = {int(of_photos[row]) for row, _ in result.films}, list[Message]()
    kind, suspects = KINDS.index("camera"), summary.suspects
    for tests in Tests(result).groups:
        if tests.kind != type_name(kind) or tests.rows is None:
            continue
        for _, (place,) in tests.beyond(CHANCE / len(films)):
            row = int(tests.rows[place])
            group = int(np.flatnonzero((suspects.kinds == kind) & (suspects.subjects == row))[0])
            if row in films and (message := _of_certificate(result, row, group)) is not None:
                found.append(Message(message))
    return found


def _of_certificate(result: Result, row: int, group: int) -> Phrase | None:
    """Return the sign of the distortion, or the principal point, if its errors explain the test of a camera.

    An opposite sign is an error of twice the given value.
    """
    summary, camera, title = result.reliability_summary, result.block.cameras[row], result.cameras[row].name
    assert summary is not None
    errors, tests = summary.hypotheses, summary.tests
    parts = np.flatnonzero((errors.group == group) & (errors.component >= 0))
    names = [camera.names[component] for component in errors.component[parts].tolist()]
    squares = dict(zip(names, errors.statistic[parts].tolist(), strict=True))
    sizes = dict(zip(names, errors.estimate[parts, 0].tolist(), strict=True))
    least = MOST * float(tests.statistic[group])
    for name in {*_given_terms(camera)} & {*names}:
        error, sd = sizes[name], abs(sizes[name]) / math.sqrt(squares[name])
        if squares[name] > least and abs(error - 2 * camera.parameters[name]) < WITHIN * sd:
            return phrase("film-lens.sign", camera=title)
    if not {*POINT} <= {*names} or sum(squares[name] for name in POINT) < least:
        return None
    rows = summary.suspects.rows(group)[[names.index(name) for name in POINT]]
    old, sd = np.array([camera.parameters[name] for name in POINT]), tests.error_sd[rows]
    values, size = old - tests.error[rows], float(np.hypot(*old))
    opposite = (np.abs(values + old) < WITHIN * sd).all() and size > WITHIN * float(sd.max())
    code = "signs" if opposite else "indicated" if size < INDICATED else "point"
    fields = {"x": values[0], "y": values[1], "sd_x": sd[0], "sd_y": sd[1]}
    fields |= {"given_x": old[0], "given_y": old[1]}
    return phrase(f"film-lens.{code}", camera=title, **{name: float(own) for name, own in fields.items()})


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
