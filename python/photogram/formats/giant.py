"""GIANT projects: five files of cards."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from photogram.adjustment.options import AdjustOptions
from photogram.errors import InputError, message_of
from photogram.formats.format import FORMATS
from photogram.formats.project import Project, frame_of
from photogram.formats.read_options import ReadOptions
from photogram.giant import Project as GiantProject
from photogram.giant import read_project
from photogram.giant.assembly import job_refraction
from photogram.giant.files import to_bytes
from photogram.messages import Message
from photogram.words import Phrase, phrase


def read(path: Path, options: ReadOptions) -> Project:
    """Read a project, with the refraction of its COMMON."""
    found = read_project(path)
    block = found.to_block().replace(refraction=job_refraction(found.common))
    messages = list(found.messages)
    if found.common.intersection_only:
        messages.append(Message.of("format.intersection", path))
    return Project(
        block=block,
        path=path,
        title=FORMATS["giant"].title,
        frame=frame_of(block),
        options=AdjustOptions(unit_variance=found.common.unbiased_variance),
        messages=tuple(messages),
    )


def write(project: Project) -> Mapping[str, bytes]:
    records = GiantProject.from_block(project.block).records()
    return {name: to_bytes(lines) for name, lines in records.items()}


def cannot_hold(project: Project) -> list[Phrase]:
    try:
        GiantProject.from_block(project.block)
    except InputError as error:
        return [phrase("lost.project", reason=message_of(error))]
    return [phrase("lost.giant-digits")]
