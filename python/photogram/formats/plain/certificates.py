"""Fiducial marks of film cameras: table and certificate files."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import ContradictionError, InputError, message_of
from photogram.film.distances import with_datum
from photogram.formats.plain.tables import Tables, columns_of
from photogram.formats.plain.unknowns import Covariances
from photogram.io.column_table import ColumnTable
from photogram.io.places import Place, at_place
from photogram.io.toml import day_of
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.films import Mark
from photogram.network.observations import Fiducial, KnownTogether, Observation
from photogram.words import Phrase, phrase

if TYPE_CHECKING:
    from photogram.film import Certificate

_MODELS = ("brown_forward", "brown")
SD_MARK = 0.002  # Default (mm) for positions in a certificate, which are printed to 0.001


def read_certificates(tables: Tables) -> dict[str, Certificate]:
    table = tables.read("photos")
    if table is None or (not tables.settings.certificates and "certificate" not in table):
        return {}
    listed = tables.rows("cameras")
    only = listed.texts("camera")[0] if listed.count == 1 else ""
    files = dict[str, Path]()
    flown = dict[str, dict[date | None, int]]()  # First row of each date of a camera
    columns = (table.texts(name) for name in ("film", "camera", "certificate", "flown"))
    for row, (film, name, file, text) in enumerate(zip(*columns, strict=True)):
        if not film:
            continue
        camera = name or only
        try:
            day = day_of(text) if text else tables.settings.flown
        except ValueError:
            raise table.cell_error(row, "flown", "error.day", value=text) from None
        flown.setdefault(camera, {}).setdefault(day, row)
        if file and files.setdefault(camera, table.path.parent / file) != table.path.parent / file:
            fields = {"camera": camera, "certificate": files[camera].name}
            raise table.cell_error(row, "certificate", "plain.other-certificate", **fields)
    from photogram.film import Certificate  # imported on demand
    from photogram.film.years import age_remark, changed_remark

    several = {
        camera: [Certificate.read(path, None if path.suffix.lower() == ".toml" else camera)]
        for camera, path in files.items()
    }
    several |= _of_settings(tables, [camera for camera in flown if camera not in files])
    certificates = {camera: _valid(table, camera, own, flown[camera]) for camera, own in several.items()}
    for camera, own in certificates.items():
        remarks: list[str | Phrase] = list(own.told())
        days = sorted(filter(None, flown[camera]))
        if not days or len(several[camera]) > 1 or own.verdict.exit_code():
            dated = phrase("plain.undated") if own.day is None else str(own.day)
            fields = {"n": len(several[camera]), "day": dated, "verdict": str(own.verdict.headline)}
            remarks.insert(0, phrase("plain.certificate", **fields))
        for day in sorted({*days[:1], *days[-1:]}):
            remarks += [age_remark(own, day), changed_remark(own, several[camera], day)]
        for message in filter(None, remarks):
            tables.remark("error.at", own.file, what=f"camera {camera}", message=message)
    return certificates


def _valid(
    table: ColumnTable, camera: str, several: Sequence[Certificate], flown: Mapping[date | None, int]
) -> Certificate:
    """Return the certificate of a camera that is valid on all of its flight dates."""
    from photogram.film.years import valid_certificate

    found: list[Certificate] = []
    for day, row in flown.items():
        try:
            found.append(valid_certificate(several, day))
        except InputError as error:
            if error.file or isinstance(error, ContradictionError):
                raise
            message = phrase("error.at", what=f"camera {camera}", message=message_of(error))
            raise table.error(row, message) from None
        if found[-1] is not found[0]:
            fields = {"camera": camera, "first": str(found[0].day), "second": str(found[-1].day)}
            raise table.error(row, phrase("plain.two-certificates", day=str(day), **fields))
    return found[0]


def _of_settings(tables: Tables, cameras: Sequence[str]) -> dict[str, list[Certificate]]:
    """Return the certificates of a project by camera: of the only camera, or by name."""
    from photogram.film import Certificate

    found: dict[str, list[Certificate]] = {}
    for path in tables.settings.certificates:
        if path.suffix.lower() != ".toml":
            for camera in cameras:
                found.setdefault(camera, []).append(Certificate.read(path, camera))
            continue
        own = Certificate.read(path)
        if own.name not in cameras and len(cameras) != 1:
            message = phrase("plain.certificate-camera", camera=own.name, names=list(cameras))
            raise InputError(message, file=tables.settings.path)
        found.setdefault(own.name if own.name in cameras else cameras[0], []).append(own)
    for camera, several in found.items():
        if len(names := {own.name for own in several}) > 1:
            message = phrase("plain.certificates-of", camera=camera, names=sorted(names))
            raise InputError(message, file=tables.settings.path)
    return found


def certified(tables: Tables, name: str, model: str, own: Certificate) -> Camera:
    if (chosen := model or _MODELS[0]) not in _MODELS:
        fields = {"camera": name, "model": chosen, "models": list(_MODELS)}
        raise InputError(phrase("plain.certificate-model", **fields), file=own.file)
    if tables.settings.image != "mm":
        raise InputError(phrase("plain.certificate-unit", camera=name), file=own.file)
    return own.camera(chosen).replace(name=name)  # type: ignore[arg-type]


def definite(tables: Tables, camera: str, xy: Floats, covariance: Floats, file: Path | None) -> Floats:
    """Return a covariance matrix of all marks of a camera with a datum."""
    with at_place(Place(file), f"camera {camera}"):
        found, free = with_datum(xy, covariance)
    if free:
        tables.remark("plain.distances-only", file, camera=camera, n=free)
    return found


@dataclass
class Marks:
    """The marks of a camera by name, and their standard deviations (mm) or joint covariance matrix."""

    camera: str
    marks: dict[str, Mark] = field(default_factory=dict)
    sd: dict[str, Floats] = field(default_factory=dict)
    covariance: Floats | None = None  # (2n, 2n) of all marks

    def add(self, name: str, xy: Floats) -> None:
        """Add a mark at a position (2,), mm."""
        self.marks[name] = Mark(f"{self.camera} {name}", xy, np.inf)

    @property
    def words(self) -> list[str]:
        """Coordinates of the marks in the table of covariances."""
        return [f"{name}.{axis}" for name in self.marks for axis in "xy"]

    def known(self, tables: Tables, read: Collection[str], covariances: Covariances) -> list[Observation]:
        """Return prior observations: of all marks together, or of each mark in `read`."""
        words, covariance = [word.lower().replace("_", " ") for word in self.words], self.covariance
        if (given := covariances.over("fiducials", self.camera, words, singular=True)) is not None:
            xy = np.array([mark.position[:2] for mark in self.marks.values()])
            covariance = definite(tables, self.camera, xy, given, tables.settings.tables["covariances"])
        if covariance is not None:
            return [KnownTogether("certificate", list(self.marks.values()), covariance=covariance)]
        return [
            KnownTogether("certificate", [mark], sd=self.sd[name])
            for name, mark in self.marks.items()
            if name in read
        ]

    def rows(self) -> Iterator[dict[str, Any]]:
        for name, mark in self.marks.items():
            sd = self.sd.get(name, np.full(2, np.nan))
            place = columns_of(("x", "y"), mark.position[:2])
            yield {"camera": self.camera, "fiducial": name, **place, **columns_of(("sd_x", "sd_y"), sd)}


def read_fiducials(
    tables: Tables, cameras: Collection[str], certificates: Mapping[str, Certificate]
) -> dict[str, Marks]:
    """Read the marks of cameras from the table and from certificates."""
    found, table = dict[str, Marks](), tables.rows("fiducials")
    xy = table.given(("x", "y"))
    sd = tables.deviations(table, "fiducials", ("sd_x", "sd_y"), SD_MARK)
    use, texts = table.flags("use"), [table.texts(name) for name in ("camera", "fiducial")]
    for row, (camera, name) in enumerate(zip(*texts, strict=True)):
        if not use[row] or camera not in cameras:
            continue
        own = found.setdefault(camera, Marks(camera))
        if name in own.marks:
            raise table.error(row, phrase("error.repeated", kind=f"fiducial of {camera}", name=name))
        own.add(name, xy[row])
        own.sd[name] = sd[row]
    for camera, certificate in certificates.items():
        if camera in found:
            file = tables.settings.tables["fiducials"]
            raise InputError(phrase("plain.marks-twice", camera=camera), file=file)
        marks, found[camera] = certificate.fiducials(), (own := Marks(camera))
        for name, place in zip(marks.names, marks.xy, strict=True):
            own.add(name, place)
        if (marks.covariance - np.diag(np.diag(marks.covariance))).any():
            own.covariance = definite(tables, camera, marks.xy, marks.covariance, certificate.file)
        else:
            own.sd |= zip(marks.names, np.sqrt(np.diag(marks.covariance)).reshape(-1, 2), strict=True)
    return found


def marks_of(
    readings: Iterable[Fiducial], together: Iterable[KnownTogether], camera_of: Mapping[str, str]
) -> dict[str, Marks]:
    """Return the marks of readings by camera name, with their priors, from the cameras of photos."""
    cameras: dict[Mark, str] = {}
    for each in readings:
        camera = camera_of[each.photo]
        if cameras.setdefault(each.mark, camera) != camera:
            raise InputError(phrase("plain.mark-of-cameras", name=each.mark.name))
    others, found = dict(cameras), dict[str, Marks]()
    for known in together:
        marks = [each for each in known.joined if isinstance(each, Mark)]
        if not marks:
            continue
        of = {cameras[mark] for mark in marks if mark in cameras}
        if len(of) != 1 or len(marks) < len(known.joined):
            raise InputError(phrase("plain.known-marks", name=known.name))
        (camera,) = of
        own, full = found.setdefault(camera, Marks(camera)), len(marks) > 1 or known.precision[0, 1] != 0
        if own.covariance is not None or (full and own.marks):
            raise InputError(phrase("plain.one-certificate", name=known.name))
        names = [mark.name.removeprefix(f"{camera} ") for mark in marks]
        own.marks |= zip(names, marks, strict=True)
        if full:
            own.covariance = known.precision
        else:
            own.sd[names[0]] = np.sqrt(np.diag(known.precision))
        others = {mark: camera for mark, camera in others.items() if mark not in marks}
    # The only prior of other marks is their own standard deviation.
    for mark, camera in others.items():
        own, sd = found.setdefault(camera, Marks(camera)), mark.deviations
        if own.covariance is not None or not (np.isfinite(sd).all() and (sd > 0).all()):
            raise InputError(phrase("plain.no-certificate", mark=mark.name, camera=camera))
        name = mark.name.removeprefix(f"{camera} ")
        own.marks[name], own.sd[name] = mark, sd
    return found
