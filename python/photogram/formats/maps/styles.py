"""Styles of the layers of a map, as QGIS reads them (QML)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

_Symbol = tuple[str, str, Mapping[str, str]]
"""Type of the symbol, class of its one layer, and properties of this."""

BLUE, RED, GREEN = "31,120,180,255", "214,39,40,255", "51,160,44,255"
GREY, CLEAR = "90,90,90,255", "0,0,0,0"


def _marker(shape: str, colour: str, size: float) -> _Symbol:
    outline = {"outline_color": "255,255,255,255", "outline_width": "0.1", "outline_width_unit": "MM"}
    own = {"name": shape, "color": colour, **outline, "size": f"{size:g}", "size_unit": "MM"}
    return "marker", "SimpleMarker", own


def _fill(colour: str, outline: str, width: float) -> _Symbol:
    own = {"color": colour, "style": "no" if colour == CLEAR else "solid", "outline_color": outline}
    own |= {"outline_style": "solid", "outline_width": f"{width:g}", "outline_width_unit": "MM"}
    return "fill", "SimpleFill", own


def _line(colour: str) -> _Symbol:
    own = {"line_color": colour, "line_style": "solid", "line_width": "0.4", "line_width_unit": "MM"}
    return "line", "SimpleLine", own


LAYERS: Mapping[str, tuple[str, Sequence[tuple[str, _Symbol]]]] = {
    "photos": ("", [("", _marker("triangle", BLUE, 2.6))]),
    "footprints": ("", [("", _fill("31,120,180,18", BLUE, 0.15))]),
    "points": (
        "kind",
        [
            ("pass", _marker("circle", GREY, 1.0)),
            ("control", _marker("equilateral_triangle", RED, 3.0)),
            ("check", _marker("square", GREEN, 2.6)),
        ],
    ),
    "point_ellipses": ("", [("", _fill(CLEAR, GREY, 0.2))]),
    "control": ("", [("", _marker("cross", RED, 3.4))]),
    "control_residuals": ("", [("", _line(RED))]),
    "check_residuals": ("", [("", _line(GREEN))]),
    "suspicious": ("", [("", _marker("star", "255,127,0,255", 3.6))]),
}
"""The attribute by whose values a layer is drawn, if any, and the symbol of each of these."""


def style(name: str) -> str:
    """Return the style of a layer."""
    attribute, symbols = LAYERS[name]
    root = Element("qgis", version="3.22.0", styleCategories="Symbology")
    kind = "categorizedSymbol" if attribute else "singleSymbol"
    renderer = SubElement(
        root, "renderer-v2", type=kind, enableorderby="0", forceraster="0", symbollevels="0"
    )
    if attribute:
        renderer.set("attr", attribute)
        categories = SubElement(renderer, "categories")
        for row, (value, _) in enumerate(symbols):
            own = {"value": value, "label": value, "symbol": str(row), "render": "true", "type": "string"}
            SubElement(categories, "category", own)
    drawn = SubElement(renderer, "symbols")
    for row, (_, (form, layer, properties)) in enumerate(symbols):
        symbol = SubElement(drawn, "symbol", type=form, name=str(row), alpha="1", clip_to_extent="1")
        inside = SubElement(symbol, "layer", {"class": layer, "enabled": "1", "locked": "0", "pass": "0"})
        # Versions from 3.26 on read the options, those before 3.18 the properties.
        options = SubElement(inside, "Option", type="Map")
        for key, value in properties.items():
            SubElement(options, "Option", name=key, type="QString", value=value)
            SubElement(inside, "prop", k=key, v=value)
    indent(root)
    declared = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    return declared + tostring(root, encoding="unicode") + "\n"
