"""COMMON (unit 7): title and job definition (GIANT guide, II.B.1)."""

from __future__ import annotations

from typing import Literal

from photogram.arguments.fields import Checked
from photogram.giant.fields import format_deviations, format_real
from photogram.giant.records import Record, Source
from photogram.io.numbers import ARCSEC
from photogram.lazy_dataclasses import dataclass
from photogram.words import phrase

UnitVariance = Literal["free", "constrained", "unity"]
UNIT_VARIANCE: tuple[UnitVariance, ...] = ("free", "constrained", "unity")

SWITCHES = (
    # Column, field of Common, the digit that means True
    (1, "geographic", 1),
    (2, "photo_to_ground", 0),
    (3, "list_input_stations", 0),
    (4, "list_input_images", 0),
    (5, "list_input_control", 0),
    (6, "list_points", 0),
    (7, "save_points", 0),
    (8, "list_stations", 0),
    (9, "save_stations", 0),
    (10, "intersection_only", 1),
    (11, "error_propagation", 1),
    (13, "sort_points", 0),
    (16, "air_refraction", 1),
    (17, "water_refraction", 1),
)


@dataclass
class Common(Checked):
    """The job definition; the defaults correspond to a blank record.

    Attributes
    ----------
    title
        Record 1, the title of every page.
    geographic
        Column 1: positions are longitude, latitude, height; else X, Y, Z.
    photo_to_ground
        Column 2: the sense of the rotation angles, in and out.
    list_input_stations, list_input_images, list_input_control, list_points, list_stations
        Columns 3, 4, 5, 6, 8: contents of the listing.
    save_points, save_stations
        Columns 7, 9: whether units 9 (GROUND) and 8 (FRAMES) are written. The guide's text of column 9
        repeats column 10; 1 means "do not save".
    intersection_only
        Column 10: stations fixed, every point separately.
    error_propagation
        Column 11: whether covariances are requested.
    unit_variance
        Column 12: cameras completely free, cameras constrained, or set to unity. `unbiased_variance` replaces
        it except for results as published: `free` is too large if cameras are accurate.
    sort_points
        Column 13: points in ascending order.
    max_iterations
        Column 14, 1 to 9; blank is 4.
    strip
        Column 15: the character removed from the beginning of names, if not blank.
    air_refraction, water_refraction
        Columns 16, 17.
    convergence_percent
        Columns 18-19: the change of the weighted sum of squares, in percent, that ends the iterations; blank
        is 5.
    water_level
        Columns 31-40: metres above the ellipsoid.
    residual_limit
        Columns 41-50, millimetres: 0 lists all residuals, more only points with a residual above it, less
        none.
    semi_major, semi_minor
        Columns 51-60, 61-70: the axes of the spheroid, whose unit is the linear unit of the job; blank is
        Clarke 1866 in metres.
    control_sd
        Record 3: standard deviations of control for blanks in GROUND; radians for longitude and latitude,
        otherwise linear units; 0 is the built-in default.
    """

    title: str = ""
    geographic: bool = False
    photo_to_ground: bool = True
    list_input_stations: bool = True
    list_input_images: bool = True
    list_input_control: bool = True
    list_points: bool = True
    save_points: bool = True
    list_stations: bool = True
    save_stations: bool = True
    intersection_only: bool = False
    error_propagation: bool = False
    unit_variance: UnitVariance = "free"
    sort_points: bool = True
    max_iterations: int = 4
    strip: str = ""
    air_refraction: bool = False
    water_refraction: bool = False
    convergence_percent: int = 5
    water_level: float = 0.0
    residual_limit: float = 0.0
    semi_major: float = 6378206.4
    semi_minor: float = 6356583.8
    control_sd: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def unbiased_variance(self) -> Literal["redundancy", "constrained", "unity"]:
        """Basis of the unit variance: as in COMMON, but `redundancy` for `free`."""
        # A blank standard deviation of a station means 60,000 units: it is not an observation.
        return "redundancy" if self.unit_variance == "free" else self.unit_variance

    @property
    def default_control_sd(self) -> tuple[float, float, float]:
        """Standard deviations for blanks in GROUND: record 3, else 1 unit or 0.01 arcsec."""
        planimetry = 0.01 * ARCSEC if self.geographic else 1.0
        first, second, third = self.control_sd
        return first or planimetry, second or planimetry, third or 1.0

    @property
    def default_station_sd(self) -> tuple[float, float, float]:
        """Standard deviations for blanks of stations: 60000 units or 10 arcmin."""
        planimetry = 600 * ARCSEC if self.geographic else 60000.0
        return planimetry, planimetry, 60000.0


def parse_common(source: Source) -> Common:
    if len(source.lines) < 2:
        raise source.error(phrase("giant.two-records", count=len(source.lines)))
    job = source.record(2)
    common = Common(title=source.lines[0].strip(" "), strip=job.columns(15, 15).strip(" "))
    for column, name, true in SWITCHES:
        setattr(common, name, _digit(job, column, 1) == true)
    common.unit_variance = UNIT_VARIANCE[_digit(job, 12, 2)]
    common.max_iterations = _digit(job, 14, 9) or common.max_iterations
    common.convergence_percent = job.integer(18, 19) or common.convergence_percent
    common.water_level = job.real(31, 40)
    common.residual_limit = job.real(41, 50)
    common.semi_major = job.real(51, 60, 2) or common.semi_major
    common.semi_minor = job.real(61, 70, 2) or common.semi_minor
    # Corrected images would be corrected twice.
    if common.air_refraction:
        job.remark(phrase("giant.air-refraction"))
    if common.water_refraction:
        job.remark(phrase("giant.water-refraction", level=common.water_level))
    if common.convergence_percent < 0:
        raise job.error(phrase("giant.criterion", value=common.convergence_percent))
    if not 0 < common.semi_minor <= common.semi_major:
        raise job.error(phrase("giant.axes", minor=common.semi_minor, major=common.semi_major))
    if len(source.lines) > 2:
        deviations, angle = source.record(3), common.geographic
        common.control_sd = (
            deviations.deviation(1, 10, angle=angle),
            deviations.deviation(11, 20, angle=angle),
            deviations.deviation(21, 30),
        )
    for record in source.records():
        if record.number > 3:
            record.remark(phrase("giant.fourth-record"))
    return common


def _digit(job: Record, column: int, largest: int) -> int:
    value = job.integer(column, column)
    if not 0 <= value <= largest:
        raise job.error(phrase("giant.digit", column=column, largest=largest, value=value))
    return value


def common_records(common: Common) -> list[str]:
    if len(common.title) > 80 or not common.title.isprintable():
        raise ValueError(phrase("giant.title", value=common.title))
    if len(common.strip) > 1 or not common.strip.isprintable():
        raise ValueError(phrase("giant.strip", value=common.strip))
    if not 1 <= common.max_iterations <= 9 or not 1 <= common.convergence_percent <= 99:
        limits = {"iterations": common.max_iterations, "percent": common.convergence_percent}
        raise ValueError(phrase("giant.iteration-limits", **limits))
    digits = {column: true if getattr(common, name) else 1 - true for column, name, true in SWITCHES}
    digits |= {12: UNIT_VARIANCE.index(common.unit_variance), 14: common.max_iterations}
    job = "".join(common.strip or " " if column == 15 else str(digits[column]) for column in range(1, 18))
    job = f"{job}{common.convergence_percent:2d}".ljust(30)
    job += format_real(common.water_level, 10, 3) + format_real(common.residual_limit, 10, 3)
    job += format_real(common.semi_major, 10, 2) + format_real(common.semi_minor, 10, 2)
    records = [common.title, job]
    if any(common.control_sd):
        records.append(format_deviations(common.control_sd, (common.geographic, common.geographic, False)))
    return records
