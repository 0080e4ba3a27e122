"""Adjustment of plain projects on disk in parts; image observations are read in batches.

All other tables are in memory; of the points, only those with control, weights or other observations. Image
observations are read once into buckets by point name, so that a bucket contains all observations of its
points, and then divided into parts.
"""

from __future__ import annotations

import hashlib
import shutil
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import cached_property, partial, reduce
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from photogram.adjustment.adjustment import core_options
from photogram.adjustment.first_features import started
from photogram.adjustment.options import AdjustOptions
from photogram.arguments.arrays import repeated_pairs
from photogram.arguments.types import Bools, Floats, Indices
from photogram.distributed.adjust import Run, opened
from photogram.distributed.cut import (
    Counts,
    Incidence,
    Tree,
    counted_work,
    cut,
    homes,
    incidence_of_points,
    vertices_of,
)
from photogram.distributed.division import Division
from photogram.distributed.driver import Outcome
from photogram.distributed.files import alone, read_arrays, write_arrays
from photogram.distributed.parts import Names, Part, assembled_part
from photogram.distributed.run import Manifest, divided, places_of, with_flights
from photogram.errors import InputError
from photogram.formats.builder import ASSUMED_SD
from photogram.formats.plain import SETTINGS
from photogram.formats.plain.photos import images_of
from photogram.formats.plain.reading import read_tables
from photogram.formats.plain.schema import SD_AXES, TABLES
from photogram.formats.plain.settings import read_settings
from photogram.formats.plain.tables import Tables
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.column_table import ColumnTable
from photogram.io.delimited import BATCH
from photogram.io.places import Place
from photogram.network.block import checked, refuse_passages
from photogram.network.core_arrays import CoreOptions
from photogram.network.films import Scan
from photogram.network.observations import Fiducial, KnownFilm, KnownTogether, Prior
from photogram.network.observations.photos import with_epochs
from photogram.results.network_tables import iteration_table
from photogram.show.page import Document, Fact, Section
from photogram.show.quantity import Table
from photogram.words import phrase

SHARE = 0.25  # Largest size of images in a text that is read as a whole, relative to the memory
BUCKET = 2**26  # Bytes of the table of images in a bucket, which is loaded completely
_Arrays = dict[str, np.ndarray]
_INDICES, _PAIRS = np.zeros(0, dtype=np.int64), np.zeros((0, 2))
_EMPTY: _Arrays = {
    **dict.fromkeys(("photos", "points", "rows", "records"), _INDICES),
    **dict.fromkeys(("xy", "sd"), _PAIRS),
}
"""Arrays of image observations; further arrays are the names of points."""
_INNER = (Fiducial, KnownFilm, KnownTogether, Prior)  # Observations that do not define a datum


def streamable(path: Path, memory: int | None = None, reading: ReadOptions | None = None) -> bool:
    """Return whether the images of a project are read in batches.

    Images in Parquet are; a text also is if it is larger than its share of the memory in bytes.
    """
    place = path / SETTINGS if path.is_dir() else path
    if place.suffix != ".toml" or not place.is_file():
        return False
    settings = read_settings(place, reading)
    images = settings.tables.get("images")
    if images is None or "photos" not in settings.tables or settings.photo_files is not None:
        return False
    return images.suffix == ".parquet" or (memory is not None and images.stat().st_size > SHARE * memory)


class Streamed:
    """A project whose image observations are read in batches of about `size` bytes."""

    def __init__(self, path: Path, options: ReadOptions, folder: Path, *, size: int = BATCH) -> None:
        settings = read_settings(path / SETTINGS if path.is_dir() else path, options)
        if settings.features:
            raise InputError(phrase("plain.parts-features"), file=settings.path)
        self._folder, self._size = folder / "buckets", size
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self._tables = tables = Tables(settings, [])
        tied = set[str](settings.statement.get("without", ()))
        for name, schema in TABLES.items():
            parts = (column for column in schema.all_columns if column.kind == "point")
            for column in (each for part in parts for each in part.names):
                tied.update(tables.rows(name).texts(column))
        control = set(tables.rows("control").texts("point"))

        def are_tied(table: ColumnTable) -> Bools:
            return np.array([name in tied for name in table.texts("point")], dtype=bool)

        def are_known(table: ColumnTable) -> Bools:
            known = [name in control for name in table.texts("point")]
            sd = tables.deviations(table, "points", SD_AXES, np.inf)
            held: Bools = np.isfinite(sd).any(axis=1) | np.array(known, dtype=bool)
            return held | are_tied(table)

        images = islice(tables.batches("images", size), None if tied else 1)
        tables.parsed["images"] = _selected(images, are_tied)
        tables.parsed["points"] = _selected(tables.batches("points", size), are_known)
        self.project: Project
        self.project, self._source = read_tables(tables, options)
        self._check()
        block = with_flights(started(checked(self.project.block)))
        # A node has only some of the observations of a drift.
        self.block = block.replace(observations=with_epochs(block.observations))
        named = {name for each in self.block.observations for name in each.points}
        self._tied = {name: row for row, name in enumerate(sorted(named))}
        self._vertices = vertices_of(self.block)

    def _check(self) -> None:
        """Reject a project that requires all image observations together."""
        block, path = self.project.block, self.project.path
        if self.project.options.datum in ("inner", "minimum"):
            raise InputError(phrase("plain.parts-datum"), file=path)
        for moving in block.timed:
            # Its time is the mean of the times of its images.
            if moving.lines is not None and moving.time is None:
                raise InputError(phrase("plain.parts-moving", photo=moving.photo), file=path)
        refuse_passages(block, "blocks in parts", but=Scan)
        for message in self.project.messages:
            if message.phrase is not None and message.code == "plain.side-unknown":
                raise InputError(phrase("plain.parts-film", **message.phrase.fields), file=path)
        known = (block.point_sd, block.photo_position_sd)
        outer = (each for each in block.observations if not isinstance(each, _INNER))
        if not (any(outer) or any(np.isfinite(each).any() for each in known)):
            raise InputError(phrase("plain.parts-free"), file=path)

    @property
    def images(self) -> Floats:
        """(P,) number of image observations of each photo, or of all on its trajectory or frame."""
        return self._spread_out[1]

    def close(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)

    def source(self, options: CoreOptions) -> str:
        """Return a fingerprint of options, settings, sizes and times of files."""
        digest = hashlib.sha256(repr((options, self._tables.settings)).encode())
        for name, table in sorted(self._tables.settings.tables.items()):
            found = table.stat()
            digest.update(f"{name} {found.st_size} {found.st_mtime_ns}".encode())
        return digest.hexdigest()

    def counted(self, parts: int) -> tuple[Tree, Counts]:
        """Return the counted work for a number of parts."""
        return counted_work(places_of(self.block), self.images, self._incidences, parts)

    def divided(self, run: Path, parts: int, options: CoreOptions, source: str) -> Manifest:
        """Write a number of parts into the folder of a run, and remove the buckets."""
        found = cut(places_of(self.block), self.images, self._incidences, parts)
        root, observed, seen = found.tree.root, np.zeros(0, dtype=np.int64), set[str]()
        for number, (bucket, incidence, of_points, of_observations) in enumerate(self._buckets()):
            home = homes(found.owners, incidence, root)
            if not number:
                observed = home[of_observations]
            seen |= set(bucket["names"].tolist()) & self._given.keys()
            of_images = home[of_points][bucket["points"]]
            self._divide(bucket, of_images, [f"node-{node}" for node in range(root + 1)], number)
        unseen = [name for name in self._given if name not in seen]
        owners = found.owners[self._vertices]

        def part_at(node: int, below: Names) -> Part:
            own = np.flatnonzero(observed == node)
            rows, arrays = self._at_home(node, unseen if node == root else [])
            rows["observations"] = own
            return assembled_part(self.block, owners, node, rows, arrays, below)

        manifest = divided(self.block, run, found.tree, part_at, options, source, [])
        self.close()
        return manifest

    @cached_property
    def _given(self) -> dict[str, int]:
        """Rows of control points, weighted points and tied points."""
        return {name: row for row, name in enumerate(self.block.point_ids)}

    @cached_property
    def _spread_out(self) -> tuple[int, Floats]:
        """Distribute observations over buckets; return counts."""
        path, source = self._tables.settings.tables["images"], self._source
        buckets = max(-(-path.stat().st_size // BUCKET), 1)
        counts, start = np.zeros(len(self.block.photo_ids)), 0
        assumed = np.asarray(ASSUMED_SD[source.cameras.rows[0].camera.unit or "px"])
        for number, table in enumerate(source.tables.batches("images", self._size)):
            images = images_of(source.tables, table, source.photos)
            xy, sd = source.converted(images)
            sd = assumed if sd is None else sd
            records = np.asarray(table.records)
            names = np.array(images.point_names, dtype=np.str_)
            batch = {
                "photos": images.photos,
                "points": images.points,
                "xy": xy,
                "sd": np.broadcast_to(sd.reshape(-1, 1) if sd.ndim == 1 else sd, xy.shape),
                "rows": start + np.arange(len(xy)),
                "records": records if images.used is None else records[images.used],
                "names": names,
            }
            counts += np.bincount(self._vertices[images.photos], minlength=len(counts))
            start += len(xy)
            of_points = [
                0 if name in self._tied else zlib.crc32(name.encode()) % buckets for name in names.tolist()
            ]
            of_images = np.array(of_points, dtype=np.int64)[images.points]
            self._divide(batch, of_images, [f"bucket-{k}" for k in range(buckets)], number)
        for k in range(buckets):
            bucket = self._gathered(f"bucket-{k}", [] if k else list(self._tied))
            records, photos, points = bucket.pop("records"), bucket["photos"], bucket["points"]
            again = repeated_pairs(photos, points, len(bucket["names"]))
            if again.size:
                alike = (photos == photos[again[0]]) & (points == points[again[0]])
                first, second = records[np.flatnonzero(alike)[:2]].tolist()
                raise Place(path, second).error(phrase("plain.image-twice", record=first))
            write_arrays(self._folder / f"{k}.npz", bucket)
        return buckets, counts

    def _divide(self, arrays: _Arrays, where: Indices, folders: Sequence[str], number: int) -> None:
        """Write the image observations of each folder as a numbered piece; `where` are their folders."""
        for k in np.unique(where).tolist():
            own = where == k
            points, of_points = np.unique(arrays["points"][own], return_inverse=True)
            piece = {name: each[own] for name, each in arrays.items() if name != "names"}
            piece |= {"points": of_points.reshape(-1), "names": arrays["names"][points]}
            (self._folder / folders[k]).mkdir(exist_ok=True)
            write_arrays(self._folder / folders[k] / f"{number:06d}.npz", piece)

    def _gathered(self, folder: str, names: Sequence[str]) -> _Arrays:
        """Return the image observations of all pieces of a folder; `names` are the first points."""
        place = self._folder / folder
        pieces = [read_arrays(each) for each in sorted(place.glob("*.npz"))]
        shutil.rmtree(place, ignore_errors=True)
        rows = {name: row for row, name in enumerate(names)}
        for piece in pieces:
            points = [rows.setdefault(name, len(rows)) for name in piece["names"].tolist()]
            piece["points"] = np.array(points, dtype=np.int64)[piece["points"]]
        found = {
            name: np.concatenate([none, *(piece[name] for piece in pieces if name in piece)])
            for name, none in _EMPTY.items()
        }
        return found | {"names": np.array(list(rows), dtype=np.str_)}

    def _buckets(self) -> Iterator[tuple[_Arrays, Incidence, Indices, Indices]]:
        """Yield buckets with their incidence, and the edges of points and, in the first one, observations."""
        for number in range(self._spread_out[0]):
            bucket = read_arrays(self._folder / f"{number}.npz")
            images = bucket["photos"], bucket["points"]
            observations = () if number else self.block.observations
            yield bucket, *incidence_of_points(self.block, bucket["names"].tolist(), images, observations)

    def _incidences(self) -> Iterator[Incidence]:
        return (incidence for _, incidence, *_ in self._buckets())

    def _at_home(self, node: int, unseen: list[str]) -> tuple[dict[str, Indices], dict[str, Any]]:
        """Return rows and arrays of points and images of a node from the pieces of all buckets."""
        found = self._gathered(f"node-{node}", [])
        names = [*found["names"].tolist(), *unseen]
        rows = np.array([self._given.get(name, -1) for name in names], dtype=np.int64)
        known = rows >= 0
        positions, sd = np.full((len(names), 3), np.nan), np.full((len(names), 3), np.inf)
        positions[known] = self.block.point_positions[rows[known]]
        sd[known] = self.block.point_sd[rows[known]]
        images = {f"image_{name}": found[name] for name in ("photos", "points", "xy", "sd")}
        arrays = {"point_ids": names, "point_positions": positions, "point_sd": sd, **images}
        return {"points": np.full(len(names), -1, dtype=np.int64), "images": found["rows"]}, arrays


def _selected(parts: Iterable[ColumnTable], wanted: Callable[[ColumnTable], Bools]) -> ColumnTable | None:
    found = [table.some(np.flatnonzero(wanted(table)).tolist()) for table in parts]
    return reduce(ColumnTable.joined, found) if found else None


def document(run: Run, outcome: Outcome) -> Document:
    """Return the document of an adjustment: sizes, sums of squares, iterations."""
    observations, weighted, unknowns = outcome.counts
    photos, points, images = (sum(getattr(run.manifest, name)) for name in ("photos", "points", "images"))
    groups = dict(zip(("camera", "ground", "plates", "observations"), outcome.sums_of_squares, strict=True))
    groups["total"] = sum(outcome.sums_of_squares)
    facts = [
        Fact("Status", outcome.status, note=f"{len(outcome.iterations)} iterations"),
        Fact.of("Photos", photos, note=f"in {len(run.manifest.tree)} nodes"),
        Fact.of("Points", points),
        Fact.of("Image points", images),
        Fact.of("Observations", observations, note=f"and {weighted} weighted unknowns"),
        Fact.of("Unknowns", unknowns),
        Fact.of("Degrees of freedom", outcome.degrees_of_freedom, decimals=0),
    ]
    facts += [Fact.of(f"Weighted sum of squares, {name}", value, figures=6) for name, value in groups.items()]
    if (variance := outcome.variance_of_unit_weight) is not None:
        facts.insert(1, Fact.of("sigma0", variance**0.5, figures=6, note="a priori 1"))
    iterations = Table("iterations", "Iterations", iteration_table(outcome.iterations))
    return Document("Adjustment in parts", "", highlights=facts, sections=[Section.of(iterations)])


@contextmanager
def on_disk(
    path: Path,
    reading: ReadOptions,
    folder: Path,
    division: Division,
    *,
    change: Callable[[AdjustOptions], AdjustOptions] = lambda options: options,
    threads: int | None = None,
) -> Iterator[Run]:
    """Open the adjustment of a project in parts in a folder; its images are read in batches.

    `change` returns the options for the options of the project.
    """
    with alone(folder), closing(Streamed(path, reading, folder)) as streamed:
        options = core_options(change(streamed.project.options), streamed.block)
        source = streamed.source(options)
        written = partial(streamed.divided, folder, options=options, source=source)

        def counts(parts: int) -> Counts:
            return streamed.counted(parts)[1]

        photos = len(streamed.block.photo_ids)
        with opened(folder, source, photos, counts, written, division, threads) as run:
            yield run
