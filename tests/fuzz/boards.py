"""Calibrations with a board: small sound ones in all forms, and how they are run."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

import photogram
from photogram.arguments.types import Floats
from photogram.cli import calibrate as calibrating
from photogram.formats import to_files
from photogram.formats.targets import adjusted_project
from photogram.targets import read
from photogram.targets.options import CornerBasis, Shape

from .projects import Files

__all__ = ["board_run", "boards"]

EXAMPLE = Path(photogram.__file__).parent / "examples" / "board"
COLUMNS, SPACING, SIZE = 9, 0.06, (1600, 1200)
"""Corners in a row of the example; metres between those that are used; pixels."""
PICTURES = 5
SIZED = 0.9
"""Part of the inputs whose size of pictures is given."""
MODELS = (
    *("opencv4", "opencv5", "opencv8", "opencv", "radial", "simple_pinhole", "opencv_fisheye"),
    *("brown", "agisoft_frame", "splined_stereographic", "nothing"),
)
FORMATS = ("opencv_yaml", "ros_camera_info", "kalibr_camchain", "mrcal")


def board_run(place: Path, rng: Random, quiet: bool) -> list[str]:
    """Calibrate what lies in a folder."""
    source = place / "in"
    given: dict[str, Any] = {}
    if not (source / "project.toml").exists():
        if rng.random() < SIZED:
            given["size"] = "{}x{}".format(*SIZE)
        if rng.random() < 0.4:
            given["model"] = rng.choice(MODELS)
        if given.get("model") == "splined_stereographic":
            given["knots"] = "6x5"
        if rng.random() < 0.1:
            given["sync"] = "none"
    if rng.random() < 0.2:
        given["shape"] = rng.choice(get_args(Shape))
    if rng.random() < 0.1:
        given["regularise"] = "mrcal"
    if rng.random() < 0.1:
        given["snoop"] = True
    elif rng.random() < 0.1:
        given["loss"] = rng.choice(("huber", "cauchy"))
    elif rng.random() < 0.1:
        given["outliers"] = "mrcal"
    if rng.random() < 0.05:
        given["components"] = [rng.choice(get_args(CornerBasis))]
    if rng.random() < 0.2:
        given["to"] = [rng.choice(FORMATS)]
    calibrating.calibrate(
        path=source,
        out=place / "out",
        json=place / "result.json",
        cross_validate=rng.choice(("none", "none", "none", "odd", "2")),
        suggest=int(rng.random() < 0.05),
        no_html=True,
        threads=1,
        quiet=quiet,
        **given,
    )
    return ["out/report.txt", "out/views.csv", "result.json"]


def boards() -> list[Files]:
    """Return five pictures of fifteen corners in files of five programs."""
    names, xy = _corners()
    rows = [
        f"{name},{point},{x},{y}"
        for name, of_picture in zip(names, xy.tolist(), strict=True)
        for point, (x, y) in enumerate(of_picture)
    ]
    shape = f"columns = 5\nrows = 3\nspacing = {SPACING}\n"
    described = f'kind = "chessboard"\n{shape}unit = "m"\npicture_size = [{SIZE[0]}, {SIZE[1]}]\n'
    table = {"board.toml": described.encode(), "corners.csv": _lines(["image,point,x,y", *rows])}
    mrcal = _lines(
        ["# filename x y level"]
        + [f"{name} {x} {y} 0" for name, own in zip(names, xy.tolist(), strict=True) for x, y in own]
    )
    kalibr = (
        "target_type: 'checkerboard'\ntargetCols: 5\ntargetRows: 3\n"
        f"rowSpacingMeters: {SPACING}\ncolSpacingMeters: {SPACING}\n"
    )
    return [
        table,
        {"corners.vnl": mrcal, "target.yaml": kalibr.encode()},
        {"corners.yml": _storage(xy)},
        {"corners.npz": _arrays(xy)},
        _project(table),
    ]


def _corners() -> tuple[list[str], Floats]:
    """Return the first pictures of the example, and (v, 15, 2) every second corner along both axes."""
    found: dict[str, list[tuple[float, float]]] = {}
    for line in (EXAMPLE / "corners.csv").read_text().splitlines()[1:]:
        name, point, x, y = line.split(",")
        if not (int(point) // COLUMNS % 2 or int(point) % COLUMNS % 2):
            found.setdefault(name, []).append((float(x), float(y)))
    whole = {name: places for name, places in found.items() if len(places) == 15}
    names = [*whole][:: len(whole) // PICTURES][:PICTURES]
    return names, np.array([whole[name] for name in names])


def _lines(lines: Sequence[str]) -> bytes:
    return ("\n".join(lines) + "\n").encode()


def _storage(xy: Floats) -> bytes:
    """Return corners as OpenCV's sample of calibration writes them."""
    numbers = ", ".join(map(repr, xy.ravel().tolist()))
    return _lines(
        [
            "%YAML:1.0",
            "---",
            f"image_width: {SIZE[0]}",
            f"image_height: {SIZE[1]}",
            "board_width: 5",
            "board_height: 3",
            f"square_size: {SPACING}",
            "image_points: !!opencv-matrix",
            f"   rows: {len(xy)}",
            "   cols: 15",
            '   dt: "2d"',
            f"   data: [ {numbers} ]",
        ]
    )


def _arrays(xy: Floats) -> bytes:
    y, x = np.mgrid[:3, :5] * SPACING
    grid = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    sink = io.BytesIO()
    np.savez(sink, imgpoints=xy, objpoints=np.tile(grid, (len(xy), 1, 1)), image_size=np.array(SIZE))
    return sink.getvalue()


def _project(table: Files) -> Files:
    """Return the adjusted project of a calibration."""
    with TemporaryDirectory() as folder:
        for name, content in table.items():
            assert isinstance(content, bytes)
            (Path(folder) / name).write_bytes(content)
        found = read(Path(folder), model="opencv4").adjust(threads=1)
    return dict(to_files(adjusted_project(found), "plain"))
