"""Control networks of ISIS: read, written, read again; damaged ones are refused."""

import json
import struct
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from photogram.errors import InputError
from photogram.formats.isis.columns import measures_of, points_of
from photogram.formats.isis.network import ControlMeasures, ControlNetwork, ControlPoints
from photogram.formats.isis.reading import is_network, read_network
from photogram.formats.isis.writing import binary_network, network_text
from photogram.io.pvl import Group
from shared_data import SHARED

NETWORKS = SHARED / "moving" / "control_network"
PUBLISHED = (
    NETWORKS / "csm_version2.net",
    NETWORKS / "lro_version5.net",
    SHARED / "moving" / "lro" / "observationPair.net",
)
LABEL = 65536
there = pytest.mark.skipif(not NETWORKS.is_dir(), reason="the published networks are not there (../shared)")


def same(one, other):
    """Return whether two arrays, texts or groups are the same, NaN where NaN is."""
    if isinstance(one, tuple):
        return all(same(a, b) for a, b in zip(one, other, strict=True))
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    return one == other


def differing(one, other, but=()):
    """Return the names of what differs in two networks, apart from the version that they were read from."""
    parts = {
        "": (one, other),
        "points.": (one.points, other.points),
        "measures.": (one.measures, other.measures),
    }
    found = {
        f"{kind}{each.name}"
        for kind, (a, b) in parts.items()
        for each in fields(a)
        if each.name not in ("version", "points", "measures")
        and not same(getattr(a, each.name), getattr(b, each.name))
    }
    return sorted(found - set(but))


def read_again(content, tmp_path):
    """Return what a file holds that has this content."""
    file = tmp_path / "again.net"
    file.write_bytes(content)
    return read_network(file)


def varint(value):
    """Return a whole number as messages have it."""
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def packed(number, value):
    """Return a field of a message: a whole number, a number, a text or bytes, by the type of the value."""
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    if isinstance(value, float):
        return varint(number << 3 | 1) + struct.pack("<d", value)
    value = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(value)) + value


MEASURE = packed(1, "S/1") + packed(2, 3) + packed(3, 10.5) + packed(4, 20.25)
POINT = packed(1, "P1") + packed(2, 2)


def binary(*points, header=b"", version=5, info="", lengths=None):
    """Return a binary network of messages of points."""
    header = packed(1, "net") + packed(2, "MOON") + header
    body = b"".join((b"" if lengths else struct.pack("<I", len(each))) + each for each in points)
    label = f"""Object = ProtoBuffer
  Object = Core
    HeaderStartByte = {LABEL}
    HeaderBytes = {len(header)}
    PointsStartByte = {LABEL + len(header)}
    PointsBytes = {len(body)}
  End_Object
  Group = ControlNetworkInfo
    Version = {version}
    {info}
  End_Group
End_Object
End
"""
    return label.encode().ljust(LABEL, b"\0") + header + body


def in_text(points, head="Version = 5"):
    """Return a network in text."""
    return f"Object = ControlNetwork\n  NetworkId = net\n  {head}\n{points}\nEnd_Object\nEnd\n".encode()


MEASURE_TEXT = """
    Group = ControlMeasure
      SerialNumber = S/1
      MeasureType  = Manual
      Sample       = 1.5
      Line         = 2.5
    End_Group
"""
POINT_TEXT = f"""
  Object = ControlPoint
    PointType = Free
    PointId   = P1
{MEASURE_TEXT}
  End_Object
"""


@there
@pytest.mark.parametrize("name", ["csm_version2.net", "lro_version5.net"])
def test_published_networks_say_what_their_answers_say(name):
    answer = json.loads((NETWORKS / "answers.json").read_text(encoding="utf-8"))[name]
    network = read_network(NETWORKS / name)
    points, measures = network.points, network.measures
    assert (network.version, len(points), len(measures)) == (
        answer["version"],
        answer["points"],
        answer["measures"],
    )
    assert {str(code): int(np.sum(points.types == code)) for code in range(5)} == answer["types"]
    first = answer["first"]
    assert (points.ids[0], points.types[0]) == (first["id"], first["type"])
    assert points.apriori[0].tolist() == first["apriori_xyz_m"]
    own = slice(*network.firsts[:2])
    assert [
        {"serial": measures.serials[serial], "type": kind, "sample": sample, "line": line}
        for serial, kind, sample, line in zip(
            measures.serial[own].tolist(),
            measures.types[own].tolist(),
            measures.sample[own].tolist(),
            measures.line[own].tolist(),
            strict=True,
        )
    ] == first["measures"]
    assert measures.sample.sum() == pytest.approx(answer["sum_of_samples"], rel=1e-14)
    assert measures.line.sum() == pytest.approx(answer["sum_of_lines"], rel=1e-14)
    assert (
        network.point_of_measure.tolist() == np.repeat(range(len(points)), np.diff(network.firsts)).tolist()
    )


@there
def test_the_same_network_in_text_and_binary_is_the_same():
    text, binary = read_network(PUBLISHED[2]), read_network(PUBLISHED[1])
    # The binary one was made without residuals, references and numbers of the registration.
    assert differing(text, binary) == [
        "measures.line_residual",
        "measures.rest",
        "measures.sample_residual",
        "points.reference",
    ]
    assert np.isfinite(text.measures.line_residual).sum() == 24
    assert np.flatnonzero(text.points.reference >= 0).size == 28


@there
@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: path.name)
def test_published_networks_are_written_without_loss(path, tmp_path):
    network = read_network(path)
    content = binary_network(network)
    for written in (content, network_text(network)):
        again = read_again(written, tmp_path)
        assert (
            differing(network, again, but=["points.rest", "measures.rest"] if written != content else ())
            == []
        )
        assert again.version == 5
        assert binary_network(again) == content
    assert is_network(content)


@there
def test_untouched_messages_stay_byte_for_byte():
    data = (NETWORKS / "lro_version5.net").read_bytes()
    assert binary_network(read_network(NETWORKS / "lro_version5.net"))[LABEL:] == data[LABEL:]
    old = (NETWORKS / "csm_version2.net").read_bytes()
    new = binary_network(read_network(NETWORKS / "csm_version2.net"))
    at, messages = len(new) - 25988 - 4 * 76, b""
    while at < len(new):
        (length,) = struct.unpack_from("<I", new, at)
        messages += new[at + 4 : at + 4 + length]
        at += 4 + length
    assert messages == old[65757:]


@there
def test_text_is_that_of_isis_but_for_its_comments():
    def lines(text):
        return [line for line in text.split("\n") if line.strip() and not line.strip().startswith("#")]

    original = PUBLISHED[2].read_text(encoding="utf-8")
    assert lines(network_text(read_network(PUBLISHED[2])).decode()) == lines(original)


@there
@pytest.mark.parametrize("write", [binary_network, network_text])
def test_what_an_adjustment_found_is_written_and_nothing_else_changes(write, tmp_path):
    network = read_network(PUBLISHED[2])
    n, m = len(network.points), len(network.measures)
    found = np.random.default_rng(1).normal(size=(n, 9)) * 1e6
    points = replace(network.points, adjusted=found[:, :3], adjusted_covariance=found[:, 3:])
    residuals = np.linspace(-1, 1, 2 * m).reshape(m, 2)
    measures = replace(
        network.measures,
        sample_residual=residuals[:, 0],
        line_residual=residuals[:, 1],
        rejected=np.arange(m) % 5 == 0,
    )
    changed = replace(network, points=points, measures=measures, modified="2026-01-01T00:00:00")
    again = read_again(write(changed), tmp_path)
    assert differing(changed, again, but=["points.rest", "measures.rest"]) == []
    assert differing(network, again, but=["points.rest", "measures.rest"]) == [
        "measures.line_residual",
        "measures.rejected",
        "measures.sample_residual",
        "modified",
        "points.adjusted",
        "points.adjusted_covariance",
    ]


def full_message():
    """Return a point with everything that a point and its measures can have, and what nobody knows."""
    six = struct.pack("<6d", 4, 0.5, 0.25, 9, -0.5, 16)
    log = packed(17, packed(1, 2) + packed(2, 0.75))
    measure = MEASURE + b"".join(
        [
            *(packed(5, 0.125), packed(6, -0.25), packed(7, "someone"), packed(8, "2020-01-01T00:00:00")),
            *(
                packed(9, 1),
                packed(10, 0),
                packed(11, 1),
                packed(12, 3.5),
                packed(13, 10.0),
                packed(14, 20.0),
            ),
            *(
                packed(15, 0.5),
                packed(16, 0.75),
                log,
                packed(40, "unknown"),
                packed(4000, 7),
                packed(41, 1.0),
            ),
            b"\xd5\x02abcd",
        ]
    )
    return POINT + b"".join(
        [
            *(packed(3, "who"), packed(4, "when"), packed(5, 1), packed(6, 1), packed(7, 0), packed(8, 1)),
            *(packed(9, 6), packed(10, "a.cub"), packed(11, 5), packed(12, "dem.cub"), packed(13, 1)),
            *(
                packed(14, 0),
                packed(15, 1),
                packed(16, 1.0),
                packed(17, 2.0),
                packed(18, 3.0),
                packed(19, six),
            ),
            *(packed(20, 1.5), packed(21, 2.5), packed(22, 3.5), packed(23, six), packed(24, b"\x08\x01")),
            *(packed(25, MEASURE), packed(25, measure), packed(26, "more"), packed(99, 3.5)),
        ]
    )


def test_everything_is_kept_byte_for_byte_and_all_columns_are_read(tmp_path):
    data = binary(full_message(), header=packed(9, "?") + packed(10, 1.0) + packed(10, 2.0) + packed(10, 3.0))
    network = read_again(data, tmp_path)
    points, measures = network.points, network.measures
    assert (network.network_id, network.target, network.user) == ("net", "MOON", None)
    assert network.radii.tolist() == [1, 2, 3]
    assert points.apriori.tolist() == [[1, 2, 3]]
    assert points.adjusted.tolist() == [[1.5, 2.5, 3.5]]
    assert (
        points.apriori_covariance.tolist()
        == points.adjusted_covariance.tolist()
        == [[4, 0.5, 0.25, 9, -0.5, 16]]
    )
    assert points.constrained.tolist() == [[True, False, True]]
    assert (points.edit_lock[0], points.ignore[0], points.rejected[0]) == (True, True, False)
    assert (points.reference[0], points.apriori_source[0], points.apriori_radius_source[0]) == (1, 6, 5)
    assert np.isnan(measures.sample_sigma[0])
    assert (measures.sample_sigma[1], measures.line_sigma[1], measures.diameter[1]) == (0.5, 0.75, 3.5)
    assert (measures.sample_residual[1], measures.line_residual[1]) == (0.125, -0.25)
    assert (measures.apriori_sample[1], measures.apriori_line[1]) == (10, 20)
    assert measures.edit_lock.tolist() == measures.rejected.tolist() == [False, True]
    written = binary_network(network)
    assert written.endswith(struct.pack("<I", len(full_message())) + full_message())
    assert differing(network, read_again(written, tmp_path)) == []
    with pytest.raises(InputError, match="field 24, which has no place in a network in text"):
        network_text(replace(network, header_rest=b""))
    with pytest.raises(InputError, match="the header has fields"):
        network_text(network)


def test_a_value_that_was_said_to_be_none_is_replaced_by_one_that_is(tmp_path):
    point = POINT + packed(6, 0) + packed(16, float("nan")) + packed(25, MEASURE + packed(11, 0))
    network = read_again(binary(point), tmp_path)
    assert binary_network(network).endswith(point)
    again = read_again(network_text(network), tmp_path)
    assert binary_network(again).endswith(point)
    points = replace(network.points, ignore=np.ones(1, bool), apriori=np.array([[1.0, np.nan, np.nan]]))
    measures = replace(network.measures, rejected=np.ones(1, bool))
    expected = POINT + packed(6, 1) + packed(16, 1.0) + packed(25, MEASURE + packed(11, 1))
    assert binary_network(replace(network, points=points, measures=measures)).endswith(expected)


def test_what_only_text_has_is_kept_in_text_and_refused_in_binary(tmp_path):
    text = in_text(
        POINT_TEXT.replace(
            "PointId   = P1",
            """PointId   = "a name"  # of a crater
    Colour    = (red,
                 "dark (very) red")
    Ignore    = False
    ChooserName = 'the "chooser"'
    /* not
       this */
    DateTime  = "2020-01-01
                 noon"
    Group = Extra
      Object = Inner
        A = 1
      End_Object
    End_Group""",
        ).replace("Line ", "GoodnessOfFit = 0.5\n      Mood = good\n      Line "),
        head="Version = 4\n  TargetRadii = (1.0, 2.0, 3.0) <meters>\n  Key = 007\n"
        "  Group = Own\n    B = 2\n  End_Group",
    )
    network = read_again(text, tmp_path)
    assert (network.version, network.points.ids[0], network.radii.tolist()) == (4, "a name", [1, 2, 3])
    written = network_text(network)
    again = read_again(written, tmp_path)
    assert differing(network, again, but=["points.rest", "measures.rest", "others"]) == []
    assert (again.others.items, again.others.inside[0].items) == ([("Key", "007")], [("B", "2")])
    assert network_text(again) == written
    for part in (
        'PointId     = "a name"',
        "Ignore      = False",
        "ChooserName = 'the \"chooser\"'",
        'DateTime    = "2020-01-01 noon"',
        "Object = Inner",
        "Mood          = good",
        "GoodnessOfFit = 0.5",
        '"dark (very) red")',
    ):
        assert part in written.decode()
    with pytest.raises(InputError, match=r"point 1 has .*Colour.* no place in a binary network"):
        binary_network(network)


@pytest.mark.parametrize(
    ("point", "record", "said"),
    [
        (POINT_TEXT.replace("PointId   = P1", ""), 5, "point 1 has no PointId"),
        (POINT_TEXT.replace("MeasureType  = Manual", ""), 9, "point 1 has no MeasureType"),
        (POINT_TEXT.replace("= 1.5", "= 1.5 <mm>"), 12, "has .* for Sample, which is pixels"),
        (POINT_TEXT.replace("= 1.5", "= one"), 12, 'has "one" for Sample, which is a number'),
        (POINT_TEXT.replace("= 1.5", "= inf"), 12, 'has "inf" for Sample, which is a number'),
        (POINT_TEXT.replace("= 1.5", "= 1.5 2"), 12, "no part of a control network"),
        (POINT_TEXT.replace("= 1.5", "= 1.5\n  Sample = 1.5"), 13, "has Sample twice"),
        (POINT_TEXT.replace("= Manual", "= Guessed"), 11, 'has "Guessed" for MeasureType'),
        (POINT_TEXT.replace("PointType = Free", "AprioriX = 1 <km>"), 6, "for AprioriX, which is meters"),
        (POINT_TEXT.replace("PointType = Free", "Ignore = maybe"), 6, "which is True or False"),
        (POINT_TEXT.replace("PointType = Free", "AprioriCovarianceMatrix = (1, 2)"), 6, "six numbers"),
        (
            POINT_TEXT.replace("PointType = Free", "ReferenceIndex = 1\n PointType = Free"),
            5,
            "measure 1.* and has 1",
        ),
        (POINT_TEXT.replace("PointType = Free", 'ChooserName = "open'), 6, "ends within a value"),
        (POINT_TEXT.replace("End_Group", ""), 16, 'no part of a control network: "End_Object"'),
        (POINT_TEXT + POINT_TEXT, 2, "point 2 has the name P1, as point 1 has"),
        ("\n  Object = ControlPoint\n /* open", 6, "ends within a comment"),
    ],
)
def test_text_that_is_wrong_is_refused_with_its_line(point, record, said, tmp_path):
    with pytest.raises(InputError, match=said) as caught:
        read_again(in_text(point), tmp_path)
    assert (caught.value.record, caught.value.file) == (record, tmp_path / "again.net")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            binary(POINT, version=1),
            "is a control network of version 1; binary ones are read in version 2 or 5",
        ),
        (binary(POINT, version=3), "version 3"),
        (binary(POINT, version=4), "version 4"),
        (in_text(POINT_TEXT, head="Version = 2"), "version 2; text ones are read in version 3, 4 or 5"),
        (in_text(POINT_TEXT, head=""), "version 1"),
        (binary(POINT, info="NumberOfPoints = 2"), "says that it has 2 points, and has 1"),
        (binary(POINT, info="NumberOfMeasures = 7"), "says that it has 7 measures, and has 0"),
        (binary(POINT, header=packed(7, 3)), "says that it has 3 points, and has 1"),
        (binary(packed(2, 2)), r"record 1: has no PointId \(byte 65551\)"),
        (binary(POINT, packed(1, "Q")), r"record 2: has no PointType"),
        (binary(POINT + packed(25, packed(2, 1))), "has no SerialNumber"),
        (binary(packed(1, "P1") + packed(2, 5)), 'has "5" for PointType'),
        (binary(packed(1, b"\xff") + packed(2, 2)), "has a text in PointId that is not UTF-8"),
        (binary(POINT + packed(16, 7)), "has field 16 in the wire type 0"),
        (binary(POINT + packed(19, bytes(40))), "40 bytes.*six numbers"),
        (binary(POINT + packed(8, 0)), "refers to its measure 0, counted from 0, and has 0"),
        (binary(POINT + b"\x0b"), "has field 1 in the wire type 3"),
        (binary(POINT + b"\x02\x00"), "impossible number 0"),
        (binary(POINT + b"\x08" + b"\xff" * 10), "more than 64 bits"),
        (binary(POINT + packed(25, MEASURE)[:-3]), "ends within a field"),
        (binary(POINT)[:-1], "ends within a point"),
        (
            binary(POINT).replace(b"PointsBytes = 10", b"PointsBytes = 99"),
            "ends within the points",
        ),
        (binary(POINT)[:LABEL], "ends within the header"),
        (binary(POINT).replace(b"HeaderBytes", b"HeaderBits_"), "its label has no HeaderBytes"),
        (binary(POINT).replace(b"HeaderBytes = 11", b"HeaderBytes = -1"), "HeaderBytes is no whole number"),
        (binary(POINT, version=2, lengths=True, header=packed(7, b"\x7f")), "ends within a point"),
        (
            binary(POINT, version=2, lengths=True, header=packed(7, b"\x00")),
            "has no PointType|has no PointId",
        ),
        (binary(POINT, version=2, lengths=True), "more bytes than the lengths of all points"),
        (b"Object = IsisCube\nEnd_Object\nEnd\n", "is no control network"),
        (b"", "is no control network"),
    ],
)
def test_networks_that_are_wrong_are_refused(content, said, tmp_path):
    with pytest.raises(InputError, match=said):
        read_again(content, tmp_path)


def test_version_2_lists_the_lengths_of_its_points(tmp_path):
    lengths = packed(7, varint(len(POINT)) + varint(len(full_message())))
    other = POINT.replace(b"P1", b"P2")
    network = read_again(binary(other, full_message(), version=2, lengths=True, header=lengths), tmp_path)
    assert (network.version, network.points.ids, len(network.measures)) == (2, ["P2", "P1"], 2)
    assert binary_network(network).endswith(full_message())


def damages(data, random, count):
    """Yield data that are cut, or have bytes changed."""
    body = [at for at in range(len(data)) if at >= LABEL or data[at]]
    for _ in range(count):
        yield data[: body[random.integers(len(body))]]
        spoilt = bytearray(data)
        for _ in range(random.integers(1, 4)):
            spoilt[body[random.integers(len(body))]] = random.integers(256)
        yield bytes(spoilt)


@pytest.mark.parametrize("form", ["binary", "version 2", "text"])
def test_damage_is_refused_or_read_but_never_ends_otherwise(form, tmp_path):
    other = POINT.replace(b"P1", b"P2") + packed(25, MEASURE)
    lengths = packed(7, varint(len(full_message())) + varint(len(other)))
    data = {
        "binary": binary(full_message(), other),
        "version 2": binary(full_message(), other, version=2, lengths=True, header=lengths),
        "text": in_text(POINT_TEXT + POINT_TEXT.replace("P1", "P2")),
    }[form]
    assert len(read_again(data, tmp_path).points) == 2
    refused = 0
    for damaged in damages(data, np.random.default_rng(5), 400):
        try:
            network = read_again(damaged, tmp_path)
        except InputError:
            refused += 1
        else:
            assert network.firsts[-1] == len(network.measures)
    assert 100 < refused < 800


def small():
    """Return a network made of nothing but columns."""
    points = points_of(
        {"ids": ["A", "B"], "types": np.array([2, 4], np.int8), "adjusted_x": np.array([1.0, 2.0])}
    )
    measures = measures_of({"serial": (np.zeros(3, np.int32), ["S"]), "types": np.ones(3, np.int8)})
    return ControlNetwork(points, measures, np.array([0, 1, 3]))


@pytest.mark.parametrize("write", [binary_network, network_text])
def test_a_network_is_made_of_columns_alone(write, tmp_path):
    again = read_again(write(small()), tmp_path)
    assert differing(small(), again) == []
    assert np.isnan(again.points.adjusted).tolist() == [[False, True, True]] * 2


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"firsts": np.array([0, 2, 1])}, "the first measures of points"),
        ({"firsts": np.array([0, 1, 2])}, "the first measures of points"),
        ({"points": {"types": np.array([2, 5], np.int8)}}, "those of points"),
        ({"measures": {"serial": np.array([0, 1, 0], np.int32)}}, "those of measures"),
        ({"points": {"reference": np.array([0, 2], np.int32)}}, "refers to its measure 2"),
        ({"points": {"rest": (np.zeros(3, np.uint8), np.array([0, 3, 3]))}}, "impossible number 0"),
        ({"points": {"rest": (np.zeros(3, np.uint8), np.array([0, 9, 9]))}}, "those of points"),
    ],
)
def test_columns_that_do_not_agree_are_not_written(change, said):
    network = small()
    parts = {
        name: replace(getattr(network, name), **value) if isinstance(value, dict) else value
        for name, value in change.items()
    }
    for write in (binary_network, network_text):
        with pytest.raises(InputError, match=said):
            write(replace(network, **parts))


def test_columns_of_another_shape_are_refused():
    network = small()
    with pytest.raises(InputError, match=r"adjusted has the shape \(2, 2\), not \(2, 3\)"):
        replace(network.points, adjusted=np.zeros((2, 2)))
    with pytest.raises(InputError, match="rest begins in 2 places, not 4"):
        replace(network.measures, rest=(np.zeros(0, np.uint8), np.zeros(2, np.int64)))
    with pytest.raises(InputError, match="firsts has the shape"):
        replace(network, firsts=np.zeros(1, np.int64))
    assert {type(network.points), type(network.measures)} == {ControlPoints, ControlMeasures}


def test_a_header_without_room_or_marks_is_refused(tmp_path):
    network = small()
    with pytest.raises(InputError, match="has room for 65536"):
        binary_network(replace(network, description="x" * LABEL))
    with pytest.raises(InputError, match="cannot stand in a label"):
        network_text(replace(network, description="two\nlines"))
    others = Group("", "label", items=[("Own", "it's")])
    assert read_again(binary_network(replace(network, others=others)), tmp_path).others == others
    assert Path(tmp_path / "again.net").stat().st_size > LABEL
