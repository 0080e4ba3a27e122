"""The registry of mistakes in whole sets of data.

Functions are imported when they are required, because most adjustments fit.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any, Literal

from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message

Stage = Literal["lens", "set", "data", "misfit", "fit"]
"""When a mistake is sought, and the arguments of the function.

`lens`, `set`: before gross errors, of a block and an adjuster; explained by adjustments.
`data`: of a block that cannot be adjusted or fits badly. `misfit`: the same, of a block and an adjuster.
`fit`: of a converged result."""


@dataclass(frozen=True)
class Mistake:
    """A type of mistakes: the kind of its findings, and the function that searches for it."""

    kind: str
    stage: Stage
    search: str  # Module and function
    unless: tuple[str, ...] = ()  # Kinds that explain the same residuals
    of: str = "residuals"  # that it explains

    def __call__(self, *given: Any) -> Any:
        module, name = self.search.split(".")
        return getattr(import_module(f"photogram.diagnosis.{module}"), name)(*given)


REGISTRY = (
    Mistake("lens", "lens", "lenses.wrong_terms"),
    Mistake("observed-positions", "set", "sets.wrong_positions"),
    Mistake("control-set", "set", "sets.wrong_control", of="control-misfit"),
    Mistake("convention", "data", "conventions.hints"),
    Mistake("trajectory", "data", "trajectory_hints.flown_hints"),
    Mistake("readout", "misfit", "moving.readout_hints"),
    Mistake("backward-readout", "fit", "moving.backward_readouts"),
    Mistake("clock", "fit", "moving.known_offsets"),
    Mistake("seam", "fit", "films.seam_hints"),
    # A film in two pieces, or one that has changed along one axis, also makes marks fail.
    Mistake("axis", "fit", "films.axis_hints", unless=("seam",)),
    Mistake("marks", "fit", "films.mark_hints", unless=("seam", "axis")),
    Mistake("certificate", "fit", "lenses.certificate_hints"),
    Mistake("jitter", "fit", "films.line_hints"),
)


def at(stage: Stage) -> tuple[Mistake, ...]:
    return tuple(each for each in REGISTRY if each.stage == stage)


def hints_at(stage: Stage, *given: Any) -> list[Message]:
    found: dict[str, list[Message]] = {}
    for each in at(stage):
        if not any(found.get(kind) for kind in each.unless):
            found[each.kind] = each(*given)
    return [message for messages in found.values() for message in messages]
