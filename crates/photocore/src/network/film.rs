//! Film of a photo in a network: its shared parameters and constants.

use nalgebra::Matrix2x3;
use smallvec::SmallVec;

use super::commons::CommonKind;
use crate::geometry::Vector3;
use crate::geometry::correction::{COEFFICIENTS, Correction};
use crate::geometry::film::{Bend, Deformation, Film, Functions, Grid, Pattern, Reading, Scanner};

/// Number of shared parameters with polynomial coefficients of a scanner.
const CURVES: usize = 2 * COEFFICIENTS / 3;

/// Film or plate of a photo, by indices of shared parameters of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmOf {
    /// Position and rotation on the scanner, a [`CommonKind::FilmPlacement`].
    pub placement: usize,
    /// Affine deformation, a [`CommonKind::FilmSize`].
    pub size: usize,
    /// Nonaffine deformation, a [`CommonKind::FilmBend`].
    pub bend: Option<usize>,
    /// Whether `bend` is g (projective) instead of h (bilinear).
    pub projective: bool,
    /// A [`CommonKind::Roll`] whose m is added to the m of the photo.
    pub roll: Option<usize>,
    /// Scanner parameters, a [`CommonKind::Scanner`].
    pub scanner: usize,
    /// Polynomial coefficients of the scanner: six of [`CommonKind::ScannerCurve`], or none.
    pub curves: Vec<usize>,
    /// Units and axes of the readings.
    pub readings: Readings,
    /// Functions of its deformation.
    pub pattern: Option<Pattern>,
    /// Weights of these functions in pairs: [`CommonKind::Pattern`].
    pub weights: Vec<usize>,
    /// Whether the film is mirrored (emulsion side).
    pub mirrored: bool,
}

/// Units and axes of scanner readings, which are constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Readings {
    /// Unit of readings in mm.
    pub pitch: f64,
    /// Origin o1, o2.
    pub origin: [f64; 2],
    /// Whether the second coordinate points down.
    pub down: bool,
    /// Half ranges hx, hy of the polynomials.
    pub half_range: [f64; 2],
}

impl Readings {
    /// Returns the scanner with the first correction parameters given; `curved` includes polynomials.
    fn scanner(&self, parameters: impl Iterator<Item = f64>, curved: bool) -> Scanner {
        let Self { pitch, origin, down, half_range } = *self;
        let mut all = Correction::NONE.parameters();
        all.iter_mut().zip(parameters).for_each(|(own, given)| *own = given);
        let correction = Correction { half_range, ..Correction::NONE }.with_parameters(&all);
        Scanner::new((correction, curved), pitch, origin, down)
    }
}

/// Film of a photo at given parameter values.
#[derive(Debug, Clone)]
pub struct FilmAt {
    film: Film,
    scanner: Scanner,
    pattern: Option<(Pattern, Vec<[f64; 2]>)>,
}

/// A reading, and the pattern functions from which it was computed.
#[derive(Debug, Clone)]
pub struct Read {
    /// Reading with its partials; NaN outside the range of the scanner.
    pub reading: Reading,
    functions: Functions,
}

impl Default for Read {
    fn default() -> Self {
        Self { reading: Reading::NONE, functions: Functions::new() }
    }
}

impl FilmOf {
    /// Returns a film from indices (in the order of the fields) and numbers. The numbers are mirrored, rows down, pitch, o1, o2, hx, hy; 0,
    /// 1 or 2 for none, h or g; flags of roll and curves; 0 to 3 for no pattern, quadratic, Ebner or grid, and the pattern's numbers.
    pub fn from_numbers(commons: &[usize], numbers: &[f64]) -> Option<Self> {
        let (&[mirrored, down, pitch, o1, o2, hx, hy, bend, roll, curves, pattern], own) =
            numbers.split_first_chunk()?;
        let mut commons = commons.iter().copied();
        let (placement, size) = (commons.next()?, commons.next()?);
        let mut take = |count: usize| -> Option<Vec<usize>> {
            let found: Vec<usize> = commons.by_ref().take(count).collect();
            (found.len() == count).then_some(found)
        };
        let one = |number: f64| usize::from(number != 0.0);
        let (of_bend, of_roll) = (take(one(bend))?.pop(), take(one(roll))?.pop());
        let (scanner, curves) = (take(1)?[0], take(CURVES * one(curves))?);
        let pattern = match (pattern, own) {
            (0.0, []) => None,
            (1.0, &[half]) => Some(Pattern::Quadratic { half }),
            (2.0, &[half]) => Some(Pattern::Ebner { half }),
            (3.0, &[x, y, along_x, along_y, columns, rows]) => {
                let nodes = [columns as usize, rows as usize];
                Some(Pattern::Grid(Grid { first: [x, y], spacing: [along_x, along_y], nodes }))
            }
            _ => return None,
        };
        let weights = take(pattern.map_or(0, |own| own.count() / 2))?;
        commons.next().is_none().then_some(Self {
            placement,
            size,
            bend: of_bend,
            projective: bend == 2.0,
            roll: of_roll,
            scanner,
            curves,
            readings: Readings { pitch, origin: [o1, o2], down: down != 0.0, half_range: [hx, hy] },
            pattern,
            weights,
            mirrored: mirrored != 0.0,
        })
    }

    /// Returns true if all constants are valid.
    pub fn is_sound(&self) -> bool {
        let Readings { pitch, origin, half_range, .. } = &self.readings;
        let ranges = half_range.iter().chain([pitch]).all(|&own| own > 0.0 && own.is_finite());
        let pattern = self.pattern.is_none_or(|pattern| match pattern {
            Pattern::Quadratic { half } | Pattern::Ebner { half } => half > 0.0 && half.is_finite(),
            Pattern::Grid(grid) => {
                grid.spacing.iter().all(|&own| own > 0.0 && own.is_finite())
                    && grid.first.iter().all(|own| own.is_finite())
                    && grid.nodes.iter().all(|&nodes| nodes > 1)
            }
        });
        ranges && pattern && origin.iter().all(|own| own.is_finite())
    }

    /// Returns true if its pattern consists of several cells.
    pub(super) fn has_cells(&self) -> bool {
        matches!(self.pattern, Some(Pattern::Grid(_)))
    }

    /// Returns the pattern cell of a position.
    pub fn cell(&self, place: [f64; 2]) -> usize {
        self.pattern.map_or(0, |pattern| pattern.cell(place))
    }

    /// Returns the shared parameters of a reading in a pattern cell; [`Self::partials`] uses indices into this list.
    pub(super) fn commons(&self, cell: usize) -> SmallVec<[(usize, CommonKind); 16]> {
        let mut all = SmallVec::new();
        all.push((self.placement, CommonKind::FilmPlacement));
        all.push((self.size, CommonKind::FilmSize));
        all.extend(self.bend.map(|own| (own, CommonKind::FilmBend)));
        all.extend(self.roll.map(|own| (own, CommonKind::Roll)));
        all.push((self.scanner, CommonKind::Scanner));
        all.extend(self.curves.iter().map(|&own| (own, CommonKind::ScannerCurve)));
        let pairs = self.pattern.map(|pattern| pattern.pairs(cell)).unwrap_or_default();
        all.extend(pairs.into_iter().map(|pair| (self.weights[pair], CommonKind::Pattern)));
        all
    }

    /// Returns the film at given values of the shared parameters; None for values that are not required.
    pub fn at(&self, common: &dyn Fn(usize) -> Option<Vector3>) -> FilmAt {
        let vector = |own: usize| common(own).map_or([0.0; 3], |own| own.into());
        let mut size = vector(self.size);
        size[0] += self.roll.map_or(0.0, |roll| vector(roll)[0]);
        let bend = self.bend.map_or(Bend::Flat, |own| {
            let [first, second, _] = vector(own);
            if self.projective { Bend::Projective([first, second]) } else { Bend::Bilinear([first, second]) }
        });
        let parameters = std::iter::once(&self.scanner).chain(&self.curves).flat_map(|&own| vector(own));
        let scanner = self.readings.scanner(parameters, !self.curves.is_empty());
        let pair = |&own: &usize| {
            let [first, second, _] = vector(own);
            [first, second]
        };
        FilmAt {
            film: Film::new(self.mirrored, vector(self.placement), size, bend),
            scanner,
            pattern: self.pattern.map(|pattern| (pattern, self.weights.iter().map(pair).collect())),
        }
    }

    /// Adds the partials of a reading by the offset of each shared parameter of [`Self::commons`].
    pub(super) fn partials(&self, read: &Read, mut add: impl FnMut(usize, &Matrix2x3<f64>)) {
        let Read { reading, functions } = read;
        let three = |rows: [&[f64]; 2]| Matrix2x3::from_fn(|row, k| rows[row].get(k).copied().unwrap_or(0.0));
        let mut slot = 0;
        let mut next = |by: &Matrix2x3<f64>| {
            add(slot, by);
            slot += 1;
        };
        let [x, y] = &reading.by_film;
        next(&three([&x[..3], &y[..3]]));
        next(&three([&x[3..], &y[3..]]));
        if self.bend.is_some() {
            next(&three([&reading.by_bend[0], &reading.by_bend[1]]));
        }
        if self.roll.is_some() {
            next(&three([&x[3..4], &y[3..4]]));
        }
        let [x, y] = &reading.by_scanner;
        let groups = x.chunks_exact(3).zip(y.chunks_exact(3)).take(1 + self.curves.len());
        groups.for_each(|(x, y)| next(&three([x, y])));
        for own in functions {
            let by = [0, 1].map(|row| reading.by_shift[row][own.axis] * own.value);
            let mut all = Matrix2x3::zeros();
            (0..2).for_each(|row| all[(row, own.weight % 2)] = by[row]);
            add(slot + own.weight / 2, &all);
        }
    }
}

impl FilmAt {
    /// Computes the reading of a position in the camera frame, with the functions of a pattern cell, into existing storage.
    pub fn read(&self, q: [f64; 2], cell: usize, read: &mut Read) {
        let deformation = self.deformation(q, cell, &mut read.functions);
        let reading = self.film.read(q, &deformation, &self.scanner);
        read.reading = reading.unwrap_or(Reading::NONE);
    }

    /// Returns a reading minus the computed reading of a position in the camera frame.
    pub(super) fn missing(&self, q: [f64; 2], cell: usize, reading: [f64; 2]) -> [f64; 2] {
        let deformation = self.deformation(q, cell, &mut Functions::new());
        let read = self.film.read(q, &deformation, &self.scanner);
        let xy = read.map_or([f64::NAN; 2], |read| read.xy);
        [0, 1].map(|k| reading[k] - xy[k])
    }

    /// Returns the position in the camera frame for a reading.
    pub fn place(&self, reading: [f64; 2], cell: usize) -> Option<[f64; 2]> {
        self.film.place(reading, |q| self.deformation(q, cell, &mut Functions::new()), &self.scanner)
    }

    /// Returns the pattern cell of a reading.
    pub fn cell_of_reading(&self, reading: [f64; 2]) -> usize {
        let place = || self.film.place(reading, |_| Deformation::default(), &self.scanner);
        self.pattern.as_ref().map_or(0, |(pattern, _)| place().map_or(0, |place| pattern.cell(place)))
    }

    /// Returns the number of reading units per mm.
    pub(super) fn units(&self) -> f64 {
        self.scanner.scale()
    }

    /// Returns the deformation D and stores its functions.
    fn deformation(&self, q: [f64; 2], cell: usize, functions: &mut Functions) -> Deformation {
        let Some((pattern, weights)) = &self.pattern else { return Deformation::default() };
        *functions = pattern.at(cell, q);
        let pairs = pattern.pairs(cell);
        Deformation::new(functions, |k| weights[pairs[k / 2]][k % 2])
    }
}
