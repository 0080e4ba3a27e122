"""The page of a camera that was calibrated by exposures of the sky."""

from __future__ import annotations

import math

import numpy as np

from photogram.show.cells import page_table
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.methods import page_of
from photogram.show.page import (
    Cell,
    Column,
    Document,
    Fact,
    Facts,
    Layers,
    Part,
    Row,
    Section,
    Table,
    decimals_of,
    fixed,
    significant,
)
from photogram.show.quantity import chosen
from photogram.stellar.night_plots import sketches
from photogram.stellar.night_result import CalibratedNight
from photogram.stellar.night_tables import (
    attitudes,
    facts,
    fit,
    inertial,
    largest,
    lens_tests,
    lenses,
)
from photogram.stellar.page import plate_pictures

WORST = 25
"""Images in the table of the worst."""
LISTED = 200
"""Exposures that are listed at most."""


@page_of.register(CalibratedNight)
def night_page(result: CalibratedNight) -> Document:
    """Return the report of a night for the browser."""
    much, good = facts(result)
    sections = [
        Section(
            "pictures", "Stars and residuals", [Layers("picture-layers", plate_pictures(sketches(result)))]
        ),
        Section("size", "How much, how good", [Facts("How much", much), Facts("How good", good)]),
        Section("camera", "Camera", _camera(result)),
        Section("exposures", "Exposures", _exposures(result)),
        Section(
            "lens",
            "Lens",
            _lens(result),
            "Which lens the data speak for, and which of its terms are worth having.",
        ),
        Section("worst", "Worst observations", [_worst(result)]),
        tests_section(result.verdict),
        remarks_section(result.messages),
    ]
    return Document(
        what="Calibration of a camera by exposures of the sky",
        title=result.night.title,
        judgements=[judged(result.verdict)],
        advice=result.verdict.next,
        highlights=_highlights(result),
        sections=sections,
    )


def _highlights(result: CalibratedNight) -> list[Fact]:
    found, night = result.calibration, result.night
    rms = float(np.sqrt(np.mean(found.residuals**2)))
    expected = (
        ""
        if result.test is None
        else f"{result.test.limits[0]:.3f} to {result.test.limits[1]:.3f} expected of its square"
    )
    return [
        Fact("Mean error of unit weight", f"{found.mean_error:.3f}", note=expected),
        Fact("rms of image residuals", significant(rms, 3), "px"),
        Fact(
            "Exposures",
            f"{len(result.exposures)}",
            note=f"of {len(night.exposures)}; {len(found.xy)} images of {len(found.catalogue)} stars",
        ),
        Fact(
            "Any exposure falsely identified", f"{result.falsely_identified:.0e}", note="probability, at most"
        ),
    ]


def _camera(result: CalibratedNight) -> list[Part]:
    camera, prior = result.camera, result.night.prior
    errors, significance = np.sqrt(np.diag(camera.covariance)), result.significance()
    rows: list[Row] = []
    for i, name in enumerate(camera.names):
        error, value = float(errors[i]), float(camera.values[i])
        held = "as fx" if camera.common_scale and name == "fy" and errors[0] > 0 else "held"
        written = fixed(value, decimals_of(np.array([error]))) if error > 0 else significant(value, 9)
        before: list[float | None] = [None, None]
        if prior is not None and prior.known[i]:
            before = [float(prior.values[i]), math.sqrt(prior.covariance[i, i])]
        rows.append(
            [name, Cell(written, sorts=value), error if error > 0 else held, significance.get(name), *before]
        )
    columns = (
        Column("Parameter", text=True),
        Column("Value"),
        Column("Mean error", figures=3),
        Column("Over it", decimals=1),
        Column("Prior", figures=7),
        Column("Its mean error", figures=3),
    )
    note = "fx, fy, cx, cy in pixels, terms of the lens without a unit."
    parts: list[Part] = [Table("Parameters", columns, rows, note)]
    free = np.flatnonzero(errors > 0)
    if len(free) > 1:
        heads = [Column("", text=True), *(Column(camera.names[j], decimals=3) for j in free.tolist())]
        matrix: list[Row] = [
            [
                camera.names[i],
                *(
                    float(camera.covariance[i, j] / (errors[i] * errors[j])) if j <= i else None
                    for j in free.tolist()
                ),
            ]
            for i in free.tolist()
        ]
        parts.append(Table("Correlations", heads, matrix))
    return parts


def _exposures(result: CalibratedNight) -> list[Part]:
    count = len(result.names)
    note = f"The first {LISTED} of {count}; exposures.csv has all." if count > LISTED else ""
    names, azimuth, elevation, _, errors, *_ = attitudes(result)
    _, ra, dec, *_ = inertial(result)
    both = {
        "Identification and fit": fit(result),
        "Attitudes": [names, azimuth, elevation, ra, dec, errors],
    }
    rows = np.arange(min(count, LISTED))
    tables = [page_table(caption, chosen(table, rows), note) for caption, table in both.items()]
    return [Layers("exposure-layers", tables)]


def _lens(result: CalibratedNight) -> list[Part]:
    parts: list[Part] = []
    if result.scale_test or result.term_tests:
        order = "In the order in which they may be left out, each without those above it."
        parts.append(page_table("Terms", lens_tests(result), order))
    if result.lenses:
        parts.append(page_table("Lenses that were tried", lenses(result), "The first is taken."))
    return parts


def _worst(result: CalibratedNight) -> Table:
    table = largest(result, WORST)
    note = f"The {len(table[0].values)} images of the largest test values."
    return page_table("Worst observations", table, note)
