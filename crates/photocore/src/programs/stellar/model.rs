//! The observation equations of stars, with exact partials.

use super::{Attitude, COMMON, Calibration, Camera, INTERIOR, PlateImage, StellarError, TAU};
use crate::adjustment::Model;
use crate::normals::GroupRows;

/// What a group of two equations observes.
#[derive(Debug, Clone, Copy)]
pub enum Group {
    /// The plate coordinates of an image.
    Image(usize),
    /// The catalogue place of a star.
    Star(usize),
    /// The direction of the axis.
    Axis,
    /// Two rows, from the given one on, of the root of the parameters' weight matrix.
    Parameters(usize),
}

/// Images of stars, star by star, and what is known beforehand, each as rows of unit weight.
#[derive(Debug)]
pub struct StarImages<'a> {
    calibration: &'a Calibration,
    /// Star by star; those of no star at the end.
    pub groups: Vec<Group>,
    /// The groups of star i are `groups[start[i]..start[i + 1]]`.
    pub start: Vec<usize>,
    /// Root R of the weight P = R^T R of each group.
    pub roots: Vec<[[f64; 2]; 2]>,
}

/// Camera, attitudes and stars at given values of the unknowns.
#[derive(Debug)]
pub struct Sight {
    pub camera: Camera,
    pub attitudes: Vec<Attitude>,
    pub tau: [f64; TAU],
    places: Vec<[f64; 2]>,
    parameters: Vec<f64>,
}

/// The two equations of a group before weighting; the first index is the row.
#[derive(Debug, Clone, Copy)]
pub struct Rows {
    /// Observed minus computed.
    pub constant: [f64; 2],
    /// Partials with respect to right ascension and declination.
    pub star: [[f64; 2]; 2],
    /// Partials with respect to the attitude.
    pub pointing: [[f64; 3]; 2],
    /// Partials with respect to the common parameters.
    pub common: [[f64; COMMON]; 2],
}

impl Sight {
    /// Takes the vector of unknowns apart.
    pub fn new(calibration: &Calibration, unknowns: &[f64]) -> Self {
        let (places, parameters) = unknowns.split_at(2 * calibration.stars.len() + 2);
        let (pointings, common) = parameters.split_at(3 * calibration.pointings.len());
        let interior = std::array::from_fn::<_, INTERIOR, _>(|k| common[k]);
        Self {
            camera: Camera::new(calibration.kind, interior),
            attitudes: pointings.as_chunks().0.iter().map(|&angles| Attitude::new(angles)).collect(),
            tau: std::array::from_fn(|k| common[INTERIOR + k]),
            places: places.as_chunks().0.to_vec(),
            parameters: parameters.to_vec(),
        }
    }

    /// An image at a place: measured minus computed, with exact partials.
    pub fn image(&self, calibration: &Calibration, image: usize) -> Rows {
        let image = &calibration.images[image];
        let place = self.places[image.star];
        let place = [place[0] + image.shift[0], place[1] + image.shift[1]];
        let seen = calibration.station.standard(place, image.sidereal_time, &self.tau);
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

    /// The direction of the axis, whose plate coordinates are free from distortion: the columns of attitude, epsilon, principal
    /// point and principal distances only.
    pub fn axis(&self, calibration: &Calibration) -> Option<Rows> {
        let axis = calibration.axis?;
        let interior = std::array::from_fn(|k| if k < 5 { self.camera.interior()[k] } else { 0.0 });
        let PlateImage { xy, pointing, interior, .. } =
            Camera::new(calibration.kind, interior).linearize(&self.attitudes[axis.pointing], axis.standard);
        let common = |i: usize| std::array::from_fn(|k| if k < 5 { interior[i][k] } else { 0.0 });
        Some(Rows {
            constant: [axis.xy[0] - xy[0], axis.xy[1] - xy[1]],
            star: [[0.0; 2]; 2],
            pointing,
            common: std::array::from_fn(common),
        })
    }

    fn star(&self, calibration: &Calibration, star: usize) -> Rows {
        let catalogue = calibration.stars[star].catalogue;
        Rows {
            constant: std::array::from_fn(|k| catalogue[k] - self.places[star][k]),
            star: [[1.0, 0.0], [0.0, 1.0]],
            pointing: [[0.0; 3]; 2],
            common: [[0.0; COMMON]; 2],
        }
    }
}

impl<'a> StarImages<'a> {
    /// Sorts the images by stars and finds the roots of all weights.
    pub fn new(calibration: &'a Calibration) -> Result<Self, StellarError> {
        let mut of_star = vec![Vec::new(); calibration.stars.len()];
        for (index, image) in calibration.images.iter().enumerate() {
            of_star[image.star].push(index);
        }
        let mut model = Self { calibration, groups: vec![], start: vec![0], roots: vec![] };
        for (star, images) in of_star.into_iter().enumerate() {
            for image in images {
                let name = || format!("image {image}");
                model.push(Group::Image(image), calibration.images[image].weight, name)?;
            }
            if let (Some(weight), false) = (calibration.stars[star].weight, calibration.stars[star].fixed) {
                model.push(Group::Star(star), weight, || format!("star {star}"))?;
            }
            model.start.push(model.groups.len());
        }
        if let Some(axis) = calibration.axis {
            model.push(Group::Axis, axis.weight, || "the axis".into())?;
        }
        for first in (0..calibration.weights.parameters.len()).step_by(2) {
            model.push(Group::Parameters(first), [[1.0, 0.0], [0.0, 1.0]], String::new)?;
        }
        model.start.push(model.groups.len());
        Ok(model)
    }

    fn push(
        &mut self,
        group: Group,
        weight: [[f64; 2]; 2],
        name: impl Fn() -> String,
    ) -> Result<(), StellarError> {
        let [[xx, xy], [_, yy]] = weight;
        let rest = yy - xy * xy / xx;
        let positive = xx > 0.0 && rest > 0.0 && xx.is_finite() && rest.is_finite();
        if !positive {
            return Err(StellarError::Weight(name()));
        }
        self.groups.push(group);
        self.roots.push([[xx.sqrt(), xy / xx.sqrt()], [0.0, rest.sqrt()]]);
        Ok(())
    }

    /// Rows of the root of the parameters' weights; the place of each parameter within the row is `offset` less.
    fn parameters(&self, sight: &Sight, first: usize, offset: usize, constant: &mut [f64], rows: &mut [f64]) {
        let weights = &self.calibration.weights;
        let count = weights.parameters.len();
        let width = rows.len() / 2;
        for row in 0..2.min(count - first) {
            let root = &weights.root[(first + row) * count..][..count];
            for ((&factor, &parameter), value) in root.iter().zip(&weights.parameters).zip(&weights.values) {
                constant[row] += factor * (value - sight.parameters[parameter]);
                rows[row * width + parameter - offset] = factor;
            }
        }
    }
}

impl Model for StarImages<'_> {
    type Prepared = Sight;

    fn prepare(&self, unknowns: &[f64]) -> Sight {
        Sight::new(self.calibration, unknowns)
    }

    /// Computes directions that are not known afresh from their first images.
    fn relocate(&self, unknowns: &mut [f64]) -> bool {
        let sight = Sight::new(self.calibration, unknowns);
        for (star, groups) in self.start.windows(2).take(self.calibration.stars.len()).enumerate() {
            let known = self.calibration.stars[star];
            if let (None, false, Some(Group::Image(image))) =
                (known.weight, known.fixed, self.groups[groups[0]..groups[1]].first())
            {
                let place = self.calibration.direction(&sight, *image);
                unknowns[2 * star..][..2].copy_from_slice(&place);
            }
        }
        true
    }

    fn observe(&self, sight: &Sight, _local: usize, group: usize, rows: &mut GroupRows<'_>) {
        rows.constant.fill(0.0);
        rows.local.fill(0.0);
        rows.kept.fill(0.0);
        rows.border.fill(0.0);
        let joint = rows.border.is_empty();
        let pointings = 3 * self.calibration.pointings.len();
        let (found, pointing) = match self.groups[group] {
            Group::Image(image) => {
                (Some(sight.image(self.calibration, image)), self.calibration.images[image].pointing)
            }
            Group::Star(star) => (Some(sight.star(self.calibration, star)), 0),
            Group::Axis => {
                (sight.axis(self.calibration), self.calibration.axis.map_or(0, |axis| axis.pointing))
            }
            Group::Parameters(first) => {
                let (offset, part) =
                    if joint { (0, &mut *rows.kept) } else { (pointings, &mut *rows.border) };
                self.parameters(sight, first, offset, rows.constant, part);
                return;
            }
        };
        let Some(found) = found else { return };
        let root = self.roots[group];
        for row in 0..2 {
            let mix = |a: f64, b: f64| root[row][0] * a + root[row][1] * b;
            rows.constant[row] = mix(found.constant[0], found.constant[1]);
            for k in 0..2 {
                rows.local[2 * row + k] = mix(found.star[0][k], found.star[1][k]);
            }
            let (pointing_part, common_part) = if joint {
                let (before, common) =
                    rows.kept[row * (pointings + COMMON)..][..pointings + COMMON].split_at_mut(pointings);
                (&mut before[3 * pointing..][..3], common)
            } else {
                (&mut rows.kept[3 * row..][..3], &mut rows.border[COMMON * row..][..COMMON])
            };
            for (k, value) in pointing_part.iter_mut().enumerate() {
                *value = mix(found.pointing[0][k], found.pointing[1][k]);
            }
            for (k, value) in common_part.iter_mut().enumerate() {
                *value = mix(found.common[0][k], found.common[1][k]);
            }
        }
    }
}

/// Change of the undistorted image below which a direction is final, relative to the principal distance.
const DIRECTION: f64 = 1e-14;
const PASSES: usize = 100;

impl Calibration {
    /// The direction of an image at given values of the unknowns.
    pub(super) fn direction(&self, sight: &Sight, image: usize) -> [f64; 2] {
        let Calibration { images, station, .. } = self;
        let image = &images[image];
        let (undistorted, ..) = sight.camera.undistorted(image.xy, DIRECTION, PASSES);
        let coordinates = sight.camera.standard(&sight.attitudes[image.pointing].matrix, undistorted);
        let place = station.place(coordinates, image.sidereal_time, &sight.tau);
        [place[0] - image.shift[0], place[1] - image.shift[1]]
    }

    /// The directions of all images at the initial values.
    pub fn directions(&self) -> Result<Vec<[f64; 2]>, StellarError> {
        self.check()?;
        let sight = self.initial();
        Ok((0..self.images.len()).map(|image| self.direction(&sight, image)).collect())
    }

    /// The equations of all images at the initial values, not weighted, with exact partials.
    pub fn equations(&self) -> Result<Vec<Rows>, StellarError> {
        self.check()?;
        let sight = self.initial();
        Ok((0..self.images.len()).map(|image| sight.image(self, image)).collect())
    }

    /// The equations of the axis at the initial values, where it is known.
    pub fn axis_equations(&self) -> Result<Option<Rows>, StellarError> {
        self.check()?;
        Ok(self.initial().axis(self))
    }

    /// Everything at the initial values.
    pub(super) fn initial(&self) -> Sight {
        let places = self.stars.iter().flat_map(|star| star.place).chain([0.0; 2]);
        let parameters = self.pointings.iter().flatten().chain(&self.common).copied();
        Sight::new(self, &places.chain(parameters).collect::<Vec<f64>>())
    }
}
