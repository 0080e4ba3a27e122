"""Tables of the plain project (docs/formats/plain-tables.md)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from photogram import _photocore
from photogram.formats.column_words import KINDS_OF_UNITS, UNITS
from photogram.formats.columns import Units
from photogram.lazy_dataclasses import dataclass, field

AXES = ("x", "y", "z")
ROTATIONS = ("rotation_x", "rotation_y", "rotation_z")
POSE = (*AXES, *ROTATIONS)  # Components of poses: small rotations are about the axes of the photo
VELOCITY, RATE = ("vx", "vy", "vz"), ("rate_x", "rate_y", "rate_z")
BIAS = ("bias_x", "bias_y", "bias_z")
BASES = ("position", "rotation")  # Corrections of a trajectory
FACTORS = ("factor_0", "factor_1", "factor_2", "factor_3")
"""Factors of neighbouring coefficients in an observed sum."""
ANGLES: Mapping[str, tuple[str, ...]] = {
    "omega_phi_kappa": ("omega", "phi", "kappa"),
    "phi_omega_kappa": ("phi", "omega", "kappa"),
    "yaw_pitch_roll": ("yaw", "pitch", "roll"),
    "azimuth_tilt_swing": ("azimuth", "tilt", "swing"),
    "quaternion": ("qw", "qx", "qy", "qz"),
    "rotation_vector": ("rx", "ry", "rz"),
    "matrix": ("m11", "m12", "m13", "m21", "m22", "m23", "m31", "m32", "m33"),
}
"""Columns of each representation of attitudes."""
OPK = ANGLES["omega_phi_kappa"]  # Representation in written files
ALL_ANGLES = tuple(dict.fromkeys(name for names in ANGLES.values() for name in names))


def covariance_columns(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return covariance columns by index pair: `cov_xy`, `cov_x_rotation_y`."""
    return {
        f"cov_{names[i]}{names[j]}" if len(names[i] + names[j]) == 2 else f"cov_{names[i]}_{names[j]}": (i, j)
        for j in range(len(names))
        for i in range(j)
    }


def deviation_columns(names: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of standard deviations of components."""
    return tuple(f"sd_{name}" for name in names)


@dataclass(frozen=True)
class Schema:
    """A table."""

    required: tuple[str, ...]  # Required columns
    texts: tuple[str, ...]  # Allowed columns: names and words, and numbers
    numbers: tuple[str, ...]
    # Allowed numbers of standard deviations in `[sd]`; empty: not allowed
    deviations: tuple[int, ...] = ()
    # Whether coordinates may be in another system than the frame, with other headings
    has_system: bool = False
    # Alternatives to required columns
    stands_in: Mapping[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[str, ...]:
        """All allowed columns."""
        return self.texts + self.numbers

    def needed(self, there: Collection[str]) -> tuple[str, ...]:
        """Return the required columns of a table that has some columns."""
        return tuple(each for each in self.required if self.stands_in.get(each) not in there)


SD_AXES, SD_ROTATIONS = deviation_columns(AXES), deviation_columns(ROTATIONS)
ENDS, DIFFERENCE = ("from", "to"), ("dx", "dy", "dz")
DEVICE = ("sx", "sy", "alpha_rad")  # Scales and obliqueness of a scanner
CURVES = tuple(f"{axis}{letter}" for axis in "xy" for letter in "abcdefghj")
"""Coefficients of its polynomials."""
GRID = ("grid_x", "grid_y", "grid_dx", "grid_dy", "grid_columns", "grid_rows")
"""Numbers of a pattern of shifts of nodes."""
FILM_MODELS = ("affine", "conformal", "bilinear", "projective")
BENDS = ("bend_x", "bend_y")  # Deflections of a board
PITCHES = ("spacing_x", "spacing_y", "tag_size", "tag_spacing")  # Lengths of a board
_SD_ANGLES = deviation_columns(ALL_ANGLES[:9])  # For angles about axes
_PARAMETERS = tuple(sorted({name.lower() for _, facts in _photocore.camera_models() for name, _ in facts[1]}))
_ACROSS = ("sd", "sd_x", "sd_y", "cov_xy")
_CLOCK = ("time_offset", "sd_time_offset")
_OF_BASES = tuple(
    name
    for of in BASES
    for name in (
        *(f"{of}_{what}" for what in ("degree", "every", "reference", "scale")),
        *(f"{sd}{of}{what}" for sd in ("", "sd_") for what in ("_smooth", "_correlation")),
        f"sd_{of}",
    )
)
_COMMON = tuple(
    f"{sd}{kind}_{axis}" for kind in ("lever", "shift", "drift") for sd in ("", "sd_") for axis in AXES
)

TABLES: Mapping[str, Schema] = {
    "cameras": Schema(
        ("camera",),
        ("camera", "model", "for_each", "weights", "calibration", "shutter", "readout_direction"),
        (
            *("width", "height", "pixel_mm", *_PARAMETERS, *deviation_columns(_PARAMETERS)),
            *("readout", "sd_readout", "readout_begin", "readout_end", "pitch_x", "pitch_y"),
        ),
    ),
    "photos": Schema(
        ("photo",),
        (
            *("photo", "camera", "group", "strip", "frame", "use"),
            *("trajectory", "rig", "sensor", "clock", "scan"),
            *("film", "scanner", "mirrored", "certificate", "flown"),
        ),
        (
            *(*AXES, *ALL_ANGLES, *SD_AXES, *_SD_ANGLES, *SD_ROTATIONS, "time"),
            *(*VELOCITY, *RATE, *deviation_columns((*VELOCITY, *RATE))),
            *(*_CLOCK, "line_rate", "sd_line_rate"),
            *("start_t1", "start_t2", "start_theta", "seam_column", "seam_row"),
        ),
        deviations=(1, 3),
        has_system=True,
    ),
    "images": Schema(
        ("photo", "point"),
        ("photo", "point", "use", "camera"),
        ("column", "row", "x", "y", "sd", "sd_x", "sd_y", "sd_column", "sd_row", "level", "correlation"),
        deviations=(1, 2),
    ),
    "points": Schema(
        ("point", *AXES),
        ("point",),
        (*AXES, *SD_AXES),
        deviations=(1, 3),
        has_system=True,
    ),
    "fiducials": Schema(
        ("camera", "fiducial", "x", "y"),
        ("camera", "fiducial", "use"),
        ("x", "y", "sd", "sd_x", "sd_y"),
        deviations=(1, 2),
    ),
    "fiducial_images": Schema(
        ("photo", "fiducial"),
        ("photo", "fiducial", "use"),
        ("column", "row", "x", "y", "sd", "sd_x", "sd_y", "sd_column", "sd_row"),
        deviations=(1, 2),
    ),
    "films": Schema(
        ("film",),
        ("film", "model", "pattern"),
        (
            *("m", "sd_m", "sd_photo_m", "sd_b1", "sd_b2", "sd_h1", "sd_h2", "sd_g1", "sd_g2"),
            *("half_format_mm", *GRID),
            *(*(f"sd_w{k}" for k in range(1, 11)), "sd_smooth"),
        ),
    ),
    "scanners": Schema(
        ("scanner", "pitch_mm", "origin_column", "origin_row"),
        ("scanner", "rows_down", "calibration"),
        (
            *("pitch_mm", "origin_column", "origin_row", *DEVICE, *CURVES, "hx", "hy"),
            *deviation_columns((*DEVICE, *CURVES)),
        ),
    ),
    "control": Schema(
        ("point",),
        ("point", "use", "cover"),
        (*AXES, "sd", *SD_AXES, *covariance_columns(AXES)),
        deviations=(1, 3),
        has_system=True,
    ),
    "distances": Schema(
        (*ENDS, "distance"),
        (*ENDS, "instrument"),
        ("distance", "sd"),
        deviations=(1,),
    ),
    "ranges": Schema(
        ("photo", "point", "range"),
        ("photo", "trajectory", "point", "instrument", "clock"),
        ("range", "sd", "time", "lever_x", "lever_y", "lever_z", *_CLOCK),
        deviations=(1,),
        stands_in={"photo": "trajectory"},
    ),
    "lengths": Schema(
        ("line", *ENDS, "length"),
        ("line", *ENDS),
        ("length", "sd", "temperature"),
        deviations=(1,),
    ),
    "instruments": Schema(
        ("instrument",),
        ("instrument",),
        ("scale", "constant", "sd_scale", "sd_constant"),
    ),
    "height_differences": Schema(
        (*ENDS, "dz"),
        ENDS,
        ("dz", "sd"),
        deviations=(1,),
    ),
    "coordinate_differences": Schema(
        (*ENDS, *DIFFERENCE),
        ENDS,
        (*DIFFERENCE, "sd", *deviation_columns(DIFFERENCE), *covariance_columns(DIFFERENCE)),
        deviations=(1, 3),
    ),
    "levels": Schema(("level",), ("level",), ("z", "sd")),
    "level_points": Schema(
        ("level", "point"),
        ("level", "point"),
        ("dz", "sd"),
        deviations=(1,),
    ),
    "planes": Schema(
        ("plane",),
        ("plane",),
        (*AXES, "nx", "ny", "nz", "sd_distance", "sd_rotation_x", "sd_rotation_y"),
    ),
    "plane_points": Schema(
        ("plane", "point"),
        ("plane", "point"),
        ("distance", "sd"),
        deviations=(1,),
    ),
    "lines": Schema(
        ("line",),
        ("line",),
        (*AXES, *DIFFERENCE, "sd_x", "sd_y", "sd_rotation_x", "sd_rotation_y"),
    ),
    "line_points": Schema(
        ("line", "point"),
        ("line", "point"),
        _ACROSS,
        deviations=(1,),
    ),
    "plumb_lines": Schema(
        ("plumb_line",),
        ("plumb_line",),
        (*AXES, "sd_x", "sd_y"),
    ),
    "plumb_line_points": Schema(
        ("plumb_line", "point"),
        ("plumb_line", "point"),
        _ACROSS,
        deviations=(1,),
    ),
    "trajectories": Schema(
        ("trajectory",),
        ("trajectory", *BASES, "interpolation", "attitude_interpolation", "position_axes", "angles"),
        _OF_BASES,
        deviations=(2,),
    ),
    "trajectory_positions": Schema(
        ("trajectory", "time", *AXES),
        ("trajectory",),
        ("time", *AXES, *VELOCITY),
    ),
    "trajectory_attitudes": Schema(
        ("trajectory", "time"),
        ("trajectory",),
        ("time", *ALL_ANGLES),
    ),
    "trajectory_knots": Schema(
        ("trajectory", "of", "knot"),
        ("trajectory", "of"),
        ("knot",),
    ),
    "trajectory_coefficients": Schema(
        ("trajectory", "of", "k"),
        ("trajectory", "of"),
        ("k", *AXES, *SD_AXES),
    ),
    "smoothness": Schema(
        ("trajectory", "of", "k", FACTORS[0]),
        ("trajectory", "of"),
        ("k", *FACTORS, *AXES, "sd", *SD_AXES, *covariance_columns(AXES)),
    ),
    "body_rotations": Schema(
        ("trajectory", "time"),
        ("trajectory",),
        ("time", *ALL_ANGLES),
    ),
    "line_times": Schema(
        ("photo", "line", "time", "seconds_per_line"),
        ("photo",),
        ("line", "time", "seconds_per_line"),
    ),
    "gnss": Schema(
        ("photo", *AXES),
        ("photo", "trajectory", "group"),
        (*AXES, "sd", *SD_AXES, *covariance_columns(AXES), "time"),
        deviations=(1, 3),
        has_system=True,
        stands_in={"photo": "trajectory"},
    ),
    "velocities": Schema(
        ("photo", *VELOCITY),
        ("photo", "trajectory", "group"),
        ("time", *VELOCITY, "sd", *deviation_columns(VELOCITY), *covariance_columns(VELOCITY)),
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "gnss_groups": Schema(
        ("group",),
        ("group", "lever", "shift", "drift", "drift_epoch", "clock"),
        (*_COMMON, *_CLOCK),
    ),
    "attitudes": Schema(
        ("photo",),
        ("photo", "trajectory", "group"),
        ("time", *ALL_ANGLES, *_SD_ANGLES, *SD_ROTATIONS, *covariance_columns(ROTATIONS)),
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "rates": Schema(
        ("photo", *RATE),
        ("photo", "trajectory", "group"),
        ("time", *RATE, "sd", *deviation_columns(RATE), *covariance_columns(RATE)),
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "attitude_groups": Schema(
        ("group",),
        ("group", "boresight", "clock", "bias"),
        (*ALL_ANGLES, *SD_ROTATIONS, *_CLOCK, *BIAS, *deviation_columns(BIAS)),
    ),
    "relative_poses": Schema(
        (*ENDS, *AXES),
        ENDS,
        (*AXES, *ALL_ANGLES, *SD_AXES, *SD_ROTATIONS, *covariance_columns(POSE)),
    ),
    "rigs": Schema(
        ("rig",),
        ("rig", "camera", "sensor", "clock"),
        (*AXES, *ALL_ANGLES, *SD_AXES, *SD_ROTATIONS, *_CLOCK),
    ),
    "frames": Schema(
        ("frame", "rig", "photo"),
        ("frame", "rig", "photo", "sensor"),
        ("time",),
    ),
    "boards": Schema(
        ("board", "kind"),
        ("board", "kind", "shape", "regularise"),
        (
            *("columns", "rows", *PITCHES),
            *(*BENDS, *deviation_columns(BENDS)),
        ),
    ),
    "knots": Schema(
        ("camera", "i", "j", "dx", "dy"),
        ("camera",),
        ("i", "j", "dx", "dy", "sd_radial", "sd_tangential"),
    ),
    "bases": Schema(
        ("rig", *ENDS, "distance"),
        ("rig", *ENDS),
        ("distance", "sd"),
        deviations=(1,),
    ),
    "covariances": Schema(
        ("kind", "name", "first", "second", "covariance"),
        ("kind", "name", "first", "second"),
        ("covariance",),
    ),
}
"""Tables in the order of reading and writing."""

_OF_IMAGES = ("images", "fiducial_images")
_IMAGE_UNITS = frozenset(("f", "fx", "fy", "c", "cx", "cy", "x0", "y0"))
"""Parameters of cameras in the unit of images."""
_OTHER_UNITS = frozenset(
    (
        "rates",
        "velocities",
        "smoothness",
        "trajectory_coefficients",
        "films",
        "scanners",
        "knots",
        "covariances",
    )
)
"""Tables without one unit for all lengths."""
_LENGTHS = frozenset(
    (
        *(*AXES, *DIFFERENCE, *BENDS, *PITCHES, "distance", "range", "length", "constant"),
        *(f"{kind}_{axis}" for kind in ("lever", "shift") for axis in AXES),
    )
)
_ANGLES = frozenset((*ALL_ANGLES[:9], *ROTATIONS))


def column_units(name: str, length: str = "m", angle: str = "deg", image: str = "px") -> Units:
    """Return unit type and size of each numeric column of a table."""
    metres, radians = UNITS[length], KINDS_OF_UNITS["angle"].get(angle, KINDS_OF_UNITS["angle"]["deg"])
    of_image = ("pixel", 1.0) if image == "px" else ("length", UNITS[image])
    found = dict.fromkeys(TABLES[name].numbers, ("", 1.0))
    for column in found:
        value = column.removeprefix("sd_")
        if name in _OF_IMAGES or (name == "cameras" and value in _IMAGE_UNITS):
            found[column] = of_image if value not in ("level", "correlation") else ("", 1.0)
        elif name == "fiducials":
            found[column] = "length", UNITS["mm"]
        elif value in ("time", "time_offset", "readout"):
            found[column] = "time", 1.0
        elif name in _OTHER_UNITS or name == "cameras":
            continue
        elif value in _LENGTHS or value == "sd":
            found[column] = "length", metres
        elif value in _ANGLES:
            found[column] = "angle", radians
    return found
