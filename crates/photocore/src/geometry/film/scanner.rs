//! What a scanner or comparator reads where a place of a film lies.

use crate::geometry::camera::Matrix2;
use crate::geometry::camera::inverse::{inverted, times};
use crate::geometry::correction::{Correction, PARAMETERS, Placed};

/// A scanner: what it reads becomes a true place by its correction.
///
/// ```text
/// (X, Y) = (x - o1, y - o2) pitch, or (x - o1, o2 - y) pitch where rows count down,    true = correction(X, Y)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanner {
    /// Of readings in mm, counted from the origin, y up.
    pub correction: Correction,
    /// mm in a unit of readings.
    pub pitch: f64,
    /// o1, o2.
    pub origin: [f64; 2],
    /// Whether the second coordinate counts down.
    pub down: bool,
}

/// A reading with its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Scanned {
    /// Column and row, or x and y.
    pub xy: [f64; 2],
    /// With respect to the true place.
    pub by_place: Matrix2,
    /// With respect to the parameters of the correction.
    pub by_parameters: [[f64; PARAMETERS]; 2],
}

impl Scanner {
    /// Units of readings in a mm along each axis.
    fn units(&self) -> [f64; 2] {
        [1.0 / self.pitch, if self.down { -1.0 } else { 1.0 } / self.pitch]
    }

    /// A reading in mm from the origin, y up.
    fn counted(&self, xy: [f64; 2]) -> [f64; 2] {
        let units = self.units();
        [0, 1].map(|k| (xy[k] - self.origin[k]) / units[k])
    }

    /// The true place of a reading.
    pub fn place(&self, xy: [f64; 2]) -> [f64; 2] {
        self.correction.place(self.counted(xy))
    }

    /// The reading of a true place; None where the correction has no way back.
    pub fn read(&self, place: [f64; 2]) -> Option<Scanned> {
        let reading = self.correction.reading(place)?;
        let Placed { by_reading, by_parameters: by, .. } = self.correction.linearize(reading);
        let units = self.units();
        let back: Matrix2 = {
            let [x, y] = inverted(by_reading);
            [x.map(|value| units[0] * value), y.map(|value| units[1] * value)]
        };
        // g(reading; parameters) = place stays, so d reading = -(dg/d reading)^-1 dg/d parameter.
        let mut by_parameters = [[0.0; PARAMETERS]; 2];
        for k in 0..PARAMETERS {
            let moved = times(&back, [by[0][k], by[1][k]]);
            (0..2).for_each(|row| by_parameters[row][k] = -moved[row]);
        }
        let xy = [0, 1].map(|k| self.origin[k] + units[k] * reading[k]);
        Some(Scanned { xy, by_place: back, by_parameters })
    }
}
