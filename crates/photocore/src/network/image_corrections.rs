//! Corrections applied to an image after projection: board deformation, spline knots, film. Each depends on shared parameters.

use nalgebra::Matrix3x2;
use smallvec::SmallVec;

use super::commons::{CommonKind, CommonState};
use super::film::{FilmAt, FilmOf};
use crate::geometry::camera::Window;
use crate::geometry::{Camera, ObjectSpace, Vector3};

/// Properties of a network that corrections require.
pub(super) struct Requirements<'a> {
    /// Coordinate system of its points.
    pub space: ObjectSpace,
    /// Whether each point is fixed and has images only.
    pub given: Vec<bool>,
    /// Its cameras.
    pub cameras: Vec<&'a Camera>,
    /// Camera of each photo.
    pub photos: Vec<usize>,
}

/// A correction of image positions.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageCorrection {
    /// Points of a bent board.
    Figure(Figure),
    /// Lens with free knots of its spline.
    Knots(Knots),
    /// Scanned film or measured plate.
    Scan(Scan),
}

impl ImageCorrection {
    /// Returns the correction of a named type from shared parameters, points, photos or cameras, and numbers. None for an unknown
    /// name or wrong counts.
    pub fn from_numbers(kind: &str, commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        match kind {
            "figure" => Figure::from_numbers(commons, of, numbers).map(Self::Figure),
            "knots" => Knots::from_numbers(commons, of, numbers).map(Self::Knots),
            "scan" => Scan::from_numbers(commons, of, numbers).map(Self::Scan),
            _ => None,
        }
    }

    /// Returns its shared parameters, with their types.
    pub fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        match self {
            Self::Figure(figure) => vec![(figure.common, CommonKind::Bend)],
            Self::Knots(knots) => knots.commons.iter().map(|&common| (common, CommonKind::Knot)).collect(),
            Self::Scan(scan) => scan.unknowns(),
        }
    }

    /// Returns the photo if it applies to all images of one photo.
    pub fn photo(&self) -> Option<usize> {
        if let Self::Scan(scan) = self { Some(scan.photo) } else { None }
    }

    /// Returns its shared parameters on which every corrected image depends: those of a film, except the weights of a pattern of several
    /// cells.
    pub fn everywhere(&self) -> Vec<usize> {
        let Self::Scan(Scan { film, .. }) = self else { return vec![] };
        let all = self.unknowns().into_iter().map(|(own, _)| own);
        all.filter(|own| !(film.has_cells() && film.weights.contains(own))).collect()
    }

    /// Returns true if it fits a network: its points, photos and cameras exist and have valid types.
    pub(super) fn is_of(&self, network: &Requirements<'_>) -> bool {
        match self {
            // Points with additional observations would also make these depend on w.
            Self::Figure(Figure { points, shifts, .. }) => {
                network.space == ObjectSpace::Rectangular
                    && points.len() == shifts.len()
                    && points.iter().all(|&point| network.given.get(point) == Some(&true))
                    && shifts.iter().flatten().all(|value| value.is_finite())
            }
            Self::Knots(Knots { camera, commons }) => network.cameras.get(*camera).is_some_and(|&camera| {
                matches!(camera, Camera::SplinedStereographic(_))
                    && camera.knots().is_some_and(|own| own.len() == commons.len())
            }),
            // The partials of lenses with knots require images in the camera.
            Self::Scan(Scan { photo, film }) => {
                let camera = network.photos.get(*photo).map(|&camera| network.cameras[camera]);
                camera.is_some_and(|own| own.knots().is_none()) && film.is_sound()
            }
        }
    }
}

/// Points at their given positions plus `w_1 e_1 + w_2 e_2`: w is a shared parameter, and each point has a given e. For a bent chessboard,
/// w is the deflection of its centre along x and y (mrcal: two parabolas).
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Shared parameter w.
    pub common: usize,
    /// Points with fixed coordinates, in rectangular space.
    pub points: Vec<usize>,
    /// e_1 and e_2 of each point, as columns.
    pub shifts: Vec<Matrix3x2<f64>>,
}

impl Figure {
    /// Indices: w, points; numbers: e_1 and e_2 of each point.
    fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[common], (shifts, [])) = (commons, numbers.as_chunks::<6>()) else { return None };
        let shifts: Vec<_> = shifts.iter().map(|own| Matrix3x2::from_column_slice(own)).collect();
        (shifts.len() == of.len()).then(|| Self { common, points: of.to_vec(), shifts })
    }

    /// Returns the displacement of its k-th point.
    pub(super) fn shift(&self, k: usize, w: &Vector3) -> Vector3 {
        self.shifts[k] * w.xy()
    }
}

/// Knots of a camera with a spline ([`crate::geometry::camera::SplinedStereographic`]), each a shared parameter: an image depends only on
/// neighbouring knots.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    /// Camera.
    pub camera: usize,
    /// Knots, row by row.
    pub commons: Vec<usize>,
}

impl Knots {
    /// Indices: knots, camera.
    fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[camera], []) = (of, numbers) else { return None };
        Some(Self { camera, commons: commons.to_vec() })
    }
}

/// Images of this photo are scanner readings: camera image -> film -> scanner.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Photo.
    pub photo: usize,
    /// Film of the photo.
    pub film: FilmOf,
}

impl Scan {
    /// See [`FilmOf::from_numbers`].
    fn from_numbers(commons: &[usize], of: &[usize], numbers: &[f64]) -> Option<Self> {
        let &[photo] = of else { return None };
        Some(Self { photo, film: FilmOf::from_numbers(commons, numbers)? })
    }

    fn unknowns(&self) -> Vec<(usize, CommonKind)> {
        let film = self.film.commons(0);
        film.into_iter().chain(self.film.weights.iter().map(|&own| (own, CommonKind::Pattern))).collect()
    }
}

/// Distinct shared parameters of an image.
pub(super) type ImageCommons = SmallVec<[usize; 32]>;

/// Corrections of a model, indexed by their objects; empty without corrections.
#[derive(Debug, Default)]
pub(super) struct ImageCorrections {
    figures: Vec<Figure>,
    /// Figure of each point of the model, and the index of the point there.
    of_point: Vec<Option<(usize, usize)>>,
    lenses: Vec<Knots>,
    of_photo: Vec<Option<usize>>,
    /// Active knots of each image of the model; empty before they are determined.
    windows: Vec<Option<Window>>,
    scans: Vec<Scan>,
    scan_of: Vec<Option<usize>>,
    /// Pattern cell of each image of the model; empty if all patterns consist of one cell.
    pub cells: Vec<usize>,
}

impl ImageCorrections {
    /// Returns the corrections of a network of `count` points, of which `points` are active, and photos with these cameras.
    pub fn new(
        image_corrections: &[ImageCorrection],
        (points, count): (&[usize], usize),
        cameras: impl Iterator<Item = usize>,
    ) -> Self {
        let mut own = Self::default();
        if image_corrections.is_empty() {
            return own;
        }
        let cameras: Vec<usize> = cameras.collect();
        own.scan_of = vec![None; cameras.len()];
        let mut of_point = vec![None; count];
        for passage in image_corrections {
            match passage {
                ImageCorrection::Figure(figure) => {
                    let number = own.figures.len();
                    let places = figure.points.iter().enumerate();
                    places.for_each(|(k, &point)| of_point[point] = Some((number, k)));
                    own.figures.push(figure.clone());
                }
                ImageCorrection::Knots(knots) => own.lenses.push(knots.clone()),
                ImageCorrection::Scan(scan) => {
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

    /// Returns true if some points are displaced.
    pub fn have_figures(&self) -> bool {
        !self.figures.is_empty()
    }

    pub fn film(&self, photo: usize) -> Option<&FilmOf> {
        Some(&self.scans[(*self.scan_of.get(photo)?)?].film)
    }

    /// Returns the films of all photos at given values of the shared parameters; empty without films.
    pub fn films(&self, commons: &[CommonState]) -> Vec<Option<FilmAt>> {
        if self.scans.is_empty() {
            return vec![];
        }
        let at = |photo| Some(self.film(photo)?.at(&|common| commons.get(common).map(CommonState::vector)));
        (0..self.scan_of.len()).map(at).collect()
    }

    /// Returns the shared parameters of films, with their photos.
    pub fn own(&self) -> impl Iterator<Item = (usize, usize)> {
        self.scans.iter().flat_map(|own| own.unknowns().into_iter().map(|(common, _)| (common, own.photo)))
    }

    pub fn cell(&self, image: usize) -> usize {
        self.cells.get(image).copied().unwrap_or(0)
    }

    /// Returns the lenses with free knots.
    pub fn lenses(&self) -> &[Knots] {
        &self.lenses
    }

    pub fn lens(&self, photo: usize) -> Option<usize> {
        *self.of_photo.get(photo)?
    }

    /// Sets the active knots of each image.
    pub fn open(&mut self, windows: Vec<Option<Window>>) {
        self.windows = windows;
    }

    /// Returns the active knots of an image.
    pub fn window(&self, image: usize) -> Option<&Window> {
        self.windows.get(image)?.as_ref()
    }

    /// Returns the figure of a point, and the index of the point there.
    pub fn figure(&self, point: usize) -> Option<(&Figure, usize)> {
        let (figure, k) = *self.of_point.get(point)?.as_ref()?;
        Some((&self.figures[figure], k))
    }

    /// Returns the displacement of a point, given the vectors of shared parameters.
    pub fn shift(&self, point: usize, common: impl Fn(usize) -> Vector3) -> Vector3 {
        self.figure(point).map_or_else(Vector3::zeros, |(own, k)| own.shift(k, &common(own.common)))
    }

    /// Returns the shared parameters of an image; `columns` is the number of knots per row of its camera.
    pub fn commons(&self, (image, photo, point): (usize, usize, usize), columns: usize) -> ImageCommons {
        let mut all: ImageCommons = self.figure(point).map(|(own, _)| own.common).into_iter().collect();
        if let (Some(lens), Some(window)) = (self.lens(photo), self.window(image)) {
            all.extend(window.knots(columns).map(|knot| self.lenses[lens].commons[knot]));
        }
        if let Some(film) = self.film(photo) {
            all.extend(film.commons(self.cell(image)).into_iter().map(|(own, _)| own));
        }
        all
    }
}
