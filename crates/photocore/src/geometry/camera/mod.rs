//! Camera models: from a direction in the photo's axes to an image position, with all partials.
//!
//! Each camera is a type that implements [`CameraModel`] in a file of its own or of its family, and a line of `cameras!` below.

pub mod backward;
pub(super) mod inverse;
mod model;
mod projections;
mod radial_tangential;

use std::sync::Arc;

use super::rotation::Vector3;

pub use brown::{BrownCorrection, BrownTerms};
pub use inverse::{Matrix2, RadialLimit};
pub use measured::Measured;
pub use model::{CameraModel, Image, LensDirection, ModelFacts, Patch, Unit, Window};
pub use orthogonal::{Ebner12, Gruen44, Orthogonal, OrthogonalSet};

macro_rules! cameras {
    ($d:tt $($file:ident::$name:ident;)* $([$family:ident] { $($member:ident;)* })*) => {
        $(mod $file;
        pub use $file::$name;)*
        $(mod $family;
        pub use $family::{$($member),*};)*
        cameras! { @kinds $d $($name)* $($($member)*)* }
    };
    (@kinds $d:tt $($name:ident)*) => {
        /// Camera of any model.
        // A boxed variant would add a pointer lookup per image for the 48 numbers of the largest model.
        #[allow(clippy::large_enum_variant)]
        #[derive(Debug, Clone, PartialEq)]
        pub enum Camera {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Camera {
            fn from(camera: $name) -> Self {
                Self::$name(camera)
            }
        })*

        impl Camera {
            /// Names of the models.
            pub const NAMES: &'static [&'static str] = &[$(<$name as CameraModel>::NAME),*];

            /// Returns the description of a model; None for an unknown name.
            pub fn model(name: &str) -> Option<ModelFacts> {
                fn facts<C: CameraModel>() -> ModelFacts {
                    ModelFacts { formula: C::FORMULA, parameters: C::PARAMETERS, constants: C::CONSTANTS, lens: C::LENS, down: C::DOWN }
                }
                $(if name == <$name as CameraModel>::NAME {
                    return Some(facts::<$name>());
                })*
                None
            }

            /// Returns the camera of a model by name; None for an unknown name or a wrong number of parameters.
            pub fn named(name: &str, parameters: &[f64]) -> Option<Self> {
                $(if name == <$name as CameraModel>::NAME {
                    return Some(<$name as CameraModel>::with_parameters(parameters.try_into().ok()?).into());
                })*
                None
            }
        }

        /// Evaluates an expression with the camera as its own type, compiled per model: calls are inlined and the match is the only
        /// dispatch.
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
    equirectangular::Equirectangular;
    brown_forward::BrownForward;
    plate::Plate;
    on_comparator::OnComparator;
    opencv_tilted::OpencvTilted;
    cahvor::Cahvor;
    splined_stereographic::SplinedStereographic;
    [brown] {
        Brown;
        BrownAffinityAfter;
    }
    [orthogonal] {
        Ebner;
        Gruen;
    }
    [measured] {
        BrownMeasured;
        BrownAffinityAfterMeasured;
        EbnerMeasured;
        GruenMeasured;
        OnComparatorMeasured;
    }
    [vision] {
        SimplePinhole;
        Pinhole;
        SimpleRadial;
        Radial;
        Bal;
        Opencv;
        FullOpencv;
        OpencvPinhole;
        Fov;
        SimpleFisheye;
        Fisheye;
        SimpleRadialFisheye;
        RadialFisheye;
        OpencvFisheye;
        OpencvFisheyeSkew;
        ThinPrismFisheye;
        RadTanThinPrismFisheye;
        SimpleDivision;
        Division;
        Equisolid;
        Stereographic;
        Eucm;
        AgisoftFrame;
        AgisoftFisheye;
        AgisoftFrameP4;
        AgisoftFisheyeP4;
    }
}

impl Camera {
    /// Returns the name of the model.
    pub fn name(&self) -> &'static str {
        fn of<C: CameraModel>(_: &C) -> &'static str {
            C::NAME
        }
        each_camera!(self, camera => of(camera))
    }

    /// Returns the names and units of the parameters, in order.
    pub fn parameter_names(&self) -> &'static [(&'static str, Unit)] {
        fn of<C: CameraModel>(_: &C) -> &'static [(&'static str, Unit)] {
            C::PARAMETERS
        }
        each_camera!(self, camera => of(camera))
    }

    /// Returns the number of constants; they are the last parameters.
    pub fn constants(&self) -> usize {
        fn of<C: CameraModel>(_: &C) -> usize {
            C::CONSTANTS
        }
        each_camera!(self, camera => of(camera))
    }

    /// Returns the camera with other parameters; None if their number differs.
    pub fn with_parameters(&self, parameters: &[f64]) -> Option<Self> {
        each_camera!(self, camera => Some(camera.with_others(parameters.try_into().ok()?).into()))
    }

    /// See [`CameraModel::knots`].
    pub fn knots(&self) -> Option<&[[f64; 2]]> {
        each_camera!(self, camera => camera.knots())
    }

    /// See [`CameraModel::with_knots`].
    pub fn with_knots(&self, knots: Arc<[[f64; 2]]>) -> Option<Self> {
        each_camera!(self, camera => camera.with_knots(knots).map(Into::into))
    }

    /// See [`CameraModel::patch`].
    pub fn patch(&self, u: &Vector3) -> Option<Patch> {
        each_camera!(self, camera => camera.patch(u))
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> Vec<f64> {
        each_camera!(self, camera => CameraModel::parameters(camera).as_ref().to_vec())
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
        each_camera!(self, camera => camera.linearize(u).listed())
    }

    /// See [`CameraModel::compare`].
    pub fn compare(&self, u: &Vector3, measured: [f64; 2]) -> ([f64; 2], Image<Vec<f64>>) {
        each_camera!(self, camera => {
            let (residual, image) = camera.compare(u, measured);
            (residual, image.listed())
        })
    }

    /// See [`CameraModel::direction`].
    pub fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
        each_camera!(self, camera => camera.direction(xy))
    }

    /// See [`CameraModel::faces`].
    pub fn faces(&self, u: &Vector3) -> bool {
        each_camera!(self, camera => camera.faces(u))
    }

    /// See [`CameraModel::folds`].
    pub fn folds(&self, u: &Vector3, measured: [f64; 2]) -> bool {
        each_camera!(self, camera => camera.folds(u, measured))
    }

    /// See [`CameraModel::radius`].
    pub fn radius(&self, u: &Vector3, measured: [f64; 2]) -> f64 {
        each_camera!(self, camera => camera.radius(u, measured))
    }

    /// See [`CameraModel::fold`].
    pub fn fold(&self) -> f64 {
        each_camera!(self, camera => camera.fold())
    }

    /// See [`CameraModel::correction`].
    pub fn correction(&self, measured: [f64; 2]) -> Option<[f64; 2]> {
        each_camera!(self, camera => camera.correction(measured))
    }

    /// See [`CameraModel::radial_limit`].
    pub fn radial_limit(&self) -> Option<RadialLimit> {
        each_camera!(self, camera => camera.radial_limit())
    }
}
