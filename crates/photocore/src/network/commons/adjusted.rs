//! Common unknowns after the adjustment.

use nalgebra::DMatrix;

use super::Common;
use crate::adjustment::Adjustment;
use crate::geometry::Matrix3;
use crate::network::Network;
use crate::network::problem::Assembled;

/// An adjusted common unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCommon {
    /// By how much its unknowns differ from what is given: observed minus adjusted is the negative of it.
    pub change: Vec<f64>,
    /// Its position, as in [`Common`]; of planes and lines the place that is given, moved along their own axes by the offsets, in
    /// rectangular space.
    pub position: [f64; 3],
    /// Its rotation, as in [`Common`].
    pub attitude: Matrix3,
    /// Cofactors (a priori unit weight) of its unknowns, rotations being those about its own axes: zero for those that are
    /// held; NaN where there are none.
    pub cofactors: DMatrix<f64>,
    /// Cofactors of its unknowns (rows) with those of the common unknown before it in their block; none where it is the first.
    pub with_former: DMatrix<f64>,
    /// Redundancy numbers of its unknowns as observations of themselves; zero unless weighted, NaN where there are no cofactors.
    pub redundancy: Vec<f64>,
    /// How many observations that took part, images of rigs among them, are of it.
    pub observations: usize,
}

impl Network {
    /// The adjusted common unknowns, in the order of the network.
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
