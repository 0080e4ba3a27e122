//! Unknowns that observations have in common: lever arms, shifts and drifts of positions, boresights, planes, lines, levels, scales of
//! instruments, sensors of rigs.
//!
//! Each is a small pose, a position p and a rotation R, of whose six components some are unknown: a line of [`CommonKind`]'s table says
//! which. The unknowns count from what is given: offsets o, and a rotation vector r with R = R_0 Exp(r) about the axes that are given.

mod adjusted;
mod motions;

use nalgebra::DMatrix;

use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::{
    Matrix3, ObjectSpace, Pose, Vector3, angle_axis_rotation, angle_axis_with_jacobian, local_vertical,
};

pub use adjusted::AdjustedCommon;
pub(super) use motions::Motion;

/// What a common unknown does when the network moves as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moves {
    /// Nothing.
    Stays,
    /// It is a length in a frame that moves along: it grows with the scale.
    Scales,
    /// It is a place in object space.
    Along,
    /// It takes up what the network moves by at what it belongs to.
    Against,
    /// It is the scale of lengths, which shrinks when these grow.
    Shrinks,
    /// It follows with the other coefficients of its trajectory, as far as the functions of these do.
    Follows,
}

/// What the number of an unknown stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// A length in the unit of the object space.
    Length,
    /// A length in a second.
    Speed,
    /// An angle in radians.
    Angle,
    /// An angle in a second.
    Rate,
    /// Seconds.
    Time,
    /// A ratio.
    Ratio,
    /// A length in an image: mm.
    InImage,
    /// A ratio a mm.
    PerImage,
}

/// The name of an unknown, which of the six components it is (offsets, then rotations), and what its number stands for.
type Unknown = (&'static str, usize, Measure);

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $moves:ident, [$(($unknown:literal, $component:literal, $measure:ident)),*];)*) => {
        /// The types of common unknowns.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum CommonKind {
            $($(#[$doc])* $kind,)*
        }

        impl CommonKind {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// The name under which reports know it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Its unknowns.
            pub fn unknowns(self) -> &'static [Unknown] {
                match self {
                    $(Self::$kind => &[$(($unknown, $component, Measure::$measure)),*],)*
                }
            }

            fn moves(self) -> Moves {
                match self {
                    $(Self::$kind => Moves::$moves,)*
                }
            }
        }
    };
}

kinds! {
    /// l, from the projection centre to the antenna in the axes of the photo (x right, y up, z back).
    LeverArm = "lever arm", Scales, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// s of observed positions, along X, Y, Z or, in geographic space, east, north and up amid the photos.
    Shift = "shift", Against, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// d of observed positions in a second, in the axes of a shift.
    Drift = "drift", Against, [("x", 0, Speed), ("y", 1, Speed), ("z", 2, Speed)];
    /// B, body to photo: unknown are rotations about the axes of the body, B = B_0 Exp(r).
    Boresight = "boresight", Stays, [("rotation x", 3, Angle), ("rotation y", 4, Angle), ("rotation z", 5, Angle)];
    /// Scale m and constant k of an instrument for distances, the first two numbers of its position.
    Instrument = "instrument", Shrinks, [("scale", 0, Ratio), ("constant", 1, Length)];
    /// A height, the third of its coordinates.
    Level = "level", Along, [("height", 2, Length)];
    /// A vertical at a place: unknown are offsets from it along X and Y or, in geographic space, east and north.
    PlumbLine = "plumb line", Along, [("x", 0, Length), ("y", 1, Length)];
    /// The line along the third of its own axes through a place: unknown are offsets along the two others and rotations about them.
    Line = "line", Along, [("x", 0, Length), ("y", 1, Length), ("rotation x", 3, Angle), ("rotation y", 4, Angle)];
    /// The plane across the third of its own axes through a place: unknown are its distance along that and rotations about the two
    /// others.
    Plane = "plane", Along, [("distance", 2, Length), ("rotation x", 3, Angle), ("rotation y", 4, Angle)];
    /// The pose of a camera in the axes of a frame (x right, y up, z back): unknown are its position and rotations about its own axes.
    Sensor = "sensor", Scales, [
        ("x", 0, Length), ("y", 1, Length), ("z", 2, Length),
        ("rotation x", 3, Angle), ("rotation y", 4, Angle), ("rotation z", 5, Angle)
    ];
    /// c_k, a coefficient of the positions of a trajectory, in their axes.
    PositionCoefficient = "position coefficient", Follows, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// r_k, a coefficient of its rotation vectors, about the axes of the photo.
    RotationCoefficient = "rotation coefficient", Follows, [("x", 0, Angle), ("y", 1, Angle), ("z", 2, Angle)];
    /// b, what a gyroscope says of a body at rest.
    GyroBias = "gyro bias", Stays, [("x", 0, Rate), ("y", 1, Rate), ("z", 2, Rate)];
    /// The readout time of all rows of a rolling shutter, or the factor of the line rates of a scanner, which is about 1.
    Readout = "readout", Stays, [("time", 0, Time)];
    /// A knot of the spline of a lens: its displacements along columns and rows, in the unit of the tangent of half the angle, twice.
    Knot = "knot", Stays, [("x", 0, Ratio), ("y", 1, Ratio)];
    /// w of a figure: how far a target bends, in the middle along its first and along its second axis.
    Bend = "bend", Stays, [("x", 0, Length), ("y", 1, Length)];
    /// Where the film of a photo lay on a scanner: t and theta.
    FilmPlacement = "film placement", Stays, [("t1", 0, InImage), ("t2", 1, InImage), ("theta", 2, Angle)];
    /// How the size of the film of a photo has changed: mean, difference of x and y, shear.
    FilmSize = "film size", Stays, [("m", 0, Ratio), ("b1", 1, Ratio), ("b2", 2, Ratio)];
    /// h or g of the film of a photo: what is not affine.
    FilmBend = "film bend", Stays, [("first", 0, PerImage), ("second", 1, PerImage)];
    /// The mean change of size of the films of one roll.
    Roll = "roll", Stays, [("m", 0, Ratio)];
    /// The place of a fiducial mark in the frame of its camera.
    Fiducial = "fiducial", Stays, [("x", 0, InImage), ("y", 1, InImage)];
    /// Two weights of a pattern of deformation.
    Pattern = "pattern", Stays, [("first", 0, InImage), ("second", 1, InImage)];
    /// Scales and obliqueness of a scanner or comparator.
    Scanner = "scanner", Stays, [("Sx", 0, Ratio), ("Sy", 1, Ratio), ("alpha", 2, Angle)];
    /// Three coefficients of the polynomials of these: six times three are those of x, then of y.
    ScannerCurve = "scanner curve", Stays, [("first", 0, InImage), ("second", 1, InImage), ("third", 2, InImage)];
    /// d, by which the clock of a receiver is behind that of a trajectory.
    Clock = "clock", Stays, [("offset", 0, Time)];
}

impl CommonKind {
    /// The type of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// Which of its six components are unknown.
    fn components(self) -> impl Iterator<Item = usize> {
        self.unknowns().iter().map(|&(_, component, _)| component)
    }

    /// Whether its position is given in coordinates of the object space.
    fn is_place(self) -> bool {
        self.moves() == Moves::Along
    }

    /// Whether it has unknowns of rotation.
    fn rotates(self) -> bool {
        self.components().any(|component| component > 2)
    }

    /// Whether a rotation about the third of its own axes leaves it as it is: its two others are any.
    fn is_axis(self) -> bool {
        matches!(self, Self::Line | Self::Plane)
    }
}

/// A common unknown as it is known beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Common {
    /// What it is.
    pub kind: CommonKind,
    /// Its position: initial and, where weighted, observed. Coordinates of the object space for levels, planes and lines; for the others
    /// components in their axes.
    pub position: [f64; 3],
    /// Its rotation: the columns are its own axes. Of planes and lines in X, Y, Z or, in geographic space, east, north and up at the place;
    /// the identity where it has no unknown of rotation.
    pub attitude: Matrix3,
    /// Standard deviations of its unknowns: infinite free, zero fixed.
    pub sd: Vec<f64>,
}

impl Common {
    /// Of a position alone.
    pub fn vector(kind: CommonKind, position: [f64; 3], sd: &[f64]) -> Self {
        Self { kind, position, attitude: Matrix3::identity(), sd: sd.to_vec() }
    }

    /// Whether nothing of it is unknown.
    pub fn is_held(&self) -> bool {
        self.sd.iter().all(|&sd| sd == 0.0)
    }
}

/// A common unknown in the cartesian axes of an adjustment.
#[derive(Debug, Clone)]
pub(super) struct PlacedCommon {
    pub kind: CommonKind,
    space: ObjectSpace,
    origin: [f64; 3],
    /// The position that is given; coordinates of a place are counted from the origin.
    coordinates: [f64; 3],
    /// What is given.
    given: Pose,
    /// The axes that its rotation is given in, as rows.
    axes: Matrix3,
    /// How many observations and images that take part are of it.
    pub uses: usize,
}

impl PlacedCommon {
    /// `vertical` has the local axes amid the photos as rows, X, Y, Z in rectangular space.
    pub fn new(common: &Common, space: ObjectSpace, origin: [f64; 3], vertical: &Matrix3) -> Self {
        let Common { kind, position, attitude, .. } = common;
        let (coordinates, position, axes) = if kind.is_place() {
            let coordinates = std::array::from_fn(|k| position[k] - origin[k]);
            let axes = match space {
                ObjectSpace::Rectangular => Matrix3::identity(),
                ObjectSpace::Geographic(_) => local_vertical(position[0], position[1]),
            };
            (coordinates, space.cartesian(coordinates), axes)
        } else {
            let axes = if kind.moves() == Moves::Against { *vertical } else { Matrix3::identity() };
            (*position, (*position).into(), axes)
        };
        let given = Pose { position, attitude: axes.tr_mul(attitude) };
        Self { kind: *kind, space, origin, coordinates, given, axes, uses: 0 }
    }

    /// Position and rotation, as in [`Common`], at given values.
    pub fn reported(&self, state: &CommonState) -> ([f64; 3], Matrix3) {
        let position = if self.kind == CommonKind::Level {
            [self.coordinates[0], self.coordinates[1], state.height]
        } else if self.kind.is_place() {
            self.space.coordinates(state.place())
        } else {
            state.vector().into()
        };
        let counted =
            |k: usize| if self.kind.is_place() { position[k] + self.origin[k] } else { position[k] };
        (std::array::from_fn(counted), self.axes * state.attitude)
    }

    /// At given values of its unknowns.
    pub fn at(&self, unknowns: &[f64]) -> CommonState {
        let mut six = [0.0; 6];
        self.kind.components().zip(unknowns).for_each(|(component, &value)| six[component] = value);
        let [x, y, z, a, b, c] = six;
        let rotation = Vector3::new(a, b, c);
        let (turn, jacobian) = angle_axis_with_jacobian(&rotation);
        CommonState {
            kind: self.kind,
            height: self.coordinates[2] + z,
            base: self.given.position,
            offset: Vector3::new(x, y, z),
            rotation,
            attitude: self.given.attitude * turn,
            turns: jacobian.transpose(),
        }
    }

    /// The unknowns with the given offset and rotation.
    fn unknowns(&self, offset: &Vector3, attitude: &Matrix3) -> Vec<f64> {
        let turn = self.given.attitude.tr_mul(attitude);
        let turn = if self.kind.is_axis() {
            // The shortest way from the third axis to where it has come.
            let (to, z) = (Vector3::from(turn.column(2)), Vector3::z());
            let across = z.cross(&to);
            let sine = across.norm();
            if sine > 0.0 { across * (sine.atan2(to.z) / sine) } else { across }
        } else {
            rotation_angle_axis(&turn)
        };
        let six = [offset.x, offset.y, offset.z, turn.x, turn.y, turn.z];
        self.kind.components().map(|component| six[component]).collect()
    }
}

/// A common unknown at given values.
#[derive(Debug, Clone)]
pub struct CommonState {
    kind: CommonKind,
    height: f64,
    base: Vector3,
    offset: Vector3,
    /// r.
    rotation: Vector3,
    attitude: Matrix3,
    /// The turn about its own axes that a unit of each component of r takes, as columns.
    turns: Matrix3,
}

impl CommonState {
    /// Its position as a vector: of a lever arm, shift, drift, instrument, sensor or coefficient.
    pub fn vector(&self) -> Vector3 {
        self.base + self.offset
    }

    /// Its rotation R, own axes as columns; of shifts and drifts the axes that they are told in.
    pub fn attitude(&self) -> &Matrix3 {
        &self.attitude
    }

    /// Its position and rotation: of a sensor.
    pub fn pose(&self) -> Pose {
        Pose { position: self.vector(), attitude: self.attitude }
    }

    /// The height of a level.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// A place in its own axes, R^T (P - p_0), p_0 being what is given; unknown offsets belong to it.
    pub fn own(&self, place: &Vector3) -> Vector3 {
        self.attitude.tr_mul(&(place - self.base))
    }

    /// The values of its unknowns.
    pub fn unknowns(&self) -> impl Iterator<Item = f64> {
        let six = [self.offset.data.0[0], self.rotation.data.0[0]].concat();
        self.kind.components().map(move |component| six[component])
    }

    /// The position that is given: unknown offsets count from it.
    pub fn given(&self) -> Vector3 {
        self.base
    }

    /// The unknown offsets.
    pub fn offset(&self) -> &Vector3 {
        &self.offset
    }

    /// Where it is, offsets in its own axes.
    fn place(&self) -> Vector3 {
        self.base + self.attitude * self.offset
    }

    /// Its unknowns with rotations about its own axes (rows) by its unknowns. Offsets of a line that turns turn with its axes: rows of these are
    /// how its place moves along them.
    pub(super) fn about_own_axes(&self) -> DMatrix<f64> {
        let components: Vec<usize> = self.kind.components().collect();
        DMatrix::from_fn(components.len(), components.len(), |i, j| {
            match (components[i].checked_sub(3), components[j].checked_sub(3)) {
                (Some(turn), Some(by)) => self.turns[(turn, by)],
                (None, Some(by)) if self.kind.is_axis() => {
                    self.turns.column(by).cross(&self.offset)[components[i]]
                }
                _ => f64::from(u8::from(i == j)),
            }
        })
    }

    /// The unknowns and, for each, the change of the offset and the turn about the own axes that a unit of it takes.
    pub(super) fn steps(&self) -> impl Iterator<Item = (Vector3, Vector3)> {
        self.kind.components().map(|component| match component.checked_sub(3) {
            None => (Vector3::ith(component, 1.0), Vector3::zeros()),
            Some(turn) => (Vector3::zeros(), self.turns.column(turn).into()),
        })
    }
}

/// Turns a rotation by a rotation vector about the axes of space.
fn turned(attitude: &Matrix3, by: &Vector3) -> Matrix3 {
    angle_axis_rotation(by) * attitude
}
