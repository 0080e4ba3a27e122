//! What images pass beside pose, point and camera: the figure of a target, and whatever else has common unknowns that the computed
//! positions of images step with.
//!
//! Each kind is a file with a type that implements [`PassageModel`], and a line of `kinds!` below.

use std::ops::Deref;

use smallvec::SmallVec;

use super::Network;
use super::commons::{CommonKind, CommonState};
use super::film::{FilmAt, FilmOf};
use crate::geometry::Vector3;

/// Something that images pass.
pub trait PassageModel {
    /// The common unknowns that it has, with their types.
    fn unknowns(&self) -> Vec<(usize, CommonKind)>;

    /// Those of them that are one block, group by group: whatever touches one of a group touches all.
    fn together(&self) -> Vec<Vec<usize>> {
        vec![]
    }

    /// Whether it is one of a network: points, photos and cameras are there, and such as it may have.
    fn is_of(&self, network: &Network) -> bool;
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
    scans: Vec<Scan>,
    /// By photo: its scan.
    of_photo: Vec<Option<usize>>,
    /// By image of the model the cell of the pattern where it is; none where there are no patterns of several.
    pub cells: Vec<usize>,
}

impl Passages {
    /// Those of a network of which these points take part.
    pub fn new(network: &Network, points: &[usize]) -> Self {
        if network.passages.is_empty() {
            return Self::default();
        }
        let mut own = Self::default();
        let mut of_point = vec![None; network.points.len()];
        own.of_photo = vec![None; network.photos.len()];
        for passage in &network.passages {
            match passage {
                Passage::Figure(figure) => {
                    let number = own.figures.len();
                    let places = figure.points.iter().enumerate();
                    places.for_each(|(k, &point)| of_point[point] = Some((number, k)));
                    own.figures.push(figure.clone());
                }
                Passage::Scan(scan) => {
                    own.of_photo[scan.photo] = Some(own.scans.len());
                    own.scans.push(scan.clone());
                }
            }
        }
        own.of_point = points.iter().map(|&point| of_point[point]).collect();
        own
    }

    pub fn is_empty(&self) -> bool {
        self.figures.is_empty() && self.scans.is_empty()
    }

    /// The film of a photo.
    pub fn film(&self, photo: usize) -> Option<&FilmOf> {
        Some(&self.scans[(*self.of_photo.get(photo)?)?].film)
    }

    /// The films of all photos at given values of the common unknowns; nothing at all where there are none.
    pub fn films(&self, commons: &[CommonState]) -> Vec<Option<FilmAt>> {
        if self.scans.is_empty() {
            return vec![];
        }
        let at = |photo| Some(self.film(photo)?.at(&|common| commons.get(common).map(CommonState::vector)));
        (0..self.of_photo.len()).map(at).collect()
    }

    /// The common unknowns of films, with their photos.
    pub fn own(&self) -> impl Iterator<Item = (usize, usize)> {
        self.scans.iter().flat_map(|own| own.unknowns().into_iter().map(|(common, _)| (common, own.photo)))
    }

    /// The cell of the pattern where an image is.
    pub fn cell(&self, image: usize) -> usize {
        self.cells.get(image).copied().unwrap_or(0)
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

    /// The common unknowns that an image of a point by a photo steps with.
    pub fn commons(&self, image: usize, point: usize, photo: usize) -> Own {
        let figure = self.figure(point).map(|(own, _)| own.common);
        let film = self.film(photo).map(|own| own.commons(self.cell(image))).unwrap_or_default();
        figure.into_iter().chain(film.into_iter().map(|(own, _)| own)).collect()
    }
}
