//! What images pass beside pose, point and camera: the figure of a target, and whatever else has common unknowns that the computed
//! positions of images step with.
//!
//! Each kind is a file with a type that implements [`PassageModel`], and a line of `kinds!` below.

use std::ops::Deref;

use smallvec::SmallVec;

use super::commons::{CommonKind, CommonState};
use super::film::{FilmAt, FilmOf};
use crate::geometry::camera::Window;
use crate::geometry::{Camera, ObjectSpace, Vector3};

/// Something that images pass.
pub trait PassageModel {
    /// The common unknowns that it has, with their types.
    fn unknowns(&self) -> Vec<(usize, CommonKind)>;

    /// The photo whose images pass it, all of them, where there is one.
    fn photo(&self) -> Option<usize> {
        None
    }

    /// Those of its common unknowns that whatever passes it steps with.
    fn everywhere(&self) -> Vec<usize> {
        vec![]
    }

    /// Whether it is one of a network: points, photos and cameras are there, and such as it may have.
    fn is_of(&self, network: &Facts<'_>) -> bool;
}

/// What passages ask of a network.
pub struct Facts<'a> {
    /// Coordinates of its points.
    pub space: ObjectSpace,
    /// Of each point, whether it is given and nothing but images is of it.
    pub given: Vec<bool>,
    /// Its cameras.
    pub cameras: Vec<&'a Camera>,
    /// Of each photo, which camera it has.
    pub photos: Vec<usize>,
}

macro_rules! kinds {
    ($($module:ident::$name:ident;)*) => {
        $(mod $module;
        pub use $module::$name;)*

        /// A passage of any kind.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Passage {
            $(#[doc = concat!("See [`", stringify!($name), "`].")] $name($name),)*
        }

        $(impl From<$name> for Passage {
            fn from(passage: $name) -> Self {
                Self::$name(passage)
            }
        })*

        impl Passage {
            /// The passage of the kind of that name, of these common unknowns, points, photos or cameras and numbers; None where there is no
            /// such kind, or they are not as many as it has.
            pub fn from_numbers(kind: &str, commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
                match kind {
                    $($name::NAME => $name::from_numbers(commons, of, numbers).map(Self::from),)*
                    _ => None,
                }
            }
        }

        impl Deref for Passage {
            type Target = dyn PassageModel;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$name(own) => own,)*
                }
            }
        }
    };
}

kinds! {
    figure::Figure;
    knots::Knots;
    scan::Scan;
}

/// The common unknowns that an image steps with, each once.
pub(super) type Own = SmallVec<[usize; 32]>;

/// The passages of a model, by what they belong to; nothing at all where there are none.
#[derive(Debug, Default)]
pub(super) struct Passages {
    figures: Vec<Figure>,
    /// By point of the model: its figure, and its number there.
    of_point: Vec<Option<(usize, usize)>>,
    lenses: Vec<Knots>,
    /// By photo: which of them its camera has.
    of_photo: Vec<Option<usize>>,
    /// By image of the model: the knots that it may step with. None at all before they are known.
    windows: Vec<Option<Window>>,
    scans: Vec<Scan>,
    /// By photo: its scan.
    scan_of: Vec<Option<usize>>,
    /// By image of the model the cell of the pattern where it is; none where there are no patterns of several.
    pub cells: Vec<usize>,
}

impl Passages {
    /// Those of a network of so many points, of which these take part, and of photos with these cameras.
    pub fn new(
        passages: &[Passage],
        (points, count): (&[usize], usize),
        cameras: impl Iterator<Item = usize>,
    ) -> Self {
        let mut own = Self::default();
        if passages.is_empty() {
            return own;
        }
        let cameras: Vec<usize> = cameras.collect();
        own.scan_of = vec![None; cameras.len()];
        let mut of_point = vec![None; count];
        for passage in passages {
            match passage {
                Passage::Figure(figure) => {
                    let number = own.figures.len();
                    let places = figure.points.iter().enumerate();
                    places.for_each(|(k, &point)| of_point[point] = Some((number, k)));
                    own.figures.push(figure.clone());
                }
                Passage::Knots(knots) => own.lenses.push(knots.clone()),
                Passage::Scan(scan) => {
                    own.scan_of[scan.photo] = Some(own.scans.len());
                    own.scans.push(scan.clone());
                }
            }
        }
        own.of_point = points.iter().map(|&point| of_point[point]).collect();
        let lens = |camera: usize| own.lenses.iter().position(|lens| lens.camera == camera);
        own.of_photo = cameras.into_iter().map(lens).collect();
        own
    }

    pub fn is_empty(&self) -> bool {
        self.figures.is_empty() && self.lenses.is_empty() && self.scans.is_empty()
    }

    /// Whether there are points that are shifted.
    pub fn have_figures(&self) -> bool {
        !self.figures.is_empty()
    }

    /// The film of a photo.
    pub fn film(&self, photo: usize) -> Option<&FilmOf> {
        Some(&self.scans[(*self.scan_of.get(photo)?)?].film)
    }

    /// The films of all photos at given values of the common unknowns; nothing at all where there are none.
    pub fn films(&self, commons: &[CommonState]) -> Vec<Option<FilmAt>> {
        if self.scans.is_empty() {
            return vec![];
        }
        let at = |photo| Some(self.film(photo)?.at(&|common| commons.get(common).map(CommonState::vector)));
        (0..self.scan_of.len()).map(at).collect()
    }

    /// The common unknowns of films, with their photos.
    pub fn own(&self) -> impl Iterator<Item = (usize, usize)> {
        self.scans.iter().flat_map(|own| own.unknowns().into_iter().map(|(common, _)| (common, own.photo)))
    }

    /// The cell of the pattern where an image is.
    pub fn cell(&self, image: usize) -> usize {
        self.cells.get(image).copied().unwrap_or(0)
    }

    /// The lenses whose knots are unknown.
    pub fn lenses(&self) -> &[Knots] {
        &self.lenses
    }

    /// Which of them a photo has.
    pub fn lens(&self, photo: usize) -> Option<usize> {
        *self.of_photo.get(photo)?
    }

    /// Says which knots each image may step with.
    pub fn open(&mut self, windows: Vec<Option<Window>>) {
        self.windows = windows;
    }

    /// The knots that an image may step with.
    pub fn window(&self, image: usize) -> Option<&Window> {
        self.windows.get(image)?.as_ref()
    }

    /// The figure of a point, and its number there.
    pub fn figure(&self, point: usize) -> Option<(&Figure, usize)> {
        let (figure, k) = *self.of_point.get(point)?.as_ref()?;
        Some((&self.figures[figure], k))
    }

    /// How far a point is from where it is given, common unknowns being these vectors.
    pub fn shift(&self, point: usize, common: impl Fn(usize) -> Vector3) -> Vector3 {
        self.figure(point).map_or_else(Vector3::zeros, |(own, k)| own.shift(k, &common(own.common)))
    }

    /// The common unknowns that the image of a point by a photo, with a camera of so many knots in a row, steps with.
    pub fn commons(&self, (image, photo, point): (usize, usize, usize), columns: usize) -> Own {
        let mut all: Own = self.figure(point).map(|(own, _)| own.common).into_iter().collect();
        if let (Some(lens), Some(window)) = (self.lens(photo), self.window(image)) {
            all.extend(window.knots(columns).map(|knot| self.lenses[lens].commons[knot]));
        }
        if let Some(film) = self.film(photo) {
            all.extend(film.commons(self.cell(image)).into_iter().map(|(own, _)| own));
        }
        all
    }
}
