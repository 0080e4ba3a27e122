//! Block triangulation: photographs and points adjusted together (GIANT guide, sections 4 to 9).
//!
//! Unknowns are the position and attitude of every photograph and the coordinates of every point, each weighted from
//! free to fixed; observations are image coordinates. Positions are X, Y, Z or longitude, latitude, height.

mod initial;
mod model;
mod neighbourhood;
mod precision;
mod screening;
mod solution;

use std::ops::ControlFlow;

use rayon::ThreadPool;
use thiserror::Error;

use crate::adjustment::{self, AdjustError, Event, Problem, gib};
use crate::geometry::{self, ObjectSpace, Refraction, RotationSense};
use crate::normals::{Layout, LayoutError, Ordering, System};

use model::CentralPerspective;
pub use screening::{Dropped, Reason};
pub use solution::{AdjustedPhoto, AdjustedPoint, Solution, SumsOfSquares};

/// A photograph as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    /// Initial position in the coordinates of the object space; that of fixed components.
    pub position: [f64; 3],
    /// Initial omega, phi, kappa in radians; those of fixed angles.
    pub attitude: [f64; 3],
    /// Observed position; of its components those count that are weighted.
    pub observed_position: [f64; 3],
    /// Observed omega, phi, kappa in radians, whole turns apart; those count that are weighted.
    pub observed_attitude: [f64; 3],
    /// Standard deviations of the position: infinite free, zero fixed.
    pub position_sd: [f64; 3],
    /// Standard deviations of the attitude in radians: infinite free, zero fixed.
    pub attitude_sd: [f64; 3],
    /// Signed principal distance in millimetres: negative for the positive plane.
    pub principal_distance: f64,
}

/// A point as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Coordinates in the object space; NaN where unknown.
    pub coordinates: [f64; 3],
    /// Standard deviations: finite for held components of control (zero fixed), infinite for all others.
    pub sd: [f64; 3],
}

impl Point {
    /// Which components are held.
    pub fn held(&self) -> [bool; 3] {
        self.sd.map(f64::is_finite)
    }
}

/// An image point.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of its photograph.
    pub photo: usize,
    /// Index of its point.
    pub point: usize,
    /// Image coordinates in millimetres.
    pub xy: [f64; 2],
    /// Their standard deviations in millimetres.
    pub sd: [f64; 2],
}

/// A block of photographs.
#[derive(Debug, Clone)]
pub struct Block {
    /// Coordinates of positions and points.
    pub space: ObjectSpace,
    /// Sense of the attitude angles.
    pub sense: RotationSense,
    /// What bends the rays, applied in every iteration; None for images that are free of it.
    pub refraction: Option<Refraction>,
    /// Its photographs.
    pub photos: Vec<Photo>,
    /// Its points.
    pub points: Vec<Point>,
    /// Its image points.
    pub images: Vec<Image>,
}

/// What the variance of unit weight is based on (GIANT guide, Appendix E).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum UnitVariance {
    /// Cameras completely free: image coordinates and ground control count, weights of the cameras do not.
    Free,
    /// Cameras constrained: every weighted quantity counts.
    #[default]
    Constrained,
    /// Set to one.
    Unity,
}

/// How to adjust a block.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop, and what to compute.
    pub adjustment: adjustment::Options,
    /// How to order the photographs.
    pub ordering: Ordering,
    /// What the variance of unit weight is based on.
    pub unit_variance: UnitVariance,
    /// Bytes that the adjustment may take (see [`System::memory`]); None for any number.
    pub memory: Option<usize>,
}

/// Why a block cannot be adjusted. Photographs and points are indices into the block.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum BlockError {
    /// An image names a photograph or point that is not there.
    #[error("image {0} names a photo or point that is not in the block")]
    Index(usize),
    /// Nothing to adjust.
    #[error("no point is left to adjust: none is on two photos")]
    Empty,
    /// The rays of a point do not say where it is.
    #[error("the rays of point {0} do not intersect, so that it has no initial position")]
    NoIntersection(usize),
    /// Points whose image points do not determine them.
    #[error("{} points are not determined by their image points", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Photographs whose position and attitude the observations do not determine; one list for each undetermined
    /// combination.
    #[error("{} combinations of the photos' positions and attitudes are not determined", .0.len())]
    UndeterminedPhotos(Vec<Vec<usize>>),
    /// The initial values put a point into the plane of a projection centre, so that its image is not finite.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
    /// Coordinates or angles that double precision rounds by more than their standard deviations, or than image coordinates show.
    #[error("{} photos and {} points have coordinates or angles too large for double precision", .photos.len(), .points.len())]
    Coarse {
        /// Photographs that have them.
        photos: Vec<usize>,
        /// Points that have them.
        points: Vec<usize>,
    },
    /// The adjustment would take more memory than it may.
    #[error("the adjustment takes {} of memory, and {} are free", gib(*.needed), gib(*.available))]
    Memory {
        /// Bytes that it would take.
        needed: usize,
        /// Bytes that it may take.
        available: usize,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// An allocation of so many bytes failed.
    #[error("there is no memory for an array of {0} bytes")]
    OutOfMemory(usize),
    /// More than can be numbered.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

impl BlockError {
    /// What stopped the adjustment, in terms of the block; `points` are those that took part.
    fn new(error: AdjustError, points: &[usize]) -> Self {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                let mut points: Vec<usize> = locals.into_iter().map(|local| points[local]).collect();
                points.sort_unstable();
                Self::UndeterminedPoints(points)
            }
            AdjustError::Undetermined(combinations) => Self::UndeterminedPhotos(combinations),
            AdjustError::NotFinite => Self::NotFinite,
            AdjustError::Interrupted => Self::Interrupted,
            AdjustError::OutOfMemory(bytes) => Self::OutOfMemory(bytes),
        }
    }
}

impl Block {
    /// Adjusts the block by least squares.
    ///
    /// Points that their image points cannot determine are left out first (see [`Dropped`]); the others start from the
    /// intersection of their rays (straight ones). `watch` is called on the calling thread; when it breaks, the adjustment stops.
    ///
    /// # Errors
    /// A block that contradicts itself, has nothing to adjust, or leaves unknowns undetermined; an interruption.
    pub fn adjust(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, BlockError> {
        let counts = (self.photos.len(), self.points.len());
        if let Some(bad) =
            self.images.iter().position(|image| image.photo >= counts.0 || image.point >= counts.1)
        {
            return Err(BlockError::Index(bad));
        }
        let Screened { points, images, dropped } = self.screen();
        if points.is_empty() {
            return Err(BlockError::Empty);
        }
        self.check_rounding()?;
        let origin = self.origin();
        let problem = pool.install(|| self.problem(options, &points, images, origin))?;
        let needed = problem.system.memory();
        if let Some(available) = options.memory.filter(|&available| needed > available) {
            return Err(BlockError::Memory { needed, available });
        }
        let adjusted = adjustment::adjust(&problem, &options.adjustment, pool, watch)
            .map_err(|error| BlockError::new(error, &points))?;
        Ok(Solution::new(self, options, &problem, adjusted, &points, origin, dropped))
    }

    /// A point near the photographs: coordinates are counted from it while the block is adjusted, so that no digits are lost
    /// in large ones. Medians, so that a single photograph with a wrong position does not move it. Geographic coordinates stay
    /// as they are; differences are formed in geocentric space.
    fn origin(&self) -> [f64; 3] {
        let middle = |k: usize| {
            let mut values: Vec<f64> = self.photos.iter().map(|photo| photo.position[k]).collect();
            let middle = values.len() / 2;
            let median =
                (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1);
            median.map_or(0.0, f64::round)
        };
        match self.space {
            ObjectSpace::Rectangular => std::array::from_fn(middle),
            ObjectSpace::Geographic(_) => [0.0; 3],
        }
    }

    /// The least-squares problem: points are local blocks of three, photographs kept blocks of six.
    fn problem(
        &self,
        options: &Options,
        points: &[usize],
        images: PointImages,
        origin: [f64; 3],
    ) -> Result<Problem<CentralPerspective>, BlockError> {
        let PointImages { start, order } = images;
        let local = |values: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| values[k] - origin[k]) };
        let local_point = |&point: &usize| {
            let Point { coordinates, sd } = self.points[point];
            Point { coordinates: local(coordinates), sd }
        };
        let model = CentralPerspective {
            space: self.space,
            sense: self.sense,
            // Coordinates are counted from the origin; heights are not.
            refraction: self
                .refraction
                .map(|refraction| Refraction { datum: refraction.datum + origin[2], ..refraction }),
            principal_distances: self.photos.iter().map(|photo| photo.principal_distance).collect(),
            points: points.iter().map(local_point).collect(),
            images: order.iter().map(|&image| self.images[image]).collect(),
            start,
            order,
        };
        let photo_values = |photo: &Photo| [local(photo.position), photo.attitude];
        let photo_prior = |photo: &Photo| {
            let mut position = photo.observed_position;
            if let ObjectSpace::Geographic(_) = self.space {
                [position[0]] = geometry::nearest_turns([position[0]], [photo.position[0]]);
            }
            [local(position), geometry::nearest_turns(photo.observed_attitude, photo.attitude)]
        };
        let photo_sd = |photo: &Photo| [photo.position_sd, photo.attitude_sd];
        let photos =
            self.photos.iter().map(photo_values).collect::<Vec<_>>().into_flattened().into_flattened();
        let prior = self.photos.iter().flat_map(photo_prior).flatten();
        let stations = model.photos(&photos);
        let met = model.intersect(&stations);
        self.check_resolution(model.middle_distance(&stations, met.as_deref().ok()))?;
        let coordinates = met.map_err(|point| BlockError::NoIntersection(points[point]))?;
        let own: Vec<[f64; 3]> = model.points.iter().map(|point| point.coordinates).collect();
        let own_sd = model.points.iter().map(|point| point.sd);
        let sd = own_sd.chain(self.photos.iter().flat_map(photo_sd)).flatten().collect();
        let photo_of = model.images.iter().map(|image| image.photo as u32).collect();
        let places = stations.iter().map(|photo| photo.centre().into()).collect();
        let layout = Layout::new(2, 3, &vec![6; self.photos.len()], model.start.clone(), photo_of)?
            .with_places(places)?;
        Ok(Problem {
            observation_sd: model.images.iter().flat_map(|image| image.sd).collect(),
            system: System::new(layout, options.ordering),
            initial: [coordinates.into_flattened(), photos].concat(),
            prior: own.into_flattened().into_iter().chain(prior).collect(),
            sd,
            model,
        })
    }
}

/// The points that take part, neighbours together, and what was left out.
struct Screened {
    points: Vec<usize>,
    images: PointImages,
    dropped: Vec<Dropped>,
}

/// The images of the points that take part, point by point: those of the i-th are `order[start[i]..start[i + 1]]`.
struct PointImages {
    start: Vec<usize>,
    order: Vec<usize>,
}
