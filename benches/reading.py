"""How long a million image records take to be read: CSV, Parquet, binary files of COLMAP, control networks.

python benches/reading.py [RECORDS]
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogram import formats
from photogram.formats.colmap.files import FEATURE, POINT, Camera, Image, Model, binary_files, read_model
from photogram.formats.isis.network import ControlMeasures, ControlNetwork, ControlPoints, read_network
from photogram.formats.isis.writing import binary_network, network_text
from photogram.io.delimited import read_columns
from photogram.io.places import Place

SEED = 7
POINTS_OF_PHOTO = 1000


def timed(what: str, work: Callable[[], object]) -> None:
    """Print the least of three times."""
    least = min(_once(work) for _ in range(3))
    print(f"{what:<28}{least[0]:8.2f} s{least[1]:8.2f} s of processor time")


def _once(work: Callable[[], object]) -> tuple[float, float]:
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


def table(path: Path) -> None:
    """Read a table of images as the plain project does."""
    read = read_columns(path, numbers={"column", "row"})
    read.names("photo"), read.names("point"), read.numbers("column"), read.numbers("row")


def main(records: int) -> None:
    """Write the files, and time reading them."""
    random = np.random.default_rng(SEED)
    photos = np.arange(records) // POINTS_OF_PHOTO
    points = (np.arange(records) * 7) % (records // 5)
    xy = random.uniform(0, 4000, (records, 2))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        lines = [
            f"IMG_{photo:05d}.JPG,T{point:06d},{x!r},{y!r}"
            for photo, point, (x, y) in zip(photos.tolist(), points.tolist(), xy.tolist(), strict=True)
        ]
        (place / "images.csv").write_text("\n".join(["photo,point,column,row", *lines, ""]))
        timed(f"CSV, {records} records", lambda: table(place / "images.csv"))
        (place / "project.toml").write_text("[project]\nformat = 1\n")
        (place / "cameras.csv").write_text("camera,width,height,f\nA,4000,4000,3000\n")
        names = "".join(f"IMG_{photo:05d}.JPG\n" for photo in range(photos[-1] + 1))
        (place / "photos.csv").write_text(f"photo\n{names}")
        timed("  the whole project", lambda: formats.read(place))
        (place / "images.csv").unlink()
        _parquet(place / "images.parquet", photos, points, xy)
        for name, content in binary_files(_model(photos, points, xy)).items():
            (place / name).write_bytes(content)
        timed("COLMAP, binary", lambda: read_model(place))
        timed("  the whole project", lambda: formats.read(place, file_format="colmap"))
        _control_network(place / "network.net", photos, points, xy)


def _parquet(path: Path, photos: np.ndarray, points: np.ndarray, xy: np.ndarray) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError:
        print("Parquet: pyarrow is not installed")
        return
    names = [
        pyarrow.array([form(each) for each in own.tolist()]).dictionary_encode()
        for form, own in (("IMG_{:05d}.JPG".format, photos), ("T{:06d}".format, points))
    ]
    columns = dict(zip(("photo", "point", "column", "row"), (*names, *xy.T), strict=True))
    pyarrow.parquet.write_table(pyarrow.table(columns), path, compression="zstd")
    timed("Parquet", lambda: table(path))
    timed("  the whole project", lambda: formats.read(path.parent))


def _control_network(path: Path, photos: np.ndarray, points: np.ndarray, xy: np.ndarray) -> None:
    """Read the records as measures of a control network, binary and as text."""
    order = np.argsort(points, kind="stable")
    counts = np.bincount(points)
    measures = ControlMeasures(
        [f"LRO/{k}/NACL" for k in range(int(photos.max()) + 1)],
        photos[order].astype(np.int32),
        np.full(len(points), 3, dtype=np.int8),
        sample=xy[order, 0],
        line=xy[order, 1],
    )
    named = ControlPoints([f"T{k:06d}" for k in range(len(counts))], np.full(len(counts), 2, np.int8))
    firsts = np.concatenate([[0], np.cumsum(counts)])
    network = ControlNetwork(named, measures, firsts)
    path.write_bytes(binary_network(network))
    timed("Control network, binary", lambda: read_network(path))
    path.write_bytes(network_text(network))
    timed("Control network, text", lambda: read_network(path))


def _model(photos: np.ndarray, points: np.ndarray, xy: np.ndarray) -> Model:
    own = int(points.max()) + 1
    features = np.empty(len(xy), FEATURE)
    features["xy"], features["point"] = xy, points + 1
    table = np.zeros(own, POINT)
    table["number"] = np.arange(1, own + 1)
    return Model(
        Path(),
        [Camera(1, "PINHOLE", 4000, 3000, (3000.0, 3000.0, 2000.0, 1500.0), Place())],
        [
            Image(photo + 1, (1.0, *(0.0,) * 6), 1, f"IMG_{photo:05d}.JPG", part)
            for photo, part in enumerate(np.split(features, np.cumsum(np.bincount(photos))[:-1]))
        ],
        table,
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000)
