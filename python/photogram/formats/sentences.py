"""Files of sentences: a firm's own words of an accuracy statement, in the place of the program's."""

from __future__ import annotations

from pathlib import Path

from photogram.arguments.arrays import shown
from photogram.errors import InputError
from photogram.io.toml import TomlFile
from photogram.results.statement.texts import Texts

__all__ = ["read_sentences"]


def read_sentences(path: Path) -> dict[str, str]:
    """Return the sentences of a file by their keys (section 5 of the specification of the statement).

    Parameters
    ----------
    path
        A file of TOML, flat, with keys in quotation marks: `"asprs.tested.h" = "Tested with {n} points."`.

    Raises
    ------
    InputError
        It cannot be read or is no TOML; a key that there is not, with the nearest one; what is no sentence,
        or has fields that the sentence of the program does not have.
    """
    file = TomlFile(path)
    for key, sentence in file.content.items():
        if isinstance(sentence, dict):
            raise file.error(key, f'{key} is no key: keys stand in quotation marks, "asprs.tested.h" = "..."')
        if not isinstance(sentence, str):
            raise file.error(key, f"{key} is no sentence: {shown(sentence)}")
        try:
            Texts(own={key: sentence})
        except InputError as error:
            raise file.error(key, error.message) from None
    return dict(file.content)
