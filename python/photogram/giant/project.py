"""A GIANT project: five files in a directory, read, written and turned into a block."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.errors import InputError
from photogram.giant.assembly import assemble
from photogram.giant.common import Common, parse_common
from photogram.giant.contents import Contents
from photogram.giant.export import block_files
from photogram.giant.files import NAMES, find_files, present_files, to_bytes
from photogram.giant.frames import parse_cameras, parse_frames
from photogram.giant.ground import parse_ground
from photogram.giant.images import parse_images
from photogram.giant.limits import Limits
from photogram.giant.records import Source
from photogram.io.writing import write_whole
from photogram.network.block import Block
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.diagnosis import Diagnosis


class Project(Contents):
    """A project: the content of the five files, and the way to a block and back."""

    def _check(self, threads: int | None) -> Diagnosis:
        from photogram.giant.checking import check

        return check(self, threads=threads)

    def to_block(self, limits: Limits | None = None) -> Block:
        """Return the block: apply the rules that hold between files (GIANT guide, sections II.B and III).

        Remarks are added to `messages`, once each.

        Parameters
        ----------
        limits
            The installation parameters of the 1987 program; by default there are none.

        Raises
        ------
        InputError
            A frame without images, a camera that is not defined, no frame at all, or a limit that is
            exceeded.
        """
        block, messages = assemble(self, limits)
        known = set(self.messages)
        self.messages += [message for message in messages if message not in known]
        return block

    @classmethod
    def from_block(cls, block: Block, common: Common | None = None) -> Project:
        """Return the project of a block.

        Infinite standard deviations of stations become the (weak) defaults of the guide; points with a known
        component go to GROUND, with the components that are not held in their type codes. Numbers are kept as
        far as the columns go when the project is written: at least 4 decimals of the second for longitudes
        and latitudes, 5 decimals of the millimetre for image coordinates.

        Parameters
        ----------
        block
            The block.
        common
            Switches of the job; title, object space, sense of rotation and spheroid come from the block.
            Default: error propagation is asked for.

        Raises
        ------
        InputError
            Something that GIANT files cannot say: fixed values, different standard deviations within a photo,
            observations beside images.
        """
        return cls(*block_files(block, common))


def read_project(directory: str | os.PathLike[str]) -> Project:
    """Read the five files of a directory, in any letter case and with any extension.

    Raises
    ------
    InputError
        A file that is missing or ambiguous, or a record that cannot be read; it names file, record number and
        record.
    """
    directory = Path(directory)
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
    """Return the five files of a project as they would be written by :func:`write_project`."""
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
    """Write the five files into a directory, which is made if need be; each file whole or not at all.

    Parameters
    ----------
    project
        What to write.
    directory
        Where.
    overwrite
        Whether input files that are there already, under whatever spelling, may be replaced.

    Raises
    ------
    InputError
        A value that does not fit its field, or files that are there already.
    OSError
        The files cannot be written.
    """
    write_whole(project_files(project, Path(directory), overwrite=overwrite))
