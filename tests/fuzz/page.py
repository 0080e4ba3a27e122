"""Figures for a page of the documentation: marked sections that commands rewrite."""

from __future__ import annotations

import os
import platform
import re
from pathlib import Path
from typing import TYPE_CHECKING

from .case import ENDINGS

if TYPE_CHECKING:
    from .run import Figures

__all__ = ["lines", "machine", "table", "write_section"]


def machine() -> str:
    """Name processor, system and Python."""
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        text = ""
    found = re.search(r"model name\s*:\s*(.*)", text)
    processor = found.group(1).strip() if found else platform.machine()
    return (
        f"{processor}, {os.cpu_count()} processors, {platform.system()}, Python {platform.python_version()}"
    )


def lines(figures: Figures, numbers: list[range]) -> list[str]:
    """Say which inputs were run, and what was found."""
    reached = sum(figures.reached.values())
    which = " and ".join(f"{own.start:,} to {own.stop - 1:,}" for own in numbers)
    return [
        f"{figures.inputs:,} inputs of seed {figures.seed}, numbers {which}: {reached:,}"
        f" ({100 * reached / figures.inputs:.0f} %) reached the computation, {len(figures.faults):,} failed.",
        f"{figures.cpu_seconds / 60:.0f} minutes of processor time"
        f" ({1000 * figures.cpu_seconds / figures.inputs:.1f} ms an input) on {machine()}.",
    ]


def table(figures: Figures) -> list[str]:
    """Make a table of how the inputs of each format ended."""
    rows = [
        "| format | inputs | reached the computation | " + " | ".join(ENDINGS) + " |",
        "|---" + "|---:" * (2 + len(ENDINGS)) + "|",
    ]
    for name in sorted(figures.reached):
        count = figures.of_format(name)
        cells = [f"{figures.endings[name, ending]:,}" for ending in ENDINGS]
        share = f"{100 * figures.reached[name] / count:.0f} %"
        rows.append(f"| {name} | {count:,} | {share} | " + " | ".join(cells) + " |")
    return rows


def write_section(page: Path, name: str, content: list[str]) -> None:
    """Replace what stands between the marks of a section, `<!-- name -->` and `<!-- /name -->`.

    Raises
    ------
    ValueError
        The page has no such marks.
    """
    text = page.read_text(encoding="utf-8")
    first, last = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    if first not in text or last not in text:
        raise ValueError(f"{page} has no section {name}")
    head, rest = text.split(first, 1)
    tail = rest.split(last, 1)[1]
    page.write_text(head + first + "\n" + "\n".join(content) + "\n\n" + last + tail, encoding="utf-8")
