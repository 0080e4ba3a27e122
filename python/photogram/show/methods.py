"""Results with a verdict and a document.

Their methods `document` and `_findings` import the files that compose the document or the findings.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.statistics.verdict import Verdict


class Judged:
    """What has a verdict."""

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the result can be used, and if not, what is wrong; see `docs/tests.md`."""
        from photogram.statistics.verdict import verdict  # what is only adjusted is not judged

        return verdict(self._findings())

    def _findings(self) -> Findings:
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
