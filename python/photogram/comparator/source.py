"""Reading measurements from files of either kind."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from photogram.comparator.cards import read_cards
from photogram.comparator.tables import read_csv
from photogram.errors import InputError

if TYPE_CHECKING:
    from photogram.comparator.grid import Grid
    from photogram.comparator.readings import Session

__all__ = ["read"]


def read(
    paths: Sequence[Path | str], grids: Iterable[Grid] = (), *, left_handed: bool | None = None
) -> list[Session]:
    """Read measurements: files named *.csv are tables, all others are decks of cards.

    Parameters
    ----------
    paths
        Tables, which make one calibration together, or files of decks, of which each makes one.
    grids
        Plates, instead of those that the files name.
    left_handed
        Whether the comparator is left-handed against the plate, instead of what the files say.

    Raises
    ------
    InputError
        A file that cannot be read or understood; tables and decks together; no file.
    """
    files = [Path(path) for path in paths]
    if not files:
        raise InputError("there is no file to read")
    tables = [path for path in files if path.suffix.lower() == ".csv"]
    plates = list(grids)
    if not tables:
        return [session for path in files for session in read_cards(path, plates, left_handed=left_handed)]
    if len(tables) < len(files):
        raise InputError("tables and decks of cards cannot make one calibration", file=tables[0])
    return [read_csv(tables, plates, left_handed=left_handed)]
