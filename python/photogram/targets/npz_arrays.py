"""Archives of NumPy arrays (`.npz`) that others wrote: read as numbers and text, never unpickled."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.memory import require


class Arrays:
    """The arrays of an archive by their names, with the file for errors."""

    def __init__(self, path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.path, self.arrays = path, arrays

    def __contains__(self, name: str) -> bool:
        # Empty text stands for None, as mrcal writes it.
        return name in self.arrays and not (self.arrays[name].dtype.kind == "U" and self.text(name) == "")

    def error(self, name: str, message: str) -> InputError:
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
    """Read an archive.

    InputError: bytes that are no archive, or arrays of Python objects, which nothing here unpickles.
    OutOfMemoryError: it would take more memory than there is.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            require(sum(each.file_size for each in archive.infolist()), f"{path}: arrays")
            found = {
                each.filename.removesuffix(".npy"): np.lib.format.read_array(
                    io.BytesIO(archive.read(each)), allow_pickle=False
                )
                for each in archive.infolist()
            }
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise InputError(f"is no archive of arrays: {error}", file=path) from None
    except ValueError as error:
        objects = "Object arrays" in str(error)
        what = "holds Python objects, which are not unpickled: save plain arrays" if objects else str(error)
        raise InputError(what, file=path) from None
    return Arrays(path, found)
