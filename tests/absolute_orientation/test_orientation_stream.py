"""Part II: any number of points from file to file, whole or not at all."""

import json
import time

import numpy as np
import pandas as pd
import pytest
from orientation_models import SIZE, simulate

from message_codes import coded
from photogram import InputError, orient
from photogram.absolute_orientation import Similarity, read_similarity, stream, transform_file


@pytest.fixture(scope="module")
def oriented():
    generator = np.random.default_rng(8)
    model = simulate(generator, angles=(0.1, 0.2, 2.0))
    return orient(model.stations(model_error=0.004 * generator.standard_normal((8, 3))))


@pytest.fixture
def small_chunks(monkeypatch):
    monkeypatch.setattr(stream, "CHUNK", 7)


def points(count):
    generator = np.random.default_rng(count)
    return np.round(0.2 * SIZE * generator.uniform(-0.5, 0.5, (count, 3)), 4)


def write_csv(path, model, sd=None):
    table = pd.DataFrame(model, columns=["x", "y", "z"])
    table.insert(0, "id", [f"P{i}" for i in range(len(model))])
    if sd is not None:
        table[["sd_x", "sd_y", "sd_z"]] = sd
    table.to_csv(path, index=False)
    return path


@pytest.mark.parametrize("count", [1, 7, 50])
@pytest.mark.parametrize("weighted", [False, True])
def test_a_csv_file(oriented, small_chunks, tmp_path, count, weighted):
    model = points(count)
    sd = np.random.default_rng(1).uniform(0, 0.01, model.shape) if weighted else None
    done = []
    source = write_csv(tmp_path / "points.csv", model, sd)
    total = transform_file(
        oriented.similarity, source, tmp_path / "out.csv", decimals=5, point_sd=0.002, progress=done.append
    )
    assert total == done[-1] == count
    assert len(done) == -(-count // 7)
    found = pd.read_csv(tmp_path / "out.csv")
    positions, covariances = oriented.similarity.transform(model, 0.002 if sd is None else sd)
    assert found["id"].tolist() == [f"P{i}" for i in range(count)]
    np.testing.assert_allclose(found[["X", "Y", "Z"]], positions, atol=0.51e-5)
    deviations = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    np.testing.assert_allclose(found[["sd_X", "sd_Y", "sd_Z"]], deviations, atol=0.51e-6)


@pytest.mark.parametrize("separator", [" ", "   ", ",", "\t"])
def test_lines_of_part_two(oriented, tmp_path, separator):
    model = points(5)
    lines = [separator.join([*map(str, row), f"{k}"]) for k, row in enumerate(model.tolist(), 1)]
    (tmp_path / "points.txt").write_text("\n".join(lines) + "\n\n")
    assert transform_file(oriented.similarity, tmp_path / "points.txt", tmp_path / "out.csv") == 5
    found = pd.read_csv(tmp_path / "out.csv", dtype={"id": str})
    assert found["id"].tolist() == ["1", "2", "3", "4", "5"]
    np.testing.assert_allclose(found[["X", "Y", "Z"]], oriented.similarity.transform(model)[0], atol=1e-6)


def test_identifiers_keep_their_characters(oriented, tmp_path):
    names = ["A,1", 'B"2', "007", "NA", "ä#", ""]
    table = pd.DataFrame({"id": names, **dict.fromkeys("xyz", 1.0), "note": ["x"] * 6})
    table.to_csv(tmp_path / "points.csv", index=False)
    transform_file(oriented.similarity, tmp_path / "points.csv", tmp_path / "out.csv")
    found = pd.read_csv(tmp_path / "out.csv", dtype=str, keep_default_na=False)
    assert found["id"].tolist() == names


def test_an_unknown_covariance_leaves_the_deviations_empty(oriented, tmp_path):
    similarity = oriented.similarity
    bare = Similarity.from_parameters(similarity.scale, similarity.rotation, similarity.translation)
    source = write_csv(tmp_path / "points.csv", points(3))
    transform_file(bare, source, tmp_path / "out.csv")
    found = pd.read_csv(tmp_path / "out.csv")
    assert found[["sd_X", "sd_Y", "sd_Z"]].isna().all(axis=None)
    np.testing.assert_allclose(found[["X", "Y", "Z"]], similarity.transform(points(3))[0], atol=1e-6)


def test_the_document_gets_the_points_too(oriented, small_chunks, tmp_path):
    model = points(20)
    (tmp_path / "result.json").write_bytes(oriented.to_json())
    similarity = read_similarity(tmp_path / "result.json")
    here, there = (each.transform(model) for each in (oriented.similarity, similarity))
    np.testing.assert_allclose(there[0], here[0], rtol=1e-12)
    np.testing.assert_allclose(there[1], here[1], rtol=1e-6, atol=1e-12)

    document = stream.Document(tmp_path / "all.json", b'{"a": 1,\n  "points": [', b'\n    {"id": "first"}')
    source = write_csv(tmp_path / "points.csv", model)
    transform_file(similarity, source, tmp_path / "out.csv", document=document)
    written = json.loads((tmp_path / "all.json").read_bytes())["points"]
    assert [point["id"] for point in written] == ["first", *(f"P{i}" for i in range(20))]
    np.testing.assert_allclose([point["position"] for point in written[1:]], here[0], rtol=1e-12)
    np.testing.assert_allclose([point["covariance"] for point in written[1:]], here[1], rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must contain points"),
        ("id,x,y,z\n", "must contain points"),
        ("id,x,y\nA,1,2\n", "requires the columns z"),
        ("id,x,y,z,sd_x\nA,1,2,3,4\n", "requires the columns sd_y"),
        ("id,x,y,z\nA,1,2,3\nB,1,two,3\n", "record 3: column y: must be a finite number, got 'two'"),
        ("id,x,y,z\nA,1,2,3\n\nB,1,,3\n", "record 4: column y: must be a finite number, got ''"),
        ("id,x,y,z\nA,1,2,inf\n", "record 2: column z: must be a finite number, got 'inf'"),
        ("id,x,y,z\nA,1,2\n", "record 2: the record must have 4 fields, got 3"),
        ("id,x,y,z\nA,1,2,3\nB,1,2,3,4\n", "record 3: the record must have 4 fields, got 5"),
        ("id,x,y,z\nA,1,2,3,4\n", "record 2: the record must have 4 fields, got 5"),
        (
            "id,x,y,z,sd_x,sd_y,sd_z\nA,1,2,3,1,1,-1\n",
            "record 2: column sd_z: must be a finite number, zero or positive, got '-1'",
        ),
        ("1 2 3 A\n4 5 B\n", "record 2: the record must have 4 fields, got 3"),
        (
            "id,x,y,z\nA,1,2," + "9" * 140_000 + "\n",
            "record 2: the record must have at most 100000 characters, got 140006",
        ),
        ("id,x,y,z" + "," * 420_000 + "\nA,1,2,3\n", "record 1: the record must have at most "),
        ("id,x,y,z,,\nA,1,2,3,,\n", "record 1: the column '' occurs twice"),
        ("id,x,y,z,x\nA,1,2,3,4\n", "record 1: the column 'x' occurs twice"),
        ('id,x,y,z\n"A\nB",1,2,3\n', "record 2: the record must have "),
        ("id,x,y,z\nA,1e308,1e308,3\n", "the transformed point A exceeds double precision"),
        ("1 2 3 A\n4 5 x B\n", "record 2: column z: must be a finite number, got 'x'"),
    ],
)
def test_faults_leave_no_file(oriented, small_chunks, tmp_path, text, message):
    source = tmp_path / "points.csv"
    source.write_text("".join(f"{line}\n" for line in text.splitlines()))
    (tmp_path / "out.csv").write_text("before")
    with pytest.raises(InputError) as caught:
        transform_file(oriented.similarity, source, tmp_path / "out.csv")
    assert message in str(caught.value)
    assert (tmp_path / "out.csv").read_text() == "before"
    assert {path.name for path in tmp_path.iterdir()} == {"points.csv", "out.csv"}


def test_a_fault_far_down_and_an_interruption_leave_no_file(oriented, small_chunks, tmp_path):
    source = write_csv(tmp_path / "points.csv", points(40))
    source.write_text(source.read_text() + "P40,1,2,z\n")
    with pytest.raises(InputError, match="record 42"):
        transform_file(oriented.similarity, source, tmp_path / "out.csv")

    def interrupt(done):
        if done > 20:
            raise KeyboardInterrupt

    document = stream.Document(tmp_path / "result.json", b'{"points": [')
    with pytest.raises(KeyboardInterrupt):
        transform_file(
            oriented.similarity, source, tmp_path / "out.csv", document=document, progress=interrupt
        )
    assert [path.name for path in tmp_path.iterdir()] == ["points.csv"]


def test_files_that_cannot_be_read(oriented, tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        transform_file(oriented.similarity, tmp_path / "none.csv", tmp_path / "out.csv")
    (tmp_path / "latin.csv").write_bytes("id,x,y,z\n\xe4,1,2,3\n".encode("latin-1"))
    with pytest.raises(InputError, match="utf-8"):
        transform_file(oriented.similarity, tmp_path / "latin.csv", tmp_path / "out.csv")
    for text in ("{", '{"scale": 1}', "[]"):
        (tmp_path / "bad.json").write_text(text)
        with pytest.raises(InputError, check=coded("error.parse" if text == "{" else "error.content")):
            read_similarity(tmp_path / "bad.json")


def test_a_deviation_that_is_none(oriented, tmp_path):
    source = write_csv(tmp_path / "points.csv", points(3))
    for value in (-1.0, np.nan, np.inf):
        with pytest.raises(InputError, check=coded("error.not-negative")):
            transform_file(oriented.similarity, source, tmp_path / "out.csv", point_sd=value)


DAMAGE = (None, "x", True, -1, 0, 1e308, -1e308, 10**15, [], {}, [[]], [None] * 3, [1e308] * 3, "\u2028")


def test_damaged_documents_are_refused_or_give_finite_points(oriented, tmp_path):
    """Every value of a document in turn, and its text cut anywhere."""
    path = tmp_path / "result.json"
    text = oriented.to_json().decode()
    whole = json.loads(text)
    places = [(name,) for name in ("scale", "rotation", "translation", "covariance", "centres", "status")]
    places += [
        ("messages",),
        ("usable",),
        ("deviation_factor",),
        ("centres", "control"),
        ("centres", "model"),
    ]
    places += [
        ("rotation", 1),
        ("rotation", 1, 2),
        ("translation", 0),
        ("covariance", 3),
        ("covariance", 3, 3),
    ]
    damaged = []
    for place in places:
        for value in DAMAGE:
            document = json.loads(text)
            inner = document
            for key in place[:-1]:
                inner = inner[key]
            inner[place[-1]] = value
            damaged.append(json.dumps(document))
        del inner[place[-1]]
        damaged.append(json.dumps(document))
    generator = np.random.default_rng(5)
    damaged += [text[:cut] for cut in generator.integers(0, len(text), 60).tolist()]
    damaged += ["[" * 3000, "null", "7", '"x"', json.dumps([whole])]
    source = write_csv(tmp_path / "points.csv", points(2))
    refusals = []
    for each in damaged:
        path.write_text(each)
        try:
            transform_file(read_similarity(path, usable=True), source, tmp_path / "out.csv")
        except InputError as error:
            refusals.append(str(error))
    assert len(refusals) > 0.6 * len(damaged)
    for refusal in refusals:
        assert refusal.startswith(str(path)) or "double precision" in refusal


def test_decimals_follow_the_deviation():
    assert [stream.decimals_for(value) for value in (30, 0.05, 1e-4, 0.0, 1e-30)] == [2, 5, 7, 6, 15]


@pytest.mark.speed
def test_a_hundred_thousand_points_are_quick(oriented, tmp_path):
    """A million takes seconds; a tenth of it here, with a limit that only another order breaks."""
    source = write_csv(tmp_path / "points.csv", points(100_000))
    start = time.process_time()
    transform_file(oriented.similarity, source, tmp_path / "out.csv")
    assert time.process_time() - start < 3
