"""The page of a calibrated comparator: what it says, before the listing of 1973 (listing.txt) repeats it."""

from __future__ import annotations

from functools import partial

from photogram.arguments.types import Floats
from photogram.comparator.calibration import Calibration
from photogram.comparator.correction import Correction
from photogram.comparator.joint import JointFit
from photogram.comparator.tables import (
    cases,
    coefficients,
    far_pointings,
    linear,
    outliers,
    terms,
    variance,
)
from photogram.show.angles import ARCSEC
from photogram.show.cells import page_table
from photogram.show.judgement import judged, remarks_section, tests_section
from photogram.show.methods import page_of
from photogram.show.page import (
    Document,
    Drawing,
    Fact,
    Facts,
    Layers,
    Part,
    Section,
    Table,
    probability_written,
    significant,
)

UM = "µm"


@page_of.register(Calibration)
def calibration_page(calibration: Calibration) -> Document:
    """Return the report of a calibration for the browser."""
    session = calibration.session
    date = f", {session.date}" if session.date else ""
    own = calibration.linear
    combined = _linear(own.correction, own.covariance, own.degrees_of_freedom)
    sections = [
        Section("variance", "Where the errors come from", [_variance(calibration)], _VARIANCE),
        Section("pictures", "Pictures", _pictures(calibration)),
        Section("linear", "Linear parameters", [combined], _LINEAR),
        Section("polynomials", "Polynomials", _polynomials(calibration), _POLYNOMIALS),
        Section("cases", "Cases", _cases(calibration)),
        Section("outliers", "Readings that do not agree", _outliers(calibration)),
        Section("joint", "Joint adjustment", _joint(calibration.joint) if calibration.joint else [], _JOINT),
        tests_section(calibration.verdict),
        remarks_section(calibration.messages),
    ]
    return Document(
        what="Calibration of a comparator",
        title=f"Comparator {session.comparator}, {len(calibration.cases)} cases{date}",
        judgements=[judged(calibration.verdict)],
        advice=calibration.verdict.next,
        highlights=_highlights(calibration),
        sections=sections,
    )


_VARIANCE = (
    "Standard deviations of a coordinate, stage by stage, and what of them is whose. Systematic shares"
    " are what the"
    " calibration takes away; the random one is what stays in every corrected measurement."
)
_LINEAR = (
    "x′ = scale x · x + scale y · sin α · y, y′ = scale y · cos α · y. α is the lack of orthogonality of the"
    " axes."
)
_POLYNOMIALS = (
    "What is added to linearly corrected coordinates: polynomials of fourth degree in metres. Each term"
    " is tested with"
    " its argument from -1 to 1 over the measured range, so that its coefficient is its effect at the edge."
)
_JOINT = "All cases, comparator, polynomials and grid in one adjustment, with the accuracy of the grid."


def _highlights(calibration: Calibration) -> list[Fact]:
    variance = calibration.variance
    after = variance.after_nonlinear or variance.after_linear
    found = [
        Fact(
            "A coordinate before", significant(variance.before.total, 3), UM, "standard deviation of one axis"
        ),
        Fact("After the calibration", significant(after.total, 3), UM),
        Fact("Random comparator", significant(variance.random, 3), UM),
        Fact("Pointing, mean of a point", significant(variance.pointing.total, 3), UM),
    ]
    own = calibration.linear.correction
    lack = own.nonorthogonality_rad / ARCSEC
    found.append(Fact("Lack of orthogonality", significant(lack, 3), "″"))
    return found


def _variance(calibration: Calibration) -> Table:
    negative = calibration.variance.negative
    note = f"Negative variances, set to 0: {', '.join(negative)}." if negative else ""
    return page_table("Analysis of variance", variance(calibration), note)


def _linear(correction: Correction, covariance: Floats, freedom: int) -> Table:
    table = linear(correction, covariance)
    return page_table("Linear parameters", table, f"{freedom} degrees of freedom", table[2].values)


def _polynomials(calibration: Calibration) -> list[Part]:
    nonlinear, test = calibration.nonlinear, calibration.polynomial_tests
    if nonlinear is None or test is None:
        return []
    first, second = test.degrees_of_freedom
    p = "" if test.probability is None else f", p = {probability_written(test.probability)}"
    note = f"All terms together: F = {test.ratio:.2f} with {first} and {second} degrees of freedom{p}."
    return [
        page_table("Terms and their tests", terms(test.terms), note),
        page_table("Coefficients, arguments in metres", coefficients(nonlinear)),
    ]


def _cases(calibration: Calibration) -> list[Part]:
    note, test = "", calibration.case_test
    if test is not None and test.f_max_limit is not None:
        same = "are" if test.f_max <= test.f_max_limit else "are not"
        note = (
            f"F-max = {test.f_max:.2f}, limit {test.f_max_limit:.2f}: the cases {same} of one population"
            " (95 percent)."
        )
    return [page_table("Cases", cases(calibration), note)]


def _outliers(calibration: Calibration) -> list[Part]:
    parts: list[Part] = []
    screening = calibration.screening
    if screening.outliers:
        note = (
            f"Beyond {screening.limit:.2f} the test rejects. They change corrected coordinates by"
            f" {screening.change_um:.2f} {UM} (root mean square)."
        )
        parts.append(page_table("Points", outliers(screening.outliers), note))
    if calibration.far_pointings:
        parts.append(page_table("Single pointings", far_pointings(calibration.far_pointings)))
    return parts


def _joint(joint: JointFit) -> list[Part]:
    facts = [
        Fact(
            "Standard deviation of unit weight",
            f"{joint.sigma0:.4f}",
            note=f"{joint.degrees_of_freedom} degrees of freedom",
        ),
        Fact("Random comparator, estimated", significant(joint.random_um, 4), UM),
    ]
    for plate, own in joint.plates.items():
        how = "estimated" if own.estimated else "given"
        facts.append(Fact(f"Grid {plate}, standard deviation", significant(own.sigma_um, 4), UM, how))
    table = _linear(joint.correction, joint.covariance, joint.degrees_of_freedom)
    return [Facts("Joint adjustment", facts), table]


def _pictures(calibration: Calibration) -> list[Part]:
    """Return the pictures of the calibration, one shown at a time."""
    from photogram.comparator.pictures.book import sketches

    made = sketches(calibration)
    layers = [Drawing(f"picture-{name}", _title(name), "", partial(made.get, name)) for name in made]
    return [Layers("picture-layers", layers)]


def _title(name: str) -> str:
    words = name.replace("-", " ")
    return words[:1].upper() + words[1:]
