"""Vector plots: residuals of each case in both systems, their averages, corrections of the grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.case import exchanged
from photogram.comparator.pictures.style import ACCENT, MM, arrows, key, magnification, panels, plain
from photogram.show.pictures import new_figure, round_length
from photogram.show.style import FAINT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from photogram.arguments.types import Floats
    from photogram.comparator.calibration import Calibration


def comparator_vectors(calibration: Calibration) -> Figure:
    """Draw the residuals of each case, after all corrections, in the system of the comparator."""
    residuals = [fit.residuals for fit in calibration.last_fits]
    return _by_case(
        calibration,
        [own.xy_um for own in residuals],
        [own.comparator_um for own in residuals],
        ("x, mm", "y, mm"),
        "Residuals in the comparator system (to be added to the measurement)",
    )


def grid_vectors(calibration: Calibration) -> Figure:
    """Draw the residuals of each case, after all corrections, in the system of its plate."""
    hands = [case.placed.orientation.left_handed for case in calibration.cases]
    return _by_case(
        calibration,
        [exchanged(case.placed.grid_um, hand) for case, hand in zip(calibration.cases, hands, strict=True)],
        [
            exchanged(fit.residuals.grid_um, hand)
            for fit, hand in zip(calibration.last_fits, hands, strict=True)
        ],
        ("X of the plate, mm", "Y of the plate, mm"),
        "Residuals in the grid system (to be added to the grid)",
    )


def _by_case(
    calibration: Calibration,
    places: Sequence[Floats],
    vectors: Sequence[Floats],
    labels: tuple[str, str],
    title: str,
) -> Figure:
    figure, axes = panels(len(places))
    scale = magnification(places[0] / MM, np.vstack(vectors))
    # The longest residual of all sets one scale for all panels.
    length = round_length(float(np.hypot(*np.vstack(vectors).T).max()))
    for panel, case, own, vector in zip(axes, calibration.cases, places, vectors, strict=True):
        arrows(panel, own, vector, scale)
        point = case.placed.orientation.nearest_point
        panel.set_title(f"case {case.number}, point {point} nearest zero", fontsize=9, loc="left")
        plain(panel, *labels)
    for panel in axes:
        panel.label_outer()
    key(axes, scale, length)
    figure.suptitle(title, fontsize=11)
    return figure


def average_vectors(calibration: Calibration, plate: int) -> Figure:
    """Draw average residuals by comparator location and by grid point, on one scale."""
    result = calibration.plates[plate]
    averages = result.averages
    grid = calibration.session.grids[plate]
    own = grid.xy_um[grid.rows_of(averages.points)]
    figure, axes = panels(1 + len(averages.by_location), side=4.2, shared=False)
    corrections = averages.corrections_um
    together = np.vstack([corrections, averages.location_um])
    scale = magnification(own / MM, together)
    length = round_length(float(np.hypot(*together.T).max()))
    arrows(axes[-1], own, corrections, scale, ACCENT)
    axes[-1].set_title("by grid point: correction of the grid", fontsize=9, loc="left")
    plain(axes[-1], "X of the plate, mm", "Y of the plate, mm")
    for panel, place in zip(axes, averages.by_location, strict=False):
        arrows(panel, place.xy_um, place.residuals_um, scale)
        panel.set_title(_of_cases("by comparator location", place.cases), fontsize=9, loc="left")
        plain(panel, "x, mm", "y, mm")
    for panel in axes:
        key([panel], scale, length)
    figure.suptitle(f"Average residuals of {len(averages.cases)} cases, plate {plate}", fontsize=11)
    return figure


def _of_cases(what: str, cases: tuple[int, ...]) -> str:
    return f"{what}, cases {', '.join(str(case) for case in cases)}"


def joint_grid(calibration: Calibration, plate: int) -> Figure:
    """Draw the corrections of the grid by the joint adjustment, with their standard ellipses."""
    from matplotlib.collections import EllipseCollection

    from photogram.comparator.pointing import Ellipse

    joint = calibration.joint
    if joint is None:
        raise ValueError("there is no joint adjustment")
    own = joint.plates[plate]
    grid = calibration.session.grids[plate]
    places = grid.xy_um[grid.rows_of(own.points)]
    figure = new_figure(6.2, 5.8)
    axes = figure.subplots()
    ellipses = [Ellipse.of(c[0, 0], c[1, 1], c[0, 1]) for c in own.covariance_um2]
    # Room for an arrow and the ellipse about its end.
    longest = own.corrections_um * (
        1 + max(ellipse.major_um for ellipse in ellipses) / np.abs(own.corrections_um).max()
    )
    scale = magnification(places / MM, longest)
    factor = 2 * scale
    collection = EllipseCollection(
        [factor * ellipse.major_um for ellipse in ellipses],
        [factor * ellipse.minor_um for ellipse in ellipses],
        [np.degrees(ellipse.angle_rad) for ellipse in ellipses],
        units="xy",
        offsets=places / MM + own.corrections_um * scale,
        transOffset=axes.transData,
        facecolor="none",
        edgecolor=FAINT,
        linewidth=0.9,
    )
    axes.add_collection(collection)
    # Collections do not count for the limits.
    reach = scale * np.array([[ellipse.major_um] for ellipse in ellipses])
    ends = places / MM + own.corrections_um * scale
    axes.update_datalim(np.vstack([ends - reach, ends + reach]))
    arrows(axes, places, own.corrections_um, scale, ACCENT)
    for point, (x, y) in zip(own.points.tolist(), (places / MM).tolist(), strict=True):
        axes.annotate(
            str(point),
            (x, y),
            xytext=(-3, -3),
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=7,
            color="#5b6773",
            zorder=3,
        )
    plain(axes, "X of the plate, mm", "Y of the plate, mm")
    key([axes], scale, round_length(float(np.hypot(*own.corrections_um.T).max())))
    axes.set_title(f"Corrections of grid {plate} by the joint adjustment, standard ellipses", fontsize=11)
    return figure
