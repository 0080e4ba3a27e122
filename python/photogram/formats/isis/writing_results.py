"""What stands beside an adjusted control network: jigsaw's tables, the network, support data."""

from __future__ import annotations

from collections.abc import Mapping

from photogram.formats.isis.bundleout import bundleout
from photogram.formats.isis.contents import contents_of
from photogram.formats.isis.csv_files import csv_files
from photogram.formats.isis.outcome import Outcome
from photogram.formats.isis.reading import is_binary
from photogram.formats.isis.support import updated_support
from photogram.formats.isis.updated import updated_network
from photogram.formats.isis.writing import binary_network, network_text
from photogram.formats.project import Project
from photogram.results.result import Result

__all__ = ["results"]


def results(project: Project, result: Result) -> Mapping[str, bytes]:
    """Return the files of an adjusted network by their names.

    Raises
    ------
    InputError
        Tables of support data that no records can stand for.
    """
    outcome = Outcome(contents_of(project.details), result)
    path, network = outcome.contents.path, updated_network(outcome)
    files = {**csv_files(outcome), "bundleout.txt": bundleout(outcome)}
    files[path.name] = (binary_network if is_binary(path) else network_text)(network)
    names: dict[str, int] = {}
    for image in outcome.contents.different:
        content = updated_support(image, result.trajectories[image.solving.trajectory.name])
        if content is None:
            continue
        count = names[image.path.name] = names.get(image.path.name, 0) + 1
        folder = "support" if count == 1 else f"support-{count}"
        files[f"{folder}/{image.path.name}"] = content
    return files
