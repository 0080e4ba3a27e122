"""Lenses of certificates that observations contradict: sign of the distortion, principal point."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from photogram.diagnosis.lenses import radial_scaled
from photogram.diagnosis.mistakes import Proposal, explain_test
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.cameras import Camera
from photogram.network.wider_models import freed
from photogram.results.network_trial import KINDS, type_name
from photogram.results.parts import AdjustedCamera
from photogram.results.result import Result
from photogram.results.tables import Tests
from photogram.words import Phrase, phrase

POINT = ["xp", "yp"]
CHANCE = 1e-4  # Probability of any hint in correct data
WITHIN, INDICATED = 3.0, 1e-3
"""Largest difference from the opposite of the given principal point, in standard deviations, and largest
distance of an indicated one from the origin, mm."""


def lens_hints(result: Result) -> list[Message]:
    """Return mistakes in weighted lenses of films whose test as a group rejects."""
    of_photos = result.block.photo_cameras
    if of_photos is None or result.loss is not None or not result.films:
        return []
    of_films = {int(of_photos[row]) for row, _ in result.films}
    found = []
    for tests in Tests(result).groups:
        if tests.kind != type_name(KINDS.index("camera")) or tests.rows is None:
            continue
        for _, (place,) in tests.beyond(CHANCE / len(of_films)):
            row = int(tests.rows[place])
            proposals, statistic = _proposals(result.block, row), float(tests.values[place])
            if row in of_films and (meant := explain_test(result, proposals, statistic)):
                proposal, changed = meant
                of_point = proposal.parameters and _of_point(result.block.cameras[row], changed.cameras[row])
                found.append(Message(of_point or proposal.message))
    return found


def _proposals(block: Block, row: int) -> Iterator[Proposal]:
    """Yield the opposite radial distortion, and a free principal point, of a camera."""
    camera = block.cameras[row]
    sign = phrase("film-lens.sign", camera=block.camera_names[row])
    yield Proposal("sign", sign, partial(_with, row=row, camera=radial_scaled(camera, -1.0)))
    free = freed(camera, POINT)
    yield Proposal("point", phrase("film-lens.point"), partial(_with, row=row, camera=free), parameters=2)


def _with(block: Block, row: int, camera: Camera) -> Block:
    return block.replace(cameras=[camera if k == row else own for k, own in enumerate(block.cameras)])


def _of_point(given: Camera, found: AdjustedCamera) -> Phrase:
    """Return the observed principal point, and the probable mistake in the given one."""
    rows = [found.names.index(name) for name in POINT]
    values, sd, old = found.values[rows], found.sd[rows], given.values[rows]
    size = float(np.hypot(*old))
    opposite = (np.abs(values + old) < WITHIN * sd).all() and size > WITHIN * float(sd.max())
    code = "signs" if opposite else "indicated" if size < INDICATED else "point"
    (x, y), (sd_x, sd_y), (given_x, given_y) = values.tolist(), sd.tolist(), old.tolist()
    fields = {"x": x, "y": y, "sd_x": sd_x, "sd_y": sd_y, "given_x": given_x, "given_y": given_y}
    return phrase(f"film-lens.{code}", camera=found.name, **fields)
