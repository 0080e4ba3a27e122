"""Patterns of residuals: by rays, photos, across the frame (Appendix H)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogram.diagnosis.findings import Section, finding, section_of, small_unit
from photogram.results.result import Result
from photogram.show.quantity import Axis, Table, column
from photogram.statistics.findings import Systematic
from photogram.statistics.verdict import as_phrase


def residuals(result: Result, patterns: Sequence[Systematic]) -> Section:
    """Describe residuals, and report the patterns that the verdict finds over frames and on photos."""
    section = section_of("patterns")
    used = result.used_images
    unit, factor = small_unit(result.block.image_unit)
    rays, squares = result.point_rays[result.block.image_points], result.residuals**2
    numbers = np.unique(rays[used])
    own = [used & (rays == number) for number in numbers]
    rms = factor * np.sqrt([squares[rows].mean(axis=0) for rows in own])
    axes = (Axis.of("x", unit), Axis.of("y", unit))
    columns = [
        column("rays", numbers, "Rays"),
        column("images", [int(rows.sum()) for rows in own], "Image observations"),
        column("rms", rms, "rms {}", axes=axes, kind="deviation", decimals=2),
        column("redundancy", [result.redundancy[rows].mean() for rows in own], "Mean redundancy", decimals=3),
    ]
    section.parts.append(Table("", "Residuals by number of rays", columns))
    for each in patterns:
        if each.significant and (each.large or each.subject):
            photos, values = [str(each.subject)] * bool(each.subject), {"statistic": each.value}
            kind = "photo-pattern" if photos else "systematic-pattern"
            found = finding("look", as_phrase(each.sentence), photos, values=values, kind=kind)
            section.findings.append(found)
    return section
