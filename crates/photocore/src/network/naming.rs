//! Description of undetermined parameter combinations in terms of photogrammetry: camera parameters and parts of poses.

use super::error::{Combination, NetworkError, PosePart};
use super::input::Network;
use super::model::Owner;
use super::problem::Assembled;
use crate::adjustment::{AdjustError, Linearized};
use crate::geometry::{PoseNumbers, Vector3};
use crate::{Context, Threads};

/// Minimum share of the sum of n_ii x_i^2 for parameters that are named.
const NOTABLE: f64 = 0.01;

impl NetworkError {
    /// Converts an error of the adjustment to terms of the network.
    #[doc(hidden)]
    pub fn new(error: AdjustError, assembled: &Assembled) -> Self {
        match error {
            AdjustError::UndeterminedLocals(locals) => {
                let mut points: Vec<usize> =
                    locals.into_iter().map(|local| assembled.points[local]).collect();
                points.sort_unstable();
                Self::UndeterminedPoints(points)
            }
            AdjustError::Undetermined(combinations) => Self::undetermined(combinations, assembled),
            AdjustError::NotFinite => Self::NotFinite,
            AdjustError::Layout(error) => Self::Layout(error),
            AdjustError::Stopped(stopped) => Self::Stopped(stopped),
        }
    }

    /// Converts combinations of retained blocks: photos, cameras and shared parameters if any, else the points.
    fn undetermined(combinations: Vec<Vec<usize>>, assembled: &Assembled) -> Self {
        let model = &assembled.problem.model;
        let count = model.parameter_blocks();
        let parameter_unknowns = |blocks: &Vec<usize>| {
            let mut found = Combination::default();
            for &block in blocks.iter().filter(|&&block| block < count) {
                for (owner, _) in model.owners(block) {
                    match owner {
                        Owner::Photo(photo) => found.photos.push(photo),
                        Owner::Camera(camera) => found.cameras.push(camera),
                        Owner::Common(common) => found.commons.push(common),
                    }
                }
            }
            (found != Combination::default()).then_some(found)
        };
        let found: Vec<Combination> = combinations.iter().filter_map(parameter_unknowns).collect();
        if !found.is_empty() {
            return Self::Undetermined(found);
        }
        let point = |block: usize| assembled.points[model.locals + block - count];
        let mut points: Vec<usize> = combinations.into_iter().flatten().map(point).collect();
        points.sort_unstable();
        points.dedup();
        Self::UndeterminedPoints(points)
    }
}

impl Network {
    /// Adds camera parameters and pose parts to undetermined combinations. Nothing is added if all cameras are fixed, or if the normal
    /// equations cannot be formed again.
    pub(super) fn name(
        &self,
        mut error: NetworkError,
        assembled: &Assembled,
        values: &[f64],
        threads: &Threads,
    ) -> NetworkError {
        let NetworkError::Undetermined(combinations) = &mut error else { return error };
        if self.cameras.iter().all(super::Camera::is_held) || self.poses == PoseNumbers::Vectors {
            return error;
        }
        let problem = &assembled.problem;
        let held = problem.any().to_hold(values, threads);
        let context = &mut Context::new(threads);
        let Ok(linearized) = Linearized::form(problem, None, values.to_vec(), held, context) else {
            return error;
        };
        let named = linearized.combinations();
        if named.len() == combinations.len() {
            combinations
                .iter_mut()
                .zip(named)
                .for_each(|(one, moved)| self.describe(one, &moved, assembled, values));
        }
        error
    }

    /// Sums up the shares n x^2 of parameters, given with x and n, by camera parameters and pose parts.
    fn describe(
        &self,
        combination: &mut Combination,
        moved: &[(usize, f64, f64)],
        assembled: &Assembled,
        values: &[f64],
    ) {
        let model = &assembled.problem.model;
        let mut all = vec![[0.0; 2]; values.len()];
        moved.iter().for_each(|&(unknown, x, n)| all[unknown] = [x, n]);
        let share = |unknown: usize| all[unknown][1] * all[unknown][0].powi(2);
        let photos = model.photos(&values[model.parameter_unknowns()]);
        let mut parts = [0.0; 4];
        let mut parameters: Vec<Vec<f64>> =
            self.cameras.iter().map(|camera| vec![0.0; camera.sd.len()]).collect();
        for (index, photo) in photos.iter().enumerate() {
            let first = model.of_block(index).start;
            let view = photo.orientation.pose().attitude.column(2).into_owned();
            let moved = Vector3::from_fn(|k, _| all[first + k][0]);
            let along = if moved.norm() > 0.0 { (moved.dot(&view) / moved.norm()).powi(2) } else { 0.0 };
            let position: f64 = (first..first + 3).map(share).sum();
            parts[0] += along * position;
            parts[1] += (1.0 - along) * position;
            parts[2] += share(first + 3) + share(first + 4);
            parts[3] += share(first + 5);
            let camera = &mut parameters[self.photos[index].camera];
            let own = (first + 6..model.of_photo(index).end).map(share);
            camera.iter_mut().zip(own).for_each(|(sum, share)| *sum += share);
        }
        for (place, &camera) in model.blocks.shared.iter().enumerate() {
            let own = model.of_block(model.cameras.len() + place).map(share);
            parameters[camera].iter_mut().zip(own).for_each(|(sum, share)| *sum += share);
        }
        let least = NOTABLE * (parts.iter().sum::<f64>() + parameters.iter().flatten().sum::<f64>());
        let numbers = parameters.iter().enumerate().flat_map(|(camera, shares)| {
            shares.iter().enumerate().filter(|&(_, &share)| share > least).map(move |(k, _)| (camera, k))
        });
        combination.parameters = numbers.collect();
        combination.poses = PosePart::ALL
            .into_iter()
            .zip(parts)
            .filter(|&(_, share)| share > least)
            .map(|(part, _)| part)
            .collect();
    }
}
