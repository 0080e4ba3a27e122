"""A project: a block with additional contents of its files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np

from photogram.adjustment.options import AdjustOptions
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.messages import Message
from photogram.network.block import Block
from photogram.network.geometry import Frame as Frame
from photogram.results.features import Definition
from photogram.summaries import Brief
from photogram.targets.board import Board
from photogram.words import Phrase, phrase

Size = tuple[int, int]  # Image width and height of a camera, pixels


def frame_of(block: Block) -> Frame:
    """Return the frame of a block; of kind geographic if the block has a spheroid."""
    if block.spheroid is not None and block.frame.kind == "cartesian":
        return replace(block.frame, kind="geographic", ellipsoid=(block.spheroid.a, block.spheroid.b))
    return block.frame


@dataclass(frozen=True, eq=False)
class Repeated:
    """Repeated observations of points in photos; the block contains the first ones."""

    photos: tuple[str, ...] = ()  # k names of each
    points: tuple[str, ...] = ()
    # (k, 2) image coordinates, in the unit of the block
    xy: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, eq=False)
class Unused(Repeated):
    """Omitted image observations of a board (`use` = `off`)."""

    # (k, 2) standard deviations of image coordinates, in the unit of the block
    sd: Floats = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Project(Brief):
    """A block with the additional contents of its files.

    Attributes
    ----------
    block
        The block to adjust. Points that are neither control nor check points do not have a position in it.
    path
        File or folder of the project.
    title
        The format, for users.
    sizes
        Image width and height of each camera of the block, pixels; None if unknown (default).
    pixel_mm
        The side of a pixel of each camera in millimetres; None if unknown (default).
    starts
        (n, 3) positions of the points of the block in the file; NaN without. None: those of the block.
    frame
        Reference frame of the coordinates; also in the block, and in its results.
    options
        Adjustment settings.
    lacks
        Missing or assumed data for an adjustment, with the option that adds them.
    messages
        Remarks on omitted, corrected or doubtful data.
    details
        Data for the writer of the same format; other formats ignore them.
    sd_taken
        Whether the reader has applied user-defined standard deviations of image coordinates, in the unit of
        the files.
    repeated
        Omitted repeated observations of points in photos.
    features
        Features to fit to adjusted points, as arguments of :func:`photogram.features`.
    statement
        Settings of its accuracy statement, as arguments of :meth:`photogram.Result.statement`.
    boards
        Boards whose points are the control, by name.
    unused
        Omitted image observations of the board.
    tracks
        Points whose names are numbers of tracks. A list of control points has other names.
    control_crs
        Coordinate reference system of the control, if it is not the frame.
    """

    block: Block
    path: Path
    title: str
    sizes: tuple[Size | None, ...] = ()
    pixel_mm: tuple[float | None, ...] = ()
    starts: Floats = None  # type: ignore[assignment]  # Positions of the block if missing
    frame: Frame = field(default_factory=Frame)
    options: AdjustOptions = field(default_factory=AdjustOptions)
    lacks: tuple[Phrase, ...] = ()
    messages: tuple[Message, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    sd_taken: bool = False
    repeated: Repeated = field(default_factory=Repeated)
    features: Mapping[str, Definition] = field(default_factory=dict)
    statement: Mapping[str, Any] = field(default_factory=dict)
    boards: Mapping[str, Board] = field(default_factory=dict)
    unused: Unused = field(default_factory=Unused)
    tracks: frozenset[str] = frozenset()
    control_crs: str = ""

    def __post_init__(self) -> None:
        given, unknown = self.block.in_frame(self.frame), (None,) * len(self.block.cameras)
        object.__setattr__(self, "sizes", self.sizes or unknown)
        object.__setattr__(self, "pixel_mm", self.pixel_mm or unknown)
        if self.starts is None:
            object.__setattr__(self, "starts", np.array(given.point_positions))
        object.__setattr__(self, "frame", frame_of(given))
        if (self.frame.kind == "geographic") != given.geographic:
            space = "geographic" if given.geographic else "rectangular: it has no spheroid"
            raise InputError(phrase("plain.frame-of-block", frame=self.frame.kind, space=space))
        if self.block.frame != self.frame:
            object.__setattr__(self, "block", self.block.in_frame(self.frame))

    def replace(self, **changes: Any) -> Self:
        """Return a project with some members replaced."""
        return replace(self, **changes)

    @property
    def checks(self) -> list[int]:
        """Check points: points with a known position and only free coordinates."""
        block = self.block
        known = np.isfinite(block.point_positions).any(axis=1) & ~np.isfinite(block.point_sd).any(axis=1)
        return [int(row) for row in np.flatnonzero(known)]

    def positions(self) -> Floats:
        """Return (n, 3) positions of control and check points, else from the file."""
        known = self.block.point_positions
        return np.where(np.isnan(known), self.starts, known)
