"""A block for the first steps of a check: straight rays without distortion."""

from __future__ import annotations

from typing import Self

import numpy as np

from photogram.diagnosis.mistakes import Change
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.block import Block
from photogram.network.motion import kept_images
from photogram.network.rays import seen_without_lenses


@dataclass(frozen=True, eq=False)
class View:
    """A block and its observations without lens distortion."""

    block: Block  # The block to adjust, without observations that no camera can have made
    # Without distortion, and without photos on frames, which lack poses of their own. Photos and points are
    # the same as in `block`
    seen: Block

    @classmethod
    def of(cls, block: Block) -> Self:
        """Return the view of a block whose photos have poses."""
        if not block.cameras and not block.mounts:
            return cls(block, block)
        plain, visible = seen_without_lenses(block)
        block = block if visible.all() else kept_images(block, np.flatnonzero(visible))
        mounted = np.isin(block.photo_ids, [each.photo for each in block.mounts])
        rows = np.flatnonzero(~mounted[block.image_photos])
        return cls(block, kept_images(plain.replace(mounts=()), rows))

    def changed(self, change: Change) -> Self:
        """Return the view of the corrected block.

        If image coordinates change for cameras with lenses, the new block has no lenses, because distortions
        would not fit.
        """
        meant = change(self.seen)
        if meant is self.seen:
            return self
        same = meant.image_xy is self.seen.image_xy or np.array_equal(meant.image_xy, self.seen.image_xy)
        same = same and np.array_equal(meant.known_distances("checks"), self.seen.known_distances("checks"))
        if self.seen is self.block or not same:
            return replace(self, block=meant, seen=meant)
        return replace(self, block=change(self.block), seen=meant)
