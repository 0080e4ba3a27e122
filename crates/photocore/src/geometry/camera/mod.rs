//! Cameras: from a direction in the photo's axes to an image position, with all partials.
//!
//! Each camera is a file with a type that implements [`CameraModel`], and a line of `cameras!` below.

use super::Vector3;

/// How a camera maps u, a point in the photo's axes (it looks along -z), to image coordinates.
///
/// Only the direction of u counts: (dx/du) u = 0.
pub trait CameraModel: Copy {
    /// Its interior parameters, an array of numbers.
    type Parameters: Copy + AsRef<[f64]> + for<'a> TryFrom<&'a [f64]>;

    /// What the model is called.
    const NAME: &'static str;
    /// What its parameters are called and measured in, in their order.
    const PARAMETERS: &'static [(&'static str, Unit)];
    /// The image of P, a point in the photo's axes, as documents say it.
    const FORMULA: &'static str;

    /// The camera with the given parameters.
    fn with_parameters(parameters: Self::Parameters) -> Self;

    /// Its parameters.
    fn parameters(&self) -> Self::Parameters;

    /// What a small angle near the axis is multiplied by, without sign: the principal distance in the unit of the image.
    fn scale(&self) -> f64;

    /// The image of u; not finite in the plane of the projection centre. What lies behind has the image that the formula gives.
    fn image(&self, u: &Vector3) -> [f64; 2];

    /// The image with its partials.
    fn linearize(&self, u: &Vector3) -> Image<Self::Parameters>;

    /// The unit direction in the photo's axes, in front of the camera, of an image position; None where no direction has it.
    fn direction(&self, xy: [f64; 2]) -> Option<Vector3>;
}

/// What a parameter of a camera is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// The unit of image coordinates.
    Image,
    /// None: a number.
    One,
}

/// An image position and its partials; the first index is x or y.
#[derive(Debug, Clone, Copy)]
pub struct Image<P> {
    /// x, y in the unit of the camera.
    pub xy: [f64; 2],
    /// With respect to u.
    pub by_u: [Vector3; 2],
    /// With respect to the parameters of the camera.
    pub by_parameters: [P; 2],
}

macro_rules! cameras {
    ($d:tt $($file:ident::$name:ident;)*) => {
        $(mod $file;
        pub use $file::$name;)*

        /// A camera of any kind.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Camera {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Camera {
            fn from(camera: $name) -> Self {
                Self::$name(camera)
            }
        })*

        impl Camera {
            /// What the models are called.
            pub const NAMES: &'static [&'static str] = &[$($name::NAME),*];

            /// Formula and parameters of a model, [`CameraModel::FORMULA`] and [`CameraModel::PARAMETERS`]; None where no model has
            /// the name.
            pub fn model(name: &str) -> Option<(&'static str, &'static [(&'static str, Unit)])> {
                match name {
                    $($name::NAME => Some(($name::FORMULA, $name::PARAMETERS)),)*
                    _ => None,
                }
            }

            /// The camera of the model that has the name; None where there is none, or it has not as many parameters.
            pub fn named(name: &str, parameters: &[f64]) -> Option<Self> {
                match name {
                    $($name::NAME => {
                        Some($name::with_parameters(parameters.try_into().ok()?).into())
                    })*
                    _ => None,
                }
            }
        }

        /// An expression of a camera as its own type, compiled for each kind: what it calls is inlined, and nothing is looked up
        /// behind the match.
        macro_rules! each_camera {
            ($d camera:expr, $d own:ident => $d body:expr) => {
                match $d camera {
                    $($crate::geometry::Camera::$name($d own) => $d body,)*
                }
            };
        }
        #[allow(unused_imports)]
        pub(crate) use each_camera;
    };
}

cameras! { $
    perspective::Perspective;
    bal::Bal;
    radial::Radial;
}

impl Camera {
    /// What its model is called.
    pub fn name(&self) -> &'static str {
        fn of<C: CameraModel>(_: &C) -> &'static str {
            C::NAME
        }
        each_camera!(self, camera => of(camera))
    }

    /// What its parameters are called and measured in, in their order.
    pub fn parameter_names(&self) -> &'static [(&'static str, Unit)] {
        fn of<C: CameraModel>(_: &C) -> &'static [(&'static str, Unit)] {
            C::PARAMETERS
        }
        each_camera!(self, camera => of(camera))
    }

    /// A camera of the same kind with other parameters; None unless they are as many.
    pub fn with_parameters(&self, parameters: &[f64]) -> Option<Self> {
        Self::named(self.name(), parameters)
    }

    /// Its parameters.
    pub fn parameters(&self) -> Vec<f64> {
        each_camera!(self, camera => camera.parameters().as_ref().to_vec())
    }

    /// See [`CameraModel::scale`].
    pub fn scale(&self) -> f64 {
        each_camera!(self, camera => camera.scale())
    }

    /// See [`CameraModel::image`].
    pub fn image(&self, u: &Vector3) -> [f64; 2] {
        each_camera!(self, camera => camera.image(u))
    }

    /// See [`CameraModel::linearize`].
    pub fn linearize(&self, u: &Vector3) -> Image<Vec<f64>> {
        each_camera!(self, camera => {
            let Image { xy, by_u, by_parameters } = camera.linearize(u);
            Image { xy, by_u, by_parameters: by_parameters.map(|row| row.as_ref().to_vec()) }
        })
    }

    /// See [`CameraModel::direction`].
    pub fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        each_camera!(self, camera => camera.direction(xy))
    }
}
