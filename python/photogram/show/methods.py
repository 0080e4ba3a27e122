"""Ways to show a result: declared here, defined for each class of results in the files above it.

A class of results holds arrays and their names, and knows no report; a report knows the class whose arrays it
reads. `Result.report()` calls `report_of`, which `results.report` defines for `Result`. So a result is one
class, and no file needs one that needs it. `WAYS` of the package of a class says which of its files define
its ways: they are loaded when the way is first asked for, by whichever name the class was imported.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cached_property, singledispatch, update_wrapper
from importlib import import_module
from typing import TYPE_CHECKING, Any, BinaryIO, Generic, NoReturn, ParamSpec, TypeVar, overload

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.statistics.verdict import Verdict

P = ParamSpec("P")
R = TypeVar("R")
F = TypeVar("F", bound=Callable[..., Any])


class Way(Generic[P, R]):
    """A function with one definition for each class of its first argument, a `functools.singledispatch`.

    A package names in `WAYS` its files that define it for its classes, by the name of the function; or those
    of each class by its name, where many wait for what few need.
    """

    __name__: str

    def __init__(self, function: Callable[P, R]) -> None:
        self._function = singledispatch(function)
        self._sought: set[type] = set()
        update_wrapper(self, function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Call what is defined for the class of the first argument."""
        return self.of(type(args[0]))(*args, **kwargs)

    def of(self, kind: type) -> Callable[P, R]:
        """Return what is defined for a class."""
        if kind not in self._sought:
            for each in kind.__mro__:
                package = each.__module__.rpartition(".")[0]
                files = getattr(sys.modules.get(package), "WAYS", {}).get(self.__name__, ())
                for file in files.get(each.__name__, ()) if isinstance(files, Mapping) else files:
                    import_module(f"{package}.{file}")
            self._sought.add(kind)
        return self._function.dispatch(kind)

    @overload
    def register(self, kind: type[Any]) -> Callable[[F], F]: ...
    @overload
    def register(self, kind: F) -> F: ...
    def register(self, kind: Any) -> Any:
        """Define it for a class: that of an annotation of the first argument, or one that is given."""
        return self._function.register(kind)


@Way
def report_of(result: object) -> str:
    """Return the report of a result as text."""
    _undefined(result, "report")


@Way
def document_of(result: object) -> bytes:
    """Return the whole result as a JSON document (UTF-8)."""
    _undefined(result, "JSON document")


@Way
def columns_of(result: object, what: str) -> Mapping[str, Any]:
    """Return what a result says about one kind of thing (`photo`, `point`, `image` ...) as named columns."""
    _undefined(result, f"table of {what}s")


@Way
def files_of(result: object) -> Mapping[str, bytes | Callable[[BinaryIO], None]]:
    """Return a result as files of a folder, by their names, from which it can be read again.

    Large ones write themselves to the file that they are given.
    """
    _undefined(result, "files")


@Way
def page_of(result: object) -> Document:
    """Return the document of a result: its own, or what is defined for its class."""
    if not isinstance(result, Documented):
        _undefined(result, "page")
    return result.document()


@Way
def findings_of(result: object) -> Findings:
    """Return what the verdict on a result rests on."""
    _undefined(result, "verdict")


@Way
def statement_of(result: object, **asked: Any) -> Any:
    """Return the accuracy statement of a result, by what is asked for."""
    _undefined(result, "statement")


def _undefined(result: object, way: str) -> NoReturn:
    raise NotImplementedError(f"{type(result).__name__} has no {way}")


class Judged:
    """What has a verdict."""

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the result can be used, and if not, what is wrong; see `docs/tests.md`."""
        from photogram.statistics.verdict import verdict  # what is only adjusted is not judged

        return verdict(self._findings())

    def _findings(self) -> Findings:
        return findings_of(self)


class Paged:
    """What has a report for the browser."""

    def to_html(self) -> bytes:
        """Return the report for the browser: one HTML file that needs nothing else (docs/report.md).

        Needs jinja2 (`pip install 'photogram[report]'`).
        """
        from photogram.show.html import page_html
        from photogram.show.run import reproducibility

        page = page_of(self)
        return page_html(page.with_sections(reproducibility(None, page.phases)))


class Documented(Paged):
    """A result that is one document, from which all its forms are written."""

    def document(self) -> Document:
        """Return the document: judgement, sections, tables."""
        raise NotImplementedError

    def report(self) -> str:
        """Return the document as text."""
        from photogram.show.forms import text

        return text(self.document())

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8); the page of the program lists its members."""
        from photogram.show.forms import to_json

        return to_json(self.document())


class Shown(Judged, Paged):
    """What has a report, a JSON document, and tables."""

    def report(self) -> str:
        """Return the report as text."""
        return report_of(self)

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8); the page of the program lists its members."""
        return document_of(self)

    def _table(self, what: str) -> pd.DataFrame:
        """Return what the result says about one kind of thing as a data frame.

        pandas rather than polars: geopandas, matplotlib and statsmodels, which people use on such tables,
        speak it. It is imported only when a table is asked for: that takes long.
        """
        import pandas as pd

        return pd.DataFrame(columns_of(self, what))
