"""Certificates of film cameras in files of their own that a project names."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.film.datum import with_datum
from photogram.formats.plain.tables import Tables
from photogram.io.delimited import ColumnTable
from photogram.messages import Message, listed
from photogram.network.cameras import Camera

if TYPE_CHECKING:
    from photogram.film import Certificate

__all__ = ["certificate_marks", "certified", "definite", "read_certificates"]

_MODELS = ("brown_forward", "brown")


def read_certificates(tables: Tables) -> dict[str, Certificate]:
    """Return the certificates that photos, or the section of films, name, by the names of cameras.

    Raises
    ------
    InputError
        A file that cannot be read, two certificates of one camera, one that is of no camera.
    """
    given = tables.settings.certificate
    table = tables.read("photos")
    if table is None or (given is None and "certificate" not in table):
        return {}
    cameras = _cameras_of_films(tables, table)
    texts = table.texts("certificate")
    found: dict[str, Path] = {}
    for row, camera in cameras.items():
        if not texts[row]:
            continue
        path = table.path.parent / texts[row]
        if found.setdefault(camera, path) != path:
            raise table.error(
                row,
                f"column certificate: the camera {camera} has another certificate, {found[camera].name}: a"
                " camera of another year is a camera by itself",
            )
    certificates = {camera: _read(path, camera) for camera, path in found.items()}
    if given is not None:
        rest = [name for name in dict.fromkeys(cameras.values()) if name not in found]
        certificates |= _of_settings(tables, given, rest)
    for camera, own in certificates.items():
        _tell(tables, camera, own)
    return certificates


def _cameras_of_films(tables: Tables, table: ColumnTable) -> dict[int, str]:
    """Return the camera of each row that is of a film."""
    films, names = table.texts("film"), table.texts("camera")
    cameras = tables.read("cameras")
    only = "" if cameras is None or cameras.count != 1 else cameras.texts("camera")[0]
    return {row: names[row] or only for row, film in enumerate(films) if film}


def _read(path: Path, camera: str) -> Certificate:
    from photogram.film import Certificate

    return Certificate.read(path, None if path.suffix.lower() == ".toml" else camera)


def _of_settings(tables: Tables, path: Path, cameras: list[str]) -> dict[str, Certificate]:
    """Return the certificate of a project: of the only camera, or of that which has its name."""
    if path.suffix.lower() != ".toml":
        return {camera: _read(path, camera) for camera in cameras}
    own = _read(path, "")
    named = [camera for camera in cameras if camera == own.name]
    if not named and len(cameras) != 1:
        raise InputError(
            f"[film] certificate is of the camera {own.name}, and those of films are"
            f" {listed(cameras) or 'none'}: give the column certificate of photos",
            file=tables.settings.path,
        )
    return dict.fromkeys(named or cameras, own)


def _tell(tables: Tables, camera: str, own: Certificate) -> None:
    """Say what the certificate of a camera leaves to be known."""
    day = "without a date" if own.day is None else f"of {own.day}"
    said = [f"its certificate is {day}: {own.verdict.headline}", *own.told()]
    tables.messages.extend(Message(f"camera {camera}: {each}", own.file) for each in said)


def certified(tables: Tables, name: str, model: str, own: Certificate) -> Camera:
    """Return the camera of a certificate.

    Raises
    ------
    InputError
        Another model than certificates are of, no focal length, a table that determines no lens.
    """
    if (chosen := model or _MODELS[0]) not in _MODELS:
        raise InputError(
            f"the camera {name} has the model {chosen}: a certificate is of {', '.join(_MODELS)}",
            file=own.file,
        )
    if tables.settings.image != "mm":
        raise InputError(f"the camera {name} has a certificate: [units] image must be mm", file=own.file)
    return own.camera(chosen).replace(name=name)  # type: ignore[arg-type]


def certificate_marks(
    tables: Tables, camera: str, own: Certificate
) -> tuple[dict[str, Floats], dict[str, Floats], Floats | None]:
    """Return places of marks by name, and standard deviations or, of correlated ones, the covariance.

    Raises
    ------
    InputError
        There are neither coordinates nor distances, or a covariance that is none.
    """
    marks = own.fiducials()
    places = dict(zip(marks.names, marks.xy, strict=True))
    if not (marks.covariance - np.diag(np.diag(marks.covariance))).any():
        sd = np.sqrt(np.diag(marks.covariance)).reshape(-1, 2)
        return places, dict(zip(marks.names, sd, strict=True)), None
    return places, {}, definite(tables, camera, marks.xy, marks.covariance, own.file)


def definite(tables: Tables, camera: str, xy: Floats, covariance: Floats, file: Path | None) -> Floats:
    """Return the covariance of all marks of a camera, with the datum that distances have not.

    Raises
    ------
    InputError
        It is singular otherwise.
    """
    try:
        found, free = with_datum(xy, covariance)
    except InputError as error:
        raise InputError(f"camera {camera}: {error.message}", file=file) from None
    if free:
        tables.messages.append(
            Message(
                f"camera {camera}: its marks are known by distances, whose covariance leaves {free} movements"
                " open: the frame is that of the marks themselves; films take shift and rotation, and the"
                " principal point is known as it is said",
                file,
            )
        )
    return found
