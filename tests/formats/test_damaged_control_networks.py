"""Control networks of ISIS that are damaged, old, or do not agree are refused, each with its place."""

from dataclasses import replace

import numpy as np
import pytest
from control_networks import (
    LABEL,
    MEASURE,
    POINT,
    POINT_TEXT,
    binary,
    full_message,
    in_text,
    packed,
    read_again,
    small,
    varint,
)

from message_codes import refused
from photogram import InputError
from photogram.formats.isis import ControlMeasures, ControlPoints, binary_network, network_text
from photogram.io.pvl import Group


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
        (POINT_TEXT + POINT_TEXT, 2, "format.repeated what=point name=P1"),
        ("\n  Object = ControlPoint\n /* open", 6, "ends within a comment"),
    ],
)
def test_text_that_is_wrong_is_refused_with_its_line(point, record, said, tmp_path):
    with refused(said) as caught:
        read_again(in_text(point), tmp_path)
    assert (caught.value.record, caught.value.file) == (record, tmp_path / "again.net")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (
            binary(POINT, version=1),
            "isis.version kind=binary version=1 names=['2', '5']",
        ),
        (binary(POINT, version=3), "isis.version kind=binary version=3 names=['2', '5']"),
        (binary(POINT, version=4), "isis.version kind=binary version=4 names=['2', '5']"),
        (in_text(POINT_TEXT, head="Version = 2"), "isis.version kind=text version=2 names=['3', '4', '5']"),
        (in_text(POINT_TEXT, head=""), "isis.version kind=text version=1 names=['3', '4', '5']"),
        (binary(POINT, info="NumberOfPoints = 2"), "isis.count count=2 what=points n=1"),
        (binary(POINT, info="NumberOfMeasures = 7"), "isis.count count=7 what=measures n=0"),
        (binary(POINT, header=packed(7, 3)), "isis.count count=3 what=points n=1"),
        (binary(packed(2, 2)), r"record 1 has no PointId \(byte 65551\)"),
        (binary(POINT, packed(1, "Q")), "record 2 has no PointType"),
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
        (binary(POINT).replace(b"HeaderBytes", b"HeaderBits_"), "format.member name=HeaderBytes"),
        (binary(POINT).replace(b"HeaderBytes = 11", b"HeaderBytes = -1"), "format.whole name=HeaderBytes"),
        (binary(POINT, version=2, lengths=True, header=packed(7, b"\x7f")), "ends within a point"),
        (
            binary(POINT, version=2, lengths=True, header=packed(7, b"\x00")),
            "has no PointType|has no PointId",
        ),
        (binary(POINT, version=2, lengths=True), "more bytes than the lengths of all points"),
        (b"Object = IsisCube\nEnd_Object\nEnd\n", "isis.network"),
        (b"", "isis.network"),
    ],
)
def test_networks_that_are_wrong_are_refused(content, said, tmp_path):
    with refused(said):
        read_again(content, tmp_path)


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
    with refused("format.shape name=adjusted required=(2, 3) got=(2, 2)"):
        replace(network.points, adjusted=np.zeros((2, 2)))
    with refused("format.shape name=rest[1] required=(4,) got=(2,)"):
        replace(network.measures, rest=(np.zeros(0, np.uint8), np.zeros(2, np.int64)))
    with refused("format.shape name=firsts required=(3,) got=(1,)"):
        replace(network, firsts=np.zeros(1, np.int64))
    assert {type(network.points), type(network.measures)} == {ControlPoints, ControlMeasures}


def test_a_header_without_room_or_marks_is_refused(tmp_path):
    network = small()
    with refused("isis.label n=65903 size=65536"):
        binary_network(replace(network, description="x" * LABEL))
    with pytest.raises(InputError, match="one kind of quotation mark"):
        network_text(replace(network, description="two\nlines"))
    others = Group("", "label", items=[("Own", "it's")])
    assert read_again(binary_network(replace(network, others=others)), tmp_path).others == others
    assert (tmp_path / "again.net").stat().st_size > LABEL
