"""Control networks of ISIS: read, written, read again without loss."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from control_networks import (
    LABEL,
    MEASURE,
    POINT,
    POINT_TEXT,
    binary,
    differing,
    full_message,
    in_text,
    packed,
    read_again,
    small,
    varint,
)

from golden_data import SHARED, needs
from message_codes import refused
from photogram import InputError
from photogram.formats.isis import binary_network, network_text, read_network
from photogram.formats.isis.network import is_network
from photogram.io.pvl import Group

NETWORKS = SHARED / "moving" / "control_network"
PUBLISHED = (
    NETWORKS / "csm_version2.net",
    NETWORKS / "lro_version5.net",
    SHARED / "moving" / "lro" / "observationPair.net",
)
published = needs("moving", "control_network")


@published
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
    assert points.is_fixed.sum() == answer["types"]["1"] + answer["types"]["4"]
    assert points.is_constrained.sum() == answer["types"]["3"]
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


@published
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


@published
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


@published
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


@published
def test_text_is_that_of_isis_but_for_its_comments():
    def lines(text):
        return [line for line in text.split("\n") if line.strip() and not line.strip().startswith("#")]

    original = PUBLISHED[2].read_text(encoding="utf-8")
    assert lines(network_text(read_network(PUBLISHED[2])).decode()) == lines(original)


@published
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
    with refused("isis.fields"):
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


def test_version_2_lists_the_lengths_of_its_points(tmp_path):
    lengths = packed(7, varint(len(POINT)) + varint(len(full_message())))
    other = POINT.replace(b"P1", b"P2")
    network = read_again(binary(other, full_message(), version=2, lengths=True, header=lengths), tmp_path)
    assert (network.version, network.points.ids, len(network.measures)) == (2, ["P2", "P1"], 2)
    assert binary_network(network).endswith(full_message())


@pytest.mark.parametrize("write", [binary_network, network_text])
def test_a_network_is_made_of_columns_alone(write, tmp_path):
    others = Group("", "label", items=[("Größe", "è vero")])
    network = replace(small(), description='Région "A"', others=others)
    again = read_again(write(network), tmp_path)
    assert differing(network, again) == []
    assert np.isnan(again.points.adjusted).tolist() == [[False, True, True]] * 2
