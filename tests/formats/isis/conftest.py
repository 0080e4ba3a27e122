"""The simulated pair of `examples/planetary_pair.py`."""

from dataclasses import replace
from pathlib import Path

import pytest

from example_scripts import load
from photogram import formats
from photogram.formats import ReadOptions
from photogram.formats.isis import network_text, read_network


class Pair:
    """Its folder, its true points, and projects made of it."""

    def __init__(self, folder):
        self.folder = folder
        self.truth = load("planetary_pair").simulate(folder)

    @property
    def network(self):
        """Read the network."""
        return read_network(self.folder / "pair.net")

    def project(self, jigsaw="settings.txt", network=None, **own):
        """Read the pair with other settings, or another network."""
        path = self.folder / "pair.net"
        if network is not None:
            path = own.get("path", self.folder / "other.net")
            path.write_bytes(own.get("written", network_text)(network))
        if jigsaw and "=" not in jigsaw:
            jigsaw = str(self.folder / jigsaw)
        return formats.read(path, ReadOptions(cubes=self.folder / "images.lis", jigsaw=jigsaw))

    def with_points(self, **columns):
        """Return the network with other columns of its points."""
        network = self.network
        return replace(network, points=replace(network.points, **columns))

    def with_measures(self, **columns):
        """Return the network with other columns of its measures."""
        network = self.network
        return replace(network, measures=replace(network.measures, **columns))


@pytest.fixture(scope="session")
def pair(tmp_path_factory):
    return Pair(Path(tmp_path_factory.mktemp("pair")))
