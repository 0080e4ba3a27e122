"""The figures of docs/self-calibration.md: `python docs/regenerate.py self-calibration.md` writes them.

Those of the Roma photos need the data set beside the repository (../shared/data/roma).
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "examples"), str(ROOT / "tests")]

import self_calibration  # noqa: E402  # found only now

import test_roma  # noqa: E402
from photogram import Result  # noqa: E402

ROMA = ROOT.parent / "shared" / "data" / "roma"
VARIANTS: dict[str, tuple[tuple[str, ...], dict[str, float], str]] = {
    "c, xp, yp, K1, K2": (("c", "xp", "yp", "K1", "K2"), {}, "0.582769"),
    "and b1, K3, P1, P2": (("c", "xp", "yp", "b1", "K1", "K2", "K3", "P1", "P2"), {}, "0.566548"),
    "none, b1 = 0.000998889": ((), {"b1": 0.000998889}, "0.623075"),
}


def example() -> list[str]:
    """Return what the example prints."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        self_calibration.main()
    return printed.getvalue().splitlines()


def roma() -> list[str] | None:
    """Return what becomes of the Roma photos and the camera of the first variant; None without them."""
    if not ROMA.is_dir():
        return None
    block = test_roma.read(ROMA)
    lines = [f"{'free':<26}{'sigma0':>10}{'report':>10}{'redundancy':>12}{'iterations':>12}"]
    results: list[Result] = []
    for name, (free, given, reported) in VARIANTS.items():
        result = test_roma.adjusted(block, *free, **given)
        results.append(result)
        assert result.variance_of_unit_weight is not None
        lines.append(
            f"{name:<26}{np.sqrt(result.variance_of_unit_weight):>10.6f}{reported:>10}"
            f"{result.degrees_of_freedom:>12}{len(result.iterations):>12}"
        )
    camera = results[0].cameras[0]
    lines += ["", f"{'parameter':<26}{'value':>14}{'sd':>12}"]
    lines += [
        f"{f'{camera.names[k]} {camera.camera.unit_of(camera.names[k])}'.strip():<26}"
        f"{camera.values[k]:>14.6g}{camera.sd[k]:>12.3g}"
        for k in camera.estimated
    ]
    return lines


BLOCKS: dict[str, Callable[[], list[str] | None]] = {"example": example, "roma": roma}
