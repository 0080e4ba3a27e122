//! Shared parameters of observations: lever arms, shifts and drifts of positions, boresights, planes, lines, levels, scales of instruments,
//! sensors of rigs.
//!
//! Each is a small pose, a position p and a rotation R. A line of the table of [`CommonKind`] lists its free components among the six.
//! Parameters are relative to the given pose: offsets o, and a rotation vector r with R = R_0 Exp(r) about the given axes.

use nalgebra::DMatrix;

use crate::geometry::angle_axis::rotation_angle_axis;
use crate::geometry::{
    Matrix3, ObjectSpace, Pose, Vector3, angle_axis_rotation, angle_axis_with_jacobian, local_vertical,
};

/// Position of consecutive parameters inside a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InBlock {
    /// Index of the block.
    pub block: usize,
    /// First parameter inside the block.
    pub first: usize,
    /// Number of parameters of the block.
    pub width: usize,
}

impl InBlock {
    /// Returns the position of a whole block.
    pub fn whole(block: usize, width: usize) -> Self {
        Self { block, first: 0, width }
    }
}

/// Effect of a similarity transformation of the network on a shared parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Moves {
    /// None.
    Stays,
    /// A length in a transformed frame: it is multiplied by the scale.
    Scales,
    /// A position in the object space.
    Along,
    /// It absorbs the displacement of the objects it belongs to.
    Against,
    /// A scale of lengths, which is divided by the scale of the network.
    Shrinks,
    /// A coefficient of a trajectory: it follows as far as the basis functions allow.
    Follows,
}

/// Unit of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measure {
    /// Length in the unit of the object space.
    Length,
    /// Length per second.
    Speed,
    /// Angle in radians.
    Angle,
    /// Radians per second.
    Rate,
    /// Seconds.
    Time,
    /// Ratio.
    Ratio,
    /// Image length in mm.
    InImage,
    /// Ratio per mm.
    PerImage,
}

/// Name of a parameter, its component among the six (offsets, then rotations), and its unit.
type Unknown = (&'static str, usize, Measure);

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal, $moves:ident, [$(($unknown:literal, $component:literal, $measure:ident)),*];)*) => {
        /// Types of shared parameters.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum CommonKind {
            $($(#[$doc])* $kind,)*
        }

        impl CommonKind {
            /// All types.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// Returns the name of the type in reports.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }

            /// Returns the parameters of the type.
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
    /// Lever arm l from the projection centre to the antenna in the axes of the photo (x right, y up, z back).
    LeverArm = "lever arm", Scales, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// Shift s of observed positions along X, Y, Z or, in geographic space, east, north and up at the centre of the photos.
    Shift = "shift", Against, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// Drift d of observed positions per second, in the axes of a shift.
    Drift = "drift", Against, [("x", 0, Speed), ("y", 1, Speed), ("z", 2, Speed)];
    /// Rotation B from body to photo; parameters are rotations about the axes of the body, B = B_0 Exp(r).
    Boresight = "boresight", Stays, [("rotation x", 3, Angle), ("rotation y", 4, Angle), ("rotation z", 5, Angle)];
    /// Scale m and constant k of a distance meter, the first two components of its position.
    Instrument = "instrument", Shrinks, [("scale", 0, Ratio), ("constant", 1, Length)];
    /// A height, the third of its coordinates.
    Level = "level", Along, [("height", 2, Length)];
    /// A vertical line; parameters are offsets along X and Y or, in geographic space, east and north.
    PlumbLine = "plumb line", Along, [("x", 0, Length), ("y", 1, Length)];
    /// A line along the third of its own axes; parameters are offsets along the two others and rotations about them.
    Line = "line", Along, [("x", 0, Length), ("y", 1, Length), ("rotation x", 3, Angle), ("rotation y", 4, Angle)];
    /// A plane normal to the third of its own axes; parameters are the offset along this axis and rotations about the two others.
    Plane = "plane", Along, [("distance", 2, Length), ("rotation x", 3, Angle), ("rotation y", 4, Angle)];
    /// Pose of a camera in the axes of a frame (x right, y up, z back); parameters are position and rotations about its own axes.
    Sensor = "sensor", Scales, [
        ("x", 0, Length), ("y", 1, Length), ("z", 2, Length),
        ("rotation x", 3, Angle), ("rotation y", 4, Angle), ("rotation z", 5, Angle)
    ];
    /// Coefficient c_k of the positions of a trajectory, in their axes.
    PositionCoefficient = "position coefficient", Follows, [("x", 0, Length), ("y", 1, Length), ("z", 2, Length)];
    /// Coefficient r_k of the rotation vectors of a trajectory, about the axes of the photo.
    RotationCoefficient = "rotation coefficient", Follows, [("x", 0, Angle), ("y", 1, Angle), ("z", 2, Angle)];
    /// Bias b of a gyroscope: its reading at rest.
    GyroBias = "gyro bias", Stays, [("x", 0, Rate), ("y", 1, Rate), ("z", 2, Rate)];
    /// Readout time of all rows of a rolling shutter, or the factor of the line rates of a scanner, which is about 1.
    Readout = "readout", Stays, [("time", 0, Time)];
    /// Knot of a lens spline: displacements along columns and rows, in the unit of 2 tan(angle / 2).
    Knot = "knot", Stays, [("x", 0, Ratio), ("y", 1, Ratio)];
    /// Deflection w of a target at the centre along its first and its second axis.
    Bend = "bend", Stays, [("x", 0, Length), ("y", 1, Length)];
    /// Position t and rotation theta of the film of a photo on a scanner.
    FilmPlacement = "film placement", Stays, [("t1", 0, InImage), ("t2", 1, InImage), ("theta", 2, Angle)];
    /// Affine deformation of the film of a photo: mean scale, difference of x and y, shear.
    FilmSize = "film size", Stays, [("m", 0, Ratio), ("b1", 1, Ratio), ("b2", 2, Ratio)];
    /// Nonaffine deformation h or g of the film of a photo.
    FilmBend = "film bend", Stays, [("first", 0, PerImage), ("second", 1, PerImage)];
    /// Mean scale change of the films of one roll.
    Roll = "roll", Stays, [("m", 0, Ratio)];
    /// Position of a fiducial mark in the frame of its camera.
    Fiducial = "fiducial", Stays, [("x", 0, InImage), ("y", 1, InImage)];
    /// Two weights of a deformation pattern.
    Pattern = "pattern", Stays, [("first", 0, InImage), ("second", 1, InImage)];
    /// Scales and obliqueness of a scanner or comparator.
    Scanner = "scanner", Stays, [("Sx", 0, Ratio), ("Sy", 1, Ratio), ("alpha", 2, Angle)];
    /// Three polynomial coefficients of a scanner; six triples describe x, then six describe y.
    ScannerCurve = "scanner curve", Stays, [("first", 0, InImage), ("second", 1, InImage), ("third", 2, InImage)];
    /// Delay d of the clock of a receiver relative to the clock of a trajectory.
    Clock = "clock", Stays, [("offset", 0, Time)];
}

impl CommonKind {
    /// Returns the type with a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// Returns the free components among the six.
    fn components(self) -> impl Iterator<Item = usize> {
        self.unknowns().iter().map(|&(_, component, _)| component)
    }

    /// Returns true if the position is given in coordinates of the object space.
    fn is_place(self) -> bool {
        self.moves() == Moves::Along
    }

    /// Returns true if rotations are among the parameters.
    fn rotates(self) -> bool {
        self.components().any(|component| component > 2)
    }

    /// Returns true if the type is invariant to rotations about the third of its own axes; the two others are arbitrary.
    fn is_axis(self) -> bool {
        matches!(self, Self::Line | Self::Plane)
    }
}

/// Initial values and prior information of a shared parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Common {
    /// Type.
    pub kind: CommonKind,
    /// Initial (and, if weighted, observed) position. Levels, planes and lines have coordinates of the object space, other types components
    /// in their axes.
    pub position: [f64; 3],
    /// Rotation with its own axes as columns. Planes and lines use X, Y, Z or, in geographic space, local east, north and up. It is the
    /// identity for types without rotation parameters.
    pub attitude: Matrix3,
    /// Standard deviations of the components: infinite free, zero fixed.
    pub sd: Vec<f64>,
}

impl Common {
    /// Returns a shared parameter with a position only.
    pub fn vector(kind: CommonKind, position: [f64; 3], sd: &[f64]) -> Self {
        Self { kind, position, attitude: Matrix3::identity(), sd: sd.to_vec() }
    }

    /// Returns true if all components are fixed.
    pub fn is_held(&self) -> bool {
        self.sd.iter().all(|&sd| sd == 0.0)
    }
}

/// A shared parameter in the Cartesian axes of an adjustment.
#[derive(Debug, Clone)]
pub(super) struct CartesianCommon {
    pub kind: CommonKind,
    space: ObjectSpace,
    origin: [f64; 3],
    /// Given position; coordinates of the object space are relative to the origin.
    coordinates: [f64; 3],
    given: Pose,
    /// Axes of the given rotation, as rows.
    axes: Matrix3,
    /// Number of active observations and images that depend on it.
    pub uses: usize,
}

/// A similarity transformation: displacement of a position, rotation vector and scale factor.
pub(super) struct SimilarityMotion<'a> {
    /// Displacement of a position.
    pub displacement: &'a dyn Fn(&Vector3) -> Vector3,
    /// Rotation vector.
    pub turn: Vector3,
    /// Scale factor.
    pub scale: f64,
}

impl CartesianCommon {
    /// Converts a shared parameter. Rows of `vertical` are the local axes at the centre of the photos, X, Y, Z in rectangular space.
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

    /// Returns position and rotation, as in [`Common`], at given values.
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

    /// Returns the state at given values of the parameters.
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

    /// Returns the parameters for a given offset and rotation.
    fn unknowns(&self, offset: &Vector3, attitude: &Matrix3) -> Vec<f64> {
        let turn = self.given.attitude.tr_mul(attitude);
        let turn = if self.kind.is_axis() {
            // The shortest rotation from the old to the new third axis.
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
    pub(super) fn change(&self, state: &CommonState, motion: &SimilarityMotion<'_>) -> Vec<f64> {
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
    pub(super) fn moved(&self, state: &CommonState, motion: &SimilarityMotion<'_>) -> Vec<f64> {
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

/// A shared parameter at given values.
#[derive(Debug, Clone)]
pub struct CommonState {
    kind: CommonKind,
    height: f64,
    base: Vector3,
    offset: Vector3,
    /// Rotation vector r.
    rotation: Vector3,
    attitude: Matrix3,
    /// Columns: rotation about the own axes per unit of each component of r.
    turns: Matrix3,
}

impl CommonState {
    /// Returns the position as a vector: for a lever arm, shift, drift, instrument, sensor or coefficient.
    pub fn vector(&self) -> Vector3 {
        self.base + self.offset
    }

    /// Returns the rotation R with the own axes as columns; for shifts and drifts, the axes of their components.
    pub fn attitude(&self) -> &Matrix3 {
        &self.attitude
    }

    /// Returns position and rotation of a sensor.
    pub fn pose(&self) -> Pose {
        Pose { position: self.vector(), attitude: self.attitude }
    }

    /// Returns the height of a level.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Returns the coordinates of a position in the own axes, R^T (P - p_0), relative to the given position p_0.
    pub fn own(&self, place: &Vector3) -> Vector3 {
        self.attitude.tr_mul(&(place - self.base))
    }

    /// Returns the values of the parameters.
    pub fn unknowns(&self) -> impl Iterator<Item = f64> {
        let six = [self.offset.data.0[0], self.rotation.data.0[0]].concat();
        self.kind.components().map(move |component| six[component])
    }

    /// Returns the given position, the origin of the offsets.
    pub fn given(&self) -> Vector3 {
        self.base
    }

    /// Returns the estimated offsets.
    pub fn offset(&self) -> &Vector3 {
        &self.offset
    }

    /// Returns the position for offsets in the own axes.
    fn place(&self) -> Vector3 {
        self.base + self.attitude * self.offset
    }

    /// Returns the partials of parameters with rotations about the own axes (rows) by the parameters. Offsets of a line rotate with its
    /// axes: their rows describe the displacement along them.
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

    /// Returns, for each parameter, the changes of the offset and of the rotation about the own axes per unit.
    pub(super) fn steps(&self) -> impl Iterator<Item = (Vector3, Vector3)> {
        self.kind.components().map(|component| match component.checked_sub(3) {
            None => (Vector3::ith(component, 1.0), Vector3::zeros()),
            Some(turn) => (Vector3::zeros(), self.turns.column(turn).into()),
        })
    }
}

/// Rotates an attitude by a rotation vector about the axes of the object space.
fn turned(attitude: &Matrix3, by: &Vector3) -> Matrix3 {
    angle_axis_rotation(by) * attitude
}
