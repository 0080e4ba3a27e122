"""Adjustment in parts (Helmert blocking): on a Dask cluster, or one part after the other."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from photogram.distributed.adjust import adjust_in_parts, plan_in_parts
    from photogram.distributed.division import Division
    from photogram.distributed.planned import PartsPlan

__all__ = ["Division", "PartsPlan", "adjust_in_parts", "plan_in_parts"]

_HOMES = {
    "Division": "division",
    "PartsPlan": "planned",
    "adjust_in_parts": "adjust",
    "plan_in_parts": "adjust",
}
"""The file of each name, loaded when it is first asked for: who takes one file of this folder waits for no other."""


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
