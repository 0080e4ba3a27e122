"""Options of `photogram calibrate`: board, images, lens, uncertainty."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.cli.command_classes import misuse
from photogram.cli.job import Job
from photogram.lazy_dataclasses import replace
from photogram.targets.calibration_options import CalibrationOptions

if TYPE_CHECKING:
    from photogram.targets import Calibrated, Calibration
    from photogram.targets.worth_options import WorthOptions


PLAIN_GOES = "--shape, --sd, --regularise, --sync offset, --offset alone"
"""Options that go with a plain project."""


def read_calibration(
    path: Path, options: CalibrationOptions, progress: Callable[[str], None] | None = None
) -> Calibration:
    """Read corners or photos of a path; `progress` receives the current photo."""
    from photogram.targets import read

    if not (path / "project.toml").exists():
        return read(path, options, progress=progress)
    from photogram import formats
    from photogram.formats.targets.calibrations import calibration_of

    found = calibration_of(formats.read(path))
    names = ("shape", "sd0", "regularise", "offsets", "sync")
    given = {name: getattr(options, name) for name in names}
    if options != CalibrationOptions(**given) or options.sync == "none":
        raise misuse(PLAIN_GOES, "project-views")
    shape, offsets = given.pop("shape"), given.pop("offsets")
    changes = {name: value for name, value in given.items() if value not in (None, "known")}
    if shape is not None:
        changes["board"] = found.board.replace(shape=shape)
    found = found.replace(**changes)
    return found.with_offsets(offsets) if offsets else found


NOT_GOOD_ENOUGH = 4  # Exit code, as of results that should not be used


def appraised(
    job: Job,
    found: Calibrated,
    options: WorthOptions,
    need: float | None,
    compare_with: Path | None,
    calibrated: Callable[[Path], Calibrated],
) -> Calibrated:
    """Return an adjusted calibration with its uncertainty, and its differences from another one."""
    from photogram.targets.appraisal import appraise
    from photogram.targets.findings import judged
    from photogram.targets.uncertainty import difference

    with job.status("uncertainty") as status:
        worth = appraise(found, options, None if status is None else status.update)
    if compare_with is not None:
        second = calibrated(compare_with)
        count = min(len(found.cameras), len(second.cameras))
        distances = options.distances or [math.inf]
        apart = [difference(found, second, distances, camera=number) for number in range(count)]
        worth = replace(worth, differences=tuple(apart))
    return judged(found, worth, need)
