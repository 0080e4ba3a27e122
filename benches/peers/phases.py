"""What each phase of photogram's adjustment took, against the operations that it had to do."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

# Multiply-adds where the result does not count them itself.
#
# An image point in one formation: its collinearity equations with their partials (about 60), and from its two
# rows the point's normal matrix and right-hand side (20), the coupling of point and photograph and its
# triangular solution (72), the photograph's own block and right-hand side (54).
FORMATION = 200.0
# With Q_oo the inverse over the k photographs of a point (6 k unknowns) the product H Q_oo takes 3 (6 k)^2;
# a Q a^T of the two equations of each image point, over point and photograph, about 100.
COFACTORS_OF_PAIR, COFACTORS_OF_IMAGE = 108.0, 100.0

FORM, FACTOR, INVERT, COFACTORS = "form", "factor", "invert", "cofactors"

NAMES = {
    FORM: "formation and reduction",
    FACTOR: "factor",
    "solve": "solution",
    INVERT: "selected inverse",
    COFACTORS: "point covariances, redundancy numbers",
}


@dataclass(frozen=True)
class Phase:
    """One phase of one adjustment, over all iterations.

    `operations` are multiply-adds, None where they are not counted.
    """

    name: str
    seconds: float
    share: float
    operations: float | None

    @property
    def rate(self) -> float | None:
        """Multiply-adds per second."""
        return self.operations / self.seconds if self.operations and self.seconds else None


def phases(record: Mapping[str, Any]) -> Iterator[Phase]:
    """Phases of photogram's record, by the names of its result, and the rest of the time at the end."""
    total = record["seconds"]["everything"]
    counted = operations(record)
    for name, seconds in record["phases"].items():
        yield Phase(name, seconds, seconds / total, counted.get(name))
    rest = total - sum(record["phases"].values())
    yield Phase("everything else", rest, rest / total, None)


def operations(record: Mapping[str, Any]) -> dict[str, float]:
    """Multiply-adds of the phases, all iterations together."""
    once, times = record["operations"], record["formations"]
    rays, pairs = record["rays"]
    formation = once.get("formation", FORMATION * rays)
    cofactors = once.get("cofactors", COFACTORS_OF_PAIR * pairs + COFACTORS_OF_IMAGE * rays)
    return {
        FORM: times * (formation + once["reduction"]),
        FACTOR: times * once["factor"],
        INVERT: once["inverse"],
        COFACTORS: cofactors,
    }
