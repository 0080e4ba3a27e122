"""matplotlib figures as vectors in PDF documents of reportlab: every path, text as outlines."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.path import Path
from matplotlib.transforms import Affine2D
from reportlab.lib.utils import ImageReader
from reportlab.platypus import Flowable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 72
"""A PDF point is a dot of a figure of so many an inch."""
CAPS = {"butt": 0, "round": 1, "projecting": 2}
JOINS = {"miter": 0, "round": 1, "bevel": 2}


class FigureFlowable(Flowable):  # type: ignore[misc]
    """A figure in the flow of a document, no wider and no higher than there is room.

    Parameters
    ----------
    figure
        The figure.
    width, height
        What it may take at the most, points.
    """

    def __init__(self, figure: Figure, width: float, height: float) -> None:
        super().__init__()
        across, up = (POINTS * float(each) for each in figure.get_size_inches())
        self._figure, self._scale = figure, min(1.0, width / across, height / up)
        self.width, self.height = self._scale * across, self._scale * up

    def draw(self) -> None:
        """Draw it where the flow has come to."""
        self._figure.set_dpi(POINTS)
        self.canv.scale(self._scale, self._scale)
        across, up = (POINTS * float(each) for each in self._figure.get_size_inches())
        self._figure.draw(_Renderer(self.canv, across, up))


class _Renderer(RendererBase):
    """What matplotlib draws on: a canvas of reportlab, in points from its lower left corner."""

    def __init__(self, canvas: Any, width: float, height: float) -> None:
        super().__init__()
        self._canvas, self._size = canvas, (width, height)

    def get_canvas_width_height(self) -> tuple[float, float]:
        """Return the size in points."""
        return self._size

    def flipy(self) -> bool:
        """Return whether y goes down."""
        return False

    def points_to_pixels(self, points: Any) -> Any:
        """Return points as dots of the canvas."""
        return points

    def draw_path(self, gc: GraphicsContextBase, path: Path, transform: Any, rgbFace: Any = None) -> None:
        """Draw a path, filled where it has a face."""
        canvas = self._canvas
        canvas.saveState()
        self._clip(gc)
        outline = self._outline(path, transform, clipped=rgbFace is None)
        line = gc.get_linewidth() > 0
        if line:
            canvas.setLineWidth(gc.get_linewidth())
            canvas.setStrokeColorRGB(*gc.get_rgb()[:3])
            canvas.setStrokeAlpha(self._alpha(gc, gc.get_rgb()))
            canvas.setLineCap(CAPS[gc.get_capstyle()])
            canvas.setLineJoin(JOINS[gc.get_joinstyle()])
            offset, dashes = self._dashes(gc)
            if dashes:
                canvas.setDash(dashes, offset)
        if rgbFace is not None:
            canvas.setFillColorRGB(*rgbFace[:3])
            canvas.setFillAlpha(self._alpha(gc, rgbFace))
        canvas.drawPath(outline, stroke=int(line), fill=int(rgbFace is not None))
        canvas.restoreState()

    def draw_image(self, gc: GraphicsContextBase, x: float, y: float, im: Any, transform: Any = None) -> None:
        """Draw dots: what a figure has as such."""
        from PIL import Image

        canvas, (height, width) = self._canvas, im.shape[:2]
        content = io.BytesIO()
        Image.fromarray(im[::-1]).save(content, format="png")
        canvas.saveState()
        self._clip(gc)
        matrix = (
            (1, 0, 0, 1, x, y) if transform is None else (transform + Affine2D().translate(x, y)).to_values()
        )
        canvas.transform(*matrix)
        size = (width, height) if transform is None else (1, 1)
        canvas.drawImage(ImageReader(content), 0, 0, *size, mask="auto")
        canvas.restoreState()

    @staticmethod
    def _dashes(gc: Any) -> tuple[float, list[float]]:
        offset, dashes = gc.get_dashes()
        return float(offset), [] if dashes is None else [float(each) for each in dashes]

    @staticmethod
    def _alpha(gc: GraphicsContextBase, colour: Any) -> float:
        forced = gc.get_forced_alpha()
        return float(gc.get_alpha() if forced or len(colour) < 4 else colour[3])

    def _clip(self, gc: Any) -> None:
        box = gc.get_clip_rectangle()
        if box is not None:
            edge = self._canvas.beginPath()
            edge.rect(*box.bounds)
            self._canvas.clipPath(edge, stroke=0, fill=0)
        path, transform = gc.get_clip_path()
        if path is not None:
            self._canvas.clipPath(self._outline(path, transform, clipped=False), stroke=0, fill=0)

    def _outline(self, path: Path, transform: Any, *, clipped: bool) -> Any:
        """Return a path of the canvas; lines are cut at its edges, beyond which numbers may be too large."""
        outline = self._canvas.beginPath()
        box = (0.0, 0.0, *self._size) if clipped else None
        for points, code in path.iter_segments(transform, clip=box, curves=True, simplify=False):
            if code == Path.MOVETO:
                outline.moveTo(*points)
            elif code == Path.LINETO:
                outline.lineTo(*points)
            elif code == Path.CURVE3:
                x, y = outline.x, outline.y
                (a, b, c, d) = points
                third = (x + 2 * (a - x) / 3, y + 2 * (b - y) / 3, c + 2 * (a - c) / 3, d + 2 * (b - d) / 3)
                outline.curveTo(*third, c, d)
            elif code == Path.CURVE4:
                outline.curveTo(*points)
            elif code == Path.CLOSEPOLY:
                outline.close()
            if code in (Path.MOVETO, Path.LINETO, Path.CURVE3, Path.CURVE4):
                outline.x, outline.y = points[-2:]
        return outline
