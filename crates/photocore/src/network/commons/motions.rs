//! Effect of similarity transformations of the network on shared parameters (see [`crate::adjustment::Motions`]).

use std::collections::BTreeMap;

use super::{CommonState, Moves, PlacedCommon, turned};
use crate::geometry::{Matrix3, Vector3};
use crate::network::model::Bundle;
use crate::network::observations::Observation;
use crate::network::stations::Placed;

/// A similarity transformation: displacement of a position, rotation vector and scale factor.
pub struct Motion<'a> {
    pub displacement: &'a dyn Fn(&Vector3) -> Vector3,
    pub turn: Vector3,
    pub scale: f64,
}

impl PlacedCommon {
    /// Returns true if the transformation changes a component.
    pub fn moves(&self) -> bool {
        self.kind.moves() != Moves::Stays
    }

    /// Returns true if the parameter absorbs the displacement of the network.
    pub fn moves_against(&self) -> bool {
        self.kind.moves() == Moves::Against
    }

    /// Returns the change of the parameters under a small transformation with a scale near 1; zero for static and absorbing parameters and
    /// coefficients of trajectories.
    pub fn change(&self, state: &CommonState, motion: &Motion<'_>) -> Vec<f64> {
        let growth = motion.scale - 1.0;
        let (offset, turn) = match self.kind.moves() {
            Moves::Stays | Moves::Against | Moves::Follows => (Vector3::zeros(), Vector3::zeros()),
            Moves::Scales => (growth * state.vector(), Vector3::zeros()),
            Moves::Shrinks => (Vector3::new(-growth * state.vector().x, 0.0, 0.0), Vector3::zeros()),
            Moves::Along => {
                let (own, turn) = (
                    state.attitude.tr_mul(&(motion.displacement)(&state.place())),
                    state.attitude.tr_mul(&motion.turn),
                );
                let turn = self.to_components(state, &turn);
                // R^T (p - p_0): the own axes rotate with the parameters.
                (own - (state.turns * turn).cross(&state.offset), turn)
            }
        };
        let six = [offset.x, offset.y, offset.z, turn.x, turn.y, turn.z];
        self.kind.components().map(|component| six[component]).collect()
    }

    /// Returns the components of r for a rotation about the own axes; the third component of an axis is zero.
    fn to_components(&self, state: &CommonState, turn: &Vector3) -> Vector3 {
        if !self.kind.rotates() {
            Vector3::zeros()
        } else if self.kind.is_axis() {
            let part = state.turns.fixed_view::<2, 2>(0, 0).into_owned();
            let found = part.try_inverse().unwrap_or_default() * turn.xy();
            Vector3::new(found.x, found.y, 0.0)
        } else {
            state.turns.try_inverse().unwrap_or_else(Matrix3::zeros) * turn
        }
    }

    /// Returns the parameters after a finite transformation; unchanged for static and absorbing ones and coefficients of trajectories.
    pub fn moved(&self, state: &CommonState, motion: &Motion<'_>) -> Vec<f64> {
        match self.kind.moves() {
            Moves::Stays | Moves::Against | Moves::Follows => self.unknowns(&state.offset, &state.attitude),
            Moves::Scales => {
                self.unknowns(&(motion.scale * state.vector() - self.given.position), &state.attitude)
            }
            Moves::Shrinks => {
                let [m, k, _] = state.vector().into();
                let now = Vector3::new(m / motion.scale, k, 0.0);
                self.unknowns(&(now - self.given.position), &state.attitude)
            }
            Moves::Along => {
                let place = state.place();
                let place = place + (motion.displacement)(&place);
                let turn = if self.kind.rotates() { motion.turn } else { Vector3::zeros() };
                let unknowns = self.unknowns(&Vector3::zeros(), &turned(&state.attitude, &turn));
                // Offsets refer to the axes that the parameters represent.
                let axes = self.at(&unknowns);
                self.unknowns(&axes.own(&place), &axes.attitude)
            }
        }
    }
}

/// Antenna positions and times of observed positions with the same shift and drift.
type Antennas = BTreeMap<[Option<usize>; 2], Vec<(Vector3, f64)>>;

impl Bundle {
    /// Writes the transformed shared parameters into all parameters. Nonabsorbing ones are computed by `each`; shifts and drifts absorb the
    /// mean displacement of their antennas.
    pub(in crate::network) fn move_commons(
        &self,
        placed: &Placed,
        motion: &Motion<'_>,
        each: impl Fn(&PlacedCommon, &CommonState) -> Vec<f64>,
        unknowns: &mut [f64],
    ) {
        let all = self.commons.iter().zip(&placed.commons).enumerate();
        for (number, (common, state)) in all.filter(|(_, (common, _))| !common.moves_against()) {
            if let Some(own) = self.of_common(number) {
                unknowns[own].copy_from_slice(&each(common, state));
            }
        }
        for (pair, antennas) in self.antennas(placed) {
            let displaced = antennas.iter().map(|&(place, time)| ((motion.displacement)(&place), time));
            for (common, moved) in pair.into_iter().zip(line(displaced, pair.map(|own| own.is_some()))) {
                let Some((common, range)) = common.and_then(|own| Some((own, self.of_common(own)?))) else {
                    continue;
                };
                let own = placed.commons[common].attitude().tr_mul(&moved);
                let values = &mut unknowns[range];
                values.iter_mut().zip(own.iter()).for_each(|(value, moved)| *value -= moved);
            }
        }
    }

    /// Returns the antennas of each pair of shift and drift that no other pair shares.
    fn antennas(&self, placed: &Placed) -> Antennas {
        let mut all = Antennas::new();
        for tied in &self.observations {
            let Observation::Position(own) = &tied.observation else { continue };
            if own.shift.is_some() || own.drift.is_some() {
                let pose = placed.photos[own.photo].orientation.pose();
                let arm = match own.lever_arm.common() {
                    Some(common) => placed.commons[common].vector(),
                    None => own.known_lever_arm(),
                };
                let antenna = pose.position + pose.attitude * arm;
                all.entry([own.shift, own.drift]).or_default().push((antenna, own.time));
            }
        }
        let of = |common: Option<usize>, k: usize| {
            common.map_or(1, |common| all.keys().filter(|pair| pair[k] == Some(common)).count())
        };
        let alone: Vec<_> =
            all.keys().filter(|pair| of(pair[0], 0) == 1 && of(pair[1], 1) == 1).copied().collect();
        all.retain(|pair, _| alone.contains(pair));
        all
    }
}

/// Returns the least-squares line a + b t through vectors at times t; only a or only b if the other is not requested.
fn line(of: impl Iterator<Item = (Vector3, f64)>, asked: [bool; 2]) -> [Vector3; 2] {
    let (mut n, mut t, mut tt) = (0.0, 0.0, 0.0);
    let (mut sum, mut along) = (Vector3::zeros(), Vector3::zeros());
    for (vector, time) in of {
        (n, t, tt) = (n + 1.0, t + time, tt + time * time);
        (sum, along) = (sum + vector, along + time * vector);
    }
    match asked {
        [true, true] if n * tt - t * t > 1e-12 * n * tt => {
            let b = (n * along - t * sum) / (n * tt - t * t);
            [(sum - t * b) / n, b]
        }
        [false, true] if tt > 0.0 => [Vector3::zeros(), along / tt],
        _ => [sum / n, Vector3::zeros()],
    }
}
