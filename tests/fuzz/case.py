"""One input: made from its seed, run, and judged."""

from __future__ import annotations

import os
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path
from random import Random
from shutil import rmtree

import orjson
import typer

from photogram import AdjustmentError, InputError, PhotogramError

from .damage import damaged
from .programs import PROGRAMS, Watch, unsound
from .sound import SOUND, Files

__all__ = ["ENDINGS", "Fuzzer", "Outcome", "kind_of", "write_input"]

ENDINGS = (
    "converged",
    "not usable",
    "not converged",
    "refused by the adjustment",
    "refused as input",
    "failed",
)
"""How an input ends."""
WITHOUT_FILES = ("simulate",)
"""Formats whose inputs are options of the Python interface."""
_FORMATS = list(PROGRAMS)
_WEIGHTS = [often for _, often in PROGRAMS.values()]


@dataclass(frozen=True)
class Outcome:
    """What became of an input.

    Attributes
    ----------
    format
        A key of the programs.
    ending
        One of the endings.
    reached
        Whether the computation was reached.
    warned
        The first warning of Python or NumPy, if any.
    fault
        What is wrong; None where nothing is.
    """

    format: str
    ending: str
    reached: bool = False
    warned: str | None = None
    fault: str | None = None


def kind_of(seed: int, number: int) -> tuple[str, Random]:
    """Return the format of an input, and the generator that makes the rest of it."""
    rng = Random(f"{seed}:{number}")
    return rng.choices(_FORMATS, _WEIGHTS)[0], rng


def write_input(folder: Path, files: Files) -> None:
    """Write the files of an input, and its links."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if isinstance(content, str):
            path.symlink_to(content)
        else:
            path.write_bytes(content)


class Fuzzer:
    """Makes, runs and judges inputs in a directory.

    Parameters
    ----------
    seed
        Of the whole run; input `number` of it is always the same.
    place
        A directory of its own.
    """

    def __init__(self, seed: int, place: Path) -> None:
        self.seed = seed
        self.place = place
        self.sound: dict[str, list[Files]] = {}
        self.watch: Watch | None = None

    def prepare(self, number: int) -> None:
        """Make the sound inputs of the format of an input, unless they are there."""
        kind, _ = kind_of(self.seed, number)
        if kind not in self.sound:
            self.sound[kind] = SOUND[kind]()

    def input_of(self, number: int) -> tuple[str, Files, Random]:
        """Return format and files of an input, and the generator that goes on to choose the options."""
        self.prepare(number)
        kind, rng = kind_of(self.seed, number)
        return kind, damaged(rng, rng.choice(self.sound[kind])), rng

    def run(self, number: int) -> Outcome:
        """Run an input and judge how it ends."""
        kind, files, rng = self.input_of(number)
        source = self.place / "in"
        source.mkdir(parents=True)
        write_input(source, files)
        # It stays in the programs: only where inputs are run, in a process of their own.
        self.watch = self.watch or Watch()
        self.watch.begin()
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            ending, fault, written = self._ended(kind, rng)
        warning = str(warned[0].message) + f" ({warned[0].filename}:{warned[0].lineno})" if warned else None
        fault = fault or self._left(files, ending, written)
        if fault is None and ending == "converged":
            silent = next(filter(None, map(unsound, self.watch.results)), None)
            fault = silent and f"converged without a remark, but {silent} is not finite"
        rmtree(self.place)
        return Outcome(kind, "failed" if fault else ending, self.watch.reached, warning, fault)

    def _ended(self, kind: str, rng: Random) -> tuple[str, str | None, list[str] | None]:
        """Run a program; return how it ends, what is wrong with that, and what it should have written."""
        try:
            written = PROGRAMS[kind][0](self.place, rng, rng.random() < 0.9)
        except AdjustmentError:
            return "refused by the adjustment", None, None
        except PhotogramError as error:
            return "refused as input", self._silent(kind, error), None
        except typer.Exit as leaving:
            if leaving.exit_code == 3:
                return "not converged", None, []
            if leaving.exit_code == 4:
                return "not usable", None, []
            return "failed", f"exit code {leaving.exit_code}", None
        except typer.BadParameter:
            return "refused as input", None, None
        except MemoryError as error:
            # The commands say it in one line; anything without one is a traceback's beginning.
            return "refused as input", None if str(error) else traceback.format_exc(), None
        except OSError as error:
            if error.filename is not None:
                return "refused as input", None, None
            return "failed", traceback.format_exc(), None
        except BaseException as error:  # panics of the extension are no Exceptions
            if isinstance(error, KeyboardInterrupt):
                raise
            return "failed", traceback.format_exc(), None
        return "converged", None, written

    def _silent(self, kind: str, error: PhotogramError) -> str | None:
        """Return what the message of a refusal lacks: a sentence, or the file or option that is wrong.

        After reading, errors of the Python interface concern the block, and name photos, points or cameras.
        """
        message = str(error).strip()
        if not message:
            return "an error without a message"
        known = not isinstance(error, InputError) or error.file is not None or message.startswith("--")
        is_reading = not (self.watch and self.watch.reached) and kind not in WITHOUT_FILES
        return f"a message without file or option: {message}" if is_reading and not known else None

    def _left(self, files: Files, ending: str, written: list[str] | None) -> str | None:
        """Look at the files: inputs are as they were; outputs are whole, or there are none."""
        source = self.place / "in"
        there = {
            str(Path(folder, name).relative_to(self.place))
            for folder, folders, inside in os.walk(self.place)
            for name in (*inside, *(each for each in folders if os.path.islink(os.path.join(folder, each))))
        }
        given = {f"in/{name}" for name in files}
        left = {name for name in there if not name.startswith("in/")}
        if there - left != given:
            return f"the directory of the input holds {sorted(there - left)}"
        for name, content in files.items():
            path = source / name
            found = os.readlink(path) if isinstance(content, str) else path.read_bytes()
            if found != content:
                return f"{name} was changed"
        if written is None:
            # What a deck gave before the set that stopped it is kept.
            kept = (
                {"result.json", "out/listing.txt", "out/report.html"}
                if os.path.exists(source / "grid.deck")  # of a damaged link it is false
                else set()
            )
            return f"refused, but {sorted(left - kept)} was written" if left - kept else None
        if missing := set(written) - left:
            return f"{ending}, but {sorted(missing)} is missing"
        if temporary := [name for name in left if name.endswith(".tmp")]:
            return f"left behind: {temporary}"
        for name in left:
            if name.endswith(".json"):
                try:
                    orjson.loads((self.place / name).read_bytes())
                except orjson.JSONDecodeError as error:
                    return f"{name} is no JSON: {error}"
        return None
