"""Common part of all commands: inputs, outputs, summary, exit code."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import fields, is_dataclass, replace
from datetime import UTC, datetime
from enum import Enum
from functools import partial, wraps
from importlib.resources import as_file, files
from inspect import Parameter, signature
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from typer.models import ArgumentInfo, OptionInfo

from photogram.cli.command_classes import declared, misuse, option_of
from photogram.cli.console import errors, failures, print_report, print_written
from photogram.messages import Message
from photogram.words import phrase

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.status import Status

    from photogram import Progress
    from photogram.io.writing import Files, OutputSet
    from photogram.show.run import Run

STANDS = {"example": "--example", "plan_views": "--plan"}
"""Options that replace the first argument of a command, by parameter."""
LARGEST = 2**53  # Largest integer of an option; larger doubles are not exact counts


class Reads(Enum):
    """Input of a command that an option or argument names."""

    FILE = "file"
    PROJECT = "directory of a GIANT project"


class Writes(Enum):
    """Output of a command that an option or argument names."""

    FILE = "file"
    DIRECTORY = "directory of results"
    EITHER = "file or directory"


Input = Annotated[Path, Reads.FILE]
InputFile = Annotated[Path | None, Reads.FILE]
OutputFile = Annotated[Path | None, Writes.FILE]
Folder = Annotated[Path, Writes.DIRECTORY]
OutputFolder = Annotated[Path | None, Writes.DIRECTORY]


class Job:
    """Inputs and outputs of a run of a command; a context manager.

    On entry it rejects outputs that would damage an input or another output. Methods :meth:`reads` and
    :meth:`writes` add inputs and outputs later. Errors become messages and exit codes.
    """

    def __init__(
        self,
        files: Iterable[Path] = (),
        projects: Iterable[Path] = (),
        outputs: Iterable[Path] = (),
        directories: Iterable[Path] = (),
        *,
        quiet: bool = False,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        self._began, self._clock = datetime.now(UTC), time.perf_counter()
        self._options = dict(options or {})
        self._files, self._projects = list(files), list(projects)
        self._outputs, self._directories = list(outputs), list(directories)
        self._spared: list[Path] = []
        self._failures = failures()
        self._resources = ExitStack()
        self._examples: list[Path] = []
        self.quiet, self.is_example = quiet, False

    def __enter__(self) -> Job:
        self._failures.__enter__()
        try:
            self._check()
        except Exception as error:
            # The context is not entered when this raises: its exit would never see the error.
            self._failures.__exit__(type(error), error, error.__traceback__)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool | None:
        self._resources.close()
        return self._failures.__exit__(kind, error, trace)

    @property
    def given(self) -> Mapping[str, Any]:
        """Values of the command line that are not defaults, by names of options."""
        return self._options

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

    def spares(self, *paths: Path) -> None:
        """Protect further files against results; reports do not list them as inputs."""
        self._spared += paths
        self._check()

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
        summary: Callable[[], None] | None = None,
        code: int = 0,
    ) -> None:
        """Write the results, print a summary, and end with an exit code."""
        self.conclude(self.write(*results), summary=summary, code=code)

    def conclude(
        self, written: Iterable[Path], *, summary: Callable[[], None] | None = None, code: int = 0
    ) -> None:
        """Print a summary and the names of written files, and end with an exit code."""
        if not self.quiet:
            if summary is not None:
                summary()
            written = list(written)
            print_written(written)
            print_report(written)
        if code:
            raise typer.Exit(code)

    def run(self, command: str) -> Run:
        """Return options, inputs and times of the run of a command for its report."""
        from photogram.show.run import Run, input_files

        found, others = input_files(self._inputs())
        inputs = [replace(each, path=self.shown(each.path)) for each in found]
        seconds = time.perf_counter() - self._clock
        return Run(f"photogram {command}", self._options, inputs, self._began, seconds, others)

    @contextmanager
    def status(self, text: str) -> Iterator[Status | None]:
        """Show a status line on standard error, if this is a terminal, unless the job is quiet."""
        if self.quiet or not errors.is_terminal:
            yield None
            return
        with errors.status(text, spinner="line") as status:
            yield status

    def outputs(self) -> OutputSet:
        """Return a set of files for results that are written in several pieces."""
        from photogram.io.writing import OutputSet

        return OutputSet([*self._inputs(), *self._spared])

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
        inputs = self._inputs()
        check_outputs(self._outputs, [*inputs, *self._spared], self._directories)
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
    """Show the progress of an adjustment; see :func:`shown`."""
    with job.status(text) as status:
        yield None if status is None else shown(status, name, factor)


@contextmanager
def estimation_status(job: Job) -> Iterator[Callable[[int, object], None]]:
    """Show the number of completed adjustments of a variance component estimation."""
    with job.status("variance components") as status:

        def show(number: int, _: object) -> None:
            if status is not None:
                status.update(f"variance components, adjustment {number + 1}")

        yield show


def shown(status: Status, name: str, factor: float) -> Callable[[Progress], None]:
    """Return a function that shows phase and last iteration."""
    last = ""

    def show(progress: Progress) -> None:
        nonlocal last
        if progress.iteration is not None:
            size = factor * progress.iteration.weighted_sum_of_squares
            last = f"iteration {progress.iteration.number}: {name} {size:.6g}; "
        elif progress.total:
            phase = _PHASES.get(progress.phase, progress.phase)
            status.update(f"{last}{phase} {100 * progress.done // progress.total} %")

    return show


def _check_name(path: Path) -> None:
    """Reject a path that the system cannot access; readers report a missing file."""
    try:
        os.stat(path)
    except OSError as error:
        if error.errno not in (errno.ENOENT, errno.ENOTDIR):
            raise OSError(error.errno, error.strerror, str(path)) from None


class Without:
    """Mark of an annotation: class of options without these names."""

    def __init__(self, *names: str) -> None:
        self.names = names


def roles(command: Callable[..., Any]) -> dict[str, Reads | Writes]:
    """Return the roles of options and arguments of a command that are paths."""
    found = {}
    for each in _options(command)[0]:
        if (role := _mark(each, (Reads, Writes))) is not None:
            found[each.name] = role
        elif _holds_path(each.annotation):
            raise TypeError(f"{command.__name__}: {each.name} must be marked as one of Reads or Writes")
    return found


def _mark(parameter: Parameter, kind: type | tuple[type, ...]) -> Any:
    """Return the mark of a kind in the annotation of an option or argument; None without one."""
    return next((each for each in get_args(parameter.annotation)[1:] if isinstance(each, kind)), None)


def _holds_path(kind: object) -> bool:
    return kind is Path or any(_holds_path(part) for part in get_args(kind))


def _with_role(parameter: Parameter) -> Parameter:
    """Return a field of a class of options; its path without a role is an input file."""
    if not _holds_path(parameter.annotation) or _mark(parameter, (Reads, Writes)) is not None:
        return parameter
    return parameter.replace(annotation=Annotated[parameter.annotation, Reads.FILE])


def _options(command: Callable[..., Any]) -> tuple[list[Parameter], dict[str, tuple[type, list[Parameter]]]]:
    """Return options and arguments of a command, and its option classes."""
    options: list[Parameter] = []
    grouped: dict[str, tuple[type, list[Parameter]]] = {}
    for parameter in signature(command, eval_str=True).parameters.values():
        kind, *marks = get_args(parameter.annotation) or (parameter.annotation,)
        if isinstance(kind, type) and is_dataclass(kind):
            without = [name for mark in marks if isinstance(mark, Without) for name in mark.names]
            own = [_with_role(option_of(each, kind)) for each in fields(kind) if each.name not in without]
            grouped[parameter.name] = kind, own
            options += own
        elif parameter.name != "job":
            options.append(declared(parameter, command.__name__))
    return options, grouped


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
    *,
    example: Sequence[str] | None = None,
    ending: str = "",
    name: str = "example",
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that runs a command inside a :class:`Job`, its parameter `job`.

    The fields of a parameter that is a dataclass are options, except fields in a mark :class:`Without`. Each
    command has the option `--quiet`.

    Parameters
    ----------
    example
        The packaged example, a directory of photogram.examples and a file in it, that the option `--example`
        assigns to the first argument. Empty: the command makes its example. None: without the option.
    ending
        Ending of the default of `out`, after the name of the first argument; empty: without default.
    name
        Name of the example in this default.
    """
    return partial(_with_job, example=example, ending=ending, name=name)


def _with_job(
    command: Callable[..., None], *, example: Sequence[str] | None, ending: str, name: str
) -> Callable[..., None]:
    own, grouped = _options(command)
    marked = roles(command)
    first, several = own[0].name, "list" in str(own[0].annotation)
    if example is not None:
        own = [_optional(parameter) for parameter in own]
        option = Parameter("example", Parameter.KEYWORD_ONLY, default=False, annotation=bool)
        own.insert(1, declared(option, command.__name__))
    quiet = Annotated[bool, typer.Option("--quiet", "-q")]
    own.append(declared(Parameter("quiet", Parameter.KEYWORD_ONLY, default=False, annotation=quiet), "Job"))

    @wraps(command)
    def with_one(**values: Any) -> None:
        for parameter in own:
            value = values.get(parameter.name, parameter.default)
            if isinstance(value, int) and abs(value) > LARGEST:
                raise misuse(_option(parameter), "large", limit=LARGEST, value=value)
        if "example" in values:
            _arrange(own, values)
        found: dict[Reads | Writes, list[Path]] = {each: [] for each in (*Reads, *Writes)}
        for path_name, role in marked.items():
            given = values.get(path_name)
            paths = given if isinstance(given, list) else [given]
            found[role] += [Path(path) for path in paths if path is not None]
        job = Job(
            found[Reads.FILE],
            found[Reads.PROJECT],
            found[Writes.FILE],
            found[Writes.DIRECTORY],
            options=_given(own, values),
            quiet=values.pop("quiet", False),
        )
        with job:
            if values.pop("example", False):
                job.is_example = True
                if example:
                    path = job.packaged(example[0]).joinpath(*example[1:])
                    values[first] = [path] if several else path
                    if path.is_file() or marked[first] is Reads.PROJECT:
                        job.reads(path)
            if ending and (job.is_example or values[first]):
                source = values[first][0] if several and values[first] else values[first]
                shown = name if job.is_example else ""
                values["out"] = values.get("out") or default_out(source, ending, shown)
                job.writes_inside(values["out"])
            for group, (kind, fields) in grouped.items():
                values[group] = _made(kind, fields, values)
            command(job=job, **values)

    with_one.__dict__["__signature__"] = signature(command).replace(parameters=own)
    with_one.__annotations__ = {parameter.name: parameter.annotation for parameter in own}
    return with_one


def _optional(parameter: Parameter) -> Parameter:
    """Return an argument that `--example` can replace, or an output with a default."""
    if parameter.default is not Parameter.empty:
        return parameter
    kind, *marks = get_args(parameter.annotation)
    return parameter.replace(default=None, annotation=Annotated[(kind | None, *marks)])


def _made(kind: type, options: Iterable[Parameter], values: dict[str, Any]) -> Any:
    """Return an object of a class of options; errors of its constructor name the option."""
    from photogram.errors import InputError

    names = {each.name: _option(each) for each in options}
    parsers: dict[str, Any] = {each.name: each.metadata.get("parse") for each in fields(kind)}
    given = {name: values.pop(name) for name in names if values.get(name) is not None}
    for name in given:
        try:
            given[name] = parsers[name](given[name]) if parsers[name] else given[name]
        except InputError:
            raise
        except ValueError as error:
            raise misuse(names[name], "form", form=str(error), value=given[name]) from None
    for name in names:
        values.pop(name, None)
    try:
        return kind(**given)
    except InputError as error:
        known = error.phrase.fields if error.phrase else {}
        if known.get("what") not in names:
            raise
        message = known["message"]
        if "options" in message.fields:
            message = phrase(message.code, options=[names[name] for name in message.fields["options"]])
        raise typer.BadParameter(str(message), param_hint=names[known["what"]]) from None


def _given(parameters: Iterable[Parameter], values: Mapping[str, Any]) -> dict[str, str]:
    """Return options and arguments without defaults, as a user writes them."""
    found = {}
    for parameter in parameters:
        value = values.get(parameter.name, parameter.default)
        if value == parameter.default or value is None:
            continue
        argument = _mark(parameter, ArgumentInfo)
        name = _option(parameter) if argument is None else str(argument.metavar)
        each = value if isinstance(value, list) else [value]
        found[name] = ", ".join(str(getattr(one, "value", one)) for one in each)
    return found


def _arrange(parameters: Iterable[Parameter], values: dict[str, Any]) -> None:
    """Assign values to arguments; an option may replace the first argument."""
    marks = {parameter.name: _mark(parameter, ArgumentInfo) for parameter in parameters}
    arguments = {name: mark.metavar for name, mark in marks.items() if mark is not None}
    given = [values[name] for name in arguments if values[name]]
    stands = [word for name, word in STANDS.items() if name in values]
    instead = sum(bool(values.get(name)) for name in STANDS)
    first, *others = arguments.values()
    if len(given) + instead > len(arguments) or not (given or instead):
        raise misuse(str(first), "alternatives", names=[first, *stands])
    if len(given) + instead < len(arguments):
        raise misuse(str(others[-1]), "missing")
    if instead:
        values.update(zip(arguments, [None, *given], strict=True))


def _option(parameter: Parameter) -> str:
    """Return the name of an option on the command line."""
    mark = _mark(parameter, OptionInfo)
    # In an annotation, the default of the mark is the first option name.
    given = () if mark is None else (mark.default, *(mark.param_decls or ()))
    names = [each for each in given if isinstance(each, str)] or ["--" + parameter.name.replace("_", "-")]
    return next((each for each in names if each.startswith("--")), names[0])
