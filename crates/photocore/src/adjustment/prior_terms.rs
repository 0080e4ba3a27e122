//! Priors of a problem as terms of one block, in unit weight.

use std::ops::Range;

/// Prior terms at given values, ascending: terms of the model ([`super::Model::prior_terms`]), and one term per other weighted unknown.
#[derive(Debug, Default)]
pub struct PriorTerms {
    places: Vec<Place>,
    constants: Vec<f64>,
    coefficients: Vec<f64>,
}

/// Unknowns of a term, and the indices of its first constant and coefficient.
#[derive(Debug, Clone, Copy)]
struct Place {
    first: u32,
    width: u32,
    constants: usize,
    coefficients: usize,
}

impl Place {
    fn unknowns(&self) -> Range<usize> {
        self.first as usize..(self.first + self.width) as usize
    }
}

/// Prior of consecutive unknowns of one block: one equation per unknown.
#[derive(Debug, Clone, Copy)]
pub struct PriorTerm<'a> {
    /// Index of the first unknown.
    pub first: usize,
    /// Observed minus computed, one element per unknown.
    pub constant: &'a [f64],
    /// Partials of the computed values by the step, square, row by row; zero rows are unobserved.
    pub coefficients: &'a [f64],
}

impl<'a> PriorTerm<'a> {
    /// Range of the unknowns.
    pub fn unknowns(&self) -> Range<usize> {
        self.first..self.first + self.constant.len()
    }

    /// Returns the rows of partials.
    pub fn rows(&self) -> impl Iterator<Item = &'a [f64]> + use<'a> {
        self.coefficients.chunks_exact(self.constant.len())
    }
}

impl PriorTerms {
    /// Adds terms of the other weighted unknowns to those of a model at given values; `prior` and `sd` are observed values and standard
    /// deviations of the unknowns.
    pub fn new(of_model: Self, values: &[f64], prior: &[f64], sd: &[f64]) -> Self {
        let mut all = of_model;
        all.sort();
        let of_model: Vec<Range<usize>> = all.places.iter().map(Place::unknowns).collect();
        let mut of_model = of_model.into_iter().peekable();
        for unknown in weighted_among(sd, 0..sd.len()) {
            while of_model.next_if(|own| own.end <= unknown).is_some() {}
            if of_model.peek().is_none_or(|next| unknown < next.start) {
                let weight = sd[unknown].recip();
                all.push(unknown, &[weight * (prior[unknown] - values[unknown])], &[weight]);
            }
        }
        all.sort();
        all
    }

    /// Adds a term.
    pub fn push(&mut self, first: usize, constant: &[f64], coefficients: &[f64]) {
        let (first, width) = (first as u32, constant.len() as u32);
        let (constants, all) = (self.constants.len(), self.coefficients.len());
        self.places.push(Place { first, width, constants, coefficients: all });
        self.constants.extend_from_slice(constant);
        self.coefficients.extend_from_slice(coefficients);
    }

    fn sort(&mut self) {
        self.places.sort_by_key(|own| own.first);
    }

    fn term(&self, place: &Place) -> PriorTerm<'_> {
        let width = place.width as usize;
        PriorTerm {
            first: place.first as usize,
            constant: &self.constants[place.constants..][..width],
            coefficients: &self.coefficients[place.coefficients..][..width * width],
        }
    }

    /// Returns the terms whose first unknown is in a range, ascending.
    pub fn within(&self, of: Range<usize>) -> impl Iterator<Item = PriorTerm<'_>> {
        let before = |end: usize| self.places.partition_point(|own| (own.first as usize) < end);
        self.places[before(of.start)..before(of.end)].iter().map(|place| self.term(place))
    }

    /// Returns the row of an unknown; empty if it is not weighted.
    pub fn row(&self, unknown: usize) -> (Vec<(usize, f64)>, f64) {
        let place = self.places.partition_point(|own| own.unknowns().end <= unknown);
        let Some(term) = self.places.get(place).map(|own| self.term(own)).filter(|own| own.first <= unknown)
        else {
            return (vec![], 0.0);
        };
        let k = unknown - term.first;
        let row = term.rows().nth(k).unwrap_or_default();
        (term.unknowns().zip(row.iter().copied()).collect(), term.constant[k])
    }

    /// Sum of squares of the terms whose first unknown is in a range.
    pub fn sum_of_squares(&self, of: Range<usize>) -> f64 {
        self.within(of).map(|term| term.constant.iter().map(|value| value * value).sum::<f64>()).sum()
    }
}

/// Returns the weighted unknowns of a range. Most unknowns are free and are skipped in blocks of 64.
pub(super) fn weighted_among(sd: &[f64], of: Range<usize>) -> impl Iterator<Item = usize> {
    const STRETCH: usize = 64;
    let stretches = of.clone().step_by(STRETCH).map(move |first| first..of.end.min(first + STRETCH));
    let free = |stretch: &Range<usize>| {
        let not_free = |all: u64, sd: &f64| all | (sd.to_bits() ^ f64::INFINITY.to_bits());
        sd[stretch.clone()].iter().fold(0, not_free) == 0
    };
    stretches.filter(move |stretch| !free(stretch)).flatten().filter(|&unknown| is_weighted(sd[unknown]))
}

/// Whether an unknown with this standard deviation is weighted: neither free nor fixed.
pub(super) fn is_weighted(sd: f64) -> bool {
    sd > 0.0 && sd.is_finite()
}
