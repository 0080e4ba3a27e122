"""What goes beyond the report: tests of significance, and the joint adjustment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogram.comparator.listing.forms import centred, number
from photogram.comparator.listing.parameters import linear_lines, polynomial_lines
from photogram.comparator.tables import terms
from photogram.show.lines import field, table_lines

if TYPE_CHECKING:
    from photogram.comparator.calibration import Calibration
    from photogram.comparator.joint import JointFit, JointPlate
    from photogram.comparator.significance import CaseVarianceTest, PolynomialTest

__all__ = ["joint_page", "tests_page"]


def tests_page(calibration: Calibration) -> list[str]:
    """Return the tests of polynomials and of case variances."""
    lines = centred("TESTS OF SIGNIFICANCE")
    if calibration.polynomial_tests:
        lines += [*_polynomial(calibration.polynomial_tests), ""]
    if calibration.case_test:
        lines += _cases(calibration.case_test)
    return lines


def _polynomial(test: PolynomialTest) -> list[str]:
    first, second = test.degrees_of_freedom
    axis, term, _, coefficient, sd, ratio, p = terms(test.terms)
    row = [*field(axis, 6, head="AXIS", gap="  "), *field(term, 6, head="TERM")]
    row += [*field(coefficient, 12, ".3f", "COEFFICIENT"), *field(sd, 10, ".3f", "SIGMA")]
    row += [*field(ratio, 10, ".2f", "T"), *field(p, 14, ".4f", "PROBABILITY")]
    return [
        f"ALL TERMS TOGETHER: F = {test.ratio:.2f} WITH {first} AND {second} DEGREES OF FREEDOM,"
        f" PROBABILITY {_probability(test.probability)}",
        "EACH TERM, ITS ARGUMENT FROM -1 TO 1 OVER THE MEASURED RANGE (MICRONS)",
        *table_lines(row),
    ]


def _cases(test: CaseVarianceTest) -> list[str]:
    lines = [
        f"VARIANCES OF THE CASES: F-MAX = {test.f_max:.2f} (AT LEAST {test.degrees_of_freedom} DEGREES OF"
        f" FREEDOM), LIMIT {number(test.f_max_limit, 0, 2)},"
        f" PROBABILITY {_probability(test.f_max_probability)}",
        f"  BARTLETT: PROBABILITY {_probability(test.bartlett_probability)}"
        f"   LEVENE: PROBABILITY {_probability(test.levene_probability)}",
    ]
    if test.f_max_limit is not None:
        equal = test.f_max <= test.f_max_limit
        lines.append(f"  THE CASES ARE {'' if equal else 'NOT '}OF ONE POPULATION (95 PERCENT)")
    return lines


def _probability(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def joint_page(calibration: Calibration, joint: JointFit) -> list[str]:
    """Return the joint adjustment."""
    correction = joint.correction
    lines = [
        *centred("JOINT ADJUSTMENT OF CASES, COMPARATOR, POLYNOMIALS AND GRID"),
        f"  STANDARD ERROR OF UNIT WEIGHT {joint.sigma0:.4f}   DEGREES OF FREEDOM {joint.degrees_of_freedom}",
        f"  RANDOM COMPARATOR {joint.random_um:.3f} MICRONS (ESTIMATED)",
        *(line for number_, plate in joint.plates.items() for line in _plate(number_, plate)),
        "",
        *linear_lines(
            correction.scale_x, correction.scale_y, correction.nonorthogonality_rad, joint.covariance
        ),
        f"  WEIGHTED MEAN OF THE REPORT AGAINST A JOINT ADJUSTMENT UNDER ITS ASSUMPTIONS: WITHIN"
        f" {number(calibration.joint_check, 0, 6)} SIGMA",
    ]
    polynomial = correction.polynomial
    if calibration.nonlinear and polynomial is not None:
        x, y = polynomial.coefficients
        covariance = joint.sigma0**2 * polynomial.cofactors
        lines += ["", *polynomial_lines(x, y, covariance)]
    for plate, own in joint.plates.items():
        lines += ["", f"CORRECTIONS OF GRID {plate} IN ITS OWN AXES (MICRONS)", *_grid(own)]
    return lines


def _plate(plate: int, own: JointPlate) -> list[str]:
    how = "ESTIMATED" if own.estimated else "GIVEN"
    ratio = "-" if own.variance_ratio is None else f"{own.variance_ratio:.3f}"
    lines = [f"  GRID {plate} STANDARD DEVIATION {own.sigma_um:.3f} MICRONS ({how}), VARIANCE RATIO {ratio}"]
    if own.test:
        low, high = own.test.limits
        verdict = "NOT " if own.test.rejected_high or own.test.rejected_low else ""
        lines.append(
            f"    TEST OF ITS STANDARD DEVIATION: VARIANCE RATIO FROM {low:.3f} TO {high:.3f} (95 PERCENT),"
            f" PROBABILITY {own.test.probability:.4f}: {verdict}ACCEPTED"
        )
    return lines


def _grid(own: JointPlate) -> list[str]:
    sd = np.sqrt(np.diagonal(own.covariance_um2, axis1=1, axis2=2))
    rows = zip(own.points.tolist(), own.corrections_um.tolist(), sd.tolist(), strict=True)
    head = f"  {'POINT':>5}{'DX':>10}{'DY':>10}{'SIGMA X':>12}{'SIGMA Y':>10}"
    lines = [f"  {point:5d}{dx:10.3f}{dy:10.3f}{sx:12.3f}{sy:10.3f}" for point, (dx, dy), (sx, sy) in rows]
    return [head, *lines]
