//! Observation equations of stars, with exact partials.

use super::{Attitude, COMMON, Calibration, Camera, INTERIOR, Image, PlateImage, StellarError, TAU, Weights};
use photocore::adjustment::{Evaluated, Model};
use photocore::internal;

use crate::sky::Standard;
use photocore::normals::{GroupRows, Term};

/// Upper triangular root R of a weight matrix P = R^T R.
pub type Root = [[f64; 2]; 2];

/// Observation of a constraint.
#[derive(Debug, Clone, Copy)]
pub enum Tied {
    /// Direction of the axis, with the root of its weights.
    Axis(Root),
    /// Row of the root of the parameters' weight matrix.
    Parameters(usize),
}

/// Tolerances of the inner iterations of the report's program.
#[derive(Debug, Clone, Copy)]
pub struct Tolerances {
    /// Tolerance of refraction, in radians.
    pub refraction: f64,
    /// Tolerance of distortion, in the unit of the plate coordinates.
    pub distortion: f64,
    /// Maximum number of iterations of the distortion.
    pub passes: usize,
}

/// Linearization of the images.
#[derive(Debug, Clone, Copy)]
pub enum Partials {
    /// Exact discrepancies and partials.
    Exact,
    /// Discrepancies and partials of the report's program.
    Published(Tolerances),
}

/// Model of star images, local block by local block, and of a-priori observations, each as rows of unit weight.
#[derive(Debug)]
pub struct StarImages<'a> {
    calibration: &'a Calibration,
    partials: Partials,
    /// Star of each local block.
    pub stars: Vec<usize>,
    /// Images of all local blocks, one observation each.
    pub images: Vec<usize>,
    /// Offsets: the images of local block i are `images[start[i]..start[i + 1]]`.
    pub start: Vec<usize>,
    /// Root of the weights of each image.
    pub roots: Vec<Root>,
    /// Root of the weights of each star's catalogue place; None if it is unknown or fixed.
    pub catalogue: Vec<Option<Root>>,
    /// Constraints without stars.
    pub terms: Vec<(Tied, Term)>,
}

/// Camera, attitudes and stars at given values of the unknowns.
#[derive(Debug)]
pub struct Sight {
    pub camera: Camera,
    pub attitudes: Vec<Attitude>,
    pub tau: [f64; TAU],
    pub places: Vec<[f64; 2]>,
    pub parameters: Vec<f64>,
    /// Standard coordinates of the stars of all images, cached for repeated use.
    seen: Vec<Standard>,
}

/// Two equations of an observation before weighting; the first index is the row.
#[derive(Debug, Clone, Copy)]
pub struct Rows {
    /// Observed minus computed.
    pub constant: [f64; 2],
    /// Partials with respect to right ascension and declination.
    pub star: [[f64; 2]; 2],
    /// Partials with respect to the attitude.
    pub pointing: [[f64; 3]; 2],
    /// Partials with respect to the shared parameters.
    pub common: [[f64; COMMON]; 2],
}

impl Sight {
    /// Evaluates the model at given directions of the stars and values of the parameters.
    pub fn new(calibration: &Calibration, places: Vec<[f64; 2]>, parameters: &[f64]) -> Self {
        let (pointings, common) = parameters.split_at(3 * calibration.pointings.len());
        let interior = std::array::from_fn::<_, INTERIOR, _>(|k| common[k]);
        Self {
            camera: Camera::new(&calibration.kind, interior),
            attitudes: pointings.as_chunks().0.iter().map(|&angles| Attitude::new(angles)).collect(),
            tau: std::array::from_fn(|k| common[INTERIOR + k]),
            places,
            parameters: parameters.to_vec(),
            seen: vec![],
        }
    }

    /// Returns the standard coordinates of the star of an image.
    fn standard(&self, calibration: &Calibration, image: &Image) -> Standard {
        let place = self.places[image.star];
        let place = [place[0] + image.shift[0], place[1] + image.shift[1]];
        calibration.station.standard(place, image.sidereal_time, &self.tau)
    }

    /// Returns measured minus computed of an image, with exact partials.
    pub fn image(&self, calibration: &Calibration, image: usize) -> Rows {
        let seen = self.seen.get(image).copied();
        let image = &calibration.images[image];
        let seen = seen.unwrap_or_else(|| self.standard(calibration, image));
        let plate = self.camera.linearize(&self.attitudes[image.pointing], seen.coordinates);
        let chain = |row: &[f64; 2], k: usize, by: &dyn Fn(usize, usize) -> f64| {
            row[0] * by(0, k) + row[1] * by(1, k)
        };
        Rows {
            constant: [image.xy[0] - plate.xy[0], image.xy[1] - plate.xy[1]],
            star: plate.standard.map(|row| std::array::from_fn(|k| chain(&row, k, &|i, k| seen.place[i][k]))),
            pointing: plate.pointing,
            common: std::array::from_fn(|i| {
                let row = &plate.standard[i];
                let tau = |k: usize| chain(row, k, &|i, k| seen.coefficients[i][k]);
                std::array::from_fn(|k| if k < INTERIOR { plate.interior[i][k] } else { tau(k - INTERIOR) })
            }),
        }
    }

    /// Returns the equations of the axis direction. Its plate coordinates are undistorted: only attitude, epsilon, principal point and
    /// principal distances have columns.
    pub fn axis(&self, calibration: &Calibration) -> Option<Rows> {
        let axis = calibration.axis?;
        let interior = std::array::from_fn(|k| if k < 5 { self.camera.interior()[k] } else { 0.0 });
        let PlateImage { xy, pointing, interior, .. } =
            Camera::new(&calibration.kind, interior).linearize(&self.attitudes[axis.pointing], axis.standard);
        let common = |i: usize| std::array::from_fn(|k| if k < 5 { interior[i][k] } else { 0.0 });
        Some(Rows {
            constant: [axis.xy[0] - xy[0], axis.xy[1] - xy[1]],
            star: [[0.0; 2]; 2],
            pointing,
            common: std::array::from_fn(common),
        })
    }
}

impl<'a> StarImages<'a> {
    /// Sorts the images by stars and computes the roots of all weights.
    pub fn new(calibration: &'a Calibration, partials: Partials) -> Result<Self, StellarError> {
        let mut of_star = vec![Vec::new(); calibration.stars.len()];
        for (index, image) in calibration.images.iter().enumerate() {
            of_star[image.star].push(index);
        }
        let mut model = Self {
            calibration,
            partials,
            stars: vec![],
            images: vec![],
            start: vec![0],
            roots: vec![],
            catalogue: vec![],
            terms: calibration.terms()?,
        };
        for (index, images) in of_star.into_iter().enumerate() {
            let star = &calibration.stars[index];
            // The images of a fixed star are uncoupled.
            let most = if star.fixed { 1 } else { images.len().max(1) };
            let free = (images.is_empty() && !star.fixed).then_some(&images[..]);
            for images in images.chunks(most).chain(free) {
                model.stars.push(index);
                model.images.extend_from_slice(images);
                model.start.push(model.images.len());
            }
            let weight = star.weight.filter(|_| !star.fixed);
            model.catalogue.push(weight.map(|weight| root(weight, || format!("star {index}"))).transpose()?);
        }
        for &image in &model.images {
            model.roots.push(root(calibration.images[image].weight, || format!("image {image}"))?);
        }
        Ok(model)
    }

    /// Returns the coordinates of a star that decorrelate its catalogue values.
    pub fn decorrelated(&self, star: usize, [ra, dec]: [f64; 2]) -> [f64; 2] {
        [ra + self.shear(star) * dec, dec]
    }

    /// Returns the ratio of the declination and right-ascension elements in the first row of the weight root R.
    pub fn shear(&self, star: usize) -> f64 {
        self.catalogue[star].map_or(0.0, |root| root[0][1] / root[0][0])
    }

    /// Returns catalogue minus current direction of a star.
    pub fn off_catalogue(&self, star: usize, place: [f64; 2]) -> [f64; 2] {
        let catalogue = self.calibration.stars[star].catalogue;
        [catalogue[0] - place[0], catalogue[1] - place[1]]
    }

    /// Evaluates camera, attitudes and stars at given values of the unknowns.
    pub fn sight(&self, unknowns: &[f64]) -> Sight {
        let (locals, parameters) = unknowns.split_at(2 * self.stars.len());
        let mut places: Vec<[f64; 2]> = self.calibration.stars.iter().map(|star| star.place).collect();
        for (&star, &[first, dec]) in self.stars.iter().zip(locals.as_chunks().0) {
            places[star] = [first - self.shear(star) * dec, dec];
        }
        Sight::new(self.calibration, places, parameters)
    }

    /// Returns discrepancies and partials of an image.
    pub fn image(&self, sight: &Sight, image: usize) -> Rows {
        match self.partials {
            Partials::Exact => sight.image(self.calibration, image),
            Partials::Published(tolerances) => {
                self.calibration.published_image(sight, image, &tolerances).rows
            }
        }
    }
}

/// Returns the root of a weight matrix.
fn root(weight: [[f64; 2]; 2], name: impl Fn() -> String) -> Result<Root, StellarError> {
    let [[xx, xy], [_, yy]] = weight;
    let rest = yy - xy * xy / xx;
    if xx > 0.0 && rest > 0.0 && xx.is_finite() && rest.is_finite() {
        Ok([[xx.sqrt(), xy / xx.sqrt()], [0.0, rest.sqrt()]])
    } else {
        Err(StellarError::Weight(name()))
    }
}

impl Calibration {
    /// Returns the constraints of the axis and of the parameter weights, with their blocks.
    fn terms(&self) -> Result<Vec<(Tied, Term)>, StellarError> {
        let (mut terms, common) = (Vec::new(), self.pointings.len() as u32);
        if let Some(axis) = self.axis {
            let root = root(axis.weight, || "the axis".into())?;
            let term = Term { rows: 2, local: None, retained: vec![axis.pointing as u32, common] };
            terms.push((Tied::Axis(root), term));
        }
        for row in 0..self.weights.parameters.len() {
            // The shared block is always included: its cofactors with every attitude are needed.
            let mut retained: Vec<u32> = self
                .weighted(row)
                .map(|(parameter, ..)| common.min(parameter as u32 / 3))
                .chain([common])
                .collect();
            retained.sort_unstable();
            retained.dedup();
            terms.push((Tied::Parameters(row), Term { rows: 1, local: None, retained }));
        }
        Ok(terms)
    }

    /// Returns parameter, given value and root element for each nonzero element in a row of the weight root.
    pub(super) fn weighted(&self, row: usize) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let Weights { parameters, values, root } = &self.weights;
        let count = parameters.len();
        let elements = root[row * count..][..count].iter();
        let all = parameters.iter().zip(values).zip(elements);
        all.map(|((&parameter, &value), &element)| (parameter, value, element))
            .filter(|&(.., element)| element != 0.0)
    }

    /// Returns a row of the root times given minus current values of the weighted parameters.
    pub(super) fn off_given(&self, sight: &Sight, row: usize) -> f64 {
        self.weighted(row).map(|(parameter, given, r)| r * (given - sight.parameters[parameter])).sum()
    }
}

/// Minimum number of images per thread.
const AT_LEAST: usize = 256;

/// Star images at given values of the unknowns.
struct StarsAt<'a> {
    model: &'a StarImages<'a>,
    sight: Sight,
}

impl Model for StarImages<'_> {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        let mut sight = self.sight(unknowns);
        if let Partials::Exact = self.partials {
            // The standard coordinates serve both the formation and the solution of the normal equations.
            let images = &self.calibration.images;
            let standard = |image: usize| sight.standard(self.calibration, &images[image]);
            sight.seen = internal::map(images.len(), AT_LEAST, standard);
        }
        Box::new(StarsAt { model: self, sight })
    }

    /// Recomputes unknown directions from their first images.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let sight = self.sight(unknowns);
        for (local, &star) in self.stars.iter().enumerate() {
            let known = &self.calibration.stars[star];
            let images = &self.images[self.start[local]..self.start[local + 1]];
            if let (None, false, Some(&image)) = (known.weight, known.fixed, images.first()) {
                unknowns[2 * local..][..2].copy_from_slice(&self.calibration.direction(&sight, image));
            }
        }
        true
    }
}

impl Evaluated for StarsAt<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let Self { model, sight } = self;
        let found = model.image(sight, model.images[group]);
        let (root, shear) = (model.roots[group], model.shear(model.stars[local]));
        for (row, root) in root.iter().enumerate() {
            let mix = |a: f64, b: f64| root[0] * a + root[1] * b;
            let [ra, dec] = [0, 1].map(|k| mix(found.star[0][k], found.star[1][k]));
            rows.constant[row] = mix(found.constant[0], found.constant[1]);
            rows.local[2 * row..][..2].copy_from_slice(&[ra, dec - shear * ra]);
            for (k, value) in rows.retained[3 * row..][..3].iter_mut().enumerate() {
                *value = mix(found.pointing[0][k], found.pointing[1][k]);
            }
            for (k, value) in rows.shared[COMMON * row..][..COMMON].iter_mut().enumerate() {
                *value = mix(found.common[0][k], found.common[1][k]);
            }
        }
    }

    fn observe_term(&self, term: usize, rows: &mut GroupRows<'_>) {
        let Self { model, sight } = self;
        let calibration = model.calibration;
        let (tied, Term { retained, .. }) = &model.terms[term];
        rows.shared.fill(0.0);
        match tied {
            Tied::Axis(root) => {
                let Some(found) = sight.axis(calibration) else { return rows.constant.fill(0.0) };
                let columns = rows.shared.as_chunks_mut::<{ 3 + COMMON }>().0;
                for ((root, constant), columns) in root.iter().zip(&mut *rows.constant).zip(columns) {
                    let mix = |a: f64, b: f64| root[0] * a + root[1] * b;
                    *constant = mix(found.constant[0], found.constant[1]);
                    let [x, y] = [0, 1].map(|i| found.pointing[i].iter().chain(&found.common[i]));
                    columns.iter_mut().zip(x.zip(y)).for_each(|(value, (x, y))| *value = mix(*x, *y));
                }
            }
            Tied::Parameters(row) => {
                rows.constant[0] = calibration.off_given(sight, *row);
                for (parameter, _, element) in calibration.weighted(*row) {
                    // Every block except the last has three unknowns.
                    let attitude = (parameter / 3).min(calibration.pointings.len());
                    let before = retained.iter().take_while(|&&block| (block as usize) < attitude).count();
                    rows.shared[3 * before + parameter - 3 * attitude] = element;
                }
            }
        }
    }
}

/// Convergence limit of the undistorted image, relative to the principal distance.
const DIRECTION: f64 = 1e-14;
const PASSES: usize = 100;

impl Calibration {
    /// Returns the direction of an image at given values of the unknowns.
    pub(super) fn direction(&self, sight: &Sight, image: usize) -> [f64; 2] {
        let Calibration { images, station, .. } = self;
        let image = &images[image];
        let (undistorted, ..) = sight.camera.undistorted(image.xy, DIRECTION, PASSES);
        let coordinates = sight.camera.standard(&sight.attitudes[image.pointing].matrix, undistorted);
        let place = station.place(coordinates, image.sidereal_time, &sight.tau);
        [place[0] - image.shift[0], place[1] - image.shift[1]]
    }

    /// Returns the directions of all images at the initial values.
    pub fn directions(&self) -> Result<Vec<[f64; 2]>, StellarError> {
        self.check()?;
        let sight = self.initial();
        Ok((0..self.images.len()).map(|image| self.direction(&sight, image)).collect())
    }

    /// Returns the unweighted equations of all images at the initial values, with exact partials.
    pub fn equations(&self) -> Result<Vec<Rows>, StellarError> {
        self.check()?;
        let sight = self.initial();
        Ok((0..self.images.len()).map(|image| sight.image(self, image)).collect())
    }

    /// Returns the equations of the axis at the initial values; None without a known axis.
    pub fn axis_equations(&self) -> Result<Option<Rows>, StellarError> {
        self.check()?;
        Ok(self.initial().axis(self))
    }

    /// Evaluates the model at the initial values.
    pub(super) fn initial(&self) -> Sight {
        let parameters: Vec<f64> = self.pointings.iter().flatten().chain(&self.common).copied().collect();
        Sight::new(self, self.stars.iter().map(|star| star.place).collect(), &parameters)
    }
}
