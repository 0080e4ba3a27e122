"""What the project has set itself, and what was reached."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import phases
from runs import Measured, Record, Size, main_seconds

GIB = 2.0**30

SMALLEST, LARGEST = 1_000, 50_000
"""Photographs from which on times are compared with those of the peers, and from which on memory counts."""

DISTANCES = {1_000: 5.0, 5_000: 3.0, 50_000: 1.8}
"""Times the counted operations at the product rate that blocks of so many photographs may take."""
REST = 0.1
"""Share of the time that may go into what is no numerical phase."""


@dataclass(frozen=True)
class Target:
    """A figure that should not be above (`above` false: below) its target."""

    name: str
    target: float
    reached: float
    above: bool = False
    unit: str = ""

    @property
    def met(self) -> bool:
        """Whether it was reached."""
        return self.reached >= self.target if self.above else self.reached <= self.target

    @property
    def bound(self) -> str:
        """The target as text."""
        return f"{'at least' if self.above else 'at most'} {self.target:.3g}{self.unit}"


@dataclass(frozen=True)
class Growth:
    """How time grows from the smallest to the largest block of a kind: with photographs to the `exponent`."""

    kind: str
    smallest: Size
    largest: Size
    exponent: float


def growth(results: Sequence[Measured]) -> Iterator[Growth]:
    """Exponents of blocks and of single strips, where there are two sizes of them."""
    for kind, strip in (("blocks", False), ("strips", True)):
        of_kind = [(each.size, each.ours) for each in results if (each.size.strips == 1) == strip]
        times = [(size, main_seconds("photogram", ours)) for size, ours in of_kind if ours is not None]
        if len(times) < 2:
            continue
        (smallest, least), (largest, most) = (extreme(times, key=_photos) for extreme in (min, max))
        exponent = math.log(most / least) / math.log(largest.photos / smallest.photos)
        yield Growth(kind, smallest, largest, exponent)


def _photos(of_size: tuple[Size, float]) -> int:
    return of_size[0].photos


def targets(results: Sequence[Measured], small: Mapping[str, float]) -> Iterator[Target]:
    """Every target that the runs can judge; `small` are the seconds of small things (machine.py)."""
    for measured in results:
        if measured.photos >= SMALLEST:
            yield from _against_peers(measured)
            yield from _against_the_limit(measured)
        if measured.photos >= LARGEST and measured.ours:
            peak = measured.ours["peak"]["everything"] / GIB
            yield Target(f"{measured.size}: peak memory", 20.0, peak, unit=" GiB")
    limits = {"blocks": 1.3, "strips": 1.05}
    for grown in growth(results):
        name = f"{grown.kind} from {grown.smallest} to {grown.largest}: exponent of time"
        yield Target(name, limits[grown.kind], grown.exponent)
    blocks = [measured for measured in results if measured.size.strips > 1 and measured.ours]
    if blocks:
        yield from _rates(max(blocks, key=lambda measured: measured.photos))
    yield Target("import of the package", 300.0, 1e3 * small["import"], unit=" ms")
    yield Target("adjustment of five photos", 20.0, 1e3 * small["small block"], unit=" ms")


def _against_peers(measured: Measured) -> Iterator[Target]:
    ours, size = measured.ours, measured.size
    gtsam, pycolmap = (measured.records.get(side, {}).get("seconds", {}) for side in ("gtsam", "pycolmap"))
    for peer, seconds in (("gtsam", gtsam), ("pycolmap", pycolmap)):
        if ours and "solution" in seconds:
            ratio = ours["seconds"]["everything"] / seconds["solution"]
            yield Target(f"{size}: everything / {peer}'s bare solution", 0.1, ratio)
    if ours and "covariances" in pycolmap:
        ratio = covariance_seconds(ours) / pycolmap["covariances"]
        yield Target(f"{size}: covariances / pycolmap's covariances", 0.05, ratio)


def _against_the_limit(measured: Measured) -> Iterator[Target]:
    """Judge the whole by the time that its counted operations take at the rate of matrix products."""
    ours, most = measured.ours, DISTANCES.get(measured.photos)
    if not ours or most is None or measured.size.strips == 1:
        return
    least = sum(phases.operations(ours).values()) / measured.product
    name = f"{measured.size}: everything, times its operations at the product rate"
    yield Target(name, most, ours["seconds"]["everything"] / least)
    *_, rest = phases.phases(ours)
    yield Target(f"{measured.size}: outside the numerical phases, share of the time", REST, rest.share)


def covariance_seconds(record: Record) -> float:
    """Seconds of photogram's covariances: what `covariance=False` would have spared."""
    return float(record["phases"][phases.INVERT] + record["phases"][phases.COFACTORS])


def _rates(measured: Measured) -> Iterator[Target]:
    """Judge the phases of one adjustment by the machine's matrix-product rate."""
    if not measured.ours:
        return
    size, counted, seconds = measured.size, phases.operations(measured.ours), measured.ours["phases"]
    for name in (phases.FACTOR, phases.INVERT):
        part = counted[name] / seconds[name] / measured.product
        yield Target(f"{size}: {phases.NAMES[name]}, part of the product rate", 0.5, part, above=True)
    times = seconds[phases.FORM] / (counted[phases.FORM] / (measured.product / 4))
    name = f"{size}: {phases.NAMES[phases.FORM]}, times its operations at a quarter of the product rate"
    yield Target(name, 3.0, times)
