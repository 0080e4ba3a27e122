"""What a project asks of its accuracy statement, where its points or its format become others."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from photogram.messages import counted

__all__ = ["asked_by_other_names", "parts_of_asked", "with_cover"]


def with_cover(
    asked: Mapping[str, Any], points: Collection[str], vegetated: frozenset[str]
) -> dict[str, Any]:
    """Return what is asked where a table says of some points which of them lie in vegetation."""
    rest = {name: own for name, own in asked.items() if name != "vegetated"}
    every = asked.get("vegetated", frozenset()).difference(points) | vegetated
    return {**rest, "vegetated": every} if every else rest


def asked_by_other_names(asked: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """Return what is asked where points have other names.

    Parameters
    ----------
    asked
        As :meth:`photogram.Result.statement` takes it.
    names
        The new name of each point.
    """
    found = dict(asked)
    if "vegetated" in found:
        found["vegetated"] = frozenset(names.get(each, each) for each in found["vegetated"])
    if "without" in found:
        found["without"] = {names.get(each, each): reason for each, reason in found["without"].items()}
    if "lengths" in found:
        found["lengths"] = tuple(
            {**each, **{end: names.get(each[end], each[end]) for end in ("from", "to")}}
            for each in found["lengths"]
        )
    if "budgets" in found:
        found["budgets"] = tuple(_quantity(each, names) for each in found["budgets"])
    return found


def _quantity(asked: str, names: Mapping[str, str]) -> str:
    """Return `point C08 z` or `distance C01 C30` with other names, which may have blanks in them."""
    kind, *words = asked.split()
    if kind == "point" and (point := " ".join(words[:-1])) in names:
        return f"point {names[point]} {words[-1]}"
    if kind == "distance":
        for cut in range(1, len(words)):
            ends = " ".join(words[:cut]), " ".join(words[cut:])
            if names.keys() >= set(ends):
                return f"distance {names[ends[0]]} {names[ends[1]]}"
    return asked


def parts_of_asked(asked: Mapping[str, Any]) -> list[str]:
    """Return what it consists of, for people."""
    found = []
    if asked.keys() - {"lengths", "vegetated"}:
        found.append("what is asked of an accuracy statement")
    if asked.get("lengths"):
        found.append(counted(len(asked["lengths"]), "calibrated length"))
    if asked.get("vegetated"):
        found.append(f"vegetation about {counted(len(asked['vegetated']), 'check point')}")
    return found
