"""ISIS cubes after spiceinit as support data: their labels, tables, and keywords of instruments."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogram.errors import InputError
from photogram.formats.csm.cube_tables import members, one, read_label, read_positions, read_turns
from photogram.formats.csm.isd import Detector, Isd
from photogram.formats.csm.line_times import fitting, read_drift
from photogram.formats.csm.optics import from_pixels, not_zero, transformed
from photogram.io.json import Tree
from photogram.io.pvl import Group
from photogram.network.lens import Lens
from photogram.network.moving_photos import Lines

__all__ = ["read_cube", "serial_number"]

KM = 1000.0
_LRO, _APOLLO = "LUNAR RECONNAISSANCE ORBITER", re.compile(r"APOLLO[ _]?(1[567])")
_NAC = ("NACL", "NACR")
_CHANGED = {"AlphaCube": "a part of another cube, or made smaller", "Mapping": "a map"}
"""Groups of cubes whose samples and lines are not those of their camera."""


def _named(instrument: Tree) -> tuple[str, str]:
    """Return spacecraft and instrument."""
    return instrument["SpacecraftName"].text().upper(), instrument["InstrumentId"].text().upper()


def serial_number(label: Group, path: Path) -> str:
    """Return what control networks call the image of a cube.

    Raises
    ------
    InputError
        An instrument whose rule is not known, keys that are missing.
    """
    instrument = members(one(one(label, "IsisCube", path), "Instrument", path), path)
    spacecraft, name = _named(instrument)
    if spacecraft == _LRO and name in _NAC:
        return f"LRO/{instrument['SpacecraftClockStartCount'].text()}/{name}"
    apollo = _APOLLO.fullmatch(spacecraft)
    if apollo and name == "METRIC":
        return f"APOLLO{apollo[1]}/METRIC/{instrument['StartTime'].text()}"
    raise InputError(
        f"no rule for serial numbers of {name} of {spacecraft} is known: write it before the path, with a"
        " comma",
        file=path,
    )


def read_cube(path: Path) -> Isd:
    """Return what the label and the tables of a cube say of its image.

    Raises
    ------
    InputError
        No cube, one without spiceinit, a part of another one or a map; an instrument that is not known by its
        label and needs an ISD.
    """
    label = read_label(path)
    cube = one(label, "IsisCube", path)
    for name, what in _CHANGED.items():
        if cube.groups(name):
            raise InputError(f"is {what} ({name}): take the cube that was made into it", file=path)
    instrument = members(one(cube, "Instrument", path), path)
    known = _CAMERAS.get(_named(instrument))
    if known is None:
        spacecraft, name = _named(instrument)
        raise InputError(
            f"{name} of {spacecraft} is not known by its label: make an ISD of it (isd_generate of ALE)",
            file=path,
        )
    return known(label, cube, instrument, path)


def _nac(label: Group, cube: Group, instrument: Tree, path: Path) -> Isd:
    """Return a narrow angle camera of the Lunar Reconnaissance Orbiter."""
    keywords = members(one(label, "NaifKeywords", path), path)
    code = f"INS{members(one(cube, 'Kernels', path), path)['NaifFrameCode'].whole(-(2**31))}"
    size = members(one(one(cube, "Core", path), "Dimensions", path), path)
    samples, count = size["Samples"].whole(1), size["Lines"].whole(1)
    pointing = read_turns(label, "InstrumentPointing", path)
    rate = not_zero(instrument["LineExposureDuration"]) / 1000
    lines = Lines([[0.0, _start(instrument, keywords), rate]])
    lines, remarks = fitting(lines, count, pointing.times, read_drift(keywords, code))
    return Isd(
        path,
        "line",
        _named(instrument)[0],
        _named(instrument)[1],
        (samples, count),
        _radii(keywords),
        not_zero(keywords[f"{code}_FOCAL_LENGTH"]),
        _detector(instrument, keywords, code),
        Lens("lrolrocnac", (keywords[f"{code}_OD_K"].number(),)),
        read_positions(label, path),
        pointing,
        read_turns(label, "BodyRotation", path),
        float(lines.times([count / 2])[0]),
        lines,
        remarks=remarks,
    )


def _detector(instrument: Tree, keywords: Tree, code: str) -> Detector:
    """Return the detector of a scanner whose images are summed along lines alone."""
    summing = instrument["SpatialSumming"].number()
    centre = [keywords[f"{code}_BORESIGHT_{axis}"].number() for axis in ("SAMPLE", "LINE")]
    if not summing > 0:
        raise instrument["SpatialSumming"].error("is not positive")
    return Detector(
        np.array(centre),
        np.array([instrument["SampleFirstPixel"].number(), 0.0]),
        np.array([summing, 1.0]),
        {
            # What instruments call ITRANSS, ITRANSL are focal2pixel of an ISD.
            "csm": from_pixels(keywords[f"{code}_ITRANSS"], keywords[f"{code}_ITRANSL"]),
            "isis": transformed(keywords, code),
        },
    )


def _radii(keywords: Tree) -> tuple[float, float]:
    """Return semi-axes of the body in metres."""
    name = f"BODY{keywords['BODY_CODE'].whole()}_RADII"
    a, other, b = KM * keywords[name].numbers(3)
    if a != other or not 0 < b <= a:
        raise keywords[name].error("are not those of a spheroid")
    return float(a), float(b)


def _start(instrument: Tree, keywords: Tree) -> float:
    """Return the ephemeris time of the clock at which reading begins, which spiceinit has computed.

    Its bytes stand there as hexadecimal digits, the least significant first.
    """
    counts = [
        key for key in ("SpacecraftClockPrerollCount", "SpacecraftClockStartCount") if key in instrument
    ]
    names = {
        name for name, _ in keywords.items() if name.startswith("CLOCK_ET_") and name.endswith("_COMPUTED")
    }
    for key in counts:
        own = [name for name in names if f"_{instrument[key].text()}_" in name]
        if own:
            value = keywords[own[0]]
            try:
                return float(struct.unpack("<d", bytes.fromhex(str(value.value)))[0])
            except (ValueError, struct.error):
                raise value.error("is no time in sixteen hexadecimal digits") from None
    raise keywords.error("has no CLOCK_ET of the clock at which the image begins")


_CAMERAS: dict[tuple[str, str], Callable[[Group, Group, Tree, Path], Isd]] = {
    (_LRO, name): _nac for name in _NAC
}
"""How cubes are read, by spacecraft and instrument."""
