"""Cameras of DBAT: elements `camera` of scripts and of files of cameras."""

from __future__ import annotations

import math

from photogram.errors import InputError
from photogram.formats.dbat.content import Sensor, sensor_of
from photogram.formats.project import Size
from photogram.formats.xml_stream import Element
from photogram.messages import Message

__all__ = ["sensors_of_cameras"]

PLAIN, AFFINE = 1, 3
"""Models: Brown's terms of measured coordinates; the same after an affinity."""
_TERMS = ("K1", "K2", "K3"), ("P1", "P2")


def sensors_of_cameras(parent: Element, messages: list[Message]) -> dict[str, Sensor]:
    """Return the cameras below an element, by their numbers; the first is 1.

    Raises
    ------
    InputError
        A camera that is not all there, or has a model that is not read.
    """
    found: dict[str, Sensor] = {}
    for row, each in enumerate(parent.all("camera"), 1):
        number = each.word("id", str(row))
        if number in found:
            raise each.error(f"the camera {number} is there twice")
        try:
            found[number] = _sensor(each, number, messages)
        except InputError as error:
            raise (error if error.file else each.error(error.message)) from None
    if not found:
        raise parent.error("has no camera")
    return found


def _numbers(element: Element, name: str, count: int) -> list[float]:
    own = element.need(name)
    words = [word.strip() for word in own.text.split(",")]
    if len(words) != count:
        raise own.error(f"has {len(words)} numbers, not {count}")
    return [own.place.number(word) for word in words]


def _sensor(element: Element, number: str, messages: list[Message]) -> Sensor:
    if (unit := element.word("unit", "mm")) != "mm":
        raise element.error(f"a camera in {unit} is not read: mm is")
    width, height = _numbers(element, "image", 2)
    if not (0 < width < 2**31 and 0 < height < 2**31 and width == int(width) and height == int(height)):
        raise element.need("image").error("is no number of pixels")
    size = int(width), int(height)
    sides = _sides(element, size)
    model = element.whole("model") if element.child("model") else PLAIN
    terms = _terms(element)
    skew = element.number("skew", 0.0)
    if model not in (PLAIN, AFFINE) and (any(terms.values()) or skew or sides[0] != sides[1]):
        raise element.need("model").error(f"model {model} is not read: {PLAIN} and {AFFINE} are, backward")
    if model == PLAIN and skew:
        raise element.need("skew").error(f"model {PLAIN} has no skew")
    c = _principal_distance(element, messages)
    px, py = _principal_point(element, size, sides, terms, messages)
    name = element.word("name") or f"camera {number}"
    return sensor_of(name, size, sides, (c, px, py), terms, skew)


def _sides(element: Element, size: Size) -> tuple[float, float]:
    """Return width and height of a pixel: the width from `aspect` where it is said."""
    sensor = element.need("sensor")
    first, comma, second = (word.strip() for word in sensor.text.partition(","))
    if not comma:
        raise sensor.error("has not both width and height")
    down = sensor.place.number(second) / size[1]
    aspect = element.word("aspect", "1" if first == "auto" else "auto")
    own = element.child("aspect") or sensor
    if aspect == "auto" and first == "auto":
        raise sensor.error("neither the width of the sensor nor the aspect of pixels is a number")
    across = sensor.place.number(first) / size[0] if aspect == "auto" else own.place.number(aspect) * down
    if not (1e-5 < down < 1 and 1e-5 < across < 1):
        raise sensor.error(f"pixels of {across:.3g} x {down:.3g} mm cannot be")
    return across, down


def _terms(element: Element) -> dict[str, float]:
    found: dict[str, float] = {}
    for letter, names in zip("KP", _TERMS, strict=True):
        own = element.child(letter)
        if own is None:
            continue
        words = own.text.replace(",", " ").split()
        if len(words) > len(names):
            raise own.error(f"has {len(words)} terms; {len(names)} are the most")
        found |= {name: own.place.number(word) for name, word in zip(names, words, strict=False)}
    return found


def _principal_distance(element: Element, messages: list[Message]) -> float:
    word = element.word("cc", "focal")
    if word == "focal":
        messages.append(Message(f"{element.word('name', 'camera')}: cc is the focal length", element.file))
        c = element.number("focal")
    else:
        c = element.number("cc")
    if not c > 0:
        raise element.error(f"a principal distance of {c:g} mm")
    return c


def _principal_point(
    element: Element,
    size: Size,
    sides: tuple[float, float],
    terms: dict[str, float],
    messages: list[Message],
) -> tuple[float, float]:
    middle = size[0] / 2 * sides[0], size[1] / 2 * sides[1]
    if element.word("pp", "default") == "default":
        messages.append(Message(f"{element.word('name', 'camera')}: pp is the middle", element.file))
        return middle
    px, py = _numbers(element, "pp", 2)
    if py < 0:
        # DBAT wrote y up, and the terms with the other sign, before its version 0.9.
        if any(terms.values()):
            raise element.need("pp").error(
                "is of an older version of DBAT, with y up and K and P of the other sign: turn them all"
            )
        py = -py
    if not (math.hypot(px - middle[0], py - middle[1]) < max(middle)):
        raise element.need("pp").error("lies outside of the picture")
    return px, py
