"""The tables of the plain project, each declared once: its columns, which it needs, what is said of it.

`python -m photogram.formats.plain.schema` prints the table of the documentation.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from photogram import _photocore
from photogram.formats.column_words import KINDS_OF_UNITS, UNITS
from photogram.formats.columns import Units
from photogram.lazy_dataclasses import dataclass, field

AXES = ("x", "y", "z")
ROTATIONS = ("rotation_x", "rotation_y", "rotation_z")
POSE = (*AXES, *ROTATIONS)
"""Components of poses: small rotations are about the axes of the photo."""
VELOCITY, RATE = ("vx", "vy", "vz"), ("rate_x", "rate_y", "rate_z")
BIAS = ("bias_x", "bias_y", "bias_z")
BASES = ("position", "rotation")
"""What a trajectory has coefficients of."""
FACTORS = ("factor_0", "factor_1", "factor_2", "factor_3")
"""Of neighbouring coefficients, whose sum was observed."""
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
OPK = ANGLES["omega_phi_kappa"]
"""That which is written."""
ALL_ANGLES = tuple(dict.fromkeys(name for names in ANGLES.values() for name in names))


def covariance_columns(names: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Return the columns of covariances between components, and which ones: `cov_xy`, `cov_x_rotation_y`."""
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

    required: tuple[str, ...]  # Columns that it must have
    texts: tuple[str, ...]  # All columns that it may have: names and words, and numbers
    numbers: tuple[str, ...]
    about: str  # What the documentation says of them
    # How many standard deviations `[sd]` may have for it; none: it has no place there
    deviations: tuple[int, ...] = ()
    # Whether its coordinates may be in another system than the frame, and its headings be those of
    # others
    has_system: bool = False
    # The column that may be there in the place of a required one
    stands_in: Mapping[str, str] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns that the table may have."""
        return self.texts + self.numbers

    def needed(self, there: Collection[str]) -> tuple[str, ...]:
        """Return the columns that a table with some columns must have."""
        return tuple(each for each in self.required if self.stands_in.get(each) not in there)


SD_AXES, SD_ROTATIONS = deviation_columns(AXES), deviation_columns(ROTATIONS)
ENDS, DIFFERENCE = ("from", "to"), ("dx", "dy", "dz")
DEVICE = ("sx", "sy", "alpha_rad")
"""Scales and obliqueness of a scanner."""
CURVES = tuple(f"{axis}{letter}" for axis in "xy" for letter in "abcdefghj")
"""Coefficients of its polynomials."""
GRID = ("grid_x", "grid_y", "grid_dx", "grid_dy", "grid_columns", "grid_rows")
"""Numbers of a pattern of shifts of nodes."""
FILM_MODELS = ("affine", "conformal", "bilinear", "projective")
BENDS = ("bend_x", "bend_y")
"""Deflections of a board."""
PITCHES = ("spacing_x", "spacing_y", "tag_size", "tag_spacing")
"""Lengths of a board."""
_SD_ANGLES = deviation_columns(ALL_ANGLES[:9])
"""Of angles about axes."""
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
        "`camera`; `model` (default `brown` with `c`, else `pinhole`), `width`, `height`, `pixel_mm`, `f` or"
        " `fx`, `fy` or `c` (positive for the positive plane; at least a tenth of `width`; a smaller one is"
        " in mm, and `pixel_mm` converts the lengths of the row to px); an unknown `f` is one unknown, in the"
        " form of the model with one focal length and equal images if there is one (`radial` for `opencv`,"
        " `agisoft_frame` for `opencv` with p1 and p2); all other parameters"
        " by the names of the model, `sd_NAME` (0 held, `inf` unknown), `for_each` (`all`, `photo`,"
        " `group`), `weights` (`corrected`, `measured`) of backward models; or `calibration` (`camera.json`"
        " of `photogram stellar-camera`: model and parameters with their covariance); of a [rolling"
        " shutter](#what-moves) `readout` (s),"
        " `sd_readout` (s; 0: known), `readout_direction` (`down`, `up`, `right`, `left`), `readout_begin`,"
        " `readout_end` (image coordinates; default: the edges of the picture), `shutter` (a name that"
        " cameras share; default: the camera's); of a [line of sensors](#what-moves) `pitch_x`, `pitch_y` (0;"
        " unit of images a sample), `x0`, `y0` (0; unit of images), `s0` (samples; default: half of `width`);"
        " the model `line` is `brown` with a line of sensors",
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
        "`photo`; `camera` (if there are several), `x`, `y`, `z`, angles by `[axes] attitude`, `sd_x` ..,"
        " `sd_omega` .. or `sd_rotation_x` .., `group`, `time` (s), `use`;"
        " of [what moves](#what-moves) `trajectory`; `rig` (if there are several), `sensor`; without a"
        " trajectory `vx` .. (0; unit of length a second), `rate_x` .. (0; rad/s), `sd_vx` .., `sd_rate_x`"
        " .. (empty: free); `time_offset` (0; s), `sd_time_offset` (s; 0: known), `clock` (a name that"
        " photos and groups share; default: the photo's), `line_rate` (a factor; 1), `sd_line_rate` (0:"
        " known), `scan` (a name that photos share; default: the photo's);"
        " of [film](film.md) `film` (its images are readings), `scanner` (if there are several), `mirrored`"
        " (default: as the marks tell), `certificate` (a file of a"
        " [certificate](certificates.md): camera and marks), `flown` (the day, as 1983-07-02; default:"
        " `[film] flown`), `start_t1`, `start_t2` (mm), `start_theta`"
        " (rad; default: as marks have them), `seam_column` or `seam_row` (of a scan that was joined of two"
        " parts: from there on is the second)",
        deviations=(1, 3),
        has_system=True,
    ),
    "images": Schema(
        ("photo", "point"),
        ("photo", "point", "use", "camera"),
        ("column", "row", "x", "y", "sd", "sd_x", "sd_y", "sd_column", "sd_row", "level", "correlation"),
        "`photo`, `point`, `column`, `row` (or `x`, `y`); `sd`, or `sd_column`, `sd_row`, or `level` l: that"
        " of `[sd]`, or 1, times 2^l; `use`; `camera` (if there are several and no table `photos`); of a line"
        " scanner sample and line",
        deviations=(1, 2),
    ),
    "points": Schema(
        ("point", *AXES),
        ("point",),
        (*AXES, *SD_AXES),
        "`point`, `x`, `y`, `z`; `sd_x` ..: initial values, may be left out altogether",
        deviations=(1, 3),
        has_system=True,
    ),
    "fiducials": Schema(
        ("camera", "fiducial", "x", "y"),
        ("camera", "fiducial", "use"),
        ("x", "y", "sd", "sd_x", "sd_y"),
        "`camera`, `fiducial`, `x`, `y` (mm, in the frame of the marks, x right and y up on the positive);"
        " `sd_x`, `sd_y` (0.002), `use`: the certificate of a film camera",
        deviations=(1, 2),
    ),
    "fiducial_images": Schema(
        ("photo", "fiducial"),
        ("photo", "fiducial", "use"),
        ("column", "row", "x", "y", "sd", "sd_x", "sd_y", "sd_column", "sd_row"),
        "`photo`, `fiducial` (empty of all of a photo: they are found), `column`, `row` (or `x`, `y`); `sd`,"
        " or `sd_column`, `sd_row`; `use`: readings of marks, as images of the photo",
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
        "`film`; `model` (`affine`, `conformal`, `bilinear`, `projective`; default: `[film] model`), `m` of"
        " the roll (0), `sd_m` (0.0005), `sd_photo_m` of single photos about it (0.0001; 0: one size),"
        " `sd_b1`, `sd_b2` (0.0001), `sd_h1`, `sd_h2` (5e-7 a mm), `sd_g1`, `sd_g2` (2e-7 a mm),"
        " `pattern` (`none`, `w1 w2`, `ebner`, `grid`, `local`: a grid of each photo), `sd_w1` .. (mm),"
        " `half_format_mm`, of grids `grid_x`, `grid_y` of the first node, `grid_dx`, `grid_dy` (mm),"
        " `grid_columns`, `grid_rows`, of local ones `sd_smooth` (mm, of second differences; `inf`)",
    ),
    "scanners": Schema(
        ("scanner", "pitch_mm", "origin_column", "origin_row"),
        ("scanner", "rows_down", "calibration"),
        (
            *("pitch_mm", "origin_column", "origin_row", *DEVICE, *CURVES, "hx", "hy"),
            *deviation_columns((*DEVICE, *CURVES)),
        ),
        "`scanner`, `pitch_mm`, `origin_column`, `origin_row`; `rows_down` (true), `Sx`, `Sy` (1),"
        " `alpha_rad` (0), `xA` .. `yJ` (0; mm) over `hx`, `hy` (1; mm), `sd_Sx` .. (0; `inf` unknown): what"
        " turns readings into true places ([comparator](comparator.md)); or `calibration` (the file of"
        " `photogram comparator --json`; the origin is then the reading at its zero)",
    ),
    "control": Schema(
        ("point",),
        ("point", "use", "cover"),
        (*AXES, "sd", *SD_AXES, *covariance_columns(AXES)),
        "`point`, one of `x`, `y`, `z`; `sd_x` .., `cov_xy`, `cov_xz`, `cov_yz`, `use` (`control`, `check`,"
        " `off`): of a check point `sd_x` .. say how good its coordinates are"
        " ([tests](tests.md#check-points)); `[sd]` has `check` for these; `cover` (`open`, `vegetated`) of"
        " check points: heights in vegetation are stated apart",
        deviations=(1, 3),
        has_system=True,
    ),
    "distances": Schema(
        (*ENDS, "distance"),
        (*ENDS, "instrument"),
        ("distance", "sd"),
        "`from`, `to`, `distance`; `sd`, `instrument`",
        deviations=(1,),
    ),
    "ranges": Schema(
        ("photo", "point", "range"),
        ("photo", "trajectory", "point", "instrument", "clock"),
        ("range", "sd", "time", "lever_x", "lever_y", "lever_z", *_CLOCK),
        "`photo`, or `trajectory` and `time` (s), `point`, `range`; `sd`, `lever_x` .. (0; unit of length,"
        " from the projection centre to the rangefinder, in the axes of the photo), `instrument`; of records"
        " of trajectories `time_offset` (0; s), `sd_time_offset` (s; 0: known), `clock` (a name that groups"
        " and photos share; default: `ranges`)",
        deviations=(1,),
        stands_in={"photo": "trajectory"},
    ),
    "lengths": Schema(
        ("line", *ENDS, "length"),
        ("line", *ENDS),
        ("length", "sd", "temperature"),
        "`line`, `from`, `to`, `length`; `sd`, `temperature` (degrees Celsius): calibrated lengths, on the"
        " lines of VDI/VDE 2634; no observations: the statement holds adjusted ones against them",
        deviations=(1,),
    ),
    "instruments": Schema(
        ("instrument",),
        ("instrument",),
        ("scale", "constant", "sd_scale", "sd_constant"),
        "`instrument`; `scale` (1), `constant` (0), `sd_scale`, `sd_constant` (empty: free)",
    ),
    "height_differences": Schema(
        (*ENDS, "dz"),
        ENDS,
        ("dz", "sd"),
        "`from`, `to`, `dz`; `sd`: levelled heights, above the ellipsoid in geographic space",
        deviations=(1,),
    ),
    "coordinate_differences": Schema(
        (*ENDS, *DIFFERENCE),
        ENDS,
        (*DIFFERENCE, "sd", *deviation_columns(DIFFERENCE), *covariance_columns(DIFFERENCE)),
        "`from`, `to`, `dx`, `dy`, `dz` (empty: not observed); `sd`, `sd_dx` .., `cov_dx_dy` ..",
        deviations=(1, 3),
    ),
    "levels": Schema(("level",), ("level",), ("z", "sd"), "`level`; `z`, `sd`"),
    "level_points": Schema(
        ("level", "point"),
        ("level", "point"),
        ("dz", "sd"),
        "`level`, `point`; `dz` above it (0), `sd`",
        deviations=(1,),
    ),
    "planes": Schema(
        ("plane",),
        ("plane",),
        (*AXES, "nx", "ny", "nz", "sd_distance", "sd_rotation_x", "sd_rotation_y"),
        "`plane`; `x`, `y`, `z` of a place, `nx`, `ny`, `nz` of the normal, `sd_distance`, `sd_rotation_x`,"
        " `sd_rotation_y`",
    ),
    "plane_points": Schema(
        ("plane", "point"),
        ("plane", "point"),
        ("distance", "sd"),
        "`plane`, `point`; `distance` from it along the normal (0), `sd`",
        deviations=(1,),
    ),
    "lines": Schema(
        ("line",),
        ("line",),
        (*AXES, *DIFFERENCE, "sd_x", "sd_y", "sd_rotation_x", "sd_rotation_y"),
        "`line`; `x`, `y`, `z` of a place, `dx`, `dy`, `dz` of the direction, `sd_x`, `sd_y`,"
        " `sd_rotation_x`, `sd_rotation_y`",
    ),
    "line_points": Schema(
        ("line", "point"),
        ("line", "point"),
        _ACROSS,
        "`line`, `point`; `sd`, or `sd_x`, `sd_y` across it, `cov_xy`",
        deviations=(1,),
    ),
    "plumb_lines": Schema(
        ("plumb_line",),
        ("plumb_line",),
        (*AXES, "sd_x", "sd_y"),
        "`plumb_line`; `x`, `y`, `z` of a place, `sd_x`, `sd_y`",
    ),
    "plumb_line_points": Schema(
        ("plumb_line", "point"),
        ("plumb_line", "point"),
        _ACROSS,
        "`plumb_line`, `point`; `sd`, or `sd_x`, `sd_y`, `cov_xy`",
        deviations=(1,),
    ),
    "trajectories": Schema(
        ("trajectory",),
        ("trajectory", *BASES, "interpolation", "attitude_interpolation", "position_axes", "angles"),
        _OF_BASES,
        "`trajectory`; `position`, `rotation`: what its corrections are (`polynomial`, `spline`, `none`);"
        " `interpolation` of positions (`linear`, `hermite`, `lagrange`), `attitude_interpolation` (`linear`,"
        " `lagrange`); `position_axes` of its corrections (`table`; `orbit`: along, across, radial; `flight`:"
        " along, across, up), `angles` of its corrections (`vector`, `zxz`); and for each of both, as"
        " `position_degree`, `rotation_degree`: `_degree` (0, of splines 3), `_every` (s between knots),"
        " `_reference`, `_scale` (s, of polynomials; default: middle and half of the records), `_smooth` (1,"
        " 2, 3: differences of this order are 0), `_correlation` (s, of a process of Gauss and Markov);"
        " `sd_position` (unit of length), `sd_rotation` (angle) of every"
        " coefficient (0: known; empty: free, or `[sd] trajectories`), `sd_position_smooth`,"
        " `sd_position_correlation`, `sd_rotation_smooth`, `sd_rotation_correlation` (the same units)",
        deviations=(2,),
    ),
    "trajectory_positions": Schema(
        ("trajectory", "time", *AXES),
        ("trajectory",),
        ("time", *AXES, *VELOCITY),
        "`trajectory`, `time` (s), `x`, `y`, `z`: of projection centres; `vx`, `vy`, `vz` (unit of length a"
        " second) for `hermite`",
    ),
    "trajectory_attitudes": Schema(
        ("trajectory", "time"),
        ("trajectory",),
        ("time", *ALL_ANGLES),
        "`trajectory`, `time` (s), angles by `[axes] attitude`",
    ),
    "trajectory_knots": Schema(
        ("trajectory", "of", "knot"),
        ("trajectory", "of"),
        ("knot",),
        "`trajectory`, `of` (`position`, `rotation`), `knot` (s): all knots, in the place of `_every`",
    ),
    "trajectory_coefficients": Schema(
        ("trajectory", "of", "k"),
        ("trajectory", "of"),
        ("k", *AXES, *SD_AXES),
        "`trajectory`, `of` (`position`, `rotation`), `k` (from 0); `x`, `y`, `z` (0), `sd_x` .. (default:"
        " as `trajectories` says): in the unit of length, or of angles",
    ),
    "smoothness": Schema(
        ("trajectory", "of", "k", FACTORS[0]),
        ("trajectory", "of"),
        ("k", *FACTORS, *AXES, "sd", *SD_AXES, *covariance_columns(AXES)),
        "`trajectory`, `of`, `k` of the first of neighbouring coefficients, `factor_0` .. `factor_3`: their"
        " sum was observed as `x`, `y`, `z` (0); `sd`, `sd_x` .., `cov_xy` .. in the units of coefficients;"
        " beside `_smooth` and `_correlation`, in the place of these where it has all their coefficients",
    ),
    "body_rotations": Schema(
        ("trajectory", "time"),
        ("trajectory",),
        ("time", *ALL_ANGLES),
        "`trajectory`, `time` (s), angles of the body's axes in those of the positions, where these are"
        " inertial and the body turns",
    ),
    "line_times": Schema(
        ("photo", "line", "time", "seconds_per_line"),
        ("photo",),
        ("line", "time", "seconds_per_line"),
        "`photo`, `line` (first of those that follow; 0: the upper edge), `time` (s), `seconds_per_line`:"
        " the photo is a line scanner's",
    ),
    "gnss": Schema(
        ("photo", *AXES),
        ("photo", "trajectory", "group"),
        (*AXES, "sd", *SD_AXES, *covariance_columns(AXES), "time"),
        "`photo`, or `trajectory` and `time` (s), `x`, `y`, `z`; `sd`, `sd_x` .., `cov_xy` .., `group`,"
        " `time` of a photo, for drifts",
        deviations=(1, 3),
        has_system=True,
        stands_in={"photo": "trajectory"},
    ),
    "velocities": Schema(
        ("photo", *VELOCITY),
        ("photo", "trajectory", "group"),
        ("time", *VELOCITY, "sd", *deviation_columns(VELOCITY), *covariance_columns(VELOCITY)),
        "`photo`, or `trajectory` and `time` (s), `vx`, `vy`, `vz` (unit of length a second); `sd`, `sd_vx`"
        " .., `cov_vx_vy` .., `group` (of `gnss_groups`: its lever arm and clock)",
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "gnss_groups": Schema(
        ("group",),
        ("group", "lever", "shift", "drift", "drift_epoch", "clock"),
        (*_COMMON, *_CLOCK),
        "`group`; `lever` (a name that groups share; default: the group's), `lever_x` .., `sd_lever_x` .. (0:"
        " known), `shift`, `drift` (true, false, or a name that groups share), `shift_x` .., `drift_x` ..,"
        " `sd_shift_x` .., `sd_drift_x` .. (empty: free), `drift_epoch` (the time that a drift counts from;"
        " empty: the mean time of its observations); of records of trajectories `time_offset` (0; s),"
        " `sd_time_offset` (s; 0: known), `clock` (a name that groups and photos share; default: the"
        " group's)",
    ),
    "attitudes": Schema(
        ("photo",),
        ("photo", "trajectory", "group"),
        ("time", *ALL_ANGLES, *_SD_ANGLES, *SD_ROTATIONS, *covariance_columns(ROTATIONS)),
        "`photo`, or `trajectory` and `time` (s), angles; `sd_rotation_x` .., `cov_rotation_x_rotation_y` ..,"
        " `group`",
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "rates": Schema(
        ("photo", *RATE),
        ("photo", "trajectory", "group"),
        ("time", *RATE, "sd", *deviation_columns(RATE), *covariance_columns(RATE)),
        "`photo`, or `trajectory` and `time` (s), `rate_x`, `rate_y`, `rate_z` (rad/s, axes of the body);"
        " `sd`, `sd_rate_x` .., `cov_rate_x_rate_y` .., `group` (of `attitude_groups`)",
        deviations=(1, 3),
        stands_in={"photo": "trajectory"},
    ),
    "attitude_groups": Schema(
        ("group",),
        ("group", "boresight", "clock", "bias"),
        (*ALL_ANGLES, *SD_ROTATIONS, *_CLOCK, *BIAS, *deviation_columns(BIAS)),
        "`group`; angles of the boresight (empty: from photos and attitudes), `sd_rotation_x` .. (empty:"
        " free), `boresight` (true, false, or a name that groups share); of records of trajectories"
        " `time_offset`, `sd_time_offset`, `clock` as in `gnss_groups`; of rates `bias` (true, false, or a"
        " name that groups share), `bias_x` .. (0; rad/s), `sd_bias_x` .. (empty: free)",
    ),
    "relative_poses": Schema(
        (*ENDS, *AXES),
        ENDS,
        (*AXES, *ALL_ANGLES, *SD_AXES, *SD_ROTATIONS, *covariance_columns(POSE)),
        "`from`, `to` (photos), `x`, `y`, `z`, angles: the second photo in the axes of the first; `sd_x` ..,"
        " `sd_rotation_x` .., `cov_xy` .., `cov_x_rotation_z` ..",
    ),
    "rigs": Schema(
        ("rig",),
        ("rig", "camera", "sensor", "clock"),
        (*AXES, *ALL_ANGLES, *SD_AXES, *SD_ROTATIONS, *_CLOCK),
        "`rig`, `camera` or `sensor`; `x`, `y`, `z`, angles, `sd_x` .., `sd_rotation_x` ..; the first row of"
        " a rig is its reference, a row with no numbers an unknown sensor; of sensors whose photos are on"
        " trajectories and say none of their own `time_offset` (0; s), `sd_time_offset` (s; 0: known),"
        " `clock` (its name)",
    ),
    "frames": Schema(
        ("frame", "rig", "photo"),
        ("frame", "rig", "photo", "sensor"),
        ("time",),
        "`frame`, `rig`, `photo`; `sensor`, where the photo's camera does not tell it; `time` (s) of the"
        " photos of a board, where `photos` say none",
    ),
    "boards": Schema(
        ("board", "kind"),
        ("board", "kind", "shape", "regularise"),
        (
            *("columns", "rows", *PITCHES),
            *(*BENDS, *deviation_columns(BENDS)),
        ),
        "`board`, `kind` (`chessboard`, `charuco`, `aprilgrid`, `circles`, `asymmetric_circles`, `points`):"
        " what the control is the points of ([targets](targets.md)); `columns`, `rows`, `spacing_x`,"
        " `spacing_y`, or `tag_size`, `tag_spacing`; `shape` (`held`, `bend`, `points`);"
        " of a `bend` the deflections `bend_x`, `bend_y` (0), `sd_bend_x`, `sd_bend_y` (`inf`); `regularise`"
        " (`mrcal`): the weak priors that `photogram calibrate` adds to its cameras",
    ),
    "knots": Schema(
        ("camera", "i", "j", "dx", "dy"),
        ("camera",),
        ("i", "j", "dx", "dy", "sd_radial", "sd_tangential"),
        "`camera`, a splined one; `i`, `j` of a knot along columns and rows, from 0; `dx`, `dy`, `sd_radial`,"
        " `sd_tangential` (0: known): in units of its stereographic image, observed as 0 where weighted",
    ),
    "bases": Schema(
        ("rig", *ENDS, "distance"),
        ("rig", *ENDS),
        ("distance", "sd"),
        "`rig`, `from`, `to` (cameras or sensors), `distance`; `sd`",
        deviations=(1,),
    ),
    "covariances": Schema(
        ("kind", "name", "first", "second", "covariance"),
        ("kind", "name", "first", "second"),
        ("covariance",),
        "`kind`, `name`, `first`, `second`, `covariance`: what was determined together of a `camera`"
        " (parameters), or of a `lever arm`, `shift`, `drift`, `boresight`, `instrument`, `level`, `plane`,"
        " `line`, `plumb line`, `sensor`, `bend` (of a board: x, y), `gyro bias`, `position coefficient`,"
        " `rotation coefficient` (components as [observations](observations.md) call them); one triangle with"
        " its diagonal, what is missing is 0",
    ),
}
"""In the order in which they are read and written."""

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
    """Return kind and size of the unit of each column of numbers of a table, by the units of a project."""
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


if __name__ == "__main__":
    print("| table | columns (required ones first) |\n| --- | --- |")
    print("\n".join(f"| `{name}` | {each.about} |" for name, each in TABLES.items()))
