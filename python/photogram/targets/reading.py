"""Reading of calibrations: corner files of any format, a board, initial values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import get_args

import numpy as np

from photogram.arguments.arrays import one_of
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.messages import Message
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
from photogram.words import phrase


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
    """Read board corners or detect them in photographs, and compute initial values.

    Parameters
    ----------
    path
        A corner file (`.vnl` and `.cameramodel` of mrcal, tables, YAML, XML, JSON or `.npz` of OpenCV), or a
        folder. The folder contains such files, or photographs (requires `pip install 'photogram[targets]'`),
        and a board description.
    board
        The board, or a file that describes it. None: the board in the folder or in the corner file.
    shape, unit
        Override the values of the board.
    model
        Lens model as in :func:`first_values`.
    knots, knot_sd
        For a splined lens: number of knots along columns and rows (30, 20). Standard deviations of the zero
        priors, radial and tangential, in units of the stereographic image (1, 0.1).
    cameras, views, within, pixel_origin, size
        Grouping of images and pixel convention: see docs/targets.md.
    sync
        `known`: images of one view are simultaneous. `none`: each has its own pose. `offset`: images have
        times by camera clocks with unknown offsets.
    offsets
        Prior clock offsets by camera name: seconds, and their standard deviations. 0 is fixed, infinite is
        free (the default, from 0).
    sd0, regularise
        As in :class:`Calibration`.
    progress
        Called with the photograph that is searched for the board.

    Raises
    ------
    InputError
        If no known format is found, if corners lack a board, if there are several formats, or if a file is
        invalid. The message names file and record.
    """
    path = path_of("path", path)
    one_of("views", views, get_args(ViewBy))
    one_of("pixel_origin", pixel_origin, ("corner", "center"))
    models, boards, corners = sorted_files(path)
    described = [board] if isinstance(board, Path) else boards if board is None else []
    own = board if isinstance(board, Board) else _only_board(described)
    size = size or next(map(picture_size, described), None)
    if knots is not None and (models or model != KNOTTED):
        raise InputError(phrase("targets.knots-of", model=KNOTTED))
    if models:
        calibration = _of_models(path, models, corners, own)
        prior = None if knot_sd and not regularise else regularise or calibration.regularise
        cameras_of_model = with_knot_sd(calibration.cameras, knot_sd, prior)
        if sync != "known" or offsets:
            raise InputError(phrase("targets.model-has-views", name=models[0].name), file=path)
        messages = [*calibration.messages, *_not_used(calibration.corners)]
        board = calibration.board if shape is None else calibration.board.replace(shape=shape)
        return calibration.replace(
            cameras=cameras_of_model, regularise=prior, sd0=sd0, messages=messages, board=board
        )
    how = Grouping(
        cameras, views, within, sync == "none", size, "corner" if pixel_origin == "corner" else "center"
    )
    pictures = [] if corners else [each for each in files_at(path) if is_picture(each)]
    if pictures and own is None:
        raise InputError(phrase("targets.no-board"), file=path)
    if pictures and own is not None:
        found = detected(path, pictures, own, progress)
    else:
        found = _measured(path, corners, own)
    assumed = [Message(phrase("targets.unit"), found.path)] if own is None and unit is None else []
    own = found.board if own is None else own
    if own is None:
        raise InputError(phrase("targets.no-board"), file=path)
    if shape is not None:
        own = own.replace(shape=shape)
    if unit is not None:
        own = own.replace(unit=unit)
    seen, remarks = grouped(found, how)
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
        messages=[*assumed, *found.messages, *remarks, *_not_used(seen), *start.remarks],
    )
    return calibration.with_offsets(offsets) if offsets else calibration


def _not_used(corners: Corners) -> list[Message]:
    unused = int(np.count_nonzero(~corners.use))
    return [Message(phrase("targets.unused", n=unused))] if unused else []


def _only_board(boards: Sequence[Path]) -> Board | None:
    if len(boards) > 1:
        names = [each.name for each in boards]
        raise InputError(phrase("targets.boards", count=len(boards), names=names), file=boards[1])
    return read_board(boards[0]) if boards else None


def _of_models(
    path: Path, models: Sequence[Path], corners: dict[Form, list[Path]], board: Board | None
) -> Calibration:
    if corners or board is not None:
        raise InputError(phrase("targets.own-corners", name=models[0].name), file=path)
    calibration = read_model(models[0])
    for other in models[1:]:
        if read_model(other) != calibration:
            names = {"first": models[0].name, "second": other.name}
            raise InputError(phrase("targets.other-calibration", **names), file=path)
    return calibration


def _measured(path: Path, corners: dict[Form, list[Path]], board: Board | None) -> Measured:
    if not corners:
        raise InputError(phrase("targets.no-format"), file=path)
    if len(corners) > 1:
        names = [f"{form.title}: {files[0].name}" for form, files in corners.items()]
        raise InputError(phrase("targets.formats", names=names), file=path)
    ((form, files),) = corners.items()
    if board is None and form.clear is False and form.read is not read_npz:
        raise InputError(phrase("targets.no-board"), file=path)
    parts = [form.read(each, board) for each in files]
    return parts[0] if len(parts) == 1 else _together(path, files, parts)


def _together(path: Path, files: Sequence[Path], parts: Sequence[Measured]) -> Measured:
    """Return the corners of several files, each a camera named by its file or folder."""
    apart = len({each.stem for each in files}) == len(files)
    names = [each.stem if apart else f"{each.parent.name}" for each in files]
    if len(set(names)) < len(names):
        raise InputError(phrase("targets.camera-names", count=len(files)), file=path)
    timed = [each.times for each in parts if each.times is not None]
    if timed and len(timed) < len(parts):
        raise InputError(phrase("targets.some-times"), file=path)
    boards = [each.board for each in parts if each.board is not None]
    if any(each != boards[0] for each in boards[1:]):
        raise InputError(phrase("targets.different-boards"), file=path)
    starts = np.cumsum([0, *(len(each.images) for each in parts)])[:-1].tolist()
    views = [own for each in parts for own in (each.views or each.images)]
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
        times=np.concatenate(timed) if timed else None,
        sizes={name: each.sizes[""] for each, name in zip(parts, names, strict=True) if "" in each.sizes},
        board=boards[0] if boards else None,
        messages=[*dict.fromkeys(own for each in parts for own in each.messages)],
    )
