"""Time and size of the report for the browser: python benches/report.py 20x50 200x250.

Each size runs in a process of its own, so that what draws is loaded anew: the time of the report is that of
the first one, with it. The time to open it is that of Chromium, without a window, where there is one.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from photogram import adjust, simulate


def measured(size: str, points: float) -> str:
    """Return a row of the table for a block of so many strips and photos in each."""
    strips, photos = map(int, size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, points_per_photo=points, seed=1).block
    began = time.perf_counter()
    result = adjust(block)
    adjusted = time.perf_counter() - began
    began, clock = time.perf_counter(), time.process_time()
    content = result.to_html()
    seconds, processor = time.perf_counter() - began, time.process_time() - clock
    cells = [
        f"{len(block.photo_ids):,}",
        f"{len(block.point_ids):,}",
        f"{len(block.image_xy):,}",
        f"{adjusted:.2f}",
        f"{seconds:.2f}",
        f"{processor:.2f}",
        f"{len(content) / 1e6:.2f}",
        opened(content),
    ]
    return f"| {' | '.join(cells)} |"


def opened(content: bytes) -> str:
    """Return the seconds in which a browser has the page ready, nothing where there is none."""
    program = next((found for name in ("chromium", "google-chrome") if (found := shutil.which(name))), None)
    if program is None:
        return ""
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        return ""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        path = Path(folder, "report.html")
        path.write_bytes(content)
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto("about:blank")
        began = time.perf_counter()
        page.goto(path.as_uri())
        seconds = time.perf_counter() - began
        browser.close()
    return f"{seconds:.2f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="+", metavar="STRIPSxPHOTOS")
    parser.add_argument("--points", type=float, default=100.0, help="points per photo (100)")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(measured(asked.sizes[0], asked.points))
        return
    print("| photos | points | images | adjustment, s | report, s | of processor, s | MB | opened, s |")
    print("|---:|---:|---:|---:|---:|---:|---:|---:|", flush=True)
    for size in asked.sizes:
        command = [sys.executable, __file__, size, "--points", str(asked.points), "--one"]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout, end="", flush=True)


if __name__ == "__main__":
    main()
