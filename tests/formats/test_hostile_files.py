"""Files that were made to fail: packed bombs, endless tags, encodings that are none, damage, wrong types."""

import json
import shutil
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

import photogram
from message_codes import refused
from photogram import InputError, formats
from photogram.cli.job import default_out
from photogram.formats import crs
from photogram.formats.xml_stream import LONGEST, MOST, read_stream, root_of
from photogram.io.delimited import read_columns
from photogram.network.point_sets import similarity
from photogram.network.rays import seen_without_lenses

EXAMPLE = Path(formats.__path__[0]).with_name("examples") / "project"


def packed(path, content, kind=zipfile.ZIP_DEFLATED):
    with zipfile.ZipFile(path, "w", kind) as archive:
        archive.writestr("doc.xml", content)
    return path


def reads(path, match, root="document"):
    begin = time.process_time()
    with refused(match):
        read_stream(path, {}, root)
    assert time.process_time() - begin < 10


def test_an_archive_that_would_grow_without_end_is_refused_by_its_header(tmp_path):
    path = packed(tmp_path / "bomb.xml", b"<document>" + b" " * 80_000_000 + b"</document>")
    reads(path, r"file\.expands ratio=250 names=\['doc\.xml'\] packed=\d{5} size=80000021")


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("bomb.psz", b" " * 80_000_000),
        ("entities.xml", b'<!DOCTYPE d [<!ENTITY a "b">' + b"<!ENTITY c 'd'>" * 10_000 + b"]><document/>"),
        ("tag.xml", b'<document a="' + b"x" * 2_000_000 + b'"/>'),
        ("cut.xml", b"<document"),
    ],
)
def test_a_document_that_is_no_root_is_rejected_by_its_reason(tmp_path, name, content):
    path = tmp_path / name
    if name.endswith(".psz"):
        packed(path, content)
    else:
        path.write_bytes(content)
    for place in (path, tmp_path):
        with pytest.raises(InputError) as found:
            formats.read(place)
        assert found.value.file == path
        assert "plain project" not in found.value.message


def workbook(path, cell):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["point", "x"])
    book.active.append(["a", 1.0])
    book.save(path)
    with zipfile.ZipFile(path) as archive:
        parts = {each: archive.read(each) for each in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    own = parts[sheet].replace(b' t="n"><v>1</v>', b' t="s">' + cell)
    assert own != parts[sheet]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for each, content in {**parts, sheet: own}.items():
            archive.writestr(each, content)
    return path


@pytest.mark.parametrize("cell", [b"<v>inf</v>", b"<v>99</v>", b"<v>" + b" " * 80_000_000 + b"</v>"])
def test_a_damaged_workbook_is_rejected_with_a_remedy(tmp_path, cell):
    path = workbook(tmp_path / "control.xlsx", cell)
    with pytest.raises(InputError) as found:
        read_columns(path)
    assert found.value.file == path
    assert "save " in found.value.message


def test_an_archive_unpacks_no_more_than_its_header_says(tmp_path):
    content = b"<document>" + b"<a/>" * 100_000 + b"</document>"
    path = packed(tmp_path / "liar.xml", content)
    data = path.read_bytes()
    size, lie = len(content).to_bytes(4, "little"), (1000).to_bytes(4, "little")
    assert data.count(size) == 2
    path.write_bytes(data.replace(size, lie))
    reads(path, "xml.packed reason=Bad CRC-32")


@pytest.mark.parametrize(
    ("content", "match"),
    [
        (b'<document a="' + b"x" * 30_000_000 + b'"/>', "xml.tag most=1048576"),
        (b"<document><!-- " + b"x" * 30_000_000 + b" --></document>", "xml.tag most=1048576"),
        (b"<document><a>" + b"x" * 30_000_000 + b"</a></document>", "xml.text most=1048576"),
        (b"<document>" + b"<a/>" * 3_000_000 + b"</document>", "xml.elements most=1000000"),
        (b"<document>" + b"<a>" * 300, "xml.depth most=200"),
        (
            b"<document>" + (b'<a b="' + b"x" * 100_000 + b'"/>') * 700 + b"</document>",
            "xml.elements most=1000000",
        ),
    ],
    ids=["attribute", "comment", "text", "elements", "depth", "attributes"],
)
def test_what_is_endless_is_refused_soon(tmp_path, content, match):
    (tmp_path / "long.xml").write_bytes(content)
    reads(tmp_path / "long.xml", match)


def test_elements_that_are_handed_over_do_not_count(tmp_path):
    path = tmp_path / "many.xml"
    path.write_bytes(b"<document>" + b"<a><b/></a>" * (MOST // 2 + 1000) + b"</document>")
    seen = []
    assert read_stream(path, {"a": seen.append}, "document").children == []
    assert len(seen) == MOST // 2 + 1000
    path.write_bytes(b'<document><a b="' + b"x" * (LONGEST - 100) + b'"/></document>')
    assert len(read_stream(path, {}, "document").children[0].attributes["b"]) == LONGEST - 100


ENCODINGS = ("idna", "rot13", "utf-7", "zlib_codec", "punycode", "hex", "undefined", "utf-32", "none", "raw")


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_encoding_that_is_none_is_refused_and_spoils_no_folder(tmp_path, encoding):
    content = f'<?xml version="1.0" encoding="{encoding}"?><document version="1.2"/>'.encode()
    (tmp_path / "a.xml").write_bytes(content)
    assert root_of(tmp_path / "a.xml")[0] in ("", "document")
    reads(tmp_path / "a.xml", "xml.syntax reason=")
    shutil.copytree(EXAMPLE, tmp_path, dirs_exist_ok=True)
    assert formats.read(tmp_path).title == "plain project"


@pytest.mark.parametrize("kind", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_archives_that_are_damaged_are_refused(tmp_path, kind):
    random = np.random.default_rng(3)
    content = (
        b"<document version='1.2'>" + b"".join(b"<a>%d</a>" % each for each in range(500)) + b"</document>"
    )
    whole = packed(tmp_path / "whole.psz", content, kind).read_bytes()
    refused = []
    for _ in range(150):
        data = bytearray(whole)
        data[int(random.integers(len(data)))] ^= int(random.integers(1, 256))
        path = tmp_path / "damaged.psz"
        path.write_bytes(data)
        root_of(path)
        try:
            read_stream(path, {}, "document")
        except InputError as error:
            refused.append(str(error))
    assert len(refused) > 100
    assert not any("None" in each for each in refused)


@pytest.mark.parametrize("camera", [[], {}, None, 3, ["a"]])
def test_a_camera_that_is_no_name_is_refused(tmp_path, camera):
    model = {
        "cameras": {"a": {"projection_type": "perspective", "width": 10, "height": 8, "focal": 1.0}},
        "shots": {"one.jpg": {"camera": camera, "rotation": [0, 0, 0], "translation": [0, 0, 0]}},
        "points": {},
    }
    (tmp_path / "reconstruction.json").write_text(json.dumps([model]))
    (tmp_path / "tracks.csv").write_text("OPENSFM_TRACKS_VERSION_v2\n")
    with pytest.raises(InputError, match=r"reconstruction\.json.*one\.jpg/camera: must be text"):
        formats.read(tmp_path)


def parquet(path, **columns):
    pyarrow = pytest.importorskip("pyarrow")
    pytest.importorskip("pyarrow.parquet").write_table(pyarrow.table(columns), path)
    return path


def test_names_that_are_numbers_with_decimals_are_refused_with_file_and_column(tmp_path):
    shutil.copytree(EXAMPLE, tmp_path, dirs_exist_ok=True)
    (tmp_path / "control.csv").unlink()
    parquet(tmp_path / "control.parquet", point=[1.5, 2.5], x=[1.0, 2.0], y=[1.0, 2.0], z=[1.0, 2.0])
    with pytest.raises(
        InputError,
        match=r"control\.parquet: the column point must contain text or integers, got decimal numbers",
    ):
        formats.read(tmp_path)
    parquet(tmp_path / "control.parquet", x=[1.0, 2.0], y=[1.0, 2.0], z=[1.0, 2.0])
    with pytest.raises(InputError, match=r"control\.parquet: the column point is required"):
        formats.read(tmp_path)


def test_empty_and_infinite_numbers_of_parquet_are_those_of_text(tmp_path):
    nan = float("nan")
    path = parquet(tmp_path / "a.parquet", x=[1.0, nan], y=[1.0, float("inf")], use=[nan, nan])
    table = read_columns(path, numbers=("x", "y"))
    assert table.numbers("x", 7.0).tolist() == [1.0, 7.0]
    assert table.numbers("x", 7.0, read=lambda text: 2 * float(text)).tolist() == [2.0, 7.0]
    assert table.texts("use", "none") == ["none", "none"]
    assert table.numbers("y", infinite=True)[1] == np.inf
    with pytest.raises(InputError, match=r"a\.parquet, record 2: column y: must be a finite number"):
        table.numbers("y")


def test_a_column_of_text_in_parquet_has_numbers_where_they_are_asked_for(tmp_path):
    path = parquet(tmp_path / "a.parquet", x=["1.5", ""], y=["", "wide"])
    table = read_columns(path)
    assert table.numbers("x", 7.0).tolist() == [1.5, 7.0]
    with pytest.raises(InputError) as found:
        table.numbers("y")
    assert (found.value.file, found.value.record) == (path, 2)


def test_a_camera_that_shows_everything_in_one_point_is_named():
    block = photogram.simulate(strips=1, photos_per_strip=3, points_per_photo=12, seed=5).block
    flat = photogram.Camera("pinhole", {"fx": 1e-30, "fy": 1e-30, "cx": 1000.0, "cy": 800.0}, name="flat")
    with pytest.raises(InputError, match="camera flat"):
        seen_without_lenses(
            block.replace(cameras=[flat], photo_cameras=np.zeros(3, int), principal_distances=None)
        )


def test_a_similarity_of_extreme_coordinates_is_none():
    model = np.array([[0.0, 0.0, 0.0], [1e200, 0.0, 1.0], [0.0, 1e200, 0.0]])
    assert similarity(model, model)[3] == np.inf


def test_links_that_lead_nowhere_or_in_circles_are_named(tmp_path):
    for name in ("one", "other"):
        shutil.copytree(EXAMPLE, tmp_path / name)
    (tmp_path / "one" / "more.csv").symlink_to("more.csv")
    assert (
        "files without the name of a table are ignored: more.csv; rename them, or name them in [tables]"
        in [each.text for each in formats.read(tmp_path / "one").messages]
    )
    (tmp_path / "other" / "images.csv").unlink()
    (tmp_path / "other" / "images.csv").symlink_to("images.csv")
    with pytest.raises(InputError, match=r"images\.csv is missing"):
        formats.read(tmp_path / "other")
    (tmp_path / "loop").symlink_to("loop")
    assert default_out(tmp_path / "loop", "-adjusted").name == "loop-adjusted"


def test_spellings_of_systems_that_proj_would_like_to_drop_are_read_in_silence():
    pytest.importorskip("pyproj")
    assert crs.is_projected("+init=epsg:25832")


@pytest.mark.parametrize("sd", [1e-200, 1e200])
def test_deviations_whose_squares_are_no_numbers_are_refused(sd):
    with refused(r"sd of distance a - b: error\.range .*low=1e-150 high=1e\+150"):
        photogram.network.observations.Distance("a", "b", 1.0, sd)
