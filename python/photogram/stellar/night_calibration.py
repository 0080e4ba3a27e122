"""Calibration of a camera from a night of exposures with approximate attitudes.

Stars are identified with an ideal camera first, then with the calibrated one. Inconsistent images are
rejected in rounds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from photogram.arguments.types import Bools, Floats
from photogram.errors import AdjustmentError, InputError, PhotogramError, message_of
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.statistics.weight_rules import LARGEST_FACTOR
from photogram.stellar.camera_tables import correlation_remarks
from photogram.stellar.comparison import POSITIVE, LensFit, LensTest, stood_still, test_scale, test_terms
from photogram.stellar.identification import attitude_of_stars, has_named_stars
from photogram.stellar.night_result import CalibratedNight, Night
from photogram.stellar.night_run import Run, adjusted
from photogram.stellar.places import Earth, station_attitude
from photogram.stellar.sky_calibration import Exposure, SkyCalibration
from photogram.stellar.sky_cameras import LENSES, SkyCamera
from photogram.words import Phrase, phrase

_ATTITUDE_ERROR, _FIELD_ERROR = math.radians(1.5), 0.05
"""Largest errors of attitudes (radians) and of the principal distance (relative)."""
_STEP = 1.3  # Ratio of consecutive fields of view; each covers half of the distance to the next
_MAX_IMAGES = 200
_TIMEOUT_MS = 5000
_MAGNITUDES = (6.0, 9.0)  # Faintest stars for fields of 40 and of 5 degrees


_MAX_FIELDS = 200  # Fields of view that are tested if images name their stars
_MAX_ROUNDS = 10


def calibrate_night(night: Night, threads: int | None = None) -> CalibratedNight:
    """Identify the stars of a night and calibrate the camera.

    An exposure is used if its stars are significant against chance and if it fits
    the camera of the others (`photogram.stellar.comparison`). Messages name the other exposures and the
    probable cause, if found.

    Raises
    ------
    InputError
        If all exposures show too few stars of the catalogue, or if `threads` is less than 1.
    AdjustmentError
        If the stars do not determine the camera.
    """
    # The pole rotates all attitudes by the same angle, and is used only in the last adjustment.
    still = replace(night, earth=Earth(night.earth.dut1))
    lenses: list[LensFit] = []
    if night.blind is not None:
        still = _located(still, night.blind)
    exposures = [
        replace(exposure, attitude=attitude_of_stars(exposure, still.camera, still)[0])
        if has_named_stars(exposure) and np.isnan(exposure.attitude).any()
        else exposure
        for exposure in still.exposures
    ]
    still = replace(still, exposures=exposures)
    if night.lenses:
        lenses, still = _with_best_lens(still, threads)
    run = _run(still, threads)
    if night.earth.pole != (0.0, 0.0):
        run.adjust(replace(still, earth=night.earth))
    found, names = run.found, night.names
    sd = night.pixel_sd * (found.mean_error or 1.0)
    result = CalibratedNight(
        night=night,
        exposures=tuple(run.exposures()),
        names=tuple(names[seen.index] for seen in run.seen),
        calibration=found,
        identified=np.array([int((seen.stars >= 0).sum()) for seen in run.seen]),
        rejected=np.array([int(((seen.stars >= 0) & ~seen.kept).sum()) for seen in run.seen]),
        odds=np.array([seen.expected for seen in run.seen]),
        log_odds=np.array([seen.log_odds for seen in run.seen]),
        star_probabilities=np.concatenate([seen.probabilities[seen.kept] for seen in run.seen]),
        doubtful={names[index]: expected for index, expected in sorted(run.doubtful.items())},
        messages=(),
        lenses=tuple(lenses),
        scale_test=_scale_test(night, run, threads),
        term_tests=tuple(test_terms(found.camera, found.degrees_of_freedom, night.frame, sd)),
        standstill=stood_still(found) if night.tripod else None,
    )
    messages = [*_failed(result), *run.messages(), *_remarks(result)]
    return replace(result, messages=tuple(map(Message, messages)))


def _located(night: Night, fields: tuple[float, float]) -> Night:
    """Return the night with attitudes and field of view located on the whole sky by `tetra3rs`.

    The package (extra `stars`) finds patterns of four bright images in a database of Gaia and Hipparcos,
    without any attitude (S. Michael, https://tetra3rs.dev). Its results are initial values of the
    identification. Stars, odds and adjustment are then the same as for given attitudes. The package supports
    only central perspectives, that is, lenses without much distortion within some 60 degrees.
    """
    exposures, seen, reasons = list(night.exposures), list[float](), dict[int, Phrase]()
    unknown = [index for index, exposure in enumerate(exposures) if exposure.stars is None]
    if unknown:
        low, high = (math.degrees(field) for field in fields)
        if not 0.5 <= low <= high <= 100:
            raise InputError(phrase("stars.blind-fields", low=low, high=high))
        count = max(1, math.ceil(math.log(high / low) / math.log(_STEP)))
        tried = [low * (high / low) ** ((k + 0.5) / count) for k in range(count)]
    for index in unknown:
        attitude, field, reason = _solved(_database(low, high), exposures[index], night, tried)
        exposures[index] = replace(exposures[index], attitude=attitude)
        if reason is None:
            seen.append(field)
            # All exposures have one camera: its field of view is tested first.
            tried.sort(key=lambda other: abs(math.log(math.radians(other) / seen[-1])))
        else:
            reasons[index] = reason
    seen = seen or _field_of_stars(night, fields)
    if not seen:
        several = {reason.code: reason for reason in reasons.values()}
        one_named = phrase("stars.one-named")
        raise InputError(phrase("stars.not-located", reasons=[*several.values()] or [one_named]))
    return replace(
        night,
        exposures=exposures,
        camera=SkyCamera.of_field(*night.frame, float(np.median(seen))),
        attitude_error=_ATTITUDE_ERROR,
        field_error=_FIELD_ERROR,
        roll_known=True,
        nowhere={**night.nowhere, **reasons},
    )


@lru_cache(maxsize=2)
def _database(low: float, high: float) -> Any:
    import tetra3rs

    faint, bright = math.log(5.0), math.log(40.0)
    share = min(1.0, max(0.0, (bright - math.log(low)) / (bright - faint)))
    magnitude = _MAGNITUDES[0] + share * (_MAGNITUDES[1] - _MAGNITUDES[0])
    return tetra3rs.SolverDatabase.generate_from_gaia(
        None, max_fov_deg=high * math.sqrt(_STEP), min_fov_deg=low, star_max_magnitude=magnitude
    )


def _solved(
    base: Any, exposure: Exposure, night: Night, fields: Sequence[float]
) -> tuple[Floats, float, Phrase | None]:
    """Return the attitude of an exposure and its field of view (radians), or the reason of the failure.

    The images are sorted by brightness; the given attitude is not used.
    """
    width, height = night.frame
    xy = exposure.xy[:_MAX_IMAGES] - 0.5 * np.array(night.frame)
    # The weights decrease in the order of brightness.
    images = np.column_stack([xy, np.arange(len(xy), 0, -1.0)])
    reason = phrase("stars.nowhere")
    for field in fields:
        solved = base.solve_from_centroids(
            images,
            fov_estimate_deg=field,
            fov_max_error_deg=field * (math.sqrt(_STEP) - 1),
            image_width=round(width),
            image_height=round(height),
            solve_timeout_ms=_TIMEOUT_MS,
        )
        if solved and not solved.parity_flip:
            matrix = np.asarray(solved.rotation_matrix_icrs_to_camera, float)
            attitude = station_attitude(matrix, night.site, exposure.utc, night.earth)
            return attitude, math.radians(solved.fov_deg), None
        if solved:
            reason = phrase("stars.mirrored")
    return np.full(3, math.nan), math.nan, reason


def _field_of_stars(night: Night, fields: tuple[float, float]) -> list[float]:
    """Return the best field of view for named stars of exposures; empty without them."""
    named = [exposure for exposure in night.exposures if has_named_stars(exposure)]

    def misfit(field: float) -> float:
        camera = SkyCamera.of_field(*night.frame, field)
        return sum(attitude_of_stars(exposure, camera, night)[1] for exposure in named)

    return [min(np.geomspace(*fields, _MAX_FIELDS).tolist(), key=misfit)] if named else []


def _run(night: Night, threads: int | None) -> Run:
    run = Run(night, threads)
    run.compare()
    if run.identify_rejected():
        run.compare()
    return run


def _with_best_lens(night: Night, threads: int | None) -> tuple[list[LensFit], Night]:
    """Choose the best lens for common images; return all lenses, and the new night."""
    runs, failed = [], []
    for lens in night.lenses:
        try:
            runs.append(_run(_with_camera(night, as_lens(night.camera, lens, night.frame)), threads))
        except (InputError, AdjustmentError) as error:
            failed.append(_failed_fit(lens, error))
    if not runs:
        raise InputError(phrase("stars.no-lens-identifies", reasons=_reasons(failed)))
    most = max(runs, key=lambda run: sum(seen.count for seen in run.seen))
    pairs = zip(most.seen, most.exposures(), strict=True)
    exposures = [replace(exposure, stars=seen.stars) for seen, exposure in pairs]
    fits, camera = _compared_lenses(night, exposures, most.found.camera, threads)
    return fits, _with_camera(night, replace(camera, covariance=np.zeros_like(camera.covariance)))


def _with_camera(night: Night, camera: SkyCamera) -> Night:
    """Return the night with another camera and its applicable fixed parameters."""
    return replace(night, camera=camera, fixed=tuple(name for name in night.fixed if name in camera.names))


def as_lens(camera: SkyCamera, lens: str, frame: tuple[float, float]) -> SkyCamera:
    """Return an ideal camera of another lens with the same horizontal field of view.

    InputError: if the field of view exceeds the lens.
    """
    if lens == camera.lens:
        return camera
    left, right = camera.rays(np.array([[0.0, camera.values[3]], [frame[0], camera.values[3]]]))
    field = math.acos(max(-1.0, min(1.0, float(left[2])))) + math.acos(max(-1.0, min(1.0, float(right[2]))))
    return SkyCamera.of_field(*frame, field, lens)


def _compared_lenses(
    night: Night, exposures: Sequence[Exposure], camera: SkyCamera, threads: int | None
) -> tuple[list[LensFit], SkyCamera]:
    """Adjust lenses to the same images; return them, best first, and the best camera.

    Images rejected by one lens are not used for any lens, unless the lens rejects most of them.

    AdjustmentError: if the adjustment fails for all lenses.
    """
    night = replace(night, weigh_stars=False)

    def adjust(start: SkyCamera, images: Sequence[Exposure]) -> SkyCalibration:
        return adjusted(_with_camera(night, start), images, start, threads)

    tried: dict[str, tuple[SkyCamera, list[Bools]]] = {}
    fits: list[LensFit] = []
    failed: list[LensFit] = []
    for lens in night.lenses:
        now = list(exposures)
        try:
            found = adjust(as_lens(camera, lens, night.frame), now)
            for _ in range(_MAX_ROUNDS if night.rejection else 0):
                far = np.abs(found.residuals).max(axis=1)
                limit = night.rejection * max(1.4826 * float(np.median(np.abs(found.residuals))), 1e-12)
                if not (far > limit).any():
                    break
                for number, exposure in enumerate(now):
                    stars = np.array(exposure.stars)
                    chosen = np.flatnonzero(stars >= 0)
                    stars[chosen[far[found.exposures == number] > limit]] = -1
                    now[number] = replace(exposure, stars=stars, attitude=found.attitudes[number])
                found = adjust(found.camera, now)
        except (InputError, AdjustmentError) as error:
            failed.append(_failed_fit(lens, error))
            continue
        tried[lens] = found.camera, [np.asarray(exposure.stars) >= 0 for exposure in now]
    counts = {lens: sum(int(images.sum()) for images in kept) for lens, (_, kept) in tried.items()}
    usual = [kept for lens, (_, kept) in tried.items() if 2 * counts[lens] > max(counts.values())]
    common = [np.logical_and.reduce(images) for images in zip(*usual, strict=True)]
    shared = [
        replace(exposure, stars=np.where(chosen, np.asarray(exposure.stars), -1))
        for exposure, chosen in zip(exposures, common, strict=False)
    ]
    cameras = {}
    for lens, (start, _) in tried.items():
        try:
            found = adjust(start, shared)
        except (InputError, AdjustmentError) as error:
            failed.append(_failed_fit(lens, error))
            continue
        count = int(found.camera.known.sum())
        effective = found.degrees_of_freedom + count
        total = max(found.mean_error**2 * found.degrees_of_freedom, 1e-300)
        bic = effective * math.log(total / effective) + count * math.log(effective)
        fits.append(LensFit(lens, count, len(found.xy), found.mean_error, bic))
        cameras[lens] = found.camera
    if not fits:
        raise AdjustmentError(phrase("stars.no-lens", reasons=_reasons(failed)))
    fits.sort(key=lambda fit: fit.bic)
    near = [fit for fit in fits if fit.bic - fits[0].bic < POSITIVE]
    best = min(near, key=lambda fit: (fit.parameters, fit.bic))
    fits.remove(best)
    return [best, *fits, *failed], cameras[best.lens]


def _failed_fit(lens: str, error: PhotogramError) -> LensFit:
    return LensFit(lens, 0, 0, math.nan, math.inf, message_of(error))


def _reasons(failed: Sequence[LensFit]) -> list[Phrase]:
    return [phrase("error.at", what=fit.lens, message=fit.reason) for fit in failed]


def _scale_test(night: Night, run: Run, threads: int | None) -> LensTest | None:
    """Test fx = fy; if this is a condition, by an adjustment without it."""
    found = run.found
    if night.common_scale:
        if night.prior is not None:
            return None
        found = adjusted(replace(run.night, common_scale=False), run.exposures(), found.camera, threads)
    sd = night.pixel_sd * (found.mean_error or 1.0)
    return test_scale(found.camera, found.degrees_of_freedom, night.frame, sd)


def _failed(result: CalibratedNight) -> Iterator[Phrase]:
    lens = result.camera.lens
    if not result.converged:
        yield phrase("stars.not-converged", status=result.calibration.status)
    if result.mostly_left_out:
        yield phrase("stars.mostly-rejected")
    for name, expected in result.doubtful.items():
        yield phrase("stars.doubtful", name=name, expected=expected)
    test = result.test
    failed = test.problem() if test else None
    if test and failed:
        code = "stars.do-not-use" if test.factor > LARGEST_FACTOR else "stars.residuals"
        yield phrase(code, reason=failed)
        missing = result.night.site.effects.left_out
        effects = [phrase("stars.effects-missing", effects=missing)] if missing else []
        others = [name for name in LENSES if name != lens]
        yield phrase("stars.lens-or-sd", lens=lens, lenses=others, effects=effects)


def _remarks(result: CalibratedNight) -> Iterator[Phrase]:
    yield from correlation_remarks(result.correlated())
    tests, scale, standstill = result.term_tests, result.scale_test, result.standstill
    if weak := [test for test in tests if not test.significant]:
        terms = [phrase("stars.weak-term", name=test.name, p=test.probability) for test in weak]
        yield phrase("stars.weak-terms", terms=terms)
    if scale is not None and result.night.common_scale and scale.needed:
        yield phrase("stars.scale", f=scale.statistic, p=scale.probability, effect=scale.effect)
    if standstill is not None:
        for k in standstill.moved:
            turn, p = float(standstill.turns[k] / ARCSEC), float(standstill.own[k])
            yield phrase("stars.moved", name=result.names[k], turn=turn, p=p)
