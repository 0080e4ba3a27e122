"""Attitudes of photos in all common representations, with covariances.

An attitude is a matrix A whose columns are the photo's axes in object space: x right, y up, z back
towards the viewer. The camera looks along -z. :meth:`Attitudes.of` reads any representation,
:meth:`Attitudes.values` and :meth:`Attitudes.covariances` convert to any. `docs/conventions.md`
contains the equations and a diagram of each convention.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from photogram import _photocore
from photogram.arguments.arrays import frozen, numbers, one_of, shaped
from photogram.arguments.fields import array, check_arrays
from photogram.arguments.objects import require
from photogram.arguments.types import Floats
from photogram.errors import InputError
from photogram.lazy_dataclasses import dataclass, field
from photogram.words import phrase

if TYPE_CHECKING:
    from collections.abc import Callable

Representation = Literal[
    "omega_phi_kappa",
    "omega_phi_kappa_photo_to_ground",
    "phi_omega_kappa",
    "azimuth_tilt_swing",
    "yaw_pitch_roll",
    "quaternion",
    "quaternion_to_vision",
    "rotation_vector",
    "rotation_vector_to_photo",
    "rotation_vector_to_vision",
    "matrix",
    "matrix_to_photo",
    "matrix_to_vision",
    "matrix_from_vision",
]
Mounting = Literal["top forward", "top right", "top back", "top left"]

_TO_VISION: Floats = np.diag([1.0, -1.0, -1.0])  # F: vision axes from photo axes
_ORTHONORMAL = 1e-6  # Tolerance of the elements of A A' - I
_LEAST_LENGTH = 1e-100  # Minimum length of a quaternion; the square of a smaller one underflows


@dataclass(frozen=True, eq=False)
class Attitudes:
    """Attitudes of n photos, independent of the input representation.

    Parameters
    ----------
    matrices
        A, (n, 3, 3), photo to object: columns are the photo's axes.
    step_covariances
        (n, 3, 3) covariances of the rotation step rho about the photo's own axes, A Exp(rho), rad^2. None if
        unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from photogram import Attitudes
    >>> flown = Attitudes.of("yaw_pitch_roll", np.radians([[90.0, 0.0, 0.0]]))
    >>> np.degrees(flown.values("omega_phi_kappa")).round(6) + 0.0
    array([[  0.,   0., -90.]])
    """

    matrices: Floats = field(metadata=array("photos", 3, 3))
    step_covariances: Floats | None = field(default=None, metadata=array("photos", 3, 3))

    def __post_init__(self) -> None:
        check_arrays(self)
        _check_orthonormal(self.matrices)

    def __len__(self) -> int:
        return len(self.matrices)

    @classmethod
    def of(
        cls,
        representation: Representation,
        values: ArrayLike,
        covariances: ArrayLike | None = None,
        *,
        mounting: Mounting | ArrayLike = "top forward",
    ) -> Attitudes:
        """Create attitudes from the numbers of a representation.

        Parameters
        ----------
        representation
            Meaning of the numbers, specified in `docs/conventions.md`; angles in radians:

            - "omega_phi_kappa": A = (Mz(kappa) My(phi) Mx(omega))', ground to photo; with
              "_photo_to_ground" A is the product itself;
            - "phi_omega_kappa": A = (Mz(kappa) Mx(omega) My(phi))', in the order phi, omega, kappa;
            - "azimuth_tilt_swing": azimuth of the direction of view clockwise from +Y, tilt from the
              nadir, swing clockwise from the photo's +y to the nadir point;
            - "yaw_pitch_roll": yaw of an aircraft clockwise from north, nose up, right wing down; object
              axes are east, north, up;
            - "quaternion": w, x, y, z of A; with "_to_vision" of F A' (COLMAP);
            - "rotation_vector": of A; with "_to_photo" of A' (Bundler, BAL), with "_to_vision" of F A'
              (OpenCV);
            - "matrix": A; with "_to_photo" A', with "_to_vision" F A' (COLMAP, OpenCV), with "_from_vision"
              A F (Metashape). F maps photo axes to vision axes, x right, y down, z forward.
        values
            (n, 3), quaternions (n, 4), matrices (n, 3, 3). Quaternions may have any length except zero.
        covariances
            (n, k, k) covariances of the numbers; for matrices (n, 3, 3) covariances of the rotation step.
        mounting
            For yaw, pitch, roll: direction of the top of the image of a nadir camera, or the boresight
            matrix (3, 3), photo axes from body axes (forward, right, down).

        Raises
        ------
        InputError
            If shapes are wrong, numbers are not finite, a matrix is not orthonormal or is mirrored, or a
            quaternion has length zero.
        """
        one_of("representation", representation, get_args(Representation))
        if representation.startswith("matrix"):
            matrices = shaped("values", values, (None, 3, 3))
            _check_orthonormal(matrices)
            # One Newton step to the nearest orthonormal matrix, because files contain few digits.
            matrices = matrices @ (3.0 * np.eye(3) - matrices.transpose(0, 2, 1) @ matrices) / 2.0
            matrices = _FROM[representation](matrices)
            return cls(matrices, None if covariances is None else numbers("covariances", covariances))
        boresight = _boresight(mounting)
        rows = numbers("values", values)
        require(np.isfinite(rows).all(), "values", "finite", value="NaN or inf")
        if representation.startswith("quaternion") and rows.ndim == 2:
            short = np.flatnonzero(np.hypot.reduce(rows, axis=1) < _LEAST_LENGTH)
            if short.size:
                raise InputError(phrase("attitude.quaternion", row=int(short[0])))
        # Partial derivatives of the rotation step with respect to the numbers.
        matrices, partials = _photocore.attitudes_from_numbers(representation, rows, boresight)
        if covariances is None:
            return cls(matrices)
        width = partials.shape[2]
        covariances = shaped("covariances", covariances, (len(matrices), width, width))
        return cls(matrices, partials @ covariances @ partials.transpose(0, 2, 1))

    def values(
        self, representation: Representation, *, mounting: Mounting | ArrayLike = "top forward"
    ) -> Floats:
        """Return the numbers of a representation: (n, 3), quaternions (n, 4), matrices (n, 3, 3).

        If two rotation axes coincide (phi of +-90 degrees, azimuth and swing of a vertical photo), one of the
        angles is zero. Quaternions have w >= 0. Arguments as in :meth:`of`.
        """
        one_of("representation", representation, get_args(Representation))
        if representation == "matrix_to_vision":
            return np.asarray(_TO_VISION @ self.matrices.transpose(0, 2, 1))
        if representation.startswith("matrix"):
            return _FROM[representation](self.matrices)
        return _photocore.numbers_of_attitudes(representation, self.matrices, _boresight(mounting))[0]

    def covariances(
        self, representation: Representation, *, mounting: Mounting | ArrayLike = "top forward"
    ) -> Floats:
        """Return the covariances of :meth:`values`, (n, k, k); NaN if two rotation axes coincide.

        For matrices, the covariances (n, 3, 3) refer to the rotation step. Arguments as in :meth:`of`.

        Raises
        ------
        InputError
            If the covariances of the attitudes are missing.
        """
        one_of("representation", representation, get_args(Representation))
        own = self.step_covariances
        if own is None:
            raise InputError(phrase("attitude.no-covariances"))
        if representation.startswith("matrix"):
            return own
        partials = _photocore.numbers_of_attitudes(representation, self.matrices, _boresight(mounting))[1]
        return np.asarray(partials @ own @ partials.transpose(0, 2, 1))

    def standard_deviations(
        self, representation: Representation, *, mounting: Mounting | ArrayLike = "top forward"
    ) -> Floats:
        """Return the standard deviations, (n, k): roots of the diagonals of :meth:`covariances`."""
        covariances = self.covariances(representation, mounting=mounting)
        return np.asarray(np.sqrt(np.einsum("nii->ni", covariances)))

    def translations(self, positions: ArrayLike) -> Floats:
        """Return t = -R C, (n, 3), for projection centres C; R = F A' as in COLMAP and OpenCV."""
        centres = shaped("positions", positions, (len(self), 3))
        return np.asarray(-np.einsum("nij,nj->ni", self.values("matrix_to_vision"), centres))

    def positions(self, translations: ArrayLike) -> Floats:
        """Return projection centres C = -R' t, (n, 3), the inverse of :meth:`translations`."""
        shifts = shaped("translations", translations, (len(self), 3))
        return np.asarray(-np.einsum("nji,nj->ni", self.values("matrix_to_vision"), shifts))


def angles_form(photo_to_ground: bool) -> Representation:
    return "omega_phi_kappa_photo_to_ground" if photo_to_ground else "omega_phi_kappa"


def known_matrices(form: Representation, angles: Floats) -> Floats:
    """Return (n, 3, 3) matrices A of (n, 3) angles; NaN for unknown ones."""
    found = np.full((len(angles), 3, 3), np.nan)
    if (known := np.isfinite(angles).all(axis=1)).any():
        found[known] = Attitudes.of(form, angles[known]).matrices
    return found


def known_angles(form: Representation, matrices: Floats) -> Floats:
    """Return (n, 3) angles of (n, 3, 3) matrices A; NaN for unknown ones."""
    found = np.full((len(matrices), 3), np.nan)
    if (known := np.isfinite(matrices).all(axis=(1, 2))).any():
        found[known] = Attitudes(matrices[known]).values(form)
    return found


_FROM: dict[str, Callable[[Floats], Floats]] = {
    "matrix": lambda a: a,
    "matrix_to_photo": lambda a: a.transpose(0, 2, 1),
    "matrix_to_vision": lambda a: a.transpose(0, 2, 1) @ _TO_VISION,
    "matrix_from_vision": lambda a: a @ _TO_VISION,
}


def _check_orthonormal(matrices: Floats) -> None:
    with np.errstate(invalid="ignore", over="ignore"):
        excess = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    bad = np.flatnonzero(~(excess <= _ORTHONORMAL))
    if bad.size:
        raise InputError(phrase("attitude.orthonormal", row=int(bad[0]), excess=float(excess[bad[0]])))
    mirrored = np.flatnonzero(np.linalg.det(matrices) < 0)
    if mirrored.size:
        raise InputError(phrase("attitude.mirrored", row=int(mirrored[0])))


def _boresight(mounting: Mounting | ArrayLike) -> Floats:
    if isinstance(mounting, str):
        known = get_args(Mounting)
        one_of("mounting", mounting, known)
        return _photocore.nadir_boresight(known.index(mounting))
    boresight = shaped("mounting", mounting, (3, 3))
    _check_orthonormal(boresight[None])
    return frozen(boresight)
