"""Pictures that are drawn where it is asked for, or written to a file, or both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from photogram.io.writing import write_whole
from photogram.show.axes import Where, whole_figure
from photogram.show.pictures import drawn, new_figure
from photogram.show.sketch.declared import Sketch
from photogram.show.sketch.on_axes import on_axes


def placed(sketch: Sketch, path: Path | None, ax: Where) -> Any:
    """Return the axes of a picture that is drawn where it is asked for, and written where there is a path.

    Parameters
    ----------
    sketch
        The picture.
    path
        Of the file, which has the figure of the axes, in the format that its suffix names; None: no file.
    ax
        As of :func:`photogram.show.axes.panels`; with a path and None, a figure that belongs to no window.

    Raises
    ------
    InputError
        A suffix that names no format; another number of axes.
    """
    axes = on_axes(sketch, new_figure(1.0, 1.0) if ax is None and path is not None else ax)
    if path is not None:
        write_whole({path: drawn(whole_figure(np.atleast_1d(np.asarray(axes, dtype=object))[0]), path)})
    return axes
