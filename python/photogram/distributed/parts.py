"""Part of a node: a block on disk, as tables in Parquet."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from photogram.arguments.types import Indices
from photogram.distributed.cut import alone_of, photos_of, vertices_of
from photogram.distributed.files import read_json, write_file, write_json
from photogram.errors import InputError
from photogram.io.column_table import NameColumn
from photogram.io.parquet import Column, parquet_content, read_sheet
from photogram.io.seals import check_seal, recorded, seal
from photogram.io.structure import Decoder, Encoder
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block
from photogram.network.films import Scan
from photogram.network.motion import IMAGES, PHOTOS
from photogram.network.unknowns import Unknown
from photogram.results.block_files import saved_classes
from photogram.words import phrase

TABLES: dict[str, tuple[str, ...]] = {
    "photos": PHOTOS,
    "points": ("point_positions", "point_sd"),
    "images": IMAGES,
}  # Arrays with a row for each photo, point or image
SETTINGS = "part.json"
IN_TABLES = ("photo_ids", "point_ids", *(name for each in TABLES.values() for name in each))


@dataclass(frozen=True, eq=False)
class Part:
    """Part of a node: a block, and its rows in the whole block.

    Photos are its own and photos of nodes above that its observations or nodes below touch. Points, images
    and other observations have their home here; cameras are complete. `owners` (P,) are the nodes of the
    photos, this one or one above. `unknowns` are the rows of the shared unknowns `common`.
    """

    node: int
    block: Block
    owners: Indices
    photos: Indices
    points: Indices
    images: Indices
    observations: Indices
    unknowns: Indices
    common: tuple[Unknown, ...]


class Names(NamedTuple):
    """Blocks of unknowns of nodes above, as ascending rows of the whole block."""

    photos: list[int]
    cameras: list[int]
    unknowns: list[int]


def part_of(block: Block, owners: Indices, homes: Mapping[str, Indices], node: int, below: Names) -> Part:
    """Return the part of a node; nodes below contribute the names `below`.

    `homes` are the home nodes of `points`, `images` and `observations`.
    """
    rows = {name: np.flatnonzero(home == node) for name, home in homes.items()}
    arrays = {name: getattr(block, name)[rows[of]] for of in ("points", "images") for name in TABLES[of]}
    new_points = np.full(len(block.point_ids), -1, dtype=np.int64)
    new_points[rows["points"]] = np.arange(len(rows["points"]))
    arrays["image_points"] = new_points[arrays["image_points"]]
    arrays["point_ids"] = [block.point_ids[row] for row in rows["points"]]
    return assembled_part(block, owners, node, rows, arrays, below)


def assembled_part(
    block: Block,
    owners: Indices,
    node: int,
    rows: Mapping[str, Indices],
    arrays: dict[str, Any],
    below: Names,
) -> Part:
    """Assemble a part from its points and observations and the names of nodes below.

    The block may exclude points and images; `owners` are (P,) the nodes of all its photos. `rows` are
    `points`, `images` and `observations` at home, in the whole block, `arrays` the fields of the part of
    points and images. `image_photos` are rows of the whole block, `image_points` of the points of the part.
    """
    own = [block.observations[row] for row in rows["observations"].tolist()]
    touched = owners == node
    touched[arrays["image_photos"]] = True
    touched[below.photos] = True
    if own or block.mounts or block.timed:
        alone = alone_of(block) if own else {}
        for each in own:
            touched[[block._photo_rows[name] for name in photos_of(each, alone)]] = True
        # Include photos that represent others on frames and trajectories
        touched[vertices_of(block)[np.flatnonzero(touched)]] = True
    photos = np.flatnonzero(touched)
    names = [block.photo_ids[row] for row in photos]
    new_photos = np.full(len(touched), -1, dtype=np.int64)
    new_photos[photos] = np.arange(len(photos))
    changes: dict[str, Any] = {
        name: None if getattr(block, name) is None else getattr(block, name)[photos]
        for name in TABLES["photos"]
    }
    present = set(names)
    reduced = block.replace(
        **changes | arrays | {"image_photos": new_photos[arrays["image_photos"]]},
        photo_ids=names,
        point_check_sd=None,  # stored in the whole block
        observations=own,
        mounts=[each for each in block.mounts if each.photo in present],
        timed=[each for each in block.timed if each.photo in present],
        passages=[each for each in block.passages if isinstance(each, Scan) and each.photo in present],
    )
    whole = {id(each): row for row, each in enumerate(block.unknowns)}
    # Unknowns of the block are first, in the order of the block.
    unknowns = [whole[id(each)] for each in reduced.unknowns]
    unknowns += sorted(set(below.unknowns) - set(unknowns))
    return Part(
        node,
        reduced,
        owners[photos],
        photos,
        rows["points"],
        rows["images"],
        rows["observations"],
        np.array(unknowns, dtype=np.int64),
        tuple(block.unknowns[row] for row in unknowns),
    )


def names_above(
    part: Part,
    below: Names,
    shared: Indices,
    of_unknowns: Mapping[int, str],
    alone: Mapping[int, str],
) -> Names:
    """Return names of unknowns that a part passes to nodes above.

    `shared` are the shared cameras of the whole block, `of_unknowns` is from :func:`photos_of_unknowns`,
    `alone` from :func:`alone_of`.
    """
    # Photos that are represented by others add no unknowns.
    free = vertices_of(part.block) == np.arange(len(part.photos))
    photos = part.photos[(part.owners != part.node) & free]
    cameras = part.block.photo_cameras
    used = set() if cameras is None else set(cameras.tolist()) & set(shared.tolist())
    at_home = {part.block.photo_ids[row] for row in np.flatnonzero(part.owners == part.node)}
    unknowns = sorted(
        row
        for row, each in zip(part.unknowns.tolist(), part.common, strict=True)
        if not (each.is_held or id(each) in of_unknowns or alone.get(id(each)) in at_home)
    )
    return Names(photos.tolist(), sorted(used | set(below.cameras)), unknowns)


def write_part(folder: Path, part: Part) -> str:
    """Write the tables of a part and then its settings; return the seal of all files."""
    block, seals = part.block, dict[str, str]()
    for table, fields in TABLES.items():
        columns = []
        if table != "images":
            names = getattr(block, f"{table[:-1]}_ids")
            columns.append(Column(table[:-1], NameColumn(names, np.arange(len(names))), "", "its name"))
        columns.append(Column("row", getattr(part, table), "", f"which of the {table} of the whole"))
        if table == "photos":
            columns.append(Column("owner", part.owners, "", "the node it belongs to"))
        for name in fields:
            values = getattr(block, name)
            if values is not None:
                columns.append(Column(name, np.asarray(values), "", f"as Block.{name}"))
        write_file(folder / f"{table}.parquet", recorded(seals, table, parquet_content(columns, {})))
    encoder = Encoder()
    document = {
        "node": part.node,
        "tables": seals,
        "observations": part.observations.tolist(),
        "unknowns": part.unknowns.tolist(),
        "block": encoder.fields(block, IN_TABLES),
        # After the block, which contains the same unknown objects.
        "common": encoder.value(list(part.common)),
    }
    return write_json(folder / SETTINGS, document)


def read_part(folder: Path, sealed: str) -> Part:
    """Read a part from a folder; InputError if it is another part or damaged."""
    document = read_json(folder / SETTINGS)
    if seal(document) != sealed:
        raise InputError(phrase("parts.other-node"), file=folder / SETTINGS)
    for table in TABLES:
        check_seal(folder / f"{table}.parquet", document["tables"][table], SETTINGS)
    sheets = {table: read_sheet(folder / f"{table}.parquet") for table in TABLES}
    decoder = Decoder(saved_classes(), folder / SETTINGS)
    given: dict[str, Any] = decoder.fields(document["block"], Block)
    common = tuple(decoder.value(document["common"]))
    for table, fields in TABLES.items():
        given |= {name: sheets[table].columns.get(name) for name in fields}
    for table in ("photos", "points"):
        names = sheets[table].names(table[:-1])
        given[f"{table[:-1]}_ids"] = [names.names[row] for row in names.rows.tolist()]
    return Part(
        document["node"],
        Block(**given),
        sheets["photos"].column("owner"),
        sheets["photos"].column("row"),
        sheets["points"].column("row"),
        sheets["images"].column("row"),
        np.array(document["observations"], dtype=np.int64),
        np.array(document["unknowns"], dtype=np.int64),
        common,
    )
