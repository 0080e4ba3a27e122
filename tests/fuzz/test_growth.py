"""That memory does not grow with adjustments: a short run of what the page tells."""

import photogram
from fuzz.growth import growth


def test_adjustments_leave_nothing_behind():
    block = photogram.simulate(strips=1, photos_per_strip=4, points_per_photo=20, seed=1).block
    before, after = growth(lambda: photogram.adjust(block).report(), 60)
    assert after - before < 8 << 20
    kept = []
    before, after = growth(lambda: kept.append(bytearray(b"x" * (1 << 20))), 60)
    assert after - before > 40 << 20
