"""Document of a camera calibrated by sky exposures."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.io.angles import ARCSEC
from photogram.show.judgement import remarks_section, verdict_document, verdict_table
from photogram.show.page import Document, Drawing, Fact, Facts, Layers, Section, conventions
from photogram.show.quantity import members
from photogram.show.sketch.plot import Plot
from photogram.stellar import night_tables as tables
from photogram.stellar.camera_tables import correlated_members, correlations, matrix_table
from photogram.stellar.lens_choice import LensTest
from photogram.stellar.night_plots import sketches

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight

MAX_WORST_IMAGES = 25
MAX_EXPOSURES = 200


def night_document(result: CalibratedNight) -> Document:
    """Return the document of a night."""
    much, good = tables.facts(result)
    camera = result.camera
    free = np.flatnonzero(camera.known)
    matrix = correlations(camera.covariance)[np.ix_(free, free)]
    names = [camera.names[row] for row in free]
    correlation = matrix_table("correlations", "Correlations", names, matrix, decimals=3)
    lens = "Which lens the data prefer, and which of its terms are significant."
    layers = Layers("exposure-layers", tables.exposures(result, MAX_EXPOSURES))
    sections = [
        Section("pictures", "Stars and residuals", [pictures(sketches(result))]),
        Section("size", "Size and fit", [Facts("Size", much), Facts("Fit", good)]),
        Section("camera", "Camera", [tables.parameters(result), correlation]),
        Section("exposures", "Exposures", [layers]),
        Section("lens", "Lens", [tables.lens_tests(result), tables.lenses(result)], lens),
        Section.of(tables.worst(result, MAX_WORST_IMAGES)),
        Section.of(verdict_table(result.verdict)),
        remarks_section(result.messages),
    ]
    details = [
        tables.exposure_table(result),
        *tables.attitudes(result),
        tables.stars(result),
        tables.images(result),
    ]
    return verdict_document(
        result.verdict,
        "Calibration of a camera by exposures of the sky",
        result.night.title,
        highlights=_highlights(result),
        sections=sections,
        members=_members(result),
        details=[*map(Section.of, details)],
    )


def pictures(drawn: dict[str, Plot]) -> Layers:
    """Return named plots as layers of a page."""
    layers = [
        Drawing(f"picture-{name}", name[:1].upper() + name[1:], "", partial(drawn.get, name))
        for name in drawn
    ]
    return Layers("picture-layers", layers)


def _members(result: CalibratedNight) -> dict[str, Any]:
    found, night, camera, test = result.calibration, result.night, result.camera, result.test
    return {
        "title": night.title,
        "conventions": conventions("night"),
        "m": found.mean_error,
        "m_unit": "standard deviation of an image coordinate",
        "sd_px": night.pixel_sd,
        **members(found, "degrees_of_freedom", "iterations", stop="status"),
        **members(result, "converged", "usable", "doubtful", "falsely_identified"),
        "global_test": test and members(test, "limits", "probability", variance_of_unit_weight="variance"),
        "lens": {
            "name": camera.lens,
            **members(camera, "common_scale", model="facts.model", formula="facts.formula"),
            "tried": [{**vars(fit), "reason": str(fit.reason)} for fit in result.lenses],
            "scale_test": result.scale_test and _test(result.scale_test),
            "term_tests": [*map(_test, result.term_tests)],
        },
        "effects": night.site.effects,
        "standstill": _standstill(result),
        "messages": [*map(str, result.messages)],
        "covariance": {"order": camera.names, "matrix": camera.covariance},
        "correlated": correlated_members(result.correlated()),
        "significance": result.significance(),
    }


def _test(test: LensTest) -> dict[str, Any]:
    return {**vars(test), "verdict": test.verdict}


def _standstill(result: CalibratedNight) -> dict[str, Any] | None:
    test = result.standstill
    if test is None:
        return None
    return {
        **members(
            test, "probability", chi_square="statistic", degrees_of_freedom="dimension", own_probability="own"
        ),
        "turn_arcsec": test.turns / ARCSEC,
        "moved": [result.names[k] for k in test.moved],
    }


def _highlights(result: CalibratedNight) -> list[Fact]:
    found, test = result.calibration, result.test
    rms = float(np.sqrt(np.mean(found.residuals**2)))
    expected = test and f"{test.limits[0]:.3f} to {test.limits[1]:.3f} expected of its square"
    of = f"of {len(result.night.exposures)}; {len(found.xy)} images of {len(found.catalogue)} stars"
    return [
        Fact.of("Mean error of unit weight", found.mean_error, note=expected or "", decimals=3),
        Fact.of("rms of image residuals", rms, "px", figures=3),
        Fact.of("Exposures", len(result.exposures), note=of),
        Fact.of(
            "Any exposure falsely identified",
            result.falsely_identified,
            note="probability, at most",
            figures=1,
        ),
    ]
