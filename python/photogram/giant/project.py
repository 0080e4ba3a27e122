"""A GIANT project: five files, converted to a block and back."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.arguments.arrays import truth_value
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.giant.assembly import assemble
from photogram.giant.common import Common, common_records, parse_common
from photogram.giant.contents import (
    Camera,
    Frame,
    GroundPoint,
    ImageFrame,
    camera_records,
    frame_records,
    ground_records,
    image_records,
    parse_cameras,
    parse_frames,
    parse_ground,
    parse_images,
)
from photogram.giant.export import block_files
from photogram.giant.fields import parse_name
from photogram.giant.files import NAMES, find_files, present_files, to_bytes, written
from photogram.giant.limits import Limits
from photogram.giant.records import Source
from photogram.io.writing import write_whole
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message
from photogram.network.block import Block
from photogram.summaries import Brief, Rows, few
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.diagnosis import Diagnosis


@dataclass(repr=False)
class Project(Brief):
    """The content of a GIANT project, with conversion to a block and back."""

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

    def _check(self, threads: int | None) -> Diagnosis:
        from photogram.giant.checking import check

        return check(self, threads=threads)

    def to_block(self, limits: Limits | None = None) -> Block:
        """Return the block of a project (GIANT guide, sections II.B and III).

        Remarks are added to `messages`, once each.

        Parameters
        ----------
        limits
            The installation parameters of the 1987 program; default: no limits.

        Raises
        ------
        InputError
            If images of a frame, a camera, or all frames are missing, or a limit is exceeded.
        """
        block, messages = assemble(self, limits)
        known = set(self.messages)
        self.messages += [message for message in messages if message not in known]
        return block

    @classmethod
    def from_block(cls, block: Block, common: Common | None = None) -> Project:
        """Return the project of a block.

        Infinite standard deviations of stations become the (weak) defaults of the guide; points with a known
        component are written to GROUND, with unheld components in their type codes. Written numbers are
        rounded to their columns: at least 4 decimals of the second for longitudes and latitudes, 5 decimals
        of the millimetre for image coordinates.

        Parameters
        ----------
        block
            The block.
        common
            Switches of the job; title, object space, sense of rotation and spheroid are taken from the
            block. Default: error propagation is requested.

        Raises
        ------
        InputError
            If GIANT files cannot contain a part of the block: fixed values, different standard deviations
            within a photo, other observations than image observations.
        """
        return cls(*block_files(block, common))


def read_project(directory: str | os.PathLike[str]) -> Project:
    """Read the five files of a directory, in any letter case and with any extension.

    Raises
    ------
    InputError
        If a file is missing or ambiguous, or a record cannot be read. The error names file, record number and
        record.
    """
    directory = path_of("directory", directory)
    files = find_files(directory)
    sources = [Source.read(files["COMMON"])]
    common = parse_common(sources[0])

    def source(name: str) -> Source:
        sources.append(Source.read(files[name], common.strip))
        return sources[-1]

    project = Project(
        common=common,
        cameras=parse_cameras(source("CAMERAS")),
        frames=parse_frames(source("FRAMES"), common.geographic),
        images=parse_images(source("IMAGES")),
        ground=parse_ground(source("GROUND"), common.geographic),
        directory=directory,
    )
    project.messages += [message for each in sources for message in each.messages]
    return project


def project_files(project: Project, directory: Path, *, overwrite: bool = False) -> dict[Path, bytes]:
    """Return the five files of a project that :func:`write_project` writes."""
    texts = project.records()
    targets = {name: directory / name for name in NAMES}
    if directory.exists():
        files = present_files(directory)
        if not overwrite and (names := [path.name for present in files.values() for path in present]):
            raise InputError(phrase("giant.overwrite", names=names), file=directory)
        for name, present in files.items():
            if len(present) > 1:
                names = [path.name for path in present]
                raise InputError(phrase("giant.several", name=name, names=names), file=directory)
            targets[name] = next(iter(present), targets[name])
    return {targets[name]: to_bytes(records) for name, records in texts.items()}


def write_project(project: Project, directory: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write the five files to a directory, each complete or absent.

    Parameters
    ----------
    project
        The project.
    directory
        Output directory.
    overwrite
        If True, existing input files may be replaced, in any spelling of their names.

    Raises
    ------
    InputError
        If a value does not fit its field, or files exist and `overwrite` is False.
    OSError
        If the files cannot be written.
    """
    truth_value("overwrite", overwrite)
    write_whole(project_files(project, path_of("directory", directory), overwrite=overwrite))
