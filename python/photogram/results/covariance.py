"""Covariances between unknowns of an adjusted network, and of functions of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from numbers import Integral
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import argument_error, names, truth_value, value_field
from photogram.arguments.objects import require_name
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass
from photogram.network.block import Block, position_columns
from photogram.network.block_checks import ATTITUDE_COLUMNS
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Result

Wanted = str | int | Sequence[str] | Sequence[int] | None
"""A name, names, or None for all. Photos and points of collections are identified by number."""

Item = tuple[str, Wanted]  # Type (`photo`, `step`, `point`, `camera`, `unknown`) and names

Selection = Item | Sequence[Item]  # One or several items


@dataclass(frozen=True, eq=False)
class Selected:
    rows: list[tuple[str, int]]  # Type and index of each part in the core
    labels: list[tuple[str, str, str]]  # Type, name and component of each unknown
    values: Floats  # Adjusted values and standard deviations, concatenated
    sd: Floats
    shapes: list[tuple[int, ...]]  # Shape of each item: (k,) for one name, (n, k) for several

    def arrays(self, values: Floats) -> list[Floats]:
        parts, start = [], 0
        for shape in self.shapes:
            size = int(np.prod(shape))
            parts.append(values[start : start + size].reshape(shape))
            start += size
        return parts


@dataclass(frozen=True, eq=False)
class Things:
    ids: Sequence[str]  # Names, names of their unknowns, values and standard deviations
    components: Sequence[tuple[str, ...]]
    values: Sequence[Floats] | Floats
    sd: Sequence[Floats] | Floats
    # Types of the parts in the core; empty if the type is the same
    parts: tuple[str, ...] = ()

    @classmethod
    def of(cls, every: Sequence[Any], components: str) -> Things:
        """Return cameras or common unknowns; an attribute has the names of unknowns."""
        names, unknowns = [each.name for each in every], [getattr(each, components) for each in every]
        return cls(names, unknowns, [each.values for each in every], [each.sd for each in every])


@dataclass(frozen=True, eq=False)
class Adjusted:
    things: Mapping[str, Things]  # By type
    numbered: bool = False  # Whether they are identified by number

    def selected(self, selection: Selection) -> Selected:
        """Return the unknowns of a selection; refuse unknown types and names."""
        items = [selection] if isinstance(selection, tuple) and isinstance(selection[0], str) else selection
        rows, labels = list[tuple[str, int]](), list[tuple[str, str, str]]()
        values, deviations = [np.empty(0)], [np.empty(0)]
        shapes: list[tuple[int, ...]] = []
        for item in items:
            if not (isinstance(item, tuple) and len(item) == 2) or item[0] not in self.things:
                raise InputError(
                    phrase("adjusted.selection", value=value_field(item), kinds=list(self.things))
                )
            kind, wanted = str(item[0]), item[1]
            own, chosen = self.things[kind], self._indices(kind, wanted)
            rows += [(part, index) for index in chosen for part in own.parts or (kind,)]
            labels += [(kind, own.ids[index], name) for index in chosen for name in own.components[index]]
            values += [np.asarray(own.values[index], dtype=float) for index in chosen]
            deviations += [np.asarray(own.sd[index], dtype=float) for index in chosen]
            counts = [len(own.components[index]) for index in chosen]
            alike = len(set(counts)) == 1 and not self._is_one(wanted)
            shapes.append((len(chosen), counts[0]) if alike else (sum(counts),))
        return Selected(rows, labels, np.concatenate(values), np.concatenate(deviations), shapes)

    @cached_property
    def _places(self) -> dict[str, dict[str, int]]:
        return {kind: {name: i for i, name in enumerate(own.ids)} for kind, own in self.things.items()}

    def _is_one(self, wanted: Wanted) -> bool:
        return isinstance(wanted, str) or (
            self.numbered and isinstance(wanted, Integral) and not isinstance(wanted, bool)
        )

    def _indices(self, kind: str, wanted: Wanted) -> list[int]:
        if wanted is None:
            used = ~np.isnan([each[0] if len(each) else 0.0 for each in self.things[kind].values])
            return np.flatnonzero(used).tolist()
        index = self._places[kind]
        several: Any = [wanted] if self._is_one(wanted) else wanted
        asked = names(f"names of the kind {kind}", several)
        if missing := [name for name in asked if name not in index]:
            what = kind.replace("step", "photo")
            raise InputError(phrase("error.absent", kind=what, name=missing[0]))
        return [index[name] for name in asked]


def used_rows(result: Result, names: Sequence[str]) -> Indices:
    """Return the rows of points; refuse unknown points, and points that were not used."""
    places = {name: row for row, name in enumerate(result.block.point_ids)}
    for name in names:
        require_name("point", name, places)
        if not result.used_points[places[name]]:
            raise InputError(phrase("adjusted.unused-point", point=name))
    return np.array([places[name] for name in names], dtype=np.int64)


def photo_components(block: Block) -> tuple[str, ...]:
    return tuple(name.removesuffix("_deg") for name in (*position_columns(block), *ATTITUDE_COLUMNS))


def adjusted(result: Result) -> Adjusted:
    block = result.block
    photos, sd = np.hstack([result.photo_positions, result.photo_attitudes]), result.photo_sd
    unknowns_of_photo, count = photo_components(block), len(photos)
    places = unknowns_of_photo[:3]
    steps = (*places, "rho x", "rho y", "rho z")
    points = [places] * len(block.point_ids)
    return Adjusted(
        things={
            "photo": Things(block.photo_ids, [unknowns_of_photo] * count, photos, sd),
            "step": Things(block.photo_ids, [steps] * count, photos, sd),
            "point": Things(block.point_ids, points, result.point_positions, result.point_sd),
            # Cameras of blocks with principal distances are known, one for each photo.
            "camera": Things.of(result.cameras, "names"),
            "unknown": Things.of(result.unknowns, "components"),
        },
    )


T = TypeVar("T")
Failure = _photocore.BlockError | _photocore.CollectionError

STEP = 0.01  # Step of differences, in standard deviations
TOGETHER = 32  # Size of groups with a joint covariance
COMPLEX_STEP = 1e-30
SPREAD = 0.1  # Step of second differences, in standard deviations along the axes of the ellipsoid


@dataclass(frozen=True, eq=False)
class Propagated:
    """A function of adjusted unknowns with its covariance.

    Attributes
    ----------
    value
        f(x): a number, or an array.
    standard_deviation
        Standard deviations in the shape of the value.
    covariance
        (m, m) covariance matrix of all m values in their order: J Q J^T times the variance of unit weight.
    partials
        (m, k) J.
    bias
        1/2 trace(f'' Q), the difference between the mean of f(x) and f of the mean, in the shape of the
        value; None unless requested.
    """

    value: Any
    standard_deviation: Any
    covariance: Floats
    partials: Floats
    bias: Any = None


class Covariances:
    """The covariances of an adjusted network in its datum, with a factor.

    A selection is a type with a name, `("point", "P12")`, several names, `("photo", ["1", "2"])`, or None for
    all that were adjusted, `("camera", None)`; or a list of selections. Types are `photo` (position, omega,
    phi, kappa), `point`, `camera`, `unknown` (common unknowns of observations) and `step`. A `step` is the
    position of a photo and its rotation about its own axes, which is never singular. In collections, photos
    and points are identified by number. Types are `photo` (all parameters), `pose` and `camera` (the first
    six and the other parameters), and `point`. Rows and columns have this order.

    Units are the units of the result: the linear unit, radians, the units of cameras.
    """

    def __init__(
        self,
        adjusted: Adjusted,
        factored: Callable[[], _photocore.BlockCovariances],
        refused: Callable[[Failure], Exception],
        scale: float,
    ) -> None:
        self._adjusted, self._refused, self._scale = adjusted, refused, scale
        self._core = self._asked(factored)

    def labels(self, selection: Selection) -> list[tuple[str, str, str]]:
        """Return type, name and component of each row of a selection.

        Raises
        ------
        InputError
            If a type or name does not exist.
        """
        return self._adjusted.selected(selection).labels

    def covariance(self, a: Selection, b: Selection | None = None) -> Floats:
        """Return the covariance matrix of a selection, or between two selections.

        The computation requires half a solution for each unknown, or a full solution for each unknown of the
        smaller selection if it is much smaller. Memory is estimated first: (unknowns of a) x (unknowns of b)
        numbers, and the fronts of the factor.

        Parameters
        ----------
        a, b
            Selections; without b all pairs of unknowns of a.

        Raises
        ------
        InputError
            If a type or name does not exist, or a point was excluded.
        OutOfMemoryError
            If the memory is not sufficient.
        KeyboardInterrupt
            If the user presses Ctrl-C.
        """
        rows = self._adjusted.selected(a).rows
        columns = None if b is None else self._adjusted.selected(b).rows
        found = self._asked(lambda: self._core.cofactors(rows, columns, threads=0, progress=None))
        found *= self._scale
        return found

    def combined(self, partials: Floats, selection: Selection) -> Floats:
        """Return the (m, m) covariance matrix J Q J' of linear combinations, scaled.

        The number of solutions is the number of combinations, for any number of unknowns.

        Parameters
        ----------
        partials
            (m, k) J: a column for each unknown of the selection.
        selection
            The unknowns that are combined; also rotation steps.

        Raises
        ------
        InputError, OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariance`.
        """
        rows = self._adjusted.selected(selection).rows
        found = self._asked(lambda: self._core.propagate(partials, rows, threads=0, progress=None))
        return np.asarray(found * self._scale)

    def correlation(self, a: Selection, b: Selection | None = None) -> Floats:
        """Return correlation coefficients instead of covariances; NaN for fixed unknowns.

        A camera with all photos, `correlation(("camera", "wide"), ("step", None))`, requires one solution for
        each parameter of the camera.

        Raises
        ------
        InputError, OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariance`.
        """
        covariance = self.covariance(a, b)
        if b is None:
            left = right = np.sqrt(np.diag(covariance))
        else:
            left, right = (self._deviations(each) for each in (a, b))
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(covariance / np.outer(left, right))

    def _deviations(self, selection: Selection) -> Floats:
        """Return standard deviations; of rotation steps from the core."""
        selected = self._adjusted.selected(selection)
        if all(kind != "step" for kind, _ in selected.rows):
            return selected.sd
        parts = [selected.rows[k : k + TOGETHER] for k in range(0, len(selected.rows), TOGETHER)]
        ask = partial(self._core.cofactors, columns=None, threads=0, progress=None)
        found = (self._asked(partial(ask, rows)) for rows in parts)
        return np.sqrt(self._scale * np.concatenate([*map(np.diag, found)]))

    def propagate(
        self, function: Callable[..., Any], unknowns: Selection, *, bias: bool = False
    ) -> Propagated:
        """Return a function of adjusted unknowns with its covariance.

        Partial derivatives are central differences with a hundredth of each standard deviation. If the
        function accepts complex arrays and gives the same derivatives, exact complex steps are used.

        Parameters
        ----------
        function
            Its arguments are an array for each item of the selection: (k,) for one name, (n, k) for several.
            It returns a number or an array.
        unknowns
            The selection of its unknowns.
        bias
            Whether to compute the bias from second differences along the axes of the joint ellipsoid.

        Raises
        ------
        InputError
            If the selection does not exist, or the function returns values that are not finite.
        OutOfMemoryError, KeyboardInterrupt
            As in :meth:`covariance`.
        """
        truth_value("bias", bias)
        selected = self._adjusted.selected(unknowns)
        if any(kind == "step" for kind, _ in selected.rows):
            raise InputError(phrase("covariance.step"))
        value = _evaluated(function, selected, selected.values)
        partials = _partials(function, selected, value)
        covariance = self.combined(partials, unknowns)
        sd = np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(np.shape(value))
        found = _bias(function, selected, value, self.covariance(unknowns)) if bias else None
        if np.ndim(value) == 0:
            scalar = None if found is None else float(found)
            return Propagated(float(value), float(sd), covariance, partials, scalar)
        return Propagated(value, sd, covariance, partials, found)

    def suspects(self) -> _photocore.NetworkSuspects:
        """Return the groups of observations; :meth:`influences` uses their rows."""
        return self._core.suspects()

    def influences(
        self, selection: Selection, function: Callable[..., Any] | None
    ) -> tuple[list[tuple[str, str, str]], Floats]:
        """Return the effects of errors of one standard deviation in each observation.

        Parameters
        ----------
        selection, function
            Unknowns, and a function of them; None for the unknowns themselves.

        Returns
        -------
        The labels of the unknowns, and (k, M) effects of all rows on each of the k values.
        """
        selected = self._adjusted.selected(selection)
        if function is None:
            partials = np.eye(len(selected.values))
        else:
            partials = _partials(function, selected, _evaluated(function, selected, selected.values))
        return selected.labels, self._asked(lambda: self._core.influences(partials, selected.rows))

    def _asked(self, ask: Callable[[], T]) -> T:
        try:
            return ask()
        except (_photocore.BlockError, _photocore.CollectionError) as error:
            raise self._refused(error) from None


def _evaluated(function: Callable[..., Any], selected: Selected, values: Floats) -> Floats:
    """Evaluate a function; refuse values that are not finite."""
    found = np.asarray(function(*selected.arrays(values)))
    if found.dtype.kind not in "fiub" or not np.isfinite(found).all():
        raise argument_error("function", "finite", value=value_field(found))
    return found.astype(float)


def _partials(function: Callable[..., Any], selected: Selected, value: Floats) -> Floats:
    """Return J, (values, unknowns): by complex steps if they are possible and equal to differences."""
    differences = np.zeros((value.size, len(selected.values)))
    partials = np.zeros_like(differences)
    for k, sd in enumerate(selected.sd.tolist()):
        if not sd > 0:  # fixed: zero variance for any derivative
            continue
        ends = []
        for sign in (1.0, -1.0):
            moved = selected.values.copy()
            moved[k] += sign * STEP * sd
            ends.append((moved[k], _evaluated(function, selected, moved).ravel()))
        (to, after), (fro, before) = ends
        differences[:, k] = (after - before) / (to - fro)
    try:
        for k in np.flatnonzero(selected.sd > 0).tolist():
            moved = selected.values.astype(complex)
            moved[k] += 1j * COMPLEX_STEP
            found = np.asarray(function(*selected.arrays(moved)))
            if found.dtype.kind != "c" or found.size != len(partials):
                return differences
            partials[:, k] = found.ravel().imag / COMPLEX_STEP
    except (TypeError, ValueError, ArithmeticError):
        return differences
    # Absolute values in the function have no complex derivative.
    scale = np.abs(differences * selected.sd).max(axis=1, initial=0.0, keepdims=True)
    agrees = np.abs((partials - differences) * selected.sd) <= 1e-3 * scale
    return partials if agrees.all() else differences


def _bias(function: Callable[..., Any], selected: Selected, value: Floats, covariance: Floats) -> Floats:
    """Return 1/2 trace(f'' Q), by second differences along the axes of the ellipsoid."""
    scale = np.where(selected.sd > 0, selected.sd, 1.0)
    variances, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    total = np.zeros(value.size)
    for variance, axis in zip(variances.tolist(), axes.T, strict=True):
        if variance <= 0:
            continue
        step = SPREAD * np.sqrt(variance) * axis * scale
        ends = [_evaluated(function, selected, selected.values + sign * step).ravel() for sign in (1, -1)]
        total += (ends[0] - 2 * value.ravel() + ends[1]) / SPREAD**2
    return np.asarray(0.5 * total.reshape(np.shape(value)))
