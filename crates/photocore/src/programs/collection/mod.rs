//! Collections of photos of unknown cameras: bundle adjustment "in the large" (Agarwal, Snavely, Seitz and Szeliski 2010).
//!
//! Unknowns are nine parameters of every photo (rotation, translation, focal length, two coefficients of radial distortion; see
//! [`crate::geometry::bundler`]) and the coordinates of every point, each weighted from free to fixed; observations are image
//! coordinates. Where all are free the network has no datum: the cofactors are then those of minimum constraints, the position and
//! attitude of one photo and one component of the translation of another held.

mod model;
mod solution;

use std::ops::ControlFlow;

use rayon::ThreadPool;
use thiserror::Error;

use crate::adjustment::{self, AdjustError, Adjustment, Event, Problem, gib};
use crate::geometry::{BundlerParameters, BundlerPhoto};
use crate::normals::{Layout, LayoutError, Ordering, System};

use model::Bundle;
pub use solution::{AdjustedPhoto, AdjustedPoint, Solution};

/// A photo as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Photo {
    /// Initial (and, where weighted, observed) angle-axis vector, translation, f, k1, k2.
    pub parameters: BundlerParameters,
    /// Their standard deviations: infinite free, zero fixed.
    pub sd: BundlerParameters,
}

/// A point as it is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Initial (and, where weighted, observed) coordinates.
    pub position: [f64; 3],
    /// Their standard deviations: infinite free, zero fixed.
    pub sd: [f64; 3],
}

/// An image point.
#[derive(Debug, Clone, Copy)]
pub struct Image {
    /// Index of its photo.
    pub photo: usize,
    /// Index of its point.
    pub point: usize,
    /// Image coordinates in pixels from the principal point, x to the right, y up.
    pub xy: [f64; 2],
    /// Their standard deviations in pixels.
    pub sd: [f64; 2],
}

/// A collection of photos.
#[derive(Debug, Clone)]
pub struct Collection {
    /// Its photos.
    pub photos: Vec<Photo>,
    /// Its points.
    pub points: Vec<Point>,
    /// Its image points.
    pub images: Vec<Image>,
}

/// How to adjust a collection.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// When to stop, and what to compute.
    pub adjustment: adjustment::Options,
    /// How to order the photos.
    pub ordering: Ordering,
    /// Bytes that the adjustment may take (see [`System::memory`]); None for any number.
    pub memory: Option<usize>,
}

/// Why a collection cannot be adjusted, or has no cofactors. Photos and points are indices into the collection.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CollectionError {
    /// An image names a photo or point that is not there.
    #[error("image {0} names a photo or point that is not in the collection")]
    Index(usize),
    /// Nothing to adjust.
    #[error("no point is left to adjust: none is on two photos")]
    Empty,
    /// Points whose image points do not determine them.
    #[error("{} points are not determined by their image points", .0.len())]
    UndeterminedPoints(Vec<usize>),
    /// Photos whose parameters the observations do not determine; one list for each undetermined combination.
    #[error("{} combinations of the photos' parameters are not determined", .0.len())]
    UndeterminedPhotos(Vec<Vec<usize>>),
    /// The initial values put a point into the plane of a projection centre, so that its image is not finite.
    #[error("the initial values give image coordinates that are not finite")]
    NotFinite,
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

impl CollectionError {
    /// What stopped the adjustment, in terms of the collection; `points` are those that took part.
    fn new(error: AdjustError, points: &[usize]) -> Self {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                Self::UndeterminedPoints(locals.into_iter().map(|local| points[local]).collect())
            }
            AdjustError::Undetermined(combinations) => Self::UndeterminedPhotos(combinations),
            AdjustError::NotFinite => Self::NotFinite,
            AdjustError::Interrupted => Self::Interrupted,
            AdjustError::OutOfMemory(bytes) => Self::OutOfMemory(bytes),
        }
    }
}

impl Collection {
    /// Adjusts the collection.
    ///
    /// Points with an unknown that is free and images on one photo only are left out, and photos that then have no image stay
    /// as they are. So are points that run into a station: the adjustment goes on without them from where it was. `watch` is called on the calling thread; when it breaks, the adjustment stops.
    ///
    /// # Errors
    /// A collection that contradicts itself or has nothing to adjust; an interruption.
    pub fn adjust(
        &self,
        options: &Options,
        pool: &ThreadPool,
        watch: &mut dyn FnMut(Event) -> ControlFlow<()>,
    ) -> Result<Solution, CollectionError> {
        let counts = (self.photos.len(), self.points.len());
        let outside = |image: &Image| image.photo >= counts.0 || image.point >= counts.1;
        if let Some(bad) = self.images.iter().position(outside) {
            return Err(CollectionError::Index(bad));
        }
        let mut left_out = vec![false; self.points.len()];
        let mut reached = self.initial();
        let mut before: Option<Adjustment> = None;
        loop {
            let used = self.used(&left_out);
            if used.points.is_empty() {
                return Err(CollectionError::Empty);
            }
            let problem = self.problem(options, &used, &reached)?;
            let needed = problem.system.memory();
            if let Some(available) = options.memory.filter(|&available| needed > available) {
                return Err(CollectionError::Memory { needed, available });
            }
            let done = before.as_ref().map_or(0, |before| before.iterations.len());
            let mut adjustment_options = options.adjustment;
            adjustment_options.max_iterations = options.adjustment.max_iterations.saturating_sub(done);
            let mut adjusted = adjustment::adjust(&problem, &adjustment_options, pool, watch)
                .map_err(|error| CollectionError::new(error, &used.points))?;
            adjusted.go_on_from(before.take());
            if adjusted.collapsed.is_empty() {
                let collapsed = (0..left_out.len()).filter(|&point| left_out[point]).collect();
                return Ok(Solution::new(self, &problem, adjusted, &used, collapsed));
            }
            adjusted.collapsed.iter().for_each(|&local| left_out[used.points[local]] = true);
            self.take_over(&mut reached, &used, &adjusted.unknowns);
            before = Some(adjusted);
        }
    }

    /// Initial values: of the points, then of the photos.
    fn initial(&self) -> Values {
        Values {
            points: self.points.iter().map(|point| point.position).collect(),
            photos: self.photos.iter().map(|photo| photo.parameters).collect(),
        }
    }

    /// Takes over adjusted unknowns.
    fn take_over(&self, reached: &mut Values, used: &Used, unknowns: &[f64]) {
        let (points, photos) = unknowns.split_at(3 * used.points.len());
        used.points.iter().zip(points.as_chunks().0).for_each(|(&point, &at)| reached.points[point] = at);
        reached.photos.copy_from_slice(photos.as_chunks().0);
    }

    /// The points that their images determine, with the images in their order; without those `left_out`.
    fn used(&self, left_out: &[bool]) -> Used {
        let mut images_of = vec![Vec::new(); self.points.len()];
        for (index, image) in self.images.iter().enumerate() {
            images_of[image.point].push(index);
        }
        let mut used = Used {
            points: vec![],
            start: vec![0],
            images: Vec::with_capacity(self.images.len()),
            images_on: vec![0; self.photos.len()],
        };
        for (point, own) in images_of.into_iter().enumerate() {
            let Some(&first) = own.first() else { continue };
            let one_photo = own.iter().all(|&image| self.images[image].photo == self.images[first].photo);
            if left_out[point] || one_photo && self.points[point].sd.contains(&f64::INFINITY) {
                continue;
            }
            own.iter().for_each(|&image| used.images_on[self.images[image].photo] += 1);
            used.points.push(point);
            used.images.extend(own);
            used.start.push(used.images.len());
        }
        used
    }

    /// The least-squares problem, from the given values on: points are local blocks of three, photos kept blocks of nine.
    fn problem(
        &self,
        options: &Options,
        used: &Used,
        start: &Values,
    ) -> Result<Problem<Bundle>, CollectionError> {
        let images: Vec<Image> = used.images.iter().map(|&image| self.images[image]).collect();
        let photo_of = images.iter().map(|image| image.photo as u32).collect();
        let places = start
            .photos
            .iter()
            .map(|&parameters| BundlerPhoto::from_parameters(parameters).centre().into())
            .collect();
        let layout = Layout::new(2, 3, &vec![9; self.photos.len()], used.start.clone(), photo_of)?
            .with_places(places)?;
        let points = || used.points.iter().map(|&point| &self.points[point]);
        let unknowns = |values: &Values| -> Vec<f64> {
            let positions = used.points.iter().flat_map(|&point| values.points[point]);
            positions.chain(values.photos.iter().flatten().copied()).collect()
        };
        // A photo without images stays as it is.
        let photo_sd = self.photos.iter().zip(&used.images_on);
        let photo_sd = photo_sd.flat_map(|(photo, &images)| if images == 0 { [0.0; 9] } else { photo.sd });
        let placed = points().flat_map(|point| point.sd).any(f64::is_finite)
            || self.photos.iter().any(|photo| photo.sd[..6].iter().any(|sd| sd.is_finite()));
        Ok(Problem {
            observation_sd: images.iter().flat_map(|image| image.sd).collect(),
            system: System::new(layout, options.ordering),
            prior: unknowns(&self.initial()),
            initial: unknowns(start),
            sd: points().flat_map(|point| point.sd).chain(photo_sd).collect(),
            model: Bundle {
                points: used.points.len(),
                images,
                images_of: used.start.clone(),
                images_on: used.images_on.clone(),
                placed,
            },
        })
    }
}

/// Values of all points and photos.
struct Values {
    points: Vec<[f64; 3]>,
    photos: Vec<BundlerParameters>,
}

/// What takes part.
struct Used {
    /// The points.
    points: Vec<usize>,
    /// The images of the i-th of them are `images[start[i]..start[i + 1]]`.
    start: Vec<usize>,
    /// The images, point by point.
    images: Vec<usize>,
    /// How many images each photo has.
    images_on: Vec<usize>,
}
