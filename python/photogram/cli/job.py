"""One job behind every command: read, compute, spare the input, write, summarise, end with an exit code."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import is_dataclass, replace
from datetime import UTC, datetime
from enum import Enum
from functools import wraps
from importlib.resources import as_file, files
from inspect import Parameter, signature
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from typer.models import ArgumentInfo, OptionInfo

from photogram.cli.command_classes import declared
from photogram.cli.console import errors, failures, print_remark, print_report, print_written
from photogram.messages import Message, printable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.status import Status

    from photogram.io.writing import Content, OutputSet
    from photogram.show.run import Run

STANDS = {"example": "--example", "plan_views": "--plan"}
"""Options that stand for the first argument of a command, by their parameters."""
LARGEST = 2**53
"""What integers of options may be at most: beyond it numbers are not counts."""


class Reads(Enum):
    """What an option or argument names that a command reads."""

    FILE = "file"
    PROJECT = "directory of a GIANT project"


class Writes(Enum):
    """What an option or argument names that a command writes."""

    FILE = "file"
    DIRECTORY = "directory of results"
    EITHER = "file or directory, which the command finds out"


InputFile = Annotated[Path | None, Reads.FILE]
OutputFile = Annotated[Path | None, Writes.FILE]
OutputFolder = Annotated[Path | None, Writes.DIRECTORY]


class Job:
    """The inputs and outputs of a run of a command; a context manager around its work.

    On entry, before anything is computed, outputs that would harm an input or one another are refused, and
    remarks are made on inputs that an interrupted run may have left in disorder. What is known only later is
    told by :meth:`reads` and :meth:`writes`. Errors become messages and exit codes.

    Parameters
    ----------
    files, projects
        Files, and directories of GIANT projects, that are read.
    outputs, directories
        Files, and directories for results, that are written.
    quiet
        Whether nothing but errors is shown.
    options
        What was given on the command line, by the names of options: for the report.
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
        self.quiet = quiet

    def __enter__(self) -> Job:
        self._failures.__enter__()
        try:
            self._check()
            self._remark()
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
        """What was given on the command line and is not the default, by the names of options."""
        return self._options

    def packaged(self, *example: str) -> Path:
        """Return a packaged example, a file or a directory, for as long as the job lasts."""
        found = self._resources.enter_context(as_file(files("photogram").joinpath("examples", *example)))
        self._examples.append(found if found.is_dir() else found.parent)
        return found

    def shown(self, path: Path) -> Path:
        """Return a path as people are told: one of the package's without where the package lies."""
        for folder in [each.parent for each in self._examples] + [Path(str(files("photogram")))]:
            if folder in path.parents:
                return path.relative_to(folder)
        return path

    def told(self, messages: Iterable[Message]) -> list[Message]:
        """Return messages with their paths as people are told; see :meth:`shown`."""
        return [each if each.file is None else replace(each, file=self.shown(each.file)) for each in messages]

    def reads(self, *paths: Path) -> None:
        """Name further files, or directories of projects, that are read: no result goes over them.

        Raises
        ------
        InputError
            A result was to do so.
        """
        for path in paths:
            (self._projects if path.is_dir() else self._files).append(path)
        self._check()

    def reads_inside(self, folder: Path) -> None:
        """Name the files of a folder, where it is one; see :meth:`reads`."""
        if folder.is_dir():
            self.reads(*(each for each in sorted(folder.iterdir()) if each.is_file()))

    def spares(self, *paths: Path) -> None:
        """Name further files of which little is read: no result goes over them, and reports do not list them.

        Raises
        ------
        InputError
            A result was to do so.
        """
        self._spared += paths
        self._check()

    def writes(self, *files: Path) -> None:
        """Name further files that are going to be written: they are looked at now.

        Raises
        ------
        InputError
            One of them would harm an input or another result.
        """
        self._outputs += [path for path in files if path not in self._outputs]
        self._check()

    def write(self, *results: Mapping[Path, Content]) -> None:
        """Write results: all of them or none, none over an input, and no two to one place.

        Those whose names a user chose are given apart from those that have names of their own.
        """
        with self.outputs() as outputs:
            for files in results:
                for path, content in files.items():
                    self._check_projects(path)
                    outputs.write(path, content)

    def finish(
        self, *results: Mapping[Path, Content], summary: Callable[[], None] | None = None, code: int = 0
    ) -> None:
        """Write the results, as :meth:`write` does, then show what they are, and end.

        Parameters
        ----------
        results
            Contents of files.
        summary
            Prints what a reader wants first.
        code
            The exit code with which the job ends.
        """
        self.write(*results)
        self.conclude([path for each in results for path in each], summary=summary, code=code)

    def conclude(
        self, written: Iterable[Path], *, summary: Callable[[], None] | None = None, code: int = 0
    ) -> None:
        """Show what was found and written, and end; see :meth:`finish`."""
        if not self.quiet:
            if summary is not None:
                summary()
            written = list(written)
            print_written(written)
            print_report(written)
        if code:
            raise typer.Exit(code)

    def run(self, command: str) -> Run:
        """Return what the report says of the run of a command: options, inputs, times up to now."""
        from photogram.show.run import Run, input_files

        found, others = input_files(self._inputs())
        inputs = [replace(each, path=self.shown(each.path)) for each in found]
        seconds = time.perf_counter() - self._clock
        return Run(f"photogram {command}", self._options, inputs, self._began, seconds, others)

    @contextmanager
    def status(self, text: str) -> Iterator[Status | None]:
        """Show on standard error what is going on, if anything is to be shown."""
        if self.quiet:
            yield None
            return
        with errors.status(text, spinner="line") as status:
            yield status

    def outputs(self) -> OutputSet:
        """Return a set of files, for results that are written piece by piece."""
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
                raise InputError("is not a directory", file=path)
            sources = [each for each in (*self._projects, *self._files) if each.is_dir()]
            if path.exists() and any(path.samefile(each) for each in sources):
                raise InputError("the results would be written over the input", file=path)
        inputs = self._inputs()
        check_outputs(self._outputs, [*inputs, *self._spared], self._directories)
        for path in self._outputs:
            self._check_projects(path)

    def _remark(self) -> None:
        """Remark on inputs that belong to a set which an interrupted run may have left incomplete."""
        from photogram.io.writing.staging import doubtful

        for path, mark in doubtful(self._inputs()).items():
            told = f"{path}: an interrupted run may have left it out of step with other files: {mark}"
            print_remark(printable(told))

    def _check_projects(self, path: Path) -> None:
        """Refuse an output by which a project that is read would have two files of one name."""
        if not self._projects:
            return
        from photogram.errors import InputError
        from photogram.giant.files import project_name

        name = project_name(path)
        place = os.path.dirname(os.path.realpath(path))
        if name and any(os.path.realpath(project) == place for project in self._projects):
            raise InputError(f"would be taken for the {name} of the project", file=path)


def _check_name(path: Path) -> None:
    """Refuse what no call of the system can look at; that nothing is there is said by who reads it."""
    try:
        os.stat(path)
    except OSError as error:
        if error.errno not in (errno.ENOENT, errno.ENOTDIR):
            raise OSError(error.errno, error.strerror, str(path)) from None


class Without:
    """Stands beside a class of options in an annotation: a command does without those of these names."""

    def __init__(self, *names: str) -> None:
        self.names = names


def roles(command: Callable[..., Any]) -> dict[str, Reads | Writes]:
    """Return the roles of options and arguments of a command that are paths.

    Raises
    ------
    TypeError
        A path has no role, or several.
    """
    found: dict[str, Reads | Writes] = {}
    for parameter in _options(command)[0]:
        kind, *metadata = get_args(parameter.annotation)
        marks = [mark for mark in metadata if isinstance(mark, Reads | Writes)]
        if len(marks) == 1:
            found[parameter.name] = marks[0]
        elif marks or _holds_path(kind):
            raise TypeError(f"{command.__name__}: {parameter.name} must be marked as one of Reads or Writes")
    return found


def _holds_path(kind: object) -> bool:
    return kind is Path or any(_holds_path(part) for part in get_args(kind))


def _options(command: Callable[..., Any]) -> tuple[list[Parameter], dict[str, tuple[type, list[str]]]]:
    """Return options and arguments of a command, and its parameters that are classes of options."""
    options: list[Parameter] = []
    grouped: dict[str, tuple[type, list[str]]] = {}
    for parameter in signature(command, eval_str=True).parameters.values():
        kind, *marks = get_args(parameter.annotation) or (parameter.annotation,)
        if isinstance(kind, type) and is_dataclass(kind):
            without = [name for mark in marks if isinstance(mark, Without) for name in mark.names]
            fields = signature(kind, eval_str=True).parameters.values()
            own = [declared(field, kind.__name__) for field in fields if field.name not in without]
            grouped[parameter.name] = kind, [field.name for field in own]
            options += own
        elif parameter.name != "job":
            options.append(declared(parameter, command.__name__))
    return options, grouped


def with_job(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command its :class:`Job` as the parameter `job`, made of its options that are marked.

    A parameter that is a dataclass stands for options, its fields (but those :class:`Without` which the
    command does). Where there is an option `--example`, that stands for the first argument, as `--plan` of
    views does.

    Raises
    ------
    TypeError
        A path among the parameters is marked neither as read nor as written.
    """
    own, grouped = _options(command)
    marked = roles(command)

    @wraps(command)
    def with_one(**values: Any) -> None:
        for parameter in own:
            _check_value(parameter, values)
        if "example" in values:
            _arrange(own, values)
        found: dict[Reads | Writes, list[Path]] = {each: [] for each in (*Reads, *Writes)}
        for name, role in marked.items():
            given = values.get(name)
            paths = given if isinstance(given, list) else [given]
            found[role] += [Path(path) for path in paths if path is not None]
        job = Job(
            found[Reads.FILE],
            found[Reads.PROJECT],
            found[Writes.FILE],
            found[Writes.DIRECTORY],
            quiet=values.get("quiet", False),
            options=_given(own, values),
        )
        for name, (kind, names) in grouped.items():
            values[name] = kind(**{each: values.pop(each) for each in names if each in values})
        command(job=job, **values)

    with_one.__dict__["__signature__"] = signature(command).replace(parameters=own)
    with_one.__annotations__ = {parameter.name: parameter.annotation for parameter in own}
    return with_one


def _given(parameters: Iterable[Parameter], values: Mapping[str, Any]) -> dict[str, str]:
    """Return options and arguments that are not their defaults, as a user writes them."""
    found = {}
    for parameter in parameters:
        value = values.get(parameter.name, parameter.default)
        if value == parameter.default or value is None:
            continue
        name = _option(parameter)
        for mark in get_args(parameter.annotation)[1:]:
            if isinstance(mark, ArgumentInfo):
                name = str(mark.metavar)
        each = value if isinstance(value, list) else [value]
        found[name] = ", ".join(str(getattr(one, "value", one)) for one in each)
    return found


def _check_value(parameter: Parameter, values: Mapping[str, Any]) -> None:
    """Refuse a value that says nothing."""
    value = values.get(parameter.name, parameter.default)
    if isinstance(value, int) and abs(value) > LARGEST:
        raise typer.BadParameter("is too large", param_hint=_option(parameter))


def _arrange(parameters: Iterable[Parameter], values: dict[str, Any]) -> None:
    """Give arguments their values: with what stands for the first one, that goes without."""
    arguments = {
        parameter.name: mark.metavar
        for parameter in parameters
        for mark in get_args(parameter.annotation)[1:]
        if isinstance(mark, ArgumentInfo)
    }
    given = [values[name] for name in arguments if values[name]]
    stands = [word for name, word in STANDS.items() if name in values]
    instead = sum(bool(values.get(name)) for name in STANDS)
    first, *others = arguments.values()
    if len(given) + instead > len(arguments) or not (given or instead):
        raise typer.BadParameter(f"give {first}, or {', or '.join(stands)}", param_hint=first)
    if len(given) + instead < len(arguments):
        raise typer.BadParameter("is missing", param_hint=others[-1])
    if instead:
        values.update(zip(arguments, [None, *given], strict=True))


def _option(parameter: Parameter) -> str:
    """Return the name of an option on the command line."""
    for mark in get_args(parameter.annotation)[1:]:
        if isinstance(mark, OptionInfo):
            # Where it is annotated, the first of its names stands in the place of a default.
            names = [each for each in (mark.default, *(mark.param_decls or ())) if isinstance(each, str)]
            if names:
                return next((each for each in names if each.startswith("--")), names[0])
    return "--" + parameter.name.replace("_", "-")
