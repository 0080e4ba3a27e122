"""The numbers of docs/stellar-camera.md: `python docs/regenerate.py stellar-camera.md`."""

from __future__ import annotations

import math
import re
import runpy
from dataclasses import replace
from functools import cache
from importlib.resources import as_file, files
from pathlib import Path

import erfa
import numpy as np

from photogram.show.forms import titled_lines
from photogram.stellar import (
    ARCSEC,
    GRAD,
    LENSES,
    NAMES,
    Air,
    CalibratedNight,
    Result,
    SkyCamera,
    calibrate,
    calibrate_night,
    read_night,
    read_plain,
    refraction,
)
from photogram.stellar.parameters import UNITS


@cache
def plate(as_published: bool = False) -> Result:
    """Calibrate the packaged plate."""
    with as_file(files("photogram") / "examples" / "stellar") as folder:
        problem = read_plain(folder / "plate.toml")
    return calibrate(replace(problem, options=replace(problem.options, as_published=as_published)))


@cache
def night() -> CalibratedNight:
    """Calibrate the packaged night."""
    with as_file(files("photogram") / "examples" / "exposures") as folder:
        return calibrate_night(read_night(folder / "night.toml"))


def section_lines(result: Result | CalibratedNight, *titles: str) -> list[str]:
    """Return sections of a report without their titles."""
    sections = re.split(r"\n\n(?=[^\n]+\n-{4,}\n)", result.report())
    lines = {title: rest for title, _, *rest in map(str.splitlines, sections[1:])}
    return [line for title in titles for line in ("", *lines[title])][1:]


def adjustment_lines() -> list[str]:
    """Show the figures of the packaged plate."""
    # The digits of sums that vanish, and the last ones of parts of a minimum, are noise.
    noisy = ("weighted sum of squares, plate", "weighted sum of squares, stars")
    figures = section_lines(plate(), "Size and fit", "Remarks")
    summary = [line for title, lines in titled_lines(plate().document(), []) for line in (title, *lines, "")]
    return [*summary, *(line for line in figures if not line.startswith(noisy))]


def parameter_lines() -> list[str]:
    """Show the camera and one attitude, strict and as published."""
    strict, published = plate(), plate(as_published=True)
    lines = [f"{'':13}{'unit':6}{'strict':>15}{'mean error':>13}{'as published':>15}{'difference':>12}"]
    for name in NAMES[:3] + NAMES[9:22]:
        unit, shown = (GRAD, "grad") if UNITS[name] == "rad" else (1.0, UNITS[name])
        value, other = strict.parameters[name] / unit, published.parameters[name] / unit
        error = strict.mean_errors[name] / unit
        # To the second digit of the mean error.
        digits = max(0, 1 - math.floor(math.log10(error)))
        lines.append(
            f"{name:13}{shown:6}{value:15.{digits}f}{error:13.2g}{other:15.{digits}f}"
            f"{(other - value) / error:9.2f} me"
        )
    m = 1e6 * strict.mean_error, 1e6 * published.mean_error
    return [*lines, f"{'m':13}{'um':6}{m[0]:15.4f}{'':13}{m[1]:15.4f}"]


def refraction_lines() -> list[str]:
    """Compare refraction with that of ERFA."""
    degrees = np.array([10.0, 30.0, 45.0, 60.0, 70.0, 74.0, 75.0, 80.0])
    z = np.radians(degrees)
    a, b = erfa.refco(1013.25, 0.0, 0.0, 0.574)
    ours = refraction(z, Air(273.15, 760.0), observed=True) / ARCSEC
    theirs = (a * np.tan(z) + b * np.tan(z) ** 3) / ARCSEC
    lines = [f"{'z deg':>6}{'report':>12}{'refco':>12}{'difference':>12}  arcsec"]
    rows = zip(degrees, ours, theirs, strict=True)
    return lines + [f"{d:6.0f}{r:12.3f}{e:12.3f}{r - e:12.3f}" for d, r, e in rows]


def night_lines() -> list[str]:
    """Show the figures and the camera of the packaged night."""
    return section_lines(night(), "Size and fit", "Camera")


def lens_lines() -> list[str]:
    """Show the tests of the packaged night's lens."""
    return section_lines(night(), "Lens")


def odds_lines() -> list[str]:
    """Show the odds and the attitudes of the packaged night."""
    return section_lines(night(), "Exposures", "Attitudes in ICRS")


def choice_lines() -> list[str]:
    """Show which lens the stars choose for an all-sky camera."""
    example = runpy.run_path(str(Path(__file__).parents[1] / "examples" / "all_sky_camera.py"))
    start = SkyCamera.of_field(*example["FRAME"], example["field_of"]("equisolid"), "kannala_brandt")
    made, _ = example["night"]("equisolid", 8, start, lenses=tuple(LENSES), tripod=True)
    return section_lines(calibrate_night(made), "Lens")


BLOCKS = {
    "adjustment": adjustment_lines,
    "parameters": parameter_lines,
    "refraction": refraction_lines,
    "night": night_lines,
    "odds": odds_lines,
    "lens": lens_lines,
    "choice": choice_lines,
}
