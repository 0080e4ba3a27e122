"""The pair of the Lunar Reconnaissance Orbiter as a control network with a list of its images."""

import json
from dataclasses import replace

import numpy as np

from golden_data import SHARED
from photogram import formats
from photogram.formats import ReadOptions
from photogram.formats.isis import network_text, read_network

LRO = SHARED / "moving" / "lro"
SIDES = ("L", "R")
SERIAL = "LRO/1/269182000:51104/NAC"
WEIGHTED = (
    "CamSolve=all CKDEGREE=2 CKSOLVEDEGREE=3 twist=yes CAMERA_ANGLES_SIGMA=0.1"
    " CAMERA_ANGULAR_VELOCITY_SIGMA=0.1 CAMERA_ANGULAR_ACCELERATION_SIGMA=0.1"
    " RADIUS=yes POINT_LATITUDE_SIGMA=2000 POINT_LONGITUDE_SIGMA=2000 POINT_RADIUS_SIGMA=500"
)


def answers():
    """Return what is published and computed of the pair."""
    return json.loads((LRO / "lro.json").read_text())


def listed(folder):
    """Return the path of a list of the two images."""
    path = folder / "images.lis"
    path.write_text("".join(f"{SERIAL}{side},{LRO / f'observationImage{side}.isd'}\n" for side in SIDES))
    return path


def rectangular(points):
    """Return X, Y, Z in metres of latitudes, longitudes and radii in km."""
    latitude, longitude, radius = np.array(points).T
    level = radius * np.cos(latitude)
    return 1000 * np.column_stack(
        [level * np.cos(longitude), level * np.sin(longitude), radius * np.sin(latitude)]
    )


def with_coordinates(folder, answers):
    """Return the path of the network whose free points have the a-priori coordinates of the weighted case."""
    network = read_network(LRO / "observationPair.net")
    assert list(network.points.ids) == answers["points"]
    known = rectangular(answers["weighted"]["inputs"]["points"])
    path = folder / "pair.net"
    path.write_bytes(network_text(replace(network, points=replace(network.points, apriori=known))))
    return path


def project(path, folder, jigsaw):
    """Read a network of the pair."""
    return formats.read(path, ReadOptions(cubes=listed(folder), jigsaw=jigsaw))
