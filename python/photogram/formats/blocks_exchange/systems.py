"""Systems of coordinates of a BlocksExchange file: all is carried into one cartesian frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.plain.tables import covariances_of
from photogram.formats.project import Frame
from photogram.formats.xml_stream import Element
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.observations import Control, Observation, Position
from photogram.words import Phrase, option_sd, phrase

LOCAL = "local"


@dataclass
class PhotoRecord:
    """A photo as a file has it: its pose in the axes of the house, and the ids of its systems."""

    path: str
    group: int
    centre: Floats
    rotation: Floats
    srs: str
    gnss: Floats | None
    gnss_srs: str
    place: Element


@dataclass
class PointRecord:
    """A point as a file has it; ties have no standard deviations."""

    name: str
    place: Element
    position: Floats
    srs: str
    sd: Floats | None = None
    check: bool = False


class Systems:
    """Positions in the systems of a file, carried into one cartesian frame."""

    def __init__(
        self, systems: Mapping[str, str], srs: str, photos: list[PhotoRecord], messages: list[Message]
    ) -> None:
        self.systems, self.main, self.messages = systems, srs, messages
        self.lacks: list[Phrase] = []
        definition = self.definition(srs or (photos[0].srs if photos else ""))
        self.frame = Frame()
        if definition != LOCAL:
            from photogram.formats.crs import amid, enu_origin

            own = enu_origin(definition)
            if own is not None:
                self.frame = Frame("topocentric", "EPSG:4979", own)
            else:
                centres = np.array([each.centre for each in photos])
                known = centres[np.isfinite(centres).all(axis=1)]
                if not len(known):
                    raise InputError(
                        phrase("blocks-exchange.centres", crs=definition), file=photos[0].place.file
                    )
                self.frame = Frame("topocentric", "EPSG:4979", amid(definition, known))
                messages.append(Message(phrase("format.frame", crs=definition, frame=self.frame.phrase)))
        self.same = definition

    def definition(self, srs: str) -> str:
        """Return the system of an id: what PROJ or this reader takes, or `local`."""
        text = self.systems.get(srs or self.main, "").strip()
        return LOCAL if not text or text.upper().startswith("LOCAL_CS") else text

    def _carried(self, srs: str, xyz: Floats, covariances: Floats) -> tuple[Floats, Floats]:
        definition = self.definition(srs)
        if definition == self.same and (definition == LOCAL or definition.upper().startswith("ENU:")):
            return xyz, covariances
        if LOCAL in (definition, self.same):
            raise InputError(phrase("blocks-exchange.systems", crs=definition, frame=self.same))
        from photogram.formats.crs import to_frame

        found, turned, remarks = to_frame(definition, xyz, covariances, self.frame)
        known = {message.phrase for message in self.messages}
        self.messages += [Message(remark) for remark in remarks if remark not in known]
        return found, turned

    def poses(self, photos: list[PhotoRecord], centres: Floats, matrices: Floats) -> tuple[Floats, Floats]:
        """Return centres and attitudes, which refer to the local axes of their systems, in the frame."""
        centres, matrices = centres.copy(), matrices.copy()
        for srs in dict.fromkeys(each.srs for each in photos):
            definition = self.definition(srs)
            own = np.array([each.srs == srs for each in photos]) & np.isfinite(centres).all(axis=1)
            if not own.any() or definition == LOCAL or definition.upper().startswith("ENU:"):
                continue
            from photogram.formats.crs import turn_to_frame

            matrices[own] = turn_to_frame(definition, centres[own], self.frame) @ matrices[own]
            centres[own] = self._carried(srs, centres[own], np.zeros((int(own.sum()), 3, 3)))[0]
        return centres, matrices

    def points(
        self, points: list[PointRecord], names: list[str]
    ) -> tuple[Floats, Floats, Floats, Floats, list[Observation]]:
        """Return starts, known positions and their standard deviations, and control with full covariances.

        The second standard deviations are those of check points.
        """
        count = len(points)
        starts, sd = np.full((count, 3), np.nan), np.full((count, 3), np.inf)
        positions, check_sd = starts.copy(), starts.copy()
        observed: list[Observation] = []
        for srs in dict.fromkeys(each.srs for each in points):
            rows = [row for row, each in enumerate(points) if each.srs == srs]
            given = np.array([points[row].position for row in rows])
            whole = np.isfinite(given).all(axis=1)
            local = self.definition(srs) == self.same and self.frame.kind == "cartesian"
            for k, row in enumerate(rows):
                if not local and points[row].sd is not None and not whole[k]:
                    raise points[row].place.error(phrase("blocks-exchange.part"))
            deviation = np.array([np.zeros(3) if points[row].sd is None else points[row].sd for row in rows])
            found, turned = given.copy(), covariances_of(np.nan_to_num(deviation))
            if whole.any():
                found[whole], turned[whole] = self._carried(srs, given[whole], turned[whole])
            for k, row in enumerate(rows):
                each = points[row]
                starts[row] = found[k]
                if each.sd is None:
                    continue
                positions[row] = found[k]
                if each.check:
                    variances = np.diag(turned[k])
                    check_sd[row] = np.where(variances > 0, np.sqrt(variances), np.nan)
                    continue
                if (turned[k] == np.diag(np.diag(turned[k]))).all():
                    sd[row] = np.where(np.isnan(found[k]), np.inf, np.sqrt(np.diag(turned[k])))
                else:
                    positions[row] = np.nan
                    observed.append(Control(names[row], found[k], covariance=(turned[k] + turned[k].T) / 2))
        return starts, positions, sd, check_sd, observed

    def gnss(self, photos: list[PhotoRecord], names: list[str], wishes: Wishes) -> list[Observation]:
        """Return positions that photos were given as observations, where there are standard deviations."""
        rows = [row for row, each in enumerate(photos) if each.gnss is not None]
        if not rows:
            return []
        if "gnss" not in wishes.sd:
            self.lacks.append(Phrase("read.gnss", {"number": len(rows), "option": option_sd("gnss")}))
            return []
        sd = np.broadcast_to(wishes.sd["gnss"], 3)
        found: list[Observation] = []
        lost = []
        for row in rows:
            position = photos[row].gnss
            assert position is not None
            try:
                own, turned = self._carried(
                    photos[row].gnss_srs, position[np.newaxis], np.diag(sd**2)[np.newaxis]
                )
            except InputError:
                lost.append(names[row])
                continue
            found.append(Position(names[row], own[0], covariance=(turned[0] + turned[0].T) / 2))
        if lost:
            self.messages.append(Message(phrase("blocks-exchange.gnss", n=len(lost), names=lost)))
        return found
