"""The options of reading a project: checks, forms of the command line, and data that they add."""

from pathlib import Path

import numpy as np
import pytest

from photogram import Distance, InputError, formats
from photogram.formats import ReadOptions
from photogram.formats.read_options import REQUIRED, deviations

EXAMPLE = Path(formats.__file__).parents[1] / "examples" / "project"
VALUES = {"mrk_antenna": True, "gnss_antenna": (0.0, 0.1, 0.2, 0.0)}


@pytest.mark.parametrize("name", REQUIRED)
def test_an_option_requires_one_of_others(name):
    with pytest.raises(InputError) as error:
        ReadOptions(**{name: VALUES.get(name, "a")})
    fields = error.value.phrase.fields
    assert (fields["what"], fields["message"].code) == (name, "usage.requires")
    assert fields["message"].fields["options"] == list(REQUIRED[name])
    for other in REQUIRED[name]:
        assert getattr(ReadOptions(**{name: VALUES.get(name, "a"), other: "b"}), other) == Path("b")


@pytest.mark.parametrize(
    "wrong",
    [
        {"columns": "colour=x"},
        {"roles": "KP=unknown"},
        {"model": -1},
        {"angles": "grad"},
        {"pixel_origin": "edge"},
        {"cameras": 3},
        {"settings": "adjust.loss=huber"},
        {"gnss": "geo.txt", "gnss_antenna": (1.0, 2.0)},
    ],
)
def test_wrong_values_are_rejected(wrong):
    with pytest.raises(InputError):
        ReadOptions(**wrong)
    with pytest.raises(InputError):
        formats.read(EXAMPLE, **wrong)


def test_columns_and_roles_are_those_of_the_command_line():
    columns = ReadOptions(columns="point=Name,x=-South", roles="KP=check").control_columns
    assert columns.headings == {"point": "Name", "x": "-South"}
    assert columns.roles == {"kp": "check"}


def test_keywords_replace_options():
    options = ReadOptions(file_format="colmap", sd=deviations(["images=0.5"]))
    assert formats.read(EXAMPLE, options, file_format="plain").block == formats.read(EXAMPLE).block


def test_options_add_control_and_names(tmp_path):
    block = formats.read(EXAMPLE).block
    observed = {name for each in block.observations for name in each.points}
    row = next(row for row, name in enumerate(block.point_ids) if name not in observed)
    (tmp_path / "control.csv").write_text("point,x,y,z,sd\nP,1,2,3,0.05\n")
    (tmp_path / "names.csv").write_text(f"point,name\n{block.point_ids[row]},P\n")
    project = formats.read(EXAMPLE, control=str(tmp_path / "control.csv"), names=tmp_path / "names.csv")
    row = project.block.point_ids.index("P")
    np.testing.assert_array_equal(project.block.point_sd[row], 0.05)


def test_observations_follow_new_names_of_points(tmp_path):
    (tmp_path / "names.csv").write_text("point,name\nsouth-1,P\n")
    project = formats.read(EXAMPLE, names=tmp_path / "names.csv")
    [distance] = project.block.observations.of_type(Distance)
    assert distance.points == ("north-1", "P") == (distance.first, distance.second)
