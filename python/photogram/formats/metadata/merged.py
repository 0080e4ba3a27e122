"""What a folder of photographs says of each photo, by precedence: position and standard deviations apart."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from photogram.formats.metadata.record import FIXED, Said
from photogram.formats.metadata.search import found_in
from photogram.lazy_dataclasses import dataclass
from photogram.messages import Message, counted, listed
from photogram.show.sections import Section
from photogram.show.summary import Brief

__all__ = [
    "WITHOUT",
    "Metadata",
    "PhotoRecord",
    "counts",
    "metadata_of",
    "read_metadata",
    "remarks_on",
    "told",
]

WITHOUT = "without"


@dataclass(frozen=True)
class PhotoRecord:
    """What is known of one photo.

    Attributes
    ----------
    photo
        Its path below the folder.
    flight
        Its folder; with several .MRK files in a folder also what its own is called.
    position
        What says where it was taken: position, system, flag, angles; None without a position.
    deviations
        What says how good that is, with the standard deviations of east, north and height in metres; None
        without usable ones. It may be another source than that of the position.
    """

    photo: str
    flight: str
    position: Said | None
    deviations: Said | None

    @property
    def rtk(self) -> bool:
        """Whether it is of a receiver with corrections in real time, and as good as that says itself."""
        source = self.deviations or self.position
        return source is not None and source.rtk


@dataclass(frozen=True, repr=False)
class Metadata(Brief):
    """What a folder of photographs says of where its photos were taken.

    Attributes
    ----------
    directory
        The folder, or the file with positions.
    photos
        By their paths below the folder, or their names in the file.
    tables, pictures
        Files that were read: tables and .MRK files, and pictures, of these the heads.
    messages
        Remarks.
    """

    directory: Path
    photos: Mapping[str, PhotoRecord]
    tables: tuple[Path, ...]
    pictures: tuple[Path, ...]
    messages: tuple[Message, ...]

    def sources(self) -> dict[str, int]:
        """Return how many positions have standard deviations of each source, and how many have none."""
        located = [each for each in self.photos.values() if each.position is not None]
        return counts(each.deviations for each in located)

    def sections(self) -> list[Section]:
        """Return what was read as titled sections: for people."""
        records = list(self.photos.values())
        located = [each for each in records if each.position is not None]
        flights: dict[str, list[PhotoRecord]] = {}
        for each in located:
            flights.setdefault(each.flight, []).append(each)
        read = f"{self.directory}: {counted(len(self.pictures), 'picture')}"
        read += f", {counted(len(self.tables), 'table')}, {counted(len(records), 'photo')}"
        return [
            ("Read", [read]),
            ("Positions", [told(counts(each.position for each in records))]),
            ("Standard deviations of positions", [told(self.sources())]),
            (
                "Flights",
                [
                    f"{name}: {counted(len(own), 'photo')}, {sum(each.rtk for each in own)} of RTK"
                    for name, own in flights.items()
                ],
            ),
            ("Remarks", [str(each) for each in (*self.messages, *remarks_on(located))]),
        ]


def counts(sources: Iterable[Said | None]) -> dict[str, int]:
    """Return how often each source is there; :data:`WITHOUT` for none."""
    return dict(Counter(WITHOUT if each is None else each.source for each in sources))


def told(sources: Mapping[str, int]) -> str:
    """Return counts of sources in words: 118 of .MRK, 2 of XMP, 1 without."""
    rest = [f"{sources[WITHOUT]} {WITHOUT}"] if WITHOUT in sources else []
    return (
        ", ".join([f"{count} of {name}" for name, count in sources.items() if name != WITHOUT] + rest)
        or "none"
    )


def read_metadata(directory: str | os.PathLike[str], *, mrk_antenna: bool = False) -> Metadata:
    """Read where photos were taken, and how well, from what their files already say.

    Heads of pictures (EXIF, XMP of DJI and Pix4D), `*_Timestamp.MRK`, `geo.txt`, references of Metashape and
    geolocations of Pix4D, in a folder and those in it. geo.txt and references count before .MRK, before XMP,
    before EXIF, for positions and standard deviations apart.

    Parameters
    ----------
    directory
        The folder.
    mrk_antenna
        Whether positions of .MRK files are those of the antenna: then their offsets carry them to the camera.
        As DJI writes them, they are those of the camera.

    Returns
    -------
    Positions in the systems of their sources; standard deviations in metres, always east, north, height.

    Raises
    ------
    InputError
        Nothing in the folder says anything, a file is at fault, pillow is not installed
        (`pip install 'photogram[photos]'`).

    Notes
    -----
    Section 6 of the specification of accuracy statements.
    """
    path = Path(directory)
    found = found_in(path, antenna=mrk_antenna)
    return metadata_of(path, found.said, found.flights, found.tables, found.pictures, found.messages)


def metadata_of(
    path: Path,
    said: Mapping[str, Sequence[Said]],
    flights: Mapping[str, str],
    tables: Sequence[Path],
    pictures: Sequence[Path],
    messages: Sequence[Message],
) -> Metadata:
    """Return the record of each photo by its sources, of which the first that has a value counts."""
    photos, without_height = {}, []
    for key, sources in said.items():
        position = next((each for each in sources if each.is_located), None)
        if position is None and any(each.position is not None for each in sources):
            without_height.append(key)
        deviations = next((each for each in sources if each.sd is not None), None)
        photos[key] = PhotoRecord(key, flights[key], position, deviations)
    remarks = list(messages)
    if without_height:
        remarks.append(
            Message(f"positions without a height are not taken: {listed(without_height, 3)}", path)
        )
    return Metadata(path, photos, tuple(tables), tuple(pictures), tuple(remarks))


def remarks_on(records: Iterable[PhotoRecord]) -> list[Message]:
    """Return what is to be said of the solutions and accuracies of some photos."""
    fixes: dict[str, list[str]] = {}
    remarks: dict[str, int] = {}
    for each in records:
        source = each.deviations or each.position
        if source is not None and source.remark:
            remarks[source.remark] = remarks.get(source.remark, 0) + 1
        said = (own.fix for own in (each.deviations, each.position) if own is not None)
        fix = next((own for own in said if own), FIXED)
        if fix != FIXED:
            fixes.setdefault(fix, []).append(each.photo)
    found = [
        Message(
            f"the solution of the receiver was {fix} for {counted(len(photos), 'photo')}: {listed(photos, 3)}"
        )
        for fix, photos in fixes.items()
    ]
    return found + [Message(f"{text} ({counted(count, 'photo')})") for text, count in remarks.items()]
