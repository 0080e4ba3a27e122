"""Structure of a block: rays, ties and bandwidth (Appendices A and H)."""

from __future__ import annotations

import numpy as np

from photogram.arguments.types import Indices
from photogram.diagnosis.findings import Section, Words, section_of
from photogram.network.block import Block
from photogram.network.structuring import FEWEST_TIES, structure, ties
from photogram.results.document import bandwidths
from photogram.results.result import Result


def structure_section(block: Block, result: Result | None, words: Words) -> Section:
    """Report rays, ties and bandwidth, photos with few ties, and separate parts."""
    section = section_of("bandwidth" if words.bandwidth else "structure", order=words.order)
    rays = np.bincount(block.image_points, minlength=len(block.point_ids))
    counts = np.bincount(block.image_photos, minlength=len(block.photo_ids))
    for number, points in zip(*np.unique(rays, return_counts=True), strict=True):
        section.figure(f"points on {number} photos", points)
    section.figure(
        "points on a photo, least, median, most", f"{counts.min()}, {np.median(counts):.0f}, {counts.max()}"
    )
    if words.bandwidth:
        _bandwidths(block, result, section)
    tied = ties(block)
    for photo in np.flatnonzero(tied < FEWEST_TIES).tolist():
        name, count = block.photo_ids[photo], int(tied[photo])
        fields = {"photo": name, "n": count, "least": FEWEST_TIES}
        section.note("grave", "check.few-ties", [name], [], {"ties": float(count)}, **fields)
    _parts(block, section)
    return section


def _bandwidths(block: Block, result: Result | None, section: Section) -> None:
    if result is not None:
        head, figures = bandwidths(result)
        section.remark("check.remark.bandwidth", description=head)
        for name, value in figures:
            section.figure(name, value)
        bandwidth = structure(result.block.image_photos, result.block.image_points).effective_bandwidth
    else:
        structured = structure(block.image_photos, block.image_points)
        bandwidth = structured.effective_bandwidth
        section.figure(
            "bandwidth in the order of the input",
            f"{bandwidth} sets of three effective, {structured.naive_bandwidth} without sharing",
        )
    photos = (bandwidth - 1) // 2
    reach = max(photos - 1, 0)
    section.remark("check.remark.sets", sets=bandwidth, photos=photos, reach=reach)


def _parts(block: Block, section: Section) -> None:
    parts = parts_of(block)
    numbers, sizes = np.unique(parts, return_counts=True)
    section.figure("parts without a common point", len(numbers))
    if len(numbers) < 2:
        return
    largest = numbers[sizes.argmax()]
    for number in numbers[numbers != largest].tolist():
        names = [block.photo_ids[photo] for photo in np.flatnonzero(parts == number).tolist()]
        section.note("grave", "check.separate-part", names, photos=names)


def parts_of(block: Block) -> Indices:
    """(P,) the first photo in the part of each photo."""
    photos, points = block.image_photos, block.image_points
    labels = np.arange(len(block.photo_ids))
    while True:
        by_point = np.full(len(block.point_ids), len(labels))
        np.minimum.at(by_point, points, labels[photos])
        fewer = labels.copy()
        np.minimum.at(fewer, photos, by_point[points])
        # Follow the labels of labels: the number of passes grows with the logarithm of the length.
        fewer = fewer[fewer]
        if (fewer == labels).all():
            return labels
        labels = fewer
