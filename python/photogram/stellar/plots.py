"""Pictures of a calibration (extra `plots`): stars, residuals, histogram, distortion, refraction."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.show.angles import ARCSEC
from photogram.show.style import COLOURS, FAINT, in_style
from photogram.stellar.curves import distortion_curves, refraction_curves, residual_classes
from photogram.stellar.drawing import band, bell, panels, vectors
from photogram.stellar.parameters import GROUPS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.stellar.result import Result


@in_style
def figures(result: Result) -> dict[str, Figure]:
    """Return all pictures that the options ask for by name; stars and residuals always."""
    made = {"stars": _stars(result), "residuals": _residuals(result)}
    if result.problem.options.histogram:
        made["histogram"] = _histogram(result)
    if result.problem.options.curves:
        made["distortion"] = _distortion(result)
    if result.problem.options.refraction:
        made["refraction"] = _refraction(result)
    return made


def _plate(title: str) -> tuple[Figure, Any]:
    figure, axes = panels(7.0, 6.6)
    axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
    axes.set_title(title)
    axes.axhline(0, color=FAINT, linewidth=0.5, alpha=0.5, zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.5, alpha=0.5, zorder=0)
    return figure, axes


def _stars(result: Result) -> Figure:
    """Draw every star at its mean place on the plate."""
    problem = result.problem
    figure, axes = _plate("Stars on the plate")
    count = np.bincount(problem.image_stars, minlength=len(problem.star_ids))
    sums = np.zeros((len(problem.star_ids), 2))
    np.add.at(sums, problem.image_stars, problem.image_xy)
    means = 1e3 * sums / np.maximum(count, 1)[:, None]
    for known, marker, label in ((True, "*", "known"), (False, "o", "unknown")):
        chosen = problem.known == known
        if chosen.any():
            style = {"color": COLOURS[0]} if known else {"facecolors": "none", "edgecolors": COLOURS[1]}
            text = f"{label} ({int(chosen.sum())})"
            axes.scatter(*means[chosen].T, marker=marker, s=46, label=text, **style)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _residuals(result: Result) -> Figure:
    problem = result.problem
    figure, axes = _plate("Residuals (computed minus measured)")
    groups = [(name, problem.image_groups == group) for group, name in enumerate(GROUPS)]
    shown = [(name, chosen) for name, chosen in groups if chosen.any()]
    vectors(figure, axes, 1e3 * problem.image_xy, 1e6 * result.solved.residuals, shown, "µm")
    return figure


def _histogram(result: Result) -> Figure:
    figure, every = panels(11.0, 3.8, 3)
    for axes, (name, values) in zip(every, residual_classes(result).items(), strict=True):
        bell(axes, 1e6 * values, f"residuals in {name}", "µm")
    return figure


def _distortion(result: Result) -> Figure:
    # Finer than the table, so that the curves are smooth.
    problem = result.problem
    fine = replace(problem.options, interval=(problem.options.extent or 0.1) / 200)
    curves = distortion_curves(replace(result, problem=replace(problem, options=fine)))
    figure, axes = panels(7.5, 4.8)
    d = 1e3 * curves.distance
    band(axes, d, 1e6 * curves.radial, 1e6 * curves.radial_error, COLOURS[0], "radial")
    band(axes, d, 1e6 * curves.transformed, 1e6 * curves.transformed_error, COLOURS[1], "radial, transformed")
    band(axes, d, 1e6 * curves.decentering, 1e6 * curves.decentering_error, COLOURS[2], "decentering")
    axes.axhline(0, color=FAINT, linewidth=0.8)
    axes.set(
        xlabel="distance from the centre of distortion, mm",
        ylabel="distortion with its mean error, µm",
        title=f"Distortion; calibrated principal distance {1e3 * curves.calibrated:.4f} mm",
    )
    axes.legend()
    return figure


def _refraction(result: Result) -> Figure:
    """Draw one curve, for all attitudes look through the same air, and where each of them looks."""
    figure, axes = panels(7.5, 4.8)
    groups = [group for group in range(3) if result.solved.free[3 * group]]
    every = {group: refraction_curves(result, group) for group in groups}
    z = np.concatenate([curves.zenith_distance for curves in every.values()])
    change = np.concatenate([curves.corrected - curves.given for curves in every.values()]) / ARCSEC
    error = np.concatenate([curves.error for curves in every.values()]) / ARCSEC
    order = np.argsort(z)
    band(axes, np.degrees(z[order]), change[order], error[order], COLOURS[3], "change and its mean error")
    low, high = axes.get_ylim()
    for k, (group, curves) in enumerate(every.items()):
        ends = np.degrees(curves.zenith_distance[[0, -1]])
        level = low - 0.06 * (k + 1) * (high - low)
        axes.plot(ends, [level, level], color=COLOURS[group], linewidth=5, label=f"field of {GROUPS[group]}")
    axes.axhline(0, color=FAINT, linewidth=0.8)
    axes.set(
        xlabel="observed zenith distance, degrees",
        ylabel="corrected minus given refraction, arcsec",
        title="Refraction",
    )
    axes.legend(loc="upper left")
    return figure
