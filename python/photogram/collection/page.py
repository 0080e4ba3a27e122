"""The page of an adjusted collection of photos."""

from __future__ import annotations

import numpy as np

from photogram.collection.report import size_of
from photogram.collection.result import AdjustedCollection
from photogram.results.page.network import drawings, network_page, size_section
from photogram.results.page.tables import control_section, stations_section
from photogram.show.methods import page_of
from photogram.show.page import Document, Fact, Section, significant


@page_of.register(AdjustedCollection)
@np.errstate(over="ignore", invalid="ignore")
def collection_page(result: AdjustedCollection) -> Document:
    """Return the report of an adjusted collection for the browser."""
    pictures = drawings(result)
    cameras = Section("cameras", "Cameras", [pictures[name] for name in ("distortion", "correlations")])
    return network_page(
        result,
        "Adjustment of a collection of photos",
        _size_section(result),
        [control_section(result), stations_section(result), cameras],
        photos=int(np.count_nonzero(result.photo_images)),
    )


def _size_section(result: AdjustedCollection) -> Section:
    given, variance = result.collection, result.variance_of_unit_weight
    more = [Fact("Camera", given.camera, note=f"unknowns of a photo: {', '.join(given.parameters)}")]
    if result.datum:
        held = [f"{name} of photo {photo}" for photo, name in result.datum]
        more.append(Fact("Datum", "held parameters", note=", ".join(held)))
    if behind := int(np.count_nonzero(result.point_rays_behind)):
        more.append(Fact("Points behind a camera", f"{behind}", tone="look"))
    first = 0.5 * result.initial_weighted_sum_of_squares
    good = [
        Fact("Cost at first, half the sum of squares", significant(first, 7)),
        Fact("Cost", significant(result.cost, 7)),
        Fact("Variance of unit weight", f"{variance:.6f}" if variance is not None else "undefined"),
    ]
    return size_section(result, size_of(result), more, good)
