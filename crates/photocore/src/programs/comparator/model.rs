//! The observation equations of a calibration.

use super::Measurement;
use super::measure::{Basis, Comparator, Placement};
use crate::adjustment::{Evaluated, Model};
use crate::normals::GroupRows;

/// Plates compared with a comparator.
#[derive(Debug)]
pub struct Comparison {
    pub basis: Basis,
    /// Of each case.
    pub left_handed: Vec<bool>,
    /// The measurements, point by point: the groups of observations.
    pub measurements: Vec<Measurement>,
    /// Index of each of them in the calibration.
    pub order: Vec<usize>,
}

/// Points, cases and comparator at given values of the unknowns.
struct At<'a> {
    comparison: &'a Comparison,
    points: Vec<[f64; 2]>,
    cases: Vec<Placement>,
    comparator: Comparator,
}

impl Comparison {
    /// Puts values of the groups back into the order of the calibration.
    pub fn in_given_order(&self, of_groups: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        let mut values = vec![[f64::NAN; 2]; of_groups.len()];
        for (value, &measurement) in of_groups.into_iter().zip(&self.order) {
            values[measurement] = value;
        }
        values
    }
}

impl Model for Comparison {
    fn at<'a>(&'a self, unknowns: &[f64]) -> Box<dyn Evaluated + 'a> {
        let cases = unknowns.len() - 3 - 2 * self.basis.functions();
        let points = cases - 3 * self.left_handed.len();
        Box::new(At {
            comparison: self,
            points: unknowns[..points].as_chunks().0.to_vec(),
            cases: unknowns[points..cases].as_chunks().0.iter().map(|&case| Placement::from(case)).collect(),
            comparator: Comparator::from_unknowns(self.basis, &unknowns[cases..]),
        })
    }
}

impl Evaluated for At<'_> {
    fn observe(&self, local: usize, group: usize, rows: &mut GroupRows<'_>) {
        let Measurement { case, xy, .. } = self.comparison.measurements[group];
        let swap = self.comparison.left_handed[case];
        let [first, second] = self.points[local];
        let point = if swap { [second, first] } else { [first, second] };
        let measured = self.comparator.measure(point, &self.cases[case]);
        let width = measured.comparator[0].len();
        for row in 0..2 {
            rows.constant[row] = xy[row] - measured.xy[row];
            let [by_first, by_second] = measured.point[row];
            let by_point = if swap { [by_second, by_first] } else { [by_first, by_second] };
            rows.local[2 * row..][..2].copy_from_slice(&by_point);
            rows.retained[3 * row..][..3].copy_from_slice(&measured.case[row]);
            rows.shared[width * row..][..width].copy_from_slice(&measured.comparator[row]);
        }
    }
}
