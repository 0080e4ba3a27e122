//! Identification of stars: pairs of candidates give similarities from measured to predicted images, and all bright images vote for them.

use std::cmp::Reverse;

use nalgebra::Complex;

type Complex64 = Complex<f64>;

/// Maximum number of raster cells per side, and of hypotheses with a full vote.
const RASTER: f64 = 2000.0;
const VOTED: usize = 4096;
/// Width of a cell, as a fraction of the distance limit between image and star.
const CELL: f64 = 0.5;

/// Similarity of the plane: z -> factor z + shift.
#[derive(Debug, Clone, Copy)]
pub struct Similarity {
    /// Scale and rotation.
    pub factor: Complex64,
    /// Image of zero.
    pub shift: Complex64,
}

impl Similarity {
    /// Returns the similarity that maps two images to two stars; not finite for coincident images.
    fn of_pair(images: [Complex64; 2], stars: [Complex64; 2]) -> Self {
        let factor = (stars[1] - stars[0]) / (images[1] - images[0]);
        Self { factor, shift: stars[0] - factor * images[0] }
    }

    fn at(&self, image: Complex64) -> Complex64 {
        self.factor * image + self.shift
    }
}

/// Conditions for a pair of candidates to form a hypothesis.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Largest difference of the two separations.
    pub tolerance: f64,
    /// Additional tolerance as a fraction of the separation of the images.
    pub stretch: f64,
    /// Lower limit of the separation of images.
    pub least: f64,
    /// Rotation centre of the camera, and its largest displacement; None for any possible rotation.
    pub axis: Option<(Complex64, f64)>,
}

/// Returns the similarities of all pairs of candidates with agreeing separations, in the order of the pairs.
///
/// A candidate is an image and a possible star, by index. Both images and both stars of a pair differ.
///
/// # Panics
///
/// If a candidate has an invalid index.
pub fn hypotheses(
    images: &[Complex64],
    stars: &[Complex64],
    candidates: &[(usize, usize)],
    rule: &Agreement,
) -> Vec<Similarity> {
    let at: Vec<Complex64> = candidates.iter().map(|&(_, star)| stars[star]).collect();
    let (x, y): (Vec<f64>, Vec<f64>) = at.iter().map(|star| (star.re, star.im)).unzip();
    // Bounds of the squared star separations that agree with each image separation.
    let bounds: Vec<(Vec<f64>, Vec<f64>)> = images
        .iter()
        .map(|first| {
            let away: Vec<f64> = images.iter().map(|other| (other - first).norm()).collect();
            candidates.iter().map(|&(other, _)| rule.squares(away[other])).unzip()
        })
        .collect();
    let mut agree = vec![false; candidates.len()];
    let mut found = vec![];
    for (a, &(image, star)) in candidates.iter().enumerate() {
        let ((low, high), rest) = (&bounds[image], a + 1..candidates.len());
        let squares = x[rest.clone()].iter().zip(&y[rest.clone()]);
        let limits = low[rest.clone()].iter().zip(&high[rest.clone()]);
        // All pairs are tested without branches, because few agree.
        for (agree, ((x, y), (low, high))) in agree[rest.clone()].iter_mut().zip(squares.zip(limits)) {
            let square = (x - at[a].re) * (x - at[a].re) + (y - at[a].im) * (y - at[a].im);
            *agree = (square > *low) & (square < *high);
        }
        for b in rest.filter(|&b| agree[b]) {
            let (other, its_star) = candidates[b];
            if its_star != star {
                let pair = Similarity::of_pair([images[image], images[other]], [at[a], at[b]]);
                found.extend(Some(pair).filter(|pair| rule.holds(pair)));
            }
        }
    }
    found
}

impl Agreement {
    /// Returns the bounds of the squared star separation for an image separation; an empty range if this is too small.
    fn squares(&self, images: f64) -> (f64, f64) {
        let off = self.tolerance + self.stretch * images;
        if images <= self.least {
            return (0.0, 0.0);
        }
        (if off > images { -1.0 } else { (images - off).powi(2) }, (images + off).powi(2))
    }

    /// Returns whether the displacement of the rotation centre is within its limit.
    fn holds(&self, pair: &Similarity) -> bool {
        self.axis.is_none_or(|(axis, radius)| (pair.at(axis) - axis).norm() <= radius)
    }
}

/// Raster of the cells near a star.
struct Raster {
    near: Vec<bool>,
    columns: usize,
    rows: usize,
    corner: Complex64,
    size: f64,
}

impl Raster {
    fn new(stars: &[Complex64], limit: f64) -> Self {
        let bound = |of: fn(f64, f64) -> f64, start: f64| {
            Complex64::new(
                stars.iter().map(|star| star.re).fold(start, of),
                stars.iter().map(|star| star.im).fold(start, of),
            )
        };
        let (least, most) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        let extent = most - least;
        let size = (CELL * limit).max(extent.re.max(extent.im) / RASTER);
        let rim = 3.0 * limit * Complex64::new(1.0, 1.0);
        let (corner, far) = (least - rim, (most + rim - (least - rim)) / size);
        let (columns, rows) = (far.re.ceil() as usize + 1, far.im.ceil() as usize + 1);
        let mut raster = Self { near: vec![false; columns * rows], columns, rows, corner, size };
        let steps = (limit / size).ceil() as i64;
        let disc: Vec<(i64, i64)> = (-steps..=steps)
            .flat_map(|dx| (-steps..=steps).map(move |dy| (dx, dy)))
            .filter(|&(dx, dy)| (dx as f64).hypot(dy as f64) * size <= limit)
            .collect();
        for star in stars {
            let cell = (star - corner) / size;
            for (dx, dy) in &disc {
                let index = raster.index(cell.re.floor() as i64 + dx, cell.im.floor() as i64 + dy);
                raster.near[index] = true;
            }
        }
        raster.clear_rim();
        raster
    }

    /// Returns the index of a cell, clamped to the rim.
    fn index(&self, column: i64, row: i64) -> usize {
        let clamped = |k: i64, count: usize| k.clamp(0, count as i64 - 1) as usize;
        clamped(column, self.columns) * self.rows + clamped(row, self.rows)
    }

    /// Clears the rim, which collects all positions outside.
    fn clear_rim(&mut self) {
        let (columns, rows) = (self.columns, self.rows);
        self.near[..rows].fill(false);
        self.near[(columns - 1) * rows..].fill(false);
        for column in 0..columns {
            self.near[column * rows] = false;
            self.near[column * rows + rows - 1] = false;
        }
    }

    /// Counts the images that a similarity maps near a star.
    fn count(&self, similarity: &Similarity, images: &[Complex64]) -> usize {
        let in_cells = Similarity {
            factor: similarity.factor / self.size,
            shift: (similarity.shift - self.corner) / self.size,
        };
        let near = |&image: &Complex64| {
            let cell = in_cells.at(image);
            self.near[self.index(cell.re as i64, cell.im as i64)]
        };
        images.iter().filter(|&image| near(image)).count()
    }
}

/// Returns the similarities with the most images within a limit of a star, counted in a raster, best first.
///
/// For many similarities, the first `makers` images preselect the similarities with a full vote.
pub fn best_voted(
    all: &[Similarity],
    images: &[Complex64],
    stars: &[Complex64],
    makers: usize,
    limit: f64,
    wanted: usize,
) -> Vec<Similarity> {
    if stars.is_empty() {
        return vec![];
    }
    let raster = Raster::new(stars, limit);
    let ranked = |of: &[usize], images: &[Complex64], wanted: usize| {
        let mut ranked: Vec<(Reverse<usize>, usize)> =
            of.iter().map(|&k| (Reverse(raster.count(&all[k], images)), k)).collect();
        ranked.sort_unstable();
        ranked.into_iter().take(wanted).map(|(_, k)| k).collect::<Vec<_>>()
    };
    let mut chosen: Vec<usize> = (0..all.len()).collect();
    if chosen.len() > VOTED {
        chosen = ranked(&chosen, &images[..makers.min(images.len())], VOTED);
    }
    ranked(&chosen, images, wanted).into_iter().map(|k| all[k]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(count: usize) -> Vec<Complex64> {
        let at = |k: usize| 0.618_033_988_749_895 * (k as f64 + 1.0);
        (0..count).map(|k| Complex64::new(1000.0 * at(k).fract(), 1000.0 * (97.3 * at(k)).fract())).collect()
    }

    struct Scene {
        images: Vec<Complex64>,
        stars: Vec<Complex64>,
        candidates: Vec<(usize, usize)>,
        truth: Similarity,
    }

    /// Twenty images, of which fourteen are stars rotated by 0.3 rad, with all candidates.
    fn turned() -> Scene {
        let stars = scattered(40);
        let truth =
            Similarity { factor: Complex64::from_polar(1.02, 0.3), shift: Complex64::new(40.0, -70.0) };
        let mut images: Vec<Complex64> =
            stars[..14].iter().map(|star| (star - truth.shift) / truth.factor).collect();
        images.extend(scattered(120)[100..106].iter());
        let candidates = (0..images.len()).flat_map(|i| (0..stars.len()).map(move |k| (i, k))).collect();
        Scene { images, stars, candidates, truth }
    }

    #[test]
    fn pairs_are_those_whose_separations_agree() {
        let Scene { images, stars, candidates, .. } = turned();
        let rule = Agreement { tolerance: 4.0, stretch: 0.03, least: 200.0, axis: None };
        let mut expected = vec![];
        for (a, &(i, k)) in candidates.iter().enumerate() {
            for &(j, l) in &candidates[a + 1..] {
                let (of_images, of_stars) = ((images[j] - images[i]).norm(), (stars[l] - stars[k]).norm());
                let agree = (of_images - of_stars).abs() < 4.0 + 0.03 * of_images && of_images > 200.0;
                if agree && k != l {
                    expected.push((images[i], stars[k], images[j], stars[l]));
                }
            }
        }
        let found = hypotheses(&images, &stars, &candidates, &rule);
        assert!(found.len() > 1000);
        assert_eq!(found.len(), expected.len());
        for (similarity, (image, star, other, its_star)) in found.iter().zip(expected) {
            assert!(
                (similarity.at(image) - star).norm() < 1e-9
                    && (similarity.at(other) - its_star).norm() < 1e-9
            );
        }
        let axis = Complex64::new(500.0, 500.0);
        let about = Agreement { axis: Some((axis, 150.0)), ..rule };
        let retained = hypotheses(&images, &stars, &candidates, &about);
        let near = found.iter().filter(|each| (each.at(axis) - axis).norm() <= 150.0).count();
        assert!(0 < near && near < found.len());
        assert_eq!(retained.len(), near);
    }

    #[test]
    fn the_true_similarity_has_the_most_votes() {
        let Scene { images, stars, candidates, truth } = turned();
        let rule = Agreement { tolerance: 4.0, stretch: 0.03, least: 200.0, axis: None };
        let all = hypotheses(&images, &stars, &candidates, &rule);
        assert!(all.len() > VOTED, "all do not vote for each");
        let best = best_voted(&all, &images, &stars, 20, 6.0, 5);
        assert_eq!(best.len(), 5);
        for each in best {
            assert!((each.factor - truth.factor).norm() < 1e-6 && (each.shift - truth.shift).norm() < 1e-4);
        }
        assert!(best_voted(&[], &images, &stars, 20, 6.0, 5).is_empty());
        assert!(best_voted(&all, &images, &[], 20, 6.0, 5).is_empty());
    }

    #[test]
    fn what_falls_outside_is_near_no_star() {
        let stars = [Complex64::new(0.0, 0.0), Complex64::new(100.0, 50.0)];
        let raster = Raster::new(&stars, 4.0);
        let same = Similarity { factor: Complex64::new(1.0, 0.0), shift: Complex64::new(0.0, 0.0) };
        let nowhere = Similarity { factor: Complex64::new(f64::NAN, f64::INFINITY), ..same };
        let images = [(0.5, 0.5), (103.0, 50.0), (20.0, 20.0), (-9e9, 3.0), (5.0, 1e300)]
            .map(|(x, y)| Complex64::new(x, y));
        assert_eq!(raster.count(&same, &images), 2);
        assert_eq!(raster.count(&nowhere, &images), 0);
    }
}
