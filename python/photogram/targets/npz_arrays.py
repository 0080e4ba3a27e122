"""Archives of NumPy arrays (`.npz`) from other programs, read as numbers and text without unpickling."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.arrays import shaped, text, truth_value
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.io.sheets import UNPACKABLE, check_unpacked_size
from photogram.memory import require
from photogram.words import phrase


class Arrays:
    def __init__(self, path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.path, self.arrays = path, arrays

    def __contains__(self, name: str) -> bool:
        # In mrcal files, empty text means None.
        return name in self.arrays and not (self.arrays[name].dtype.kind == "U" and self.text(name) == "")

    def refusal(self, code: str, name: str, **fields: object) -> InputError:
        return InputError(phrase(code, name=name, **fields), file=self.path)

    def first(self, *names: str) -> str:
        """Return the first existing name; versions of a program write different names."""
        existing = next((name for name in names if name in self), None)
        if existing is None:
            raise InputError(phrase("error.missing", name=" or ".join(names)), file=self.path)
        return existing

    def text(self, name: str) -> str:
        with at_place(Place(self.path)):
            return text(name, self.arrays[name].tolist())

    def says(self, name: str) -> bool:
        """Return whether an array is true; False if it is missing."""
        if name not in self:
            return False
        value = self.arrays[name].tolist()
        with at_place(Place(self.path)):
            return truth_value(name, bool(value) if type(value) is int else value)

    def numbers(self, name: str, *shape: int | None) -> Floats:
        """Return an array of finite numbers; None in the shape permits any length."""
        array = self.arrays[name]
        if array.ndim == len(shape):
            shape = tuple(n if own is None else own for own, n in zip(shape, array.shape, strict=True))
        with at_place(Place(self.path)):
            return shaped(name, array, shape, "finite")


def read_arrays(path: Path, data: bytes) -> Arrays:
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            check_unpacked_size(path, members)
            require(sum(each.file_size for each in members), f"{path}: arrays")
            for member in members:
                name = member.filename.removesuffix(".npy")
                arrays[name] = _array(path, name, archive.read(member))
    except UNPACKABLE as error:
        message = phrase("error.parse", format="archive of arrays (npz)", reason=str(error))
        raise InputError(message, file=path) from None
    return Arrays(path, arrays)


def _array(path: Path, name: str, content: bytes) -> NDArray[Any]:
    try:
        return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
    except Exception as error:  # any error of the parser for a damaged header
        raise InputError(phrase("targets.array-damaged", name=name, reason=str(error)), file=path) from None
