"""Decks of 80-column cards: numeric fields and sequential reading."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.objects import path_of, require
from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.io.numbers import ARCSEC
from photogram.io.places import at_place
from photogram.io.records import Record, Source, parse_integer, parse_real
from photogram.stellar.parameters import GRAD, NAMES
from photogram.stellar.problem import Axis, Options, Problem, default_parameters, rejected
from photogram.stellar.sky import Air, Site
from photogram.words import Phrase, phrase


class Card(Record):
    """Card with fields given by first and last column, counted from 1."""

    def name(self, first: int, last: int) -> str:
        return self.columns(first, last).strip()

    def real(self, first: int, last: int, decimals: int = 8) -> float:
        """Return an Ew.d or Fw.d field; blank is zero."""
        return float(self._parsed(first, last, partial(parse_real, decimals=decimals)))

    def integer(self, first: int, last: int) -> int:
        """Return an Iw field; blank is zero."""
        return int(self._parsed(first, last, parse_integer))

    def _parsed(self, first: int, last: int, parse: Callable[[str], Any]) -> Any:
        try:
            return parse(self.columns(first, last))
        except ValueError as error:
            message = phrase("error.columns", first=first, last=last, message=message_of(error))
            raise self.error(message) from None

    def reals(self, first: int, width: int, count: int, decimals: int = 8) -> list[float]:
        starts = range(first, first + width * count, width)
        return [self.real(start, start + width - 1, decimals) for start in starts]

    def sexagesimal(self, first: int, last: int, decimals: int) -> tuple[float, float, float]:
        """Return degrees (3 columns), minutes (2) and seconds, with a column between them."""
        degrees, minutes = self.real(first, first + 2, 0), self.real(first + 4, first + 5, 0)
        return degrees, minutes, self.real(first + 7, last, decimals)

    def symmetric(self, values: list[float]) -> Floats:
        """Return a weight matrix of its elements xx, yy, xy."""
        first, second, cross = values
        if not (first > 0 and second > 0 and first * second > cross * cross):
            raise self.error(phrase("stars.indefinite-card", xx=first, yy=second, xy=cross))
        return np.array([[first, cross], [cross, second]])


class Cards:
    def __init__(self, file: Path) -> None:
        self._source, self._taken = Source.read(file), 0

    def take(self, name: str) -> Card:
        """Return the next card, named in errors.

        InputError: if the deck ends.
        """
        self._taken += 1
        if self._taken > len(self._source.lines):
            message = phrase("stars.deck-ends", card=name)
            raise InputError(message, file=self._source.path, record=self._taken)
        return Card(self._source, self._taken)

    @property
    def at_end(self) -> bool:
        """Return whether only blank cards remain."""
        return not any(number > self._taken for number in self._source.filled())


_DEGREE = np.pi / 180.0
_HOUR = np.pi / 12.0
_FULL = 52  # Cards of a full weight matrix of 22 parameters: every row starts a card
_MAX_STARS, _MAX_POINTS, _FIRST_POINT = 100, 200, 10000
_HEAD: dict[str, dict[str, tuple[int, int]]] = {
    "card 1 (problem number)": {"problem": (1, 4), "date of computation": (7, 25)},
    "card 2 (title)": {"title": (1, 80)},
    "card 3 (options)": {},
    "card 4 (problem constants)": {},
    "card 5 (event)": {"event": (1, 4), "date of observation": (7, 25)},
    "card 6 (plate)": {"plate": (1, 4), "camera": (7, 14), "tracking unit": (17, 19)},
    "card 7 (comparator)": {"comparator": (1, 8), "operator": (9, 32)},
}
"""First cards, with the columns of their labels."""
_SWITCHES = {"common_scale": 1, "refraction": 5, "pre_run": 7, "curves": 8, "plate_list": 11}
"""Options that are on or off, with their numbers."""


def read_deck(path: Path) -> list[Problem]:
    """Read all problems of a deck.

    Parameters
    ----------
    path
        Deck with one card per line.

    Raises
    ------
    InputError
        If the file cannot be read, or if a card is invalid. The message has its number and text (error 1 of
        the report and all others).
    """
    path = path_of("path", path)
    cards = Cards(path)
    problems = []
    while True:
        problem, last = _problem(cards)
        problems.append(problem)
        if last or cards.at_end:
            return problems


def _problem(cards: Cards) -> tuple[Problem, bool]:
    head = [*map(cards.take, _HEAD)]
    first, _, option_card, constants, _, plate, comparator = head
    option, mean_error = _descriptors(option_card)
    reject, histogram = (option_card.name(*columns) not in ("", "0") for columns in ((77, 77), (78, 80)))
    values = constants.reals(1, 10, 8, 6)
    with at_place(constants):
        air = Air(values[2], values[3])
    site = _site(cards.take("card 8 (station)"), air)
    reference, pole = None, (0.0, 0.0)
    if option[9]:
        reference = _site(cards.take("card 9 (reference station)"), site.air)
        card = cards.take("card 10 (pole)")
        pole = (card.real(1, 8, 4) * ARCSEC, card.real(9, 16, 4) * ARCSEC)
    axis = _axis(cards) if option[2] else None
    initial = _initial(cards)
    weights = _weights(cards, option[10]) if option[10] else np.zeros((len(NAMES), len(NAMES)))
    star_weight = _common_weight(cards, "card 20 (weight of the stars)") if option[3] else None
    plate_weight = _common_weight(cards, "card 21 (weight of the plate)") if option[4] else None
    stars, points = _rejections(cards) if reject else ({}, {})
    minimum = _minimum(cards, option[6]) if option[6] else {}
    factor, time = _factor(comparator), plate.real(26, 36)
    corrections = [_sidereal(plate, column) for column in (37, 51, 65)]
    groups = comparator.integer(72, 74) or 500, comparator.integer(75, 77) or 900
    data = _data(cards, groups, corrections, star_weight, plate_weight)
    (ids, names, places, star_weights), images = data
    image_points, image_stars, image_groups, xy, image_weights, times = images
    for numbers, known, code in (
        (minimum, ids, "stars.minimum-unknown"),
        (stars, ids, "stars.rejected-star"),
        (points, image_points, "stars.rejected-point"),
    ):
        for number, card in numbers.items():
            if number not in known:
                raise card.error(Phrase(code, {"names": [number]}))
    with at_place(option_card):
        options = Options(
            **{name: bool(option[number]) for name, number in _SWITCHES.items()},
            minimum_stars=tuple(minimum),
            reference=reference,
            pole=pole,
            max_iterations_minimum=option[12],
            max_iterations=option[13],
            mean_error=mean_error,
            histogram=histogram,
            tolerance=values[0],
            refraction_tolerance=(values[1] or 1e-4) * ARCSEC,
            crossover=values[4],
            interval=values[5] or 0.005,
            extent=values[6],
            distortion_tolerance=values[7],
            movement_factor=factor,
            movement_time=time,
        )
    labels = {
        name: card.name(*columns)
        for card, fields in zip(head, _HEAD.values(), strict=True)
        for name, columns in fields.items()
    }
    if any(corrections):
        seconds = ", ".join(f"{correction / _HOUR * 3600:.4f} s" for correction in corrections)
        labels["time corrections pre, post, event"] = seconds
    problem = Problem(
        site=site,
        star_ids=ids,
        star_names=names,
        star_places=np.array(places),
        star_weights=np.array(star_weights),
        image_points=image_points,
        image_stars=np.array(image_stars, np.int64),
        image_groups=np.array(image_groups, np.int64),
        image_xy=np.array(xy),
        image_weights=np.array(image_weights),
        image_times=np.array(times),
        initial=initial,
        parameter_weights=weights,
        axis=axis,
        options=options,
        labels={name: value for name, value in labels.items() if value},
    )
    return rejected(problem, stars.keys(), points.keys()), bool(first.integer(80, 80))


def _descriptors(card: Card) -> tuple[dict[int, int], float]:
    """Return options 1 to 13, with or without separating blanks, and the mean error."""
    words = card.columns(1, 76).split()
    if len(words) >= 13:
        try:
            numbers = [int(word) for word in words[:13]]
            mean_error = float(words[13].upper().replace("D", "E")) if len(words) > 13 else 0.0
        except ValueError:
            numbers_only = phrase("error.numbers", count=13, value=" ".join(words))
            raise card.error(phrase("error.at", what="options", message=numbers_only)) from None
    else:
        widths = [1, 1, 1, 1, 1, 2, 1, 1, 1, 2, 1, 2, 2]
        ends = np.cumsum(widths).tolist()
        numbers = [card.integer(end - width + 1, end) for width, end in zip(widths, ends, strict=True)]
        mean_error = card.real(18, 31)
    with at_place(card):
        least = min(*numbers, mean_error)
        require(least >= 0, "options", "not-negative", value=least)
    return dict(enumerate(numbers, 1)), mean_error


def _site(card: Card, air: Air) -> Site:
    south = card.real(33, 33, 0) != 0
    degrees, minutes, seconds = card.sexagesimal(36, 49, 4)
    latitude, longitude = _degrees(abs(degrees), minutes, seconds), _degrees(*card.sexagesimal(53, 66, 4))
    with at_place(card):
        require(latitude <= 90, "latitude", "most", high=90, value=latitude)
    return Site(
        latitude=(-latitude if south else latitude) * _DEGREE,
        longitude_west=longitude * _DEGREE,
        elevation=card.real(70, 80, 4),
        air=air,
        number=card.name(1, 4),
        name=card.name(7, 30),
    )


def _axis(cards: Cards) -> Axis:
    card = cards.take("card 11 (azimuth and zenith distance)")
    azimuth, zenith = (_degrees(*card.sexagesimal(*columns, 1)) for columns in ((36, 46), (53, 63)))
    card = cards.take("card 12 (plate coordinates of the axis)")
    x, y, *weight = card.reals(13, 12, 5)
    return Axis(azimuth * _DEGREE, zenith * _DEGREE, np.array([x, y]), card.symmetric(weight))


def _degrees(degrees: float, minutes: float, seconds: float) -> float:
    return degrees + minutes / 60 + seconds / 3600


def _initial(cards: Cards) -> Floats:
    """Read cards 13 to 18: attitude of the event and epsilon in grads, and the camera."""
    values: list[float] = []
    for number in range(13, 19):
        card = cards.take(f"card {number} (initial parameters)")
        values += [card.real(start, start + 13) for start in (2, 17, 32)]
    parameters = default_parameters(values[6])
    for group in range(3):
        parameters[3 * group : 3 * group + 3] = np.array(values[:3]) * GRAD
    parameters[9:22] = values[3:16]
    parameters[9] *= GRAD
    parameters[21] *= GRAD
    with at_place(card):
        least = float(min(parameters[12:14]))
        require(least > 0, "principal distance (cards 13 to 18)", "positive", value=least)
    return parameters


def _weights(cards: Cards, count: int) -> Floats:
    weights = np.zeros((len(NAMES), len(NAMES)))
    if count >= _FULL:
        for first, end in [(0, 22), (22, 26)] if count > _FULL else [(0, 22)]:
            for row in range(first, end):
                values = list[float]()
                while len(values) < end - row:
                    values += cards.take("card 19 (weights of parameters)").reals(1, 12, 6)
                weights[row, row:end] = values[: end - row]
    else:
        for _ in range(count):
            card = cards.take("card 19 (weights of parameters)")
            for start in range(1, 80, 16):
                row, column = card.integer(start, start + 1), card.integer(start + 2, start + 3)
                if row == column == 0:
                    continue
                if not (1 <= row <= 26 and 1 <= column <= 26):
                    raise card.error(phrase("stars.no-weight", row=row, column=column))
                weights[min(row, column) - 1, max(row, column) - 1] = card.real(start + 4, start + 15)
    return np.triu(weights) + np.triu(weights, 1).T


def _common_weight(cards: Cards, name: str) -> Floats:
    card = cards.take(name)
    return card.symmetric(card.reals(1, 12, 3))


def _rejections(cards: Cards) -> tuple[dict[str, Card], dict[str, Card]]:
    stars: dict[str, Card] = {}
    points: dict[str, Card] = {}
    while True:
        card = cards.take("a rejection card")
        number = card.integer(1, 6)
        (stars if number < _FIRST_POINT else points)[str(number)] = card
        if len(stars) > _MAX_STARS or len(points) > _MAX_POINTS:
            raise card.error(phrase("stars.too-many-rejected", stars=_MAX_STARS, points=_MAX_POINTS))
        if card.integer(18, 18):
            return stars, points


def _minimum(cards: Cards, count: int) -> dict[str, Card]:
    numbers: dict[str, Card] = {}
    for first in range(0, count, 20):
        card = cards.take("the stars of the minimum solution")
        for start in range(1, 4 * min(20, count - first), 4):
            numbers[str(card.integer(start, start + 3))] = card
    return numbers


def _sidereal(card: Card, column: int) -> float:
    hours, minutes = card.real(column, column + 2, 0), card.real(column + 3, column + 5, 0)
    return (hours + minutes / 60 + card.real(column + 6, column + 13, 4) / 3600) * _HOUR


def _factor(card: Card) -> float:
    words = card.columns(33, 71).split()
    try:
        return float(words[-1]) if words else 0.0
    except ValueError:
        message = phrase("error.number", value=words[-1])
        raise card.error(phrase("error.at", what="factor of the movement test", message=message)) from None


def _data(
    cards: Cards,
    groups: tuple[int, int],
    corrections: Sequence[float],
    common_star: Floats | None,
    common_plate: Floats | None,
) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
    """Return columns of the stars and of the images.

    Stars have numbers, names, positions and weights. Images have points, star rows, groups, coordinates,
    weights and times.
    """
    stars: dict[str, tuple[Any, ...]] = {}
    images: list[tuple[Any, ...]] = []
    last = False
    while not last:
        card = cards.take("a star card")
        number, count = card.integer(61, 66), card.integer(69, 71)
        star = str(abs(number))
        if star in stars:
            raise card.error(phrase("error.repeated", kind="star", name=star))
        if count < 1:
            raise card.error(phrase("stars.no-images", star=star, count=count))
        place = [card.real(1, 14), card.real(15, 28)]
        if abs(place[1]) > np.pi / 2:
            raise card.error(phrase("stars.declination", star=star, value=place[1]))
        weight = np.zeros((2, 2)) if number < 0 else common_star
        if weight is None:
            values = card.reals(29, 10, 3, 4)
            # As in the program, a star without positive weight is an unknown direction.
            weight = card.symmetric(values) if values[0] > 0 else np.zeros((2, 2))
        stars[star] = star, card.name(72, 77) or star, place, weight
        for image in range(count):
            card = cards.take(f"an image of star {star}")
            if str(number := abs(card.integer(61, 66))) != star:
                raise card.error(phrase("stars.error-1", star=star, value=number))
            point = card.integer(55, 60)
            trail = abs(point) % 1000
            group = 0 if trail < groups[0] else 1 if trail < groups[1] else 2
            xy = [card.real(1, 12, 10), card.real(13, 24, 10)]
            weight = card.symmetric(card.reals(25, 10, 3, 4)) if common_plate is None else common_plate
            time = card.real(67, 77, 8) + corrections[group]
            images.append((str(point), len(stars) - 1, group, xy, weight, time))
            last = card.integer(80, 80) != 0
            if last and image + 1 < count:
                raise card.error(phrase("stars.early-flag", star=star, images=count))
    return [*zip(*stars.values(), strict=True)], [*zip(*images, strict=True)]
