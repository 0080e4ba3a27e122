"""A small project as records, to be changed by tests."""

COMMON = [
    "A SMALL BLOCK",
    "01000000001009 00 1",
]
CAMERAS = ["F1982        -152740"]
IMAGES = [
    "A                                       F1982",
    "1              10000     20000",
    "2             -10000     20000",
    "3              1.500    -2.500",
    "****",
    "B                       0.0060    0.0080F1982",
    "3              -1000      2000",
    "2              -2000      3000",
    "1               4000      5000",
    "********",
]


def frame_record(name, first, second, third, *sd):
    """One of the two records of a frame in FRAMES."""
    return f"{name:8}{first:>12}{second:>12}{third:>12}" + "".join(f"{value:>10}" for value in sd)


FRAMES = [
    frame_record("A", "100.000", "200.000", "1500.000"),
    frame_record("A", "0.000", "-3.000", "900000.000"),
    frame_record("B", "700.000", "200.000", "1500.000", "5.000", "6.000"),
    frame_record("B", "10000.000", "0.000", "900000.000", "", "", "3000.000"),
]


def ground_record(name, x, y, z, *sd, code=""):
    """One record of GROUND."""
    return f"{name:8}{x:>12}{y:>12}{z:>12}" + "".join(f"{value:>10}" for value in sd).ljust(35) + code


GROUND = [
    ground_record("1", "110.000", "210.000", "10.000", "0.020"),
    ground_record("2", "0.000", "0.000", "20.000", "", "", "0.040", code="3"),
    ground_record("3", "50.", "60.", "", code="7"),
]

FILES = {"COMMON": COMMON, "CAMERAS": CAMERAS, "IMAGES": IMAGES, "FRAMES": FRAMES, "GROUND": GROUND}


def write_files(directory, **changes):
    """Write the project with some files replaced: name=records."""
    for name, records in {**FILES, **changes}.items():
        (directory / name).write_text("".join(f"{record}\n" for record in records))
    return directory


def replaced(records, number, record):
    """Replace one of the records, numbered from 1."""
    return [record if n == number else old for n, old in enumerate(records, 1)]


def same(one, other):
    """Assert that two projects hold the same names and the same numbers, to the last bit."""
    assert one.common == other.common
    assert one.cameras == other.cameras
    assert one.frames == other.frames
    assert one.ground == other.ground
    for a, b in zip(one.images, other.images, strict=True):
        assert (a.name, a.points, a.sd, a.camera) == (b.name, b.points, b.sd, b.camera)
        assert a.principal_distance == b.principal_distance
        assert a.xy.tolist() == b.xy.tolist()
