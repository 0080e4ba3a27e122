"""ISIS cubes made of the numbers of support data: a label, and tables behind it."""

import struct

import numpy as np
import support_data

CLOCK = "1/269181999:50462"
CODE = -85600
LABEL = 8192
CONSTANT = [1.0, 0, 0, 0, 0, 1.0, 0, -1.0, 0]
"""A quarter of a turn, behind the records of the pointing."""


def keywords():
    """Return the keywords of an instrument whose rate of lines lacks its corrections."""
    own = support_data.document()
    clock = struct.pack("<d", support_data.START - 0.008).hex()
    found = {
        "BODY_CODE": 301,
        "BODY301_RADII": [support_data.RADIUS] * 3,
        f"CLOCK_ET_-85_{CLOCK}_COMPUTED": clock,
    }
    instrument = {
        "FOCAL_LENGTH": own["focal_length_model"]["focal_length"],
        "BORESIGHT_SAMPLE": own["detector_center"]["sample"],
        "BORESIGHT_LINE": own["detector_center"]["line"],
        "ITRANSS": own["focal2pixel_samples"],
        "ITRANSL": own["focal2pixel_lines"],
        "TRANSX": [0.0, 0.0, 0.02],
        "TRANSY": [0.0, 0.02, 0.0],
        "OD_K": 1.8e-5,
        "MULTIPLI_LINE_ERROR": 0.25,
        "ADDITIVE_LINE_ERROR": 0.0,
        "ADDITIONAL_PREROLL": 0.8,
    }
    return found | {f"INS{CODE}_{name}": value for name, value in instrument.items()}


def isd():
    """Return what an ISD of the cube would be."""
    own = support_data.document()
    own |= {"naif_keywords": keywords(), "optical_distortion": {"lrolrocnac": {"coefficients": 1.8e-5}}}
    own |= {"starting_detector_line": 0, "starting_detector_sample": 8, "detector_sample_summing": 2}
    # 0.008 s a line are 0.01 s with the corrections; 0.8 lines later.
    own["line_scan_rate"] = [[0.5, -2.008, 0.008]]
    own["instrument_pointing"] |= {"constant_rotation": CONSTANT, "time_dependent_frames": [CODE, 1]}
    return own


def quaternion_table(of):
    times = np.array(of["ephemeris_times"])
    return ["J2000Q0", "J2000Q1", "J2000Q2", "J2000Q3", "ET"], np.column_stack([of["quaternions"], times])


def tables():
    """Return the tables of a cube: name, columns, rows, further keys."""
    own = isd()
    position = own["instrument_position"]
    places = np.column_stack([position["positions"], position["velocities"], position["ephemeris_times"]])
    names = ["J2000X", "J2000Y", "J2000Z", "J2000XV", "J2000YV", "J2000ZV", "ET"]
    span = [repr(position["ephemeris_times"][k]) for k in (0, -1)]
    pointing, body = quaternion_table(own["instrument_pointing"]), quaternion_table(own["body_rotation"])
    # Angular velocities stand between, and are not used.
    rates = np.zeros((len(pointing[1]), 3))
    columns = [*pointing[0][:4], "AV1", "AV2", "AV3", "ET"]
    rows = np.column_stack([pointing[1][:, :4], rates, pointing[1][:, 4]])
    kept = {f"Ck{word}": value for word, value in zip(("TableStartTime", "TableEndTime"), span, strict=True)}
    spk = {f"Spk{name[2:]}": value for name, value in kept.items()}
    constant = f"({', '.join(map(repr, CONSTANT))})"
    return {
        "InstrumentPointing": (columns, rows, kept | {"ConstantRotation": constant}),
        "InstrumentPosition": (names, places, spk | {"CacheType": "Linear"}),
        "BodyRotation": (*body, kept),
    }


def value(given):
    if isinstance(given, list):
        return f"({', '.join(map(repr, given))})"
    return given if isinstance(given, str) else repr(given)


INSTRUMENT = {
    "SpacecraftName": '"LUNAR RECONNAISSANCE ORBITER"',
    "InstrumentId": "NACL",
    "StartTime": "2009-07-13T17:33:17.246",
    "SpacecraftClockStartCount": "1/269182000:51104",
    "SpacecraftClockPrerollCount": CLOCK,
    "LineExposureDuration": "8.0 <MILLISECONDS>",
    "SpatialSumming": "2",
    "SampleFirstPixel": "8",
}


def cube(path, *, instrument=INSTRUMENT, tables=None, order="<", known=None, label=LABEL, group=None):
    """Write a cube, whose pixels nobody reads, and return its path."""
    own = globals()["tables"]() if tables is None else tables
    lines = ["Object = IsisCube", "  Object = Core", "    StartByte = 65537", "    Group = Dimensions"]
    lines += ["      Samples = 300", "      Lines = 400", "      Bands = 1", "    End_Group", "  End_Object"]
    lines += [
        "  Group = Instrument",
        *(f"    {key} = {text}" for key, text in instrument.items()),
        "  End_Group",
    ]
    lines += [] if group is None else [f"  Group = {group}", "    Of = something", "  End_Group"]
    lines += ["  Group = Kernels", f"    NaifFrameCode = {CODE}", "  End_Group", "End_Object"]
    data = b""
    for name, (columns, rows, keys) in own.items():
        body = np.asarray(rows, dtype=f"{order}f8").tobytes()
        lines += ["Object = Table", f"  Name = {name}", f"  StartByte = {label + len(data) + 1}"]
        lines += [f"  Bytes = {len(body)}", f"  Records = {len(rows)}"]
        lines += [f"  ByteOrder = {'Lsb' if order == '<' else 'Msb'}"]
        lines += [f"  {key} = {text}" for key, text in keys.items()]
        for column in columns:
            lines += [
                "  Group = Field",
                f"    Name = {column}",
                "    Type = Double",
                "    Size = 1",
                "  End_Group",
            ]
        lines += ["End_Object"]
        data += body
    named = keywords() if known is None else known
    lines += [
        "Object = NaifKeywords",
        *(f"  {key} = {value(own)}" for key, own in named.items()),
        "End_Object",
    ]
    text = "\n".join([*lines, "End", ""]).encode()
    assert len(text) <= label
    path.write_bytes(text.ljust(label, b"\0") + data)
    return path
