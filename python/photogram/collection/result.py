"""Result of the adjustment of a collection, its core network, and trials for tests."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram import _photocore
from photogram.adjustment.remarks import too_coarse
from photogram.arguments.types import Floats, Indices
from photogram.collection.parameters import POSE
from photogram.errors import AdjustmentError, InputError, RankError, failure_of_core
from photogram.lazy_dataclasses import dataclass, replace
from photogram.memory import available_memory
from photogram.network.core_arrays import CoreOptions
from photogram.results.covariance import Adjusted, Failure, Things
from photogram.results.network import AdjustedNetwork
from photogram.results.network_trial import KINDS, NamedSuspects, NetworkTrial
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from photogram.collection import Collection
    from photogram.io.writing import Content
    from photogram.results.parts import Terms
    from photogram.results.reliability import ReliabilitySummary
    from photogram.show.page import Document
    from photogram.statistics.findings import Findings


ROUGH, EXACT = 1e-7, 1e-12  # Relative decrease of the sum of squares that ends a round; EXACT with full R


def collection_network(given: Collection, options: CoreOptions) -> _photocore.CollectionNetwork:
    return _photocore.collection_network(
        given.camera,
        given.photo_parameters,
        given.photo_sd,
        given.point_positions,
        given.point_sd,
        given.image_photos,
        given.image_points,
        given.image_xy,
        given.image_sd,
        decrease=options.limit,
        max_iterations=options.max_iterations,
        covariance=options.covariance,
        loss=options.loss,
        ordering=options.ordering,
        memory=available_memory(),
    )


def named(
    kind: str,
    message: str,
    combinations: list[_photocore.CombinationRow],
    points: list[int],
    _seconds: list[float],
) -> AdjustmentError | InputError:
    """Convert a core failure to an error; photos and points are numbered from 0."""
    if kind == "undetermined points":
        names = [str(point) for point in points]
        text = phrase("collection.undetermined-points", n=len(names), names=names)
        return RankError(text, [], names)
    if kind == "undetermined photos":
        names = [str(photo) for photo in sorted({photo for each in combinations for photo in each[0]})]
        text = phrase("collection.undetermined-photos", n=len(combinations), names=names)
        return RankError(text, names, [])
    if kind == "coarse":
        return too_coarse([str(photo) for photo in combinations[0][0]], [str(point) for point in points])
    if kind == "left out":
        return InputError(phrase("collection.point-excluded", point=points[0]))
    return failure_of_core(kind, message)


def collection_trial(
    collection: Collection,
    options: CoreOptions,
    state: _photocore.BlockState | None,
    *,
    threads: int = 0,
    parts: bool = True,
) -> NetworkTrial:
    network = collection_network(collection, replace(options, covariance=True, loss=None))
    core = network.trial(state, threads=threads)
    return NetworkTrial(
        core=core,
        suspects=_Named(collection, core.suspects),
        supported=np.asarray(np.isfinite(collection.photo_sd).all(axis=1)),
        rough=ROUGH,
        exact=EXACT,
        control="components" if parts else "whole",
    )


class _Named(NamedSuspects):
    def __init__(self, collection: Collection, core: _photocore.NetworkSuspects) -> None:
        components = ("XYZ", POSE[3:], POSE[:3])
        super().__init__(collection, core, components=components, lengths=("",) * 3)
        self.parameters = collection.parameters[len(POSE) :]

    def other_name(self, kind: int, subject: int) -> Phrase:
        return Phrase(f"named.photo_{KINDS[kind]}", {"photo": str(self.given.photo_ids[subject])})

    def other_row(self, kind: int, subject: int, component: int) -> tuple[str, str]:
        """Return the name of a camera parameter, without a unit."""
        return self.parameters[component], ""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class AdjustedCollection(AdjustedNetwork):
    """Adjusted collection, with the arrays of every `AdjustedNetwork`.

    The k unknowns of a photo are its parameters in the collection. Types of covariances are `photo` (all
    parameters), `pose` and `camera` (its first six, the others) and `point`. Photos and points are identified
    by number: `("photo", 3)`, `("point", [7, 8])`. Cofactors refer to the datum defined by observations and
    weights; otherwise to the fixed parameters in `datum`.

    Attributes
    ----------
    collection
        The collection before the adjustment.
    weighted_sum_of_squares
        Of images and weighted unknowns, with weights modified by the loss.
    photo_parameters
        (P, k) adjusted parameters; see :class:`Collection`.
    photo_images
        (P,) number of image points of each photo.
    point_rays_behind
        (n,) number of image observations with the point behind the camera.
    datum
        Photos and parameters that were fixed to define a datum of the cofactors.
    """

    collection: Collection
    weighted_sum_of_squares: float
    photo_parameters: Floats
    photo_images: Indices
    point_rays_behind: Indices
    datum: list[tuple[int, str]]

    @property
    def known_weight(self) -> bool:
        """False: the standard deviations of collections are unknown."""
        return False

    def _findings(self) -> Findings:
        from photogram.collection.findings import collection_findings

        return collection_findings(self)

    def _table(self, what: str) -> pd.DataFrame:
        from photogram.results.tables import table_frame

        return table_frame(self, what)

    def _files(self) -> Mapping[str, Content]:
        from photogram.collection.result_files import collection_files

        return collection_files(self)

    def document(self) -> Document:
        """Return the document: verdict, sections, tables."""
        from photogram.collection.document import collection_document

        return collection_document(self)

    @cached_property
    def reliability_summary(self) -> ReliabilitySummary | None:
        """The reliability summary of reports; see `AdjustedNetwork`."""
        from photogram.results.evaluation import reliability_summary

        return reliability_summary(self)

    @property
    def given(self) -> Collection:
        """The collection before the adjustment."""
        return self.collection

    @property
    def sum_and_freedom(self) -> tuple[float, float]:
        """Weighted sum of squares of all observations, and its degrees of freedom."""
        return self.weighted_sum_of_squares, self.degrees_of_freedom

    @property
    def cost(self) -> float:
        """Half the objective function at the adjusted values."""
        last = self.iterations[-1].weighted_sum_of_squares if self.iterations else None
        return 0.5 * (self.initial_weighted_sum_of_squares if last is None else last)

    @property
    def photo_given_sd(self) -> Floats:
        """(P, k) standard deviations of observed parameters: infinite is free, zero is fixed."""
        return self.collection.photo_sd

    @property
    def photo_residuals(self) -> Floats:
        """(P, k) given minus adjusted parameters; 0 if fixed, NaN if free."""
        residuals = self.collection.photo_parameters - self.photo_parameters
        return np.where(np.isfinite(self.photo_given_sd), residuals, np.nan)

    def _adjusted(self) -> Adjusted:
        names, photos, points = self.collection.parameters, self.given.photo_ids, self.given.point_ids
        values, sd, count = self.photo_parameters, self.photo_sd, len(photos)
        pose, camera = slice(0, len(POSE)), slice(len(POSE), None)
        places = [("X", "Y", "Z")] * len(points)
        return Adjusted(
            things={
                "photo": Things(photos, [names] * count, values, sd, ("photo", "camera")),
                "pose": Things(photos, [names[pose]] * count, values[:, pose], sd[:, pose], ("photo",)),
                "camera": Things(photos, [names[camera]] * count, values[:, camera], sd[:, camera]),
                "point": Things(points, places, self.point_positions, self.point_sd),
            },
            numbered=True,
        )

    def _refused(self, error: Failure) -> Exception:
        return named(*error.args)

    def _core_network(self) -> _photocore.CollectionNetwork:
        return collection_network(self.collection, self.options)

    @cached_property
    def _terms(self) -> Terms:
        from photogram.collection.document import collection_terms

        return collection_terms(self)

    def _plot_data(self) -> Any:
        from photogram.collection.picture_data import PicturedCollection

        return PicturedCollection(self)

    def _trial(self) -> NetworkTrial:
        return collection_trial(self.collection, self.options, self.state)

    def adjusted(self) -> Collection:
        """Return the collection at adjusted values; excluded points do not change."""
        positions = np.where(
            self.used_points[:, np.newaxis], self.point_positions, self.collection.point_positions
        )
        return self.collection.replace(photo_parameters=self.photo_parameters, point_positions=positions)
