"""Transformation of table coordinates of other systems into the frame."""

from __future__ import annotations

import math

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError, message_of
from photogram.formats.columns import is_geographic
from photogram.formats.plain.settings import Settings
from photogram.formats.project import Frame
from photogram.io.column_table import ColumnTable
from photogram.messages import Message
from photogram.words import phrase


class Transform:
    """Transformation of table coordinates into the frame, in internal units."""

    def __init__(self, settings: Settings, messages: list[Message]) -> None:
        self.settings, self._messages = settings, messages
        self.frame = settings.frame

    def positions(
        self, name: str, values: Floats, covariances: Floats | None, table: ColumnTable
    ) -> tuple[Floats, Floats]:
        """Return (n, 3) positions in the frame, and (n, 3, 3) covariances, m2."""
        own = np.zeros((len(values), 3, 3)) if covariances is None else covariances
        crs = self.settings.crs.get(name, "")
        if not crs:
            if self.frame.kind != "geographic" and is_geographic(table):
                raise table.head.error(phrase("plain.degrees"))
            if self.frame.kind == "geographic":
                return np.column_stack(
                    [np.radians(values[:, 0]), np.radians(values[:, 1]), values[:, 2]]
                ), own
            return values, own
        from photogram.formats.crs import to_frame

        if self.settings.length != "m":
            raise InputError(phrase("plain.crs-unit", unit=self.settings.length), file=self.settings.path)
        partly = np.isnan(values).any(axis=1) & ~np.isnan(values).all(axis=1)
        if partly.any():
            row = int(np.flatnonzero(partly)[0])
            raise table.error(row, phrase("plain.partial-position", crs=crs))
        known = ~np.isnan(values).any(axis=1)
        if not known.any():
            return values, own
        try:
            self._settle(crs, values[known])
            found, turned, remarks = to_frame(crs, values[known], own[known], self.frame)
        except InputError as error:
            if error.file:
                raise
            raise table.head.error(phrase("plain.crs", message=message_of(error))) from None
        positions, rotated = np.full_like(values, math.nan), own.copy()
        positions[known], rotated[known] = found, turned
        self._messages += [Message(text, table.path) for text in remarks]
        return positions, rotated

    def _settle(self, crs: str, values: Floats) -> None:
        """Choose the origin of a topocentric frame: mean of the first positions."""
        from photogram.formats.crs import amid

        if self.frame.kind == "cartesian" or (self.frame.kind == "topocentric" and self.frame.origin is None):
            self.frame = Frame("topocentric", "EPSG:4979", amid(crs, values))
            self._messages.append(Message(phrase("plain.frame", crs=crs, frame=str(self.frame))))
