"""What the page of a block says of films, their marks, and scanners."""

from __future__ import annotations

from photogram.results.film_report import film_table, form_table, mark_table, scanner_table
from photogram.results.result import Result
from photogram.show.cells import page_table
from photogram.show.page import Drawing, Part, Section

__all__ = ["films_section"]


def films_section(result: Result, drawing: Drawing) -> Section:
    """Return the section of films, with the picture of marks and patterns; empty without films."""
    if not result.films:
        return Section("films", "Film and fiducials", [])
    intro = (
        "Where films lay and how their size has changed, the form of six numbers that other programs have,"
        " and marks of cameras: what a certificate was moved by, and what their readings leave."
    )
    form = (
        "reading = a0 + a1 x + a2 y, x and y in the frame of the marks (mm); the scanner is errorless in"
        " standard deviations."
    )
    scales = (
        "Scales are mm of the film in a mm of the camera; between axes is the angle between their images less"
        " 90 degrees."
    )
    photos, *rest = form_table(result)
    numbers, said = rest[:2], rest[2:]
    lost = "Lost are marks that were read on other photos. T is that of both coordinates of a reading."
    marks = "Mean residuals are in the frame of the camera, of all photos."
    parts: list[Part] = [
        page_table("Films", film_table(result), lost),
        page_table("The same as six numbers", [photos, *numbers], form),
        page_table("Scales, angle between the axes, rotation", [photos, *said], scales),
        drawing,
        page_table("Fiducial marks", mark_table(result), marks),
        page_table("Scanners", scanner_table(result)),
    ]
    return Section("films", "Film and fiducials", parts, intro)
