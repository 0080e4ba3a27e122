"""The format of the page on extensions."""

import numpy as np
import pytest
from line_format import FORMAT

from photogram import InputError, formats
from photogram.formats import ReadOptions
from photogram.formats.models import lost

TEXT = """\
camera C 3000.0 2000.0 1500.0 4000 3000
photo A C 0.0 0.0 100.0 0.0 0.0 0.0
photo B C 50.0 0.0 100.0 1.0 -2.0 3.0
control P 10.0 5.0 0.0 0.02
image A P 2300.0 1350.0
image B P 800.0 1350.0
image A Q 2000.0 1500.0
image B Q 500.0 1500.0
"""


def project_of(folder, text):
    (folder / "block.lines").write_text(text)
    return FORMAT.read(folder / "block.lines", ReadOptions())


def test_a_file_is_read_and_written(tmp_path):
    project = project_of(tmp_path, TEXT)
    block = project.block
    assert (block.photo_ids, block.point_ids) == (["A", "B"], ["P", "Q"])
    np.testing.assert_allclose(np.degrees(block.photo_attitudes[1]), [1, -2, 3], atol=1e-12)
    assert block.point_sd[0].tolist() == [0.02] * 3
    again = project_of(tmp_path, FORMAT.write(project)["block.lines"].decode()).block
    np.testing.assert_allclose(again.photo_attitudes, block.photo_attitudes, atol=1e-14)
    np.testing.assert_array_equal(again.image_xy, block.image_xy)
    np.testing.assert_array_equal(again.point_positions, block.point_positions)
    codes = {each.code for each in lost(project, FORMAT.holds)}
    assert {"lost.deviations", "lost.frame", "lost.points"} <= codes
    assert not codes & {"lost.control", "lost.names"}


@pytest.mark.parametrize(
    ("old", "new", "record", "code"),
    [
        ("photo B C", "photo A C", 3, "format.name"),
        ("photo B C", "photo B D", 3, "format.undefined"),
        ("image A Q", "image D Q", 7, "format.undefined"),
        ("1500.0\nimage B Q", "x\nimage B Q", 7, "error.at"),
    ],
)
def test_a_fault_is_named_with_its_line(tmp_path, old, new, record, code):
    with pytest.raises(InputError) as raised:
        project_of(tmp_path, TEXT.replace(old, new))
    assert (raised.value.record, raised.value.code) == (record, code)


def test_a_format_of_another_program_is_added(tmp_path, monkeypatch):
    project = project_of(tmp_path, TEXT)
    monkeypatch.setitem(formats.FORMATS, "lines", FORMAT)
    assert formats.recognised(tmp_path / "block.lines") is FORMAT
    assert set(formats.to_files(project, "lines")) == {"block.lines"}
    assert formats.read(tmp_path / "block.lines").block.photo_ids == ["A", "B"]
