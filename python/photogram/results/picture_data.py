"""The plot data of an adjusted block, and plots of its cameras."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.arrays import standard_deviations
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.network import geometry
from photogram.network.motion import scanners
from photogram.network.rays import LocalAxes, local_axes
from photogram.plots import picture_data as plots
from photogram.plots.distortion import side_by_side
from photogram.results.distortion import DistortionCurve, distortion_curve, lens_field
from photogram.results.film_report import film_patterns, mean_mark_residuals
from photogram.results.footprints import footprints, metric_covariances
from photogram.results.network import AdjustedNetwork
from photogram.results.parts import AdjustedCamera
from photogram.results.tables import Tests
from photogram.show.page import about
from photogram.show.sketch.marks import Arrows, Ellipses, Panel, around, ellipse_axes
from photogram.show.sketch.plot import Plot
from photogram.show.style import BLUE, INK, round_length
from photogram.statistics.findings import Tested
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result


class PicturedNetwork(ABC):
    """The plot data of all adjusted networks; each part is computed on demand.

    Subclasses also have the `title`, `correlations` and `distortion` of cameras, and `footprints`: (P, v, 3)
    closed outlines of photos on level ground, in the axes of the plan. NaN for photos without ground; (0, v,
    3) if no axis of the plan is vertical.
    """

    def __init__(self, result: AdjustedNetwork) -> None:
        self.result = result

    @property
    @abstractmethod
    def plan(self) -> plots.Plan: ...

    @property
    @abstractmethod
    def cameras(self) -> tuple[Indices, Sequence[str], bool]:
        """(P,) cameras of photos, their names, and whether y is downwards."""

    @property
    def films(self) -> Sequence[plots.VectorField]:
        """Mean residuals of the marks of cameras, and patterns of films."""
        return ()

    @abstractmethod
    def covariances(self, points: Indices) -> Floats:
        """Return (k, 3, 3) covariances of points along the axes of the plan; NaN if missing."""

    @cached_property
    def images(self) -> plots.Images:
        result, given, used = self.result, self.result.given, self.result.used_images
        cameras, names, down = self.cameras
        return plots.Images(
            unit=given.image_unit,
            photos=given.image_photos[used],
            points=given.image_points[used],
            xy=given.image_xy[used],
            residuals=result.residuals[used],
            redundancy=result.redundancy[used],
            cameras=cameras[given.image_photos[used]],
            names=names,
            down=down,
            scanned=self.scanned[given.image_photos[used]],
        )

    @cached_property
    def scanned(self) -> Bools:
        """(P,) photos that are scanner strips: image coordinates are samples and lines."""
        return np.zeros(len(self.result.given.photo_ids), dtype=bool)

    @property
    def poses(self) -> Floats:
        """(P, 6, 6) cofactors of positions and rotations of photos."""
        return self.result.photo_cofactors[:, :6, :6]

    @cached_property
    def _tests(self) -> Tests:
        return Tests(self.result)

    @property
    def tested(self) -> Sequence[Tested]:
        """All observations with their standardized residuals."""
        return self._tests.normal

    @property
    def outlying(self) -> list[Bools]:
        """Components that are outliers of the verdict."""
        return self._tests.outliers

    def moved(self, error: int | None) -> plots.Moved | None:
        summary, plan = self.result.reliability_summary, self.plan
        found = None if summary is None else summary.hypotheses
        row = error if error is not None or found is None else found.worst
        if found is None or row is None or row not in found.effects:
            return None
        points, group = found.drawn, int(found.group[row])
        changes = found.admitted(row) * found.effects[row].changes * self.lengths(points)
        sd = standard_deviations(self.covariances(points)) / self.unit_weight
        ratios = np.divide(np.abs(changes), sd, out=np.zeros_like(sd), where=sd > 0)
        own, photos = found.suspects.touched(group) if group >= 0 else ([], [])
        suspects = np.concatenate([plan.points[own], plan.photos[photos]])
        sentence = str(found.sentence(row))
        return plots.Moved(sentence, points, changes, ratios.max(axis=1), found.limit, suspects, found.points)

    def lengths(self, points: Indices) -> Floats:
        """Return (k, 3) lengths of the units of coordinates of points."""
        return np.ones((len(points), 3))

    @property
    def unit_weight(self) -> float:
        return float(np.sqrt(self.result.covariance_scale))


class PicturedBlock(PicturedNetwork):
    """The data of an adjusted block; local axes for geographic space."""

    result: Result

    @cached_property
    def title(self) -> str:
        return self.result.block.title

    @cached_property
    def plan(self) -> plots.Plan:
        result, block = self.result, self.result.block
        return plots.Plan(
            axes=("E", "N", "h") if block.geographic else ("X", "Y", "Z"),
            unit=block.linear_unit,
            photo_ids=block.photo_ids,
            photos=self._metric(result.photo_positions),
            point_ids=block.point_ids,
            points=np.where(result.used_points[:, np.newaxis], self._metric(result.point_positions), np.nan),
            rays=result.point_rays,
            kinds=result.point_kinds,
            # Differences of angles are too small to be computed from positions.
            differences=result.point_differences * self.lengths(np.arange(len(block.point_ids))),
        )

    def lengths(self, points: Indices) -> Floats:
        return geometry.lengths_of_units(self.result.point_positions[points], self.result.block.spheroid)

    def _metric(self, positions: Floats) -> Floats:
        return self._axes.positions(positions) if self.result.block.geographic else positions

    @cached_property
    def _axes(self) -> LocalAxes:
        return local_axes(self.result.block)

    def covariances(self, points: Indices) -> Floats:
        return np.asarray(metric_covariances(self.result)[points])

    @cached_property
    def footprints(self) -> Floats:
        found = footprints(self.result).positions()
        return self._metric(found.reshape(-1, 3)).reshape(found.shape)

    @cached_property
    def cameras(self) -> tuple[Indices, Sequence[str], bool]:
        block = self.result.block
        _, cameras = block.core_cameras()
        names = block.camera_names
        if not names:
            distances = dict.fromkeys(block.known_distances("pictures").tolist())
            names = [about("camera.distance", c=distance, unit=block.image_unit) for distance in distances]
        down = bool(block.cameras) and block.cameras[0].image_y == "down"
        if not self.scanned.any():
            return cameras, names, down
        # Samples and lines are not frame coordinates: they have a separate plot.
        cameras = np.where(self.scanned, cameras + len(names), cameras)
        return cameras, [*names, *(about("camera.scanned", name=name) for name in names)], down

    @cached_property
    def scanned(self) -> Bools:
        return scanners(self.result.block)

    @cached_property
    def correlations(self) -> list[plots.Correlated]:
        found = []
        for each in self.result.cameras:
            rows = each.estimated
            table = each.correlations[np.ix_(rows, rows)]
            if len(rows) > 1 and np.isfinite(table).all():
                found.append(plots.Correlated(each.name, [each.names[k] for k in rows], table))
        return found

    @cached_property
    def distortion(self) -> list[plots.Curves]:
        curves = [(each, distortion_curve(self.result, each)) for each in self.result.cameras]
        return [curves_of(each, curve) for each, curve in curves if curve is not None]

    @cached_property
    def films(self) -> Sequence[plots.VectorField]:
        if not self.result.films:
            return []
        return [*mean_mark_residuals(self.result), *film_patterns(self.result)]


def _bands(**sds: Floats) -> dict[str, Floats]:
    """Return existing standard deviations by name; fixed cameras have none."""
    return {
        name.replace("_", " "): sd for name, sd in sds.items() if np.isfinite(sd).all() and np.any(sd != 0)
    }


def curves_of(camera: AdjustedCamera, curve: DistortionCurve) -> plots.Curves:
    unit = str(camera.camera.unit)
    balanced = about("curve.balanced", at=curve.balanced_at, c=curve.balanced_distance, unit=unit)
    return plots.Curves(
        camera=about("curve.camera", name=camera.name, model=camera.camera.model, direction=curve.direction),
        unit=unit,
        radii=curve.radii,
        observed=curve.observed,
        curves=[
            plots.Curve("", curve.values, _bands(mapping=curve.sd_mapping, curve=curve.sd)),
            plots.Curve(balanced, curve.balanced, _bands(balanced_curve=curve.sd_balanced)),
        ],
    )


def plot_distortion(result: Result, camera: AdjustedCamera) -> Plot:
    """Plot the distortion of a camera: curve, balanced form, standard deviations.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.

    Raises
    ------
    InputError
        If the camera is without radial terms or images.
    """
    curve = distortion_curve(result, camera)
    if curve is None:
        raise InputError(phrase("plot.distortion"))
    return Plot(6.4, 7.5, side_by_side([curves_of(camera, curve)]), shared=True)


def plot_lens_field(result: Result, camera: AdjustedCamera) -> Plot:
    """Plot displacements by all but radial lens terms, with standard ellipses.

    Parameters
    ----------
    result, camera
        An adjusted block, and one of its cameras.

    Raises
    ------
    InputError
        If the camera is without such terms or images.
    """
    field = lens_field(result, camera)
    if field is None:
        raise InputError(phrase("plot.lens-field", camera=camera.name))
    unit = str(camera.camera.unit)
    factor, written = plots.display_unit(unit)
    longest = float(np.hypot(*field.vectors.T).max())
    spacing = float(np.ptp(field.positions[:, 0])) / 8
    scale = round_length(longest) / spacing if longest > 0 else 1.0
    ends = field.positions + field.vectors / scale
    semi_axes, angles = ellipse_axes(field.covariances / scale**2)
    marks = [
        Ellipses(ends, semi_axes, angles, BLUE, 0.0, 0.4, layer=1.0),
        Arrows(field.positions, field.vectors / scale, INK, 0.003),
    ]
    reach = float(semi_axes.max(initial=0.0))
    limits = around(np.vstack([field.positions, ends - reach, ends + reach]), 0.05)
    size = {"size": factor * scale * spacing, "unit": written}
    title = about("field.title", names=list(field.names), camera=camera.name, **size)
    return Plot(7.0, 6.0, [Panel(limits, marks, title, f"x, {unit}", f"y, {unit}", equal=True)])
