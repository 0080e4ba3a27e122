"""Coordinate systems of a BlocksExchange file, transformed into one frame."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.formats.format import Wishes
from photogram.formats.plain.tables import covariances_of
from photogram.formats.point_table import PointTable
from photogram.formats.project import Frame
from photogram.formats.xml_stream import Element
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message
from photogram.network.observations import Observation, Position
from photogram.words import Phrase, option_sd, phrase

LOCAL = "local"


@dataclass
class PhotoRecord:
    """A photo of a file: its pose (y up, z back) and the ids of its systems."""

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
    """A point of a file, with standard deviations unless it is a tie point."""

    name: str
    place: Element
    position: Floats
    srs: str
    sd: Floats | None = None
    check: bool = False


class Systems:
    """Positions in the systems of a file, transformed into one cartesian frame."""

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
        """Return the definition of an id for PROJ or this reader, or `local`."""
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
        """Transform centres and attitudes, which refer to local axes, into the frame."""
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

    def points(self, records: list[PointRecord], names: list[str]) -> PointTable:
        """Return the points, with control and check points."""
        points = PointTable(names)
        for srs in dict.fromkeys(record.srs for record in records):
            rows = [row for row, record in enumerate(records) if record.srs == srs]
            own = [records[row] for row in rows]
            xyz = np.array([record.position for record in own])
            whole = np.isfinite(xyz).all(axis=1)
            local = self.definition(srs) == self.same and self.frame.kind == "cartesian"
            for record, complete in zip(own, whole, strict=True):
                if not local and record.sd is not None and not complete:
                    raise record.place.error(phrase("blocks-exchange.part"))
            sd = np.array([np.zeros(3) if record.sd is None else record.sd for record in own])
            covariances = covariances_of(np.nan_to_num(sd))
            if whole.any():
                xyz[whole], covariances[whole] = self._carried(srs, xyz[whole], covariances[whole])
            for row, record, position, covariance in zip(rows, own, xyz, covariances, strict=True):
                if record.sd is None:
                    points.starts[row] = position
                elif record.check:
                    points.check(row, position, np.diag(covariance))
                else:
                    points.control(row, position, covariance)
        return points

    def gnss(self, photos: list[PhotoRecord], names: list[str], wishes: Wishes) -> list[Observation]:
        """Return photo positions as observations, if they have standard deviations."""
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
