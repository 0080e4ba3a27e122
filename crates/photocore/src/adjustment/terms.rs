//! Priors of a problem as equations of unit weight, in addition to the observation equations.

use std::borrow::Cow;
use std::ops::Range;

use super::problem::{AnyProblem, Model, Term, is_weighted};
use crate::normals::Prior;

/// All prior terms at given values: terms of the model ([`Model::terms`]), and one term per other weighted unknown.
#[derive(Debug)]
pub struct Terms<'a> {
    values: &'a [f64],
    prior: &'a [f64],
    sd: &'a [f64],
    of_model: Vec<Term>,
}

impl<'a> Terms<'a> {
    /// Creates the terms at given values; `prior` and `sd` are observed values and standard deviations of the unknowns.
    pub fn new(model: &dyn Model, values: &'a [f64], prior: &'a [f64], sd: &'a [f64]) -> Self {
        Self { values, prior, sd, of_model: model.terms(values, prior, sd) }
    }

    /// Returns the terms whose first unknown is in a range, ascending.
    pub fn within(&self, of: Range<usize>) -> impl Iterator<Item = Cow<'_, Term>> {
        let mut of_model = &self.of_model[self.of_model.partition_point(|term| term.first < of.start)..];
        let end = of.end;
        let mut apart = weighted_among(self.sd, of).peekable();
        std::iter::from_fn(move || {
            let next = of_model.first().filter(|term| term.first < end);
            let Some(term) = next else {
                return apart.next().map(|unknown| Cow::Owned(self.single(unknown)));
            };
            if let Some(unknown) = apart.next_if(|&unknown| unknown < term.first) {
                return Some(Cow::Owned(self.single(unknown)));
            }
            while apart.next_if(|&unknown| unknown < term.unknowns().end).is_some() {}
            of_model = &of_model[1..];
            Some(Cow::Borrowed(term))
        })
    }

    /// Calls `take` for each weighted unknown of terms whose first unknown is in a range, ascending, with its row: (unknown, coefficients
    /// of unknowns, observed minus computed).
    pub fn rows_within(
        &self,
        of: Range<usize>,
        mut take: impl FnMut(usize, &mut dyn Iterator<Item = (usize, f64)>, f64),
    ) {
        for term in self.within(of) {
            for (k, row) in term.rows().enumerate().filter(|&(k, _)| is_weighted(self.sd[term.first + k])) {
                take(term.first + k, &mut term.unknowns().zip(row.iter().copied()), term.constant[k]);
            }
        }
    }

    /// Returns the row of an unknown; empty if it is not weighted.
    pub fn row(&self, unknown: usize) -> (Vec<(usize, f64)>, f64) {
        if !is_weighted(self.sd[unknown]) {
            return (vec![], 0.0);
        }
        let place = self.of_model.partition_point(|term| term.unknowns().end <= unknown);
        let term = match self.of_model.get(place).filter(|term| term.first <= unknown) {
            Some(term) => Cow::Borrowed(term),
            None => Cow::Owned(self.single(unknown)),
        };
        let k = unknown - term.first;
        let row = term.rows().nth(k).unwrap_or_default();
        (term.unknowns().zip(row.iter().copied()).collect(), term.constant[k])
    }

    /// Sum of squares of the terms whose first unknown is in a range.
    pub fn sum_of_squares(&self, of: Range<usize>) -> f64 {
        self.within(of).map(|term| term.constant.iter().map(|value| value * value).sum::<f64>()).sum()
    }

    fn single(&self, unknown: usize) -> Term {
        Term::single(unknown, self.prior[unknown] - self.values[unknown], self.sd[unknown])
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

impl AnyProblem<'_> {
    /// Returns the prior terms at given values.
    pub fn terms<'a>(&'a self, values: &'a [f64]) -> Terms<'a> {
        Terms::new(&self.model, values, &self.prior, &self.sd)
    }

    /// Forms the normal equations of all terms. A fixed or constrained unknown has the equation x = 0 with unit weight instead of others
    /// (see [`super::equations`]). Outer unknowns have zero weight here.
    #[doc(hidden)]
    pub fn prior_equations(&self, terms: &Terms<'_>, held: &[usize]) -> Prior {
        let fixed = self.fixed(held);
        let weight = fixed.iter().map(|&fixed| f64::from(u8::from(fixed))).collect();
        let mut prior = Prior { weight, right: vec![0.0; fixed.len()], between: vec![] };
        terms.within(0..fixed.len()).for_each(|term| add_term(&mut prior, &term, &fixed));
        let layout = self.layout();
        layout.unknowns_of(layout.outer()).for_each(|unknown| prior.weight[unknown] = 0.0);
        prior
    }
}

/// Adds A^T A and A^T l of a term, except for fixed unknowns.
fn add_term(prior: &mut Prior, term: &Term, fixed: &[bool]) {
    for (i, unknown) in term.unknowns().enumerate().filter(|&(_, unknown)| !fixed[unknown]) {
        let product = |j: usize| term.rows().map(|row| row[i] * row[j]).sum::<f64>();
        prior.weight[unknown] = product(i);
        prior.right[unknown] = term.rows().zip(&term.constant).map(|(row, constant)| row[i] * constant).sum();
        let others = (0..i).filter(|&j| !fixed[term.first + j]);
        prior.between.extend(others.map(|j| (unknown, term.first + j, product(j))));
    }
}
