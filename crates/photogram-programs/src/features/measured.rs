//! Reported values of a feature: parameters with standard deviations, point deviations, and the test of the form.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3xX, RowDVector};

use super::fit::{Placed, by_points, fit};
use super::form::{Partials, RADIUS};
use super::{FeatureError, Form};
use photocore::geometry::{Matrix3, Vector3};

/// Maximum relative standard deviation of a radius, and of a direction in radians, for linear error propagation.
const LOOSE: f64 = 0.2;

/// Value with its standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Name: `diameter`, `centre x`, `axis x`, `flatness` ...
    pub name: &'static str,
    /// Whether the value is a length; otherwise it is a component of a unit vector.
    pub is_length: bool,
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub sd: f64,
}

/// Deviation of a point from a feature: positive outside, or on the normal's side of a plane; always positive for a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointDeviation {
    /// Distance; for a circle the radial deviation.
    pub value: f64,
    /// Standard deviation of the distance; NaN on a line.
    pub sd: f64,
    /// Out-of-plane deviation of a circle; 0 for other features, with standard deviation 0.
    pub axial: f64,
    /// Standard deviation of the out-of-plane deviation.
    pub axial_sd: f64,
}

/// Test of the form deviations against the errors of the points. `statistic` is d' C_d^- d, chi-square distributed without form deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormTest {
    /// Weighted sum of squares.
    pub statistic: f64,
    /// Degrees of freedom: deviations minus unknowns.
    pub freedom: usize,
}

/// Reported feature.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Values.
    pub quantities: Vec<Quantity>,
    /// (q, q) joint covariance of the values.
    pub covariance: DMatrix<f64>,
    /// Deviations of the points.
    pub deviations: Vec<PointDeviation>,
    /// None if the points are error-free or without redundancy.
    pub test: Option<FormTest>,
}

impl Measured {
    /// Returns a quantity by name.
    pub fn of(&self, name: &str) -> Option<&Quantity> {
        self.quantities.iter().find(|each| each.name == name)
    }
}

/// Returns the distance of two points; the covariance of both is (6, 6).
///
/// # Errors
/// Values that are not finite, another shape, coincident points.
pub fn distance(points: &[Vector3; 2], covariance: &DMatrix<f64>) -> Result<Measured, FeatureError> {
    check(points, covariance)?;
    let between = points[1] - points[0];
    let length = between.norm();
    if length == 0.0 {
        return Err(FeatureError::Coincident);
    }
    let direction = (between / length).transpose();
    let mut lines = Lines::default();
    let mut partials = RowDVector::zeros(6);
    partials.fixed_columns_mut::<3>(0).copy_from(&-direction);
    partials.fixed_columns_mut::<3>(3).copy_from(&direction);
    lines.push("distance", true, length, partials);
    Ok(lines.propagated(covariance, vec![], None))
}

/// Fits a feature to n points with their joint (3n, 3n) covariance, ordered point by point.
///
/// # Errors
/// [`FeatureError`]: too few points, undetermined or ambiguous features, values that are not finite, another shape.
pub fn measure(form: Form, points: &[Vector3], covariance: &DMatrix<f64>) -> Result<Measured, FeatureError> {
    check(points, covariance)?;
    let count = points.len();
    if count < form.needed() {
        return Err(FeatureError::TooFew { form, given: count });
    }
    let mean = points.iter().sum::<Vector3>() / count as f64;
    let scale = (points.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / count as f64).sqrt();
    if scale == 0.0 {
        return Err(FeatureError::Undetermined(form));
    }
    let own: Vec<Vector3> = points.iter().map(|p| (p - mean) / scale).collect();
    let placed = fit(form, &own)?;
    let fitted = Fitted {
        form,
        mean,
        scale,
        follows: by_points(form, &placed, &own)?,
        partials: placed.linearize(form, &own),
        placed,
        points: own,
    };
    let deviations = fitted.deviations(covariance);
    fitted.lines(&deviations).propagated(covariance, deviations, fitted.test(covariance)).determined(form)
}

fn check(points: &[Vector3], covariance: &DMatrix<f64>) -> Result<(), FeatureError> {
    let (rows, columns) = covariance.shape();
    if (rows, columns) != (3 * points.len(), 3 * points.len()) {
        return Err(FeatureError::Shape { points: points.len(), rows, columns });
    }
    let known = points.iter().flatten().chain(covariance).all(|each| each.is_finite());
    if known { Ok(()) } else { Err(FeatureError::NotFinite) }
}

/// Quantities, each with a row of partials with respect to the points.
#[derive(Default)]
struct Lines {
    named: Vec<(&'static str, bool, f64)>,
    partials: Vec<RowDVector<f64>>,
}

impl Lines {
    fn push(&mut self, name: &'static str, is_length: bool, value: f64, partials: RowDVector<f64>) {
        self.named.push((name, is_length, value));
        self.partials.push(partials);
    }

    fn push_vector(
        &mut self,
        names: [&'static str; 3],
        is_length: bool,
        value: &Vector3,
        by: &Matrix3xX<f64>,
    ) {
        for k in 0..3 {
            self.push(names[k], is_length, value[k], by.row(k).into_owned());
        }
    }

    fn propagated(
        self,
        covariance: &DMatrix<f64>,
        deviations: Vec<PointDeviation>,
        test: Option<FormTest>,
    ) -> Measured {
        let partials = DMatrix::from_rows(&self.partials);
        let covariance = &partials * covariance * partials.transpose();
        let named = self.named.into_iter().enumerate();
        let quantities = named
            .map(|(k, (name, is_length, value))| {
                let sd = covariance[(k, k)].max(0.0).sqrt();
                Quantity { name, is_length, value, sd }
            })
            .collect();
        Measured { quantities, covariance, deviations, test }
    }
}

impl Measured {
    /// Returns the values if linear error propagation is valid.
    fn determined(self, form: Form) -> Result<Self, FeatureError> {
        for each in &self.quantities {
            let (what, sd) = match each.name {
                "diameter" => ("the diameter", each.sd / each.value),
                _ if !each.is_length => ("its direction", each.sd),
                _ => continue,
            };
            if sd.is_nan() || sd > LOOSE {
                return Err(FeatureError::Loose { form, what, sd });
            }
        }
        Ok(self)
    }
}

/// Fitted feature, with points relative to their mean and scaled.
struct Fitted {
    form: Form,
    mean: Vector3,
    scale: f64,
    placed: Placed,
    points: Vec<Vector3>,
    partials: Vec<Partials>,
    /// (7, 3n) partials of the motions with respect to the points.
    follows: DMatrix<f64>,
}

impl Fitted {
    /// Returns the reported quantities with their partials.
    fn lines(&self, deviations: &[PointDeviation]) -> Lines {
        let (axes, form) = (&self.placed.axes, self.form);
        let mut lines = Lines::default();
        if form.motions().contains(&RADIUS) {
            let diameter = 2.0 * self.placed.radius * self.scale;
            lines.push("diameter", true, diameter, 2.0 * self.follows.row(RADIUS));
        }
        let centre = self.mean + self.scale * self.placed.centre;
        lines.push_vector(
            ["centre x", "centre y", "centre z"],
            true,
            &centre,
            &(axes * self.centre_follows()),
        );
        if form != Form::Sphere {
            let by = axes * self.axis_follows() / self.scale;
            let names = match form {
                Form::Line | Form::Cylinder => ["axis x", "axis y", "axis z"],
                _ => ["normal x", "normal y", "normal z"],
            };
            lines.push_vector(names, false, &self.placed.axis(), &by);
        }
        if self.freedom() > 0 {
            self.push_forms(&mut lines, deviations);
        }
        lines
    }

    /// Adds the ranges of the deviations; for a line, the diameter of the enclosing cylinder.
    fn push_forms(&self, lines: &mut Lines, deviations: &[PointDeviation]) {
        let range = |of: fn(&PointDeviation) -> f64| {
            let order = |&a: &usize, &b: &usize| of(&deviations[a]).total_cmp(&of(&deviations[b]));
            let low = (0..deviations.len()).min_by(order).unwrap_or(0);
            let high = (0..deviations.len()).max_by(order).unwrap_or(0);
            (low, high, of(&deviations[high]) - of(&deviations[low]))
        };
        let name = match self.form {
            Form::Line => {
                let (_, far, _) = range(|each| each.value);
                return lines.push(
                    "straightness",
                    true,
                    2.0 * deviations[far].value,
                    2.0 * self.distance(far),
                );
            }
            Form::Plane => "flatness",
            Form::Circle => "roundness",
            Form::Sphere => "sphericity",
            Form::Cylinder => "cylindricity",
        };
        let (low, high, value) = range(|each| each.value);
        lines.push(name, true, value, self.distance(high) - self.distance(low));
        if self.form == Form::Circle {
            let (low, high, value) = range(|each| each.axial);
            lines.push("flatness", true, value, self.deviation(2 * high + 1) - self.deviation(2 * low + 1));
        }
    }

    /// Returns the (3, 3n) partials of the centre in the frame. Along motions without effect the centre is the foot of the mean of the
    /// points. It moves with the mean, and with rotations of the axis if the mean is off the axis.
    fn centre_follows(&self) -> Matrix3xX<f64> {
        let (motions, count) = (self.form.motions(), self.points.len());
        let mean = self.placed.own(&Vector3::zeros());
        let turned = self.axis_follows();
        let mut shift: Matrix3xX<f64> = self.follows.fixed_rows::<3>(0).into_owned();
        for axis in (0..3).filter(|axis| !motions.contains(axis)) {
            for k in 0..count {
                let unit = self.placed.axes.column(axis).transpose() / count as f64;
                shift.fixed_view_mut::<1, 3>(axis, 3 * k).copy_from(&unit);
            }
            if axis == 2 {
                let along = mean.x * turned.row(0) + mean.y * turned.row(1);
                let row = shift.row(axis) + along;
                shift.set_row(axis, &row);
            }
        }
        shift
    }

    /// Returns the (3, 3n) partials w x z of the axis in the frame.
    fn axis_follows(&self) -> Matrix3xX<f64> {
        let mut turned = Matrix3xX::zeros(self.follows.ncols());
        turned.set_row(0, &self.follows.row(4));
        turned.set_row(1, &-self.follows.row(3));
        turned
    }

    /// Returns the partials of a deviation with respect to all points.
    fn deviation(&self, row: usize) -> RowDVector<f64> {
        let (each, point) = (&self.partials[row], row / self.form.deviations().len());
        let mut by = each.motions.transpose() * &self.follows;
        let mut own = by.fixed_columns_mut::<3>(3 * point);
        own += (self.placed.axes * each.point).transpose();
        by
    }

    /// Returns the partials of the first deviation of a point, or of its distance from a line.
    fn distance(&self, point: usize) -> RowDVector<f64> {
        if self.form != Form::Line {
            return self.deviation(point * self.form.deviations().len());
        }
        let [x, y] = [0, 1].map(|k| self.partials[2 * point + k].value);
        (x * self.deviation(2 * point) + y * self.deviation(2 * point + 1)) / x.hypot(y)
    }

    /// Returns the number of deviations minus the unknowns of the feature.
    fn freedom(&self) -> usize {
        self.partials.len().saturating_sub(self.form.motions().len())
    }

    /// Returns the deviations of all points with their standard deviations, without storing a full row of partials per point.
    fn deviations(&self, covariance: &DMatrix<f64>) -> Vec<PointDeviation> {
        let together = covariance * self.follows.transpose();
        let motions = &self.follows * &together;
        let per_point = self.form.deviations().len();
        let joint = |a: usize, b: usize| -> f64 {
            let point = 3 * (a / per_point);
            let [own, other] = [a, b].map(|row| self.placed.axes * self.partials[row].point);
            let [by, by_other] = [a, b].map(|row| &self.partials[row].motions);
            let block: Matrix3 = covariance.fixed_view::<3, 3>(point, point).into();
            let with = together.fixed_rows::<3>(point);
            let cross = own.dot(&(with * by_other)) + other.dot(&(with * by));
            own.dot(&(block * other)) + cross + (by.transpose() * &motions * by_other)[0]
        };
        let of = |point: usize| {
            let row = per_point * point;
            let value = self.scale * self.partials[row].value;
            let sd = joint(row, row).max(0.0).sqrt();
            if per_point == 1 {
                return PointDeviation { value, sd, axial: 0.0, axial_sd: 0.0 };
            }
            let (axial, axial_variance) =
                (self.scale * self.partials[row + 1].value, joint(row + 1, row + 1));
            if self.form == Form::Circle {
                return PointDeviation { value, sd, axial, axial_sd: axial_variance.max(0.0).sqrt() };
            }
            let far = value.hypot(axial);
            let square = value.powi(2) * sd.powi(2) + axial.powi(2) * axial_variance;
            let variance = square + 2.0 * value * axial * joint(row, row + 1);
            PointDeviation { value: far, sd: variance.max(0.0).sqrt() / far, axial: 0.0, axial_sd: 0.0 }
        };
        (0..self.points.len()).map(of).collect()
    }

    /// Returns d' C_d^- d: the minimum sum of squares over all motions, with the deviations' covariance S for a fixed feature. S + J J'
    /// replaces S: the result is the same, and the matrix is regular even if the datum of the points fixes motions.
    fn test(&self, covariance: &DMatrix<f64>) -> Option<FormTest> {
        let (rows, form) = (self.partials.len(), self.form);
        if self.freedom() == 0 {
            return None;
        }
        let per_point = form.deviations().len();
        let across: Vec<Vector3> = self.partials.iter().map(|each| self.placed.axes * each.point).collect();
        let own = DMatrix::from_fn(rows, rows, |a, b| {
            let block = covariance.fixed_view::<3, 3>(3 * (a / per_point), 3 * (b / per_point));
            across[a].dot(&(block * across[b]))
        });
        let motions =
            DMatrix::from_fn(rows, form.motions().len(), |a, k| self.partials[a].motions[form.motions()[k]]);
        let whole = &own + &motions * motions.transpose() * (own.trace() / rows as f64);
        let diagonal = whole.diagonal();
        let factor = Cholesky::new(whole)?;
        let lower = factor.l_dirty();
        if (0..rows).any(|k| lower[(k, k)].powi(2) <= 1e-12 * diagonal[k]) {
            return None;
        }
        let given = DVector::from_iterator(rows, self.partials.iter().map(|each| self.scale * each.value));
        let (solved, turned) = (factor.solve(&given), factor.solve(&motions));
        let right = motions.tr_mul(&solved);
        let moved = Cholesky::new(motions.tr_mul(&turned))?.solve(&right);
        let statistic = given.dot(&solved) - right.dot(&moved);
        Some(FormTest { statistic: statistic.max(0.0), freedom: self.freedom() })
    }
}
