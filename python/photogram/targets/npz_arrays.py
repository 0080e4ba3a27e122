"""Archives of NumPy arrays (`.npz`) that others wrote: read as numbers and text, never unpickled."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.io.archives import UNPACKABLE, check_unpacked_size
from photogram.memory import require
from photogram.words import Phrase

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


class Arrays:
    """The arrays of an archive by their names, with the file for errors."""

    def __init__(self, path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.path, self.arrays = path, arrays

    def __contains__(self, name: str) -> bool:
        # Empty text stands for None, as mrcal writes it.
        return name in self.arrays and not (self.arrays[name].dtype.kind == "U" and self.text(name) == "")

    def error(self, name: str, message: str | Phrase) -> InputError:
        """Return an error that names file and array."""
        return InputError(f"{name} {message}", file=self.path)

    def first(self, *names: str) -> str:
        """Return the first of some names that is there; versions of a program write others."""
        found = next((each for each in names if each in self), None)
        if found is None:
            raise InputError(f"has no {' or '.join(names)}", file=self.path)
        return found

    def text(self, name: str) -> str:
        """Return an array of one text."""
        found = self.arrays[name]
        if found.dtype.kind not in "US" or found.ndim:
            raise self.error(name, "is no text")
        return str(found)

    def says(self, name: str) -> bool:
        """Return whether an array is true; False where it is missing."""
        if name not in self:
            return False
        found = self.arrays[name]
        if found.ndim or found.dtype.kind not in "biu":
            raise self.error(name, "is neither true nor false")
        return bool(found)

    def numbers(self, name: str, *shape: int | None) -> Floats:
        """Return an array of finite numbers; None in the shape stands for any length."""
        found = self.arrays[name]
        if found.dtype.kind not in "fiu":
            raise self.error(name, f"holds no numbers: its type is {found.dtype}")
        fits = found.ndim == len(shape) and all(
            own is None or own == each for own, each in zip(shape, found.shape, strict=True)
        )
        if not fits:
            wanted = " x ".join("n" if each is None else str(each) for each in shape) or "a number"
            raise self.error(name, f"has the shape {found.shape}, not {wanted}")
        numbers = found.astype(np.float64)
        if not np.isfinite(numbers).all():
            raise self.error(name, "holds what is not finite")
        return numbers


def read_arrays(path: Path, data: bytes) -> Arrays:
    """Read an archive."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            check_unpacked_size(path, members)
            require(sum(each.file_size for each in members), f"{path}: arrays")
            arrays = {}
            for member in members:
                name = member.filename.removesuffix(".npy")
                arrays[name] = _array(path, name, archive.read(member))
    except InputError:
        raise
    except (*UNPACKABLE, ValueError) as error:
        raise InputError(f"cannot be read as an archive of arrays: {error}", file=path) from None
    return Arrays(path, arrays)


def _array(path: Path, name: str, content: bytes) -> NDArray[Any]:
    """Return the array of a member, whose header must announce as many bytes as there are."""
    stream = io.BytesIO(content)
    try:
        version = np.lib.format.read_magic(stream)
        shape, by_columns, kind = _HEADERS[version](stream)
        announced = math.prod(shape) * kind.itemsize
    except Exception as error:  # whatever a damaged header makes the parser raise
        what = f"the header of the array {name} is damaged ({type(error).__name__}: {error})"
        raise InputError(f"{what}: write the file again with numpy.savez", file=path) from None
    if kind.hasobject:
        raise InputError(
            f"the array {name} holds Python objects, which are not unpickled: save plain arrays", file=path
        )
    own = len(content) - stream.tell()
    if announced != own or min(shape, default=0) < 0:
        raise InputError(
            f"the header of the array {name} announces the shape {shape} of {kind}, {announced} bytes, but"
            f" {own} bytes follow: write the file again with numpy.savez",
            file=path,
        )
    return np.ndarray(shape, kind, content, stream.tell(), order="F" if by_columns else "C")
