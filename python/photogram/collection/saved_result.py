"""Reading of a saved collection result from a folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from photogram.collection.collection import Collection
from photogram.collection.parameters import parameters_of
from photogram.collection.result import AdjustedCollection
from photogram.collection.result_files import collection_parts
from photogram.messages import Message
from photogram.network.core_arrays import CoreOptions
from photogram.results.parts import Iteration
from photogram.results.result_files import read_saved
from photogram.statistics.findings import Removed
from photogram.words import Phrase


def read_collection_result(folder: Path, document: Mapping[str, Any]) -> AdjustedCollection:
    """Read the result of a collection from a folder; InputError if files are invalid."""
    saved = read_saved(folder, (CoreOptions, Iteration, Message, Phrase, Removed), document)
    given = saved.members("collection", Collection)
    images = saved.sheets["images"]
    for kind in ("photo", "point"):
        given[f"image_{kind}s"] = images.numbers(kind)
    names, units = parameters_of(given["camera"])
    own, arrays = saved.arrays(collection_parts(names, units), "collection")
    collection = Collection(**given, **arrays)
    return AdjustedCollection(
        **saved.members("result", AdjustedCollection), **own, collection=collection, state=saved.state()
    )
