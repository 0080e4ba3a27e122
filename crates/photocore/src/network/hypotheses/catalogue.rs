//! The catalogue of errors that sets of observations have in common, and the partials of all observations by their parameters.

use std::collections::HashMap;

use nalgebra::{DMatrix, Vector3};

use super::super::linearization_point::LinearizationPoint;
use super::super::model::{Bundle, Owner};
use super::super::trial::Trial;
use super::facts::Facts;
use crate::adjustment::{AdditionalParameters, Equation, EquationOf, Leverages, Shared};
use crate::normals::Layout;

/// An error that a set of observations has in common.
pub(super) struct Cause {
    pub code: &'static str,
    /// The set of the facts, or the camera.
    pub set: Option<usize>,
    pub parameters: Vec<&'static str>,
    /// Standard deviations of the parameters before the data are used; empty if unknown.
    pub plausible: Vec<f64>,
    /// The columns of the catalogue that each parameter changes, with its factors.
    pub columns: Vec<Vec<(usize, f64)>>,
}

impl Cause {
    /// Columns of the catalogue by some parameters.
    pub fn directions(&self, count: usize, parameters: &[usize]) -> DMatrix<f64> {
        let mut directions = DMatrix::zeros(count, parameters.len());
        for (k, &parameter) in parameters.iter().enumerate() {
            self.columns[parameter].iter().for_each(|&(column, factor)| directions[(column, k)] = factor);
        }
        directions
    }
}

/// Observations that see a displacement of unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Seen {
    /// Coordinates of control points.
    Control,
    /// Positions of photos.
    Positions,
    /// Attitudes of photos.
    Attitudes,
    /// Images of points that are not local.
    Images,
}

/// Deformations of the images of a photo, relative to its principal point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Deformations {
    pub principal_point: [f64; 2],
    pub distance: f64,
    /// Columns of the scale of the first axis, and of the shear.
    pub affinity: [usize; 2],
    pub radial: Option<usize>,
}

/// All common errors that are possible for a network.
pub(super) struct Catalogue<'a> {
    pub causes: Vec<Cause>,
    pub bundle: &'a Bundle,
    layout: &'a Layout,
    pub linearization: LinearizationPoint,
    pub facts: &'a Facts,
    /// Standard deviations of the unknowns.
    pub sd: &'a [f64],
    count: usize,
    /// Displacements d(unknown) / d(parameter), by the observations that see them: columns and values.
    displaced: HashMap<(Seen, usize), Vec<(usize, f64)>>,
    /// The same of fixed unknowns, whose error all observations see.
    fixed: HashMap<usize, Vec<(usize, f64)>>,
    /// Errors of observations that are no images of local points, in unit weight: columns and values.
    single: HashMap<EquationOf, Vec<(usize, f64)>>,
    /// Parameters of the camera of each photo, and their columns.
    pub(super) cameras: Vec<Vec<(usize, usize)>>,
    /// Columns of the readout times of the camera of each photo, with the times of image coordinates.
    pub(super) shutters: Vec<Vec<(usize, [f64; 3])>>,
    /// Velocities of these photos in coordinates of the object space.
    pub(super) velocities: Vec<Vector3<f64>>,
    /// Columns of the shift of the images of each photo that is tested.
    pub(super) shifts: Vec<Option<[usize; 2]>>,
    /// Deformations of the images of each photo.
    pub(super) deformations: Vec<Option<Deformations>>,
}

impl<'a> Catalogue<'a> {
    /// Without any error yet, at the adjusted values.
    pub fn new(trial: &'a Trial, found: &Leverages, facts: &'a Facts) -> Self {
        let problem = &trial.assembled.problem;
        let bundle = &problem.model;
        let photos = bundle.cameras.len();
        Self {
            causes: vec![],
            bundle,
            layout: problem.layout(),
            linearization: bundle.evaluated(&found.values),
            facts,
            sd: &problem.sd,
            count: 0,
            displaced: HashMap::new(),
            fixed: HashMap::new(),
            single: HashMap::new(),
            cameras: vec![vec![]; photos],
            shutters: vec![vec![]; photos],
            velocities: vec![Vector3::zeros(); photos],
            shifts: vec![None; photos],
            deformations: vec![None; photos],
        }
    }

    /// Adds a hypothesis with its parameters; their columns.
    pub fn add(
        &mut self,
        (code, set): (&'static str, Option<usize>),
        parameters: &[&'static str],
        plausible: &[f64],
    ) -> Vec<usize> {
        let columns: Vec<usize> = (self.count..self.count + parameters.len()).collect();
        self.count += parameters.len();
        let (parameters, plausible) = (parameters.to_vec(), plausible.to_vec());
        let own = columns.iter().map(|&column| vec![(column, 1.0)]).collect();
        self.causes.push(Cause { code, set, parameters, plausible, columns: own });
        columns
    }

    /// Adds a hypothesis whose parameters each change several of these columns.
    pub fn add_combination(
        &mut self,
        (code, set): (&'static str, Option<usize>),
        parameters: &[&'static str],
        plausible: &[f64],
        columns: Vec<Vec<(usize, f64)>>,
    ) {
        let (parameters, plausible) = (parameters.to_vec(), plausible.to_vec());
        self.causes.push(Cause { code, set, parameters, plausible, columns });
    }

    /// Adds an error of some observations as a parameter; its column.
    pub fn add_single(&mut self, error: &[(EquationOf, f64)]) -> usize {
        self.add_to(self.count, error);
        self.count += 1;
        self.count - 1
    }

    /// Adds partials of observations, in unit weight, by a parameter.
    pub fn add_to(&mut self, column: usize, partials: &[(EquationOf, f64)]) {
        for &(of, value) in partials {
            self.single.entry(of).or_default().push((column, value));
        }
    }

    /// Displaces an unknown, as some observations see it, with a parameter.
    pub fn displace(&mut self, seen: Seen, unknown: usize, column: usize, value: f64) {
        if self.sd[unknown] == 0.0 {
            // Observed values are the computed ones plus the error; with fixed ones it is the computed that have it.
            self.fixed.entry(unknown).or_default().push((column, -value));
        } else {
            self.displace_seen(seen, unknown, column, value);
        }
    }

    /// The same of unknowns that may be fixed, if only these observations have the error.
    pub fn displace_seen(&mut self, seen: Seen, unknown: usize, column: usize, value: f64) {
        self.displaced.entry((seen, unknown)).or_default().push((column, value));
    }

    /// Whether attitudes of photos were observed.
    pub fn has_attitudes(&self) -> bool {
        let weighted = |photo: usize| {
            let first = self.bundle.of_block(photo).start + 3;
            self.sd[first..first + 3].iter().any(|sd| sd.is_finite() && *sd > 0.0)
        };
        self.bundle.observations.iter().any(|active| active.observation.kind() == "attitude")
            || (0..self.bundle.cameras.len()).any(weighted)
    }

    /// What sees an unknown as an observation of itself.
    fn seen_by_itself(&self, unknown: usize) -> Option<Seen> {
        match self.bundle.owner(unknown) {
            None => Some(Seen::Control),
            Some((Owner::Photo(_), 0..3)) => Some(Seen::Positions),
            Some((Owner::Photo(_), 3..6)) => Some(Seen::Attitudes),
            Some(_) => None,
        }
    }

    /// The image of an equation; None if it is of something else.
    pub(super) fn image_of(&self, of: EquationOf) -> Option<(usize, usize, usize)> {
        match of {
            EquationOf::Group { group, local, row } => Some((group, local, row)),
            EquationOf::Term { term, row } if term < self.bundle.image_terms() => {
                let image = self.bundle.point_images.start[self.bundle.locals] + term;
                Some((image, self.bundle.point_of(image), row))
            }
            _ => None,
        }
    }
}

impl AdditionalParameters for Catalogue<'_> {
    fn count(&self) -> usize {
        self.count
    }

    fn locals(&self) -> Option<Vec<usize>> {
        let cameras = self.cameras.iter().any(|own| !own.is_empty());
        let deformed = self.deformations.iter().any(Option::is_some);
        let shuttered = self.shutters.iter().any(|own| !own.is_empty());
        let shifted = self.shifts.iter().any(Option::is_some);
        if cameras || deformed || shuttered || shifted || !self.fixed.is_empty() {
            return None;
        }
        let single = self.single.keys().filter_map(|of| match *of {
            EquationOf::Unknown(unknown) => Some(unknown / 3),
            EquationOf::Term { term, .. } => self.layout.terms()[term].local.map(|local| local as usize),
            EquationOf::Group { .. } => None,
        });
        let displaced = self.displaced.keys().map(|own| own.1 / 3);
        let mut locals: Vec<usize> =
            displaced.chain(single).filter(|&local| local < self.bundle.locals).collect();
        locals.sort_unstable();
        locals.dedup();
        Some(locals)
    }

    fn partials(&self, equation: &Equation<'_>, shared: &mut Shared, partials: &mut Vec<(usize, f64)>) {
        let image = self.image_of(equation.of);
        let seen = match equation.of {
            EquationOf::Unknown(unknown) => self.seen_by_itself(unknown),
            EquationOf::Term { .. } if image.is_some() => Some(Seen::Images),
            EquationOf::Term { term, .. } => {
                match self.bundle.observations[term - self.bundle.image_terms()].observation.kind() {
                    "control" => Some(Seen::Control),
                    "position" => Some(Seen::Positions),
                    "attitude" => Some(Seen::Attitudes),
                    _ => None,
                }
            }
            _ => None,
        };
        let mut add = |own: Option<&Vec<(usize, f64)>>, coefficient: f64| {
            let own = own.into_iter().flatten();
            own.for_each(|&(column, value)| put(partials, column, coefficient * value));
        };
        if seen.is_some() || !self.fixed.is_empty() {
            for (unknown, coefficient) in equation.coefficients() {
                add(seen.and_then(|seen| self.displaced.get(&(seen, unknown))), coefficient);
                add(self.fixed.get(&unknown), coefficient);
            }
        }
        if !matches!(equation.of, EquationOf::Group { .. }) {
            add(self.single.get(&equation.of), 1.0);
        }
        if let Some(image) = image {
            self.camera_partials(image, equation, shared, partials);
            self.shutter_partials(image, equation, partials);
            self.deformation_partials(image, equation, partials);
            self.shift_partials(image, equation, partials);
        }
    }
}

/// Adds a partial to those of its column.
pub(super) fn put(partials: &mut Vec<(usize, f64)>, column: usize, value: f64) {
    match partials.iter_mut().find(|own| own.0 == column) {
        Some(own) => own.1 += value,
        None => partials.push((column, value)),
    }
}
