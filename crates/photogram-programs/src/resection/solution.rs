//! Result of a resection.
//!
//! Result of the adjustment from one initial pose.

use super::degenerate::{Degeneracy, outside_cylinder};
use super::{ControlPoint, Partials, Pose, Resection};
use photocore::adjustment::{Adjustment, Evaluated, Model, Problem, Status, leading_matrix, standardized};
use photocore::geometry::{ObjectSpace, Point, Projection, RotationSense, View};
use photocore::normals::GroupRows;

/// Adjusted control point.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedControl {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Cofactors (a priori unit weight); NaN if not requested.
    pub cofactors: [[f64; 3]; 3],
    /// Redundancy numbers of the coordinates as observations; zero unless weighted, NaN if not requested.
    pub redundancy: [f64; 3],
}

/// Adjusted image observation.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedImage {
    /// Observed minus computed, in millimetres.
    pub residual: [f64; 2],
    /// Redundancy numbers; NaN if not requested.
    pub redundancy: [f64; 2],
    /// Residual / (standard deviation x root of the redundancy number), a priori unit weight (Baarda's w). NaN if not requested, or if the
    /// redundancy is zero.
    pub standardized: [f64; 2],
    /// Partials of x and y with respect to position and attitude, at the solution.
    pub partials: [[f64; 6]; 2],
}

/// Alternative pose that fits the observations.
#[derive(Debug, Clone, Copy)]
pub struct Alternative {
    /// Pose.
    pub pose: Pose,
    /// Weighted sum of squares.
    pub sum_of_squares: f64,
}

/// Resected photo; points and image observations have the order of the input.
#[derive(Debug)]
pub struct Solution {
    /// Position and attitude.
    pub pose: Pose,
    /// Cofactors of the pose (a priori unit weight); NaN if not requested.
    pub cofactors: [[f64; 6]; 6],
    /// Redundancy numbers of position and attitude as observations; zero unless weighted, NaN if not requested.
    pub redundancy: [f64; 6],
    /// Control points.
    pub points: Vec<AdjustedControl>,
    /// Image observations.
    pub images: Vec<AdjustedImage>,
    /// Points behind the camera, ascending; the equations do not exclude them.
    pub behind: Vec<usize>,
    /// Weighted sum of squares of all observations.
    pub sum_of_squares: f64,
    /// Number of observations and weighted unknowns minus number of unknowns.
    pub degrees_of_freedom: i64,
    /// Initial pose of the adjustment.
    pub start: Pose,
    /// The pose after each iteration.
    pub history: Vec<Pose>,
    /// Other minima; their sum of squares exceeds the least by at most nine times the variance of unit weight (at least nine).
    pub alternatives: Vec<Alternative>,
    /// Reason why an alternative pose with a similar fit is not determined. With three points it may be on the danger cylinder, unlike the
    /// other poses.
    pub undetermined: Option<Degeneracy>,
    /// Distance of the projection centre from the right cylinder over the circle through three points, negative inside; None unless there
    /// are exactly three. On this danger cylinder the pose is not determined.
    pub outside_danger_cylinder: Option<f64>,
    /// Status, iterations, counts.
    pub adjustment: Adjustment,
}

/// Largest difference of poses of the same minimum, in radians and as a fraction of the distance to the points.
const SAME: f64 = 1e-6;
/// Largest excess of the sum of squares of an alternative, in variances of unit weight: three standard deviations.
const NINE: f64 = 9.0;

impl Solution {
    /// Selects the best adjustment; the others are alternatives. None without any.
    pub(super) fn new(
        resection: &Resection,
        solved: Vec<Solved>,
        undetermined: Option<Degeneracy>,
    ) -> Option<Self> {
        let mut rest = solved.into_iter();
        let best = rest.next()?;
        let sum_of_squares = best.sum_of_squares();
        let mut solution = Self { undetermined, ..Self::of(resection, best, sum_of_squares) };
        let freedom = solution.degrees_of_freedom;
        let variance = if freedom > 0 { (sum_of_squares / freedom as f64).max(1.0) } else { 1.0 };
        for other in rest.filter(Solved::converged) {
            let pose = other.pose();
            let found = solution
                .alternatives
                .iter()
                .map(|known| known.pose)
                .chain([solution.pose])
                .collect::<Vec<_>>();
            let fits = other.sum_of_squares() - sum_of_squares <= NINE * variance;
            if fits && !found.iter().any(|known| resection.same(known, &pose)) {
                solution.alternatives.push(Alternative { pose, sum_of_squares: other.sum_of_squares() });
            }
        }
        Some(solution)
    }

    fn of(resection: &Resection, solved: Solved, sum_of_squares: f64) -> Self {
        let pose = solved.pose();
        let Solved { problem, mut adjustment, start, origin } = solved;
        let unknowns = std::mem::take(&mut adjustment.unknowns);
        let cofactors = adjustment.cofactors.take();
        let own = adjustment.prior_redundancy.take();
        let redundancy_of = |unknown: usize| own.as_ref().map_or(f64::NAN, |all| all[unknown]);
        let first = problem.layout().all_retained().start;
        let local = cofactors.as_ref().map(|all| &all.local[..]);
        let control = |point: usize| AdjustedControl {
            coordinates: std::array::from_fn(|k| {
                let given = &resection.points[point];
                let value = unknowns[3 * point + k] + origin[k];
                if given.sd[k] == 0.0 { given.coordinates[k] } else { value }
            }),
            cofactors: leading_matrix(local.map(|all| &all[9 * point..])),
            redundancy: std::array::from_fn(|k| redundancy_of(3 * point + k)),
        };
        let history = adjustment.history.iter().skip(1).map(|values| absolute(values, origin)).collect();
        Self {
            pose,
            cofactors: leading_matrix(cofactors.as_ref().map(|all| &all.retained[..])),
            redundancy: std::array::from_fn(|k| redundancy_of(first + k)),
            points: (0..resection.points.len()).map(control).collect(),
            images: images(&problem.model, &unknowns, &problem.observation_sd, &mut adjustment),
            behind: problem.model.behind(&unknowns),
            sum_of_squares,
            degrees_of_freedom: adjustment.counts.degrees_of_freedom(),
            start,
            history,
            alternatives: vec![],
            undetermined: None,
            outside_danger_cylinder: outside_cylinder(
                &resection.sight().points,
                &resection.space.cartesian(pose.position),
            )
            .map(|(outside, _)| outside),
            adjustment,
        }
    }
}

impl Resection {
    /// Returns whether two poses are the same minimum.
    fn same(&self, a: &Pose, b: &Pose) -> bool {
        let cartesian = |pose: &Pose| self.space.cartesian(pose.position);
        let (first, second) = (cartesian(a), cartesian(b));
        let distance =
            self.sight().points.iter().fold(0.0, |most: f64, point| {
                (0..3).map(|k| (point[k] - first[k]).abs()).fold(most, f64::max)
            });
        let turned = |k: usize| (a.attitude[k] - b.attitude[k]).sin().abs() < SAME;
        (0..3).all(|k| turned(k) && (first[k] - second[k]).abs() < SAME * distance)
    }
}

/// Returns residuals, test values and partials, observation by observation.
fn images(
    model: &SinglePhoto,
    unknowns: &[f64],
    sd: &[f64],
    adjustment: &mut Adjustment,
) -> Vec<AdjustedImage> {
    let residuals = std::mem::take(&mut adjustment.residuals);
    let redundancy = adjustment.redundancy.take().unwrap_or_else(|| vec![f64::NAN; sd.len()]);
    let At { photo, points, .. } = model.evaluated(unknowns);
    let image = |index: usize| {
        let of = |values: &[f64]| [values[2 * index], values[2 * index + 1]];
        let (residual, redundancy, sd) = (of(&residuals), of(&redundancy), of(sd));
        AdjustedImage {
            residual,
            redundancy,
            standardized: std::array::from_fn(|row| standardized(residual[row], sd[row], redundancy[row])),
            partials: model.linearize(&photo, &points[index], index).photo,
        }
    };
    (0..points.len()).map(image).collect()
}

/// Adjustment with its problem.
pub(super) struct Solved {
    pub problem: Problem<SinglePhoto>,
    pub adjustment: Adjustment,
    pub start: Pose,
    pub origin: [f64; 3],
}

impl Solved {
    pub fn pose(&self) -> Pose {
        absolute(&self.adjustment.unknowns[self.problem.layout().all_retained()], self.origin)
    }

    /// Returns the final weighted sum of squares.
    pub fn sum_of_squares(&self) -> f64 {
        let last = self.adjustment.iterations.last();
        last.map_or(self.adjustment.initial_sum_of_squares, |iteration| iteration.sum_of_squares)
    }

    pub fn behind(&self) -> Vec<usize> {
        self.problem.model.behind(&self.adjustment.unknowns)
    }

    pub fn converged(&self) -> bool {
        self.adjustment.status == Status::Converged
    }
}

/// Converts a pose from the local origin to the object space.
pub(super) fn absolute(values: &[f64], origin: [f64; 3]) -> Pose {
    let local = Pose::from_unknowns(values);
    local.counted_from(origin.map(|value| -value))
}

/// Model of one photo of control points: the collinearity equations. The local blocks are the points, the retained block is the photo.
#[derive(Debug)]
pub struct SinglePhoto {
    pub space: ObjectSpace,
    pub sense: RotationSense,
    /// Principal distance in millimetres, signed.
    pub principal_distance: f64,
    pub partials: Partials,
    /// Control points relative to the local origin.
    pub points: Vec<ControlPoint>,
}

impl SinglePhoto {
    /// Returns the image of a point with its partials.
    #[inline]
    pub fn linearize(&self, photo: &View, point: &Point, index: usize) -> Projection {
        match self.partials {
            Partials::AtComputed => photo.linearize(point),
            Partials::AtMeasured => linearize_at_measured(photo, point, self.points[index].xy),
        }
    }

    /// Returns the points behind the camera, ascending; the equations do not exclude them.
    pub fn behind(&self, unknowns: &[f64]) -> Vec<usize> {
        let At { photo, .. } = self.evaluated(unknowns);
        let points = unknowns[..3 * self.points.len()].as_chunks().0.iter().enumerate();
        points
            .filter(|&(_, &coordinates)| photo.depth(&self.space.cartesian(coordinates)) < 0.0)
            .map(|(point, _)| point)
            .collect()
    }
}

/// Photo and points at given values of the unknowns.
pub struct At<'a> {
    model: &'a SinglePhoto,
    pub photo: View,
    pub points: Vec<Point>,
}

impl SinglePhoto {
    /// Evaluates photo and points at given values of the unknowns.
    pub fn evaluated(&self, unknowns: &[f64]) -> At<'_> {
        let (points, photo) = unknowns.split_at(3 * self.points.len());
        let points = points.as_chunks().0.iter().map(|&coordinates| Point::new(self.space, coordinates));
        let Pose { position, attitude } = Pose::from_unknowns(photo);
        let photo = View::new(self.space, self.sense, position, attitude, self.principal_distance);
        At { model: self, photo, points: points.collect() }
    }
}

impl Model for SinglePhoto {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        Box::new(self.evaluated(unknowns))
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, _: usize, rows: &mut GroupRows<'_>) {
        let measured = self.model.points[local].xy;
        let projection = self.model.linearize(&self.photo, &self.points[local], local);
        for row in 0..2 {
            rows.constant[row] = measured[row] - projection.xy[row];
            rows.local[3 * row..][..3].copy_from_slice(&projection.point[row]);
            rows.retained[6 * row..][..6].copy_from_slice(&projection.photo[row]);
        }
    }
}

/// Returns the image position of a point and the partials of program W5344 (USGS Computer Contribution 2, 1969, equations 4 and 5). They
/// contain the measured image position instead of the computed one; both agree if the residuals are zero.
pub fn linearize_at_measured(photo: &View, point: &Point, measured: [f64; 2]) -> Projection {
    let u = photo.orientation.to_camera_frame(point);
    photo.orientation.projection(&u, &photo.camera.linearize_at(&u, |_| measured), point)
}
