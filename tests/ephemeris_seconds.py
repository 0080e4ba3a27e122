"""Line times as programs have them that add them to ephemeris seconds, which have 6e-8 s: 3e-5 of a line."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from photogram.network import Lines


@contextmanager
def added_to_ephemeris_seconds() -> Iterator[None]:
    """Have the times of lines rounded so."""
    exact = Lines.times

    def rounded(self: Lines, lines: np.ndarray, start: float = 0.0) -> np.ndarray:
        return exact(self, lines) - start

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Lines, "times", rounded)
        yield
