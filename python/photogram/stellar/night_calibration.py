"""A night of exposures: from measured star images and rough attitudes to the calibrated camera.

Stars are identified with an ideal camera first, then again with the calibrated one; images that contradict it
are left out, one round after the other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogram.errors import AdjustmentError, InputError
from photogram.messages import Message, listed
from photogram.show.angles import ARCSEC
from photogram.statistics.verdict import LARGEST_FACTOR
from photogram.stellar.blind import ATTITUDE, FIELD, locate
from photogram.stellar.comparison import stood_still
from photogram.stellar.identification import attitude_of_stars, has_named_stars
from photogram.stellar.lens_choice import LensFit, LensTest, as_lens, compared_lenses, test_scale, test_terms
from photogram.stellar.lenses import LENSES
from photogram.stellar.night_result import CalibratedNight, Night
from photogram.stellar.night_run import Run, adjusted
from photogram.stellar.places import Earth
from photogram.stellar.sky_cameras import SkyCamera

__all__ = ["CalibratedNight", "Night", "calibrate_night"]

_FIELDS = 200
"""Fields of view that are tried for exposures whose images name their stars."""


def calibrate_night(night: Night, threads: int | None = None) -> CalibratedNight:
    """Identify the stars of a night and calibrate the camera.

    An exposure takes part when chance would not have found its stars (`photogram.stellar.odds`), and stays
    when it fits the camera of the others (`photogram.stellar.comparison`). The others are named, with the
    mistake that explains them if there is one (`photogram.stellar.hints`).

    Raises
    ------
    InputError
        No exposure shows enough stars of the catalogue; fewer than one thread.
    AdjustmentError
        The stars do not determine the camera.
    """
    # The pole turns all attitudes alike: it waits for the last adjustment.
    still = replace(night, earth=Earth(night.earth.dut1))
    lenses: list[LensFit] = []
    if night.blind is not None:
        still = _located(still, night.blind)
    still = _directed(still)
    if night.lenses:
        lenses, still = _with_best_lens(still, threads)
    run = _run(still, threads)
    if night.earth.pole != (0.0, 0.0):
        run.adjust(replace(still, earth=night.earth))
    found, names = run.found, night.names
    frame, freedom = night.frame, found.degrees_of_freedom
    sd = night.pixel_sd * (found.mean_error or 1.0)
    result = CalibratedNight(
        night=night,
        exposures=tuple(run.exposures()),
        names=tuple(names[each.index] for each in run.seen),
        calibration=found,
        identified=np.array([int((each.stars >= 0).sum()) for each in run.seen]),
        rejected=np.array([int(((each.stars >= 0) & ~each.kept).sum()) for each in run.seen]),
        odds=np.array([each.expected for each in run.seen]),
        log_odds=np.array([each.log_odds for each in run.seen]),
        star_probabilities=np.concatenate([each.probabilities[each.kept] for each in run.seen]),
        doubtful={names[index]: expected for index, expected in sorted(run.doubtful.items())},
        messages=(),
        lenses=tuple(lenses),
        scale_test=_scale_test(night, run, threads),
        term_tests=tuple(test_terms(found.camera, freedom, frame, sd)),
        standstill=stood_still(found) if night.tripod else None,
    )
    return replace(result, messages=(*_failed(result), *run.messages(), *_remarks(result)))


def _located(night: Night, fields: tuple[float, float]) -> Night:
    """Return the night with the attitudes and the field of view that are found in the whole sky."""
    unknown = [index for index, exposure in enumerate(night.exposures) if exposure.stars is None]
    found = (
        locate([night.exposures[index] for index in unknown], night.site, night.frame, fields, night.earth)
        if unknown
        else []
    )
    seen = [located.field for located in found if located.found] or _field_of_stars(night, fields)
    if not seen:
        reasons = sorted({located.reason() for located in found}) or ["images name one star, and need two"]
        raise InputError(f"no exposure is found in the sky: {listed(reasons)}")
    exposures, reasons_of = list(night.exposures), dict(night.nowhere)
    for index, located in zip(unknown, found, strict=True):
        exposures[index] = replace(exposures[index], attitude=located.attitude)
        if not located.found:
            reasons_of[index] = located.reason()
    camera = SkyCamera.of_field(*night.frame, float(np.median(seen)))
    return replace(
        night,
        exposures=exposures,
        camera=camera,
        attitude_error=ATTITUDE,
        field_error=FIELD,
        roll_known=True,
        nowhere=reasons_of,
    )


def _field_of_stars(night: Night, fields: tuple[float, float]) -> list[float]:
    """Return the field of view that fits the exposures whose images name their stars best; none without."""
    named = [each for each in night.exposures if has_named_stars(each)]
    if not named:
        return []
    tried = np.geomspace(*fields, _FIELDS)
    misfits = [
        sum(
            attitude_of_stars(
                each, SkyCamera.of_field(*night.frame, field), night.site, night.catalogue, night.earth
            )[1]
            for each in named
        )
        for field in tried.tolist()
    ]
    return [float(tried[int(np.argmin(misfits))])]


def _directed(night: Night) -> Night:
    """Return the night with the directions that named stars give exposures without any."""
    exposures = [
        replace(
            each,
            attitude=attitude_of_stars(each, night.camera, night.site, night.catalogue, night.earth)[0],
        )
        if has_named_stars(each) and np.isnan(each.attitude).any()
        else each
        for each in night.exposures
    ]
    return replace(night, exposures=exposures)


def _run(night: Night, threads: int | None) -> Run:
    """Identify and adjust until all exposures fit each other."""
    run = Run(night, threads)
    run.compare()
    if run.identify_left_out():
        run.compare()
    return run


def _with_best_lens(night: Night, threads: int | None) -> tuple[list[LensFit], Night]:
    """Choose a lens by the images that the best of them identifies; return all, and the night with it."""
    runs, failed = [], []
    for lens in night.lenses:
        try:
            camera = as_lens(night.camera, lens, night.frame)
            runs.append(_run(replace(night, camera=camera, fixed=_of(night, camera)), threads))
        except (InputError, AdjustmentError) as error:
            failed.append(f"{lens}: {error}")
    if not runs:
        raise InputError(f"no lens shows stars of the catalogue: {'; '.join(failed)}")
    most = max(runs, key=lambda run: sum(int(each.kept.sum()) for each in run.seen))
    pairs = zip(most.seen, most.exposures(), strict=True)
    exposures = [replace(exposure, stars=each.stars) for each, exposure in pairs]
    fits, camera = compared_lenses(
        night.lenses,
        exposures,
        most.found.camera,
        night.site,
        night.catalogue,
        frame=night.frame,
        pixel_sd=night.pixel_sd,
        rejection=night.rejection,
        fixed=night.fixed,
        common_scale=night.common_scale,
        earth=night.earth,
        threads=threads,
    )
    start = replace(camera, covariance=np.zeros_like(camera.covariance))
    return fits, replace(night, camera=start, fixed=_of(night, start))


def _of(night: Night, camera: SkyCamera) -> tuple[str, ...]:
    """Return the names of those parameters to be held that a camera has."""
    return tuple(name for name in night.fixed if name in camera.names)


def _scale_test(night: Night, run: Run, threads: int | None) -> LensTest | None:
    """Test fx = fy, by an adjustment without that condition where there is one."""
    found = run.found
    if night.common_scale:
        if night.prior is not None:
            return None
        found = adjusted(replace(run.night, common_scale=False), run.exposures(), found.camera, threads)
    sd = night.pixel_sd * (found.mean_error or 1.0)
    return test_scale(found.camera, found.degrees_of_freedom, night.frame, sd)


def _failed(result: CalibratedNight) -> list[Message]:
    """Say what makes the camera unfit for use, and of which nature it is."""
    texts, lens = [], result.camera.lens
    if not result.converged:
        texts.append(f"the adjustment has not converged: {result.calibration.status}: do not use this camera")
    if result.mostly_left_out:
        texts.append("more exposures are left out than take part: do not use this camera")
    texts += [
        f"the identification of exposure {name} is doubtful: by chance {expected:.2g} attitudes would show"
        " as many stars: do not use this camera before the exposure is taken out of the file, or confirmed"
        for name, expected in result.doubtful.items()
    ]
    test = result.test
    failed = test.problem() if test else None
    if test and failed:
        texts.append(f"{failed}: do not use this camera" if test.factor > LARGEST_FACTOR else failed)
        missing = result.night.site.effects.left_out
        places = f", or its places need {' and '.join(missing)}, left out of them" if missing else ""
        texts.append(
            f"the stars are found beyond doubt: sd_px is too small, or the lens {lens} does not"
            f" describe this camera (others are {listed([name for name in LENSES if name != lens])}){places}"
        )
    return [Message(text) for text in texts]


def _remarks(result: CalibratedNight) -> list[Message]:
    """Name what the stars hardly determine, and what else they say."""
    texts = [f"correlation of {a} and {b}: {r:+.4f}" for a, b, r in result.correlated()]
    weak = [
        f"{test.name} (probability {test.probability:.2g})"
        for test in result.term_tests
        if not test.significant
    ]
    if weak:
        texts.append(f"distortion terms that are not significant: {'; '.join(weak)}")
    scale = result.scale_test
    if scale is not None and result.night.common_scale and scale.needed:
        texts.append(
            f"fx is not fy: the data refuse it (F = {scale.statistic:.1f}, probability"
            f" {scale.probability:.2g}), it makes {scale.effect:.2f} px at the rim"
        )
    if result.standstill is not None:
        texts += [
            f"exposure {result.names[k]}: the camera did not stand still, it is turned by"
            f" {result.standstill.turns[k] / ARCSEC:.1f} arcsec against the others"
            f" (probability {result.standstill.own[k]:.2g})"
            for k in result.standstill.moved
        ]
    return [Message(text) for text in texts]
