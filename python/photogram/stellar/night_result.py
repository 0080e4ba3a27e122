"""Night of exposures of one camera, and its calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.fields import check_fields, option
from photogram.arguments.objects import require, require_name
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.messages import Message, unknown_name
from photogram.network.attitudes import Attitudes
from photogram.show.methods import Documented, Judged
from photogram.statistics.limits import GlobalTest, global_test
from photogram.stellar.camera_tables import correlated, night_findings, significance
from photogram.stellar.catalogue import Catalogue
from photogram.stellar.identification import STRETCH
from photogram.stellar.places import Earth, inertial_attitudes
from photogram.stellar.sky import Site
from photogram.stellar.sky_calibration import Exposure, SkyCalibration
from photogram.stellar.sky_cameras import LENSES, SkyCamera
from photogram.summaries import Brief
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings
    from photogram.stellar.comparison import LensFit, LensTest, Standstill
    from photogram.stellar.pictures import PicturedStars


@dataclass(frozen=True, eq=False, repr=False)
class Night(Brief):
    """Exposures of one camera with prior information.

    Attributes
    ----------
    site, earth
        Station; UT1 - UTC and the pole.
    catalogue
        Stars, brightest first (`Catalogue.brighter`), at least as deep as the images.
    frame
        Width and height, pixels.
    camera
        Approximate camera, such as `SkyCamera.of_field`, or the calibrated one in `prior`.
    exposures
        Exposures with approximate attitudes and images sorted by brightness. Known stars are stored in
        `Exposure.stars`.
    names
        (E,) names of the exposures.
    pixel_sd
        Standard deviation of an image coordinate, pixels.
    attitude_error
        Largest error of the approximate attitudes, radians.
    tolerance
        Largest distance between an image and its star for the ideal camera, after the best polynomials;
        pixels.
    rejection
        Critical value of standardized residuals for the rejection of images; 0 disables it.
    fixed, common_scale, prior, weigh_stars
        As in `calibrate_exposures`.
    lenses
        Names of lenses to compare; None: only the lens of `camera`.
    roll_known
        Whether the roll of the approximate attitudes is known as well as their direction; otherwise it is
        arbitrary.
    field_error
        Largest relative error of the principal distance of `camera`.
    blind
        Smallest and largest horizontal field of view, radians, if neither attitudes nor the field of view are
        known (`photogram.stellar.night_calibration`); otherwise None.
    tripod
        Whether the camera was fixed on a tripod: equality of its attitudes is tested.
    confirmed
        Names of exposures that are used in spite of a doubtful identification.
    nowhere
        Exposures without an attitude, by index, with reasons. They are not used.
    title
        Title of the report.
    """

    site: Site
    catalogue: Catalogue
    frame: tuple[float, float]
    camera: SkyCamera
    exposures: Sequence[Exposure]
    names: tuple[str, ...]
    pixel_sd: float = option(0.1, 0.0, is_open=True)
    attitude_error: float = float(np.radians(1.0))
    tolerance: float = option(8.0, 0.0, is_open=True)
    rejection: float = option(4.0, 0.0)
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
        check_fields(self)
        exposures, names = len(self.exposures), len(self.names)
        if not exposures or names != exposures:
            raise InputError(phrase("stars.names-of-exposures", exposures=exposures, names=names))
        for name, value in zip(("width", "height"), self.frame, strict=True):
            require(value > 0, name, "positive", value=value)
        field_error = self.field_error
        require(0 < field_error <= 0.5, "field_error", "range", low=0, high=0.5, value=field_error)
        for lens in self.lenses:
            require_name("lens", lens, LENSES)
        for name in self.confirmed:
            if name not in self.names:
                unknown = unknown_name("exposure", name, self.names)
                raise InputError(phrase("error.at", what="confirmed", message=unknown))
        if self.lenses and self.prior is not None:
            raise InputError(phrase("stars.lenses-with-prior"))


@dataclass(frozen=True, eq=False, repr=False)
class CalibratedNight(Judged, Documented):
    """Calibrated camera of a night, with the use of its images.

    Attributes
    ----------
    night
        Input of the calibration.
    exposures
        Used exposures, with the stars of their images.
    names
        Names of the used exposures.
    calibration
        Adjusted camera and attitudes.
    identified, rejected
        (E,) numbers of images with a star, and of those rejected as inconsistent.
    odds
        (E,) expected number of wrong hypotheses with an equal number of matches: the maximum of the first
        identification and the final camera. NaN if the images name their stars.
    log_odds
        (E,) logarithm of the odds against chance by the distances of images and stars (D. Lang et al. 2010).
    star_probabilities
        (m,) probability of the star of each used image, in the order of `calibration`; NaN if the image names
        it.
    doubtful
        Names of unused exposures whose identification may be correct, with the expected number of chance
        matches.
    messages
        Warnings.
    lenses
        Compared lenses, the chosen one first; empty without a choice.
    scale_test
        Test of fx = fy; None if impossible.
    term_tests
        Tests of the lens terms, removable ones first.
    standstill
        Test of one attitude for all exposures; None if not requested.
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
        """Whether the last adjustment met its convergence criterion."""
        return self.calibration.status == "converged"

    @cached_property
    def test(self) -> GlobalTest | None:
        """The global test of the residuals against `Night.pixel_sd`."""
        found = self.calibration
        return global_test(found.mean_error**2 * found.degrees_of_freedom, found.degrees_of_freedom)

    @property
    def usable(self) -> bool:
        """Whether the camera is usable; `verdict` gives the reasons.

        It is unusable if the adjustment has not converged, or if residuals are much larger than assumed. It
        is also unusable if more exposures are unused than used, or if an identification is doubtful.
        """
        return self.verdict.usable

    @property
    def probabilities(self) -> Floats:
        """(E,) probabilities that exposures show their stars, at least 1 / (1 + odds).

        NaN if images name their stars.
        """
        return np.asarray(1.0 / (1.0 + self.odds), float)

    @property
    def falsely_identified(self) -> float:
        """Upper bound of the probability of any false identification: the sum of `odds`."""
        return float(np.nansum(self.odds))

    @cached_property
    def inertial(self) -> Attitudes:
        """Attitudes of the E exposures in ICRS, with covariances of rotations."""
        found, night = self.calibration, self.night
        utcs = [exposure.utc for exposure in self.exposures]
        return inertial_attitudes(found.attitudes, found.attitude_covariances, night.site, utcs, night.earth)

    @property
    def mostly_left_out(self) -> bool:
        """Whether more exposures are unused than used."""
        return len(self.night.exposures) > 2 * len(self.exposures)

    @property
    def camera(self) -> SkyCamera:
        """The calibrated camera."""
        return self.calibration.camera

    def document(self) -> Document:
        """Return the document with verdict, camera, exposures and images."""
        from photogram.stellar.night_document import night_document

        return night_document(self)

    def _plot_data(self) -> PicturedStars:
        from photogram.stellar.pictures import night_pictured

        return night_pictured(self)

    def _findings(self) -> Findings:
        return night_findings(self)

    def correlated(self) -> list[tuple[str, str, float]]:
        """Return pairs of camera parameters with correlations above 0.95."""
        return correlated(self.camera.names, self.camera.covariance)

    def significance(self) -> dict[str, float]:
        """Return the ratio of each estimated distortion term to its mean error."""
        camera = self.camera
        return significance(camera.names[4:], camera.values[4:], camera.covariance[4:, 4:])
