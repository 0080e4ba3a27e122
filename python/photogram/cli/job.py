"""Common part of all commands: inputs, outputs, summary, exit code."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial, wraps
from importlib.resources import as_file, files
from inspect import Parameter, signature
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer

from photogram.cli.console import errors, failures, print_remark, print_sections, print_written
from photogram.cli.options import (
    OutputFile,
    Reads,
    Writes,
    arrange,
    declared,
    given_options,
    misuse,
    option_name,
    options_of,
    roles,
)
from photogram.messages import Message, printable
from photogram.words import phrase

if TYPE_CHECKING:
    from collections.abc import Iterator

    from photogram import Progress
    from photogram.io.seals import InputFile
    from photogram.io.writing import Files, OutputSet
    from photogram.show.page import Document, Section

Command = Callable[..., None]
LARGEST = 2**53  # Largest integer of an option; larger doubles are not exact counts


class Job:
    """Inputs and outputs of a run of a command; a context manager.

    On entry it rejects outputs that would damage an input or another output. Methods :meth:`reads` and
    :meth:`writes` add inputs and outputs later. Errors become messages and exit codes.
    """

    def __init__(
        self,
        *,
        paths: Mapping[Reads | Writes, list[Path]] | None = None,
        name: str = "",
        quiet: bool = False,
        json: Path | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self._began, self._clock = datetime.now(UTC), time.perf_counter()
        self.given = dict(options or {})  # Values that are not defaults, by names of options
        given = paths or {}
        self._files, self._projects, self._outputs, self._directories = (
            [*given.get(role, ())] for role in (Reads.FILE, Reads.PROJECT, Writes.FILE, Writes.DIRECTORY)
        )
        self._read = set[Path]()  # All files that are read during the job
        self._resources = ExitStack()
        self._examples: list[Path] = []
        self.name, self.quiet, self.json, self.is_example = name, quiet, json, False

    def __enter__(self) -> Job:
        from photogram.io.files import paths_read

        with ExitStack() as resources:  # Converts an error of the checks
            resources.enter_context(failures())
            resources.callback(paths_read.reset, paths_read.set(self._read))
            self._check()
            self._resources = resources.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        return self._resources.__exit__(kind, error, trace)

    def alone(self, option: str, others: Collection[str]) -> None:
        """Reject an option in combination with others; the message names them."""
        if typed := [name for name in self.given if name in others]:
            raise misuse(option, "conflict", options=typed)

    def only(self, permitted: Collection[str], code: str, **fields: Any) -> None:
        """Reject all options and arguments except some; `code` is one of the family `usage`."""
        for name in self.given:
            if name not in permitted:
                raise misuse(name, code, **fields)

    def packaged(self, *example: str) -> Path:
        """Return a packaged example, a file or a directory, for as long as the job lasts."""
        found = self._resources.enter_context(as_file(files("photogram").joinpath("examples", *example)))
        self._examples.append(found if found.is_dir() else found.parent)
        return found

    def shown(self, path: Path) -> Path:
        """Return a path for messages; a path of the package is relative."""
        for folder in [each.parent for each in self._examples] + [Path(str(files("photogram")))]:
            if folder in path.parents:
                return path.relative_to(folder)
        return path

    def told(self, messages: Iterable[Message]) -> list[Message]:
        """Return messages with paths of :meth:`shown`."""
        return [each if each.file is None else replace(each, file=self.shown(each.file)) for each in messages]

    def reads(self, *paths: Path) -> None:
        """Protect further inputs, files or directories of projects, against results."""
        for path in paths:
            (self._projects if path.is_dir() else self._files).append(path)
        self._check()

    def reads_inside(self, folder: Path) -> None:
        """Protect the files in a folder against results; see :meth:`reads`."""
        if folder.is_dir():
            self.reads(*(each for each in sorted(folder.iterdir()) if each.is_file()))

    def writes(self, *files: Path) -> None:
        """Declare further outputs, and check them now."""
        self._outputs += [path for path in files if path not in self._outputs]
        self._check()

    def writes_inside(self, folder: Path) -> None:
        """Declare an output folder, and check it now."""
        self._directories.append(folder)
        self._check()

    def write(self, *results: Files | Callable[[], Files]) -> list[Path]:
        """Write results, all or none: none over an input, no two to one path; return the paths.

        A function computes its results while the disk receives those before it.
        """
        written = []
        with self.outputs() as outputs:
            for files in results:
                for path, content in (files() if callable(files) else files).items():
                    self._check_projects(path)
                    outputs.write(path, content)
                    written.append(path)
        return written

    def finish(
        self,
        *results: Files | Callable[[], Files],
        document: Document | None = None,
        summary: Callable[[], None] | None = None,
        code: int = 0,
    ) -> None:
        """Write results and the JSON of a document, print a summary or the document, and exit with a code."""
        if document is not None:
            from photogram.show.forms import to_json

            results = (*results, self.as_json(partial(to_json, document)))
            summary = summary or partial(print_sections, document, "--json FILE")
        self.conclude(self.write(*results), summary=summary, code=code)

    def conclude(
        self, written: Iterable[Path], *, summary: Callable[[], None] | None = None, code: int = 0
    ) -> None:
        """Print a summary and the names of written files, and end with an exit code."""
        if not self.quiet:
            if summary is not None:
                summary()
            print_written(written)
        if code:
            raise typer.Exit(code)

    def as_json(self, make: Callable[[], bytes], mark: str = "") -> dict[Path, bytes]:
        """Return the file of `--json FILE`; none without it."""
        return {} if self.json is None else {self.json.with_stem(self.json.stem + mark): make()}

    def input_files(self) -> tuple[list[InputFile], int]:
        """Return the first files that were read, with checksums, and the number of the others."""
        from photogram.io.seals import input_files

        found, others = input_files(self._inputs())
        return [replace(each, path=self.shown(each.path)) for each in found], others

    def reproducibility(self, phases: Mapping[str, float]) -> Section:
        """Return the last section of a report: program, options, inputs and times."""
        from photogram.show.html import reproducibility
        from photogram.show.page import Fact, Facts, about
        from photogram.show.quantity import Axis, Quantity, Table, of_each

        inputs, others = self.input_files()
        files = [
            Quantity([printable(str(each.path)) for each in inputs], kind="name", head="File"),
            of_each(inputs, "size", (Axis.of("", "bytes"),), "deviation", head="Size", decimals=0),
            of_each(inputs, "sha256", (), "name", head="SHA-256"),
        ]
        options = [Fact(name, printable(value)) for name, value in self.given.items()]
        run = [
            Fact("Command", printable(f"photogram {self.name}")),
            Fact("Began", self._began.strftime("%Y-%m-%d %H:%M:%S"), "UTC"),
            Fact.of("Time up to this report", time.perf_counter() - self._clock, "s", decimals=2),
        ]
        table = Table("", "Input files", files, f"and {others} more" if others else "")
        return reproducibility(phases, run, [table, Facts(about("run.options"), options)])

    def remark(self, *remarks: object) -> None:
        """Print remarks on standard error, unless the job is quiet."""
        for each in () if self.quiet else remarks:
            print_remark(each)

    @contextmanager
    def status(self, text: str) -> Iterator[Callable[[str], None] | None]:
        """Show a status line on standard error, if this is a terminal, unless the job is quiet.

        Yields the function that changes its text; None without a line.
        """
        if self.quiet or not errors.is_terminal:
            yield None
            return
        with errors.status(text, spinner="line") as status:
            yield status.update

    def outputs(self) -> OutputSet:
        """Return a set of files for results that are written in several pieces."""
        from photogram.io.writing import OutputSet

        return OutputSet([*self._inputs(), *self._read])

    def _inputs(self) -> list[Path]:
        inputs = list(self._files)
        for project in self._projects:
            if project.is_dir():
                from photogram.giant.files import present_files

                inputs += [path for found in present_files(project).values() for path in found]
        return inputs

    def _check(self) -> None:
        from photogram.errors import InputError
        from photogram.io.files import reading
        from photogram.io.writing import check_outputs

        for path in [*self._files, *self._projects]:
            with reading(path):
                _check_name(path)
        for path in self._directories:
            _check_name(path)
            if path.exists() and not path.is_dir():
                raise InputError(phrase("command.no-folder"), file=path)
            sources = [each for each in (*self._projects, *self._files) if each.is_dir()]
            if path.exists() and any(path.samefile(each) for each in sources):
                raise InputError(phrase("command.over-input"), file=path)
        check_outputs(self._outputs, [*self._inputs(), *self._read], self._directories)
        for path in self._outputs:
            self._check_projects(path)

    def _check_projects(self, path: Path) -> None:
        """Reject an output that would be a second file of one name in an input project."""
        if not self._projects:
            return
        from photogram.errors import InputError
        from photogram.giant.files import project_name

        name = project_name(path)
        place = os.path.dirname(os.path.realpath(path))
        if name and any(os.path.realpath(project) == place for project in self._projects):
            raise InputError(phrase("command.project-file", name=name), file=path)


_PHASES = {"form": "normal equations", "solve": "solution", "invert": "standard deviations"}


@contextmanager
def adjustment_status(
    job: Job, text: str = "adjusting", name: str = "weighted sum of squares", factor: float = 1.0
) -> Iterator[Callable[[Progress], None] | None]:
    """Show phase and last iteration of an adjustment."""
    with job.status(text) as update:
        yield None if update is None else shown(update, name, factor)


def shown(update: Callable[[str], None], name: str, factor: float) -> Callable[[Progress], None]:
    """Return a function that shows phase and last iteration."""
    last = ""

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.iteration is not None:
            size = factor * progress.iteration.weighted_sum_of_squares
            last = f"iteration {progress.iteration.number}: {name} {size:.6g}; "
        elif progress.total:
            phase = _PHASES.get(progress.phase, progress.phase)
            update(f"{last}{phase} {100 * progress.done // progress.total} %")

    return show


@contextmanager
def estimation_status(job: Job) -> Iterator[Callable[[int, object], None]]:
    """Show the number of completed adjustments of a variance component estimation."""
    with job.status("variance components") as update:

        def show(number: int, _: object) -> None:
            if update is not None:
                update(f"variance components, adjustment {number + 1}")

        yield show


def _check_name(path: Path) -> None:
    """Reject a path that the system cannot access; readers report a missing file."""
    try:
        os.stat(path)
    except OSError as error:
        if error.errno not in (errno.ENOENT, errno.ENOTDIR):
            raise OSError(error.errno, error.strerror, str(path)) from None


def default_out(source: Path, ending: str, example: str = "") -> Path:
    """Return the default output folder: name of the input, or of the example, with an ending.

    It is in the folder of the input, or in the current folder if that is read-only or the input is packaged.
    """
    if example:
        return Path(f"{example}{ending}")
    place = Path(os.path.realpath(source))
    parent = place.parent if os.access(place.parent, os.W_OK) else Path()
    return parent / f"{place.name if place.is_dir() else place.stem}{ending}"


def with_job(
    name: str = "",
    *,
    example: Sequence[str] | None = None,
    ending: str = "",
    example_name: str = "example",
    json: bool = True,
) -> Callable[[Command], Command]:
    """Return a decorator that runs a command inside a :class:`Job`, its parameter `job`.

    The fields of a parameter that is a dataclass are options; marks :class:`Without`, :class:`Only` and
    :class:`Changes` select some of them. Each command has the option `--quiet`, and `--json FILE`, which
    :meth:`Job.finish` or :meth:`Job.as_json` writes.

    Parameters
    ----------
    name
        Name of the command in reports.
    example
        The packaged example, a directory of photogram.examples and a file in it, that the option `--example`
        assigns to the first argument. Empty: the command makes its example. None: without the option.
    ending
        Ending of the default of `out`, after the name of the first argument; empty: without default.
    example_name
        Name of the example in this default.
    json
        False for a command whose complete result is in its other files: without `--json`.
    """
    return partial(_with_job, name=name, example=example, ending=ending, example_name=example_name, json=json)


def _with_job(
    command: Command, *, name: str, example: Sequence[str] | None, ending: str, example_name: str, json: bool
) -> Command:
    own, classes = options_of(command)
    marked = {**roles(command), "json": Writes.FILE}
    first, several = own[0].name, "list" in str(own[0].annotation)
    if example is not None:
        own = [_optional(parameter) for parameter in own]
        option = Parameter("example", Parameter.KEYWORD_ONLY, default=False, annotation=bool)
        own.insert(1, declared(option, command.__name__))
    more: dict[str, Any] = {"json": (None, OutputFile)} if json else {}
    more["quiet"] = False, Annotated[bool, typer.Option("--quiet", "-q")]
    for option_of_all, (default, kind) in more.items():
        parameter = Parameter(option_of_all, Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        own.append(declared(parameter, command.__name__))

    @wraps(command)
    def run(**values: Any) -> None:
        for parameter in own:
            value = values.get(parameter.name, parameter.default)
            if isinstance(value, int) and abs(value) > LARGEST:
                raise misuse(option_name(parameter), "large", limit=LARGEST, value=value)
        if "example" in values:
            arrange(own, values)
        paths: dict[Reads | Writes, list[Path]] = {role: [] for role in (*Reads, *Writes)}
        for path_name, role in marked.items():
            value = values.get(path_name)
            several_paths = value if isinstance(value, list) else [value]
            paths[role] += [Path(path) for path in several_paths if path is not None]
        given = given_options(own, values)
        of_job = {"quiet": values.pop("quiet", False), "json": values.pop("json", None)}
        with Job(paths=paths, name=name, options=given, **of_job) as job:
            if values.pop("example", False):
                job.is_example = True
                if example:
                    path = job.packaged(example[0]).joinpath(*example[1:])
                    values[first] = [path] if several else path
                    if path.is_file() or marked[first] is Reads.PROJECT:
                        job.reads(path)
            if ending and (job.is_example or values[first]):
                source = values[first][0] if several and values[first] else values[first]
                shown = example_name if job.is_example else ""
                values["out"] = values.get("out") or default_out(source, ending, shown)
                job.writes_inside(values["out"])
            for parameter_name, each in classes.items():
                values[parameter_name] = each.value(values)
            command(job=job, **values)

    run.__dict__["__signature__"] = signature(command).replace(parameters=own)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in own}
    return run


def _optional(parameter: Parameter) -> Parameter:
    """Return an argument that `--example` can replace."""
    if parameter.default is not Parameter.empty:
        return parameter
    kind, *marks = get_args(parameter.annotation)
    return parameter.replace(default=None, annotation=Annotated[(kind | None, *marks)])
