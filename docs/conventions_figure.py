"""Draw what the numbers of an attitude are: docs/conventions.svg.

    python docs/conventions_figure.py

Everything that is drawn comes from the class that computes with it: axes are columns of its matrices.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from views import BLUE, GREEN, GREY, LIGHT, RED, Floats, View, circle, svg

from photogram import Attitudes
from photogram.network.attitudes import Representation

FIGURE = Path(__file__).with_name("conventions.svg")

EAST, NORTH, UP = np.eye(3)
ORIGIN = np.zeros(3)
ANGLES = np.radians([32.0, 28.0, 40.0])
"""Of the sequential rotations."""
VIEW = (-1.35, 1.45, -1.0, 1.35)


def axes(representation: Representation, numbers: Floats) -> Floats:
    """Return the photo's axes x, y, z in object space, one row each."""
    return Attitudes.of(representation, numbers[None]).values("matrix_to_photo")[0]


def ground(view: View) -> None:
    """Draw the axes of the object space."""
    view.line(circle(EAST, NORTH), color=LIGHT)
    for axis, label in ((EAST, "X east"), (NORTH, "Y north"), (UP, "Z up")):
        view.arrow(ORIGIN, axis, label, BLUE)


def photo(view: View, centre: Floats, turned: Floats, size: float) -> None:
    """Draw the picture of a camera with its axes, and where it looks."""
    x, y, z = turned
    corners = [centre + size * (a * x + b * y) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    view.axes.fill(*(view.rows @ np.array(corners).T), color=GREEN, alpha=0.12, linewidth=0)
    view.line(np.array(corners), color=GREEN)
    view.arrow(centre, centre + 1.7 * size * x, "x", GREEN, 1.2)
    view.arrow(centre, centre + 1.7 * size * y, "y", GREEN, 1.2)
    view.line(np.array([centre, centre - 1.6 * size * z]), color=GREY, linestyle=":")
    view.text(centre - 1.9 * size * z, "looks", GREY)


def sequence(view: View, representation: Representation, labels: str, moved: tuple[int, int, int]) -> None:
    """Draw three turns about axes that turn along, each by the arc of one axis that it moves."""
    ground(view)
    steps = [axes(representation, ANGLES * (np.arange(3) < done)) for done in range(4)]
    for label, axis, before, after in zip(labels, moved, steps[:-1], steps[1:], strict=True):
        view.arc(before[axis], after[axis], label, RED, 0.8, 1.2)
        view.line(np.array([ORIGIN, 0.9 * after[axis]]), color=GREY, linestyle=":")
    for axis, label in zip(steps[3], "xyz", strict=True):
        view.arrow(ORIGIN, axis, label, GREEN, 1.14)


def draw_axes(view: View) -> None:
    """Draw photo axes and vision axes of one camera."""
    turned = axes("azimuth_tilt_swing", np.radians([25.0, 85.0, 180.0]))
    x, y, z = turned
    photo(view, ORIGIN, turned, 0.42)
    view.arrow(ORIGIN, 0.75 * z, "z", GREEN, 1.15)
    vision = Attitudes(turned.T[None]).values("matrix_to_vision")[0]
    start = -0.9 * x - 0.6 * y
    for axis, label in zip(vision, "xyz", strict=True):
        view.arrow(start, start + 0.45 * axis, label, RED, 1.2)
    view.axes.set_title(
        "Photo axes (green): x right, y up, z back;\nvision axes (red): x right, y down, z on"
    )


def draw_azimuth(view: View) -> None:
    """Draw azimuth, tilt and swing."""
    turned = axes("azimuth_tilt_swing", np.radians([110.0, 55.0, 215.0]))
    ground(view)
    look = -turned[2]
    foot = look - (look @ UP) * UP
    foot /= np.linalg.norm(foot)
    view.line(np.array([foot, ORIGIN, -0.95 * UP]), color=GREY, linestyle=":")
    view.arc(NORTH, foot, "azimuth", RED, 0.7, 1.2)
    view.arc(-UP, look, "tilt", RED, 0.4, 1.35)
    centre, size = 1.15 * look, 0.33
    view.line(np.array([ORIGIN, centre]), color=GREY)
    photo(view, centre, turned, size)
    to_nadir = -UP + (UP @ turned[2]) * turned[2]
    to_nadir /= np.linalg.norm(to_nadir)
    view.line(np.array([centre, centre + 1.3 * size * to_nadir]), color=GREY, linestyle=":")
    view.text(centre + 1.75 * size * to_nadir, "to nadir", GREY)
    t = np.linspace(0.0, np.radians(215.0), 60)[:, None]
    # Clockwise from +y as the picture is seen.
    view.line(centre + 0.7 * size * (np.cos(t) * turned[1] + np.sin(t) * turned[0]), color=RED, linewidth=1.3)
    view.text(centre + 1.15 * size * (turned[0] - turned[1]) / np.sqrt(2.0), "swing", RED)
    view.axes.set_title("azimuth from north, tilt from the nadir,\nswing from +y to the nadir point")


def draw_aircraft(view: View) -> None:
    """Draw yaw, pitch and roll with the axes of the aircraft."""
    yaw, pitch, roll = np.radians([60.0, 25.0, 30.0])
    level, nose, body = (
        Attitudes.of("yaw_pitch_roll", np.array([numbers]), mounting=np.eye(3)).matrices[0].T
        for numbers in ([yaw, 0.0, 0.0], [yaw, pitch, 0.0], [yaw, pitch, roll])
    )
    ground(view)
    view.arc(NORTH, level[0], "yaw", RED, 0.6, 1.3)
    view.arc(level[0], nose[0], "pitch", RED, 0.85, 1.2)
    view.arc(nose[1], body[1], "roll", RED, 0.8, 1.2)
    view.line(np.array([level[0], ORIGIN, 0.95 * nose[1]]), color=GREY, linestyle=":")
    for axis, label in zip(body, ("forward", "right wing", "down"), strict=True):
        view.arrow(ORIGIN, axis, label, GREEN, 1.15)
    view.axes.set_title("yaw clockwise from north,\npitch nose up, roll right wing down")


def draw_vector(view: View) -> None:
    """Draw the one axis of a rotation vector or quaternion."""
    axis = np.array([-0.4, 0.4, 0.82])
    axis /= np.linalg.norm(axis)
    angle = np.radians(60.0)
    turned = axes("rotation_vector", angle * axis)
    ground(view)
    view.line(np.array([-0.5 * axis, 1.25 * axis]), color=RED, linestyle="--")
    view.text(1.4 * axis, "axis e", RED)
    for before, after, label in zip(np.eye(3), turned, "xyz", strict=True):
        view.arrow(ORIGIN, after, label, GREEN, 1.12)
        t = np.linspace(0.0, angle, 40)
        steps = Attitudes.of("rotation_vector", t[:, None] * axis).matrices
        view.line(0.8 * steps @ before, color=RED, linewidth=1.0)
    view.axes.set_title("rotation vector θ e,\nquaternion cos θ/2, sin θ/2 e")


def drawn() -> Figure:
    """Draw all conventions, one panel each."""
    made = Figure(figsize=(11.0, 7.6), layout="constrained")
    panels = made.subplots(2, 3).flat
    draw_axes(View(next(panels), 25.0, 25.0, VIEW))
    first = View(next(panels), 125.0, 24.0, VIEW)
    sequence(first, "omega_phi_kappa", "ωφκ", (1, 0, 0))
    first.axes.set_title("omega about X, phi about the turned y,\nkappa about the turned z")
    second = View(next(panels), 125.0, 24.0, VIEW)
    sequence(second, "phi_omega_kappa", "φωκ", (0, 1, 1))
    second.axes.set_title("phi about Y, omega about the turned x,\nkappa about the turned z")
    draw_azimuth(View(next(panels), 28.0, 24.0, (-1.35, 1.45, -1.45, 1.2)))
    draw_aircraft(View(next(panels), -25.0, 25.0, VIEW))
    draw_vector(View(next(panels), 125.0, 24.0, VIEW))
    for axes_ in made.axes:
        axes_.title.set_fontsize(9)
    return made


def figure() -> str:
    """Return the figure as an SVG document."""
    return svg(drawn)


if __name__ == "__main__":
    FIGURE.write_text(figure(), encoding="utf-8")
