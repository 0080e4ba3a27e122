//! Adjusted shared parameters.

use nalgebra::DMatrix;

use super::Common;
use crate::adjustment::Adjustment;
use crate::geometry::Matrix3;
use crate::network::Network;
use crate::network::problem::Assembled;

/// An adjusted shared parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCommon {
    /// Adjusted minus given values of its components: the negative of observed minus adjusted.
    pub change: Vec<f64>,
    /// Position, as in [`Common`]; for planes and lines the given position, displaced along their own axes by the offsets in rectangular
    /// space.
    pub position: [f64; 3],
    /// Rotation, as in [`Common`].
    pub attitude: Matrix3,
    /// Cofactors (a priori unit weight) of the components, with rotations about the own axes: zero for fixed components, NaN without
    /// cofactors.
    pub cofactors: DMatrix<f64>,
    /// Cofactors of the components (rows) with the components of the preceding shared parameter of the block; empty for the first.
    pub with_former: DMatrix<f64>,
    /// Redundancy numbers of the components as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: Vec<f64>,
    /// Number of active observations, including images of rigs, that depend on it.
    pub observations: usize,
}

impl Network {
    /// Returns the adjusted shared parameters, in the order of the network.
    pub(in crate::network) fn adjusted_commons(
        &self,
        Assembled { problem, .. }: &Assembled,
        adjustment: &Adjustment,
        unknowns: &[f64],
    ) -> Vec<AdjustedCommon> {
        let model = &problem.model;
        let states = model.common_states(&unknowns[model.of_stations()]);
        let each = |(index, common): (usize, &Common)| {
            let (width, state) = (common.sd.len(), &states[index]);
            let missing = if adjustment.cofactors.is_some() && common.is_held() { 0.0 } else { f64::NAN };
            let mut found = AdjustedCommon {
                change: vec![0.0; width],
                position: common.position,
                attitude: common.attitude,
                cofactors: DMatrix::repeat(width, width, missing),
                with_former: DMatrix::zeros(width, 0),
                redundancy: vec![missing; width],
                observations: model.commons[index].uses,
            };
            let Some(range) = model.of_common(index) else { return found };
            found.change = unknowns[range.clone()].to_vec();
            (found.position, found.attitude) = model.commons[index].reported(state);
            if found.observations == 0 {
                return found;
            }
            if let Some(all) = &adjustment.cofactors {
                let steps = state.about_own_axes();
                let own = &steps * model.cofactors_of_common(all, index) * steps.transpose();
                found.cofactors = (&own + own.transpose()) / 2.0;
                if let Some(former) = model.former_in_block(index) {
                    let turned = states[former].about_own_axes();
                    let mixed = model.cofactors_in_block(all, index, former);
                    found.with_former = &steps * mixed * turned.transpose();
                }
            }
            if let Some(all) = &adjustment.prior_redundancy {
                found.redundancy = all[range].to_vec();
            }
            found
        };
        self.commons.iter().enumerate().map(each).collect()
    }
}
