//! Resection from three points without initial values. The law of cosines gives the distances of the points (Grunert 1841), reduced to one
//! cubic as by Persson and Nordberg (Lambda Twist, ECCV 2018).
//!
//! With l_i the distances, y_i unit rays and d_ij the sides of the triangle, |l_i y_i - l_j y_j|^2 = d_ij^2. Two combinations of the three
//! equations are homogeneous: the cones l^T D1 l = 0 and l^T D2 l = 0. A cone D1 + g D2 with zero determinant is a pair of planes. On each
//! plane one distance is a linear function of the other two, and a quadratic equation remains.

use photocore::geometry::rotation::{solve, unit};
use photocore::geometry::{Matrix3, Vector3};

/// Pose in cartesian object space: u = G (P - C).
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// C, the projection centre.
    pub centre: Vector3,
    /// G: object space to photo.
    pub to_photo: Matrix3,
}

/// Largest misfits due to errors of the rays near the danger cylinder, at which two solutions merge and vanish: discriminant of a quadratic
/// equation relative to b^2; relative misclosures of the squared sides.
const NOT_REAL: f64 = 1e-2;
const NOT_CLOSED: f64 = 1e-2;
/// Relative difference of the distances below which two solutions are identical.
const TWINS: f64 = 1e-4;

/// Returns up to four placements with three points on three unit rays (in the photo), in front of the camera.
///
/// Near the danger cylinder two solutions may merge, and approximate solutions may be included.
pub fn three_points(rays: &[Vector3; 3], points: &[Vector3; 3]) -> Vec<Placement> {
    let triangle = RayTriangle::new(rays, points);
    let mut candidates = triangle.distances();
    candidates.sort_by(|a, b| a.misclosure.total_cmp(&b.misclosure));
    let mut found: Vec<Vector3> = Vec::new();
    for PoseCandidate { distances, .. } in candidates {
        let twin = |other: &Vector3| {
            (other - distances).norm_squared() <= (TWINS * TWINS) * distances.norm_squared()
        };
        if found.len() < 4 && !found.iter().any(twin) {
            found.push(distances);
        }
    }
    found.iter().filter_map(|distances| place(rays, points, distances)).collect()
}

/// Distances of three points, with their misclosure.
struct PoseCandidate {
    distances: Vector3,
    /// Sum of squares of the relative misclosures of the squared sides.
    misclosure: f64,
}

/// Squared sides and cosines between rays; `[0, 1, 2]` are the pairs 12, 13, 23.
struct RayTriangle {
    side: [f64; 3],
    cosine: [f64; 3],
}

const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

impl RayTriangle {
    fn new(rays: &[Vector3; 3], points: &[Vector3; 3]) -> Self {
        let side = PAIRS.map(|(i, j)| (points[i] - points[j]).norm_squared());
        Self { side, cosine: PAIRS.map(|(i, j)| rays[i].dot(&rays[j])) }
    }

    /// Returns the matrix of the quadratic form d_ij^2 of one pair.
    fn cone(&self, pair: usize) -> Matrix3 {
        let (i, j) = PAIRS[pair];
        let mut cone = Matrix3::zeros();
        (cone[(i, i)], cone[(j, j)]) = (1.0, 1.0);
        (cone[(i, j)], cone[(j, i)]) = (-self.cosine[pair], -self.cosine[pair]);
        cone
    }

    /// Returns positive distances that satisfy the three equations, possibly with repetitions.
    fn distances(&self) -> Vec<PoseCandidate> {
        let [c12, c13, c23] = [0, 1, 2].map(|pair| self.cone(pair));
        let [a12, a13, a23] = self.side;
        let d1 = a23 * c12 - a12 * c23;
        let d2 = a23 * c13 - a13 * c23;
        let (adjugate1, adjugate2) = (cofactors(&d1), cofactors(&d2));
        // det(D1 + g D2) = det D1 + g <adj D1, D2> + g^2 <D1, adj D2> + g^3 det D2.
        let cubic = [
            d1.column(0).dot(&adjugate1.column(0)),
            adjugate1.dot(&d2),
            d1.dot(&adjugate2),
            d2.column(0).dot(&adjugate2.column(0)),
        ];
        // Each pair of planes is paired with a cone of the pencil that does not vanish on them.
        let pair = |g: f64| (d1 + g * d2, d2 - g * d1);
        let mut pencil: Vec<(Matrix3, Matrix3)> = real_roots(&cubic).into_iter().map(pair).collect();
        if pencil.len() < 3 {
            // The root at infinity: D2 is a pair of planes (an isosceles triangle seen from above its axis).
            pencil.push((d2, d1));
        }
        let on_planes = |(cone, other): &(Matrix3, Matrix3)| -> Vec<Vector3> {
            planes(cone).iter().flat_map(|plane| self.on_plane(plane, other)).collect()
        };
        pencil.iter().flat_map(on_planes).filter_map(|distances| self.polish(distances)).collect()
    }

    /// Returns the distances on the plane n . l = 0 and on a cone: the largest component of n gives one distance from the other two.
    fn on_plane(&self, n: &Vector3, cone: &Matrix3) -> Vec<Vector3> {
        let k = (0..3).max_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
        let (p, q) = ((k + 1) % 3, (k + 2) % 3);
        // l = l_p (e + t f), t = l_q / l_p.
        let (mut e, mut f) = (Vector3::zeros(), Vector3::zeros());
        (e[p], e[k]) = (1.0, -n[p] / n[k]);
        (f[q], f[k]) = (1.0, -n[q] / n[k]);
        let (ce, cf) = (cone * e, cone * f);
        let ratios = quadratic_roots(f.dot(&cf), 2.0 * e.dot(&cf), e.dot(&ce));
        let distances = ratios.into_iter().filter_map(|t| {
            let direction = e + t * f;
            let sizes = [0, 1, 2].map(|pair| direction.dot(&(self.cone(pair) * direction)));
            // The longest side defines the scale.
            let longest = (0..3).max_by(|&a, &b| self.side[a].total_cmp(&self.side[b]))?;
            let scale = (self.side[longest] / sizes[longest]).sqrt();
            let distances = scale * direction;
            let positive = distances.iter().all(|&value| value.is_finite() && value > 0.0);
            positive.then_some(distances)
        });
        distances.collect()
    }

    /// Refines distances by a few Newton steps on the three equations; None without convergence.
    fn polish(&self, start: Vector3) -> Option<PoseCandidate> {
        let misclosure = |l: &Vector3| -> Vector3 {
            Vector3::from_fn(|pair, _| self.side[pair] - l.dot(&(self.cone(pair) * l)))
        };
        let size = |v: &Vector3| (0..3).map(|pair| (v[pair] / self.side[pair]).powi(2)).sum::<f64>();
        let (mut l, mut best) = (start, size(&misclosure(&start)));
        for _ in 0..6 {
            let row = |pair: usize| 2.0 * (self.cone(pair) * l).transpose();
            let jacobian = Matrix3::from_rows(&[0, 1, 2].map(row));
            let Some(step) = solve(&jacobian, &misclosure(&l), 1e-14) else { break };
            let next = l + step;
            let error = size(&misclosure(&next));
            if error.is_nan() || error >= best {
                break;
            }
            (l, best) = (next, error);
        }
        let closed = best < NOT_CLOSED * NOT_CLOSED && l.iter().all(|&value| value > 0.0);
        closed.then_some(PoseCandidate { distances: l, misclosure: best })
    }
}

/// Returns the placement with the points at the given distances along the rays, by aligning two congruent triangles.
fn place(rays: &[Vector3; 3], points: &[Vector3; 3], distances: &Vector3) -> Option<Placement> {
    let seen: [Vector3; 3] = std::array::from_fn(|i| distances[i] * rays[i]);
    // The columns of `axes` are unit vectors fixed to the triangle.
    let to_photo = axes(&seen)? * axes(points)?.transpose();
    Some(Placement { centre: points[0] - to_photo.tr_mul(&seen[0]), to_photo })
}

fn axes(corners: &[Vector3; 3]) -> Option<Matrix3> {
    let along = unit(&(corners[1] - corners[0]))?;
    let normal = unit(&along.cross(&(corners[2] - corners[0])))?;
    Some(Matrix3::from_columns(&[along, normal.cross(&along), normal]))
}

/// Returns the matrix of cofactors; for a symmetric matrix also the adjugate.
fn cofactors(m: &Matrix3) -> Matrix3 {
    let [a, b, c] = [0, 1, 2].map(|i| m.row(i).transpose());
    Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]).transpose()
}

/// Returns the normals v1 sqrt(e1) +- v2 sqrt(-e2) of the two planes of a symmetric cone with zero determinant; empty if the planes are not
/// real.
fn planes(cone: &Matrix3) -> Vec<Vector3> {
    // Nonzero eigenvalues: their sum is the trace, their product is the sum of the principal minors.
    let trace = cone.trace();
    let adjugate = cofactors(cone);
    let minors = adjugate.trace();
    let root = (trace * trace / 4.0 - minors).max(0.0).sqrt();
    let (positive, negative) = (trace / 2.0 + root, trace / 2.0 - root);
    if positive <= 0.0 || negative > 0.0 {
        return vec![];
    }
    let (Some(v1), Some(v2)) = (eigenvector(cone, positive), eigenvector(cone, negative)) else {
        return vec![];
    };
    let (s1, s2) = (positive.sqrt(), (-negative).sqrt());
    vec![s1 * v1 + s2 * v2, s1 * v1 - s2 * v2]
}

/// Returns the vector orthogonal to the rows of A - e I: the largest of the three cross products.
fn eigenvector(matrix: &Matrix3, eigenvalue: f64) -> Option<Vector3> {
    let rows = cofactors(&(matrix - eigenvalue * Matrix3::identity()));
    let largest = rows.row_iter().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
    unit(&largest.transpose())
}

/// Returns the real roots of c0 + c1 x + c2 x^2 + c3 x^3, with a lower degree if the leading coefficients vanish.
fn real_roots(c: &[f64; 4]) -> Vec<f64> {
    let largest = c.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    if c[3].abs() <= 1e-14 * largest {
        return quadratic_roots(c[2], c[1], c[0]);
    }
    // x = t - b/3: t^3 + p t + q = 0.
    let [d, b1, b] = [c[0] / c[3], c[1] / c[3], c[2] / c[3]];
    let p = b1 - b * b / 3.0;
    let q = 2.0 * b.powi(3) / 27.0 - b * b1 / 3.0 + d;
    let discriminant = (q / 2.0).powi(2) + (p / 3.0).powi(3);
    let depressed: Vec<f64> = if discriminant > 0.0 {
        let larger = q.signum() * (q.abs() / 2.0 + discriminant.sqrt());
        let u = -larger.cbrt();
        vec![u - p / (3.0 * u)]
    } else {
        let radius = 2.0 * (-p / 3.0).max(0.0).sqrt();
        let cosine = if radius > 0.0 { (3.0 * q / (p * radius)).clamp(-1.0, 1.0) } else { 1.0 };
        let angle = cosine.acos() / 3.0;
        [0.0, 1.0, 2.0].map(|k| radius * (angle - k * std::f64::consts::TAU / 3.0).cos()).to_vec()
    };
    let polish = |t: f64| {
        let mut x = t - b / 3.0;
        for _ in 0..4 {
            let slope = (3.0 * x + 2.0 * b) * x + b1;
            if slope == 0.0 {
                break;
            }
            x -= (((x + b) * x + b1) * x + d) / slope;
        }
        x
    };
    depressed.into_iter().map(polish).filter(|x| x.is_finite()).collect()
}

/// Returns the real roots of a x^2 + b x + c; a slightly negative discriminant gives a double root.
fn quadratic_roots(a: f64, b: f64, c: f64) -> Vec<f64> {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < -NOT_REAL * b * b {
        return vec![];
    }
    let q = -0.5 * (b + b.signum() * discriminant.max(0.0).sqrt());
    [q / a, c / q].into_iter().filter(|x| x.is_finite()).collect()
}
