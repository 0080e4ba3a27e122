//! What points and measures consist of: numbers of fields in messages, keys of text, names of columns.

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A text of its own in every row.
    Text,
    /// A text that many rows have in common.
    Name,
    /// One of so many words; in messages its place among them.
    Code(&'static [&'static str]),
    /// Yes or no, no where it is not said.
    Truth,
    /// A number, with the unit that text gives it.
    Number(Option<&'static str>),
    /// The upper triangle of a symmetric matrix of three rows, row by row.
    Covariance,
    /// The index of a measure.
    Index,
    /// A text without a column.
    Kept,
    /// Numbers that a program has left, without a column: in text by keys of their own.
    Log,
}

/// A field of a point or a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Its number in messages.
    pub number: u32,
    /// Its key in text.
    pub key: &'static str,
    /// The name of its column.
    pub name: &'static str,
    /// What it holds.
    pub kind: Kind,
}

const fn field(number: u32, key: &'static str, name: &'static str, kind: Kind) -> Field {
    Field { number, key, name, kind }
}

use Kind::{Code, Covariance, Index, Kept, Log, Name, Number, Text, Truth};

/// Types of points; the first two are those of old networks.
pub const POINT_TYPES: &[&str] = &["Tie", "Ground", "Free", "Constrained", "Fixed"];
/// Where a-priori coordinates are from.
const SOURCES: &[&str] =
    &["None", "User", "AverageOfMeasures", "Reference", "Ellipsoid", "DEM", "Basemap", "BundleSolution"];
/// Types of measures.
const MEASURE_TYPES: &[&str] = &["Candidate", "Manual", "RegisteredPixel", "RegisteredSubPixel"];
/// The numbers of a log of a measure; what a message says is the place among them, from 1.
pub const LOGS: &[&str] = &[
    "Eccentricity",
    "GoodnessOfFit",
    "MinimumPixelZScore",
    "MaximumPixelZScore",
    "PixelShift",
    "WholePixelCorrelation",
    "SubPixelCorrelation",
    "AverageResidual",
];
const METERS: Kind = Number(Some("meters"));
const PIXELS: Kind = Number(Some("pixels"));

/// The field of a point that holds a measure.
pub const MEASURE: u32 = 25;

/// The fields of a point, in the order of text.
pub static POINT: &[Field] = &[
    field(2, "PointType", "types", Code(POINT_TYPES)),
    field(1, "PointId", "ids", Text),
    field(3, "ChooserName", "", Kept),
    field(4, "DateTime", "", Kept),
    field(5, "EditLock", "edit_lock", Truth),
    field(6, "Ignore", "ignore", Truth),
    field(7, "JigsawRejected", "rejected", Truth),
    field(8, "ReferenceIndex", "reference", Index),
    field(9, "AprioriXYZSource", "apriori_source", Code(SOURCES)),
    field(10, "AprioriXYZSourceFile", "", Kept),
    field(11, "AprioriRadiusSource", "apriori_radius_source", Code(SOURCES)),
    field(12, "AprioriRadiusSourceFile", "", Kept),
    field(16, "AprioriX", "apriori_x", METERS),
    field(17, "AprioriY", "apriori_y", METERS),
    field(18, "AprioriZ", "apriori_z", METERS),
    field(19, "AprioriCovarianceMatrix", "apriori_covariance", Covariance),
    field(13, "LatitudeConstrained", "latitude_constrained", Truth),
    field(14, "LongitudeConstrained", "longitude_constrained", Truth),
    field(15, "RadiusConstrained", "radius_constrained", Truth),
    field(20, "AdjustedX", "adjusted_x", METERS),
    field(21, "AdjustedY", "adjusted_y", METERS),
    field(22, "AdjustedZ", "adjusted_z", METERS),
    field(23, "AdjustedCovarianceMatrix", "adjusted_covariance", Covariance),
];

/// The fields of a measure, in the order of text.
pub static MEASURES: &[Field] = &[
    field(1, "SerialNumber", "serial", Name),
    field(2, "MeasureType", "types", Code(MEASURE_TYPES)),
    field(7, "ChooserName", "", Kept),
    field(8, "DateTime", "", Kept),
    field(9, "EditLock", "edit_lock", Truth),
    field(10, "Ignore", "ignore", Truth),
    field(3, "Sample", "sample", Number(None)),
    field(4, "Line", "line", Number(None)),
    field(12, "Diameter", "diameter", Number(None)),
    field(13, "AprioriSample", "apriori_sample", Number(None)),
    field(14, "AprioriLine", "apriori_line", Number(None)),
    field(15, "SampleSigma", "sample_sigma", PIXELS),
    field(16, "LineSigma", "line_sigma", PIXELS),
    field(5, "SampleResidual", "sample_residual", PIXELS),
    field(6, "LineResidual", "line_residual", PIXELS),
    field(11, "JigsawRejected", "rejected", Truth),
    field(17, "", "", Log),
];
