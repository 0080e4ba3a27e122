"""Collection of photos as validated arrays."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from photogram import _photocore
from photogram.arguments.arrays import length
from photogram.arguments.equality import Valued
from photogram.arguments.fields import array, check_arrays
from photogram.arguments.types import FREE, ONE, Array, Floats, IndexArray
from photogram.collection.parameters import POSE, parameters_of
from photogram.errors import InputError
from photogram.lazy_dataclasses import converting_dataclass, field, replace
from photogram.network.block import span
from photogram.network.block_checks import numbered
from photogram.network.cameras import camera_facts
from photogram.network.observations import Observation, Observations
from photogram.network.passages import KNOTTED
from photogram.summaries import Brief, Rows
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram import Snooped
    from photogram.collection import AdjustedCollection
    from photogram.diagnosis import Diagnosis
    from photogram.network.core_arrays import CoreOptions
    from photogram.results.grouping import Grouping, Observables
    from photogram.results.snooping_options import SnoopOptions


@converting_dataclass(frozen=True, eq=False, repr=False)
class Collection(Valued, Brief):
    """Collection of P photos with unknown cameras, n points and m image observations.

    A photo sees a point X at P = R(w) X + t and looks along its -z axis. Its camera maps P to the image; all
    photos share the camera model. Any unknown may be weighted, from free (infinite standard deviation) to
    fixed (zero).

    Attributes
    ----------
    photo_parameters
        (P, k) w (rad), t (units of the object space), and the camera parameters.
    point_positions
        (n, 3) positions in the object space.
    image_photos, image_points
        (m,) indices of photos and points.
    image_xy
        (m, 2) pixels, in the convention of the camera.
    image_sd
        (m, 2) standard deviations, pixels; one number applies to all.
    photo_sd, point_sd
        (P, k) and (n, 3) standard deviations of the given values as observations; infinite is free, zero is
        fixed. One number applies to all except the constants of a camera, which are fixed.
    camera
        Camera model. `bal` ("Bundle Adjustment in the Large"; Agarwal and others 2010) has f, k1, k2 and maps
        P to f (1 + k1 p^2 + k2 p^4) p with p = -(P1, P2) / P3: pixels from the principal point, x to the
        right, y up. `docs/cameras.md` describes the other models.
    """

    photo_parameters: Array = field(metadata=array("photos", "parameters", rule="finite"))
    point_positions: Array = field(metadata=array("points", 3, rule="finite"))
    image_photos: IndexArray = field(metadata=array("images", index="photos"))
    image_points: IndexArray = field(metadata=array("images", index="points"))
    image_xy: Array = field(metadata=array("images", 2, rule="finite"))
    image_sd: Array = field(default=ONE, metadata=array("images", 2, rule="positive"))
    photo_sd: Array = field(default=FREE, metadata=array("photos", "parameters", rule="sd"))
    point_sd: Array = field(default=FREE, metadata=array("points", 3, rule="sd"))
    camera: str = "bal"

    def __post_init__(self) -> None:
        # Models with knots have more than parameters.
        known = [name for name in _photocore.CAMERAS if name != KNOTTED]
        if self.camera not in known:
            raise InputError(phrase("collection.camera", names=known, value=self.camera))
        if np.ndim(self.photo_sd) == 0:
            rows, names = length("photo_parameters", self.photo_parameters), self.parameters
            constant = np.arange(len(names)) >= len(names) - camera_facts(self.camera)[2]
            of_all = np.tile(np.where(constant, 0.0, self.photo_sd), (rows, 1))
            object.__setattr__(self, "photo_sd", of_all)
        check_arrays(self, parameters=len(self.parameters))

    def brief(self) -> tuple[str, Rows]:
        """Return a short summary of the collection, as shown by its `repr` and in notebooks."""
        fixed, sd = int((self.photo_sd == 0).all(axis=1).sum()), span(self.image_sd)
        return "Collection", [
            ("photos", str(phrase("brief.photos", n=len(self.photo_parameters), fixed=fixed))),
            ("points", str(phrase("brief.points", n=len(self.point_positions)))),
            ("images", str(phrase("brief.images", n=len(self.image_xy), unit="px", sd=sd))),
            ("camera", f"{self.camera}: {', '.join(self.parameters[len(POSE) :])}"),
        ]

    @cached_property
    def photo_ids(self) -> list[str]:
        """P names: the numbers of the photos, from 0."""
        return numbered(len(self.photo_parameters))

    @cached_property
    def point_ids(self) -> list[str]:
        """N names: the numbers of the points, from 0."""
        return numbered(len(self.point_positions))

    @property
    def observations(self) -> Observations[Observation]:
        """Additional observations: none."""
        return Observations()

    @property
    def image_unit(self) -> str:
        """Unit of image coordinates: `px`."""
        return "px"

    @property
    def geographic(self) -> bool:
        """Whether positions are longitude, latitude and height: always False."""
        return False

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the k parameters of a photo."""
        return parameters_of(self.camera)[0]

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the k parameters: `rad`, `px`; empty for numbers and for lengths in object space."""
        return parameters_of(self.camera)[1]

    @property
    def formula(self) -> str:
        """Formula of the image of P, a point in the axes of the photo."""
        return camera_facts(self.camera)[0]

    def replace(self, **changes: Any) -> Self:
        """Return the collection with some arrays replaced."""
        return replace(self, **changes)

    def _observables(self) -> Observables:
        from photogram.results.grouping import Observables

        photos, width = self.photo_parameters.shape
        return Observables(
            given=self,
            photo_cameras=np.arange(photos),
            camera_names=self.photo_ids,
            strips=lambda: [np.arange(photos)],
            point_classes=np.where(np.isfinite(self.point_sd).any(axis=1), "control", "pass"),
            # Weights of camera parameters, which are separate in the core, do not change.
            photo_observed=(self.photo_sd > 0) & np.isfinite(self.photo_sd) & (np.arange(width) < len(POSE)),
            stations=("rotations",) * 3 + ("translations",) * 3 + ("cameras",) * (width - len(POSE)),
            commons=0,
        )

    def _scaled(self, grouping: Grouping, factors: Floats) -> Collection:
        roots = np.sqrt(factors)
        return self.replace(
            image_sd=self.image_sd * grouping.factors(roots, grouping.images),
            point_sd=self.point_sd * grouping.factors(roots, grouping.points),
            photo_sd=self.photo_sd * grouping.factors(roots, grouping.photos),
        )

    def _adjust(self, **options: Any) -> AdjustedCollection:
        from photogram.collection.adjust import adjust

        return adjust(self, **options)

    def _adjust_again(self, options: CoreOptions, **more: Any) -> AdjustedCollection:
        from photogram.collection.adjust import adjusted

        return adjusted(self, options, **more)

    def _snoop(self, options: SnoopOptions, **changes: Any) -> Snooped:
        from photogram.collection.snooping import snoop_collection

        return snoop_collection(self, options, **changes)

    def _check(self, threads: int | None) -> Diagnosis:
        from photogram.collection.snooping import check

        return check(self, threads)

    def computed_xy(self) -> Floats:
        """Compute (m, 2) image coordinates from the present parameters and positions."""
        return _photocore.collection_images(
            self.camera, self.photo_parameters[self.image_photos], self.point_positions[self.image_points]
        )

    def cost(self) -> float:
        """Return half the weighted sum of squared residuals, as in "Bundle Adjustment in the Large"."""
        return 0.5 * float((((self.image_xy - self.computed_xy()) / self.image_sd) ** 2).sum())
