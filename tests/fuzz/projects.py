"""Projects of all formats: small sound ones, and how they are run."""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

import photogram
from photogram import Block, formats
from photogram.adjustment.options import CurrentVariance
from photogram.cli import adjust as adjusting
from photogram.comparator import Place
from photogram.distributed import Division
from photogram.formats import ReadOptions
from photogram.formats.images import to_corner
from photogram.formats.supplements import self_calibrated, with_control
from photogram.io.places import at_place

from .networks import random_network

__all__ = ["PROJECTS", "Files", "project_run", "sound_projects"]

Files = dict[str, "bytes | str"]
"""Contents of an input by path in it; a text is what a symbolic link says."""
EXAMPLE = Path(photogram.__file__).parent / "examples" / "project"
FORMAT_TESTS = Path(__file__).parents[1] / "formats"
NETWORKS = 28
"""Random networks in the sound inputs: four of every datum."""
SMALL_DISK = 0.03
"""Part of the inputs whose run may write files of a few kB only."""
COMMAND = 0.2
"""Part of the inputs that the whole command runs; the others are read, adjusted and reported."""
ASKED: dict[str, Any] = {
    "survey_common_sd": (0.003, 0.003, 0.005),
    "survey_common_in_control": True,
    "independent": "same-base",
    "standards": ("asprs-2023", "plain", "nssda", "vdi-2634", "iso-19157"),
    "classes": {"h": 0.05, "v": 0.1, "3d": 0.12},
    "area": 12.5e6,
    "without": {"middle": "target moved"},
    "language": "de",
    "text": {"asprs.points": "{n} of {asked} points."},
    "budgets": ("point middle z", "distance north-1 south-1", "camera drone f"),
    "coverage": 0.9,
    "limit": (1e-5, 5e-6, np.inf),
    "expansion": 11.5e-6,
    "client": "Müller & Söhne",
    "date": "2026-05-01",
    "vegetated": frozenset({"middle"}),
    "lengths": (
        {"line": "1", "from": "north-1", "to": "south-1", "length": 70.765, "sd": 0.005, "temperature": 21.5},
        {"line": "2", "from": "north-1", "to": "north-2", "length": 50.1, "sd": 0.005},
    ),
}
"""What the example asks of its statement, so that damage comes to these sections and tables, too."""
SYSTEMS = (
    *(
        "EPSG:25832",
        "EPSG:4326",
        "EPSG:4979",
        "EPSG:4978",
        "EPSG:25832+5783",
        "EPSG:99999",
        "EPSG:",
        "epsg:-1",
    ),
    *(
        "",
        " ",
        "\n",
        "WGS84",
        "ENU:47,8,400",
        "ENU:91,8,400",
        "ENU:nan,8,400",
        "ENU:47,8",
        "ENU:" + "9" * 500,
    ),
    *(
        "+proj=utm +zone=32",
        "+proj=utm +zone=99",
        "+proj=lcc",
        "+proj=pipeline",
        "+init=epsg:25832",
        "PROJCS[",
    ),
    *("urn:ogc:def:crs:EPSG::25832", "EPSG:25832\n", "{}", "geocentric", "local", "\u2603", "x" * 5000),
)
"""What may stand for a system of coordinates, and what may not."""
PARAMETERS = (
    "f",
    "c",
    "all",
    "fx,fy",
    "cx,cy",
    "k1,k2",
    "c,xp,yp,k1",
    "f,k1",
    "f,f",
    "",
    "nothing",
    "K1",
    "f;k1",
)


@contextmanager
def _disk(rng: Random) -> Iterator[None]:
    """Let some runs find a disk that is soon full: files may have so many bytes, and no more."""
    if rng.random() >= SMALL_DISK:
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (rng.choice((0, 100, 1000, 4000, 20_000)), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def project_run(main: str) -> Callable[[Path, Random, bool], list[str]]:
    """Return how projects are run whose path is a file of this name, or the folder where it is empty."""

    def run(place: Path, rng: Random, quiet: bool) -> list[str]:
        source = place / "in"
        path = source / main
        control = next(iter(sorted((source / "control").glob("*"))), None)
        crs = rng.choice(SYSTEMS) if rng.random() < 0.15 else None
        options = {
            "datum": rng.choice(("inner", "minimum", "control")) if rng.random() < 0.2 else None,
            "loss": rng.choice(("huber", "cauchy")) if rng.random() < 0.15 else None,
            "unit_variance": rng.choice(get_args(CurrentVariance)) if rng.random() < 0.3 else None,
        }
        calibrated = rng.choice(PARAMETERS) if rng.random() < 0.15 else ""
        with _disk(rng):
            if rng.random() < COMMAND:
                return _command(place, path, control, crs, options, calibrated, rng, quiet)
            return _adjusted(path, control, crs, options, calibrated, rng)

    return run


def _command(
    place: Path,
    path: Path,
    control: Path | None,
    crs: str | None,
    options: dict[str, Any],
    calibrated: str,
    rng: Random,
    quiet: bool,
) -> list[str]:
    chosen = dict(options)
    if control is not None:
        chosen |= {"control": control, "control_crs": crs, "sd": ["control=0.02"]}
    adjusting.adjust(
        path=path,
        out=place / "out",
        json=place / "result.json",
        no_html=True,
        crs=crs if control is None and rng.random() < 0.3 else None,
        self_calibrate=calibrated or None,
        snoop=rng.random() < 0.05,
        parquet=place / "data" if rng.random() < 0.2 else None,
        threads=1,
        quiet=quiet,
        **chosen,
    )
    return ["out/report.txt", "result.json"]


def _adjusted(
    path: Path, control: Path | None, crs: str | None, options: dict[str, Any], calibrated: str, rng: Random
) -> list[str]:
    """Do what the command does, by the Python interface: read, find first values, adjust, report."""
    sd = {"control": (0.02,), "images": (0.5,), "gnss": (0.1,)}
    project = formats.read(path, ReadOptions(sd=sd, cameras=_cameras(path)))
    if control is not None:
        project = with_control(project, control, sd, crs)
    if calibrated:
        with at_place(Place(), "--self-calibrate"):
            project = self_calibrated(project, calibrated.split(","))
    block = project.block
    if not np.isfinite(block.photo_positions).all():
        block = photogram.first_values(block).block
    datum = options["datum"] or project.options.datum
    kinds = {"inner": photogram.InnerConstraints, "minimum": photogram.MinimumConstraints}
    unit_variance = str(options["unit_variance"] or project.options.unit_variance)
    shared = {"unit_variance": unit_variance, "max_iterations": 30, "threads": 1}
    if rng.random() < 0.05:
        result = photogram.adjust_in_parts(block, Division(parts=2), **shared)
    else:
        result = photogram.adjust(
            block,
            datum=kinds[datum]() if datum in kinds else None,
            loss=options["loss"] or project.options.loss,
            **shared,
        )
    result.report()
    result.to_json()
    return []


def _cameras(path: Path) -> Path | None:
    """Return the table of cameras of a format that has none of its own."""
    found = (path if path.is_dir() else path.parent) / "cameras.csv"
    return found if path.suffix in (".csv", ".txt") and found.exists() else None


def sound_projects(name: str) -> list[Files]:
    """Return the sound inputs of a format."""
    return [dict(each) for each in _SOURCES[name]()]


@cache
def _bases() -> list[formats.Project]:
    """Return a block in pixels with GNSS and distances, and one in millimetres with weighted stations."""
    made = photogram.simulate(
        strips=1, photos_per_strip=3, points_per_photo=8, check_points=1, position_sd=0.1, seed=11
    )
    return [formats.read(EXAMPLE).replace(statement=ASKED), _as_project(made.block)]


def _as_project(block: Block, **options: Any) -> formats.Project:
    """Return a block that is adjusted as a project, by way of its result."""
    with TemporaryDirectory() as folder:
        photogram.adjust(block, threads=1, **options).to_parquet(folder)
        return formats.read(Path(folder))


def _written(name: str, projects: Sequence[formats.Project]) -> list[Files]:
    """Return projects as files of a format, those that it can hold."""
    found: list[Files] = []
    for project in projects:
        try:
            files = formats.target(Path("/there"), name).files(project)
        except photogram.InputError:
            continue
        found.append({str(path.relative_to("/there")): content for path, content in files.items()})
    return found


@cache
def _networks() -> list[formats.Project]:
    """Return random networks of every camera, kind of observation and datum."""
    found = []
    for number in range(NETWORKS):
        network = random_network(5, number)
        try:
            found.append(_as_project(network.block, datum=network.datum))
        except photogram.PhotogramError:
            continue
    return found


def _parquet() -> list[Files]:
    """Return the example with its tables as Parquet."""
    import pyarrow
    import pyarrow.csv
    import pyarrow.parquet

    found = []
    for files in _written("plain", _bases()):
        own: Files = {}
        for name, content in files.items():
            if not name.endswith(".csv"):
                own[name] = content
                continue
            table = pyarrow.csv.read_csv(pyarrow.BufferReader(content))
            sink = pyarrow.BufferOutputStream()
            pyarrow.parquet.write_table(table, sink)
            own[name.replace(".csv", ".parquet")] = sink.getvalue().to_pybytes()
        found.append(own)
    return found


def _results() -> list[Files]:
    """Return results as data, of both blocks and of some networks."""
    found = []
    for block in [each.block for each in (*_bases(), *_networks()[:4])]:
        with TemporaryDirectory() as folder:
            datum = None if np.isfinite(block.point_sd).any() else photogram.InnerConstraints()
            photogram.adjust(block, threads=1, datum=datum).to_parquet(folder)
            found.append({each.name: each.read_bytes() for each in Path(folder).iterdir()})
    return found


def _with_control() -> list[Files]:
    """Return models with lists of control beside: a table, OpenSfM's list of text, and its JSON."""
    project = _bases()[0]
    block = project.block
    held = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1))
    check = held[0]
    table = ["point,x,y,z,use"] + [
        ",".join(
            [
                block.point_ids[row],
                *map(str, block.point_positions[row]),
                "check" if row == check else "control",
            ]
        )
        for row in held.tolist()
    ]
    corner, listed = to_corner(project), ["EPSG:25832"]
    for row in held.tolist():
        for image in np.flatnonzero(block.image_points == row).tolist():
            x, y, z = block.point_positions[row] + [500_000.0, 5_000_000.0, 0.0]
            u, v = corner[image]
            listed.append(f"{x} {y} {z} {u} {v} {block.photo_ids[block.image_photos[image]]} gcp{row}")
    lists: list[Files] = [
        {"control/list.csv": ("\n".join(table) + "\n").encode()},
        {"control/gcp_list.txt": ("\n".join(listed) + "\n").encode()},
    ]
    return [{**model, **each} for model in _written("colmap_text", [project]) for each in lists]


def _dbat() -> list[Files]:
    """Return the example as a script of DBAT with its tables."""
    project = _bases()[0]
    block, corner = project.block, to_corner(project)
    held = np.flatnonzero(np.isfinite(block.point_sd).all(axis=1)).tolist()
    rows = zip(block.image_points.tolist(), block.image_photos.tolist(), corner.tolist(), strict=True)
    tables = {
        "control.txt": [
            f"{row + 1}, {block.point_ids[row]}, {_joined(block.point_positions[row])}" for row in held
        ],
        "images.txt": [f"{row + 1}, {name}.jpg" for row, name in enumerate(block.photo_ids)],
        "markpts.txt": [f"{point + 1}, {photo + 1}, {x}, {y}" for point, photo, (x, y) in rows],
    }
    found: Files = {name: ("\n".join(lines) + "\n").encode() for name, lines in tables.items()}
    (width, height), values, pixel = project.sizes[0] or (1, 1), block.cameras[0].parameters, 0.0024
    camera = {"size": f"{width},{height}", "sensor": f"{pixel * width},{pixel * height}"}
    camera |= {"c": pixel * values["fx"], "point": f"{pixel * values['cx']},{pixel * values['cy']}"}
    return [{"block.xml": _SCRIPT.format(**camera).encode(), **found}]


def _joined(values: Any) -> str:
    return ", ".join(map(str, [*values, 0.02, 0.02, 0.03]))


_SCRIPT = """<?xml version="1.0" encoding="UTF-8"?>
<document dbat_script_version="1.0">
  <input base_dir="$HERE">
    <ctrl_pts><file format="id,label,x,y,z,sx,sy,sz">control.txt</file></ctrl_pts>
    <images image_base_dir="$HERE"><file format="id,path">images.txt</file></images>
    <image_pts><file format="id,im,x,y" sxy="0.5">markpts.txt</file></image_pts>
    <cameras>
      <camera>
        <name>drone</name><unit>mm</unit><sensor>{sensor}</sensor><image>{size}</image>
        <focal>{c}</focal><cc>{c}</cc><pp>{point}</pp><K>0,0,0</K><P>0,0</P><model>3</model>
        <skew>0</skew><aspect>1</aspect>
      </camera>
    </cameras>
  </input>
  <operations>
    <operation><set_bundle_estimate_params><io><all>false</all></io></set_bundle_estimate_params></operation>
  </operations>
</document>
"""


def _aicon() -> list[Files]:
    """Return the files of AICON that the tests of this format write."""
    folders = [str(FORMAT_TESTS), str(FORMAT_TESTS.parent)]
    sys.path[:0] = folders
    try:
        from test_aicon import block_of_tests, write_files
    finally:
        del sys.path[: len(folders)]
    with TemporaryDirectory() as folder:
        write_files(block_of_tests(), Path(folder))
        return [{each.name: each.read_bytes() for each in Path(folder).iterdir()}]


_SOURCES: dict[str, Callable[[], list[Files]]] = {
    "networks": lambda: _written("plain", _networks()),
    "tables as Parquet": _parquet,
    "result as data": _results,
    "control list": _with_control,
    "dbat": _dbat,
    "aicon": _aicon,
}
_SOURCES |= {
    name: lambda name=name: _written(name, _bases())
    for name, each in formats.FORMATS.items()
    if each.write is not None
}
_MAIN = {name: own.files[0] for name, own in formats.FORMATS.items() if own.files and name != "plain"}
_MAIN |= {"dbat": "block.xml", "aicon": "", "results": ""}
_MEASURED_OFTEN = {"networks": 30, "plain": 16, "control list": 6, "result as data": 4}

PROJECTS: dict[str, tuple[str, int]] = {
    name: (_MAIN.get(name, ""), _MEASURED_OFTEN.get(name, 5)) for name in _SOURCES
}
"""The main file of the projects of a format, and how often among all inputs it is tried."""
