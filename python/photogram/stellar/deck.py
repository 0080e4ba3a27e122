"""Cards of 80 columns: fields as numbers, and the cards of a deck one after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.records import Record, Source, parse_integer, parse_real
from photogram.lazy_dataclasses import dataclass, field
from photogram.show.angles import ARCSEC
from photogram.stellar.options import Options
from photogram.stellar.parameters import GRAD, NAMES
from photogram.stellar.problem import Axis, Problem, default_parameters, rejected
from photogram.stellar.sky import Air, Site


class Card(Record):
    """A card: fields are taken by their first and last column, counted from 1."""

    def name(self, first: int, last: int) -> str:
        """Return a field as text."""
        return self.columns(first, last).strip()

    def real(self, first: int, last: int, decimals: int = 8) -> float:
        """Return an Ew.d or Fw.d field; blank is zero."""
        try:
            return float(parse_real(self.columns(first, last), decimals))
        except ValueError as error:
            raise self.error(f"columns {first}-{last}: {error}") from None

    def integer(self, first: int, last: int) -> int:
        """Return an Iw field; blank is zero."""
        try:
            return parse_integer(self.columns(first, last))
        except ValueError as error:
            raise self.error(f"columns {first}-{last}: {error}") from None

    def reals(self, first: int, width: int, count: int, decimals: int = 8) -> list[float]:
        """Return consecutive fields of equal width."""
        starts = range(first, first + width * count, width)
        return [self.real(start, start + width - 1, decimals) for start in starts]


class Cards:
    """The cards of a file, a card a line, taken one after the other."""

    def __init__(self, file: Path) -> None:
        self._source, self._taken = Source.read(file), 0

    def take(self, what: str) -> Card:
        """Return the next card, which holds what is named.

        Raises InputError: the deck is at its end.
        """
        if self._taken >= len(self._source.lines):
            message = f"the deck ends where {what} is expected"
            raise InputError(message, file=self._source.path, record=self._taken + 1)
        self._taken += 1
        return Card(self._source, self._taken)

    @property
    def at_end(self) -> bool:
        """Whether nothing but blank cards is left."""
        return not any(number > self._taken for number in self._source.filled())


_DEGREE = np.pi / 180.0
_HOUR = np.pi / 12.0
_FULL = 52
"""Cards of a full weight matrix of 22 parameters: every row starts a card."""
_MOST_STARS, _MOST_POINTS, _FIRST_POINT = 100, 200, 10000


@dataclass
class _Descriptors:
    """Card 3."""

    options: list[int]
    mean_error: float
    reject: bool
    histogram: bool

    def __getitem__(self, number: int) -> int:
        return self.options[number - 1]


@dataclass
class _Common:
    """What the cards before the data say and the data need."""

    post: int
    event: int
    corrections: tuple[float, float, float]
    star_weight: Floats | None
    plate_weight: Floats | None


@dataclass
class _Data:
    """Star and image cards."""

    ids: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    places: list[list[float]] = field(default_factory=list)
    weights: list[Floats] = field(default_factory=list)
    points: list[str] = field(default_factory=list)
    stars: list[int] = field(default_factory=list)
    groups: list[int] = field(default_factory=list)
    xy: list[list[float]] = field(default_factory=list)
    image_weights: list[Floats] = field(default_factory=list)
    times: list[float] = field(default_factory=list)


def read_deck(path: Path) -> list[Problem]:
    """Read all problems of a deck.

    Parameters
    ----------
    path
        The deck, a card a line.

    Raises
    ------
    InputError
        The file cannot be read; or a card cannot be used, with its number and text: error 1 of the report and
        all others.
    """
    cards = Cards(path)
    problems = []
    while True:
        problem, last = _problem(cards)
        problems.append(problem)
        if last or cards.at_end:
            return problems


def _problem(cards: Cards) -> tuple[Problem, bool]:
    first = cards.take("card 1 (problem number)")
    title = cards.take("card 2 (title)")
    option_card = cards.take("card 3 (options)")
    descriptors = _descriptors(option_card)
    constants = cards.take("card 4 (problem constants)")
    values = constants.reals(1, 10, 8, 6)
    event, plate, comparator = (
        cards.take(what) for what in ("card 5 (event)", "card 6 (plate)", "card 7 (comparator)")
    )
    try:
        air = Air(values[2], values[3])
    except InputError as error:
        raise constants.error(error.message) from None
    site = _site(cards.take("card 8 (station)"), air)
    reference, pole = None, (0.0, 0.0)
    if descriptors[9]:
        reference = _site(cards.take("card 9 (reference station)"), site.air)
        card = cards.take("card 10 (pole)")
        pole = (card.real(1, 8, 4) * ARCSEC, card.real(9, 16, 4) * ARCSEC)
    axis = _axis(cards) if descriptors[2] else None
    initial = _initial(cards)
    weights = _weights(cards, descriptors[10]) if descriptors[10] else np.zeros((len(NAMES), len(NAMES)))
    star_weight = _matrix(cards.take("card 20 (weight of the stars)"), 1, 12) if descriptors[3] else None
    plate_weight = _matrix(cards.take("card 21 (weight of the plate)"), 1, 12) if descriptors[4] else None
    stars, points = _rejections(cards) if descriptors.reject else ({}, {})
    minimum = _minimum(cards, descriptors[6]) if descriptors[6] else {}
    factor, time = _factor(comparator), plate.real(26, 36)
    corrections = tuple(_sidereal(plate, column) for column in (37, 51, 65))
    common = _Common(
        post=comparator.integer(72, 74) or 500,
        event=comparator.integer(75, 77) or 900,
        corrections=(corrections[0], corrections[1], corrections[2]),
        star_weight=star_weight,
        plate_weight=plate_weight,
    )
    data = _data(cards, common)
    _refuse_missing(minimum, data.ids, "incorrect stars specified for minimum solution")
    _refuse_missing(stars, data.ids, "rejected but not there")
    _refuse_missing(points, data.points, "rejected but not there")
    try:
        options = Options(
            common_scale=bool(descriptors[1]),
            refraction=bool(descriptors[5]),
            minimum_stars=tuple(minimum),
            pre_run=bool(descriptors[7]),
            curves=bool(descriptors[8]),
            reference=reference,
            pole=pole,
            plate_list=bool(descriptors[11]),
            max_iterations_minimum=descriptors[12],
            max_iterations=descriptors[13],
            mean_error=descriptors.mean_error,
            histogram=descriptors.histogram,
            tolerance=values[0],
            refraction_tolerance=(values[1] or 1e-4) * ARCSEC,
            crossover=values[4],
            interval=values[5] or 0.005,
            extent=values[6],
            distortion_tolerance=values[7],
            movement_factor=factor,
            movement_time=time,
        )
    except InputError as error:
        raise option_card.error(error.message) from None
    labels = {
        "title": title.name(1, 80),
        "problem": first.name(1, 4),
        "date of computation": first.name(7, 25),
        "event": event.name(1, 4),
        "date of observation": event.name(7, 25),
        "plate": plate.name(1, 4),
        "camera": plate.name(7, 14),
        "tracking unit": plate.name(17, 19),
        "comparator": comparator.name(1, 8),
        "operator": comparator.name(9, 32),
        "time corrections pre, post, event": ", ".join(f"{c / _HOUR * 3600:.4f} s" for c in corrections)
        if any(corrections)
        else "",
    }
    problem = Problem(
        site=site,
        star_ids=tuple(data.ids),
        star_names=tuple(data.names),
        star_places=np.array(data.places).reshape(-1, 2),
        star_weights=np.array(data.weights).reshape(-1, 2, 2),
        image_points=tuple(data.points),
        image_stars=np.array(data.stars, np.int64),
        image_groups=np.array(data.groups, np.int64),
        image_xy=np.array(data.xy).reshape(-1, 2),
        image_weights=np.array(data.image_weights).reshape(-1, 2, 2),
        image_times=np.array(data.times),
        initial=initial,
        parameter_weights=weights,
        axis=axis,
        options=options,
        labels={name: value for name, value in labels.items() if value},
    )
    return rejected(problem, stars.keys(), points.keys()), bool(first.integer(80, 80))


def _descriptors(card: Card) -> _Descriptors:
    """Read the options: separated by blanks, or one after the other without any."""
    words = card.columns(1, 76).split()
    if len(words) >= 13:
        try:
            numbers = [int(word) for word in words[:13]]
            mean_error = float(words[13].upper().replace("D", "E")) if len(words) > 13 else 0.0
        except ValueError as error:
            raise card.error(f"options: {error}") from None
    else:
        widths = [1, 1, 1, 1, 1, 2, 1, 1, 1, 2, 1, 2, 2]
        ends = np.cumsum(widths)
        numbers = [
            card.integer(int(end) - width + 1, int(end)) for width, end in zip(widths, ends, strict=True)
        ]
        mean_error = card.real(18, 31)
    if min(numbers) < 0 or mean_error < 0:
        raise card.error("an option cannot be negative")
    # The listing has the limit of the minimum solution first.
    return _Descriptors(
        numbers, mean_error, card.name(77, 77) not in ("", "0"), card.name(78, 80) not in ("", "0")
    )


def _site(card: Card, air: Air) -> Site:
    south = card.real(33, 33, 0) != 0
    latitude = abs(card.real(36, 38, 0)) + card.real(40, 41, 0) / 60 + card.real(43, 49, 4) / 3600
    longitude = card.real(53, 55, 0) + card.real(57, 58, 0) / 60 + card.real(60, 66, 4) / 3600
    if latitude > 90:
        raise card.error("the latitude exceeds 90 degrees")
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
    azimuth = card.real(36, 38, 0) + card.real(40, 41, 0) / 60 + card.real(43, 46, 1) / 3600
    zenith = card.real(53, 55, 0) + card.real(57, 58, 0) / 60 + card.real(60, 63, 1) / 3600
    card = cards.take("card 12 (plate coordinates of the axis)")
    x, y, *weight = card.reals(13, 12, 5)
    return Axis(azimuth * _DEGREE, zenith * _DEGREE, np.array([x, y]), _symmetric(card, weight))


def _initial(cards: Cards) -> Floats:
    """Cards 13 to 18: alpha, omega, kappa of the event in grads, epsilon (grads), and the camera."""
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
    if not (parameters[12] > 0 and parameters[13] > 0):
        raise card.error("the principal distances of cards 13 to 18 must be positive")
    return parameters


def _weights(cards: Cards, count: int) -> Floats:
    weights = np.zeros((len(NAMES), len(NAMES)))
    if count >= _FULL:
        sizes = [(0, 22)] + ([(22, 26)] if count > _FULL else [])
        for first, end in sizes:
            for row in range(first, end):
                weights[row, row:end] = _row(cards, end - row)
    else:
        for _ in range(count):
            card = cards.take("card 19 (weights of parameters)")
            for start in range(1, 80, 16):
                row, column = card.integer(start, start + 1), card.integer(start + 2, start + 3)
                if row == column == 0:
                    continue
                if not (1 <= row <= 26 and 1 <= column <= 26):
                    raise card.error(f"there is no weight ({row}, {column}) of 26 parameters")
                weights[min(row, column) - 1, max(row, column) - 1] = card.real(start + 4, start + 15)
    return np.triu(weights) + np.triu(weights, 1).T


def _row(cards: Cards, count: int) -> list[float]:
    values: list[float] = []
    while len(values) < count:
        values += cards.take("card 19 (weights of parameters)").reals(1, 12, 6)
    return values[:count]


def _matrix(card: Card, first: int, width: int) -> Floats:
    return _symmetric(card, card.reals(first, width, 3))


def _symmetric(card: Card, values: list[float]) -> Floats:
    first, second, cross = values
    if not (first > 0 and second > 0 and first * second > cross * cross):
        raise card.error("the weight matrix is not positive definite")
    return np.array([[first, cross], [cross, second]])


def _rejections(cards: Cards) -> tuple[dict[str, Card], dict[str, Card]]:
    """Read the numbers of stars and plate points, each with its card."""
    stars: dict[str, Card] = {}
    points: dict[str, Card] = {}
    while True:
        card = cards.take("a rejection card")
        number = card.integer(1, 6)
        (stars if number < _FIRST_POINT else points)[str(number)] = card
        if len(stars) > _MOST_STARS:
            raise card.error(f"too many rejected stars: {_MOST_STARS} at the most")
        if len(points) > _MOST_POINTS:
            raise card.error(f"too many rejected plate points: {_MOST_POINTS} at the most")
        if card.integer(18, 18):
            return stars, points


def _minimum(cards: Cards, count: int) -> dict[str, Card]:
    """Read the numbers of the stars, twenty a card, each with its card."""
    numbers: dict[str, Card] = {}
    for first in range(0, count, 20):
        card = cards.take("the stars of the minimum solution")
        for start in range(1, 4 * min(20, count - first), 4):
            numbers[str(card.integer(start, start + 3))] = card
    return numbers


def _refuse_missing(named: dict[str, Card], there: list[str], message: str) -> None:
    known = set(there)
    for number, card in named.items():
        if number not in known:
            raise card.error(f"{message}: {number}")


def _sidereal(card: Card, column: int) -> float:
    hours, minutes = card.real(column, column + 2, 0), card.real(column + 3, column + 5, 0)
    return (hours + minutes / 60 + card.real(column + 6, column + 13, 4) / 3600) * _HOUR


def _factor(card: Card) -> float:
    words = card.columns(33, 71).split()
    try:
        return float(words[-1]) if words else 0.0
    except ValueError:
        raise card.error(f"the factor of the movement test is not a number: {words[-1]!r}") from None


def _data(cards: Cards, common: _Common) -> _Data:
    data, last = _Data(), False
    known: set[str] = set()
    while not last:
        card = cards.take("a star card")
        number, count = card.integer(61, 66), card.integer(69, 71)
        star = str(abs(number))
        if star in known:
            raise card.error(f"star {star} is in the deck twice")
        if count < 1:
            raise card.error(f"star {star} has no images")
        known.add(star)
        data.ids.append(star)
        data.names.append(card.name(72, 77) or star)
        place = [card.real(1, 14), card.real(15, 28)]
        if abs(place[1]) > np.pi / 2:
            raise card.error(f"the declination {place[1]:g} of star {star} is beyond the pole")
        data.places.append(place)
        data.weights.append(np.zeros((2, 2)) if number < 0 else _star_weight(card, common))
        for image in range(count):
            card = cards.take(f"an image of star {star}")
            last = _image(card, star, data, common)
            if last and image + 1 < count:
                raise card.error(f"the last image of the deck is flagged, but star {star} has {count} images")
    return data


def _star_weight(card: Card, common: _Common) -> Floats:
    if common.star_weight is not None:
        return common.star_weight
    weight = card.reals(29, 10, 3, 4)
    # A weight that is not positive is what the program took for an unknown direction.
    return _symmetric(card, weight) if weight[0] > 0 else np.zeros((2, 2))


def _image(card: Card, star: str, data: _Data, common: _Common) -> bool:
    if str(abs(card.integer(61, 66))) != star:
        raise card.error(f"ERROR 1: star numbers disagree: the star card has {star}")
    point = card.integer(55, 60)
    trail = abs(point) % 1000
    group = 0 if trail < common.post else 1 if trail < common.event else 2
    weight = common.plate_weight
    data.points.append(str(point))
    data.stars.append(len(data.ids) - 1)
    data.groups.append(group)
    data.xy.append([card.real(1, 12, 10), card.real(13, 24, 10)])
    data.image_weights.append(_symmetric(card, card.reals(25, 10, 3, 4)) if weight is None else weight)
    data.times.append(card.real(67, 77, 8) + common.corrections[group])
    return card.integer(80, 80) != 0
