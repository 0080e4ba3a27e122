"""The options of reading a project."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from photogram.arguments.fields import Checked, option
from photogram.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from photogram.formats.columns import Columns

REQUIRED = {
    "photos_crs": ("photos_dir",),
    "mrk_antenna": ("photos_dir", "gnss"),
    "gnss_crs": ("gnss",),
    "gnss_antenna": ("gnss",),
    "jigsaw": ("cubes",),
}
"""Options that require one of others."""


def deviations(texts: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Return standard deviations by table from `images=0.5` or `control=0.02,0.02,0.03`."""
    from photogram.errors import InputError
    from photogram.formats.plain.schema import WITH_SD
    from photogram.words import phrase

    found = {}
    for each in texts:
        name, equals, numbers = each.partition("=")
        name = name.strip()
        if name not in WITH_SD:
            raise InputError(phrase("plain.sd-option", text=each, names=list(WITH_SD)))
        counts = WITH_SD[name]
        try:
            values = tuple(float(number) for number in numbers.split(","))
        except ValueError:
            values = ()
        if not equals or len(values) not in counts or not all(0 <= value < math.inf for value in values):
            raise InputError(phrase("plain.sd-numbers", text=each, counts=list(counts)))
        if name == "images" and not all(values):
            raise InputError(phrase("plain.sd-of-images", text=each))
        found[name] = values
    return found


def _antenna(text: str) -> tuple[float, float, float, float]:
    """Return antenna position and standard deviation of `X,Y,Z` or `X,Y,Z,SD`."""
    try:
        x, y, z, sd = map(float, (text if text.count(",") == 3 else f"{text},0").split(","))
    except ValueError:
        sd = x = y = z = math.nan
    if not (math.isfinite(x + y + z) and sd >= 0):
        raise ValueError("3 or 4 numbers in metres, such as 0.0,0.08,0.1,0.01")
    return x, y, z, sd


@dataclass(frozen=True, kw_only=True)
class ReadOptions(Checked):
    """Options of :func:`photogram.formats.read` and of all commands that read a project.

    They complete the contents of files.

    Attributes
    ----------
    file_format
        Name of the format; None: detected.
    control
        Table of control and check points.
    control_crs
        System of `control`; None: the system of the project.
    columns
        Meaning of the columns of a control table: `point=Name,x=Rechtswert`, or `PNEZD` without a header.
    roles
        Roles of control points by words of the table: `KP=check,PP=control,X=off`.
    images
        Table of further image observations, in pixels.
    names
        Table of other names of points.
    cameras
        Camera table (as in the plain project) for formats without cameras; None: cameras of the files.
    sd
        Standard deviations by table for files without them: one number or three.
    settings
        Settings that replace settings of a plain project: `section.key=value`.
    photos_dir
        Folder of photographs with positions, which become observations; None: as in the project.
    photos_crs
        System of positions if their source does not name it or the reference of its heights (EXIF).
    gnss
        A file with positions of photos, which become observations. A table of photo, x, y, z. Or a
        geolocation file of Pix4D, a reference of Metashape, `geo.txt` of OpenDroneMap, an .MRK file of DJI,
        or events of RTKLIB (`*_events.pos`).
    gnss_crs
        System of the positions in `gnss` if the file does not name it; None: the frame of the project.
    gnss_antenna
        x, y, z of the antenna in the axes of the photo (right, up, back towards the viewer) from the
        projection centre, and one standard deviation of them (0: fixed; `inf`: free), metres; None: positions
        in `gnss` are projection centres.
    mrk_antenna
        Whether positions of .MRK files are antenna positions.
    pixel_origin
        `corner` or `center` of the first pixel is 0, 0 in tables of pixels; None: as defined by the format.
    model
        Index of the model in a file with several, from 0; None: the largest.
    angles
        `deg`, `gon` or `rad`, for files that do not specify the unit of their angles.
    keep_repeated
        Whether means replace repeated image observations; otherwise the first one is used.
    cubes
        The list of cubes or ISDs of a control network.
    jigsaw
        Adjustment settings of a control network by names of jigsaw, or the path of a file with them.

    Examples
    --------
    >>> from photogram.formats import ReadOptions
    >>> ReadOptions(gnss="geo.txt", gnss_antenna=(0.0, 0.08, 0.1, 0.01)).gnss.name
    'geo.txt'
    """

    file_format: str | None = option(None, name="--format")
    control: Path | None = None
    control_crs: str | None = None
    columns: str | None = None
    roles: str | None = None
    images: Path | None = None
    names: Path | None = None
    cameras: Path | None = option(None, name="--camera")
    sd: Mapping[str, tuple[float, ...]] = option(dict, kind=list[str], parse=deviations)
    settings: Sequence[str] = option((), kind=list[str], name="--set")
    photos_dir: Path | None = None
    photos_crs: str | None = None
    gnss: Path | None = None
    gnss_crs: str | None = None
    gnss_antenna: tuple[float, float, float, float] | None = option(None, kind=str, parse=_antenna)
    mrk_antenna: bool = False
    pixel_origin: Literal["corner", "center"] | None = None
    model: int | None = option(None, 0, kind=int)
    angles: Literal["deg", "gon", "rad"] | None = None
    keep_repeated: bool = False
    cubes: Path | None = None
    jigsaw: str | None = None

    def __post_init__(self) -> None:
        from photogram.errors import InputError
        from photogram.words import phrase

        super().__post_init__()
        for name, others in REQUIRED.items():
            if getattr(self, name) and not any(getattr(self, other) for other in others):
                message = phrase("usage.requires", options=list(others))
                raise InputError(phrase("error.at", what=name, message=message))
        if self.columns or self.roles:
            self.control_columns  # noqa: B018  # rejects unknown columns and roles

    @property
    def control_columns(self) -> Columns:
        """The meaning of the columns of a control table."""
        from photogram.formats.columns import columns_given

        return columns_given(self.columns, self.roles)
