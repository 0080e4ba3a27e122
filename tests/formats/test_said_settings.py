"""Keys of project.toml that a user says on the command line."""

from pathlib import Path

import pytest

from message_codes import rejected
from photogram import InputError
from photogram.formats import ReadOptions, read, to_files
from photogram.formats.plain.settings import read_settings

TABLES = {
    "project.toml": '[project]\nformat = 1\n[adjust]\nloss = "cauchy"\n',
    "photos.csv": "photo,x,y,z,omega,phi,kappa\np1,0,0,100,0,0,0\np2,50,0,100,0,0,0\n",
    "images.csv": "photo,point,column,row,sd\np1,a,500,500,0.5\np2,a,10,500,0.5\n",
    "cameras.csv": "camera,model,f,cx,cy\nk,pinhole,1000,500,500\n",
    "control.csv": "point,x,y,z\na,0,0,0\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in TABLES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def said(folder: Path, *words: str):
    return read(folder, ReadOptions(settings=words))


def test_what_is_said_goes_before_the_file(folder: Path) -> None:
    found = said(folder, "adjust.loss=huber", "sd.control = [0.1, 0.1, 0.2]")
    assert found.options.loss == "huber"
    assert found.block.point_sd.tolist() == [[0.1, 0.1, 0.2]]
    assert said(folder, "sd.control=0.1").options.loss == "cauchy"


@pytest.mark.parametrize("text", ["quarry, east", "a = b", "1\nx = 2", "1.2.3"])
def test_texts_may_go_without_quotation_marks(folder: Path, text: str) -> None:
    for word in (text, f"'{text}'") if "\n" not in text else (text,):
        assert (
            read_settings(folder / "project.toml", ReadOptions(settings=[f"project.name={word}"])).name
            == text
        )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("adjust", "toml.replace adjust"),
        ("adjust=1", "toml.replace adjust=1"),
        ("adjust.los=huber", "error.at --set adjust.los=huber: error.at [adjust]: error.unknown.close"),
        ("ajust.loss=huber", "error.at --set ajust.loss=huber: error.unknown.close table ajust adjust"),
        ("adjust.loss=hubert", "error.at --set adjust.loss=hubert: error.key adjust loss: error.choice"),
        ("sd.control=-1", "error.at --set sd.control=-1: error.key sd control: error.not-negative -1"),
    ],
)
def test_what_cannot_be_is_refused_by_what_was_said(folder: Path, words: str, message: str) -> None:
    with rejected(message):
        said(folder, "sd.control=0.1", words)


def test_an_error_of_the_file_still_names_its_line(folder: Path) -> None:
    (folder / "project.toml").write_text('[project]\nformat = 1\n[adjust]\nloss = "none of these"\n')
    with pytest.raises(InputError) as caught:
        said(folder, "sd.control=0.1")
    assert caught.value.record == 4


def test_other_formats_have_no_settings(folder: Path) -> None:
    for name, content in to_files(said(folder, "sd.control=0.1"), "bundler").items():
        (folder / "other" / name).parent.mkdir(exist_ok=True)
        (folder / "other" / name).write_bytes(content)
    with rejected("format.settings Bundle file"):
        said(folder / "other", "adjust.loss=huber")
