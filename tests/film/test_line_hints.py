"""Jitter of the lines of a scanner, which residuals of images in one line show."""

import numpy as np
import pytest

from example_scripts import load
from photogram import Block, adjust
from photogram.arguments.types import Floats
from photogram.diagnosis.after_adjustment import diagnosed
from photogram.diagnosis.films import line_hints
from photogram.formats import read


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory) -> Block:
    """Return the example with 1,500 points of the ground in place of 60."""
    made, folder = load("make_archive"), tmp_path_factory.mktemp("crowded")
    of_few = made.ground

    def ground(random: np.random.Generator) -> tuple[list[str], Floats]:
        names, places = of_few(random)
        plan = random.uniform([-1600, -1500], [1600, 1500], (1500, 2))
        heights = 90.0 + 60.0 * np.sin(plan[:, 0] / 700.0) * np.cos(plan[:, 1] / 900.0)
        more = [f"m{k:04d}" for k in range(len(plan))]
        return names + more, np.vstack([places, np.column_stack([plan, heights])])

    made.ground = ground
    made.main([str(folder)])
    return read(folder).block


def jittered(block: Block, axis: int, lines: int, size: float) -> Block:
    """Return a block whose scans have lines, 20 pixels together, that are shifted."""
    random = np.random.default_rng(3)
    xy = block.image_xy.copy()
    for photo in range(len(block.photo_ids)):
        own = block.image_photos == photo
        shifts = random.normal(0.0, size, 700)
        xy[own, axis] += shifts[(xy[own, lines] / 20.0).astype(int)]
    return block.replace(image_xy=xy)


def test_lines_that_do_not_jitter_are_not_told(crowded: Block) -> None:
    assert line_hints(adjust(crowded)) == []


@pytest.mark.parametrize(("axis", "lines", "counted"), [(0, 1, "rows"), (1, 1, "rows"), (1, 0, "columns")])
def test_lines_that_jitter_are_told(crowded: Block, axis: int, lines: int, counted: str) -> None:
    result = diagnosed(adjust(jittered(crowded, axis, lines, 0.5)))
    [hint] = line_hints(result)
    fields = hint.phrase.fields
    assert (hint.code, fields["axis"]) == (f"film-check.jitter.{counted}", "xy"[axis])
    assert fields["jitter"] == pytest.approx(0.5, abs=0.15)
    assert fields["sd"] == pytest.approx(np.hypot(0.25, fields["jitter"]), abs=0.02)
    assert hint in result.messages


def test_what_is_smooth_over_the_scan_is_no_jitter(crowded: Block) -> None:
    """Radial distortion that nobody has given, and scans that are bent along their rows."""
    xy = crowded.image_xy - 6000.0
    away = (xy**2).sum(axis=1, keepdims=True) / 5000.0**2
    bent = crowded.image_xy + 1.5 * away * xy / 5000.0
    assert line_hints(adjust(crowded.replace(image_xy=bent))) == []
    bow = np.column_stack([(xy[:, 1] / 5000.0) ** 3, np.zeros(len(xy))])
    assert line_hints(adjust(crowded.replace(image_xy=crowded.image_xy + 2.0 * bow))) == []
