"""Plain projects of commit ae1d3bec contain the same cameras, photos, points and observations."""

import json
import lzma

import pytest
from frozen_projects import FILE, differences, put, summary

from photogram import formats
from photogram.formats.plain.schema import TABLES

FROZEN = json.loads(lzma.decompress(FILE.read_bytes()))


@pytest.mark.parametrize("name", FROZEN)
def test_a_project_of_the_first_version_is_unchanged(name, tmp_path):
    project = formats.read(put(FROZEN[name]["files"], tmp_path))
    after = json.loads(json.dumps(summary(project)))
    assert differences(FROZEN[name]["summary"], after) == []


def test_all_tables_are_frozen():
    files = {
        file.partition(".")[0].removeprefix("table ") for each in FROZEN.values() for file in each["files"]
    }
    assert set(TABLES) <= files
