"""Draw the frames of the stellar camera: docs/stellar-frames.svg.

    python docs/stellar_figure.py

Everything that is drawn comes from the functions that compute with it: the axes of the camera from its
matrix, the local frame on the globe from the terrestrial one.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from views import BLUE, GREEN, GREY, LIGHT, RED, Floats, View, circle, svg

from photogram import _photocore
from photogram.stellar import GRAD, Site
from photogram.stellar.places import terrestrial

FIGURE = Path(__file__).with_name("stellar-frames.svg")

# The report's triads are left-handed; the space of a picture is not: east, north, zenith, and X, 90 E, Z.
TO_SPACE = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TO_GLOBE = np.diag([1.0, -1.0, 1.0])
ATTITUDE = np.array([64.0, 24.0, -86.0]) * GRAD
SITE = Site(np.radians(42.0), np.radians(84.0))


def local_axes() -> tuple[Floats, Floats, Floats]:
    """Return north, east, zenith in the space of the picture."""
    north, east, zenith = TO_SPACE.T
    return north, east, zenith


def camera_axes() -> tuple[Floats, Floats, Floats]:
    """Return x, y and the axis of the camera in the space of the picture."""
    x, y, axis = _photocore.pointing_matrix(ATTITUDE) @ TO_SPACE.T
    return x, y, axis


def globe_axes() -> tuple[Floats, Floats, Floats]:
    """Return the station's north, east, zenith on the globe of the picture."""
    north, east, zenith = (TO_GLOBE @ terrestrial(SITE)).T
    return north, east, zenith


def draw_local(view: View) -> None:
    """Draw north, east, zenith; azimuth and zenith distance of a star; the pole."""
    north, east, zenith = local_axes()
    azimuth, distance = np.radians([62.0, 48.0])
    star = np.sin(distance) * (-np.cos(azimuth) * north - np.sin(azimuth) * east) + np.cos(distance) * zenith
    foot = star - (star @ zenith) * zenith
    view.line(circle(north, east), color=LIGHT)
    view.line(np.array([-north, 0 * north]), color=LIGHT, linestyle="--")
    view.line(np.array([-east, 0 * east]), color=LIGHT, linestyle="--")
    view.text(-1.12 * north, "S")
    view.text(-1.12 * east, "W")
    for axis, label, colour in ((north, "ξ north", BLUE), (east, "η east", BLUE), (zenith, "zenith", BLUE)):
        view.arrow(0 * north, axis, label, colour)
    view.line(np.array([foot / np.linalg.norm(foot), 0 * star]), color=RED, linestyle=":")
    view.arrow(0 * star, star, "star", RED, 1.08)
    view.arc(-north, foot, "A", RED, 0.5, 1.35)
    view.arc(zenith, star, "ζ", RED, 0.45, 1.3)
    pole = np.cos(SITE.latitude) * north + np.sin(SITE.latitude) * zenith
    view.arrow(0 * pole, pole, "pole", GREY)
    view.arc(north, pole, "φ", GREY, 0.5, 1.28)
    view.axes.set_title("Station: left-handed;\nazimuth A from south, positive west", fontsize=9)


def draw_globe(view: View) -> None:
    """Draw the terrestrial frame, and a station with its west longitude."""
    x, ninety_west, pole = TO_GLOBE.T
    north, east, zenith = globe_axes()
    view.line(circle(x, ninety_west), color=LIGHT)
    view.line(circle(x, pole), color=LIGHT)
    outline = view.rows / np.linalg.norm(view.rows, axis=1)[:, None]
    view.line(circle(outline[0], outline[1]), color=LIGHT)
    for axis, label in ((x, "X  0°"), (ninety_west, "Y  90° W"), (pole, "Z pole")):
        view.arrow(0 * x, 1.25 * axis, label, BLUE, 1.14)
    meridian = zenith - (zenith @ pole) * pole
    view.line(np.array([meridian / np.linalg.norm(meridian), 0 * x, zenith]), color=RED, linestyle=":")
    view.arc(x, meridian, "λ west", RED, 0.55, 1.5)
    view.arc(meridian, zenith, "φ", RED, 0.6, 1.18)
    for axis, label in ((north, "ξ"), (east, "η"), (zenith, "zenith")):
        view.arrow(zenith, zenith + 0.42 * axis, label, GREEN, 1.3)
    view.axes.set_title("Earth: left-handed;\nlongitude λ positive west", fontsize=9)


def draw_camera(view: View) -> None:
    """Draw alpha and omega, and the plate between the centre of projection and the sky."""
    north, east, zenith = local_axes()
    x, y, axis = camera_axes()
    view.line(circle(north, east)[:181], color=LIGHT)
    for direction, label in ((north, "ξ north"), (east, "η east"), (zenith, "zenith")):
        view.arrow(0 * north, direction, label, BLUE)
    turned = axis - (axis @ east) * east
    view.line(np.array([0 * axis, 0.8 * turned / np.linalg.norm(turned)]), color=GREY, linestyle=":")
    view.arc(zenith, turned, "α", RED, 0.45, 1.3)
    view.arc(turned, axis, "ω", RED, 0.6, 1.2)
    centre, size = 1.05 * axis, 0.3
    corners = [centre + size * (a * x + b * y) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    view.axes.fill(*(view.rows @ np.array(corners).T), color=GREEN, alpha=0.12, linewidth=0)
    view.line(np.array(corners), color=GREEN)
    view.arrow(0 * axis, 1.55 * axis, "axis, to the sky", GREEN, 1.08)
    view.arrow(centre, centre + 1.5 * size * x, "x", GREEN, 1.2)
    view.arrow(centre, centre + 1.5 * size * y, "y", GREEN, 1.2)
    view.text(np.array([0.0, 0.0, -0.1]), "O")
    view.axes.set_title(
        "Camera: α from zenith to north, ω to east,\nκ about the axis; x, y, axis right-handed", fontsize=9
    )


def drawn() -> Figure:
    """Draw the three frames side by side."""
    made = Figure(figsize=(11.0, 4.2), layout="constrained")
    left, middle, right = made.subplots(1, 3)
    draw_local(View(left, 32.0, 24.0, (-1.4, 1.4, -0.7, 1.3)))
    draw_globe(View(middle, 40.0, 22.0, (-1.4, 1.4, -1.1, 1.5)))
    draw_camera(View(right, 18.0, 16.0, (-1.25, 1.75, -0.5, 1.45)))
    return made


def figure() -> str:
    """Return the figure as an SVG document."""
    return svg(drawn)


if __name__ == "__main__":
    FIGURE.write_text(figure(), encoding="utf-8")
