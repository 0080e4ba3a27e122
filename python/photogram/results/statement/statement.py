"""Accuracy statement of an adjusted block: figures, sentences, assumptions, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from photogram.arguments.arrays import truth_value
from photogram.arguments.objects import require_kind
from photogram.errors import AdjustmentError, InputError
from photogram.io.seals import InputFile
from photogram.lazy_dataclasses import dataclass
from photogram.results.result import Result
from photogram.results.statement import comparison, tables
from photogram.results.statement import standards as by_standard
from photogram.results.statement.budget import Budget, budgets, chosen, wanted
from photogram.results.statement.comparison import Layout, layout
from photogram.results.statement.figures import Figures, figures
from photogram.results.statement.judgement import Judged, judged
from photogram.results.statement.request import Asked
from photogram.results.statement.texts import Texts
from photogram.show.methods import Documented
from photogram.show.page import Document
from photogram.show.quantity import records
from photogram.summaries import Rows
from photogram.words import Phrase, phrase


@dataclass(frozen=True, eq=False, repr=False)
class Statement(Documented):
    """An accuracy statement for a client: figures, standards, methods, assumptions.

    Lengths are in the linear unit of the block, along east, north and up.

    Attributes
    ----------
    result, asked, texts
        The adjusted block, the request, and its texts.
    compared
        Check points with their joint covariance.
    of_all, of_rest, of_vegetated
        Figures of all check points, without excluded ones, and of heights in vegetation; None without any.
    left_out
        Control points predicted by the others.
    taken_apart
        Budgets of uncertainty.
    standards
        Results by standards.
    layout
        The distribution of check points; None without any.
    removed
        Names of observations that were not used in the adjustment, each with the reason: `snooping` (data
        snooping removed it), `first values` (it does not fit the initial values), `earlier` (removed before).
    survey
        Control and check points as given, in the displayed coordinate system.
    inputs, command
        Input files and command, if a command made the statement.
    assumed
        Assumptions in reading the files.
    strict
        Whether some messages also have the exit code 4.
    """

    result: Result
    asked: Asked
    texts: Texts
    compared: comparison.Compared
    of_all: Figures | None
    of_rest: Figures | None
    of_vegetated: Figures | None
    left_out: tuple[comparison.LeftOut, ...]
    taken_apart: tuple[Budget, ...]
    standards: by_standard.Standards
    layout: Layout | None
    removed: tuple[tuple[Phrase | str, str], ...]
    survey: comparison.Survey
    inputs: tuple[InputFile, ...] = ()
    command: str = ""
    assumed: Sequence[Phrase | str] = ()
    strict: bool = False

    @cached_property
    def judged(self) -> Judged:
        """Headline, sentences, assumptions, messages and exit code for all outputs."""
        return judged(self)

    @property
    def exit(self) -> int:
        """The exit code: 0 without objections, 4 if the statement must not be used.

        The code is 4 if a class is missed, differences are larger than predicted, or the verdict of the
        adjustment requires it. With `strict` it is also 4 for a warning of that verdict, smaller
        differences than predicted, a disagreeing control point, or calibrated lengths that disagree with
        their standard deviations.
        """
        return self.judged.exit

    @property
    def headline(self) -> str:
        """The first sentence of the page."""
        return self.judged.headline

    @property
    def figures(self) -> dict[str, Any] | None:
        """All figures by their names in the JSON document; None without check points."""
        return tables.figures_member(self.of_all, self.standards.nssda_member)

    @property
    def sentences(self) -> list[dict[str, str]]:
        """The statements: a key of the table of texts and a text each."""
        return [{"key": key, "text": text} for key, text in self.judged.sentences]

    @property
    def assumptions(self) -> list[dict[str, str]]:
        """The assumptions: a key and a text each."""
        return [{"key": key, "text": text} for key, text in self.judged.assumptions]

    @property
    def check_points(self) -> list[dict[str, Any]]:
        """The check points, as in the JSON document."""
        return records(tables.check_points(self).columns)

    @property
    def leave_one_out(self) -> list[dict[str, Any]]:
        """Control points predicted by the others, as in the JSON document."""
        return records(tables.left_out_points(self.texts, self.left_out).columns)

    def budget(self, quantity: str | Mapping[Any, Sequence[float]]) -> dict[str, Any]:
        """Return the budget of a quantity of the page, or of any other.

        Parameters
        ----------
        quantity
            `point C08 z`, `distance C01 C30`, `camera drone f`, `photo 101 z`, or a linear function by its
            gradient, `{("point", "C08"): [0, 0, 1]}`.

        Raises
        ------
        InputError
            If the quantity does not exist.
        AdjustmentError, OutOfMemoryError, KeyboardInterrupt
            As in :meth:`photogram.Result.covariances`.
        """
        found = [each for each in self.taken_apart if each.quantity == quantity] or budgets(
            self.result,
            [wanted(self.result, quantity)],
            self.result.covariances(),
            coverage=self.asked.coverage,
        )
        return tables.budget_member(found[0])

    def brief(self) -> tuple[str, Rows]:
        """Return a summary of the statement."""
        rows = [("headline", self.headline), *((key, text) for key, text in self.judged.sentences)]
        return "Accuracy statement", [
            *rows,
            ("see", ".figures, .check_points, .budget(..), .to_html(), .to_pdf()"),
        ]

    def document(self) -> Document:
        """Return the document: headline, sentences, figures, assumptions, annexes."""
        from photogram.results.statement.page import statement_document

        return statement_document(self)

    def to_html(self, path: str | PathLike[str] | None = None) -> bytes:
        """Return the page as a self-contained HTML file; optionally write it to a path."""
        from photogram.show.html import page_html

        return _written(page_html(self.document()), path)

    def to_pdf(self, path: str | PathLike[str] | None = None) -> bytes:
        """Return the page as a PDF document; optionally write it to a path.

        Needs typst (`pip install 'photogram[pdf]'`).
        """
        try:
            from photogram.show.pdf import page_pdf
        except ModuleNotFoundError:
            raise InputError(phrase("error.package", what="PDF", package="typst", extra="pdf")) from None
        return _written(page_pdf(self.document(), author=self.asked.firm), path)

    def to_json(self, path: str | PathLike[str] | None = None) -> bytes:
        """Return all data as a JSON document (UTF-8); optionally write it to a path."""
        return _written(super().to_json(), path)


def _written(content: bytes, path: str | PathLike[str] | None) -> bytes:
    if path is not None:
        from photogram.io.writing import write_whole

        write_whole({Path(path): content})
    return content


def statement(
    result: Result,
    *,
    strict: bool = False,
    assumed: Sequence[Phrase | str] = (),
    removed: Sequence[Phrase | str] = (),
    system: comparison.System | None = None,
    inputs: Sequence[InputFile] = (),
    command: str = "",
    **asked: Any,
) -> Statement:
    """Return the accuracy statement of an adjusted block (docs/statement.md).

    Parameters
    ----------
    result
        The adjusted block, with covariances.
    strict
        Whether some messages also have the exit code 4.
    assumed
        Assumptions in reading the files, as sentences.
    removed
        Names of observations that you removed before the adjustment. The statement also lists those that data
        snooping and the initial values removed.
    system
        The displayed coordinate system; None: the axes of the block.
    inputs, command
        Input files and command, for annex G.
    asked
        `standards`, `classes`, `area`, `sd`, `without`, `independent`, `language`, `text`, `budgets`,
        `coverage`, `client` ...: see :class:`photogram.results.statement.request.Asked`.

    Raises
    ------
    InputError
        If options are invalid, quantities do not exist, or check points are without standard deviations of
        their survey or are control.
    AdjustmentError
        If the adjustment has not converged, or is without covariances.
    OutOfMemoryError, KeyboardInterrupt
        As in :meth:`photogram.Result.covariances`.
    """
    truth_value("strict", strict)
    require_kind("result", result, Result)
    options = Asked.checked(**asked)
    if not result.converged:
        raise AdjustmentError(phrase("request.not-converged", status=result.status))
    if (
        not result.WHOLE
        or not np.isfinite(result.point_cofactors[np.flatnonzero(result.used_points)[:1]]).all()
    ):
        raise AdjustmentError(phrase("request.covariances"))
    texts = Texts(options.language, options.text, result.block.linear_unit)
    covariances = result.covariances()
    found = comparison.compared(result, options, covariances)
    rest = found.without(list(options.without)) if options.without else None
    of_all = figures(found, options.coverage)
    of_vegetated = figures(found.in_vegetation(), options.coverage)
    left_out = comparison.leave_one_out(result)
    quantities = (
        chosen(result, found.names)
        if options.budgets is None
        else [wanted(result, each) for each in options.budgets]
    )
    taken_apart = budgets(
        result, quantities, covariances, coverage=options.coverage, components=options.components
    )
    lengths = by_standard.tested_lengths(result, options) if options.lengths else None
    snooped = () if result.snooped is None else [each["subject"] for each in result.snooped.removed]
    of_reason = {"snooping": snooped, "first values": result.set_aside, "earlier": removed}
    # Given positions with both plan coordinates.
    checks = found.given_places[np.isfinite(found.given[:, :2]).all(axis=1)]
    control = comparison.control_places(result.block)
    return Statement(
        result=result,
        asked=options,
        texts=texts,
        compared=found,
        of_all=of_all,
        of_rest=None if rest is None else figures(rest, options.coverage),
        of_vegetated=of_vegetated,
        left_out=tuple(left_out),
        taken_apart=tuple(taken_apart),
        standards=by_standard.Standards(
            asprs=by_standard.asprs_figures(result, options, found, of_all, of_vegetated, left_out)
            if "asprs-2023" in options.standards
            else None,
            nssda=None
            if of_all is None
            else by_standard.nssda(of_all.moments, of_all.rmse["rmse_v1"], of_all.n),
            lengths=lengths,
            iso_19157=by_standard.iso_measures(of_all, lengths) if "iso-19157" in options.standards else [],
        ),
        layout=layout(checks, np.concatenate([checks, control]), control) if len(checks) else None,
        removed=tuple((name, why) for why, names in of_reason.items() for name in names),
        survey=comparison.surveyed(result, found, system),
        inputs=tuple(inputs),
        command=command,
        assumed=assumed,
        strict=strict,
    )
