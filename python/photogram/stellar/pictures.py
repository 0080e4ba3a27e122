"""Plot data of plates and nights: residuals, tests, correlations, distortion; plot of refraction."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Bools
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass, replace
from photogram.plots.accessor import drawings
from photogram.plots.picture_data import Correlated, Curve, Curves, Images
from photogram.show.page import Drawing, Layers
from photogram.show.sketch.marks import Line, Mark, Panel, band, horizontal_line, spread
from photogram.show.sketch.plot import Plot
from photogram.show.style import COLOURS, FAINT
from photogram.statistics.findings import Tested
from photogram.stellar.camera_tables import correlations, night_standardized, plate_standardized
from photogram.stellar.curves import distortion_curves, refraction_curves
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from photogram.stellar import CalibratedNight, Result

PICTURES = ("residuals", "tests", "correlations", "distortion")
_RADII = 200
_WIDEST = np.radians(110)


@dataclass(frozen=True, eq=False)
class PicturedStars:
    """Plot data of star images: the parts of `results.picture_data.PicturedNetwork` without a network."""

    images: Images
    tested: Sequence[Tested]
    outlying: list[Bools]
    correlations: list[Correlated]
    distortion: list[Curves]
    unit_weight: float = 1.0


def plate_pictured(result: Result) -> PicturedStars:
    """Return the plot data of a plate; attitude groups have separate panels."""
    problem, tested = result.problem, plate_standardized(result)
    rows = np.flatnonzero(result.solved.free)
    matrix = correlations(result.covariance)[np.ix_(rows, rows)]
    images = Images(
        unit="mm",
        photos=problem.image_groups,
        points=problem.image_stars,
        xy=1e3 * problem.image_xy,
        residuals=-1e3 * result.solved.residuals,
        redundancy=result.solved.redundancy,
        cameras=problem.image_groups,
        names=GROUPS,
        down=False,
        scanned=np.zeros(len(problem.image_xy), bool),
    )
    marks = [result.verdict.marks(each.kind, each.values.shape) for each in tested]
    correlated = [Correlated("plate", result.estimated, matrix)]
    return PicturedStars(images, tested, marks, correlated, _plate_distortion(result))


def _plate_distortion(result: Result) -> list[Curves]:
    problem, values = result.problem, result.parameters
    if not problem.options.curves:
        return []
    fine = replace(problem.options, interval=(problem.options.extent or 0.1) / _RADII)
    found = distortion_curves(replace(result, problem=replace(problem, options=fine)))
    centre = values["xp"] + values["dx"], values["yp"] + values["dy"]
    distance = f"transformed for the calibrated principal distance {1e3 * found.calibrated:.4f} mm"
    curves = [
        Curve("", 1e3 * found.radial, {"radial distortion": 1e3 * found.radial_error}),
        Curve(distance, 1e3 * found.transformed, {"transformed curve": 1e3 * found.transformed_error}),
        Curve("decentring profile", 1e3 * found.decentering, {"profile": 1e3 * found.decentering_error}),
    ]
    observed = float(np.linalg.norm(problem.image_xy - centre, axis=1).max())
    observed = 1e3 * min(observed, problem.options.extent)
    return [Curves("the plate", "mm", 1e3 * found.distance, observed, curves)]


def night_pictured(result: CalibratedNight) -> PicturedStars:
    """Return the plot data of a night, with all exposures in one panel."""
    found, tested = result.calibration, night_standardized(result)
    images = Images(
        unit="px",
        photos=found.exposures,
        points=found.stars,
        xy=found.xy,
        residuals=found.residuals,
        redundancy=found.redundancy,
        cameras=np.zeros_like(found.exposures),
        names=[result.camera.lens],
        down=True,
        scanned=np.zeros(len(found.xy), bool),
    )
    camera = result.camera
    known = np.flatnonzero(camera.known)
    matrix = correlations(camera.covariance)[np.ix_(known, known)]
    correlated = [Correlated(camera.lens, [camera.names[row] for row in known], matrix)]
    marks = [result.verdict.marks(each.kind, each.values.shape) for each in tested]
    return PicturedStars(images, tested, marks, correlated, _night_distortion(result), found.mean_error)


def _night_distortion(result: CalibratedNight) -> list[Curves]:
    """Return the effect of the radial terms along x against the radius without them."""
    camera = result.camera
    if not camera.facts.groups:
        return []
    radial = [row for row, name in enumerate(camera.names) if name.startswith("k")]
    rows = np.arange(len(camera.values))
    axes = replace(camera, values=np.where(np.isin(rows, [0, 1, 2, 3, *radial]), camera.values, 0.0))
    ideal = replace(camera, values=np.where(rows < 4, camera.values, 0.0))
    theta = np.linspace(0, min(camera.largest_angle(result.night.frame), _WIDEST), _RADII)
    along = np.column_stack([np.sin(theta), np.zeros(len(theta)), np.cos(theta)])
    seen, radii = (each.images(along)[:, 0] - camera.values[2] for each in (axes, ideal))
    partials = axes.partials(along)[:, 0, radial]
    covariance = camera.covariance[np.ix_(radial, radial)]
    errors = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", partials, covariance, partials), 0.0))
    observed = float(np.linalg.norm(result.calibration.xy - camera.values[2:4], axis=1).max())
    curve = Curve("", seen - radii, {"curve": errors} if errors.any() else {})
    return [Curves(f"the lens {camera.lens}", "px", radii, observed, [curve])]


def plate_drawings(result: Result) -> Layers:
    shown = [*drawings(result, PICTURES).values()]
    if result.problem.options.refraction:
        shown.append(Drawing("picture-refraction", "Refraction", "", partial(_refraction, result)))
    return Layers("picture-layers", shown)


def night_drawings(result: CalibratedNight) -> Layers:
    return Layers("picture-layers", [*drawings(result, PICTURES).values()])


def _refraction(result: Result) -> Plot:
    marks: list[Mark] = []
    ends = []
    for colour, group in zip(COLOURS, result.groups, strict=False):
        found = refraction_curves(result, group)
        z, change = np.degrees(found.zenith_distance), (found.corrected - found.given) / ARCSEC
        low, high = change - found.error / ARCSEC, change + found.error / ARCSEC
        marks.append(band(z, low, high, colour, 0.2))
        marks.append(Line(np.column_stack([z, change]), colour, label=f"field of {group}"))
        ends.append([z, low, high])
    z, low, high = np.concatenate(ends, axis=1)
    panel = Panel(
        np.column_stack([spread(z), spread(low, high)]),
        [*marks, horizontal_line(0.0, FAINT, 0.8)],
        "Change of the refraction with its mean error",
        "observed zenith distance, degrees",
        "corrected minus given refraction, arcsec",
        legend="below",
    )
    return Plot(7.5, 4.8, [panel])
