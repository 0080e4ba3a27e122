//! Transformation from the camera frame to the reading of a scanned film or a measured plate, with all partials.
//!
//! ```text
//! n = q + [m + b1, b2; b2, m - b1] q + D(q)              q: mm, x right, y up, seen as the positive
//! e = n + (h1 x y, h2 x y)    or    n/(1 + g1 x + g2 y)  (x, y) = q
//! p = R(theta) J e + t                                   J = diag(1, 1), or diag(-1, 1) mirrored
//! reading = scanner^-1(p)
//! ```

mod pattern;

use super::camera::Matrix2;
use super::camera::inverse::{inverted, times, way_back};
use super::correction::PARAMETERS;

pub use pattern::{Deformation, Function, Functions, Grid, Pattern, Scanned, Scanner};

/// Film of a photo: its orientation on the scanner and its deformation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Film {
    /// R(theta) J.
    lie: Matrix2,
    /// t.
    shift: [f64; 2],
    /// m, b1, b2.
    size: [f64; 3],
    bend: Bend,
}

/// Non-affine deformation of the film of a photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bend {
    /// Zero.
    Flat,
    /// h1, h2, per mm.
    Bilinear([f64; 2]),
    /// g1, g2, per mm.
    Projective([f64; 2]),
}

/// Reading with its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    /// Column and row, or x and y.
    pub xy: [f64; 2],
    /// With respect to q.
    pub by_q: Matrix2,
    /// With respect to t1, t2, theta, m, b1, b2.
    pub by_film: [[f64; 6]; 2],
    /// With respect to h1, h2 or g1, g2.
    pub by_bend: Matrix2,
    /// With respect to D: its product with the value of a pattern function is the partial with respect to the function's weight.
    pub by_shift: Matrix2,
    /// With respect to the parameters of the scanner's correction.
    pub by_scanner: [[f64; PARAMETERS]; 2],
}

impl Reading {
    /// NaN, for positions without a reading.
    pub const NONE: Self = {
        let square = [[f64::NAN; 2]; 2];
        Self {
            xy: [f64::NAN; 2],
            by_q: square,
            by_film: [[f64::NAN; 6]; 2],
            by_bend: square,
            by_shift: square,
            by_scanner: [[f64::NAN; PARAMETERS]; 2],
        }
    };
}

/// e with its partials.
struct Aged {
    e: [f64; 2],
    by_q: Matrix2,
    by_size: [[f64; 3]; 2],
    by_bend: Matrix2,
    by_shift: Matrix2,
}

impl Film {
    /// Returns a film with orientation t1, t2 (mm), theta (radians) and deformation m, b1, b2; `mirrored` if the emulsion side is reversed.
    pub fn new(mirrored: bool, [t1, t2, theta]: [f64; 3], size: [f64; 3], bend: Bend) -> Self {
        let ((sin, cos), side) = (theta.sin_cos(), if mirrored { -1.0 } else { 1.0 });
        Self { lie: [[side * cos, -sin], [side * sin, cos]], shift: [t1, t2], size, bend }
    }

    /// Returns the reading of a position in the camera frame; None outside of the scanner's range.
    pub fn read(&self, q: [f64; 2], deformation: &Deformation, scanner: &Scanner) -> Option<Reading> {
        let Aged { e, by_q, by_size, by_bend, by_shift } = self.aged(q, deformation);
        let [x, y] = times(&self.lie, e);
        let Scanned { xy, by_place, by_parameters } = scanner.read([x + self.shift[0], y + self.shift[1]])?;
        let by_e = product(&by_place, &self.lie);
        let turned = times(&by_place, [-y, x]);
        let film = |row: usize| {
            let size = [0, 1, 2].map(|k| times(&by_e, [by_size[0][k], by_size[1][k]])[row]);
            [by_place[row][0], by_place[row][1], turned[row], size[0], size[1], size[2]]
        };
        Some(Reading {
            xy,
            by_q: product(&by_e, &by_q),
            by_film: [film(0), film(1)],
            by_bend: product(&by_e, &by_bend),
            by_shift: product(&by_e, &by_shift),
            by_scanner: by_parameters,
        })
    }

    /// Returns the position of a reading in the camera frame; None without convergence. `deformation` returns D of a position.
    pub fn place(
        &self,
        reading: [f64; 2],
        deformation: impl Fn([f64; 2]) -> Deformation,
        scanner: &Scanner,
    ) -> Option<[f64; 2]> {
        let p = scanner.place(reading);
        let e = times(&inverted(self.lie), [p[0] - self.shift[0], p[1] - self.shift[1]]);
        way_back(e, e, |q| {
            let Aged { e, by_q, .. } = self.aged(q, &deformation(q));
            (e, by_q)
        })
    }

    /// Returns e with its partials.
    fn aged(&self, q: [f64; 2], deformation: &Deformation) -> Aged {
        let ([x, y], [m, b1, b2], Deformation { shift, by_place }) = (q, self.size, *deformation);
        let affine = [[1.0 + m + b1, b2], [b2, 1.0 + m - b1]];
        let straight = times(&affine, q);
        let n = [0, 1].map(|k| straight[k] + shift[k]);
        let by_q = [0, 1].map(|i| [0, 1].map(|j| affine[i][j] + by_place[i][j]));
        let by_size = [[x, x, y], [y, -y, x]];
        let unit = [[1.0, 0.0], [0.0, 1.0]];
        match self.bend {
            Bend::Flat => Aged { e: n, by_q, by_size, by_bend: [[0.0; 2]; 2], by_shift: unit },
            Bend::Bilinear(h) => Aged {
                e: [0, 1].map(|k| n[k] + h[k] * x * y),
                by_q: [0, 1].map(|k| [by_q[k][0] + h[k] * y, by_q[k][1] + h[k] * x]),
                by_size,
                by_bend: unit.map(|row| row.map(|one| one * x * y)),
                by_shift: unit,
            },
            Bend::Projective(g) => {
                let w = 1.0 / (1.0 + g[0] * x + g[1] * y);
                let e = n.map(|value| w * value);
                Aged {
                    e,
                    by_q: [0, 1].map(|i| [0, 1].map(|j| w * (by_q[i][j] - e[i] * g[j]))),
                    by_size: by_size.map(|row| row.map(|by| w * by)),
                    by_bend: e.map(|value| [-w * value * x, -w * value * y]),
                    by_shift: unit.map(|row| row.map(|one| w * one)),
                }
            }
        }
    }
}

fn product(a: &Matrix2, b: &Matrix2) -> Matrix2 {
    let columns = [0, 1].map(|k| times(a, [b[0][k], b[1][k]]));
    [0, 1].map(|row| columns.map(|column| column[row]))
}

#[cfg(test)]
mod tests;
