"""An image with support data as photos on a trajectory, and where its pixels lie on the ground."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from photogram.arguments.arrays import numbers
from photogram.arguments.types import Floats, Indices
from photogram.errors import InputError
from photogram.formats.csm.angles import fitted_angles, of_angles
from photogram.formats.csm.isd import HALF, Framelets, Isd, Pixels, Turns, check_choice
from photogram.lazy_dataclasses import dataclass, field, replace
from photogram.network.cameras import Camera
from photogram.network.moving_photos import LineSensor, Timed
from photogram.network.projecting import projected
from photogram.network.trajectories import Basis, Interpolation, Table, Trajectory
from photogram.words import phrase

_DOWN = np.array([1.0, -1.0])  # Factors of x, y, between y up and y down
_JOINED: dict[str, Interpolation] = {"csm": "lagrange", "isis": "linear"}
"""How records are joined where they do not say it themselves."""
_STEPS = 5  # Until a shift no longer changes the line that it is of: shifts are less than a line
_EDGE = 1e-6  # Rows beyond a framelet that are rounding at its edge


def trajectory_of(
    isd: Isd,
    name: str,
    *,
    interpolation: Literal["csm", "isis"] = "csm",
    position: Basis | None = None,
    rotation: Basis | None = None,
) -> Trajectory:
    """Return the trajectory of a camera: inertial records in metres, under which its body turns.

    Records are joined as `interpolation` says, those of cubes as they say themselves. `csm`: polynomials
    through eight records, of positions and quaternions, at their own times however far apart these are;
    `isis`: positions straight, attitudes uniformly from record to record. Corrections are as for
    :class:`Trajectory`.
    """
    check_choice("csm", interpolation)
    places, pointing, joined = isd.position, isd.pointing, _JOINED[interpolation]
    own = places.interpolation or joined
    if own == "hermite" and places.velocities is None:
        raise isd.error(phrase("csm.velocities"))
    table = Table(
        places.times,
        places.places,
        pointing.times,
        np.swapaxes(pointing.matrices, 1, 2) * isd.axes,
        velocities=places.velocities if own == "hermite" else None,
        interpolation=own,
        attitude_interpolation=pointing.interpolation or joined,
    )
    return Trajectory(name, table, position, rotation, (isd.body.times, isd.body.matrices))


def to_camera(isd: Isd, attitudes: Floats) -> Floats:
    """Return (n, 3, 3) matrices from inertial axes to those of a camera, of attitudes photo to inertial."""
    return np.asarray(np.swapaxes(attitudes * isd.axes, 1, 2))


def with_polynomial_pointing(isd: Isd, degree: int) -> Isd:
    """Return support data whose pointing is polynomials fitted to its three angles, as jigsaw has it.

    `degree` is its CKDEGREE; there have to be as many records as coefficients.
    """
    own = isd.pointing
    if not 0 <= degree < len(own.times):
        raise isd.error(phrase("csm.degree", n=len(own.times), degree=degree))
    fit = fitted_angles(own.times, own.matrices, degree)
    times, angles = fit.sampled(float(own.times[0]), float(own.times[-1]))
    return replace(isd, pointing=Turns(times, of_angles(angles), "lagrange"))


@dataclass(frozen=True, eq=False)
class SupportedImage:
    """An image with support data.

    Parameters
    ----------
    isd
        The support data.
    name
        Of the photo; the framelets of a push frame camera are photos `name/0`, `name/1` ..
    pixels
        How its samples and lines are counted, here and in the support data: from 1 in the middle of the first
        pixel (`isis`), or from 0.5 there (`csm`).
    interpolation
        As for :func:`trajectory_of`.
    trajectory
        That it is on, which other images may share; None: that of its support data, without corrections.

    Attributes
    ----------
    camera
        Behind the corrected focal plane, in millimetres: nothing but its principal distance.
    timed
        Its photos on the trajectory: one, or each framelet.

    Raises
    ------
    InputError
        Other pixels or interpolations.
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
        own = self.trajectory
        if own is None:
            own = trajectory_of(self.isd, self.name, interpolation=self.interpolation)
        object.__setattr__(self, "flown", own)
        # Many sensors have the name of their platform before their own.
        platform, sensor = self.isd.platform, self.isd.sensor
        name = sensor if sensor.startswith(platform) else f"{platform} {sensor}"
        camera = Camera("perspective", {"c": -self.isd.focal_length}, name=name)
        object.__setattr__(self, "camera", camera)
        object.__setattr__(self, "timed", self._photos(own))

    def _photos(self, on: Trajectory) -> tuple[Timed, ...]:
        isd = self.isd
        if isd.lines is not None:
            return (Timed(self.name, on, isd.time, lines=isd.lines, line_sensor=self._line_sensor()),)
        if isd.framelets is not None:
            times = map(isd.framelets.time, range(isd.framelets.count))
            return tuple(Timed(f"{self.name}/{k}", on, time=time) for k, time in enumerate(times))
        return (Timed(self.name, on, time=isd.time),)

    def _line_sensor(self) -> LineSensor:
        """Return the line of sensors: its line of the detector is that at which the image begins."""
        isd, middle = self.isd, self.isd.size[0] / 2
        detector = isd.detector.from_centre(np.array([[middle, 0.0]]), self.pixels)
        detector[:, 1] = isd.detector.first[1] - isd.detector.centre[1]
        plane = isd.detector.planes[self.pixels]
        x, y = plane.places(detector)[0]
        pitch = plane.matrix[:, 0] * isd.detector.summing[0]
        return LineSensor((float(pitch[0]), -float(pitch[1])), middle, float(x), -float(y), isd.lens)

    def coordinates(self, samples: ArrayLike, lines: ArrayLike) -> tuple[Indices, Floats]:
        """Return image coordinates for a block.

        Parameters
        ----------
        samples, lines
            (n,) counted as `pixels` says.

        Returns
        -------
        (n,) which photo of `timed` each is in, and (n, 2): of scanners samples and lines from the corner, of
        others x, y in the focal plane of a perfect lens, millimetres.

        Raises
        ------
        InputError
            Arrays of different lengths, what is no number.
        """
        own = [np.atleast_1d(numbers(name, each)) for name, each in (("samples", samples), ("lines", lines))]
        if own[0].ndim != 1 or own[0].shape != own[1].shape:
            raise InputError(
                phrase("format.shape", name="lines", required=str(own[0].shape), got=str(own[1].shape))
            )
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
        """Return (n, 2) places behind a perfect lens, in the axes of photos, of samples and lines."""
        detector, lens = self.isd.detector, self.isd.lens
        places = detector.planes[self.pixels].places(detector.from_centre(image, self.pixels))
        if lens is not None:
            places = lens.corrected(places * _DOWN) * _DOWN
        return places * self.isd.axes[:2]

    def _measured(self, corrected: Floats) -> Floats:
        """Return what :meth:`_corrected` makes these of."""
        detector, lens = self.isd.detector, self.isd.lens
        places = corrected * self.isd.axes[:2]
        if lens is not None:
            places = lens.distorted(places * _DOWN) * _DOWN
        return detector.image(detector.planes[self.pixels].detector(places), self.pixels)

    def to_ground(self, lines: ArrayLike, samples: ArrayLike, height: float = 0.0) -> Floats:
        """Return where pixels lie on the spheroid of the body, its semi-axes longer by a height.

        Parameters
        ----------
        lines, samples
            (n,) counted as `pixels` says.
        height
            Metres.

        Returns
        -------
        (n, 3) X, Y, Z from the body's centre, fixed to the body, metres: of the two points of a ray that
        which is nearer to the camera, and of a ray that misses the body its nearest.

        Raises
        ------
        InputError
            Lines at times that the tables do not reach, arrays as for :meth:`coordinates`.
        """
        photos, xy = self.coordinates(samples, lines)
        if self.isd.lines is None:
            times = np.array([each.time for each in self.timed], dtype=float)[photos]
        else:
            times = self.isd.lines.times(xy[:, 1])
            xy = self._line_sensor().places(xy[:, 0])
        self._check_reached(times, np.atleast_1d(np.asarray(lines, dtype=float)))
        given = (np.array([each.position for each in own]) for own in self.flown.coefficients)
        places, turned, *_ = self.flown.flown(times, *given)
        rays = np.einsum("nij,nj->ni", turned.reshape(-1, 3, 3), self.camera.rays(xy))
        a, b = self.isd.radii
        return _nearest_intersection(places, rays, a + height, b + height)

    def _check_reached(self, times: Floats, lines: Floats) -> None:
        """Refuse times at which nothing is known of the pose."""
        first, last = self.flown.reach
        beyond = (times < first) | (times > last)
        if beyond.any():
            row = int(np.argmax(beyond))
            raise self.isd.error(
                phrase(
                    "csm.reach",
                    line=lines[row],
                    image=self.name,
                    time=float(times[row]),
                    first=first,
                    last=last,
                )
            )

    def to_image(self, xyz: ArrayLike) -> Floats:
        """Return the line and the sample at which points appear.

        Parameters
        ----------
        xyz
            (n, 3) X, Y, Z from the body's centre, fixed to the body, metres.

        Returns
        -------
        (n, 2) lines and samples, counted as `pixels` says, beyond the edges as if the image went on; NaN for
        points that are not seen at any time.
        """
        points = np.atleast_2d(numbers("xyz", xyz))
        seen = [projected(each, self.flown, self.camera, points) for each in self.timed]
        if self.isd.lines is not None:
            return seen[0][:, ::-1] + HALF[self.pixels]
        images = np.array([self._measured(each) for each in seen])
        framelets = self.isd.framelets
        found = images[0] if framelets is None else _in_framelets(framelets, images)
        return self._jittered(found)[:, ::-1] + HALF[self.pixels]

    def _jittered(self, image: Floats) -> Floats:
        """Return where samples and lines are measured that jitter has shifted."""
        jitter = self.isd.jitter
        if jitter is None:
            return image
        found = image
        for _ in range(_STEPS):
            found = image + jitter.shifts(np.nan_to_num(found[:, 1]))
        return found


def _in_framelets(framelets: Framelets, images: Floats) -> Floats:
    """Return (n, 2) samples and lines of points in the framelet that sees them nearest to its middle.

    `images` are (framelets, n, 2) samples and rows as each sees them; NaN where none does.
    """
    off = np.abs(images[:, :, 1] - framelets.height / 2)
    off = np.where(np.isnan(off), np.inf, off)
    best = off.argmin(axis=0)
    own = images[best, np.arange(images.shape[1])]
    lines = framelets.lines(own[:, 1], best)
    seen = off.min(axis=0, initial=np.inf) <= framelets.height / 2 + _EDGE
    return np.where(seen[:, np.newaxis], np.column_stack([own[:, 0], lines]), np.nan)


def _nearest_intersection(origins: Floats, rays: Floats, a: float, b: float) -> Floats:
    """Return (n, 3) where lines meet a spheroid about the origin, nearest to where they begin.

    Of a line that misses it: where the spheroid, enlarged, would touch it. `a` is the semi-axis along X and
    Y.
    """
    stretch = np.array([1.0, 1.0, a / b])
    from_centre, along = origins * stretch, rays * stretch
    square = np.einsum("ni,ni->n", along, along)
    middle = -np.einsum("ni,ni->n", from_centre, along) / square
    # |o + (m + s) d|^2 = a^2 about the middle of the chord, where o + m d is square to d.
    foot = from_centre + middle[:, np.newaxis] * along
    half = np.sqrt(np.maximum(a * a - np.einsum("ni,ni->n", foot, foot), 0.0) / square)
    ends = np.stack([middle - half, middle + half])
    nearest = np.where(np.abs(ends[0]) <= np.abs(ends[1]), ends[0], ends[1])
    return np.asarray(origins + nearest[:, np.newaxis] * rays)
