"""Build the packaged example `collection`: eight simulated photos around sixty points.

python examples/make_collection.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogram.collection import simulate, to_bytes

EXAMPLE = Path(__file__).resolve().parents[1] / "python" / "photogram" / "examples" / "collection"
SEED = 2010


def main() -> None:
    """Write the example, with no more digits than the numbers deserve."""
    made = simulate(coarseness=2.0, seed=SEED).collection
    rounded = made.replace(
        photo_parameters=np.round(made.photo_parameters, 4),
        point_positions=np.round(made.point_positions, 3),
        image_xy=np.round(made.image_xy, 2),
    )
    (EXAMPLE / "ring.txt").write_bytes(to_bytes(rounded))


if __name__ == "__main__":
    main()
