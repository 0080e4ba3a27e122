//! The axes that corrections of positions are told in.

use super::Positions;
use crate::geometry::{Matrix3, Vector3};

/// What corrections of positions are along.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Axes {
    /// The axes of the table.
    #[default]
    Table,
    /// Along, across and radial on an orbit about a place: radial is away from it, along the velocity across that, across to the left.
    Orbit(Vector3),
    /// The same of a flight: radial is the third axis of the table, up.
    Flight,
}

/// The step, in seconds, of the differences of axes, which are of the fourth order.
const STEP: f64 = 5e-4;

impl Axes {
    /// Their directions as columns, in those of the table, and how these change in a second.
    pub(super) fn at(&self, positions: &Positions, time: f64) -> (Matrix3, Matrix3) {
        if *self == Self::Table {
            return (Matrix3::identity(), Matrix3::zeros());
        }
        let of = |time: f64| self.of(positions.at(time));
        let apart = |steps: f64| of(time + steps * STEP) - of(time - steps * STEP);
        (of(time), (8.0 * apart(1.0) - apart(2.0)) / (12.0 * STEP))
    }

    fn of(&self, (place, velocity): (Vector3, Vector3)) -> Matrix3 {
        let radial = match self {
            Self::Orbit(centre) => (place - centre).normalize(),
            Self::Table | Self::Flight => Vector3::z(),
        };
        let along = (velocity - radial * radial.dot(&velocity)).normalize();
        Matrix3::from_columns(&[along, radial.cross(&along), radial])
    }

    /// The same with coordinates counted from an origin.
    pub(super) fn counted_from(self, origin: [f64; 3]) -> Self {
        match self {
            Self::Orbit(centre) => Self::Orbit(centre - Vector3::from(origin)),
            other => other,
        }
    }
}
