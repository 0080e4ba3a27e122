"""The content of the five files of a GIANT project."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from photogram.errors import InputError
from photogram.giant.common import Common, common_records
from photogram.giant.fields import parse_name
from photogram.giant.files import written
from photogram.giant.frames import Camera, Frame, camera_records, frame_records
from photogram.giant.ground import GroundPoint, ground_records
from photogram.giant.images import ImageFrame, image_records
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.summaries import Brief, Rows, few
from photogram.words import phrase


@dataclass(repr=False)
class Contents(Brief):
    """The content of the five files."""

    common: Common  # The files, each with its own names and units (see their classes)
    cameras: list[Camera]
    frames: list[Frame]
    images: list[ImageFrame]
    ground: list[GroundPoint]
    # Remarks of the reader, and of the conversion to a block
    messages: list[Message] = field(default_factory=list)
    directory: Path | None = None  # Folder of the files, if they were read

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the project: title, and numbers of records."""
        rows = [
            ("cameras", f"{len(self.cameras):,}"),
            ("frames", few([each.name for each in self.frames])),
            ("images", f"{sum(len(each.points) for each in self.images):,} on {len(self.images):,} frames"),
            ("ground", f"{len(self.ground):,} points"),
            ("messages", f"{len(self.messages):,}"),
            ("directory", str(self.directory) if self.directory else "none"),
        ]
        return f"GIANT project: {self.title.strip()}", rows

    @property
    def title(self) -> str:
        """Record 1 of COMMON."""
        return self.common.title

    def records(self) -> dict[str, list[str]]:
        """Return the records of the five files by name.

        Raises
        ------
        InputError
            If a value does not fit its field, or a name would lose its first character.
        """
        geographic, strip = self.common.geographic, self.common.strip
        if strip:
            names = {camera.name for camera in self.cameras} | {frame.name for frame in self.frames}
            names |= {frame.name for frame in self.images} | {frame.camera for frame in self.images}
            names |= {name for frame in self.images for name in frame.points}
            names |= {point.name for point in self.ground}
            # Stripping would change the name.
            for name in sorted(names):
                if parse_name(name, strip) != name:
                    raise InputError(phrase("giant.stripped-name", name=name, strip=strip))
        writers: dict[str, Callable[[], list[str]]] = {
            "COMMON": lambda: common_records(self.common),
            "CAMERAS": lambda: camera_records(self.cameras),
            "IMAGES": lambda: image_records(self.images),
            "FRAMES": lambda: frame_records(self.frames, geographic),
            "GROUND": lambda: ground_records(self.ground, geographic),
        }
        return {name: written(name, writer) for name, writer in writers.items()}
