"""Plain projects of commit ae1d3bec contain the same cameras, photos, points and observations."""

import json
import lzma
import re
import tomllib
from base64 import b64decode

import pytest
from frozen_projects import FILE, MORE, differences, put, summary

from photogram import formats
from photogram.formats.plain.schema import TABLES
from photogram.formats.plain.settings import KEYS

FROZEN = {
    name: project
    for file in (FILE, MORE)
    for name, project in json.loads(lzma.decompress(file.read_bytes())).items()
}
LATER = {"iterations", "max_bias_ratio"}
"""Keys that the first version did not have."""


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


def test_all_keys_and_words_are_frozen():
    found = {}
    for project in FROZEN.values():
        text = project["files"]["project.toml"].removeprefix("\ufeff")
        settings = tomllib.loads(b64decode(text[7:]).decode("utf-8-sig") if text[:7] == "base64:" else text)
        for section, table in settings.items():
            for name, value in table.items():
                found.setdefault((section, name), set()).add(str(value))
    for key in KEYS:
        if key.name not in LATER:
            assert (key.section, key.name) in found, key
            words = key.words.split()
            # The default is also read without the key.
            assert key.kind != "word" or {*words[1:]} <= found[key.section, key.name], key


def test_almost_all_columns_are_frozen():
    # Numbers that cannot be estimated, and some columns of trajectories, rigs and boards, are not frozen.
    found = {}
    for project in FROZEN.values():
        for file, text in project["files"].items():
            lines = text.removeprefix("\ufeff").splitlines()
            head = next((line for line in lines if line.strip() and line[0] != "#"), "")
            table = file.partition(".")[0].removeprefix("table ")
            found.setdefault(table, set()).update(re.split(r"\s*[,;\t]\s*", head.lower()))
    lacking = {
        f"{name} {column}" for name, table in TABLES.items() for column in {*table.columns} - found[name]
    }
    assert len(lacking) < 30, sorted(lacking)
