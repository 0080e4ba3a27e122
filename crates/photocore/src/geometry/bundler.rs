//! The photo of Bundler and of "Bundle Adjustment in the Large" (Agarwal, Snavely, Seitz and Szeliski 2010), nine parameters: the
//! camera [`Bal`] on an orientation u = R P + t given by the angle-axis vector of R and t.

use super::projection::Photo;
use super::{Bal, Orientation};

/// The nine parameters of a photo: angle-axis vector (3), translation t (3), f, k1, k2.
pub type BundlerParameters = [f64; 9];

/// A photo with a camera of its own.
pub type BundlerPhoto = Photo<Bal>;

impl BundlerPhoto {
    /// The photo with the given parameters.
    pub fn from_parameters([a, b, c, x, y, z, f, k1, k2]: BundlerParameters) -> Self {
        let orientation = Orientation::from_vectors([a, b, c].into(), [x, y, z].into());
        Self { orientation, camera: Bal { focal_length: f, radial: [k1, k2] } }
    }
}
