"""Verdicts on public data sets: python benches/golden_verdicts.py [DATA].

DATA is the folder of data sets (default: ../shared/data). Each project that `photogram.formats.read` detects
is adjusted as it is. The output is one line for each: folder, code, exit code and headline.
"""

from __future__ import annotations

import sys
from pathlib import Path

from photogram import Block, PhotogramError, adjust
from photogram.collection import adjust as adjust_collection
from photogram.formats import read

PROJECTS = (
    *(
        f"formats/{name}"
        for name in ("agisoft", "bingo", "dbat", "opensfm", "patb", "project", "project_small")
    ),
    "formats/blocksexchange/matrix_pixels_ydown_v2.1.xml",
    "formats/blocksexchange/angles_millimetres_yup_v3.2.xml",
    "formats/bundler/bundle.out",
    *(f"formats/colmap/{name}" for name in ("binary", "rig_binary", "text")),
    "bal/problem-21-11315-pre.txt",
    "camcal/camcaldemo.xml",
    "roma/project.xml",
    "strasbourg/giant",
)


def verdict(path: Path) -> str:
    """Return code, exit code and headline of the adjustment of a project; of an error its code."""
    try:
        block = read(path)
        block = getattr(block, "block", block)
        found = (adjust if isinstance(block, Block) else adjust_collection)(block).verdict
    except PhotogramError as error:
        return f"error      {error.code}"
    return f"{found.code}, exit {found.exit}: {found.headline[:160]}"


def main() -> None:
    """Print the verdict of every project."""
    data = Path(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
    for name in PROJECTS:
        if (data / name).exists():
            print(f"{name:55s} {verdict(data / name)}", flush=True)


if __name__ == "__main__":
    main()
