"""Tests of camera unknowns: used terms, other terms, model comparisons.

* Estimated terms, k with the cofactors Q_kk (a priori unit weight): T = x' Q_kk^-1 x is the increase of the
  weighted sum of squares without them (Wald; exact for linear models).
* Fixed terms: B are the partials of the images by them, in standard deviations, and ~v the residuals. With c
  = B' ~v and C = B' R B, T = c' C^-1 c is the decrease with them (Rao's score; no adjustment).
* T is chi-square with k if the unit weight is known. Otherwise (T / k) / (Omega' / f') is F(k, f'); Omega'
  and f' belong to the model with the terms.
* Models that are not nested: BIC = Omega + k ln n or, for an unknown unit weight, n ln(Omega / n) + k ln n. n
  = f + k, because points use as many observations as they have coordinates (Schwarz 1978).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import argument_error, value_field
from photogram.arguments.objects import require_name
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.network.motion import focal_images
from photogram.results.distortion import INTERIOR, compared_places, partials_of, rows_of_images
from photogram.results.fixed_tests import score
from photogram.results.network import AdjustedNetwork
from photogram.results.parts import AdjustedCamera
from photogram.show.methods import Tabular
from photogram.show.page import Document, Section, about
from photogram.show.quantity import Quantity, Table, of_each
from photogram.statistics.agreement import quadratic
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

LEVEL = 0.05  # Significance level of terms
KEPT = 0.01  # Significance level of useful terms
EFFECT = 0.2  # Smallest effect of useful terms on an image, in standard deviations
DECISIVE, POSITIVE = 10.0, 2.0  # Differences of BIC with decisive and positive evidence
CHECKS = 10  # Smallest number of check points for their root mean square
SEEN = 2000  # Number of images for the effect of terms


@dataclass(frozen=True)
class TermsTest:
    camera: str  # camera and its parameters
    names: tuple[str, ...]
    statistic: float  # T: increase of the weighted sum of squares without them, or decrease with them
    freedom: float  # Degrees of freedom of the unit variance with the terms; infinite if it is known
    scale: float  # Variance of unit weight of the test: 1 if it is known
    # Their largest effect on an image, in its standard deviations; NaN for fixed terms
    effect: float = math.nan

    @property
    def dimension(self) -> int:
        return len(self.names)

    @property
    def test_value(self) -> float:
        """T over its dimension and the variance of unit weight."""
        return self.statistic / self.scale / self.dimension

    @property
    def probability(self) -> float:
        """The probability of a larger value under the null hypothesis."""
        return tail_probability(self.statistic / self.scale, self.dimension, self.freedom)

    @property
    def significant(self) -> bool:
        """Whether the terms differ from zero at the 5 percent level."""
        return self.probability < LEVEL

    @property
    def outcome(self) -> str:
        return about(f"outcome.{'' if self.significant else 'not-'}significant")

    @property
    def worth_keeping(self) -> bool:
        """Whether they are significant at 1 percent and affect an image by 0.2 sd."""
        return self.probability < KEPT and not self.effect <= EFFECT


@dataclass(frozen=True)
class Model:
    """One of several models of the same observations."""

    name: str  # Name of the caller for it
    squares: float  # Weighted sum of squares
    freedom: int
    parameters: int  # Estimated parameters of cameras
    bic: float  # The criterion; the least is the best
    checks: float  # Root mean square of ten or more check points, linear unit; NaN otherwise


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Tabular):
    """A comparison of models of the same observations."""

    models: tuple[Model, ...]  # The best first
    known: bool  # Whether the unit weight is known
    # Tests of every model against the next larger one that has all its parameters and more: names of both, T,
    # its dimension, and the probability if the smaller one is right
    nested: tuple[tuple[str, str, float, int, float], ...]

    @property
    def best(self) -> Model:
        """The model with the minimum criterion."""
        return self.models[0]

    def statement(self) -> str:
        """Return a statement on the criterion."""
        best, *rivals = self.models
        if not rivals:
            return about("models.only", best=best.name)
        apart = rivals[0].bic - best.bic
        size = "decisive" if apart > DECISIVE else "positive" if apart > POSITIVE else "none"
        return about(f"models.{size}", best=best.name, rival=rivals[0].name, difference=apart)

    def document(self) -> Document:
        """Return the document: models, the best first, and tests against larger models."""
        columns = [
            of_each(self.models, "name", kind="name", name="model", head="Model"),
            of_each(
                self.models, "squares", name="sum_of_squares", head="Weighted sum of squares", decimals=3
            ),
            of_each(self.models, "freedom", name="degrees_of_freedom", head="Degrees of freedom", decimals=0),
            of_each(self.models, "parameters", name="parameters", head="Parameters", decimals=0),
            of_each(self.models, "bic", name="bic", head="BIC", decimals=2),
            of_each(self.models, "checks", name="rms_check", head="rms of checks", figures=5),
        ]
        models = Table("models", "Models", columns, self.statement())
        small, large, statistic, dimension, p = zip(*self.nested, strict=True) if self.nested else ((),) * 5
        tests = [
            Quantity(small, kind="name", head="Model"),
            Quantity(large, kind="name", head="Within"),
            Quantity(statistic, head="T", decimals=3),
            Quantity(dimension, head="Dimension", decimals=0),
            Quantity(p, head="p", figures=2),
        ]
        nested = Table("nested", "Nested models", tests)
        return Document("Models of the same observations", "", sections=[*map(Section.of, (models, nested))])


def terms_test(result: Result, names: Sequence[str], *, camera: str | None = None) -> TermsTest:
    """Test estimated terms of a camera jointly, without another adjustment (Wald).

    Parameters
    ----------
    result
        The adjusted block, with covariances.
    names
        Free or weighted distortion parameters, tested against 0.
    camera
        The name of the camera; optional if there is only one.

    Raises
    ------
    InputError
        If the camera does not exist, the terms are not estimated, or covariances are missing.
    """
    found, rows = _camera(result, camera, names)
    if not set(rows) <= set(found.estimated):
        raise InputError(phrase("models.fixed", names=list(names), camera=found.name))
    if not np.isfinite(found.cofactors[np.ix_(rows, rows)]).all():
        raise InputError(phrase("models.no-covariances"))
    effect, own = math.nan, rows_of_images(result, found)  # The largest effect on an image, in its sd
    if own.size:
        own = own[np.unique(np.linspace(0, own.size - 1, SEEN).round().astype(np.int64))]
        without = {**found.camera.parameters, **dict.fromkeys((found.names[row] for row in rows), 0.0)}
        measured = focal_images(result.block)[own]
        other = found.camera.replace(parameters=without, sd=0.0, covariance=None)
        moved = np.abs(other.project(found.camera.rays(measured)) - measured) / result.block.image_sd[own]
        effect = float(np.nanmax(moved)) if np.isfinite(moved).any() else math.nan
    return replace(joint_test(result, found, names), effect=effect)


def joint_test(result: Result, camera: AdjustedCamera, names: Sequence[str]) -> TermsTest:
    """Return the joint test of estimated terms (Wald), without their effect."""
    rows = [camera.names.index(name) for name in names]
    statistic, _ = quadratic(camera.values[rows], camera.cofactors[np.ix_(rows, rows)])
    freedom = result.freedom_of_scale
    scale = result.covariance_scale if math.isfinite(freedom) else 1.0
    return TermsTest(camera.name, tuple(names), statistic, freedom, scale)


def score_test(
    result: Result, names: Sequence[str] = (), *, camera: str | None = None, partials: ArrayLike | None = None
) -> TermsTest:
    """Test fixed terms, or effects outside the model, without an adjustment (Rao).

    Parameters
    ----------
    result
        The adjusted block.
    names
        Fixed parameters of a camera, or names of the `partials`.
    camera
        The name of the camera; optional if there is only one.
    partials
        (k, m, 2) partials of the image coordinates by k user-defined effects, in the unit of the image
        coordinates; for cameras with terms that correct measurements, of corrected coordinates. The default
        is the partials by the fixed parameters.

    Raises
    ------
    InputError
        If the camera does not exist, the terms are estimated, the partials have another shape, or the
        unknowns of the block absorb the effects completely.
    """
    _require_block(result)
    block = result.block
    m = len(block.image_xy)
    if partials is None:
        found, rows = _camera(result, camera, names)
        if set(rows) & set(found.estimated):
            raise InputError(phrase("models.estimated", names=list(names), camera=found.name))
        # Forward cameras compare measured with computed images, backward ones corrected with ideal images.
        own, title = rows_of_images(result, found), found.name
        plain = found.camera.replace(sd=0.0, covariance=None)
        measured, residuals = focal_images(block)[own], result.residuals[own]
        backward, reach = plain.direction == "backward", float(np.abs(measured).max(initial=1.0))
        compared = compared_places(plain, measured if backward else measured - residuals)
        columns = np.zeros((len(rows), m, 2))
        columns[:, own] = (-1.0 if backward else 1.0) * partials_of(compared, plain, names, reach)
        if backward and "c" in names:
            columns[list(names).index("c"), own] += (compared(plain) - residuals) / plain.parameters["c"]
        columns = np.nan_to_num(columns)
    else:
        columns = np.asarray(partials, dtype=np.float64)
        if columns.ndim != 3 or columns.shape[1:] != (m, 2) or not np.isfinite(columns).all():
            raise InputError(phrase("models.partials", images=m, actual=str(columns.shape)))
        title = camera or ""
        names = tuple(names) or tuple(f"effect {k + 1}" for k in range(len(columns)))
    used = result.used_images[:, np.newaxis]
    b, v = (np.where(used, each / block.image_sd, 0.0) for each in (columns, result.residuals))
    statistic = score(result._factor(), b, v)
    if statistic is None:
        raise InputError(phrase("models.inseparable", names=list(names)))
    freedom = result.freedom_of_scale - len(b)
    omega = result.covariance_scale * result.freedom_of_scale - statistic
    scale = max(omega, 1e-12 * statistic) / freedom if 0 < freedom < math.inf else 1.0
    return TermsTest(title, tuple(names), statistic, freedom, scale)


def compare(results: Mapping[str, Result], *, known: bool | None = None) -> Comparison:
    """Compare nested or other models of the same observations.

    Parameters
    ----------
    results
        Adjusted blocks by the names of their models. They must use the same images with the same standard
        deviations: remove gross errors that one of them rejects from all of them.
    known
        Whether the unit weight is known; by default, unless its estimate scales covariances.

    Raises
    ------
    InputError
        If there are fewer than two results, or they have different observations or no degrees of freedom.
    """
    if not isinstance(results, Mapping) or len(results) < 2:
        raise InputError(phrase("models.few", value=value_field(results)))
    for result in results.values():
        _require_block(result)
    names, all_results = list(results), list(results.values())
    first = all_results[0]
    for name, other in zip(names[1:], all_results[1:], strict=True):
        for what in ("image_xy", "image_sd"):
            if not np.array_equal(getattr(first.block, what), getattr(other.block, what)):
                raise InputError(phrase("models.observations", one=names[0], other=name, what=what))
        if count := int((first.used_images != other.used_images).sum()):
            raise InputError(phrase("models.images", n=count, one=names[0], other=name))
    taken = all(math.isinf(each.freedom_of_scale) for each in all_results) if known is None else known
    models = [_model(name, result, taken) for name, result in results.items()]
    nested = []
    for small in names:
        larger = [each for each in names if _is_within(results[small], results[each])]
        if larger:
            large = min(larger, key=lambda each: _count(results[each]))
            omega = [results[each].sums_of_squares.total for each in (small, large)]
            freedom = [_all_freedom(results[each]) for each in (small, large)]
            k, statistic = freedom[0] - freedom[1], omega[0] - omega[1]
            scale = 1.0 if taken else omega[1] / freedom[1]
            p = tail_probability(max(statistic, 0.0) / scale, k, math.inf if taken else freedom[1])
            nested.append((small, large, statistic, k, p))
    return Comparison(tuple(sorted(models, key=lambda each: each.bic)), taken, tuple(nested))


def groups_of_terms(camera: AdjustedCamera) -> list[tuple[str, ...]]:
    """Return distortion terms that are used together: single powers of the radius, letters."""
    radial, others = [], dict[str, list[str]]()
    for k in camera.estimated:
        name = camera.names[k]
        if name in INTERIOR:
            continue
        if re.fullmatch(r"[Kk]_?\d", name):
            radial.append(name)
        else:
            others.setdefault(re.sub(r"[\d_]+$", "", name), []).append(name)
    return [(name,) for name in reversed(radial)] + [tuple(names) for names in others.values()]


def _camera(result: Result, name: str | None, terms: Sequence[str]) -> tuple[AdjustedCamera, list[int]]:
    _require_block(result)
    cameras = {each.name: each for each in result.cameras}
    if name is None and len(cameras) != 1:
        raise InputError(phrase("models.which-camera", names=list(cameras)))
    name = next(iter(cameras)) if name is None else name
    require_name("camera", name, cameras)
    if isinstance(terms, str) or not terms:
        raise argument_error("names", "kind", kind="a list of names", value=value_field(terms))
    for term in terms:
        require_name("parameter", str(term), cameras[name].names)
    return cameras[name], [cameras[name].names.index(term) for term in terms]


def _require_block(result: object) -> None:
    if not (isinstance(result, AdjustedNetwork) and hasattr(result, "block")):
        raise InputError(phrase("models.not-a-block", value=value_field(result)))


def tail_probability(value: float, k: int, freedom: float) -> float:
    if math.isinf(freedom):
        return _photocore.chi_square(value, k)
    return _photocore.fisher(value / k, k, freedom) if freedom > 0 else math.nan


def _count(result: Result) -> int:
    return sum(len(each.estimated) for each in result.cameras)


def _model(name: str, result: Result, known: bool) -> Model:
    k, squares = _count(result), result.sums_of_squares.total
    counted = _all_freedom(result)
    if counted < 1:
        raise InputError(phrase("models.no-freedom", model=name))
    n = counted + k
    bic = (squares if known else n * math.log(squares / n)) + k * math.log(n)
    differences = result.point_differences[(result.point_kinds == "check") & result.used_points]
    finite = differences[np.isfinite(differences).all(axis=1)]
    rms = float(np.sqrt((finite**2).mean())) if len(finite) >= CHECKS else math.nan
    return Model(name, squares, counted, k, bic, math.nan if result.block.geographic else rms)


def _all_freedom(result: Result) -> int:
    """Return observations minus unknowns, for any basis of the unit variance."""
    sums = result.redundancies
    return round(result.degrees_of_freedom if sums is None else sums.total)


def _is_within(small: Result, large: Result) -> bool:
    """Whether a model is another with some parameters fixed at initial values."""
    if len(small.cameras) != len(large.cameras) or _count(small) >= _count(large):
        return False
    return all(
        a.given.model == b.given.model and set(a.estimated) <= set(b.estimated)
        for a, b in zip(small.cameras, large.cameras, strict=True)
    )
