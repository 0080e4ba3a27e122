"""The check of a collection: that of its block, from where a robust adjustment brings it."""

from __future__ import annotations

from photogram.collection.adjust import adjust
from photogram.collection.as_block import as_block
from photogram.collection.collection import Collection
from photogram.diagnosis.diagnose import Manner, check_block
from photogram.diagnosis.diagnosis import Diagnosis
from photogram.diagnosis.findings import Section
from photogram.errors import AdjustmentError
from photogram.words import phrase


def check(network: Collection, threads: int | None) -> Diagnosis:
    """Check a collection."""
    section = Section("Start", "Values of a collection may be far off: a robust adjustment comes first.")
    try:
        adjusted = adjust(network, loss="huber", covariance=False, threads=threads)
        network = network.replace(
            photo_parameters=adjusted.photo_parameters, point_positions=adjusted.point_positions
        )
        section.figure("robust adjustment", adjusted.status)
    except AdjustmentError as error:
        section.remark(str(phrase("collection.no-robust-start", error=error)))
    sections, result = check_block(as_block(network), Manner({"threads": threads}))
    return Diagnosis("", [section, *sections], result)
