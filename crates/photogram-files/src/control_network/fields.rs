//! Fields of points and measures: message field numbers, keys in text, column names; special numbers of ISIS.

/// Bit pattern of a missing number in ISIS.
const NULL: u64 = 0xFFEF_FFFF_FFFF_FFFB;

/// Type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Separate text in every row.
    Text,
    /// Text shared by many rows.
    Name,
    /// Word from a list; messages contain its index.
    Code(&'static [&'static str]),
    /// Yes or no; no by default.
    Truth,
    /// Number, with its unit in text.
    Number(Option<&'static str>),
    /// Upper triangle of a symmetric 3 x 3 matrix, row by row.
    Covariance,
    /// Index of a measure.
    Index,
    /// Text without a column.
    Kept,
    /// Logged numbers without a column; text uses one key per number.
    Log,
}

/// Field of a point or a measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// Field number in messages.
    pub number: u32,
    /// Key in text.
    pub key: &'static str,
    /// Name of the column.
    pub name: &'static str,
    /// Type of the field.
    pub kind: Kind,
}

const fn field(number: u32, key: &'static str, name: &'static str, kind: Kind) -> Field {
    Field { number, key, name, kind }
}

use Kind::{Code, Covariance, Index, Kept, Log, Name, Number, Text, Truth};

/// Types of points; the first two belong to old networks.
pub const POINT_TYPES: &[&str] = &["Tie", "Ground", "Free", "Constrained", "Fixed"];
/// Sources of a-priori coordinates.
const SOURCES: &[&str] =
    &["None", "User", "AverageOfMeasures", "Reference", "Ellipsoid", "DEM", "Basemap", "BundleSolution"];
/// Types of measures.
const MEASURE_TYPES: &[&str] = &["Candidate", "Manual", "RegisteredPixel", "RegisteredSubPixel"];
/// Names of the logged numbers of a measure; a message contains the index, from 1.
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

/// Field number of the measures in a point.
pub const MEASURE: u32 = 25;

/// Fields of a point, in the order of text.
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

/// Fields of a measure, in the order of text.
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

/// Decodes eight bytes, lowest first; NaN for a missing or infinite number.
pub fn number_or_absent(bytes: [u8; 8]) -> f64 {
    let value = f64::from_le_bytes(bytes);
    if value.is_finite() && value.to_bits() != NULL { value } else { f64::NAN }
}
