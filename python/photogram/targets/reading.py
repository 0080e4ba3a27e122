"""Reading of calibrations: corner files of any format, a board, initial values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import numpy as np

from photogram.arguments.fields import options_of
from photogram.arguments.objects import path_of
from photogram.errors import InputError
from photogram.io.places import Place, at_place
from photogram.lazy_dataclasses import replace
from photogram.messages import Message
from photogram.network.passages import KNOTTED
from photogram.targets.board import Board, picture_size, read_board
from photogram.targets.calibration import Calibration
from photogram.targets.corner_files import Form, files_at, is_picture, sorted_files
from photogram.targets.corners import Corners, Measured, grouped
from photogram.targets.detection import detected
from photogram.targets.first_calibration import first_values
from photogram.targets.lens_fit import KNOTS
from photogram.targets.mrcal import read_model
from photogram.targets.opencv_corners import read_npz
from photogram.targets.options import CalibrationOptions
from photogram.targets.regularisation import with_knot_sd
from photogram.words import phrase

if TYPE_CHECKING:
    from photogram.targets.keywords import CalibrationKeywords


def read(
    path: Path,
    options: CalibrationOptions | None = None,
    *,
    progress: Callable[[str], None] | None = None,
    **changes: Unpack[CalibrationKeywords],
) -> Calibration:
    """Read board corners or detect them in photographs, and compute initial values.

    Parameters
    ----------
    path
        A corner file (`.vnl` and `.cameramodel` of mrcal, tables, YAML, XML, JSON or `.npz` of OpenCV), or a
        folder. The folder contains such files, or photographs (requires `pip install 'photogram[targets]'`),
        and a board description.
    options
        The options; None: the defaults.
    progress
        Called with the photograph that is searched for the board.
    **changes
        Fields of :class:`photogram.targets.CalibrationOptions` with other values.

    Raises
    ------
    InputError
        If no known format is found, if corners lack a board, if there are several formats, or if a file is
        invalid. The message names file and record.
    """
    path = path_of("path", path)
    chosen = options_of(CalibrationOptions, options, changes)
    board, shape, sync, regularise = chosen.board, chosen.shape, chosen.sync, chosen.regularise
    models, boards, corners = sorted_files(path)
    described = [board] if isinstance(board, Path) else boards if board is None else []
    own = board_of(chosen, described)
    chosen = replace(chosen, size=chosen.size or next(map(picture_size, described), None))
    if chosen.knots is not None and (models or chosen.model != KNOTTED):
        raise InputError(phrase("targets.knots-of", model=KNOTTED))
    if models:
        if corners or own is not None:
            raise InputError(phrase("targets.own-corners", name=models[0].name), file=path)
        calibration = read_model(models[0])
        for other in models[1:]:
            if read_model(other) != calibration:
                names = {"first": models[0].name, "second": other.name}
                raise InputError(phrase("targets.other-calibration", **names), file=path)
        prior = None if chosen.knot_sd and not regularise else regularise or calibration.regularise
        cameras_of_model = with_knot_sd(calibration.cameras, chosen.knot_sd, prior)
        if sync != "known" or chosen.offsets:
            raise InputError(phrase("targets.model-has-views", name=models[0].name), file=path)
        messages = [*calibration.messages, *_not_used(calibration.corners)]
        board = calibration.board if shape is None else calibration.board.replace(shape=shape)
        return calibration.replace(
            cameras=cameras_of_model, regularise=prior, sd0=chosen.sd0, messages=messages, board=board
        )
    pictures = [] if corners else [each for each in files_at(path) if is_picture(each)]
    if pictures and own is None:
        raise InputError(phrase("targets.no-board"), file=path)
    if pictures and own is not None:
        found = detected(path, pictures, own, progress)
    else:
        found = _measured(path, corners, own)
    assumed = [Message(phrase("targets.unit"), found.path)] if own is None and chosen.unit is None else []
    own = found.board if own is None else own
    if own is None:
        raise InputError(phrase("targets.no-board"), file=path)
    own = own.replace(
        **{key: each for key in ("shape", "unit") if (each := getattr(chosen, key)) is not None}
    )
    seen, remarks = grouped(found, chosen)
    with at_place(Place(path)):
        start = first_values(own, seen, chosen.model, chosen.knots or KNOTS)
    poses = start.picture_poses if sync == "none" else start.poses
    calibration = Calibration(
        board=own,
        corners=start.corners,
        cameras=with_knot_sd(start.cameras, chosen.knot_sd, regularise),
        poses=poses,
        sensors=None if sync == "none" else start.sensors,
        references=None if sync == "none" else start.references,
        sd0=chosen.sd0,
        sync=sync,
        regularise=regularise,
        messages=[*assumed, *found.messages, *remarks, *_not_used(seen), *start.remarks],
    )
    return calibration.with_offsets(chosen.offsets) if chosen.offsets else calibration


def _not_used(corners: Corners) -> list[Message]:
    unused = int(np.count_nonzero(~corners.use))
    return [Message(phrase("targets.unused", n=unused))] if unused else []


def board_of(options: CalibrationOptions, described: Sequence[Path]) -> Board | None:
    if isinstance(options.board, Board):
        return options.board
    if isinstance(options.board, tuple):
        return Board(columns=options.board[0], rows=options.board[1], spacing=options.spacing)
    if len(described) > 1:
        names = [each.name for each in described]
        raise InputError(phrase("targets.boards", count=len(described), names=names), file=described[1])
    return read_board(described[0]) if described else None


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
