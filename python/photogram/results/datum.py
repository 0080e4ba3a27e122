"""The datum of coordinates and standard deviations, and check points, which do not define it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.arguments.arrays import by_key
from photogram.arguments.objects import require_name
from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import AdjustmentError, InputError, failure_of_core
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.block_checks import ATTITUDE_COLUMNS
from photogram.network.datum import DatumRow
from photogram.network.observations import Distance, EqualHeight, OnPlumbLine
from photogram.network.observations.points import Control
from photogram.network.trajectories import RotationCoefficient
from photogram.results.covariance import Failure, photo_components
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram import Result
    from photogram.show.quantity import Axis
    from photogram.statistics.findings import Agreement

ANGLES = tuple(name.removesuffix("_deg") for name in ATTITUDE_COLUMNS)
TURNS = (*ANGLES, "rotation ")  # First words of names of rotations
NOTABLE_LOSS = 1e-9  # Largest part of a variance by rounding without a message


@dataclass(frozen=True)
class ResultDatum:
    """The datum of coordinates and standard deviations."""

    # `observations` (control, weights and observations define it), `minimal control` (control and weights
    # only define the datum, and check nothing), `minimum constraints`, `inner constraints` or `relative`
    kind: str
    # Photos, or coefficients of trajectories, with the names of their fixed unknowns; for types other than
    # minimum constraints, before the transformation of the network to its datum
    held: tuple[tuple[str, str], ...] = ()
    # points, photos: Items with inner constraints, or references of relative cofactors
    points: tuple[str, ...] = ()
    photos: tuple[str, ...] = ()
    scale: bool = False  # Whether inner constraints also define the scale: no observation does
    lost: float = 0.0  # Approximate part of the variances that is rounding error
    attitudes: tuple[str, ...] = ()  # Photos with inner constraints on attitudes
    row: DatumRow | None = field(default=None, repr=False)
    """The datum for the core."""

    @property
    def phrase(self) -> Phrase:
        counts = (("points", self.points), ("photos", self.photos), ("attitudes", self.attitudes))
        scaled = self.kind == "inner constraints" and self.scale
        fields = {
            "held": held_unknowns(self.held),
            "over": [Phrase(f"datum.over.{name}", {"n": len(own)}) for name, own in counts if own],
            "names": [*self.photos, *self.points],
        }
        return Phrase(f"datum.{self.kind}{'.scale' if scaled else ''}", fields)

    def __str__(self) -> str:
        return str(self.phrase)

    @property
    def is_chosen(self) -> bool:
        """Whether standard deviations depend on the choice of the datum."""
        return self.kind not in ("observations", "minimal control")

    @property
    def has_chosen_scale(self) -> bool:
        """Whether only the datum defines lengths."""
        return self.scale or (self.kind == "minimum constraints" and holds_scale(self.held))

    def document(self) -> dict[str, Any]:
        return {
            "kind": self.kind,
            "held": [{"photo": photo, "unknown": unknown} for photo, unknown in self.held],
            **{name: list(getattr(self, name)) for name in ("points", "photos", "attitudes")},
            "scale": self.scale,
        }


def holds_scale(held: Sequence[tuple[str, str]]) -> bool:
    """Whether exactly one coordinate of a photo or coefficient fixes the scale."""
    names = [name for name, _ in held]
    return any(names.count(name) == 1 and not unknown.startswith(TURNS) for name, unknown in held)


def held_unknowns(held: Sequence[tuple[str, str]]) -> list[Phrase]:
    """Return fixed unknowns with their photos, grouped by name."""
    photos = by_key((unknown, photo) for photo, unknown in held)
    return [
        Phrase("datum.held", {"unknown": Phrase(f"axis.{unknown}"), "photos": own})
        for unknown, own in photos.items()
    ]


def datum_of(
    block: Block,
    solution: _photocore.BlockSolution,
    row: DatumRow | None = None,
    *,
    held: Sequence[tuple[int, int]] | None = None,
) -> ResultDatum:
    """Return the datum of a solution: of inner constraints, or of fixed unknowns."""
    names = photo_components(block)
    own = tuple((block.photo_ids[photo], names[unknown]) for photo, unknown in sorted(solution.datum))
    for number, component in sorted(solution.datum_unknowns):  # Of coefficients of trajectories
        each = block.unknowns[number]
        turn = "rotation " if isinstance(each, RotationCoefficient) else ""
        own += ((each.name, turn + each.components[component]),)
    if row is None:
        given = "minimal control" if solution.minimal_control else "observations"
        return ResultDatum("minimum constraints" if own else given, own)
    name, points, photos, scale, attitudes, _ = row
    used = solution.point_rays > 0
    of_whole = own if held is None else [(str(photo), names[unknown]) for photo, unknown in held]
    return ResultDatum(
        kind="inner constraints" if name == "inner" else name,
        held=own,
        points=tuple(block.point_ids[point] for point in points if used[point]),
        photos=tuple(block.photo_ids[photo] for photo in photos),
        scale=scale and holds_scale(of_whole),
        lost=solution.relative_error,
        attitudes=tuple(block.photo_ids[photo] for photo in attitudes),
        row=row,
    )


def datum_messages(block: Block, datum: ResultDatum, point_rays: np.ndarray) -> list[Message]:
    """Return messages on the datum, or the photo weights, of a block without control."""
    messages = []
    if datum.lost > NOTABLE_LOSS:
        messages.append(Message(phrase("free.rounding", share=datum.lost)))
    if datum.kind in ("inner constraints", "relative"):
        code = f"free.{datum.kind.partition(' ')[0]}"
        return [Message(phrase(code, datum=datum.phrase)), *messages]
    if datum.kind == "minimum constraints":
        fixed, kinds = held_unknowns(datum.held), {type(each) for each in block.observations}
        scale, levels = [] if Distance in kinds else ["scale"], list[Phrase]()
        beyond, kinds = len(datum.held) - 4 - len(scale), kinds - {Distance}
        # Motions that a plumb line or equal heights leave undetermined.
        if kinds == {OnPlumbLine} and beyond in (0, -2):
            motions = ["place", "azimuth"] if beyond == 0 else ["turn", "shift"]
            levels = [phrase("free.plumb-line", motions=[phrase(f"free.{name}") for name in motions + scale])]
        elif kinds == {EqualHeight} and beyond == 1:
            levels = [phrase("free.equal-heights")]
        return [Message(phrase("free.minimum", fixed=fixed, levels=levels[0] if levels else ""))]
    if datum.kind == "minimal control":
        return [Message(phrase("free.minimal-control"))]
    held = np.isfinite(block.point_sd) & (point_rays > 0)[:, np.newaxis]
    if held.any() or block.observations or (block.photo_position_sd == 0).all():
        return []
    return [Message(phrase(f"free.weights.{'trajectories' if block.timed else 'photos'}"))]


def relative_datum(block: Block, photo: str | None, points: Sequence[str] | None) -> DatumRow:
    if (photo is None) == (points is None):
        raise InputError(phrase("error.exclusive", first="photo", second="points"))
    if photo is not None:
        require_name("photo", photo, block.photo_ids)
        return "relative", [], [block.photo_ids.index(photo)], False, [], None
    index = {name: i for i, name in enumerate(block.point_ids)}
    for name in points or []:
        require_name("point", name, index)
    return "relative", [index[name] for name in points or []], [], False, [], None


def refused(
    block: Block, network: _photocore.BlockNetwork, state: _photocore.BlockState | None, error: Failure
) -> AdjustmentError | InputError:
    kind, message, _, points, *_ = error.args
    if kind == "left out":
        return InputError(phrase("free.left-out", point=block.point_ids[points[0]]))
    if kind == "datum":
        return InputError(phrase("free.few"))
    if kind == "not free":
        state = network.adjust(datum=None, threads=0, progress=None).state if state is None else state
        resistance = sorted(network.resistance(state, threads=0), key=lambda each: -each[1])
        parts = [phrase("free.part", kind=kind, share=share) for kind, share in resistance]
        return AdjustmentError(phrase("free.not-free", kinds=parts))
    return failure_of_core(kind, message)


MOST = 1000  # Largest number of check points in the joint test; of more points a regular subset is used


@dataclass(frozen=True, eq=False)
class CheckPoints:
    rows: Indices  # (k,) among all points
    names: tuple[str, ...]  # Names of the points
    differences: Floats  # (k, 3) adjusted minus given, in the units of the block; NaN if not given
    sd: Floats  # (k, 3) standard deviations of the adjusted coordinates
    # (k, 3) standard deviations of the given coordinates; assumed values if none were given
    given_sd: Floats
    assumed: Bools  # (k,) whether the given deviations are assumed
    untested: Phrase | None  # Reason for a missing test; None with a test
    agreement: Agreement | None = None  # Tests, if any


def check_points(result: Result) -> CheckPoints:
    """Return the check points of a result with single and joint tests.

    Blocks that were adjusted in parts lack covariances between points, and therefore a joint test.
    """
    block = result.block
    rows = np.flatnonzero(result.used_points & (result.point_kinds == "check"))
    differences = result.point_differences[rows]
    obstacles = {
        "none": not len(rows),
        "datum": result.datum.is_chosen,
        "fixed": not result.photo_given_sd.any(),
        "not-converged": not result.converged,
        "no-covariances": not np.isfinite(result.point_cofactors[rows]).all(),
    }
    untested = next((Phrase(f"untested.checks-{code}") for code, holds in obstacles.items() if holds), None)
    names, sd = tuple(block.point_ids[row] for row in rows.tolist()), result.point_sd[rows]
    given = np.full((len(rows), 3), math.nan) if block.point_check_sd is None else block.point_check_sd[rows]
    lacking: Bools = np.asarray((np.isnan(given) & np.isfinite(differences)).any(axis=1))
    # Standard deviations of observations are lengths, also in geographic blocks.
    observed = [] if block.geographic else block.observations.of_type(Control)
    every = np.vstack([block.point_sd, *(np.sqrt(np.diag(each.precision)) for each in observed)])
    assumed = [np.median(held) if (held := column[np.isfinite(column)]).size else 0.0 for column in every.T]
    given = np.asarray(np.where(np.isnan(given), assumed, given))
    found = CheckPoints(rows, names, differences, sd, given, lacking, untested)
    return found if untested else replace(found, agreement=_agreement(result, found))


def _agreement(result: Result, found: CheckPoints) -> Agreement:
    from photogram.results.network_tables import point_axes  # few blocks have check points
    from photogram.statistics.agreement import agreement
    from photogram.statistics.evidence import SUSPECT

    survey = np.zeros((len(found.rows), 3, 3))
    survey[:, range(3), range(3)] = found.given_sd**2
    scale, freedom = result.covariance_scale, result.freedom_of_scale
    some = together(len(found.rows))

    def tested(cofactors: Floats, some: slice = slice(None)) -> Agreement:
        names, differences = found.names[some], found.differences[some]
        return agreement(
            differences,
            cofactors,
            survey[some],
            scale=scale,
            second=freedom,
            level=SUSPECT,
            name=partial(_named, names),
            apart=partial(_apart, differences, point_axes(result.block)),
        )

    joint = result.state.joint(found.rows[some].tolist()) if result.WHOLE else None
    if joint is None and result.WHOLE:
        # Not enough memory, or singular by rounding: single tests remain.
        with suppress(AdjustmentError):
            joint = result.covariance(("point", found.names[some])) / result.covariance_scale
    if joint is None:
        return tested(result.point_cofactors[found.rows])
    every = tested(joint, some)
    if len(survey) <= MOST:
        return every
    return replace(tested(result.point_cofactors[found.rows]), together=every.together)


def _named(names: tuple[str, ...], place: tuple[int, ...]) -> str:
    """Return the name of a point; module-level, so that results can be pickled."""
    return names[place[0]]


def together(count: int) -> slice:
    """Return the slice of check points that are tested jointly."""
    return slice(None, None, -(-count // MOST) or None)


def tested_together(block: Block) -> list[int]:
    """Return the points whose joint cofactors this test requires, if all take part."""
    rows = np.flatnonzero(point_kinds(block) == "check")
    chosen: list[int] = rows[together(len(rows))].tolist()
    return chosen


def point_kinds(block: Block) -> NDArray[np.str_]:
    """Return (n,) types: `control` if observed, `check` if known only, else `pass`."""
    held: Bools = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    held[observed_control(block)] = True
    known = np.isfinite(block.point_positions).any(axis=1)
    return np.where(held, "control", np.where(known, "check", "pass"))


def given_control(block: Block) -> tuple[Floats, Floats]:
    """Return (n, 3) given positions and standard deviations, also of jointly observed control."""
    positions, sd = block.point_positions.copy(), block.point_sd.copy()
    for each in block.observations.of_type(Control):
        row = block._point_rows[each.point]
        positions[row], sd[row] = each.observed, np.sqrt(np.diagonal(each.precision))
    return positions, sd


def observed_control(block: Block) -> list[int]:
    """Return the control points with an observed covariance matrix."""
    names = {each.point for each in block.observations.of_type(Control)}
    return [row for row, name in enumerate(block.point_ids) if name in names] if names else []


def _apart(
    differences: Floats, axes: tuple[Axis, ...], place: tuple[int, ...], sd: Floats
) -> dict[str, float | str | Phrase]:
    """Return the distance of a point in the component with the largest test value."""
    own = differences[place[0]]
    with np.errstate(all="ignore"):
        k = int(np.nanargmax(np.abs(own) / np.where(sd > 0, sd, 1e-300)))
    axis = axes[k]
    sizes = {"difference": float(own[k] * axis.factor), "sd": float(sd[k] * axis.factor)}
    return {**sizes, "unit": axis.small, "axis": Phrase(f"axis.{axis.name}")}
