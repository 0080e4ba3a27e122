//! Facts beside the network that hypotheses require.

/// Facts beside the network that hypotheses require; each may be empty.
#[derive(Debug, Clone, Default)]
pub struct Facts {
    /// Velocity of each photo in Cartesian axes (geocentric in geographic space), per second or per any other unit of time; NaN if
    /// unknown.
    pub velocities: Vec<[f64; 3]>,
    /// Time of each photo, for a drift of positions; NaN if unknown.
    pub times: Vec<f64>,
    /// Observed position of each photo; NaN, or empty, if unknown.
    pub observed: Vec<[f64; 3]>,
    /// Set of positions (strip, day, receiver) of each photo.
    pub position_sets: Vec<Option<usize>>,
    /// Set of control (file, standard deviation, day) of each point.
    pub control_sets: Vec<Option<usize>>,
    /// For each camera the time of image coordinates x, y within the readout of the whole image, from -1/2 to 1/2: a x + b y + c, if rows
    /// are read one after the other, and if columns are; fewer if impossible.
    pub readouts: Vec<Vec<[f64; 3]>>,
    /// Width of the image of each camera, in its unit; NaN if unknown.
    pub widths: Vec<f64>,
    /// Photos that are tested for a shift of all their images.
    pub photos: Vec<usize>,
    /// Check points, and other points whose changes are reported.
    pub checks: Vec<usize>,
    /// Number of check points with known differences, which are the first of these.
    pub compared: usize,
    /// Whether these also test errors of each component of groups.
    pub by_component: bool,
    /// Centre of scale, rotation and bending; the middle of the network if None.
    pub centre: Option<[f64; 3]>,
    /// Sum of squares and degrees of freedom if the unit weight is estimated; None if it is known.
    pub estimated: Option<(f64, f64)>,
    /// Significance level and power of the minimal detectable bias.
    pub detection: (f64, f64),
    /// Effects are counted from this number of standard deviations on.
    pub limit: f64,
    /// Number of groups whose effects are computed: those of the largest bias-to-noise ratios.
    pub effects: usize,
    /// Whether the trial ends: the data for tests are released before the normal equations of a large network are factored.
    pub last: bool,
}
