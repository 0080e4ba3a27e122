"""Messages on the datum of coordinates and standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from photogram import _photocore
from photogram.arguments.objects import require_name
from photogram.errors import AdjustmentError, InputError, failure_of_core
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.datum import DatumRow
from photogram.network.observations import Distance, EqualHeight, OnPlumbLine
from photogram.network.tables import ATTITUDE_COLUMNS
from photogram.network.trajectories import RotationCoefficient
from photogram.results.covariance import Failure, photo_components
from photogram.words import Phrase, phrase

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
    photos: dict[str, list[str]] = {}
    for photo, unknown in held:
        photos.setdefault(unknown, []).append(photo)
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
        fixed, levels = held_unknowns(datum.held), _levelled(block, len(datum.held))
        return [Message(phrase("free.minimum", fixed=fixed, levels=levels or ""))]
    if datum.kind == "minimal control":
        return [Message(phrase("free.minimal-control"))]
    held = np.isfinite(block.point_sd) & (point_rays > 0)[:, np.newaxis]
    if held.any() or block.observations or (block.photo_position_sd == 0).all():
        return []
    return [Message(phrase(f"free.weights.{'trajectories' if block.timed else 'photos'}"))]


def _levelled(block: Block, held: int) -> Phrase | None:
    """Return motions that a plumb line or equal heights leave undetermined."""
    kinds = {type(each) for each in block.observations}
    scale = [] if Distance in kinds else ["scale"]
    beyond, kinds = held - 4 - len(scale), kinds - {Distance}
    if kinds == {OnPlumbLine} and beyond in (0, -2):
        motions = ["place", "azimuth"] if beyond == 0 else ["turn", "shift"]
        return phrase("free.plumb-line", motions=[phrase(f"free.{name}") for name in motions + scale])
    return phrase("free.equal-heights") if kinds == {EqualHeight} and beyond == 1 else None


def relative_datum(block: Block, photo: str | None, points: Sequence[str] | None) -> DatumRow:
    """Return the reference of relative cofactors for the core."""
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
