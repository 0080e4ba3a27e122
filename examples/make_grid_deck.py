"""Build the packaged example `perspective_center/grid.deck`: a simulated grid, projected at two heights.

    python examples/make_grid_deck.py

A projector with known position, attitude and radial distortion projects a grid of 25 points; each point is
read two or three times, on a coordinatograph with errors of scale and perpendicularity that the deck's
factors correct. Always the same numbers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.network import rotation_matrix

DECK = Path(__file__).resolve().parents[1] / "python/photogram/examples/perspective_center/grid.deck"

POSITION = np.array([251.3, 248.6, 305.4])  # mm in the model
ATTITUDE_MINUTES = np.array([12.0, -8.0, 15.0])
PRINCIPAL_DISTANCE = 150.0
HEIGHTS = (0.0, 60.0)
READING_SD = 0.006  # mm in the model
FACTORS = (1.00012, 0.99991, 0.00008)  # X scale, Y scale, non-perpendicularity
DISTORTION = 2.4e-4  # of dr = DISTORTION r (1 - (r / 90)^2): +8 um at 52 mm, -16 um in the corners
SPACING, ACROSS = 40.0, 5


def plate() -> tuple[list[int], np.ndarray]:
    """Return numbers and coordinates of the grid, row by row."""
    axis = SPACING * (np.arange(ACROSS) - ACROSS // 2)
    xy = np.array([(x, y) for y in axis for x in axis])
    return [101 + index for index in range(len(xy))], xy


def projected(xy: np.ndarray, height: float) -> np.ndarray:
    """Return the model coordinates of the distorted plate points at a height."""
    radius = np.hypot(*xy.T)
    distorted = xy * (1 + DISTORTION * (1 - (radius / 90.0) ** 2))[:, np.newaxis]
    to_photo = rotation_matrix(np.radians(ATTITUDE_MINUTES / 60.0)[np.newaxis])[0]
    direction = np.column_stack([distorted, np.full(len(xy), -PRINCIPAL_DISTANCE)]) @ to_photo
    reach = (height - POSITION[2]) / direction[:, 2]
    return np.asarray(POSITION[:2] + reach[:, np.newaxis] * direction[:, :2])


def misread(xy: np.ndarray) -> np.ndarray:
    """Return what a coordinatograph shows that the factors of the deck correct."""
    x_scale, y_scale, sine = FACTORS
    anchor = np.abs(xy).min(axis=0)
    x, y = (xy - anchor).T
    raw_y = y / y_scale
    return np.column_stack([x / x_scale - raw_y * sine, raw_y]) + anchor


def cards() -> list[str]:
    """Return the deck, card by card."""
    random = np.random.default_rng(1969)
    numbers, xy = plate()
    lines = ["SIMULATED PROJECTOR - 25 GRID POINTS AT TWO HEIGHTS", "(I5,2F10.3)", "(I5,3F10.3)"]
    lines.append(f"{len(numbers):5d}{len(HEIGHTS):5d}{1:5d}{PRINCIPAL_DISTANCE:10.3f}{0.001:10.4f}")
    lines.append("".join(f"{factor:20.8E}".replace("E", "D") for factor in FACTORS))
    lines += [f"{number:5d}{x:10.3f}{y:10.3f}" for number, (x, y) in zip(numbers, xy, strict=True)]
    for height in HEIGHTS:
        lines.append("".join(f"{value:10.3f}" for value in (0.0, 0.0, 0.0, 250.0, 250.0, 300.0)))
        for number, place in zip(numbers, misread(projected(xy, height)), strict=True):
            for x, y in place + random.normal(0.0, READING_SD, (int(random.integers(2, 4)), 2)):
                lines.append(f"{number:5d}{x:10.3f}{y:10.3f}{height:10.3f}")
        lines.append("    0")
    return lines


def main() -> None:
    """Write the deck."""
    DECK.parent.mkdir(parents=True, exist_ok=True)
    DECK.write_text("".join(f"{line}\n" for line in cards()))


if __name__ == "__main__":
    main()
