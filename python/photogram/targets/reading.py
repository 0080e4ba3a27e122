"""Calibrations from what lies at a path: corners in files of any format, a board, values to start from."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.messages import Message, counted, listed
from photogram.network.knots import KNOTTED
from photogram.targets.board import Board, Shape
from photogram.targets.board_files import picture_size, read_board
from photogram.targets.calibration import Calibration
from photogram.targets.corner_files import Form, files_at, is_picture, sorted_files
from photogram.targets.corner_views import Grouping, Measured, ViewBy, grouped
from photogram.targets.corners import Corners
from photogram.targets.detection import detected
from photogram.targets.first_calibration import first_values
from photogram.targets.lens_fit import KNOTS
from photogram.targets.mrcal_model import read_model
from photogram.targets.opencv_corners import read_npz
from photogram.targets.regularisation import with_knot_sd
from photogram.targets.start import Regularisation, Synchronisation

NO_BOARD_SEEN = "pictures, but no board: write board.toml or give --board 9x6 --spacing 0.025"
UNIT_ASSUMED = "does not say the unit of its board: metres are assumed (--unit)"
NO_BOARD = "corners, but no board: write board.toml or give --board 10x10 --spacing 0.077"


def read(
    path: Path,
    *,
    board: Board | Path | None = None,
    shape: Shape | None = None,
    unit: str | None = None,
    model: str | None = None,
    knots: tuple[int, int] | None = None,
    knot_sd: tuple[float, float] | None = None,
    cameras: Sequence[str] = (),
    views: ViewBy = "name",
    within: float = 0.005,
    sync: Synchronisation = "known",
    offsets: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    pixel_origin: str = "center",
    size: tuple[int, int] | None = None,
    sd0: float | None = None,
    regularise: Regularisation | None = None,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Read corners of a board, or find them in photographs, and find values to start from.

    Parameters
    ----------
    path
        A file of corners (`.vnl` and `.cameramodel` of mrcal, tables, YAML, XML, JSON or `.npz` of OpenCV),
        or a folder with such files, or else with photographs (needs `pip install 'photogram[targets]'`),
        and the description of a board.
    board
        The board, or a file that describes it. None: that in the folder, or in the file of corners.
    shape, unit
        In the place of those of the board.
    model
        The lens, as of :func:`first_values`.
    knots, knot_sd
        Of a splined lens: how many along columns and rows (30, 20), and the standard deviations with which
        they are zero, radial and tangential, in units of the stereographic image (1, 0.1).
    cameras, views, within, pixel_origin, size
        How images are grouped, and how pixels count: see docs/targets.md.
    sync
        `known`: images of one view were taken at one time; `none`: each has a pose of its own; `offset`: at
        their times by the clock of their camera, whose offset is unknown.
    offsets
        What is known of these by the names of cameras: seconds, and their standard deviations, 0 where one is
        held, infinite where it is free (the default, from 0).
    sd0, regularise
        As of :class:`Calibration`.
    progress
        Is told which photograph is searched for the board.

    Raises
    ------
    InputError
        Nothing that is known, corners without a board, several formats at once, or whatever a format refuses:
        names the file and the record.
    """
    path = Path(path)
    models, boards, corners = sorted_files(path)
    described = [board] if isinstance(board, Path) else boards if board is None else []
    own = board if isinstance(board, Board) else _only_board(described)
    size = size or next(map(picture_size, described), None)
    if knots is not None and (models or model != KNOTTED):
        raise InputError(f"knots: the lens has a number of them where it is {KNOTTED}, and no file says it")
    if models:
        given = _given(path, models, corners, own)
        prior = None if knot_sd and not regularise else regularise or given.regularise
        given = given.replace(cameras=with_knot_sd(given.cameras, knot_sd, prior), regularise=prior, sd0=sd0)
        if sync != "known" or offsets:
            raise InputError(
                f"{models[0].name} says which pictures are of one view: --sync, --offset go without",
                file=path,
            )
        given = given.replace(messages=[*given.messages, *_not_used(given.corners)])
        return given if shape is None else given.replace(board=given.board.replace(shape=shape))
    how = Grouping(
        cameras, views, within, sync == "none", size, "corner" if pixel_origin == "corner" else "center"
    )
    pictures = [] if corners else [each for each in files_at(path) if is_picture(each)]
    if pictures and own is None:
        raise InputError(NO_BOARD_SEEN, file=path)
    if pictures and own is not None:
        found = detected(path, pictures, own, progress)
    else:
        found = _measured(path, corners, own)
    assumed = [Message(UNIT_ASSUMED, found.path)] if own is None and unit is None else []
    own = found.board if own is None else own
    if own is None:
        raise InputError(NO_BOARD, file=path)
    if shape is not None:
        own = own.replace(shape=shape)
    if unit is not None:
        own = own.replace(unit=unit)
    seen, told = grouped(found, how)
    with at_place(Place(path)):
        start = first_values(own, seen, model, knots or KNOTS)
    poses = start.picture_poses if sync == "none" else start.poses
    calibration = Calibration(
        board=own,
        corners=start.corners,
        cameras=with_knot_sd(start.cameras, knot_sd, regularise),
        poses=poses,
        sensors=None if sync == "none" else start.sensors,
        references=None if sync == "none" else start.references,
        sd0=sd0,
        sync=sync,
        regularise=regularise,
        messages=[*assumed, *found.messages, *told, *_not_used(seen), *start.remarks],
    )
    return calibration.with_offsets(offsets) if offsets else calibration


def _not_used(corners: Corners) -> list[Message]:
    left = int(np.count_nonzero(~corners.use))
    return [Message(f"{counted(left, 'corner')} not used, as the file says")] if left else []


def _only_board(boards: Sequence[Path]) -> Board | None:
    if len(boards) > 1:
        names = listed([each.name for each in boards])
        raise InputError(
            f"there are {len(boards)} boards, {names}: several boards that are fixed to each other are one of"
            " the kind points; those whose relative pose is unknown are not taken yet",
            file=boards[1],
        )
    return read_board(boards[0]) if boards else None


def _given(
    path: Path, models: Sequence[Path], corners: dict[Form, list[Path]], board: Board | None
) -> Calibration:
    """Return the calibration of the one model of mrcal that lies there; those of one solution are alike."""
    if corners or board is not None:
        raise InputError(
            f"{models[0].name} has corners and a board of its own, and others lie beside it", file=path
        )
    found = read_model(models[0])
    for other in models[1:]:
        if read_model(other) != found:
            raise InputError(
                f"{models[0].name} and {other.name} are of different calibrations: give one of them",
                file=path,
            )
    return found


def _measured(path: Path, corners: dict[Form, list[Path]], board: Board | None) -> Measured:
    if not corners:
        raise InputError(
            "holds no corners of a board in any format that is known (docs/targets.md)", file=path
        )
    if len(corners) > 1:
        told = " and ".join(f"{form.title} ({files[0].name})" for form, files in corners.items())
        raise InputError(f"holds {told}: give the file that is meant", file=path)
    ((form, files),) = corners.items()
    if board is None and form.clear is False and form.read is not read_npz:
        raise InputError(NO_BOARD, file=path)
    found = [form.read(each, board) for each in files]
    return found[0] if len(found) == 1 else _together(path, files, found)


def _together(path: Path, files: Sequence[Path], parts: Sequence[Measured]) -> Measured:
    """Return the corners of several files: a camera each, which its file or folder is named for."""
    apart = len({each.stem for each in files}) == len(files)
    names = [each.stem if apart else f"{each.parent.name}" for each in files]
    if len(set(names)) < len(names):
        raise InputError(
            f"holds {counted(len(files), 'file')} of corners whose names tell no cameras apart", file=path
        )
    if any(each.times is None for each in parts) and not all(each.times is None for each in parts):
        raise InputError("has times of corners in some files, but not in all", file=path)
    boards = [each.board for each in parts if each.board is not None]
    if any(each != boards[0] for each in boards[1:]):
        raise InputError("has files of corners with different boards", file=path)
    starts = np.cumsum([0, *(len(each.images) for each in parts)])[:-1].tolist()
    views = [own for each in parts for own in (each.views or each.images)]
    times = None
    if all(each.times is not None for each in parts):
        times = np.concatenate([each.times for each in parts if each.times is not None])
    return Measured(
        path=path,
        images=[own for each in parts for own in each.images],
        image=np.concatenate([each.image + start for each, start in zip(parts, starts, strict=True)]),
        point=np.concatenate([each.point for each in parts]),
        xy=np.concatenate([each.xy for each in parts]),
        sd=np.concatenate([each.sd for each in parts]),
        use=np.concatenate([each.use for each in parts]),
        cameras=[name for each, name in zip(parts, names, strict=True) for _ in each.images],
        views=views,
        times=times,
        sizes={name: each.sizes[""] for each, name in zip(parts, names, strict=True) if "" in each.sizes},
        board=boards[0] if boards else None,
        messages=[*dict.fromkeys(own for each in parts for own in each.messages)],
    )
