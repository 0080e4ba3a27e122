"""PATB and BINGO: photo coordinates reduced to the principal point, y up.

PATB has an image file in micrometres, an orientation with matrices, and control with codes. BINGO has
`image.dat` in millimetres, and an orientation with lines `ORIA`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path

import numpy as np

from photogram.arguments.types import Bools, Floats, Indices
from photogram.errors import InputError
from photogram.formats.builder import BlockBuilder
from photogram.formats.cards import END, Card, cards, file_of, one_file
from photogram.formats.description import agreement
from photogram.formats.format import FORMATS
from photogram.formats.images import checked_rotation
from photogram.formats.models import attitude_matrices, complete_positions, known_cameras, known_points
from photogram.formats.names import NAMES, names_file, numbered, read_names
from photogram.formats.plain.cameras import read_cameras
from photogram.formats.plain.settings import Settings
from photogram.formats.plain.tables import Tables
from photogram.formats.plain.writing import control_table
from photogram.formats.project import Project
from photogram.formats.read_options import ReadOptions
from photogram.io.csv_text import csv_text
from photogram.io.numbers import scaled
from photogram.io.places import Place, one_word
from photogram.messages import Message
from photogram.network.attitudes import Attitudes
from photogram.network.block import Block
from photogram.network.block_checks import known_poses
from photogram.network.cameras import Camera
from photogram.network.rays import image_directions
from photogram.words import Phrase, option_sd, phrase

BETTER = 3.0  # Smallest ratio of misfits for which rotations are transposed
LEAST, MOST = 2.0, 3000.0  # Smallest and largest principal distance of cameras, millimetres
NOMINAL = 100.0
"""Principal distance in millimetres for an unknown pixel size; it does not affect the rays."""
RADIANS = {"deg": np.pi / 180, "gon": np.pi / 200, "rad": 1.0}
LARGEST = 1e4  # Largest angle, radians
SIDE = -0.02  # Largest u3 of unit directions that a perspective camera can image


class ReducedBuilder(BlockBuilder):
    """A block of such files; `names` are names of photos and points by their words."""

    def __init__(
        self, path: Path, title: str, options: ReadOptions, names: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(path, title)
        self.sd, self.unit_of_angles, self.names = options.sd, options.angles, names or {}

    def name(self, card: Card) -> str:
        """Return the name of the first word."""
        return self.names.get(card.words[0], card.words[0])

    def add_images(self, add: Callable[[str, Card], None], unit: float, *, ends_empty: bool) -> None:
        """Add the photos of the image file, each with the observations up to an end mark or empty line."""
        photo: str | None = None
        for card in cards(self.path):
            if card.ends or not card.words:
                photo = None if card.ends or ends_empty else photo
            elif photo is None:
                photo = self.name(card)
                add(photo, card)
            else:
                xy = card.numbers(1, "x y")
                x, y = (xy if unit == 1.0 else scaled(xy, unit)).tolist()
                self.image(photo, self.name(card), x, y)

    def turn(self, card: Card, first: int, default: str | None) -> Floats:
        """Return the rotation of angles in the unit of the user, or by default of the format."""
        if (unit := self.unit_of_angles or default) is None:
            raise InputError(phrase("format.angle-unit"), file=card.place.file)
        angles = card.numbers(first, "omega phi kappa") * RADIANS[unit]
        if (most := abs(angles).max()) > LARGEST:
            raise card.place.error(phrase("format.angles", most=LARGEST, unit="rad", value=float(most)))
        return np.asarray(Attitudes.of("omega_phi_kappa", [angles]).matrices[0])

    def principal_distance(self, c: float, place: Place) -> str:
        """Return the name of the camera of a principal distance in millimetres."""
        if not LEAST < abs(c) < MOST:
            raise place.error(phrase("reduced.distance", value=abs(c), low=LEAST, high=MOST))
        name = f"c {abs(c):.12g} mm"
        if name not in self.camera_rows:
            # Coordinates are in the positive plane, for which c of the model is negative.
            self.camera(Camera("perspective", {"c": -abs(c)}, name=name))
        return name

    def known_point(self, name: str, xyz: Floats, used: Bools, place: Place) -> None:
        """Add a control point with the coordinates in use, or a check point without such."""
        control = self.sd.get("control", (np.inf,))
        if used.any():
            self.control(name, np.where(used, xyz, np.nan), np.where(used, control, np.inf), place)
        else:
            sd = self.sd.get("check", control)
            self.control(name, xyz, np.where(np.isfinite(sd), sd, np.nan), place, check=True)

    def reduced_project(self, unit: str) -> Project:
        """Return the project; `unit` is the unit of the image file, for remarks."""
        if not self.image_keys:
            raise self.place.error(phrase("format.missing", what="image observations"))
        (photo, point), (x, y) = self.image_keys[0], self.image_xy[0]
        first = phrase("format.first-record", unit=unit, point=point, photo=photo, x=x, y=y)
        self.messages += [Message(first, self.path), Message(phrase("reduced.assumed"))]
        if self.controls and "control" not in self.sd:
            fields = {"number": self.controls, "option": option_sd("control")}
            self.lacks.append(Phrase("read.control", fields))
        return with_fitting_rotations(self.project())


def with_fitting_rotations(project: Project) -> Project:
    """Return a project with rotations transposed if rays then fit better."""
    block = project.block
    if not np.isfinite(block.photo_attitudes).all():
        return project
    as_read = _misfit(project)
    matrices = Attitudes.of("omega_phi_kappa", block.photo_attitudes).matrices
    turned = Attitudes(matrices.transpose(0, 2, 1)).values("omega_phi_kappa")
    other = project.replace(block=block.replace(photo_attitudes=turned))
    transposed = _misfit(other)
    limit = 0.1 * float(np.median(block.camera_scales()))
    if min(as_read, transposed) > limit:
        raise InputError(phrase("reduced.rays", as_read=as_read, transposed=transposed), file=project.path)
    if transposed * BETTER < as_read:
        remark = Message(phrase("reduced.transposed"))
        return other.replace(messages=(*project.messages, remark))
    return project


def _misfit(project: Project) -> float:
    """Return the median residual of intersections; infinite behind photos."""
    unknown = np.full_like(project.starts, np.nan)
    block = project.block.replace(point_positions=unknown, point_sd=np.inf)
    loose = project.replace(block=block, starts=unknown)
    found = agreement(loose.replace(starts=complete_positions(loose)))
    return found.median if len(found.xy) else 0.0


_Images = list[list[tuple[str, float, float]]]


def reduced_images(project: Project, digits: int | None = None) -> tuple[Floats, _Images]:
    """Return principal distances of cameras, and names and coordinates of the observations of each photo.

    Coordinates are millimetres from the principal point, y up, of a camera without distortion. Observations
    that a perspective camera cannot have are omitted.
    """
    block, (cameras, which) = project.block, known_cameras(project.block)
    distances = np.array(
        [
            each.scale if each.unit == "mm" else NOMINAL if pixel is None else each.scale * pixel
            for each, pixel in zip_longest(cameras, project.pixel_mm)
        ]
    )
    if digits is not None:
        distances = distances.round(digits)
    rows, rays = _in_front(block)
    photos = block.image_photos[rows]
    xy = distances[np.asarray(which, dtype=np.int64)[photos], np.newaxis] * rays[:, :2] / -rays[:, 2:]
    images: _Images = [[] for _ in block.photo_ids]
    points = block.image_points[rows]
    for photo, point, (x, y) in zip(photos.tolist(), points.tolist(), xy.tolist(), strict=True):
        images[photo].append((block.point_ids[point], x, y))
    return distances, images


def _in_front(block: Block) -> tuple[Indices, Floats]:
    """Return rows and directions of the observations that a perspective camera can have."""
    directions = image_directions(block)
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(directions[:, 2] < SIDE)
    return rows, directions[rows]


def given_control(project: Project) -> dict[str, tuple[Floats, Bools]]:
    """Return control and check points, and their fixed or weighted coordinates."""
    known = known_points(project)
    held = np.isfinite(known.sd) & ~known.checks[:, np.newaxis]
    names = [project.block.point_ids[row] for row in known.rows]
    return dict(zip(names, zip(known.positions, held, strict=True), strict=True))


def lost_of_reduced(project: Project) -> list[Phrase]:
    found = []
    if any(camera.unit == "px" for camera in known_cameras(project.block)[0]) and None in project.pixel_mm:
        found.append(phrase("lost.nominal-distance", distance=NOMINAL))
    if lost := len(project.block.image_xy) - len(_in_front(project.block)[0]):
        found.append(phrase("lost.images", n=lost))
    return found


IMAGES, ORIENTATION, CONTROL = ".im", ".ori", ".con"
MICROMETRES = 1e-3
DIGITS = 6  # Digits of principal distances in millimetres; files have three of micrometres


def read_patb(path: Path, options: ReadOptions) -> Project:
    """Read the image file, and orientation, control and names if present."""
    images = file_of(path, IMAGES)
    folder = images.parent
    block = ReducedBuilder(images, FORMATS["patb"].title, options, read_names(folder / NAMES))

    def add(photo: str, card: Card) -> None:
        c = card.number(1, "the principal distance") * MICROMETRES
        block.photo(photo, block.principal_distance(c, card.place), card.place)

    block.add_images(add, MICROMETRES, ends_empty=False)
    orientation = one_file(folder, ORIENTATION)
    lines = iter([] if orientation is None else _filled(orientation))
    for head in lines:
        # Angles are in the line of the centre, the elements of a matrix in the lines after it.
        centre = head.numbers(1, "X Y Z")
        if len(head.words) >= 7:
            matrix = block.turn(head, 4, None)
        else:
            elements: list[float] = []
            while len(elements) < 9:
                if (card := next(lines, None)) is None:
                    raise head.place.error(phrase("format.end", name="the nine elements of the rotation"))
                elements += card.numbers(0, " ".join(["element"] * len(card.words))).tolist()
            if len(elements) != 9:
                raise head.place.error(phrase("format.count", n=len(elements), required=9))
            matrix = checked_rotation(head.place, np.array(elements).reshape(3, 3), 1e-4)
        block.pose(block.name(head), centre, matrix, head.place)
    if (control := one_file(folder, CONTROL)) is not None:
        for card in _filled(control):
            xyz = card.numbers(1, "X Y Z")
            codes = [card.number(k, "a code") for k in range(4, min(len(card.words), 6))]
            # A single code applies to all coordinates, two to position and height.
            level, height = (code > 0 for code in (codes[0], codes[-1])) if codes else (False, False)
            block.known_point(block.name(card), xyz, np.array([level, level, height]), card.place)
    return block.reduced_project("um")


def _filled(path: Path) -> Sequence[Card]:
    return [card for card in cards(path) if card.words and not card.ends]


def lost_in_patb(project: Project) -> list[Phrase]:
    found = [*lost_of_reduced(project), phrase("lost.patb-digits")]
    if any((held[0] != held[1]) for _, held in given_control(project).values()):
        found.append(phrase("lost.horizontal-control"))
    return found


def write_patb(project: Project) -> Mapping[str, bytes]:
    """Return image file, orientation, control, and names if they are not numbers."""
    block, (distances, observed) = project.block, reduced_images(project, DIGITS)
    numbers = numbered([*block.photo_ids, *block.point_ids])
    images: list[str] = []
    for photo, row, own in zip(block.photo_ids, known_cameras(block)[1], observed, strict=True):
        images.append(f"{numbers[photo]:12d}{distances[row] / MICROMETRES:15.3f}")
        images += [
            f"{numbers[point]:12d}{x / MICROMETRES:16.4f}{y / MICROMETRES:16.4f}    0" for point, x, y in own
        ]
        images.append(f"{END:>12}")
    oriented, matrices = list[str](), attitude_matrices(block)
    for row in np.flatnonzero(known_poses(block)).tolist():
        centre = "".join(f"{own:16.5f}" for own in block.photo_positions[row])
        elements = [f"{own:16.12f}" for own in matrices[row].ravel()]
        oriented.append(f"{numbers[block.photo_ids[row]]:16d}{'':16}{centre}")
        oriented += ["".join(elements[:5]), "".join(elements[5:])]
    files = {f"block{IMAGES}": images, f"block{ORIENTATION}": oriented}
    control = [
        f"{numbers[name]:12d}{''.join(f'{0.0 if np.isnan(own) else own:17.5f}' for own in position)}"
        f"{int(held[:2].all()):5d}{int(held[2]):5d}"
        for name, (position, held) in given_control(project).items()
    ]
    files[f"block{CONTROL}"] = [*control, f"{END:>12}"] if control else []
    found = {name: ("\n".join(lines) + "\n").encode() for name, lines in files.items() if lines}
    return found | names_file(numbers, "number")


IMAGE_DAT, ORIENTATION_DAT, CAMERAS = "image.dat", "orientation.dat", "cameras.csv"


def read_bingo(path: Path, options: ReadOptions) -> Project:
    """Read `image.dat` and the orientation; the default angle unit is gon."""
    folder = path if path.is_dir() else path.parent
    images = folder / IMAGE_DAT if path.is_dir() else path
    table = options.cameras or folder / CAMERAS
    if options.cameras is None and not table.is_file():
        raise InputError(phrase("format.cameras"), file=images)
    given = read_cameras(Tables(Settings(images, tables={"cameras": table}, image="mm"), []))
    known = {each.name: each for each in given.cameras}
    block = ReducedBuilder(images, FORMATS["bingo"].title, options)

    def add(photo: str, card: Card) -> None:
        camera = card.words[1] if len(card.words) > 1 else ""
        if camera in known and camera not in block.camera_rows:
            block.camera(known[camera])
        block.photo(photo, camera, card.place)

    block.add_images(add, 1.0, ends_empty=True)
    for card in _filled(folder / ORIENTATION_DAT) if (folder / ORIENTATION_DAT).is_file() else ():
        one_word(card.place, "keyword", card.words[0], ["ORIA"])
        if len(card.words) < 9:
            raise card.place.error(phrase("format.member", name="photo, camera, X, Y, Z, omega, phi, kappa"))
        matrix = block.turn(card, 6, "gon")
        block.pose(card.words[1], card.numbers(3, "X Y Z"), matrix, card.place)
    return block.reduced_project("mm")


def lost_in_bingo(project: Project) -> list[Phrase]:
    found = lost_of_reduced(project)
    if any(name != word for name, word in _words(project).items()):
        found.append(phrase("lost.blanks"))
    if given_control(project):
        found.append(phrase("lost.control-table"))
    return found


def _words(project: Project) -> dict[str, str]:
    found: dict[str, str] = {}
    cameras = [each.name for each in known_cameras(project.block)[0]]
    for names in (project.block.photo_ids, project.block.point_ids, cameras):
        own = {name: "_".join(name.split()) for name in names}
        last = {word: name for name, word in own.items()}
        if same := [[name, last[word]] for name, word in own.items() if last[word] != name]:
            raise InputError(phrase("bingo.blanks", names=same[0]))
        found |= own
    if bad := [name for name, word in found.items() if word in (END, "C", "#")]:
        raise InputError(phrase("bingo.reserved", name=bad[0]))
    return found


def write_bingo(project: Project) -> Mapping[str, bytes]:
    """Return images, orientation, and tables of cameras and of control."""
    block, (cameras, which), words = project.block, known_cameras(project.block), _words(project)
    distances, observed = reduced_images(project)
    lines, names = list[str](), [words[each.name] for each in cameras]
    owners = [names[row] for row in which]
    for photo, camera, own in zip(block.photo_ids, owners, observed, strict=True):
        lines.append(f"{words[photo]} {camera}")
        lines += [f"{words[point]} {x!r} {y!r}" for point, x, y in own]
        lines.append(END)
    files = {IMAGE_DAT: ("\n".join(lines) + "\n").encode()}
    if len(rows := np.flatnonzero(known_poses(block))):
        angles = Attitudes(attitude_matrices(block)[rows]).values("omega_phi_kappa") * (200 / np.pi)
        lines = []
        for row, own in zip(rows.tolist(), angles.tolist(), strict=True):
            numbers = " ".join(map(repr, [*block.photo_positions[row].tolist(), *own]))
            lines.append(f"ORIA {words[block.photo_ids[row]]} {owners[row]} {numbers}\n")
        files[ORIENTATION_DAT] = "".join(lines).encode()
    files[CAMERAS] = csv_text({"camera": names, "c": distances})
    if table := control_table(project):
        files["control.csv"] = csv_text({**table, "point": [words[name] for name in table["point"]]})
    return files
