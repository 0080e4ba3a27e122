"""Ways to show a result: declared here, defined for each class of results in the files above it.

A class of results holds arrays and their names, and knows no report; a report knows the class whose arrays it
reads. `Result.report()` calls `report_of`, which `results.report` defines for `Result`. So a result is one
class, and no file needs one that needs it. The package of a class imports the files that define its ways:
they are there as soon as the class is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, singledispatch
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, BinaryIO, NoReturn

from photogram.statistics.findings import Findings
from photogram.statistics.verdict import Verdict, verdict

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Page
    from photogram.show.run import Run

__all__ = [
    "Judged",
    "Shown",
    "axes_of",
    "columns_of",
    "document_of",
    "files_of",
    "findings_of",
    "html_of",
    "page_of",
    "report_of",
]


@singledispatch
def report_of(result: object) -> str:
    """Return the report of a result as text."""
    _undefined(result, "report")


@singledispatch
def document_of(result: object) -> bytes:
    """Return the whole result as a JSON document (UTF-8)."""
    _undefined(result, "JSON document")


@singledispatch
def columns_of(result: object, what: str) -> Mapping[str, Any]:
    """Return what a result says about one kind of thing (`photo`, `point`, `image` ...) as named columns."""
    _undefined(result, f"table of {what}s")


@singledispatch
def files_of(result: object) -> Mapping[str, bytes | Callable[[BinaryIO], None]]:
    """Return a result as files of a folder, by their names, from which it can be read again.

    Large ones write themselves to the file that they are given.
    """
    _undefined(result, "files")


@singledispatch
def axes_of(result: object, ax: Any = None) -> Any:
    """Draw a result into axes, or into a new figure; return the axes."""
    _undefined(result, "picture")


@singledispatch
def page_of(result: object) -> Page:
    """Return the report of a result for the browser, without its last section.

    It is defined in the module `page` beside the class of the result, which is loaded when one is asked for.
    """
    for kind in type(result).__mro__:
        package = kind.__module__.rpartition(".")[0]
        if package and find_spec(f"{package}.page"):
            import_module(f"{package}.page")
    own = page_of.dispatch(type(result))
    if own is page_of.dispatch(object):
        _undefined(result, "page")
    return own(result)


def html_of(result: object, run: Run | None = None) -> bytes:
    """Return the report of a result as one HTML file; `run` is the run of the command that made it."""
    from photogram.show.html import page_html
    from photogram.show.run import reproducibility

    page = page_of(result)
    return page_html(page.with_sections(reproducibility(run, page.phases)))


@singledispatch
def findings_of(result: object) -> Findings:
    """Return what the verdict on a result rests on."""
    _undefined(result, "verdict")


def _undefined(result: object, way: str) -> NoReturn:
    raise NotImplementedError(f"{type(result).__name__} has no {way}")


class Judged:
    """What has a verdict."""

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the result can be used, and if not, what is wrong; see `docs/tests.md`."""
        return verdict(findings_of(self))


class Shown(Judged):
    """What has a report, a JSON document, and tables."""

    def report(self) -> str:
        """Return the report as text."""
        return report_of(self)

    def to_json(self) -> bytes:
        """Return the whole result as a JSON document (UTF-8); the page of the program lists its members."""
        return document_of(self)

    def to_html(self) -> bytes:
        """Return the report for the browser: one HTML file that needs nothing else (docs/report.md).

        Needs jinja2 and matplotlib (`pip install 'photogram[report]'`).
        """
        return html_of(self)

    def _table(self, what: str) -> pd.DataFrame:
        """Return what the result says about one kind of thing as a data frame.

        pandas rather than polars: geopandas, matplotlib and statsmodels, which people use on such tables,
        speak it. It is imported only when a table is asked for: that takes long.
        """
        import pandas as pd

        return pd.DataFrame(columns_of(self, what))
