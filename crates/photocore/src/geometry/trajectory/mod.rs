//! Trajectories (poses as functions of time): an a-priori table, and corrections in a basis of functions of time.
//!
//! ```text
//! C(t) = C0(t) + sum B_k(t) c_k        A(t) = A0(t) Exp(r(t)),  r(t) = sum B_k(t) r_k
//! ```
//!
//! The table is C0, A0. The coefficients are c_k, in its axes, and rotation vectors r_k, in photo axes; alternatives: [`Axes`],
//! [`Rotations`]. A frame photo has one record and degree 0. Continuous-time splines: Furgale and others 2012; line scanners: Poli 2007.

mod functions;
mod rotations;
mod table;

use std::ops::Range;

use self::functions::ALWAYS;

pub use functions::{Active, BasisModel};
pub use rotations::Rotations;
pub use table::{Attitudes, Axes, Interpolation, Positions};

use self::rotations::CorrectedAttitude;
use super::{Matrix3, Pose, Vector3};

macro_rules! bases {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// Basis of corrections: functions of time, or none.
        #[derive(Debug, Clone, PartialEq, Default)]
        pub enum Basis {
            /// No corrections.
            #[default]
            None,
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        impl Basis {
            /// Returns a basis by name (see [`BasisModel::from_numbers`]); None for an unknown name.
            pub fn from_numbers(name: &str, degree: usize, numbers: &[f64]) -> Option<Self> {
                match name {
                    "none" => Some(Self::None),
                    $($name::NAME => $name::from_numbers(degree, numbers).map(Self::$name),)*
                    _ => None,
                }
            }

            /// Returns the number of functions.
            pub fn count(&self) -> usize {
                match self {
                    Self::None => 0,
                    $(Self::$name(own) => own.count(),)*
                }
            }

            /// Returns the functions that are nonzero at a time.
            pub fn at(&self, time: f64) -> Active {
                let mut all = Active::default();
                match self {
                    Self::None => {}
                    $(Self::$name(own) => own.put(time, &mut all),)*
                }
                all
            }

            fn active(&self, time: f64) -> Range<usize> {
                match self {
                    Self::None => 0..0,
                    $(Self::$name(own) => own.active(time),)*
                }
            }

            /// See [`BasisModel::is_sound`].
            pub fn is_sound(&self) -> bool {
                match self {
                    Self::None => true,
                    $(Self::$name(own) => own.is_sound(),)*
                }
            }

            /// See [`BasisModel::span`].
            pub fn span(&self) -> (f64, f64) {
                match self {
                    Self::None => ALWAYS,
                    $(Self::$name(own) => own.span(),)*
                }
            }

            fn reach(&self) -> Option<f64> {
                match self {
                    Self::None => None,
                    $(Self::$name(own) => own.reach(),)*
                }
            }

            /// See [`BasisModel::middle`].
            pub fn middle(&self, k: usize) -> Option<f64> {
                match self {
                    Self::None => None,
                    $(Self::$name(own) => own.middle(k),)*
                }
            }
        }
    };
}

bases! {
    polynomial::Polynomial;
    spline::Spline;
}

impl Basis {
    /// Returns whether the functions are local, that is zero outside of a time interval.
    pub fn is_local(&self) -> bool {
        self.reach().is_some()
    }

    /// Returns the indices of the functions that are nonzero at a time or, unless `exactly`, near it.
    pub fn near(&self, time: f64, exactly: bool) -> Range<usize> {
        match self.reach() {
            Some(reach) if !exactly => self.active(time - reach).start..self.active(time + reach).end,
            _ => self.active(time),
        }
    }
}

/// Pose with its velocity and rotation rate.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// The pose.
    pub pose: Pose,
    /// C' in the axes of the position, per second.
    pub velocity: Vector3,
    /// w, about the axes of the photo, in radians per second: `A' = A [w]x`.
    pub rate: Vector3,
}

/// Trajectory without the values of its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// A-priori positions.
    pub positions: Positions,
    /// A-priori attitudes, photo to the axes of the positions.
    pub attitudes: Attitudes,
    /// Basis of the position corrections.
    pub position: Basis,
    /// Basis of the attitude corrections.
    pub rotation: Basis,
    /// Axes of the position corrections.
    pub axes: Axes,
    /// Parametrization of the attitude corrections.
    pub rotations: Rotations,
    /// Attitudes inertial to body, if the table is inertial and the object space is a rotating body.
    pub body: Option<Attitudes>,
}

/// Evaluated trajectory at a time, with derivatives.
#[derive(Debug, Clone)]
pub struct Flight {
    /// Pose, velocity and rate.
    pub motion: Motion,
    /// Basis functions of the position.
    pub position: Active,
    /// Basis functions of the rotation.
    pub rotation: Active,
    /// Axes of the position coefficients, as columns in the axes of the object space.
    pub axes: Matrix3,
    /// Derivatives of these axes per second.
    axes_rate: Matrix3,
    /// Rotation about the axes of the photo per unit of each attitude correction, as columns: Jr(r) for rotation vectors.
    pub jacobian: Matrix3,
    /// Parametrization and values for the rate of the Jacobian.
    rotations: Rotations,
    turn: [Vector3; 2],
}

impl Trajectory {
    /// Evaluates the trajectory at a time with the given coefficients.
    pub fn at(&self, time: f64, c: &dyn Fn(usize) -> Vector3, r: &dyn Fn(usize) -> Vector3) -> Flight {
        let (position, rotation) = (self.position.at(time), self.rotation.at(time));
        let (shift, drift) = position.sums(c);
        let turn = rotation.sums(r);
        let (place, speed) = self.positions.at(time);
        let CorrectedAttitude { attitude, mut rate, jacobian, turn } =
            self.rotations.corrected(self.attitudes.at(time), turn.into());
        let (mut axes, mut axes_rate) = self.axes.at(&self.positions, time);
        let mut pose = Pose { position: place + axes * shift, attitude };
        let mut velocity = speed + axes * drift + axes_rate * shift;
        if let Some(body) = &self.body {
            let (to_body, turning) = body.at(time);
            velocity = to_body * (velocity + turning.cross(&pose.position));
            rate += pose.attitude.tr_mul(&turning);
            pose = Pose { position: to_body * pose.position, attitude: to_body * pose.attitude };
            axes_rate = to_body * (axes_rate + turning.cross_matrix() * axes);
            axes = to_body * axes;
        }
        Flight {
            motion: Motion { pose, velocity, rate },
            position,
            rotation,
            axes,
            axes_rate,
            jacobian,
            rotations: self.rotations,
            turn,
        }
    }

    /// Returns the table position at a time, clamped to the valid time range, without corrections.
    pub fn place(&self, time: f64) -> Vector3 {
        let (first, last) = self.span();
        let nothing = |_: usize| Vector3::zeros();
        self.at(time.max(first).min(last), &nothing, &nothing).motion.pose.position
    }

    /// Returns the trajectory with coordinates relative to an origin.
    #[must_use]
    pub fn counted_from(&self, origin: [f64; 3]) -> Self {
        let (positions, axes) = (self.positions.counted_from(origin), self.axes.counted_from(origin));
        Self { positions, axes, ..self.clone() }
    }

    /// Returns the valid time range: the table and half a record beyond, within the knots of splines.
    pub fn span(&self) -> (f64, f64) {
        let all = [self.positions.span(), self.attitudes.span(), self.position.span(), self.rotation.span()];
        all.into_iter()
            .chain(self.body.as_ref().map(Attitudes::span))
            .fold((f64::NEG_INFINITY, f64::INFINITY), |(first, last), own| {
                (first.max(own.0), last.min(own.1))
            })
    }
}

impl Flight {
    /// Returns the partials of C' with respect to c_k.
    pub fn velocity_by_position(&self, k: usize) -> Matrix3 {
        self.position.rate(k) * self.axes + self.position.value(k) * self.axes_rate
    }

    /// Returns the partials of w with respect to r_k: `W_k = B_k' Jr + B_k (Jr' + [w]x Jr)`.
    pub fn rate_by_rotation(&self, k: usize) -> Matrix3 {
        let (value, rate) = (self.rotation.value(k), self.rotation.rate(k));
        // The rotation of the body, which is part of w, changes in the photo's axes.
        rate * self.jacobian
            + value
                * (self.rotations.jacobian_rate(&self.turn) + self.motion.rate.cross_matrix() * self.jacobian)
    }
}

#[cfg(test)]
mod tests;
