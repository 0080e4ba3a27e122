"""Pictures of a calibration (extra `plots`): stars, residuals, histogram, distortion, refraction."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.angles import ARCSEC
from photogram.stellar.curves import distortion_curves, histogram, refraction_curves, residual_classes
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.stellar.result import Result

__all__ = ["figures"]

_COLOURS = ("#0072b2", "#d55e00", "#009e73")


def figures(result: Result) -> dict[str, bytes]:
    """Return all pictures that the options ask for as PNG files by name; stars and residuals always."""
    made = {"stars.png": _stars(result), "residuals.png": _residuals(result)}
    if result.problem.options.histogram:
        made["histogram.png"] = _histogram(result)
    if result.problem.options.curves:
        made["distortion.png"] = _distortion(result)
    if result.problem.options.refraction:
        made["refraction.png"] = _refraction(result)
    return {name: _png(figure) for name, figure in made.items()}


def _figure(**arguments: Any) -> tuple[Figure, Any]:
    from matplotlib.figure import Figure

    figure = Figure(layout="constrained", **arguments)
    return figure, figure.subplots()


def _png(figure: Figure) -> bytes:
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    return buffer.getvalue()


def _plate(result: Result, title: str) -> tuple[Figure, Any]:
    figure, axes = _figure(figsize=(7.0, 6.6))
    axes.set(xlabel="x (mm)", ylabel="y (mm)", title=title, aspect="equal")
    axes.axhline(0, color="0.85", linewidth=0.8, zorder=0)
    axes.axvline(0, color="0.85", linewidth=0.8, zorder=0)
    return figure, axes


def _stars(result: Result) -> Figure:
    """Draw every star at its mean place on the plate."""
    problem = result.problem
    figure, axes = _plate(result, "Stars on the plate")
    count = np.bincount(problem.image_stars, minlength=len(problem.star_ids))
    sums = np.zeros((len(problem.star_ids), 2))
    np.add.at(sums, problem.image_stars, problem.image_xy)
    means = 1e3 * sums / np.maximum(count, 1)[:, None]
    for known, marker, label in ((True, "*", "known"), (False, "o", "unknown")):
        chosen = problem.known == known
        if chosen.any():
            style = {"facecolors": "none", "edgecolors": _COLOURS[1]} if not known else {"color": _COLOURS[0]}
            axes.scatter(
                *means[chosen].T, marker=marker, s=46, label=f"{label} ({int(chosen.sum())})", **style
            )
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _residuals(result: Result) -> Figure:
    problem, residuals = result.problem, 1e6 * result.solved.residuals
    figure, axes = _plate(result, "Residuals (computed minus measured)")
    extent = np.ptp(1e3 * problem.image_xy, axis=0).max()
    size = float(np.sqrt(np.mean(np.sum(residuals**2, axis=1)))) or 1.0
    # A residual of the mean size is a twentieth of the plate long.
    scale = size / (0.05 * extent)
    for group, colour in enumerate(_COLOURS):
        chosen = problem.image_groups == group
        if chosen.any():
            place = 1e3 * problem.image_xy[chosen].T
            axes.quiver(
                *place,
                *residuals[chosen].T,
                angles="xy",
                scale_units="xy",
                scale=scale,
                color=colour,
                width=0.0022,
                label=GROUPS[group],
            )
    key = float(f"{size:.0e}")
    x0, x1 = axes.get_xlim()
    y0, y1 = axes.get_ylim()
    axes.set(xlim=(x0 - 0.05 * extent, x1 + 0.05 * extent), ylim=(y0 - 0.05 * extent, y1 + 0.05 * extent))
    figure.legend(loc="outside lower center", ncols=3, title=f"mean size {size:.3g} um; bar: {key:g} um")
    axes.plot([x0, x0 + key / scale], [y0 - 0.02 * extent] * 2, color="black", linewidth=2.5)
    return figure


def _histogram(result: Result) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 3.8), layout="constrained")
    for axes, (name, values) in zip(figure.subplots(1, 3), residual_classes(result).items(), strict=True):
        found = histogram(1e6 * values)
        middle = 0.5 * (found.edges[1:] + found.edges[:-1])
        width = np.diff(found.edges)
        axes.bar(middle, found.counts, width=width, color="#9ecae1", edgecolor="white")
        curve = np.linspace(found.edges[0], found.edges[-1], 200)
        density = np.exp(-0.5 * ((curve - found.mean) / found.sd) ** 2) / (found.sd * np.sqrt(2 * np.pi))
        axes.plot(curve, len(values) * width[0] * density, color=_COLOURS[1])
        axes.set(title=f"residuals in {name}: sd {found.sd:.3g} um", xlabel="um", ylabel="number")
    return figure


def _band(axes: Any, x: Any, y: Any, error: Any, colour: str, label: str) -> None:
    axes.plot(x, y, color=colour, label=label)
    axes.fill_between(x, y - error, y + error, color=colour, alpha=0.2, linewidth=0)


def _distortion(result: Result) -> Figure:
    curves = distortion_curves(result)
    figure, axes = _figure(figsize=(7.5, 4.8))
    d = 1e3 * curves.distance
    _band(axes, d, 1e6 * curves.radial, 1e6 * curves.radial_error, _COLOURS[0], "radial")
    _band(
        axes, d, 1e6 * curves.transformed, 1e6 * curves.transformed_error, _COLOURS[1], "radial, transformed"
    )
    _band(axes, d, 1e6 * curves.decentering, 1e6 * curves.decentering_error, _COLOURS[2], "decentering")
    axes.axhline(0, color="0.7", linewidth=0.8)
    axes.set(
        xlabel="distance from the centre of distortion (mm)",
        ylabel="distortion (um), with its mean error",
        title=f"Distortion; calibrated principal distance {1e3 * curves.calibrated:.4f} mm",
    )
    axes.legend()
    return figure


def _refraction(result: Result) -> Figure:
    figure, axes = _figure(figsize=(7.5, 4.8))
    for group in range(3):
        if result.solved.free[3 * group]:
            curves = refraction_curves(result, group)
            z = np.degrees(curves.zenith_distance)
            change, error = (curves.corrected - curves.given) / ARCSEC, curves.error / ARCSEC
            _band(axes, z, change, error, _COLOURS[group], GROUPS[group])
    axes.axhline(0, color="0.7", linewidth=0.8)
    axes.set(
        xlabel="observed zenith distance (degrees)",
        ylabel="corrected minus given refraction (arcsec)",
        title="Refraction, with its mean error",
    )
    axes.legend()
    return figure
