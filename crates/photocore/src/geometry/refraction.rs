//! Refraction in air and water, modelled as a lift of the ground point before projection.
//!
//! In the report's form (GIANT guide, Appendices F and G) a point at D from the camera is lifted along the local vertical of the camera.
//! The lift is dZ = (K_a + K_w) D.D / dZ0 with dZ0 = -up . D; it rotates the ray by (K_a + K_w) tan alpha away from the nadir. The rigorous
//! ray through water lifts the point along its own vertical. `docs/refraction.md` derives both.

use super::atmosphere::{Air, SCALE_HEIGHT};
use super::ellipsoid::{GeometryError, local_vertical};
use super::orientation::Orientation;
use super::rotation::{Matrix3, Vector3};
use super::space::{ObjectSpace, Point, RefractionOffset};

/// Refractivity n - 1 of air at sea level (Saastamoinen 1974).
const REFRACTIVITY: f64 = 277.0e-6;
/// Minimum height of the camera above a point for a correction by air, in metres: K_a tan alpha is invalid for horizontal rays.
const LEAST_DROP: f64 = 1.0;
/// Half-width of the depth smoothing at the water level, as a fraction of the camera height above it. The smoothed depth differs by at most
/// a quarter of this. Refraction leaves 30 % of that: below half a micrometre in a photograph up to 45 degrees.
const SHORE: f64 = 3e-5;

/// Model of refraction in air.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AirModel {
    /// K_a = 13 (H - h) [1 - 0.02 (2 H + h)] microradians, km (GIANT guide, Appendix F), to 9 km.
    Giant,
    /// K_a = mean of n - n(H) between point and camera, in horizontal layers of the standard atmosphere.
    Standard,
}

/// Model of refraction in water.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaterModel {
    /// K_w = [(Hc + d) / (Hc + d') - 1] / (1 + tan^2 alpha) (GIANT guide, Appendix G).
    Giant,
    /// Rigorous ray by Snell's law at a plane perpendicular to the vertical at the point.
    Snell,
}

/// Water below a level; it affects only points below the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    model: WaterModel,
    level: f64,
    index: f64,
}

impl Water {
    /// Returns water with its surface at the height `level` (linear unit) and a refractive index relative to air.
    ///
    /// # Errors
    /// The level must be finite, the index finite and at least 1.
    pub fn new(model: WaterModel, level: f64, index: f64) -> Result<Self, GeometryError> {
        if level.is_finite() && index.is_finite() && index >= 1.0 {
            Ok(Self { model, level, index })
        } else {
            Err(GeometryError::Water { level, index })
        }
    }
}

/// Air and water between points and cameras. The third coordinate of the object space is the height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refraction {
    /// Model of the air; None for no refraction in air.
    pub air: Option<AirModel>,
    /// Water; None for no water.
    pub water: Option<Water>,
    /// Metres per linear unit.
    pub metres_per_unit: f64,
    /// Height of the zero of the third coordinate, in the linear unit.
    pub datum: f64,
}

/// Vertical at one end of a ray.
#[derive(Debug, Clone, Copy)]
pub struct Vertical {
    /// Unit vector in cartesian axes.
    up: Vector3,
    /// Partials of the unit vector with respect to the three coordinates, as columns.
    turning: Matrix3,
    /// Height in the linear unit.
    height: f64,
    /// Air at this height; vacuum unless the air model needs it.
    air: Air,
}

/// Lift of a point along a vertical, and its partials.
#[derive(Debug, Clone, Copy)]
struct Rise {
    value: f64,
    /// With respect to D.D.
    by_square: f64,
    /// With respect to -up . D.
    by_drop: f64,
    /// With respect to the heights of the camera and of the point.
    by_heights: [f64; 2],
}

/// K and its partials.
#[derive(Debug, Clone, Copy, Default)]
struct Bending {
    value: f64,
    /// With respect to the square of the horizontal distance.
    by_across: f64,
    /// With respect to the heights of the camera and of the point.
    by_heights: [f64; 2],
}

impl Refraction {
    /// Returns the vertical at a position of the object space.
    pub fn vertical(&self, space: ObjectSpace, coordinates: [f64; 3]) -> Vertical {
        let height = coordinates[2] + self.datum;
        let air = match self.air {
            Some(AirModel::Standard) => Air::at(height * self.metres_per_unit),
            _ => Air::NONE,
        };
        let (up, turning) = match space {
            ObjectSpace::Rectangular => (Vector3::z(), Matrix3::zeros()),
            ObjectSpace::Geographic(_) => {
                // d(up)/d(latitude) is north, d(up)/d(longitude) is east times the cosine of the latitude.
                let rows = local_vertical(coordinates[0], coordinates[1]);
                let (north, up) = (rows.row(1).transpose(), rows.row(2).transpose());
                (up, Matrix3::from_columns(&[Vector3::new(-up.y, up.x, 0.0), north, Vector3::zeros()]))
            }
        };
        Vertical { up, turning, height, air }
    }

    /// Returns the lift of a point for one photo; `station` and `foot` are the verticals at photo and point.
    pub fn offset(
        &self,
        photo: &Orientation,
        station: &Vertical,
        point: &Point,
        foot: &Vertical,
    ) -> RefractionOffset {
        let d = point.position() - photo.centre();
        let (square, drop) = (d.norm_squared(), -station.up.dot(&d));
        let mut bending = self.air(station, foot);
        let mut offset = RefractionOffset::none();
        if let Some(water) = &self.water {
            match water.model {
                WaterModel::Giant => bending.add(&water.bending(square - drop * drop, station, foot)),
                WaterModel::Snell => {
                    let rise = water.rise(square, -foot.up.dot(&d), foot);
                    let turned = add(&mut offset, &rise, foot, &d, photo, point);
                    offset.by_point += turned;
                }
            }
        }
        if bending.value != 0.0 {
            let turned = add(&mut offset, &bending.rise(square, drop), station, &d, photo, point);
            offset.by_photo += turned;
        }
        offset
    }

    /// Returns K_a between a camera and a point.
    fn air(&self, station: &Vertical, foot: &Vertical) -> Bending {
        let metres = self.metres_per_unit;
        let drop = metres * (station.height - foot.height);
        let Some(model) = self.air.filter(|_| drop >= LEAST_DROP) else { return Bending::default() };
        let (value, by_heights) = match model {
            AirModel::Giant => appendix_f(1e-3 * metres * station.height, 1e-3 * metres * foot.height),
            AirModel::Standard => layered(&station.air, &foot.air, drop),
        };
        Bending { value, by_across: 0.0, by_heights: by_heights.map(|each| metres * each) }
    }
}

/// Returns K_a of the GIANT guide, Appendix F, for heights in km; partials per metre.
fn appendix_f(station: f64, point: f64) -> (f64, [f64; 2]) {
    let (drop, thinning) = (station - point, 1.0 - 0.02 * (2.0 * station + point));
    (13e-6 * drop * thinning, [13e-9 * (thinning - 0.04 * drop), 13e-9 * (-thinning - 0.02 * drop)])
}

/// Returns K_a = N0 [R T0 / (M g) (p_h - p_H) / (H - h) - rho_H], p and rho relative to sea level; partials per metre.
///
/// The mean of n - n(H) over the height: in equilibrium the integral of the density is the pressure difference.
fn layered(station: &Air, point: &Air, drop: f64) -> (f64, [f64; 2]) {
    let mean = SCALE_HEIGHT * (point.pressure - station.pressure) / drop;
    let by_station = (station.density - mean) / drop - station.gradient;
    let by_point = (mean - point.density) / drop;
    (REFRACTIVITY * (mean - station.density), [REFRACTIVITY * by_station, REFRACTIVITY * by_point])
}

impl Bending {
    fn add(&mut self, other: &Self) {
        self.value += other.value;
        self.by_across += other.by_across;
        (0..2).for_each(|k| self.by_heights[k] += other.by_heights[k]);
    }

    /// Returns dZ = K D.D / dZ0; the square of the horizontal distance is D.D - dZ0^2.
    fn rise(&self, square: f64, drop: f64) -> Rise {
        let stretch = square / drop;
        Rise {
            value: self.value * stretch,
            by_square: self.value / drop + self.by_across * stretch,
            by_drop: -self.value * stretch / drop - 2.0 * square * self.by_across,
            by_heights: self.by_heights.map(|each| each * stretch),
        }
    }
}

/// Smoothed depth of a point and its partials.
#[derive(Debug, Clone, Copy)]
struct Depth {
    value: f64,
    /// With respect to the unsmoothed depth.
    by_depth: f64,
    /// With respect to the height of the camera above the water.
    by_height: f64,
}

/// Difference d - d' of true and apparent depth, and its partials.
#[derive(Debug, Clone, Copy)]
struct Shallowing {
    value: f64,
    /// With respect to the square of the horizontal distance, the camera height above the water, and the depth.
    by: [f64; 3],
}

impl Water {
    /// Returns the depth of a point for a camera at `height` above the water; None if the camera is below it or the point above it.
    ///
    /// max(0, d) has a kink, and iterations do not converge to a minimum on a kink. Within e = `SHORE` x height of the level the depth is
    /// therefore (d + e)^2 / (4 e).
    fn depth(&self, foot: &Vertical, height: f64) -> Option<Depth> {
        let (depth, shore) = (self.level - foot.height, SHORE * height);
        if height <= 0.0 || depth <= -shore {
            None
        } else if depth >= shore {
            Some(Depth { value: depth, by_depth: 1.0, by_height: 0.0 })
        } else {
            let part = (depth + shore) / (2.0 * shore);
            Some(Depth { value: part * part * shore, by_depth: part, by_height: SHORE * part * (1.0 - part) })
        }
    }

    /// Returns K_w = (d - d') / (Hc + d') / (1 + L^2 / (Hc + d)^2) of the GIANT guide, Appendix G. Heights of camera and point are
    /// ellipsoidal.
    fn bending(&self, across: f64, station: &Vertical, foot: &Vertical) -> Bending {
        let height = station.height - self.level;
        let Some(depth) = self.depth(foot, height) else { return Bending::default() };
        let Shallowing { value, by } = self.shallowing(across, height, depth.value);
        let (drop, apparent) = (height + depth.value, height + depth.value - value);
        let slant = drop * drop + across;
        let steep = drop * drop / slant;
        // K_w = steep (d - d') / apparent; steep and apparent depend on drop.
        let bending = steep * value / apparent;
        let by_value = steep * drop / (apparent * apparent);
        let by_drop = bending * (2.0 * across / (drop * slant) - 1.0 / apparent);
        let [by_height, by_depth] = [by[1], by[2]].map(|each| by_value * each + by_drop);
        Bending {
            value: bending,
            by_across: by_value * by[0] - bending / slant,
            // A higher point has a smaller depth.
            by_heights: [by_height + by_depth * depth.by_height, -by_depth * depth.by_depth],
        }
    }

    /// Returns the lift d - d' of the rigorous ray in the frame of the point; `drop` is the camera height above the point in that frame.
    fn rise(&self, square: f64, drop: f64, foot: &Vertical) -> Rise {
        let height = drop - (self.level - foot.height);
        let Some(depth) = self.depth(foot, height) else {
            return Rise { value: 0.0, by_square: 0.0, by_drop: 0.0, by_heights: [0.0; 2] };
        };
        let Shallowing { value, by: [by_across, by_height, by_depth] } =
            self.shallowing(square - drop * drop, height, depth.value);
        let by_height = by_height + by_depth * depth.by_height;
        Rise {
            value,
            by_square: by_across,
            by_drop: by_height - 2.0 * drop * by_across,
            // A higher point has a smaller depth; at the same drop its camera is higher above the water.
            by_heights: [0.0, by_height - by_depth * depth.by_depth],
        }
    }

    /// Returns d - d' = d (1 - q) for a camera at `height` above the water and the square `across` of the horizontal distance L.
    ///
    /// With T = tan i above the water: tan r = q T below it, q = 1 / sqrt(n^2 + (n^2 - 1) T^2), L = T (Hc + d q). Implicit differentiation
    /// gives (Hc + d n^2 q^3) dT = dL - T dHc - q T dd.
    fn shallowing(&self, across: f64, height: f64, depth: f64) -> Shallowing {
        let index_square = self.index * self.index;
        let tangent = self.tangent(across.max(0.0).sqrt(), height, depth);
        let tangent_square = tangent * tangent;
        let q = (index_square + (index_square - 1.0) * tangent_square).sqrt().recip();
        // dq = -(n^2 - 1) q^3 T dT, with T dL = d(L^2) / 2 / (Hc + d q).
        let scale = depth * (index_square - 1.0) * q.powi(3) / (height + depth * index_square * q.powi(3));
        Shallowing {
            value: depth * (1.0 - q),
            by: [
                scale * 0.5 / (height + depth * q),
                -scale * tangent_square,
                1.0 - q - scale * tangent_square * q,
            ],
        }
    }

    /// Returns T of L = T (Hc + d q(T)) by Newton's method. The right side is concave and q <= 1/n, so that T increases monotonically from
    /// the initial value to the root.
    fn tangent(&self, across: f64, height: f64, depth: f64) -> f64 {
        const MOST_STEPS: usize = 50;
        let index_square = self.index * self.index;
        let mut tangent = across / (height + depth / self.index);
        for _ in 0..MOST_STEPS {
            let q = (index_square + (index_square - 1.0) * tangent * tangent).sqrt().recip();
            let short = across - tangent * (height + depth * q);
            let step = short / (height + depth * index_square * q.powi(3));
            tangent += step;
            if step <= 4.0 * f64::EPSILON * tangent {
                break;
            }
        }
        tangent
    }
}

/// Adds a rise along a vertical to a lift. Returns the partials due to the rotation of the vertical, which belong to the end of the ray at
/// the vertical.
fn add(
    offset: &mut RefractionOffset,
    rise: &Rise,
    vertical: &Vertical,
    d: &Vector3,
    photo: &Orientation,
    point: &Point,
) -> Matrix3 {
    let up = vertical.up;
    let by_vector = 2.0 * rise.by_square * d - rise.by_drop * up;
    let mut by_photo = -photo.centre_partials().tr_mul(&by_vector);
    let mut by_point = point.partials().tr_mul(&by_vector);
    by_photo.z += rise.by_heights[0];
    by_point.z += rise.by_heights[1];
    let by_turning = -rise.by_drop * vertical.turning.tr_mul(d);
    offset.vector += rise.value * up;
    offset.by_photo += up * by_photo.transpose();
    offset.by_point += up * by_point.transpose();
    up * by_turning.transpose() + rise.value * vertical.turning
}
