"""`photogram convert`: what the name of OUT says, and round trips through every format that is written."""

from pathlib import Path

import numpy as np
import pytest
from test_plain_project import EXAMPLE

import photogram
from message_codes import refused
from photogram import Spheroid, adjust, formats
from photogram.formats.models import in_topocentric, topocentric_remarks
from photogram.network import lengths_of_units
from photogram.network.rays import image_directions


@pytest.mark.parametrize(
    ("out", "name", "files"),
    [
        ("tables", "plain", {"tables/project.toml", "tables/images.csv"}),
        ("there/quarry.toml", "plain", {"there/quarry.toml", "there/images.csv"}),
        ("sparse", "colmap", {"sparse/cameras.bin", "sparse/images.bin"}),
        ("sparse/0", "colmap", {"sparse/0/cameras.bin"}),
        ("model-colmap", "colmap", {"model-colmap/points3D.bin"}),
        ("colmap_text", "colmap_text", {"colmap_text/cameras.txt"}),
        ("run/opensfm", "opensfm", {"run/opensfm/reconstruction.json"}),
        ("reconstruction.json", "opensfm", {"reconstruction.json", "tracks.csv"}),
        ("block.xml", "blocks_exchange", {"block.xml"}),
        ("cameras.xml", "agisoft", {"cameras.xml"}),
        ("b/bundle.out", "bundler", {"b/bundle.out", "b/list.txt"}),
        ("own.out", "bundler", {"own.out", "list.txt"}),
        ("own.bal", "bal", {"own.bal"}),
        ("problem-6-16.txt", "bal", {"problem-6-16.txt"}),
        ("pixels.csv", "pixels", {"pixels.csv"}),
        ("p/flight.im", "patb", {"p/flight.im", "p/flight.ori", "p/flight.con", "p/names.csv"}),
        ("image.dat", "bingo", {"image.dat", "orientation.dat", "cameras.csv"}),
        ("v1.2", "plain", {"v1.2/project.toml"}),
    ],
)
def test_the_name_of_the_output_says_the_format(run, tmp_path, out, name, files):
    done = run("convert", "--example", out)
    assert done.exit_code == 0, done.output
    assert f"--to {name}" in done.output
    assert files <= {str(each.relative_to(tmp_path)) for each in tmp_path.rglob("*")}
    if name != "pixels":
        assert formats.read(tmp_path / out).block.photo_ids


def test_an_option_says_the_format_of_any_name(run, tmp_path):
    done = run("convert", "--example", "whatever.xml", "--to", "agisoft")
    assert done.exit_code == 0, done.output
    assert (tmp_path / "whatever.xml").is_file()
    assert run("convert", "--example", "model", "--to", "blocks_exchange").exit_code == 0
    assert (tmp_path / "model" / "block.xml").is_file()
    assert run("convert", "--example", "images.csv", "--to", "colmap").exit_code == 0
    assert (tmp_path / "images.csv" / "cameras.bin").is_file()


def test_a_name_that_may_be_two_formats_is_refused(run, tmp_path):
    done = run("convert", "--example", "whatever.xml")
    assert done.exit_code == 1
    for word in ("whatever.xml", "--to blocks_exchange", "--to agisoft"):
        assert word in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_format_that_is_only_read_is_refused_with_those_that_are_written(run, tmp_path):
    done = run("convert", "--example", "own", "--to", "dbat")
    assert done.exit_code == 1
    assert "the format for writing must be one of plain, colmap" in done.stderr.replace("\n", " ")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["info", "check", "adjust"])
def test_commands_have_the_example(run, tmp_path, command):
    done = run(command, "--example")
    assert done.exit_code == 0, done.output
    assert "drone   opencv  4000 x 3000" in done.output
    for words in ((), ("some", "--example")):
        refused = run(command, *words)
        assert refused.exit_code == 2
        assert "specify one of PATH, --example" in refused.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "specify one of IN, --example"),
        (("a", "b", "--example"), "specify one of IN, --example"),
        (("a",), "OUT: must be specified"),
        (("--example",), "OUT: must be specified"),
    ],
)
def test_arguments_that_are_missing_or_too_many_are_named(run, words, message):
    refused = run("convert", *words)
    assert refused.exit_code == 2
    assert message in " ".join(refused.stderr.replace("│", " ").split())


# A table of pixels has no poses, cards of GIANT refuse the observations beside images: both have own tests.
WITH_POSES = [
    name for name, each in formats.FORMATS.items() if each.write and name not in ("pixels", "giant")
]


@pytest.mark.parametrize("name", WITH_POSES)
def test_every_format_that_is_written_keeps_its_rays(tmp_path, name):
    project = formats.read(EXAMPLE)
    for path, content in formats.target(tmp_path / "there", name).files(project).items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    where = tmp_path / "there"
    main = formats.FORMATS[name].files
    block = formats.read(where / main[0] if main else where, file_format=name).block
    assert len(block.photo_ids) == len(project.block.photo_ids)
    rays = image_directions(project.block)
    count = len(block.image_xy)
    if name == "agisoft":
        assert 0 < count < len(rays)
        return
    assert count == len(rays)
    # Formats order images as they like: the rays of each photo, sorted, are the same.
    limit = {"patb": 1e-7}.get(name, 1e-12)
    for photo in range(len(block.photo_ids)):
        mine = rays[project.block.image_photos == photo]
        own = image_directions(block)[block.image_photos == photo]
        np.testing.assert_allclose(np.sort(own[:, 0]), np.sort(mine[:, 0]), rtol=0, atol=limit)
        np.testing.assert_allclose(np.sort(own[:, 1]), np.sort(mine[:, 1]), rtol=0, atol=limit)


@pytest.mark.parametrize("out", ["own", "own/images.csv", "own/../own/project.toml", "link.csv"])
def test_nothing_is_written_over_the_input(run, tmp_path, out):
    run("new", "own")
    (tmp_path / "link.csv").symlink_to(tmp_path / "own" / "images.csv")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    done = run("convert", "own", out)
    assert done.exit_code == 1
    assert "over the input" in done.stderr
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_the_name_of_an_unknown_format_is_refused():
    with refused("format.unknown what=format value=nothing"):
        formats.target(EXAMPLE / "other", "nothing")


def test_a_geographic_project_keeps_its_rays_and_control_in_a_topocentric_frame():
    sample = formats.read(Path(photogram.__file__).parent / "examples" / "galveston")
    found = in_topocentric(sample)
    assert 29 < topocentric_remarks(sample)[0].fields["latitude"] < 30
    assert found.block.frame.origin is None  # of Clarke 1866, whose datum nobody has said
    given, made = adjust(sample.block, tolerance=1e-9), adjust(found.block, tolerance=1e-9)
    held = np.isfinite(sample.block.point_sd)
    np.testing.assert_array_equal(np.isfinite(found.block.point_sd), held)
    assert (held.sum(axis=1) % 3 > 0).any()  # control in plan or height alone
    assert made.sums_of_squares.plates == pytest.approx(given.sums_of_squares.plates, rel=1e-3)
    lengths = lengths_of_units(given.point_positions, sample.block.spheroid)
    np.testing.assert_allclose(made.point_sd, given.point_sd * lengths, rtol=0.01)
    known = sample.block.replace(spheroid=Spheroid.wgs84())
    assert in_topocentric(sample.replace(block=known)).block.frame.kind == "topocentric"
