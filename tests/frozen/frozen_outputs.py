"""Outputs of commands for packaged examples and golden networks: numbers, codes, names and exit codes.

`python tests/frozen/frozen_outputs.py` writes `tests/data/frozen/outputs.json.gz` with the installed package.
The file was written at commit ae1d3bec. If an output changes on purpose, add the change and its reason to
`permitted.toml`; the file itself remains. `... frozen_outputs.py NAME` adds a new case. Prose is not stored.
"""

from __future__ import annotations

import csv
import functools
import gzip
import hashlib
import json
import math
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import chdir
from importlib.resources import files
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))

import test_film  # noqa: E402
import test_moving  # noqa: E402
from golden_data import golden  # noqa: E402
from golden_network import free_network  # noqa: E402
from photogram import Block, adjust  # noqa: E402
from photogram.cli import app  # noqa: E402
from test_components import six_photos  # noqa: E402
from test_snooping import golden_block  # noqa: E402

FILE = TESTS / "data" / "frozen" / "outputs.json.gz"
QUIET = "--no-html --quiet"
LISTED = 12
"""Longer columns are stored as their length and three sums."""
VOLATILE = {
    "seconds",
    "peak_bytes",
    "version",
    "photogram",
    "date",
    "program_version",
    "phases",
    "timings",
    "sha256",
}

CASES: dict[str, tuple[str, ...]] = {
    "adjust": (f"adjust --example --json r.json --parquet p {QUIET}",),
    "adjust, snooping": (f"adjust --example --snoop --json r.json {QUIET}",),
    "adjust, inner constraints": (
        "new p --kind metrology --quiet",
        f"adjust p --datum inner --json r.json {QUIET}",
    ),
    "adjust, loss": (f"adjust --example --loss huber --json r.json {QUIET}",),
    "check": (f"check --example --json r.json {QUIET}",),
    "info": ("info --example --json r.json --quiet",),
    "metadata": ("metadata DATA/statement/metadata --photos-crs EPSG:4326 --out gnss.csv --quiet",),
    "convert-lens": ("convert-lens EXAMPLES/project --to opencv8 --json r.json --out o --quiet",),
    "features": ("features --example --json r.json --quiet",),
    "statement": ("statement --example --date 2026-01-01 --out o --quiet",),
    **{
        f"convert, {name}": (f"convert --example {place}", f"info {place} --json r.json --quiet")
        for name, place in {
            "colmap": "sparse",
            "bundler": "bundle.out",
            "opensfm": "opensfm",
            "blocks_exchange": "block.xml",
            "plain": "tables",
        }.items()
    },
    **{
        f"new, {kind}": (f"new p --kind {kind} --quiet", f"adjust p --json r.json {QUIET}")
        for kind in ("block", "metrology", "survey", "rolling", "archive")
    },
    "new, survey, statement": ("new p --kind survey --quiet", f"adjust p --statement --out o {QUIET}"),
    "new, night": (
        "new p --kind night --quiet",
        f"stellar-camera exposures p/night.toml --json r.json {QUIET}",
    ),
    "new, board": ("new p --kind board --quiet", f"calibrate p --json r.json {QUIET}"),
    "collection": (f"collection --example --json r.json --out o {QUIET}",),
    "collection, components": (f"collection --example --components component --json r.json --out o {QUIET}",),
    "perspective-center": (f"perspective-center --example --json r.json {QUIET}",),
    "absolute-orientation": (f"absolute-orientation --example --json r.json {QUIET}",),
    "absolute-orientation transform": (
        f"absolute-orientation --example --json r.json {QUIET}",
        "absolute-orientation transform r.json EXAMPLES/absolute_orientation/points.csv t.csv --quiet",
    ),
    "comparator": (f"comparator --example --json r.json --date x --no-plots {QUIET}",),
    "comparator correct": (
        f"comparator --example --out o --date x --no-plots {QUIET}",
        "comparator correct o/correction.json MEASURED.csv c.csv --quiet",
    ),
    "comparator compare": (f"comparator compare --example --json r.json {QUIET}",),
    "camera compare": (f"camera compare --example --json r.json {QUIET}",),
    "certificate": (f"certificate --example --json r.json {QUIET}",),
    "film": (f"film --example --json r.json {QUIET}",),
    "stellar-camera": (f"stellar-camera --example --json r.json {QUIET}",),
    "stellar-camera exposures": (f"stellar-camera exposures --example --json r.json {QUIET}",),
    "calibrate": (f"calibrate --example --json r.json {QUIET}",),
    "plan": (f"plan --example --json r.json {QUIET}",),
    "giant": (f"giant --example --json r.json {QUIET}",),
    "giant, as published": (f"giant --example --as-published --json r.json {QUIET}",),
    "giant check": (f"giant check --example --json r.json {QUIET}",),
    "simulate": (
        "simulate b --strips 2 --photos-per-strip 4 --seed 1 --quiet",
        f"giant b --json r.json {QUIET}",
    ),
    **{
        f"golden, {place}": (f"adjust DATA/{place} --json r.json {options} {QUIET}",)
        for place, options in {
            "formats/project": "",
            "formats/project_small": "",
            "formats/opensfm": "",
            "formats/colmap/text": "",
            "formats/colmap/rig_text": "",
            "formats/blocksexchange/matrix_pixels_ydown_v2.1.xml": "",
            "formats/agisoft/cameras.xml": "",
            "formats/bal/problem-6-40.txt": "",
            "formats/bundler/bundle.out": "",
            "statement/block": "",
        }.items()
    },
    **{
        f"golden check, {place}": (f"check DATA/{place} --json r.json {QUIET}",)
        for place in ("formats/project", "formats/project_small", "statement/block")
    },
}


def moving(name: str) -> Block:
    """Return the block that the test of a golden network adjusts."""

    class BlockError(Exception):
        """Carries the block out of the test."""

    def stop(block: Block, **_: Any) -> None:
        raise BlockError(block)

    original, test_moving.adjust = test_moving.adjust, stop
    try:
        getattr(test_moving, f"test_{name}")()
    except BlockError as error:
        return error.args[0]
    finally:
        test_moving.adjust = original
    raise AssertionError(name)


def film() -> Block:
    with tempfile.TemporaryDirectory() as folder:
        return test_film.project(Path(folder)).block


NETWORKS: dict[str, Callable[[], Block]] = {
    "free network": lambda: free_network(bars=False),
    "free network with scale bars": lambda: free_network(bars=True),
    "six photos": lambda: six_photos()[0],
    "six photos with gross errors": lambda: golden_block(
        golden("statistics", "block6_blunders.json")["input"]
    ),
    "film": film,
    **{
        name: functools.partial(moving, name)
        for name in ("jitter", "planetary_pair", "pushbroom_strips", "rolling_shutter", "three_line")
    },
}


def outputs(case: str) -> dict[str, Any]:
    """Return exit codes, file names and figures of a case, of commands in an empty directory."""
    if case in NETWORKS:
        return {"figures": dict(entries("", json.loads(adjust(NETWORKS[case]()).to_json())))}
    runner = CliRunner()
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        shutil.copytree(TESTS / "data", "DATA", ignore=shutil.ignore_patterns("frozen", "*.gz"))
        shutil.copytree(str(files("photogram") / "examples"), "EXAMPLES")
        Path("MEASURED.csv").write_text("x_um,y_um\n1000,2000\n90000,150000\n", encoding="utf-8")
        codes = [runner.invoke(app, command.split()).exit_code for command in CASES[case]]
        inputs = ("DATA", "EXAMPLES", "MEASURED.csv")
        written = sorted(path for path in Path().rglob("*") if path.is_file() and path.parts[0] not in inputs)
        return {
            "exit codes": codes,
            "files": [path.as_posix() for path in written],
            "figures": {
                path.as_posix(): dict(figures(path)) for path in written if path.suffix in (".json", ".csv")
            },
        }


def figures(path: Path) -> Iterator[tuple[str, Any]]:
    """Yield the name and the value of every figure and code of a JSON or CSV file."""
    if path.suffix == ".json":
        yield from entries("", json.loads(path.read_text(encoding="utf-8")))
        return
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = [row for row in csv.reader(file) if row and not row[0].startswith("#")]
    for name, *column in zip(*rows, strict=False):
        yield from entries(name, [number(cell) for cell in column])


def number(cell: str) -> float | str:
    """Return a cell as a number if it is one."""
    try:
        return float(cell)
    except ValueError:
        return cell


def entries(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the figures and codes of a value of JSON; lists are columns."""
    if isinstance(value, dict):
        for key, part in value.items():
            if key not in VOLATILE:
                yield from entries(f"{name}/{key}", part)
    elif isinstance(value, list):
        if value and all(isinstance(part, dict) for part in value):
            yield f"{name}#", len(value)
            for key in sorted({key for part in value for key in part}):
                yield from entries(f"{name}/{key}", [part.get(key) for part in value])
        elif value and all(isinstance(part, list) for part in value):
            yield f"{name}#", len(value)
            yield from entries(f"{name}/*", [item for part in value for item in part])
        else:
            yield name, column_digest(value)
    elif not isinstance(value, str) or is_code(value):
        yield name, value


def is_code(text: Any) -> bool:
    """Return if a text is a name or a code: one word, and no digest of a file."""
    is_word = isinstance(text, str) and not any(character.isspace() for character in text)
    return is_word and not re.fullmatch(r"[0-9a-f]{64}", text)


def column_digest(values: list[Any]) -> Any:
    """Return a short column as it is, a long one as its length and sums; prose is left out."""
    kept = [part if not isinstance(part, str) or is_code(part) else "" for part in values]
    if len(kept) <= LISTED:
        return kept
    numbers = [float(part) for part in kept if isinstance(part, int | float) and math.isfinite(part)]
    others = [part for part in kept if not isinstance(part, int | float) or not math.isfinite(part)]
    return {
        "length": len(kept),
        "sum": math.fsum(numbers),
        "absolute": math.fsum(map(abs, numbers)),
        "weighted": math.fsum(part * math.cos(index) for index, part in enumerate(numbers)),
        "others": hashlib.sha256(json.dumps(others).encode()).hexdigest()[:16] if others else "",
    }


def differences(
    before: Any, after: Any, place: str = "", *, relative: float = 1e-6, absolute: float = 1e-12
) -> Iterator[tuple[str, Any, Any]]:
    """Yield the place and both values of every difference between outputs.

    Numbers are equal if they differ by less than `relative` of the larger, or by less than `absolute`. The
    sums of a column are compared with its sum of absolute values.
    """
    if isinstance(before, dict) and isinstance(after, dict):
        if "absolute" in before and "absolute" in after:
            size = max(before["absolute"], after["absolute"])
            near = all(
                abs(before[key] - after[key]) <= relative * size + absolute
                for key in ("sum", "absolute", "weighted")
            )
            if not near or any(before[key] != after[key] for key in ("length", "others")):
                yield place, before, after
            return
        for key in sorted({*before, *after}):
            yield from differences(
                before.get(key), after.get(key), f"{place}:{key}", relative=relative, absolute=absolute
            )
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        size = max(
            (abs(part) for part in before if isinstance(part, int | float) and math.isfinite(part)),
            default=0.0,
        )
        for one, other in zip(before, after, strict=True):
            if isinstance(one, dict | list):
                yield from differences(one, other, f"{place}:*", relative=relative, absolute=absolute)
            elif not equal(one, other, relative, relative * size + absolute):
                yield place, before, after
                return
    elif not equal(before, after, relative, absolute):
        yield place, before, after


def equal(one: Any, other: Any, relative: float, absolute: float) -> bool:
    """Return if two values are equal, numbers within the tolerance."""
    if isinstance(one, int | float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=relative, abs_tol=absolute)
    return bool(one == other)


def main(names: list[str]) -> None:
    """Write the outputs of the cases, or add those of some cases."""
    os.environ |= {"COLUMNS": "200", "NO_COLOR": "1"}
    frozen = json.loads(gzip.decompress(FILE.read_bytes())) if names else {}
    for case in names or (*CASES, *NETWORKS):
        frozen[case] = outputs(case)
        print(case, frozen[case].get("exit codes", ""), flush=True)
    FILE.parent.mkdir(parents=True, exist_ok=True)
    data = json.dumps(frozen, indent=0, sort_keys=True).encode()
    FILE.write_bytes(gzip.compress(data, 9, mtime=0))


if __name__ == "__main__":
    main(sys.argv[1:])
