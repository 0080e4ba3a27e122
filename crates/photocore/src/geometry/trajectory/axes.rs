//! Axes of position corrections.

use super::Positions;
use crate::geometry::{Matrix3, Vector3};

/// Axes in which position corrections are expressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Axes {
    /// The axes of the table.
    #[default]
    Table,
    /// Orbit about a centre: radial points outward, along is the velocity component perpendicular to it, across points left.
    Orbit(Vector3),
    /// Flight: the same axes, with the third axis of the table (up) as radial.
    Flight,
}

/// Step, in seconds, of the fourth-order differences of axes.
const STEP: f64 = 5e-4;

impl Axes {
    /// Returns the directions of the axes as columns, in the axes of the table, and their derivatives per second.
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

    /// Returns the axes with coordinates relative to an origin.
    pub(super) fn counted_from(self, origin: [f64; 3]) -> Self {
        match self {
            Self::Orbit(centre) => Self::Orbit(centre - Vector3::from(origin)),
            other => other,
        }
    }
}
