"""Parts of a plain project with images in Parquet, read in batches.

Photos, control and ties are few and remain in memory. Image observations are read twice: first into buckets
by point name, so that a bucket contains all observations of its points, then into the parts.
"""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from photogram.adjustment.first_features import started
from photogram.arguments.types import Floats, Indices
from photogram.distributed.cut import Counts, Incidence, Tree, counted_work, cut, homes, joined
from photogram.distributed.files import read_arrays, write_arrays
from photogram.distributed.parts import AtHome, Names, Part, assembled_part
from photogram.distributed.run import Manifest, divided, places_of
from photogram.errors import InputError
from photogram.formats.builder import ASSUMED_SD
from photogram.formats.plain import SETTINGS
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.photos import image_coordinates, read_images, read_photos
from photogram.formats.plain.reading import read_tables
from photogram.formats.plain.settings import Settings, read_settings
from photogram.formats.plain.tables import Tables, Transform
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.delimited import read_head
from photogram.io.parquet import coded
from photogram.messages import missing_columns, unknown_name
from photogram.network.block import checked, refuse_passages
from photogram.network.core_arrays import CoreOptions
from photogram.network.observations.photos import with_epochs
from photogram.words import phrase

TIES = ("distances", "height_differences", "coordinate_differences")  # Tables of observations between points
HELD = (
    *("cameras", "photos", "control", "gnss", "gnss_groups", "attitudes", "attitude_groups"),
    *("relative_poses", "instruments", *TIES),
)
"""Tables that are loaded into memory."""
BATCH = 2**18  # Rows per read
BUCKET = 2**22  # Approximate rows of a bucket, which is loaded completely


def streamable(path: Path) -> bool:
    """Return whether the images of a project can be read batch by batch."""
    place = path / SETTINGS if path.is_dir() else path
    if place.suffix != ".toml" or not place.is_file():
        return False
    settings = read_settings(place)
    tables = settings.tables
    return (
        settings.photo_files is None
        and {"images", "photos"} <= set(tables)
        and tables["images"].suffix == ".parquet"
        and set(tables) <= {"images", "points", *HELD}
    )


class Streamed:
    """A project that is read batch by batch."""

    def __init__(self, path: Path, options: ReadOptions, folder: Path) -> None:
        settings = read_settings(path / SETTINGS if path.is_dir() else path, options)
        if settings.features:
            raise InputError(phrase("plain.parts-features"), file=settings.path)
        self._folder = folder / "buckets"
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True)
        self._settings = settings
        held = self._without_images()
        self.project: Project = read_tables(Tables(held, []), options)
        if self.project.options.datum in ("inner", "minimum"):
            raise InputError(phrase("plain.parts-datum"), file=settings.path)
        if self.project.block.timed:
            photo = self.project.block.timed[0].photo
            raise InputError(phrase("plain.parts-moving", photo=photo), file=settings.path)
        refuse_passages(self.project.block, "blocks in parts")
        block = started(checked(self.project.block))
        # A node has only some of the observations of a drift.
        self.block = block.replace(observations=with_epochs(block.observations))
        tables = Tables(replace(settings, frame=self.project.frame), [])
        self._cameras = read_cameras(tables)
        self._photos = read_photos(tables, Transform(tables.settings, tables.messages), self._cameras)
        if self._photos.names != self.block.photo_ids or len(self._cameras.cameras) != len(
            self.block.cameras
        ):
            raise InputError(phrase("plain.parts-cameras"), file=settings.path)
        known = (self.block.point_sd, self.block.photo_position_sd)
        if not (self.block.observations or any(np.isfinite(each).any() for each in known)):
            raise InputError(phrase("plain.parts-free"), file=settings.path)
        named = {name for each in self.block.observations for name in each.points}
        self._tied = {name: row for row, name in enumerate(sorted(named))}

    @property
    def images(self) -> Floats:
        """(P,) number of image observations of each photo."""
        return self._spread_out[1]

    def close(self) -> None:
        """Remove the buckets."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def source(self, options: CoreOptions) -> str:
        """Return a fingerprint of options, settings, sizes and times of files."""
        digest = hashlib.sha256(repr((options, self._settings)).encode())
        for name, table in sorted(self._settings.tables.items()):
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
        for number, incidence in enumerate(self._incidences()):
            home = homes(found.owners, incidence, root)
            bucket = read_arrays(self._folder / f"{number}.npz")
            of_points, of_observations = self._edges(number, len(bucket["names"]))
            if not number:
                observed = home[of_observations]
            seen |= set(bucket["names"].tolist()) & self._given.keys()
            self._into_pieces(number, bucket, home[of_points])
        unseen = [name for name in self._given if name not in seen]

        def part_at(node: int, below: Names) -> Part:
            own = np.flatnonzero(observed == node)
            at_home = self._at_home(node, unseen if node == root else [], own)
            return assembled_part(self.block, found.owners, node, at_home, below)

        manifest = divided(self.block, run, found.tree, part_at, options, source, [])
        self.close()
        return manifest

    def _without_images(self) -> Settings:
        """Return settings with nearly empty tables of points and images."""
        import pyarrow
        import pyarrow.parquet

        settings = self._settings
        schema = pyarrow.parquet.read_schema(settings.tables["images"])
        columns = {name.strip().lower(): name for name in schema.names}
        if not {"photo", "point"} <= columns.keys():
            message = missing_columns(["photo", "point"], schema.names)
            raise InputError(message, file=settings.tables["images"])
        if "use" in columns:
            message = phrase("plain.parts-column", column="use")
            raise InputError(message, file=settings.tables["images"])
        named = read_head(settings.tables["points"]) if "points" in settings.tables else []
        if any(name.startswith("sd") for name in named):
            message = phrase("plain.parts-column", column="sd_x")
            raise InputError(message, file=settings.tables["points"])
        self._columns = columns
        images, points = self._folder / "images.parquet", self._folder / "points.parquet"
        pyarrow.parquet.write_table(schema.empty_table(), images)
        tables = Tables(settings, [])
        ties = [table for kind in TIES if (table := tables.read(kind)) is not None]
        names = sorted({name for table in ties for end in ("from", "to") for name in table.texts(end)})
        nothing = np.full(len(names), np.nan)
        pyarrow.parquet.write_table(
            pyarrow.table({"point": pyarrow.array(names, pyarrow.string())} | dict.fromkeys("xyz", nothing)),
            points,
        )
        return replace(settings, tables={**settings.tables, "images": images, "points": points})

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {name: row for row, name in enumerate(self.block.photo_ids)}

    @property
    def _given(self) -> dict[str, int]:
        """Rows of control points and tied points."""
        return {name: row for row, name in enumerate(self.block.point_ids)}

    @cached_property
    def _spread_out(self) -> tuple[int, Floats]:
        """Distribute observations over buckets; return counts."""
        import pandas as pd
        import pyarrow
        import pyarrow.parquet

        path = self._settings.tables["images"]
        rows, unused = self._rows, self._photos.unused
        counts = np.zeros(len(rows))
        with pyarrow.parquet.ParquetFile(path) as file:
            buckets = max(-(-file.metadata.num_rows // BUCKET), 1)
            writers: list[pyarrow.parquet.ParquetWriter] = []
            start = 0
            try:
                for batch in file.iter_batches(BATCH):
                    table = pyarrow.Table.from_batches([batch])
                    photos, of_photos = _stripped(table.column(self._columns["photo"]))
                    points, of_points = _stripped(table.column(self._columns["point"]))
                    known = np.array([rows.get(each, -1) for each in photos], dtype=np.int64)
                    for each, row in zip(photos, known.tolist(), strict=True):
                        if row < 0 and each not in unused:
                            raise InputError(unknown_name("photo", each, rows), file=path)
                    used = known[of_photos] >= 0
                    counts += np.bincount(known[of_photos][used], minlength=len(rows))
                    hashed = pd.util.hash_array(np.array(points, dtype=object)) % np.uint64(buckets)
                    where = hashed.astype(np.int64)
                    where[[row for row, each in enumerate(points) if each in self._tied]] = 0
                    table = table.append_column("record", pyarrow.array(start + np.arange(len(table))))
                    if not writers:
                        writers = [
                            pyarrow.parquet.ParquetWriter(self._folder / f"{k}.parquet", table.schema)
                            for k in range(buckets)
                        ]
                    for k, writer in enumerate(writers):
                        own = used & (where[of_points] == k)
                        if own.any():
                            writer.write_table(table.filter(pyarrow.array(own)))
                    start += len(table)
            finally:
                for each in writers:
                    each.close()
        for k in range(buckets):
            self._read_bucket(k)
        return buckets, counts

    def _read_bucket(self, number: int) -> None:
        """Convert the rows of a bucket to arrays."""
        import pyarrow.parquet

        path = self._folder / f"{number}.parquet"
        settings = replace(self._settings, tables={**self._settings.tables, "images": path})
        # The column is internal and needs no remark.
        images = read_images(Tables(settings, []), self._photos)
        cameras = np.asarray(self._photos.cameras)
        xy, sd = image_coordinates(
            settings, images, self._cameras, cameras, np.zeros(len(cameras), dtype=bool)
        )
        if sd is None:
            sd = np.asarray(ASSUMED_SD[self._cameras.cameras[0].unit or "px"])
        names = list(dict.fromkeys([*self._tied, *images.point_names])) if not number else images.point_names
        places = {name: row for row, name in enumerate(names)}
        which = np.array([places[name] for name in images.point_names], dtype=np.int64)
        write_arrays(
            self._folder / f"{number}.npz",
            {
                "photos": images.photos,
                "points": which[images.points],
                "xy": xy,
                "sd": np.broadcast_to(sd.reshape(-1, 1) if sd.ndim == 1 else sd, xy.shape),
                "rows": pyarrow.parquet.read_table(path, columns=["record"]).column(0).to_numpy(),
                "names": np.array(names, dtype=np.str_),
            },
        )
        path.unlink()

    def _edges(self, number: int, points: int) -> tuple[Indices, Indices]:
        """Return the edge of each point and, in the first bucket, observation."""
        if number:
            return np.arange(points), np.zeros(0, dtype=np.int64)
        tied = [tuple(self._tied[name] for name in each.points) for each in self.block.observations]
        edges = joined(points, (each for each in tied if len(each) > 1))
        alone = iter(range(points, points + len(tied)))
        return edges, np.array([edges[each[0]] if each else next(alone) for each in tied], dtype=np.int64)

    def _incidences(self) -> Iterator[Incidence]:
        rows = self._rows
        for number in range(self._spread_out[0]):
            bucket = read_arrays(self._folder / f"{number}.npz")
            edges, of_observations = self._edges(number, len(bucket["names"]))
            others = [
                (rows[name], edge)
                for each, edge in zip(self.block.observations, of_observations.tolist(), strict=not number)
                for name in each.photos
            ]
            photos, own = np.array(others, dtype=np.int64).reshape(-1, 2).T
            yield Incidence(
                np.concatenate([bucket["photos"], photos]),
                np.concatenate([edges[bucket["points"]], own]),
                len(edges) + len(of_observations),
            )

    def _into_pieces(self, number: int, bucket: dict[str, np.ndarray], home: Indices) -> None:
        """Write the image observations of a bucket to their nodes."""
        of_images = home[bucket["points"]]
        for node in np.unique(of_images).tolist():
            own = of_images == node
            kept, which = np.unique(bucket["points"][own], return_inverse=True)
            place = self._folder / f"node-{node}"
            place.mkdir(exist_ok=True)
            piece = {name: bucket[name][own] for name in ("photos", "rows", "xy", "sd")}
            piece |= {"points": which.reshape(-1), "names": bucket["names"][kept]}
            write_arrays(place / f"{number:06d}.npz", piece)

    def _at_home(self, node: int, unseen: list[str], observations: Indices) -> AtHome:
        """Return the observations of a node from the pieces of all buckets."""
        place = self._folder / f"node-{node}"
        pieces = [read_arrays(each) for each in sorted(place.glob("*.npz"))] if place.is_dir() else []
        names = [str(name) for piece in pieces for name in piece["names"]]
        starts = np.cumsum([0, *(len(piece["names"]) for piece in pieces)])
        points = [piece["points"] + start for piece, start in zip(pieces, starts, strict=False)]
        names += unseen
        given, held = self._given, self.block
        rows = np.array([given.get(name, -1) for name in names], dtype=np.int64)
        known = rows >= 0
        positions, sd = np.full((len(names), 3), np.nan), np.full((len(names), 3), np.inf)
        positions[known], sd[known] = held.point_positions[rows[known]], held.point_sd[rows[known]]

        def whole(name: str, width: tuple[int, ...], kind: type) -> np.ndarray:
            return np.concatenate([np.zeros((0, *width), kind), *(each[name] for each in pieces)])

        return AtHome(
            points=np.full(len(names), -1, dtype=np.int64),
            names=names,
            point_positions=positions,
            point_sd=sd,
            images=whole("rows", (), np.int64),
            image_photos=whole("photos", (), np.int64),
            image_points=np.concatenate([np.zeros(0, dtype=np.int64), *points]),
            image_xy=whole("xy", (2,), np.float64),
            image_sd=whole("sd", (2,), np.float64),
            observations=observations,
        )


def _stripped(column: Any) -> tuple[list[str], Indices]:
    """Return column names without outer blanks, and the index of each row."""
    names, rows = coded(column)
    return [str(name).strip() for name in names], rows
