"""Reading the result of a block from the files of a folder (`docs/results.md`)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from photogram.network.block import Block
from photogram.results.block_files import parts_of_block, saved_classes
from photogram.results.result import Result
from photogram.results.result_files import read_saved, rows_of


def read_block_result(folder: Path, document: Mapping[str, Any]) -> Result:
    """Return the result from a folder; refuse missing, damaged or wrong files."""
    saved = read_saved(folder, saved_classes(), document)
    given = saved.members("block", Block)
    images, names = saved.sheets["images"], {}
    for kind in ("photo", "point"):
        sheet = saved.sheets[f"{kind}s"]
        own = sheet.names(kind)
        names[kind] = (
            own.names if (own.rows == np.arange(len(own))).all() else [own.names[k] for k in own.rows]
        )
        given[f"{kind}_ids"] = names[kind]
        given[f"image_{kind}s"] = rows_of(images.names(kind), names[kind], images.path)
    units = {"unit": given["linear_unit"], "image_unit": str(document["image_unit"])}
    parts = parts_of_block(geographic=given["spheroid"] is not None, **units)
    own_arrays, block_arrays = saved.arrays(parts, "block")
    block = Block(**given | block_arrays)
    members = saved.members("result", Result)
    if block.timed or any(each.knot_unknowns for each in block.cameras):
        # Coefficients of photos with their own trajectories, and knots, are created with their block.
        pairs = zip(members["unknowns"], block.unknowns, strict=True)
        members["unknowns"] = tuple(replace(each, given=own) for each, own in pairs)
    return Result(**members, **own_arrays, block=block, state=saved.state())
