//! Comparator readings of plate points, with partial derivatives.

/// Rotation and translation of a plate: grid = M(rotation) (corrected - centre) + translation, with M = [[cos, sin], [-sin, cos]] (NOAA TR
/// NOS 57, equation 36) and the centre of the [`Basis`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Rotation in radians.
    pub rotation: f64,
    /// Grid coordinates of the centre of the basis.
    pub translation: [f64; 2],
}

impl From<[f64; 3]> for Placement {
    fn from([rotation, x, y]: [f64; 3]) -> Self {
        Self { rotation, translation: [x, y] }
    }
}

/// Basis functions of both polynomials: u^d, v^d, ... u^2, v^2 with u = (x - centre) / half range, likewise v. Together with the linear
/// transformation they span the same space as equation 59, and are well conditioned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// Highest degree d; the lowest is 2.
    pub degree: u32,
    /// Centre of the measured range.
    pub centre: [f64; 2],
    /// Half of the measured range.
    pub half_range: [f64; 2],
}

impl Basis {
    /// Returns the number of functions.
    pub fn functions(&self) -> usize {
        2 * (self.degree as usize).saturating_sub(1)
    }

    /// Evaluates functions and derivatives at a position: each depends on one coordinate only, x for even and y for odd indices.
    fn evaluate(&self, place: [f64; 2], values: &mut [f64], slopes: &mut [f64]) {
        for axis in 0..2 {
            let u = (place[axis] - self.centre[axis]) / self.half_range[axis];
            for (i, degree) in (2..=self.degree).rev().enumerate() {
                let lower = u.powi(degree as i32 - 1);
                values[2 * i + axis] = lower * u;
                slopes[2 * i + axis] = f64::from(degree) * lower / self.half_range[axis];
            }
        }
    }
}

/// Comparator: x' = Sx x + Sy sin(alpha) y, y' = Sy cos(alpha) y (equation 34); corrected = x' + P(x') (equation 63).
#[derive(Debug, Clone, PartialEq)]
pub struct Comparator {
    /// Scales in x and y.
    pub scale: [f64; 2],
    /// Nonorthogonality alpha in radians: positive if the y axis is inclined towards +x.
    pub nonorthogonality: f64,
    /// Basis functions of the polynomials.
    pub basis: Basis,
    /// Coefficients of x and of y, in the unit of the coordinates.
    pub coefficients: [Vec<f64>; 2],
}

/// Computed reading and its partials.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Computed reading.
    pub xy: [f64; 2],
    /// Partials with respect to the grid point, in the handedness of the comparator.
    pub point: [[f64; 2]; 2],
    /// Partials with respect to rotation and translation of the case.
    pub case: [[f64; 3]; 2],
    /// Partials with respect to scales, nonorthogonality, coefficients of x, coefficients of y.
    pub comparator: [Vec<f64>; 2],
}

/// Newton steps of the inverse correction: the first step reduces an error of about 1e-5 to its square.
const STEPS: usize = 4;

impl Comparator {
    /// Returns the unknowns in the order of the partials.
    pub fn unknowns(&self) -> Vec<f64> {
        let [x, y] = &self.coefficients;
        [&self.scale[..], &[self.nonorthogonality], x, y].concat()
    }

    /// Creates a comparator from its unknowns, in the order of the partials.
    pub fn from_unknowns(basis: Basis, unknowns: &[f64]) -> Self {
        let (x, y) = unknowns[3..].split_at(basis.functions());
        Self {
            scale: [unknowns[0], unknowns[1]],
            nonorthogonality: unknowns[2],
            basis,
            coefficients: [x.to_vec(), y.to_vec()],
        }
    }

    /// Computes the reading of a grid point, given in the handedness of the comparator, for a placed plate.
    pub fn measure(&self, point: [f64; 2], placement: &Placement) -> Measured {
        let (s, c) = placement.rotation.sin_cos();
        let d: [f64; 2] = std::array::from_fn(|k| point[k] - placement.translation[k]);
        let centre = self.basis.centre;
        let corrected = [c * d[0] - s * d[1] + centre[0], s * d[0] + c * d[1] + centre[1]];
        let (linear, functions, inverse) = self.before_polynomials(corrected);
        let (sin, cos) = self.nonorthogonality.sin_cos();
        let [sx, sy] = self.scale;
        let y = linear[1] / (sy * cos);
        let x = (linear[0] - sy * sin * y) / sx;
        // Partials of the readings with respect to linearly corrected, then to corrected coordinates.
        let unlinear = [[1.0 / sx, -sin / (cos * sx)], [0.0, 1.0 / (sy * cos)]];
        let back = product(unlinear, inverse);
        let turned = product(back, [[c, -s], [s, c]]);
        let by_rotation = [-s * d[0] - c * d[1], c * d[0] - s * d[1]];
        let case = |row: usize| {
            let turn = back[row][0] * by_rotation[0] + back[row][1] * by_rotation[1];
            [turn, -turned[row][0], -turned[row][1]]
        };
        let scales = [
            [-x / sx, 0.0, -linear[1] / (cos * cos * sx)],
            [0.0, -y / sy, linear[1] * sin / (sy * cos * cos)],
        ];
        let comparator = |row: usize| {
            let of_axis = |axis: usize| functions.iter().map(move |value| -back[row][axis] * value);
            scales[row].into_iter().chain(of_axis(0)).chain(of_axis(1)).collect()
        };
        Measured {
            xy: [x, y],
            point: turned,
            case: std::array::from_fn(case),
            comparator: std::array::from_fn(comparator),
        }
    }

    /// Returns the linear coordinates x' with x' + P(x') = corrected, the functions there, and the partials dx' / d corrected.
    fn before_polynomials(&self, corrected: [f64; 2]) -> ([f64; 2], Vec<f64>, [[f64; 2]; 2]) {
        let mut values = vec![0.0; self.basis.functions()];
        let mut slopes = values.clone();
        let mut place = corrected;
        let mut inverse = [[1.0, 0.0], [0.0, 1.0]];
        for _ in 0..STEPS {
            self.basis.evaluate(place, &mut values, &mut slopes);
            let mut jacobian = [[1.0, 0.0], [0.0, 1.0]];
            let mut excess = [place[0] - corrected[0], place[1] - corrected[1]];
            for axis in 0..2 {
                for (i, coefficient) in self.coefficients[axis].iter().enumerate() {
                    excess[axis] += coefficient * values[i];
                    jacobian[axis][i % 2] += coefficient * slopes[i];
                }
            }
            let [[a, b], [c, d]] = jacobian;
            let determinant = a * d - b * c;
            inverse = [[d / determinant, -b / determinant], [-c / determinant, a / determinant]];
            for axis in 0..2 {
                place[axis] -= inverse[axis][0] * excess[0] + inverse[axis][1] * excess[1];
            }
        }
        self.basis.evaluate(place, &mut values, &mut slopes);
        (place, values, inverse)
    }
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}
