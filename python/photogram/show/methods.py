"""Results with a verdict and a document, and functions with a definition for each class of networks.

A class of results has the methods `document` and `_findings`, which import the file that composes the
document or the findings. A `Way` has a definition for blocks and one for collections; `WAYS` of the package
of a class names the file that defines it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cached_property, singledispatch, update_wrapper
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, ParamSpec, TypeVar, overload

if TYPE_CHECKING:
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


def findings_of(result: Judged) -> Findings:
    """Return what the verdict on a result rests on."""
    return result._findings()


class Judged:
    """What has a verdict."""

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the result can be used, and if not, what is wrong; see `docs/tests.md`."""
        from photogram.statistics.verdict import verdict  # what is only adjusted is not judged

        return verdict(self._findings())

    def _findings(self) -> Findings:
        """Return what the verdict rests on."""
        raise NotImplementedError


class Documented:
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

    def to_html(self) -> bytes:
        """Return the report for the browser: one HTML file that needs nothing else (docs/report.md).

        Needs jinja2 (`pip install 'photogram[report]'`).
        """
        from photogram.show.html import page_html
        from photogram.show.run import reproducibility

        page = self.document()
        return page_html(page.with_sections(reproducibility(None, page.phases)))
