//! What errors of single observations do to their own points and photos, and which of them cannot be told apart.

use std::ops::Range;

use super::NetworkError;
use super::model::Bundle;
use super::predictions::OnPoint;
use super::suspects::Home;
use super::trial::Trial;
use crate::adjustment::canonical_correlation;
use crate::geometry::{AttitudeNumbers, Matrix3};
use crate::{Threads, parallel};

/// Points that a thread takes at least.
const AT_LEAST: usize = 16;

impl Trial {
    /// How an error of one standard deviation in each row of some suspects moves its own point and its own photo: for each row the three
    /// coordinates, then the six numbers of the pose; NaN where it has none.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn effects(&self, suspects: &[usize], threads: &Threads) -> Result<Vec<[f64; 9]>, NetworkError> {
        let found = self.found()?;
        let (problem, model) = (&self.assembled.problem, &self.assembled.problem.model);
        let around = self.around(suspects, &problem.observation_sd, found, threads);
        let terms = self.terms(&problem.sd, &found.values);
        let mut all = Vec::new();
        for &index in suspects {
            let suspect = &self.suspects.all[index];
            let rows = suspect.rows.len();
            match suspect.home {
                Home::Group { group, point } => {
                    let Some(own) = around.points.get(&point) else { continue };
                    let first = 2 * (group - problem.layout().groups_of(point).start);
                    let photo = model.carrier(model.images[group].photo);
                    let other = own.others.iter().find(|other| other.0 == photo);
                    for row in first..first + rows {
                        let mut effect = [f64::NAN; 9];
                        effect[..3].copy_from_slice(&own.local[3 * row..3 * row + 3]);
                        if let Some((_, values)) = other {
                            let width = values.len() / own.rows();
                            effect[3..].copy_from_slice(&values[row * width..][..6]);
                        }
                        all.push(effect);
                    }
                }
                Home::Tie(tie) => {
                    let Some(own) = around.ties.get(&tie) else { continue };
                    let stations = model.stations();
                    let point = own.blocks.iter().find(|block| block.0 >= stations);
                    let photo = own.blocks.iter().find(|block| block.0 < model.cameras.len());
                    for row in 0..rows {
                        let mut effect = [f64::NAN; 9];
                        for (block, to, count) in [(point, 0, 3), (photo, 3, 6)] {
                            let Some((_, values)) = block else { continue };
                            let width = values.len() / rows;
                            effect[to..to + count].copy_from_slice(&values[row * width..][..count]);
                        }
                        all.push(effect);
                    }
                }
                home => {
                    let some: Vec<usize> = (0..rows).collect();
                    let a = self.term_rows(suspect, &some, &terms);
                    let along = a * self.cofactors_at(found, home);
                    for row in 0..rows {
                        let mut effect = [f64::NAN; 9];
                        match home {
                            Home::Point(_) => (0..3).for_each(|k| effect[k] = along[(row, k)]),
                            Home::Block(block) if block < model.cameras.len() => {
                                (0..6).for_each(|k| effect[3 + k] = along[(row, k)]);
                            }
                            _ => {}
                        }
                        all.push(effect);
                    }
                }
            }
        }
        self.to_angles(suspects, &found.values, &mut all);
        Ok(all)
    }

    /// Turns steps by a rotation vector into those of the angles of a photo.
    fn to_angles(&self, suspects: &[usize], values: &[f64], effects: &mut [[f64; 9]]) {
        let model = &self.assembled.problem.model;
        let mut rest = effects;
        for &index in suspects {
            let suspect = &self.suspects.all[index];
            let (own, others) = rest.split_at_mut(suspect.rows.len());
            rest = others;
            let photo = match suspect.home {
                Home::Group { group, .. } => Some(model.carrier(model.images[group].photo)),
                Home::Block(block) if block < model.cameras.len() => Some(block),
                Home::Tie(tie) => model.photo_of_tie(tie),
                _ => None,
            };
            let turning = photo.and_then(|photo| Some((photo, model.turning_sense(photo)?)));
            let Some((photo, sense)) = turning else { continue };
            let first = model.of_block(photo).start + 3;
            let angles = [values[first], values[first + 1], values[first + 2]];
            let rates = AttitudeNumbers::OmegaPhiKappa(sense).rates(angles);
            let inverse = rates.try_inverse().unwrap_or_else(|| Matrix3::repeat(f64::NAN));
            for effect in own {
                let turned = inverse * nalgebra::Vector3::new(effect[6], effect[7], effect[8]);
                effect[6..].copy_from_slice(turned.as_slice());
            }
        }
    }

    /// Pairs of observations of one point whose tests are correlated by more than `limit`, with their correlation: errors of them cannot
    /// be told apart.
    ///
    /// # Errors
    /// Nothing was adjusted before.
    pub fn inseparable(
        &self,
        points: &[usize],
        limit: f64,
        threads: &Threads,
    ) -> Result<Vec<(usize, usize, f64)>, NetworkError> {
        let on_points = self.on_points(points, threads)?;
        let pairs = |points: Range<usize>| -> Vec<(usize, usize, f64)> {
            on_points[points].iter().flat_map(|own| self.pairs_on(own, limit)).collect()
        };
        Ok(threads.install(|| parallel::by_parts(on_points.len(), AT_LEAST, &pairs)))
    }

    fn pairs_on(&self, own: &OnPoint, limit: f64) -> Vec<(usize, usize, f64)> {
        let count = own.residual.len();
        let mut starts = vec![0];
        own.suspects.iter().for_each(|&index| {
            starts.push(starts[starts.len() - 1] + self.suspects.all[index].rows.len());
        });
        let block = |i: usize, j: usize| -> Vec<f64> {
            let rows = starts[i]..starts[i + 1];
            rows.flat_map(|row| own.cofactors[row * count..][starts[j]..starts[j + 1]].to_vec()).collect()
        };
        let mut found = vec![];
        let is_in = |&k: &usize| self.suspects.all[own.suspects[k]].rows.iter().any(|row| self.is_in(row.0));
        let taking_part: Vec<usize> = (0..own.suspects.len()).filter(is_in).collect();
        let alone: Vec<Vec<f64>> = (0..own.suspects.len()).map(|k| block(k, k)).collect();
        for (at, &j) in taking_part.iter().enumerate() {
            for &i in &taking_part[..at] {
                let rho = canonical_correlation(&alone[i], &alone[j], &block(i, j));
                if rho > limit {
                    found.push((own.suspects[i], own.suspects[j], rho));
                }
            }
        }
        found
    }
}

impl Bundle {
    /// The first photo whose block a tie touches.
    fn photo_of_tie(&self, tie: usize) -> Option<usize> {
        let is_photo = |&block: &usize| block < self.cameras.len();
        match tie.checked_sub(self.tied_images()) {
            None => Some(self.main_block(self.point_images.start[self.locals] + tie)).filter(is_photo),
            Some(observation) => self.observations[observation].blocks.iter().copied().find(is_photo),
        }
    }
}
