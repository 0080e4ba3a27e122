"""Common methods of results: verdict and document.

Their methods `document` and `_findings` import the modules that create the document or the findings.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from photogram.summaries import Brief

if TYPE_CHECKING:
    import pandas as pd

    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.statistics.verdict import Verdict


class Judged:
    """Base class of results with a verdict."""

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the result can be used, and if not, the reason (`docs/tests.md`)."""
        from photogram.statistics.verdict import verdict  # imported on demand

        return verdict(self._findings())

    def _findings(self) -> Findings:
        raise NotImplementedError


class Documented(Brief):
    """Base class of results with a document, the source of all output formats, and a summary."""

    def document(self) -> Document:
        """Return the document: verdict, sections, tables."""
        raise NotImplementedError

    def report(self) -> str:
        """Return the document as text."""
        from photogram.show.forms import text

        return text(self.document())

    def to_json(self) -> bytes:
        """Return the result as a JSON document (UTF-8); its page lists the members."""
        from photogram.show.forms import to_json

        return to_json(self.document())

    def to_html(self) -> bytes:
        """Return the HTML report, one self-contained file (docs/report.md)."""
        from photogram.show.html import page_html, reproducibility

        page = self.document()
        return page_html(page.with_sections(reproducibility(page.phases)))


class Tabular(Documented):
    """Base class of results that are one table in the main."""

    def table(self) -> pd.DataFrame:
        """Return the table as a data frame."""
        return self.document().tables()[0].frame()
