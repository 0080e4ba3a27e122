//! Poses as functions of time: a table of what is known beforehand, and corrections in a basis of functions of time.
//!
//! ```text
//! C(t) = C0(t) + sum B_k(t) c_k        A(t) = A0(t) Exp(r(t)),  r(t) = sum B_k(t) r_k
//! ```
//!
//! C0, A0 are the table. c_k, in the axes of the table, and the rotation vectors r_k, in those of the photo, are the coefficients. Others are
//! [`Axes`] and [`Rotations`]. A frame is the case of one record and degree 0. Continuous-time splines: Furgale and others 2012; line scanners: Poli 2007.

mod axes;
mod functions;
mod rotations;
mod table;

use std::ops::Range;

use self::functions::ALWAYS;

pub use axes::Axes;
pub use functions::{Active, BasisModel};
pub use rotations::Rotations;
pub use table::{Attitudes, Interpolation, Positions};

use self::rotations::Corrected;
use super::{Matrix3, Pose, Vector3};

macro_rules! bases {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// What corrections are made of: functions of time of any kind, or nothing.
        #[derive(Debug, Clone, PartialEq, Default)]
        pub enum Basis {
            /// No corrections.
            #[default]
            None,
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        impl Basis {
            /// A basis of that name (see [`BasisModel::from_numbers`]); None where there is no such.
            pub fn from_numbers(name: &str, degree: usize, numbers: &[f64]) -> Option<Self> {
                match name {
                    "none" => Some(Self::None),
                    $($name::NAME => $name::from_numbers(degree, numbers).map(Self::$name),)*
                    _ => None,
                }
            }

            /// How many functions there are.
            pub fn count(&self) -> usize {
                match self {
                    Self::None => 0,
                    $(Self::$name(own) => own.count(),)*
                }
            }

            /// Those functions that are not zero at a time.
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
    /// Whether some functions are zero at some times: others then are not.
    pub fn is_local(&self) -> bool {
        self.reach().is_some()
    }

    /// The numbers of the functions that are not zero at a time or, where that is not known exactly, near it.
    pub fn near(&self, time: f64, exactly: bool) -> Range<usize> {
        match self.reach() {
            Some(reach) if !exactly => self.active(time - reach).start..self.active(time + reach).end,
            _ => self.active(time),
        }
    }
}

/// A pose, and how it moves.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// The pose.
    pub pose: Pose,
    /// C', in the axes of the pose's position, in a second.
    pub velocity: Vector3,
    /// w, about the axes of the photo, in radians in a second: `A' = A [w]x`.
    pub rate: Vector3,
}

/// A trajectory without the values of its coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// What is known beforehand of positions.
    pub positions: Positions,
    /// The same of attitudes, photo to the axes of the positions.
    pub attitudes: Attitudes,
    /// What the corrections of positions are made of.
    pub position: Basis,
    /// The same of attitudes.
    pub rotation: Basis,
    /// The axes of the corrections of positions.
    pub axes: Axes,
    /// What the corrections of attitudes are.
    pub rotations: Rotations,
    /// Where the table is inertial, and the object space a body that turns: inertial to body.
    pub body: Option<Attitudes>,
}

/// A trajectory at a time, with what its pose is made of.
#[derive(Debug, Clone)]
pub struct Flight {
    /// Pose, velocity and rate.
    pub motion: Motion,
    /// The functions that the position is made of.
    pub position: Active,
    /// The same of the rotation.
    pub rotation: Active,
    /// The axes of the coefficients of positions, as columns in those of the object space.
    pub axes: Matrix3,
    /// How these change in a second.
    axes_rate: Matrix3,
    /// The turn about the axes of the photo by a unit of each correction of the attitude, as columns: Jr(r) of rotation vectors.
    pub jacobian: Matrix3,
    /// How that changes.
    rotations: Rotations,
    turn: [Vector3; 2],
}

impl Trajectory {
    /// At a time, the coefficients given.
    pub fn at(&self, time: f64, c: &dyn Fn(usize) -> Vector3, r: &dyn Fn(usize) -> Vector3) -> Flight {
        let (position, rotation) = (self.position.at(time), self.rotation.at(time));
        let (shift, drift) = position.sums(c);
        let turn = rotation.sums(r);
        let (place, speed) = self.positions.at(time);
        let Corrected { attitude, mut rate, jacobian, turn } =
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

    /// Where it is at a time, or at the end that is nearest to that, by its table alone.
    pub fn place(&self, time: f64) -> Vector3 {
        let (first, last) = self.span();
        let nothing = |_: usize| Vector3::zeros();
        self.at(time.max(first).min(last), &nothing, &nothing).motion.pose.position
    }

    /// The same with its coordinates counted from an origin.
    #[must_use]
    pub fn counted_from(&self, origin: [f64; 3]) -> Self {
        let (positions, axes) = (self.positions.counted_from(origin), self.axes.counted_from(origin));
        Self { positions, axes, ..self.clone() }
    }

    /// The times that it may be asked for: those of the table and half a record beyond, within the knots of splines.
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
    /// The partials of C' by c_k.
    pub fn velocity_by_position(&self, k: usize) -> Matrix3 {
        self.position.rate(k) * self.axes + self.position.value(k) * self.axes_rate
    }

    /// The partials of w by r_k: `W_k = B_k' Jr + B_k (Jr' + [w]x Jr)`.
    pub fn rate_by_rotation(&self, k: usize) -> Matrix3 {
        let (value, rate) = (self.rotation.value(k), self.rotation.rate(k));
        // The turning of the body, which is in w, steps as it is seen in the photo's axes.
        rate * self.jacobian
            + value
                * (self.rotations.jacobian_rate(&self.turn) + self.motion.rate.cross_matrix() * self.jacobian)
    }
}

#[cfg(test)]
mod tests;
