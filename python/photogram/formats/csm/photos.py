"""Images with support data as photos on a trajectory."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import numbers
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.csm.isd import HALF, Framelets, Isd, Pixels, check_choice
from photogram.lazy_dataclasses import dataclass, field
from photogram.network.cameras import Camera
from photogram.network.moving_photos import LineSensor, Timed
from photogram.network.projecting import projected
from photogram.network.trajectories import AttitudeInterpolation, Basis, Table, Trajectory
from photogram.words import phrase

_DOWN = np.array([1.0, -1.0])  # Factors of x, y, between y up and y down
_JOINED: dict[str, AttitudeInterpolation] = {"csm": "lagrange", "isis": "linear"}
"""Interpolation of records that do not specify it."""
_STEPS = 5  # Iterations until a shift and the line of the shift agree: shifts are less than a line
_EDGE = 1e-6  # Tolerance for rounding at the edge of a framelet, rows


def trajectory_of(
    isd: Isd,
    name: str,
    *,
    interpolation: Literal["csm", "isis"] = "csm",
    position: Basis | None = None,
    rotation: Basis | None = None,
) -> Trajectory:
    """Return the trajectory of a camera: inertial records, metres, body rotation.

    `interpolation` applies to records that do not specify it; records of cubes do. `csm`: polynomials
    through eight records of positions and quaternions, at any spacing in time; `isis`: linear positions, and
    attitudes with uniform rotation between records. Corrections are as for :class:`Trajectory`.
    """
    check_choice("csm", interpolation)
    places, pointing, joined = isd.position, isd.pointing, _JOINED[interpolation]
    own = places.interpolation or joined
    if own == "hermite" and places.velocities is None:
        raise isd.error(phrase("csm.velocities"))
    attitudes = np.swapaxes(pointing.matrices, 1, 2) * isd.axes
    velocities, turned = places.velocities if own == "hermite" else None, pointing.interpolation or joined
    table = Table(places.times, places.places, pointing.times, attitudes, velocities, own, turned)
    return Trajectory(name, table, position, rotation, (isd.body.times, isd.body.matrices))


def to_camera(isd: Isd, attitudes: Floats) -> Floats:
    """Return (n, 3, 3) matrices inertial to camera of photo attitudes."""
    return np.asarray(np.swapaxes(attitudes * isd.axes, 1, 2))


@dataclass(frozen=True, eq=False)
class SupportedImage:
    """An image with support data.

    Parameters
    ----------
    isd
        The support data.
    name
        Name of the photo; the framelets of a push frame camera are photos `name/0`, `name/1` ..
    pixels
        Pixel counting, here and in the support data: from 1 in the centre of the first pixel (`isis`), or
        from 0.5 there (`csm`).
    interpolation
        As for :func:`trajectory_of`.
    trajectory
        Trajectory of the image, which other images may share; None: from the support data, without
        corrections.

    Attributes
    ----------
    camera
        Camera for the corrected focal plane, millimetres; principal distance only.
    timed
        Photos on the trajectory: one, or each framelet.

    Raises
    ------
    InputError
        If `pixels` or `interpolation` is unknown.
    """

    isd: Isd
    name: str
    pixels: Pixels = "csm"
    interpolation: Literal["csm", "isis"] = "csm"
    trajectory: Trajectory | None = None
    camera: Camera = field(init=False)
    timed: tuple[Timed, ...] = field(init=False)
    flown: Trajectory = field(init=False)

    def __post_init__(self) -> None:
        check_choice(self.pixels, self.interpolation)
        own, isd = self.trajectory, self.isd
        if own is None:
            own = trajectory_of(isd, self.name, interpolation=self.interpolation)
        # Many sensor names begin with the name of their platform.
        platform, sensor = isd.platform, isd.sensor
        name = sensor if sensor.startswith(platform) else f"{platform} {sensor}"
        camera = Camera("perspective", {"c": -isd.focal_length}, name=name)
        timed = [Timed(self.name, own, time=isd.time)]
        if isd.lines is not None:
            timed = [Timed(self.name, own, isd.time, lines=isd.lines, line_sensor=self._line_sensor())]
        elif isd.framelets is not None:
            times = map(isd.framelets.time, range(isd.framelets.count))
            timed = [Timed(f"{self.name}/{k}", own, time=time) for k, time in enumerate(times)]
        vars(self).update(camera=camera, timed=tuple(timed), flown=own)

    def _line_sensor(self) -> LineSensor:
        """Return the sensor line: the detector line at the start of the image."""
        isd, middle = self.isd, self.isd.size[0] / 2
        detector = isd.detector.from_centre(np.array([[middle, 0.0]]), self.pixels)
        detector[:, 1] = isd.detector.first[1] - isd.detector.centre[1]
        plane = isd.detector.planes[self.pixels]
        x, y = plane.places(detector)[0]
        pitch = plane.matrix[:, 0] * isd.detector.summing[0]
        return LineSensor((float(pitch[0]), -float(pitch[1])), middle, float(x), -float(y), isd.lens)

    def coordinates(self, samples: ArrayLike, lines: ArrayLike) -> tuple[Indices, Floats]:
        """Convert samples and lines to image coordinates for a block.

        Parameters
        ----------
        samples, lines
            (n,) counted as in `pixels`.

        Returns
        -------
        (n,) index in `timed` of the photo of each pixel, and (n, 2) coordinates. Coordinates of scanners are
        samples and lines from the corner; of others x, y in the focal plane without distortion, millimetres.

        Raises
        ------
        InputError
            If the arrays have different lengths or contain values that are not numbers.
        """
        own = [np.atleast_1d(numbers(name, each)) for name, each in (("samples", samples), ("lines", lines))]
        required, got = (each.shape for each in own)
        if len(required) != 1 or required != got:
            raise InputError(phrase("format.shape", name="lines", required=str(required), got=str(got)))
        image = np.column_stack(own) - HALF[self.pixels]
        photos = np.zeros(len(image), dtype=np.int64)
        if self.isd.lines is not None:
            return photos, image
        if self.isd.jitter is not None:
            image = image - self.isd.jitter.shifts(image[:, 1])
        framelets = self.isd.framelets
        if framelets is not None:
            numbered = framelets.numbers(image[:, 1])
            photos = numbered.astype(np.int64)
            image[:, 1] = framelets.rows(image[:, 1], numbered)
        return photos, self._corrected(image)

    def _corrected(self, image: Floats) -> Floats:
        """Return (n, 2) undistorted positions of samples and lines, photo axes."""
        detector, lens = self.isd.detector, self.isd.lens
        places = detector.planes[self.pixels].places(detector.from_centre(image, self.pixels))
        if lens is not None:
            places = lens.corrected(places * _DOWN) * _DOWN
        return places * self.isd.axes[:2]

    def _measured(self, corrected: Floats) -> Floats:
        """Return the inverse of :meth:`_corrected`."""
        detector, lens = self.isd.detector, self.isd.lens
        places = corrected * self.isd.axes[:2]
        if lens is not None:
            places = lens.distorted(places * _DOWN) * _DOWN
        return detector.image(detector.planes[self.pixels].detector(places), self.pixels)

    def to_ground(self, lines: ArrayLike, samples: ArrayLike, height: float = 0.0) -> Floats:
        """Intersect pixel rays with the spheroid of the body, enlarged by a height.

        Parameters
        ----------
        lines, samples
            (n,) counted as in `pixels`.
        height
            Addition to the semi-axes, metres.

        Returns
        -------
        (n, 3) X, Y, Z from the body's centre, fixed to the body, metres: the intersection nearer to the
        camera. If a ray misses the body, the result is its nearest point.

        Raises
        ------
        InputError
            If lines are at times outside the tables, or for arrays as in :meth:`coordinates`.
        """
        photos, xy = self.coordinates(samples, lines)
        if self.isd.lines is None:
            times = np.array([each.time for each in self.timed], dtype=float)[photos]
        else:
            times = self.isd.lines.times(xy[:, 1])
            xy = self._line_sensor().places(xy[:, 0])
        first, last = self.flown.reach
        beyond = (times < first) | (times > last)
        if beyond.any():
            row = int(np.argmax(beyond))
            fields = {"line": float(np.atleast_1d(lines)[row]), "time": float(times[row])}
            raise self.isd.error(phrase("csm.reach", image=self.name, first=first, last=last, **fields))
        given = (np.array([each.position for each in own]) for own in self.flown.coefficients)
        places, turned, *_ = self.flown.flown(times, *given)
        rays = np.einsum("nij,nj->ni", turned.reshape(-1, 3, 3), self.camera.rays(xy))
        a, b = self.isd.radii
        return _nearest_intersection(places, rays, a + height, b + height)

    def to_image(self, xyz: ArrayLike) -> Floats:
        """Project points to lines and samples of the image.

        Parameters
        ----------
        xyz
            (n, 3) X, Y, Z from the body's centre, fixed to the body, metres.

        Returns
        -------
        (n, 2) lines and samples, counted as in `pixels`, extrapolated beyond the edges; NaN for points that
        are not visible at any time.
        """
        points = np.atleast_2d(numbers("xyz", xyz))
        seen = [projected(each, self.flown, self.camera, points) for each in self.timed]
        if self.isd.lines is not None:
            return seen[0][:, ::-1] + HALF[self.pixels]
        images = np.array([self._measured(each) for each in seen])
        framelets = self.isd.framelets
        image = found = images[0] if framelets is None else _in_framelets(framelets, images)
        if self.isd.jitter is not None:
            for _ in range(_STEPS):
                found = image + self.isd.jitter.shifts(np.nan_to_num(found[:, 1]))
        return found[:, ::-1] + HALF[self.pixels]


def _in_framelets(framelets: Framelets, images: Floats) -> Floats:
    """Return (n, 2) samples and lines in the framelet nearest to its centre.

    `images` are (framelets, n, 2) samples and rows in each framelet; NaN for points not visible in any.
    """
    off = np.abs(images[:, :, 1] - framelets.height / 2)
    off = np.where(np.isnan(off), np.inf, off)
    best = off.argmin(axis=0)
    own = images[best, np.arange(images.shape[1])]
    lines = framelets.lines(own[:, 1], best)
    seen = off.min(axis=0, initial=np.inf) <= framelets.height / 2 + _EDGE
    return np.where(seen[:, np.newaxis], np.column_stack([own[:, 0], lines]), np.nan)


def _nearest_intersection(origins: Floats, rays: Floats, a: float, b: float) -> Floats:
    """Return (n, 3) nearest intersections of lines with a spheroid.

    If a line misses the spheroid, the enlarged spheroid touches it there. `a` is the semi-axis along X and Y.
    """
    stretch = np.array([1.0, 1.0, a / b])
    from_centre, along = origins * stretch, rays * stretch
    square = np.einsum("ni,ni->n", along, along)
    middle = -np.einsum("ni,ni->n", from_centre, along) / square
    # |o + (m + s) d|^2 = a^2 about the centre of the chord; o + m d is perpendicular to d.
    foot = from_centre + middle[:, np.newaxis] * along
    half = np.sqrt(np.maximum(a * a - np.einsum("ni,ni->n", foot, foot), 0.0) / square)
    ends = np.stack([middle - half, middle + half])
    nearest = np.where(np.abs(ends[0]) <= np.abs(ends[1]), ends[0], ends[1])
    return np.asarray(origins + nearest[:, np.newaxis] * rays)
