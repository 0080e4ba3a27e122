"""What no two sentences of one report may say beside each other: one judgement is the source of all."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator

from photogram.show import quantity
from photogram.show.forms import PLAIN, written
from photogram.show.page import Document, Facts, Layers, Part, Remarks, Table, Text
from photogram.statistics.verdict import Verdict

CLAIMS = {
    "it can be used": (
        r"exit code 0$|^mark usable|^usable\b|^accepted[:,]|can be used|nothing needs|is good"
        r"|residuals agree with the given|document: usable"
        r"|holds the calibrated camera|correct measurements with|^adjust: "
    ),
    "it must not be used": (
        r"exit code [34]$|^mark not to be used|must not be used|do not use|do not hand over|are no results"
        r"|is withheld|are withheld|may take this camera|model or identification is wrong|is unusable"
        r"|the data are likely wrong|gross errors likely|gross errors: |the model is likely wrong"
        r"|document: not usable"
    ),
    "nothing is to be done": r"nothing needs",
    "something is to be done": (
        r"^mark .*look first|look at the|put right|^correct what|adjust again|^give the "
    ),
    "all is well": r"^problems: none$|^accepted: ",
    "nothing rejects": r"no single test rejects|^nothing was found",
    "a test rejects": r"test .* rejects$|\(and \d+ more\)|gross errors likely|look at: ",
    "take observations out": r"--snoop|takes? (them|gross errors) out|--reject id",
    "take nothing out": (
        r"observations are not to be taken out|do not take out observations|what is held is no observation"
    ),
    "observations were taken out": r"after removal of|had to be removed|^taken out [1-9]",
    "nothing was taken out": r"nothing was taken out",
    "tested as a whole": r"residuals agree with the given|weights too (optimistic|pessimistic)|test global",
    "not tested as a whole": r"not tested as a whole|there is no global test",
    "checked": r"^accepted|no single test rejects|are judged by|degrees of freedom [1-9]\d",
    "not checked": r"nothing is checked|nothing checks these|no degrees of freedom|degrees of freedom 0$",
    "check points were tested": r"check points disagree|at the check points|test check|^check points +[\d.]",
    "no check points": r"there are no check points",
    "has a datum": r"held components of control .*[1-9]|datum observations",
    "has no datum": r"nothing gives the network a datum|there is no control",
    "converged": r"status converged",
    "not converged": r"not converged|has diverged|status (not|diverged)",
    "standard deviations too small": r"too optimistic|standard deviations are too small",
    "standard deviations too large": r"too pessimistic|smaller standard deviations",
    "covariances are scaled": r"covariances are scaled by the unit variance",
    "covariances are not scaled": r"covariances are scaled by 1",
    "residuals agree": r"residuals agree with the given",
    "residuals do not": r"too optimistic|too pessimistic|gross errors( likely)?: ",
    "one cause": r"model is likely wrong|gross errors likely|weights too optimistic",
    "no cause": r"no single cause",
    "withheld": r"is withheld|are withheld",
    "handed out": r"holds the calibrated camera|correct measurements with|next calibration the adjusted grid",
    "nothing grave": r"^0 grave|nothing grave|^nothing was found",
    "grave": r"^[1-9]\d* grave|^grave (?!0|findings)",
}
"""What sentences claim, as expressions of small letters."""

EXCLUSIVE = (
    ("it can be used", "it must not be used"),
    ("nothing is to be done", "something is to be done"),
    ("all is well", "it must not be used"),
    ("all is well", "a test rejects"),
    ("nothing rejects", "a test rejects"),
    ("take observations out", "take nothing out"),
    ("take observations out", "observations were taken out"),
    ("observations were taken out", "nothing was taken out"),
    ("tested as a whole", "not tested as a whole"),
    ("checked", "not checked"),
    ("check points were tested", "no check points"),
    ("has a datum", "has no datum"),
    ("converged", "not converged"),
    ("standard deviations too small", "standard deviations too large"),
    ("covariances are scaled", "covariances are not scaled"),
    ("residuals agree", "residuals do not"),
    ("one cause", "no cause"),
    ("withheld", "handed out"),
    ("nothing grave", "grave"),
)
"""Of each two, no sentence that claims one stands in a report with one that claims the other."""


def contradictions(sentences: Iterable[str]) -> list[tuple[str, str]]:
    """Return all pairs of sentences of a report that contradict each other."""
    every = list(dict.fromkeys(" ".join(each.lower().split()) for each in sentences))
    claim = {name: [each for each in every if re.search(found, each)] for name, found in CLAIMS.items()}
    return [(one, other) for a, b in EXCLUSIVE for one in claim[a] for other in claim[b]]


def sentences_of(verdict: Verdict, page: Document | None, report: str, document: bytes | None) -> list[str]:
    """Return what a command ends by, and all that its page, its text and its document say."""
    told = [f"exit code {verdict.exit}", verdict.headline, *map(str, [*verdict.lines, *verdict.next])]
    told += [f"test {test.name.partition(':')[0]} {'passes' if test.accepted else 'rejects'}"
             for test in verdict.tests]  # fmt: skip
    if page is not None:
        told += _of_page(page)
    told += _of_text(report)
    if document is not None:
        told += _of_document(json.loads(document))
    return told


def _of_page(page: Document) -> Iterator[str]:
    for each in page.judgements:
        yield from (f"mark {each.mark}", each.headline, *each.lines)
    yield from map(str, page.advice)
    for fact in page.highlights:
        yield f"{fact.name} {fact.value} {fact.unit}"
        yield fact.note
    for section in page.sections:
        yield section.intro
        for part in section.parts:
            yield from _of_part(part)


def _of_part(part: Part) -> Iterator[str]:
    if isinstance(part, quantity.Table):
        if not part.visible:
            return
        part = written(part)
    if isinstance(part, Facts):
        for fact in part.facts:
            yield f"{fact.name} {fact.value} {fact.unit}"
            yield fact.note
    elif isinstance(part, Layers):
        for each in part.parts:
            yield from _of_part(each)
    elif isinstance(part, Remarks):
        yield from part.sentences
    elif isinstance(part, Text):
        yield part.text
    else:
        yield part.title if isinstance(part, Table) else part.caption
        if isinstance(part, Table):
            yield part.note


def _of_text(report: str) -> Iterator[str]:
    """Return the lines of a report as text, those of short sections with their titles."""
    title = ""
    for line, below in zip(report.splitlines(), [*report.splitlines()[1:], ""], strict=True):
        if below and set(below) == {"-"}:
            title = line
        yield line
        yield f"{title}: {line}"


def _of_document(members: dict) -> Iterator[str]:
    if "usable" in members:
        yield f"document: {'usable' if members['usable'] else 'not usable'}"
    yield from members.get("messages", ())
    if members.get("covariance_scale") == 1.0:
        yield "covariances are scaled by 1"
    yield from (f"problems: {each}" for each in members.get("problems", ()))


def plain_words(text: str) -> str:
    """Return a text without line ends and capitals, as a report writes it."""
    return " ".join(text.translate(PLAIN).casefold().split())


def assert_one_judgement(
    verdict: Verdict, page: Document | None, report: str, document: bytes | None
) -> None:
    """See that page, text and document say the same, and that no two sentences contradict each other."""
    found = contradictions(sentences_of(verdict, page, report, document))
    assert not found, f"{verdict}: {found}"
    if page is not None and len(page.judgements) == 1:
        assert page.judgements[0].headline == verdict.headline
        assert list(page.advice) == list(verdict.next)
    assert verdict.next
    if "Verdict\n" in report:
        words = plain_words(report)
        for sentence in (verdict.headline, *verdict.lines, *verdict.next):
            assert plain_words(str(sentence)) in words
    if document is not None and "verdict" in (members := json.loads(document)):
        assert members["verdict"]["next"] == [str(each) for each in verdict.next]
