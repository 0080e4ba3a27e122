//! How common unknowns move with a network as a whole (see [`crate::adjustment::Motions`]).

use std::collections::BTreeMap;

use super::{CommonState, Moves, PlacedCommon, turned};
use crate::geometry::{Matrix3, Vector3};
use crate::network::model::Bundle;
use crate::network::observations::Observation;
use crate::network::stations::Placed;

/// A motion of the whole: how it displaces a place, the rotation vector by which it turns, the factor of its scale.
pub struct Motion<'a> {
    pub displacement: &'a dyn Fn(&Vector3) -> Vector3,
    pub turn: Vector3,
    pub scale: f64,
}

impl PlacedCommon {
    /// Whether anything of it changes when the network moves as a whole.
    pub fn moves(&self) -> bool {
        self.kind.moves() != Moves::Stays
    }

    /// Whether it takes up what the network moves by.
    pub fn moves_against(&self) -> bool {
        self.kind.moves() == Moves::Against
    }

    /// How its unknowns change with a small motion, the scale being 1 and a change of it; of those that move against it, and of coefficients of
    /// trajectories, nothing.
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
                // R^T (p - p_0): its own axes turn as the unknowns turn them.
                (own - (state.turns * turn).cross(&state.offset), turn)
            }
        };
        let six = [offset.x, offset.y, offset.z, turn.x, turn.y, turn.z];
        self.kind.components().map(|component| six[component]).collect()
    }

    /// The components of r that turn the axes so, about themselves; of an axis its third component is none.
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

    /// Its unknowns after a motion that need not be small; of the same ones as they are.
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
                // Offsets count in the axes that the unknowns give.
                let axes = self.at(&unknowns);
                self.unknowns(&axes.own(&place), &axes.attitude)
            }
        }
    }
}

/// The places of antennas with their times, of the positions that have one shift and drift.
type Antennas = BTreeMap<[Option<usize>; 2], Vec<(Vector3, f64)>>;

impl Bundle {
    /// Writes what a motion makes of common unknowns where these stand among all: by `each` of those that do not move against it; to
    /// shifts and drifts is added what they take up of it.
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

    /// The antennas of each shift and drift; without those that belong to several.
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

/// The line a + b t through vectors at times t, least squares; only a, or only b, where the other is not asked for.
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
