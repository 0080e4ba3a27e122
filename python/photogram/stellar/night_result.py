"""A night of exposures of one camera, and what becomes of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message, unknown_name
from photogram.show.methods import Brief, Documented, Judged
from photogram.statistics.limits import GlobalTest, global_test
from photogram.stellar.camera_tables import correlated, significance
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.lenses import lens_named
from photogram.stellar.matching import STRETCH
from photogram.stellar.places import Earth, InertialAttitude, inertial_attitude
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration
from photogram.stellar.sky_cameras import SkyCamera
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.stellar.comparison import Standstill
    from photogram.stellar.lens_choice import LensFit, LensTest


@dataclass(frozen=True, eq=False, repr=False)
class Night(Brief):
    """Exposures of one camera, and what is known of it beforehand.

    Attributes
    ----------
    site, earth
        Where the camera stood; UT1 - UTC and the pole.
    catalogue
        The brightest stars first (`Catalogue.brighter`); at least as deep as the images.
    frame
        Width and height, pixels.
    camera
        Approximate, such as `SkyCamera.of_field`; or the calibrated one that is `prior`.
    exposures
        With approximate attitudes; images in the order of their brightness. Stars that are known already
        stand in `Exposure.stars`.
    names
        (E,) of the exposures.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    attitude_error
        Largest error of the approximate attitudes, radians.
    tolerance
        Largest distance between an image and its star under the ideal camera, when the best polynomials are
        taken off; pixels.
    rejection
        Images with larger standardized residuals are left out; 0 for none.
    fixed, common_scale, prior, weigh_stars
        As for `calibrate_exposures`.
    lenses
        Names of lenses that are tried; the data choose. None for that of `camera` alone.
    roll_known
        Whether the roll of the approximate attitudes is known as well as their direction; else it may be any.
    field_error
        Share by which the principal distance of `camera` may be wrong.
    blind
        Smallest and largest horizontal field of view, radians, when neither attitudes nor the field of view
        are known (`photogram.stellar.blind`); None where they are.
    tripod
        Whether the camera stood still on a tripod: its attitudes are tested to be one.
    confirmed
        Names of exposures that take part though their identification is doubtful.
    nowhere
        Exposures without an attitude, by their index, and why they have none: they are left out.
    title
        For the report.
    """

    site: Site
    catalogue: Catalogue
    frame: tuple[float, float]
    camera: SkyCamera
    exposures: Sequence[Exposure]
    names: tuple[str, ...]
    pixel_sd: float = 0.1
    attitude_error: float = float(np.radians(1.0))
    tolerance: float = 8.0
    rejection: float = 4.0
    fixed: tuple[str, ...] = ()
    prior: SkyCamera | None = None
    weigh_stars: bool = False
    earth: Earth = field(default_factory=Earth)
    title: str = ""
    common_scale: bool = False
    lenses: tuple[str, ...] = ()
    roll_known: bool = True
    field_error: float = STRETCH
    blind: tuple[float, float] | None = None
    tripod: bool = False
    confirmed: tuple[str, ...] = ()
    nowhere: Mapping[int, str | Phrase] = field(default_factory=dict)

    def __post_init__(self) -> None:
        exposures, names = len(self.exposures), len(self.names)
        if not exposures or names != exposures:
            raise InputError(phrase("stars.names-of-exposures", exposures=exposures, names=names))
        positive = {
            "width": self.frame[0],
            "height": self.frame[1],
            "pixel_sd": self.pixel_sd,
            "tolerance": self.tolerance,
        }
        for name, value in positive.items():
            if not value > 0:
                raise InputError(_at(name, phrase("error.positive", value=value)))
        if not self.rejection >= 0:
            raise InputError(_at("rejection", phrase("error.not-negative", value=self.rejection)))
        if not 0 < self.field_error <= 0.5:
            limits = phrase("error.range", low=0, high=0.5, value=self.field_error)
            raise InputError(_at("field_error", limits))
        for lens in self.lenses:
            lens_named(lens)
        for name in self.confirmed:
            if name not in self.names:
                raise InputError(_at("confirmed", unknown_name("exposure", name, self.names)))
        if self.lenses and self.prior is not None:
            raise InputError(phrase("stars.lenses-with-prior"))


def _at(name: str, message: Phrase) -> Phrase:
    return phrase("error.at", what=name, message=message)


@dataclass(frozen=True, eq=False, repr=False)
class CalibratedNight(Judged, Documented, Brief):
    """A calibrated camera, and what happened to the images.

    Attributes
    ----------
    night
        What was calibrated.
    exposures
        Those that took part, with the stars of their images.
    names
        Their names.
    calibration
        Camera and attitudes.
    identified, rejected
        (E,) images with a star, and those of them that were left out because they contradict the rest.
    odds
        (E,) expected number of wrong hypotheses under which as many images have a star: the larger one of
        the first identification and of that under the final camera. NaN where the images name their stars.
    log_odds
        (E,) logarithm of the odds against chance by the distances of images and stars (D. Lang et al. 2010).
    star_probabilities
        (m,) probability of the star of each image used, in the order of `calibration`; NaN where the image
        names it.
    doubtful
        Names of the exposures that are left out although chance may not have found their stars, with the
        expected number of chance matches.
    messages
        Remarks.
    lenses
        Lenses that were tried, the chosen one first; empty where there was no choice.
    scale_test
        The data's test of fx = fy; None where it cannot be made.
    term_tests
        Of the terms of the lens, those first that may be left out.
    standstill
        The test of one attitude for all exposures; None where it was not asked for.
    """

    night: Night
    exposures: tuple[Exposure, ...]
    names: tuple[str, ...]
    calibration: SkyCalibration
    identified: Indices
    rejected: Indices
    odds: Floats
    log_odds: Floats
    star_probabilities: Floats
    doubtful: dict[str, float]
    messages: tuple[Message, ...]
    lenses: tuple[LensFit, ...] = ()
    scale_test: LensTest | None = None
    term_tests: tuple[LensTest, ...] = ()
    standstill: Standstill | None = None

    @property
    def converged(self) -> bool:
        """Whether the last adjustment ended by its criterion."""
        return self.calibration.status == "converged"

    @cached_property
    def test(self) -> GlobalTest | None:
        """The global test of the residuals against `Night.pixel_sd`."""
        found = self.calibration
        return global_test(found.mean_error**2 * found.degrees_of_freedom, found.degrees_of_freedom)

    @property
    def usable(self) -> bool:
        """Whether the camera may be used: `verdict` says why not.

        Not so when the adjustment has not converged, residuals are much larger than assumed, more exposures
        are left out than take part, or the identification of an exposure is doubtful.
        """
        return self.verdict.usable

    @property
    def probabilities(self) -> Floats:
        """(E,) that each exposure shows its stars, 1 / (1 + odds) at least; NaN where images name them."""
        return np.asarray(1.0 / (1.0 + self.odds), float)

    @property
    def falsely_identified(self) -> float:
        """Bound of the probability that any exposure is falsely identified: the sum of `odds`."""
        return float(np.nansum(self.odds))

    @cached_property
    def inertial(self) -> list[InertialAttitude]:
        """(E,) attitudes in ICRS: quaternions with covariance."""
        found, night = self.calibration, self.night
        rows = zip(found.attitudes, found.attitude_covariances, self.exposures, strict=True)
        return [
            inertial_attitude(angles, covariance, night.site, exposure.utc, night.earth)
            for angles, covariance, exposure in rows
        ]

    @property
    def mostly_left_out(self) -> bool:
        """Whether more exposures are left out than take part."""
        return len(self.night.exposures) > 2 * len(self.exposures)

    @property
    def camera(self) -> SkyCamera:
        """The calibrated camera."""
        return self.calibration.camera

    def document(self) -> Document:
        """Return the document: verdict, camera, exposures, images."""
        from photogram.stellar.night_document import night_document

        return night_document(self)

    def _findings(self) -> Findings:
        from photogram.stellar.findings import night_findings

        return night_findings(self)

    def correlated(self) -> list[tuple[str, str, float]]:
        """Name pairs of camera parameters whose correlation exceeds 0.95."""
        return correlated(self.camera.names, self.camera.covariance)

    def significance(self) -> dict[str, float]:
        """Return each estimated distortion term over its mean error."""
        camera = self.camera
        return significance(camera.names[4:], camera.values[4:], camera.covariance[4:, 4:])
