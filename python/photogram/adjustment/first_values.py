"""Initial values: poses of photos with unknown position or attitude, from all other data.

The core performs the search (`photogram_programs::first_values`). `docs/first-values.md` describes its
steps.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from photogram import _photocore
from photogram.adjustment.adjustment import adjust
from photogram.adjustment.first_features import Known, with_poses
from photogram.arguments.arrays import by_key, truth_value
from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError
from photogram.lazy_dataclasses import dataclass, replace
from photogram.messages import Message, listed
from photogram.network.attitudes import Attitudes, angles_form
from photogram.network.block import Block, flown_by, require_block
from photogram.network.film_reduction import as_seen, is_scanned
from photogram.network.geometry import Cartesian
from photogram.network.motion import at_rest, kept_images, of_photos, timed_photos, with_rejected_points
from photogram.network.observations import Distance
from photogram.network.point_sets import similarity
from photogram.network.rays import direction_deviations, image_directions
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

_Array = TypeVar("_Array", bound=NDArray[np.generic])

NEEDED = 4  # Minimum number of known points for resection
DOUBTFUL = 0.3  # Part of inconsistent control images that makes control, or the initial poses, doubtful
ESTIMATES = 3  # Maximum number of camera estimations followed by a new search
IN_COMMON = 3  # Minimum number of objects shared by a model and known data
SOURCES = ("given", "resected", "observed", "oriented")


@dataclass(frozen=True, eq=False, repr=False)
class FirstValues(Brief):
    """Initial values of a block with P photos, n points and m image observations.

    Attributes
    ----------
    block
        Block with initial values of all oriented photos; NaN for other photos. Given values and observed
        values do not change.
    sources
        Source of the pose of each oriented photo: `given`, `resected`, `observed` or `oriented`.
    missing
        Photos that could not be oriented, with reasons.
    contradicted
        Photos in `missing` whose observations are inconsistent with any pose: they show something else, or
        names are wrong.
    point_positions
        (n, 3) intersections of the rays of points, as in the block; NaN if undefined.
    set_aside
        (m,) image observations that are inconsistent with the poses: a wrong point, or a poor ray.
    contradicted_control
        Control points whose image observations agree with each other but not with the coordinates. They are
        adjusted with all their images.
    misfit
        Median of the angles between observed and computed directions, radians; NaN without observations.
    first_photo
        Photo at the origin, with a base of length 1 (or scale from observed distances), if control, poses and
        observed positions do not define a datum; otherwise None.
    messages
        Summary in sentences.
    """

    block: Block
    sources: dict[str, str]
    missing: dict[str, str]
    contradicted: tuple[str, ...]
    point_positions: Floats
    set_aside: Bools
    contradicted_control: tuple[str, ...]
    misfit: float
    first_photo: str | None
    messages: list[Message]

    def usable(self) -> Block:
        """Return the block of oriented photos without inconsistent images, ready to adjust.

        Raises
        ------
        InputError
            If there are observations of photos that could not be oriented.
        """
        started = np.array([photo in self.sources for photo in self.block.photo_ids])
        usable = of_photos(kept_images(self.block, ~self.set_aside), started)
        return with_rejected_points(usable, self.block)


def first_values(block: Block, *, keep_all: bool = False) -> FirstValues:
    """Compute initial positions and attitudes of photos.

    Photos whose position or attitude is NaN are oriented from known data. Rays are intersected if poses are
    given, and photos with four known points are resected. Observed positions and attitudes
    (:class:`photogram.Position`, :class:`photogram.network.Attitude`) give poses. Other photos are oriented
    relative to each other, joined, and transformed to control, given poses or observed positions by a
    similarity. Every step is a consensus search that tolerates wrong points, followed by a robust adjustment.
    Refraction and unknown camera parameters are ignored. Photos on trajectories retain their given poses and
    are not used, because their images do not share one pose.

    Parameters
    ----------
    block
        Photos to orient have NaN in positions or attitudes. A position without an attitude, or an observed
        one with a standard deviation, is an observed position. The same applies to attitudes.
    keep_all
        Whether to retain inconsistent images. If True, they are only counted.

    Returns
    -------
    The block with initial values, and the source of each pose. Photos that could not be oriented are listed
    with reasons.

    Raises
    ------
    InputError
        If the argument is not a block.
    AdjustmentError
        If no photo can be oriented, or none in the datum of trajectories; the message contains the reason.

    Examples
    --------
    >>> import numpy as np
    >>> from photogram import adjust, first_values, simulate
    >>> block = simulate(strips=2, photos_per_strip=4).block
    >>> unknown = block.replace(photo_positions=np.nan, photo_attitudes=np.nan,
    ...                         photo_position_sd=np.inf, photo_attitude_sd=np.inf)
    >>> started = first_values(unknown)
    >>> len(started.sources), started.missing
    (8, {})
    >>> adjust(started.block).status
    'converged'
    """
    require_block(block)
    if is_scanned(block):
        found = first_values(as_seen(block), keep_all=keep_all)
        own = ("image_xy", "image_sd", "passages", "observations")
        return replace(found, block=found.block.replace(**{name: getattr(block, name) for name in own}))
    if flown_by(block):
        return _beside_trajectories(block, keep_all=keep_all)
    axes = Cartesian(block.spheroid)
    known = Known.of(block, axes)
    directions, search = _searched(block, known, axes)
    nominal = None if search.oriented.any() else _on_nominal(block, known, directions, axes)
    search, orienting = (search, []) if nominal is None else nominal
    reasons = dict(zip(block.photo_ids, search.reasons, strict=True))
    missing = {photo: str(_reason(*why)) for photo, why in reasons.items() if why[0] not in SOURCES}
    sources = {photo: why[0] for photo, why in reasons.items() if why[0] in SOURCES}
    kept = truth_value("keep_all", keep_all)
    control = tuple(np.array(block.point_ids, dtype=object)[search.against])
    wrong = search.aside | search.against[block.image_points]
    mirrored = _mirrored(block, known, directions, len(sources), wrong)
    # A single image of a control point cannot be compared with others; the adjustment tests it.
    posed = search.oriented[block.image_photos]
    images = np.bincount(block.image_points[posed], minlength=len(block.point_ids))
    aside = search.aside & ~((images == 1) & np.isfinite(block.point_sd).any(axis=1))[block.image_points]
    if not sources:
        hints = "".join(f"\n  hint: {hint}" for hint in mirrored)
        raise AdjustmentError(phrase("first.none", reasons=_reasons(missing), hints=hints))
    if search.first is not None:
        scale = _scale(block, search.points)
        search = search._replace(positions=search.positions * scale, points=search.points * scale)
    first = None if search.first is None else block.photo_ids[search.first]
    return FirstValues(
        block=_started(block, axes, search),
        sources=sources,
        missing=missing,
        contradicted=tuple(photo for photo in missing if reasons[photo][0] == "misfit"),
        point_positions=axes.from_cartesian(search.points),
        set_aside=np.zeros_like(aside) if kept else aside,
        contradicted_control=control,
        misfit=np.nan if search.misfit is None else search.misfit,
        first_photo=first,
        messages=[
            *mirrored,
            *orienting,
            *_of_control(block, control, aside),
            *_messages(block, sources, missing, aside, first, kept=kept),
        ],
    )


def _beside_trajectories(block: Block, *, keep_all: bool) -> FirstValues:
    """Compute initial values of photos at rest; photos on trajectories do not change."""
    timed = timed_photos(block)
    poses = np.hstack([block.photo_positions, block.photo_attitudes])
    stay = timed | np.isfinite(poses).all(axis=1)
    names = np.array(block.photo_ids, dtype=object)
    sources = dict.fromkeys(names[stay].tolist(), "given")
    moving = Message(phrase("first.moving", n=int(timed.sum())))
    found = FirstValues(
        block=block,
        sources=sources,
        missing={},
        contradicted=(),
        point_positions=np.full(block.point_positions.shape, np.nan),
        set_aside=np.zeros(len(block.image_xy), dtype=bool),
        contradicted_control=(),
        misfit=np.nan,
        first_photo=None,
        messages=[moving],
    )
    if stay.all():
        return found
    own = first_values(at_rest(block), keep_all=keep_all)
    if own.first_photo is not None:
        raise AdjustmentError(phrase("first.no-datum-of-photos", photos=names[~stay].tolist()))
    changes: dict[str, Floats] = {}
    for name in ("photo_positions", "photo_attitudes"):
        changes[name] = _with(getattr(block, name), ~timed, getattr(own.block, name))
        observed = getattr(own.block, f"{name}_observed")
        if observed is not None:
            given = getattr(block, f"{name}_observed")
            given = getattr(block, name) if given is None else given
            changes[f"{name}_observed"] = _with(given, ~timed, observed)
    return replace(
        own,
        block=block.replace(**changes),
        sources={name: sources.get(name) or own.sources[name] for name in names if name not in own.missing},
        set_aside=_with(found.set_aside, ~timed[block.image_photos], own.set_aside),
        messages=[*own.messages, moving],
    )


def _with(values: _Array, rows: Bools, others: _Array) -> _Array:
    found = values.copy()
    found[rows] = others
    return found


class _Search(NamedTuple):
    """Result of a search of the core for P photos, n points and m images; NaN if not found."""

    positions: Floats  # (P, 3)
    attitudes: Floats  # (P, 3, 3)
    # (P,) one of `SOURCES`, or the reason why a photo is not oriented with two counts; see the core
    reasons: list[tuple[str, int, int]]
    points: Floats  # (n, 3)
    aside: Bools  # (m,) images that are inconsistent with the poses
    against: Bools  # (n,) control points whose images agree with each other but not with the coordinates
    first: int | None  # Photo that defines the datum if nothing else does
    misfit: float | None  # Median angle between observed and computed directions, radians

    @property
    def oriented(self) -> Bools:
        """(P,) photos with a pose."""
        return np.array([reason in SOURCES for reason, *_ in self.reasons], dtype=bool)


def _searched(block: Block, known: Known, axes: Cartesian) -> tuple[Floats, _Search]:
    """Search with the given cameras, then with cameras estimated from the photos.

    Images and photos that fit estimated cameras only are accepted. If photos or control still do not fit,
    cameras are estimated without control.
    """
    given = image_directions(block)
    best = _improved(block, known, axes, given)
    search, control = best[1], np.isfinite(block.point_sd).any(axis=1)
    whole = search.oriented.all() and search.against.sum() <= DOUBTFUL * control.sum()
    if whole or not control.any() or all(each.is_held for each in block.cameras):
        return best
    alone = block.replace(point_sd=np.inf)
    directions, _ = _improved(alone, Known.of(alone, axes), axes, given)
    return max(best, _improved(block, known, axes, directions), key=lambda each: _fitting(each[1]))


def _improved(block: Block, known: Known, axes: Cartesian, directions: Floats) -> tuple[Floats, _Search]:
    """Repeat the search with estimated cameras while more fits; return the best directions too."""
    best = directions, _found(block, known, directions)
    for _ in range(ESTIMATES):
        before, search = best
        calibrated = _calibrated(block, axes, search)
        if calibrated is None:
            break
        directions = image_directions(calibrated)
        again = _found(block, known, directions)
        if _fitting(again) <= _fitting(search):
            break
        best = directions, again
        turned = np.linalg.norm(directions - before, axis=1)
        if np.nanmedian(turned) < direction_deviations(block).mean():
            break
    return best


def _fitting(search: _Search) -> tuple[int, int, int]:
    """Return counts of oriented photos, and minus counts of inconsistent images and control."""
    return int(search.oriented.sum()), -int(search.aside.sum()), -int(search.against.sum())


def _calibrated(block: Block, axes: Cartesian, search: _Search) -> Block | None:
    """Return the block with cameras adjusted with the poses of a search.

    None if all images fit, all cameras are fixed, or the adjustment fails.
    """
    posed, aside = search.oriented, search.aside
    free = not all(each.is_held for each in block.cameras)
    if not free or not posed.any() or (posed.all() and not aside.any() and not search.against.any()):
        return None
    start = _started(block, axes, search)
    # Without inconsistent control and images, the datum or the cameras may be undetermined.
    fewer = start.replace(point_sd=np.where(search.against[:, np.newaxis], np.inf, block.point_sd))
    for each, kept in ((fewer, ~aside), (start, ~aside), (start, np.ones_like(aside))):
        try:
            result = adjust(of_photos(kept_images(each, kept), posed), covariance=False)
        except (AdjustmentError, InputError):
            continue
        if result.converged and result.cameras:
            return block.replace(cameras=[each.camera for each in result.cameras])
    return None


def _found(block: Block, known: Known, directions: Floats) -> _Search:
    row = _photocore.find_first_values(
        known.positions,
        known.attitudes,
        known.observed_positions,
        known.observed_attitudes,
        known.points,
        known.point_sd,
        block.image_photos,
        block.image_points,
        directions,
        direction_deviations(block),
        threads=0,
    )
    return _Search(*row)


def _on_nominal(
    block: Block, known: Known, directions: Floats, axes: Cartesian
) -> tuple[_Search, list[Message]] | None:
    """Orient photos relatively and transform the model to nominal coordinates of points.

    None if no point has both constrained and free coordinates. None if the model contains fewer than three
    points with coordinates, or if these are collinear.
    """
    held = np.isfinite(block.point_sd)
    if not (held.any(axis=1) & ~held.all(axis=1)).any():
        return None
    free = replace(
        known,
        points=np.full_like(known.points, np.nan),
        point_sd=np.full_like(known.point_sd, np.inf),
    )
    search = _found(block, free, directions)
    given = axes.positions(block.point_positions)
    rows = np.flatnonzero(np.isfinite(given).all(axis=1) & np.isfinite(search.points).all(axis=1))
    if search.first is None or len(rows) < IN_COMMON:
        return None
    scale, turn, shift, residual = similarity(search.points[rows], given[rows])
    if not np.isfinite(residual):
        return None
    names = [block.point_ids[row] for row in rows.tolist()]
    message = Message(phrase("first.nominal", n=len(names), points=names))
    positions, points = (scale * each @ turn.T + shift for each in (search.positions, search.points))
    attitudes = turn @ search.attitudes
    return search._replace(positions=positions, attitudes=attitudes, points=points, first=None), [message]


def _mirrored(block: Block, known: Known, directions: Floats, started: int, against: Bools) -> list[Message]:
    """Return notes on inconsistent control, or on control that fits mirrored photos.

    Only control that is not in a plane reveals mirrored photos; relative orientation does not.
    """
    control = np.asarray(np.isfinite(known.point_sd).all(axis=1))
    of_control = control[block.image_points]
    misses = int(np.count_nonzero(against & of_control))
    doubtful = DOUBTFUL * np.count_nonzero(of_control) < misses
    if np.count_nonzero(control) < NEEDED or not (doubtful or started < len(block.photo_ids)):
        return []
    found = _found(block, known, directions * [-1.0, 1.0, 1.0])
    others = int(found.oriented.sum())
    still = int(np.count_nonzero((found.aside | found.against[block.image_points]) & of_control))
    if others >= max(started, len(block.photo_ids) // 2) and (others > 2 * started or 5 * still < misses):
        return [Message(phrase("first.mirrored"))]
    count = int(np.count_nonzero(of_control))
    return [Message(phrase("first.control-images", n=misses, all=count))] if doubtful else []


def _of_control(block: Block, contradicted: tuple[str, ...], aside: Bools) -> list[Message]:
    """Report control points that are inconsistent with their images, or without a consistent image."""
    messages = []
    if contradicted:
        messages.append(Message(phrase("first.contradicted", points=list(contradicted))))
    held = np.asarray(np.isfinite(block.point_sd).any(axis=1))
    lost = np.setdiff1d(block.image_points[aside & held[block.image_points]], block.image_points[~aside])
    if lost.size:
        messages.append(Message(phrase("first.lost", points=[block.point_ids[row] for row in lost.tolist()])))
    return messages


def _started(block: Block, axes: Cartesian, search: _Search) -> Block:
    """Insert the computed poses; given poses and observed values do not change."""
    new = search.oriented & np.array([reason != "given" for reason, *_ in search.reasons])
    new_positions, new_attitudes = block.photo_positions.copy(), block.photo_attitudes.copy()
    if new.any():
        new_positions[new] = axes.from_cartesian(search.positions[new])
        matrices = axes.to_local(search.attitudes[new], new_positions[new])
        new_attitudes[new] = Attitudes(matrices).values(angles_form(block.photo_to_ground))
    return with_poses(block, new_positions, new_attitudes)


def _scale(block: Block, points: Floats) -> float:
    """Return the ratio of observed to computed distances; 1 without observed distances."""
    place = block._point_rows
    ratios = [
        each.length / float(np.linalg.norm(points[place[each.first]] - points[place[each.second]]))
        for each in block.observations.of_type(Distance)
    ]
    known = [ratio for ratio in ratios if np.isfinite(ratio)]
    return float(np.median(known)) if known else 1.0


def _reason(kind: str, count: int, photos: int) -> Phrase:
    fields = {"n": count, "photos": photos, "least": NEEDED if kind == "points" else IN_COMMON}
    few = "few" if count < IN_COMMON else "line"
    return phrase(f"first.reason.{kind if kind in ('points', 'misfit') else few}", **fields)


def _reasons(missing: dict[str, str]) -> str:
    by_reason = by_key((reason, photo) for photo, reason in missing.items())
    return "; ".join(f"{listed(photos)}: {reason}" for reason, photos in by_reason.items())


def _messages(
    block: Block,
    sources: dict[str, str],
    missing: dict[str, str],
    aside: Bools,
    first: str | None,
    *,
    kept: bool,
) -> list[Message]:
    counts = {source: sum(own == source for own in sources.values()) for source in SOURCES}
    parts = [phrase(f"first.source.{source}", count=count) for source, count in counts.items() if count]
    messages = [phrase("first.sources", n=len(sources), all=len(block.photo_ids), sources=parts)]
    if missing:
        messages.append(phrase("first.missing", reasons=_reasons(missing)))
    if first is not None:
        messages.append(phrase("first.no-datum", photo=first))
    if aside.any():
        points = sorted({block.point_ids[point] for point in block.image_points[aside]})
        code = "first.images.kept" if kept else "first.images.aside"
        messages.append(phrase(code, n=int(aside.sum()), points=points))
    if block.refraction is not None:
        messages.append(phrase("first.refraction"))
    return [Message(message) for message in messages]
