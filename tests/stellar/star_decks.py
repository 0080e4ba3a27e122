"""The example as a card deck."""

import numpy as np

from photogram.stellar import GRAD


def put(*fields):
    """Make a card of fields that start at given columns."""
    card = ""
    for column, text in fields:
        card = card.ljust(column - 1) + str(text)
        assert len(card) <= 80
    return card


def e(value, width=14, decimals=8):
    return f"{value:{width}.{decimals}E}" if value else "0".rjust(width)


def cards(problem, options="0 0 1 1 0 0 0 1 0 0 0 0 0 0.0"):
    """Write the example as a deck: all groups begin at the event's attitude, as the deck has it."""
    p = problem.initial
    values = [*(p[6:9] / GRAD), p[9] / GRAD, *p[10:21], p[21] / GRAD, 0.0, 0.0]
    deck = [
        put((1, "7"), (7, "18 JULY 1967"), (80, "1")),
        "A PLATE",
        options,
        "".join(e(v, 10, 3) for v in (1e-10, 1e-6, 293.0, 760.0, 0.065, 0.005, 0.1, 1e-12)),
        put((1, "E1"), (7, "19 JULY 1967")),
        put((1, "P1"), (26, " 1.50000000"), (37, "  0  0  0.0000")),
        put((1, "MANN"), (9, "N.N."), (64, "    3.00"), (72, "500900")),
        put((1, "1"), (7, "SOMEWHERE"), (36, " 30"), (40, " 0"), (43, " 0.0000"), (53, " 80"), (57, " 0")),
    ]
    deck += ["".join(f" {v:14.7E}" for v in values[i : i + 3]) for i in range(0, 18, 3)]
    deck += [
        "".join(e(v, 12, 5) for v in (9.57266, 9.57266, 0.0)),
        "".join(e(v, 12, 5) for v in (1.0, 1.0, 0.0)),
    ]
    for i, star in enumerate(problem.star_ids):
        images = np.flatnonzero(problem.image_stars == i)
        ra, dec = problem.star_places[i]
        deck.append(
            put((1, f"{ra:14.11f}"), (15, f"{dec:14.11f}"), (61, f"{star:>6}"), (69, f"{len(images):3}"))
        )
        for k in images:
            x, y = problem.image_xy[k]
            last = "1" if k == len(problem.image_points) - 1 else "0"
            point, time = problem.image_points[k], problem.image_times[k]
            deck.append(
                put(
                    (1, f"{x:12.8f}"),
                    (13, f"{y:12.8f}"),
                    (55, f"{point:>6}{star:>6}{time:11.8f}"),
                    (80, last),
                )
            )
    return deck
