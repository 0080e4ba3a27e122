//! What a scanner or comparator reads where a place of a film lies.

use crate::geometry::camera::Matrix2;
use crate::geometry::camera::inverse::{inverted, times};
use crate::geometry::correction::{Correction, LINEAR, Linear, PARAMETERS, Placed};

/// A scanner: what it reads becomes a true place by its correction.
///
/// ```text
/// (X, Y) = (x - o1, y - o2) pitch, or (x - o1, o2 - y) pitch where rows count down,    true = correction(X, Y)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scanner {
    correction: Correction,
    /// Its linear part.
    linear: Linear,
    /// Whether it may have polynomials.
    curved: bool,
    /// o1, o2.
    origin: [f64; 2],
    /// Units of readings in a mm along each axis.
    units: [f64; 2],
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
    /// One of so many mm in a unit of readings; `down`: whether the second coordinate counts down. The correction is that of readings in mm,
    /// counted from the origin, y up; without polynomials unless it is `curved`.
    pub fn new((correction, curved): (Correction, bool), pitch: f64, origin: [f64; 2], down: bool) -> Self {
        let units = [1.0 / pitch, if down { -1.0 } else { 1.0 } / pitch];
        Self { correction, linear: correction.linear(), curved, origin, units }
    }

    /// Units of readings in a mm, without sign.
    pub fn scale(&self) -> f64 {
        self.units[0]
    }

    /// The true place of a reading.
    pub fn place(&self, xy: [f64; 2]) -> [f64; 2] {
        let counted = [0, 1].map(|k| (xy[k] - self.origin[k]) / self.units[k]);
        if self.curved { self.correction.place(counted) } else { times(&self.linear.matrix, counted) }
    }

    /// The reading of a true place; None where the correction has no way back.
    pub fn read(&self, place: [f64; 2]) -> Option<Scanned> {
        let mut by_parameters = [[0.0; PARAMETERS]; 2];
        let (reading, back, count) = if self.curved {
            let reading = self.correction.reading(place)?;
            let Placed { by_reading, by_parameters: by, .. } = self.correction.linearize(reading);
            by_parameters = by;
            (reading, inverted(by_reading), PARAMETERS)
        } else {
            let reading = times(&self.linear.back, place);
            let by = self.linear.by_parameters(reading);
            (0..2).for_each(|row| (0..LINEAR).for_each(|k| by_parameters[row][k] = by[k][row]));
            (reading, self.linear.back, LINEAR)
        };
        let by_place = [0, 1].map(|row| back[row].map(|value| self.units[row] * value));
        // g(reading; parameters) = place stays, so d reading = -(dg/d reading)^-1 dg/d parameter.
        for k in 0..count {
            let moved = times(&by_place, [by_parameters[0][k], by_parameters[1][k]]);
            (0..2).for_each(|row| by_parameters[row][k] = -moved[row]);
        }
        let xy = [0, 1].map(|k| self.origin[k] + self.units[k] * reading[k]);
        Some(Scanned { xy, by_place, by_parameters })
    }
}
