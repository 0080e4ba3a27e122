//! First values: the main axes of the points, circles and spheres by linear equations, axes of cylinders from all directions.

use nalgebra::{Matrix4, Vector4};

use super::Form;
use super::placed::Placed;
use crate::geometry::{Matrix3, Vector3};
use crate::sorting::sort_by;

/// Directions of the axis of a cylinder that are tried, over half a sphere: one every 8 degrees.
const DIRECTIONS: usize = 300;
/// Of these the best, no two nearer to each other than this cosine (15 degrees).
const TAKEN: usize = 8;
const APART: f64 = 0.966;
/// Steps of a decomposition at the most.
const STEPS: usize = 1000;

/// Where to begin, the likeliest first; points are counted from their mean. None where there is nothing to begin with.
pub fn starts(form: Form, points: &[Vector3]) -> Vec<Placed> {
    let Some(axes) = main_axes(points) else { return vec![] };
    let at = |axis: Vector3| placed(form, points, &axis);
    match form {
        Form::Line => at(axes.column(0).into()).into_iter().collect(),
        Form::Cylinder => cylinders(points, &axes),
        Form::Plane | Form::Circle | Form::Sphere => at(axes.column(2).into()).into_iter().collect(),
    }
}

/// Unit vectors along which the points extend most, less, least.
fn main_axes(points: &[Vector3]) -> Option<Matrix3> {
    let scatter: Matrix3 = points.iter().map(|p| p * p.transpose()).sum();
    let eigen = scatter.try_symmetric_eigen(f64::EPSILON, STEPS)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    Some(Matrix3::from_columns(&order.map(|k| Vector3::from(eigen.eigenvectors.column(k)))))
}

/// A feature with a given axis through the mean of the points, its centre and radius by linear equations.
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

/// The centre and radius that fit best in |y|^2 = 2 c y + k, of the first two or three coordinates.
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

/// Cylinders about the best of many directions, and about the main axes.
fn cylinders(points: &[Vector3], axes: &Matrix3) -> Vec<Placed> {
    // A spiral with the golden angle covers the half sphere evenly.
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
    sort_by(&mut judged, &|a, b| a.0.total_cmp(&b.0));
    let mut taken: Vec<Placed> = vec![];
    for (_, each) in judged {
        let apart = |other: &Placed| other.axis().dot(&each.axis()).abs() < APART;
        if taken.len() < TAKEN && taken.iter().all(apart) {
            taken.push(each);
        }
    }
    taken
}

/// Right-handed axes of which the third is given.
fn frame_about(axis: &Vector3) -> Matrix3 {
    let z = axis.normalize();
    let x = z.cross(&Vector3::ith(z.iamin(), 1.0)).normalize();
    Matrix3::from_columns(&[x, z.cross(&x), z])
}
