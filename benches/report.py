"""Time and size of the report for the browser: python benches/report.py 20x50 200x250.

Each size runs in a process of its own, so that what draws is loaded anew: the time of the report is that of
the first one, with it. The time to open it is that of Chromium, without a window, where there is one. A
second table has each picture by itself, as it stands in the report and as a file, and with `--maps` the
files of docs/maps.md. `--into DIR` keeps all of them, to be looked at.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TypeVar

from photogram import Result, adjust, simulate

HEADS = (
    ["photos", "points", "images", "adjustment, s", "report, s", "of processor, s", "MB", "opened, s"],
    ["photos", "picture or map", "of processor, s", "kB", "in the report, s", "kB there"],
)
MAPS = ("map.gpkg", "map.geojson", "points.ply")

T = TypeVar("T")


def measured(size: str, points: float, maps: bool, into: Path) -> Iterator[tuple[int, list[str]]]:
    """Give rows of the two tables for a block of so many strips and photos in each."""
    strips, photos = map(int, size.split("x"))
    block = simulate(strips=strips, photos_per_strip=photos, points_per_photo=points, seed=1).block
    began = time.perf_counter()
    result = adjust(block)
    adjusted = time.perf_counter() - began
    began = time.perf_counter()
    processor, content = timed(result.to_html)
    seconds = time.perf_counter() - began
    into.mkdir(parents=True, exist_ok=True)
    page = into / f"{size}.html"
    page.write_bytes(content)
    count = f"{len(block.photo_ids):,}"
    yield (
        0,
        [
            count,
            f"{len(block.point_ids):,}",
            f"{len(block.image_xy):,}",
            f"{adjusted:.2f}",
            f"{seconds:.2f}",
            f"{processor:.2f}",
            f"{len(content) / 1e6:.2f}",
            opened(page),
        ],
    )
    yield from ((1, [count, *cells]) for cells in pictures(result, into, size))
    if maps:
        yield from ((1, [count, *cells]) for cells in mapped(result, into, size))


def pictures(result: Result, into: Path, size: str) -> Iterator[list[str]]:
    """Give name, time and size of each picture as a PNG file, and of the same in the report."""
    from photogram.results.network_document import drawings
    from photogram.show.html import inlined

    for name, drawing in drawings(result).items():
        inside, picture = timed(partial(inlined, drawing))
        if picture is None:
            continue
        seconds, content = timed(lambda name=name: getattr(result.plot, name)().render("png"))
        written = {into / f"{name}.png": content}
        yield [name, *_kept(written, size, seconds), f"{inside:.2f}", _kilobytes(len(picture.markup))]


def mapped(result: Result, into: Path, size: str) -> Iterator[list[str]]:
    """Give name, time and size of each map."""
    from photogram.formats.maps import map_files, point_cloud

    for name in MAPS:
        place = into / name
        seconds, written = timed(
            (lambda place=place: {place: point_cloud(result)})
            if place.suffix == ".ply"
            else (lambda place=place: map_files(result, place)[0])
        )
        yield [name, *_kept(written, size, seconds), "", ""]


def timed(call: Callable[[], T]) -> tuple[float, T]:
    """Return the processor time of a call, seconds, and what it gives."""
    began = time.process_time()
    found = call()
    return time.process_time() - began, found


def _kept(written: Mapping[Path, bytes], size: str, seconds: float) -> list[str]:
    """Write files under the size of their block; return the time they took, and their size."""
    for place, content in written.items():
        place.with_name(f"{size}-{place.name}").write_bytes(content)
    return [f"{seconds:.2f}", _kilobytes(sum(map(len, written.values())))]


def _kilobytes(count: int) -> str:
    return f"{count / 1000:,.0f}"


def opened(path: Path) -> str:
    """Return the seconds in which a browser has the page ready, nothing where there is none."""
    program = next((found for name in ("chromium", "google-chrome") if (found := shutil.which(name))), None)
    if program is None:
        return ""
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        return ""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page()
        page.goto("about:blank")
        began = time.perf_counter()
        page.goto(path.resolve().as_uri())
        seconds = time.perf_counter() - began
        browser.close()
    return f"{seconds:.2f}"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="+", metavar="STRIPSxPHOTOS")
    parser.add_argument("--points", type=float, default=100.0, help="points per photo (100)")
    parser.add_argument("--maps", action="store_true", help="maps and point clouds, too")
    parser.add_argument("--into", type=Path, help="keep what is made in this folder")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        into = asked.into or Path(folder)
        if asked.one:
            for table, cells in measured(asked.sizes[0], asked.points, asked.maps, into):
                print(f"{table}| {' | '.join(cells)} |", flush=True)
            return
        options = ["--points", str(asked.points), "--into", str(into), *(["--maps"] if asked.maps else [])]
        tables: list[list[str]] = [[], []]
        for size in asked.sizes:
            command = [sys.executable, __file__, size, *options, "--one"]
            done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
            for line in done.stdout.splitlines():
                tables[int(line[0])].append(line[1:])
    for heads, lines in zip(HEADS, tables, strict=True):
        print(f"| {' | '.join(heads)} |")
        print(
            f"|{'|'.join('---:' if place != 1 or len(heads) > 6 else '---' for place in range(len(heads)))}|"
        )
        print("\n".join(lines), end="\n\n")


if __name__ == "__main__":
    main()
