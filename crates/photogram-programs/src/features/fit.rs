//! Least-squares fit of a feature to points, and the derivatives of the feature with respect to the points.
//!
//! With F(q, x) = 1/2 sum d^2 over all deviations and q the motions of the frame, the iteration uses Newton steps -F_qq^-1 F_q.
//! Gauss-Newton steps replace them if F_qq is not positive definite. At the minimum F_q = 0 for any points, so that dq/dx = -F_qq^-1 F_qx
//! exactly, even for large form deviations.
//!
//! The fitted feature is given by its frame and radius.
//!
//! Initial values: principal axes of the points, circles and spheres by linear equations, cylinder axes from all directions.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix4, Vector4};

use super::form::{ByMotions, Curvature, MOTIONS, Partials, RADIUS};
use super::{FeatureError, Form};
use photocore::geometry::{Matrix3, Vector3, angle_axis_rotation};
use photocore::internal::principal_axes;

/// Maximum number of steps, and the step size that ends the iteration; lengths are relative to the root mean square distance of the points.
const STEPS: usize = 200;
const AT_REST: f64 = 1e-13;
/// Step size that may be pure rounding, and the relative rounding of a sum of squares.
const SMALL: f64 = 1e-9;
const SUMS_ROUND: f64 = 1e-12;
/// Maximum number of halvings of a step that increases the sum of squares.
const HALVINGS: usize = 30;
/// Smallest pivot of the scaled normal equations of a determined feature.
const DETERMINED: f64 = 1e-10;
/// Ratio of sums of squares up to which a second feature fits as well as the best one; rounding of a sum of squares.
const RIVAL: f64 = 4.0;
const ROUNDING: f64 = 1e-20;
/// Cosine between axes above which two features are identical.
const SAME: f64 = 1.0 - 1e-6;

/// Sums over the points.
struct MomentSums {
    gradient: ByMotions,
    gauss: Curvature,
    newton: Curvature,
}

/// Fits a feature to points that are relative to their mean and scaled to a mean square distance of 1.
pub fn fit(form: Form, points: &[Vector3]) -> Result<Placed, FeatureError> {
    let starts = starts(form, points);
    if starts.is_empty() {
        return Err(FeatureError::Undetermined(form));
    }
    let mut found: Vec<(f64, Placed)> = vec![];
    let mut failed = FeatureError::NotAtRest(form);
    for start in starts {
        match at_rest(form, points, start) {
            Ok(placed) => found.push((placed.square_sum(form, points), placed)),
            Err(error) => failed = error,
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut found = found.into_iter();
    let Some((least, best)) = found.next() else { return Err(failed) };
    let limit = RIVAL * least + ROUNDING * points.len() as f64;
    if found.any(|(sum, other)| sum <= limit && other.axis().dot(&best.axis()).abs() < SAME) {
        return Err(FeatureError::Ambiguous(form));
    }
    Ok(best.oriented(form))
}

/// Iterates from an initial feature to the minimum.
fn at_rest(form: Form, points: &[Vector3], start: Placed) -> Result<Placed, FeatureError> {
    let mut at = start;
    let mut sum = at.square_sum(form, points);
    let mut before = f64::INFINITY;
    for _ in 0..STEPS {
        let sums = sums(&at.linearize(form, points));
        let factor = factored(form, &sums.newton).or_else(|| factored(form, &sums.gauss));
        let Some(factor) = factor else { return Err(FeatureError::Undetermined(form)) };
        let mut step = all_motions(form, &-factor.solve(&of_motions(form, &sums.gradient)));
        let mut after = at.moved(&step);
        for _ in 0..HALVINGS {
            if after.square_sum(form, points) <= sum * (1.0 + SUMS_ROUND) {
                break;
            }
            step *= 0.5;
            after = at.moved(&step);
        }
        at = after;
        sum = at.square_sum(form, points);
        if !sum.is_finite() {
            return Err(FeatureError::NotAtRest(form));
        }
        let size = step.amax();
        // Steps caused by rounding do not decrease further.
        if size <= AT_REST || (size < SMALL && size > 0.5 * before) {
            return Ok(at);
        }
        before = size;
    }
    Err(FeatureError::NotAtRest(form))
}

/// Returns the partials of the motions with respect to the points, (7, 3n), along the axes of the points; 0 for motions without effect.
pub fn by_points(form: Form, placed: &Placed, points: &[Vector3]) -> Result<DMatrix<f64>, FeatureError> {
    let partials = placed.linearize(form, points);
    let sums = sums(&partials);
    let factor = factored(form, &sums.newton).ok_or(FeatureError::Undetermined(form))?;
    let mut all = DMatrix::zeros(MOTIONS, 3 * points.len());
    for (k, own) in partials.chunks(form.deviations().len()).enumerate() {
        for each in own {
            let right = each.motions * each.point.transpose() + each.value * each.mixed;
            let mut place = all.fixed_columns_mut::<3>(3 * k);
            place -= right * placed.axes.transpose();
        }
    }
    let chosen = all.select_rows(form.motions());
    let solved = factor.solve(&chosen);
    all.fill(0.0);
    for (row, &motion) in form.motions().iter().enumerate() {
        all.set_row(motion, &solved.row(row));
    }
    Ok(all)
}

fn sums(partials: &[Partials]) -> MomentSums {
    let mut sums =
        MomentSums { gradient: ByMotions::zeros(), gauss: Curvature::zeros(), newton: Curvature::zeros() };
    for each in partials {
        let square = each.motions * each.motions.transpose();
        sums.gradient += each.value * each.motions;
        sums.gauss += square;
        sums.newton += square + each.value * each.curvature;
    }
    sums
}

/// Factors the equations of the effective motions; None unless they are positive definite by far more than rounding.
fn factored(form: Form, matrix: &Curvature) -> Option<Cholesky<f64, Dyn>> {
    let own = matrix.select_rows(form.motions()).select_columns(form.motions());
    let factor = Cholesky::new(own.clone())?;
    let lower = factor.l_dirty();
    (0..own.nrows()).all(|k| lower[(k, k)].powi(2) > DETERMINED * own[(k, k)]).then_some(factor)
}

fn of_motions(form: Form, all: &ByMotions) -> DVector<f64> {
    DVector::from_iterator(form.motions().len(), form.motions().iter().map(|&k| all[k]))
}

fn all_motions(form: Form, own: &DVector<f64>) -> ByMotions {
    let mut all = ByMotions::zeros();
    for (&motion, &value) in form.motions().iter().zip(own.iter()) {
        all[motion] = value;
    }
    all
}

/// Frame and radius of a feature.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Origin of the frame.
    pub centre: Vector3,
    /// Unit vectors of the frame, in columns.
    pub axes: Matrix3,
    /// Radius; 0 for features without radius.
    pub radius: f64,
}

impl Placed {
    /// Returns the third axis.
    pub fn axis(&self) -> Vector3 {
        self.axes.column(2).into()
    }

    /// Returns a point in the frame.
    pub fn own(&self, point: &Vector3) -> Vector3 {
        self.axes.transpose() * (point - self.centre)
    }

    /// Returns the sum of squares of all deviations.
    pub fn square_sum(&self, form: Form, points: &[Vector3]) -> f64 {
        let of = |p: &Vector3| {
            let y = self.own(p);
            form.deviations().iter().map(|each| each.value(&y, self.radius).powi(2)).sum::<f64>()
        };
        points.iter().map(of).sum()
    }

    /// Returns the deviations of all points with their partials, point by point.
    pub fn linearize(&self, form: Form, points: &[Vector3]) -> Vec<Partials> {
        let of = |p: &Vector3| {
            let y = self.own(p);
            form.deviations().iter().map(move |each| each.linearize(&y, self.radius))
        };
        points.iter().flat_map(of).collect()
    }

    /// Returns the feature after motions of its frame.
    pub(super) fn moved(&self, motions: &ByMotions) -> Self {
        let turn = angle_axis_rotation(&motions.fixed_rows::<3>(3).into());
        Self {
            centre: self.centre + self.axes * motions.fixed_rows::<3>(0),
            axes: self.axes * turn,
            radius: self.radius + motions[RADIUS],
        }
    }

    /// Normalizes the representation. The largest component of the axis is positive. Along motions without effect the origin is the foot of
    /// the mean of the points, which is 0.
    pub(super) fn oriented(mut self, form: Form) -> Self {
        let axis = self.axis();
        if axis[axis.iamax()] < 0.0 {
            self.axes.fixed_columns_mut::<2>(1).neg_mut();
        }
        let back = self.own(&Vector3::zeros());
        let free = |k: usize| if form.motions().contains(&k) { 0.0 } else { back[k] };
        self.centre += self.axes * Vector3::from_fn(|k, _| free(k));
        self
    }
}

/// Number of trial directions of a cylinder axis over a hemisphere: one per 8 degrees.
const DIRECTIONS: usize = 300;
/// Number of best trial axes, and the minimum separation of two of them as a cosine (15 degrees).
const TAKEN: usize = 8;
const APART: f64 = 0.966;

/// Returns initial features, most probable first, for points relative to their mean; empty for degenerate points.
pub fn starts(form: Form, points: &[Vector3]) -> Vec<Placed> {
    let Some(axes) = main_axes(points) else { return vec![] };
    let at = |axis: Vector3| placed(form, points, &axis);
    match form {
        Form::Line => at(axes.column(0).into()).into_iter().collect(),
        Form::Cylinder => cylinders(points, &axes),
        Form::Plane | Form::Circle | Form::Sphere => at(axes.column(2).into()).into_iter().collect(),
    }
}

/// Returns the principal axes of the points, largest extent first.
fn main_axes(points: &[Vector3]) -> Option<Matrix3> {
    let scatter: Matrix3 = points.iter().map(|p| p * p.transpose()).sum();
    principal_axes(&scatter).map(|(_, axes)| axes)
}

/// Returns a feature with a given axis through the mean of the points; centre and radius follow from linear equations.
fn placed(form: Form, points: &[Vector3], axis: &Vector3) -> Option<Placed> {
    let axes = frame_about(axis);
    let count = match form {
        Form::Line | Form::Plane => {
            return Some(Placed { centre: Vector3::zeros(), axes, radius: 0.0 });
        }
        Form::Circle | Form::Cylinder => 2,
        Form::Sphere => 3,
    };
    let (centre, radius) = round(count, points.iter().map(|p| axes.transpose() * p))?;
    Some(Placed { centre: axes * centre, axes, radius })
}

/// Solves |y|^2 = 2 c y + k for centre and radius by least squares, with the first two or three coordinates.
fn round(count: usize, points: impl Iterator<Item = Vector3>) -> Option<(Vector3, f64)> {
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for y in points {
        let own = Vector3::from_fn(|k, _| if k < count { y[k] } else { 0.0 });
        let row = Vector4::new(2.0 * own.x, 2.0 * own.y, 2.0 * own.z, 1.0);
        normal += row * row.transpose();
        right += row * own.norm_squared();
    }
    if count == 2 {
        normal[(2, 2)] = 1.0;
    }
    let found = normal.cholesky()?.solve(&right);
    let centre = found.xyz();
    let square = found.w + centre.norm_squared();
    (square > 0.0 && square.is_finite()).then(|| (centre, square.sqrt()))
}

/// Returns cylinders about the best of many directions, and about the principal axes.
fn cylinders(points: &[Vector3], axes: &Matrix3) -> Vec<Placed> {
    // A spiral with the golden angle covers the hemisphere evenly.
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let spiral = (0..DIRECTIONS).map(|k| {
        let z = (k as f64 + 0.5) / DIRECTIONS as f64;
        let (sin, cos) = (golden * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * cos, r * sin, z)
    });
    let main = (0..3).map(|k| Vector3::from(axes.column(k)));
    let all = main.chain(spiral).filter_map(|axis| placed(Form::Cylinder, points, &axis));
    let mut judged: Vec<(f64, Placed)> =
        all.map(|each| (each.square_sum(Form::Cylinder, points), each)).collect();
    judged.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken: Vec<Placed> = vec![];
    for (_, each) in judged {
        let apart = |other: &Placed| other.axis().dot(&each.axis()).abs() < APART;
        if taken.len() < TAKEN && taken.iter().all(apart) {
            taken.push(each);
        }
    }
    taken
}

/// Returns right-handed axes with the given third axis.
fn frame_about(axis: &Vector3) -> Matrix3 {
    let z = axis.normalize();
    let x = z.cross(&Vector3::ith(z.iamin(), 1.0)).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z])
}
