"""What the sides need, so that those that cannot run are left out."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec

import apex_block
from runs import package

MODULES = {"gtsam": ("gtsam",), "pycolmap": ("pycolmap", "pyceres"), "symforce": ("symforce",)}


def lacking(side: str) -> str:
    """Return what a side needs and is not installed; nothing where it can run.

    The program of apex-solver is built for that: at first it takes minutes.
    """
    if package(side) == "apex-solver":
        return "" if apex_block.build() else "a cargo that can build it"
    return " and ".join(module for module in MODULES.get(package(side), ()) if find_spec(module) is None)


def left_out(sides: Iterable[str]) -> dict[str, str]:
    """Return a line for every side that cannot run."""
    missing = {side: lacking(side) for side in sides}
    return {side: f"* {side} is left out: {what} is not installed." for side, what in missing.items() if what}
