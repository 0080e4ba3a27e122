"""Parts of a project on disk, read in batches: those of the same project read as a whole."""

import shutil

import numpy as np
import pandas as pd
import pytest
from test_parts import OPTIONS, tied_block

from message_codes import rejected
from photogram import Distance, InputError, Position
from photogram.adjustment.first_features import started
from photogram.distributed.run import partition, read_manifest, read_node
from photogram.formats import Project, ReadOptions, in_parts, read, to_files
from photogram.formats.in_parts import Streamed, streamable
from photogram.io import delimited
from photogram.network import Relative


def project_of(block, folder):
    """Write a block as a plain project whose images lie in Parquet."""
    kinds = (Distance, Position, Relative)
    block = block.replace(observations=[each for each in block.observations if isinstance(each, kinds)])
    count = len(block.cameras)
    starts = np.full((len(block.point_ids), 3), np.nan)
    none = (None,) * count
    project = Project(block=block, path=folder, title="", sizes=none, pixel_mm=none, starts=starts)
    folder.mkdir()
    for name, content in to_files(project, "plain").items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    table = pd.read_csv(folder / "images.csv", dtype={"photo": str, "point": str}, comment="#")
    table.to_parquet(folder / "images.parquet")
    (folder / "images.csv").unlink()
    return folder


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    return project_of(tied_block(), tmp_path_factory.mktemp("project") / "tied")


def copied(project, folder):
    shutil.copytree(project, folder)
    return folder


def in_text(project, folder):
    """Copy a project with its image observations as text."""
    copied(project, folder)
    pd.read_parquet(folder / "images.parquet").to_csv(folder / "images.csv", index=False)
    (folder / "images.parquet").unlink()
    return folder


def omitted(project, folder):
    """Copy a project with an omitted photo and omitted image observations."""
    copied(project, folder)
    table = pd.read_parquet(folder / "images.parquet")
    table.assign(use=["off" if row % 7 == 3 else "" for row in range(len(table))]).to_parquet(
        folder / "images.parquet"
    )
    return folder


def weighted(project, folder):
    """Copy a project with points, of which some are weighted, and more observations of points."""
    copied(project, folder)
    block = read(project).block
    tied = [name for name in block.point_ids if name[0] not in "CK"]
    lines = [f"{name},{k},{2 * k},3,{'0.5' if k % 5 == 0 else ''}" for k, name in enumerate(tied[:60])]
    (folder / "points.csv").write_text("\n".join(["point,x,y,z,sd", *lines, ""]))
    (folder / "levels.csv").write_text("level,z\nlake,3\n")
    rows = [f"lake,{name},0.1" for name in (*tied[7:9], *tied[-2:])]
    (folder / "level_points.csv").write_text("\n".join(["level,point,sd", *rows, ""]))
    (folder / "lengths.csv").write_text(f"line,from,to,length,sd\nL,{tied[20]},{tied[30]},4,1\n")
    return folder


def of_each_photo(project, folder):
    """Copy a project in which each photo has a camera."""
    copied(project, folder)
    table = pd.read_csv(folder / "cameras.csv", dtype={"camera": str}, comment="#")
    table.assign(for_each="photo").to_csv(folder / "cameras.csv", index=False)
    return folder


@pytest.mark.parametrize("changed", [copied, in_text, omitted, weighted, of_each_photo])
@pytest.mark.parametrize("size", [1 << 30, 20_000])
def test_parts_are_those_of_the_project_read_whole(project, tmp_path, monkeypatch, changed, size):
    monkeypatch.setattr(in_parts, "BUCKET", size)
    monkeypatch.setattr(delimited, "LARGE", 1000)
    monkeypatch.setattr(delimited, "PIECE", 3000)
    project = changed(project, tmp_path / "project")
    block = read(project).block
    expected = partition(started(block), tmp_path / "whole", 4, OPTIONS, "")
    assert streamable(project, 40_000)
    assert streamable(project, 1 << 40) == (changed is not in_text)
    own = Streamed(project, ReadOptions(), tmp_path / "parts", size=size)
    np.testing.assert_array_equal(own.images, np.bincount(block.image_photos))
    assert own.source(OPTIONS) == own.source(OPTIONS)
    tree, counts = own.counted(4)
    assert len(tree) == 7
    assert counts.photos.sum() == len(block.photo_ids)
    found = own.divided(tmp_path / "parts", 4, OPTIONS, "")
    assert not (tmp_path / "parts" / "buckets").exists()
    assert found.tree == expected.tree
    assert found.outer == expected.outer
    for name in ("middle", "weighted", "photos", "images", "held"):
        assert getattr(found, name) == getattr(expected, name)
    for node in range(len(tree)):
        one, other = (
            read_node(tmp_path / each, read_manifest(tmp_path / each), node) for each in ("parts", "whole")
        )
        same(one, other)


def test_names_may_come_with_all_that_the_file_has(project, tmp_path):
    folder = copied(project, tmp_path / "categories")
    table = pd.read_parquet(project / "images.parquet")
    names = [*(f"unseen {row}" for row in range(1000)), *sorted(set(table["point"]))]
    table.assign(point=pd.Categorical(table["point"], names)).to_parquet(folder / "images.parquet")
    of_names, of_texts = (
        Streamed(each, ReadOptions(), tmp_path / f"parts of {each.name}", size=3200)
        for each in (folder, project)
    )
    np.testing.assert_array_equal(of_names.images, of_texts.images)
    found = of_names.divided(tmp_path / "parts", 4, OPTIONS, "")
    expected = of_texts.divided(tmp_path / "others", 4, OPTIONS, "")
    assert (found.points, found.images) == (expected.points, expected.images)


def same(one, other):
    """Compare two parts: the order of points is free."""
    for name in ("photos", "owners", "observations", "unknowns"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for name in ("photo_positions", "photo_attitudes", "photo_position_sd", "photo_cameras"):
        np.testing.assert_array_equal(getattr(one.block, name), getattr(other.block, name))
    assert one.block.cameras == other.block.cameras
    order = [one.block.point_ids.index(name) for name in other.block.point_ids]
    assert len(order) == len(one.block.point_ids)
    np.testing.assert_array_equal(one.block.point_positions[order], other.block.point_positions)
    np.testing.assert_array_equal(one.block.point_sd[order], other.block.point_sd)
    first, second = np.argsort(one.images), np.argsort(other.images)
    np.testing.assert_array_equal(one.images[first], other.images[second])
    for name in ("image_photos", "image_xy", "image_sd"):
        np.testing.assert_array_equal(getattr(one.block, name)[first], getattr(other.block, name)[second])
    names = [[each.block.point_ids[row] for row in each.block.image_points] for each in (one, other)]
    assert [names[0][row] for row in first] == [names[1][row] for row in second]
    for mine, theirs in zip(one.block.observations, other.block.observations, strict=True):
        assert mine.name == theirs.name
        np.testing.assert_array_equal(mine.observed, theirs.observed)


@pytest.mark.parametrize("form", [copied, in_text])
def test_a_photo_that_is_not_there_is_named(project, tmp_path, form):
    folder = copied(project, tmp_path / "copy")
    table = pd.read_parquet(folder / "images.parquet")
    table.loc[7, "photo"] = "nowhere"
    table.to_parquet(folder / "images.parquet")
    folder = form(folder, tmp_path / "form")
    with rejected("error.column photo: error.unknown photo nowhere") as raised:
        Streamed(folder, ReadOptions(), tmp_path / "parts").counted(2)
    assert raised.value.file.stem == "images"
    assert raised.value.record == (8 if form is copied else 9)


def test_a_repeated_image_is_named_with_both_records(project, tmp_path):
    folder = copied(project, tmp_path / "copy")
    table = pd.read_parquet(folder / "images.parquet")
    pd.concat([table, table[40:41]]).to_parquet(folder / "images.parquet")
    with rejected("plain.image-twice 41") as raised:
        Streamed(folder, ReadOptions(), tmp_path / "parts", size=3200).counted(2)
    assert raised.value.record == len(table) + 1


def test_a_tied_point_that_is_not_there_is_named(project, tmp_path):
    folder = copied(project, tmp_path / "copy")
    (folder / "levels.csv").write_text("level,z\nlake,3\n")
    (folder / "level_points.csv").write_text("level,point,sd\nlake,nowhere,0.1\n")
    with rejected("error.column point: error.unknown point nowhere"):
        Streamed(folder, ReadOptions(), tmp_path / "parts")


def test_features_are_refused(project, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(project, folder)
    with (folder / "project.toml").open("a") as file:
        file.write('[features]\nd = { distance = ["a", "b"] }\n')
    with pytest.raises(InputError, match=r"\[features\] require joint covariances"):
        Streamed(folder, ReadOptions(), tmp_path / "parts")


def test_a_free_project_is_refused_before_its_images_are_read(tmp_path):
    block = tied_block()
    free = np.full_like(block.point_sd, np.inf)
    project = project_of(
        block.replace(observations=[], point_sd=free, photo_position_sd=np.inf),
        tmp_path / "free",
    )
    with pytest.raises(InputError, match=r"the block requires a datum.* photogram\.adjust_in_parts\("):
        Streamed(project, ReadOptions(), tmp_path / "parts")


def test_other_files_are_not_streamed(project):
    assert streamable(project / "project.toml")
    assert not streamable(project / "images.parquet")
