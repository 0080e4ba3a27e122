//! Data snooping of linear models, published and small enough to be solved densely.

use std::collections::{BTreeSet, HashSet};

use nalgebra::{DMatrix, DVector};

use super::super::NetworkError;
use super::super::group_tests::{TestOfGroup, TestOfRow, Tests};
use super::super::predictions::ResidualBlock;
use super::super::test_groups::TestKind;
use super::super::trial::Excluded;
use super::groups::Groups;
use super::tried::Tried;
use super::unit_weight::UnitWeight;
use super::{Kept, Log, Remark, Settings, Snooping, Standing};
use crate::adjustment::{GroupTest, Status};

/// Observations of unit weight, each a group.
struct Linear {
    partials: DMatrix<f64>,
    observed: DVector<f64>,
    /// Type of the observations: images are not disputed.
    kind: TestKind,
    is_in: Vec<bool>,
    values: DVector<f64>,
    cofactors: DMatrix<f64>,
}

impl Linear {
    fn new(partials: DMatrix<f64>, observed: &[f64], sd: f64) -> Self {
        let count = partials.ncols();
        Self {
            observed: DVector::from_column_slice(observed) / sd,
            partials: partials / sd,
            kind: TestKind::Image,
            is_in: vec![true; observed.len()],
            values: DVector::zeros(count),
            cofactors: DMatrix::zeros(count, count),
        }
    }

    /// Zeros for excluded rows.
    fn partials_in_use(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.is_in.len(), self.values.len(), |i, j| {
            if self.is_in[i] { self.partials[(i, j)] } else { 0.0 }
        })
    }

    fn residuals(&self) -> DVector<f64> {
        &self.observed - &self.partials * &self.values
    }

    fn r(&self) -> DMatrix<f64> {
        let a = self.partials_in_use();
        let identity = DMatrix::from_diagonal(&DVector::from_iterator(
            self.is_in.len(),
            self.is_in.iter().map(|is_in| f64::from(u8::from(*is_in))),
        ));
        identity - &a * &self.cofactors * a.transpose()
    }

    fn snoop(&mut self, settings: Settings) -> Log {
        let groups = Groups::of_single_rows(self.observed.len(), self.kind);
        let mut snooping = Snooping::begin(self, groups, settings, None).unwrap();
        snooping.run(self).unwrap();
        snooping.finish()
    }
}

impl Tried for Linear {
    fn adjust(&mut self, out: &Excluded, _: f64) -> Result<Standing, NetworkError> {
        self.is_in = out.rows.iter().map(|out| !out).collect();
        let a = self.partials_in_use();
        self.cofactors = a.tr_mul(&a).try_inverse().ok_or(NetworkError::NotFinite)?;
        self.values = &self.cofactors * a.tr_mul(&self.observed);
        let residuals = self.residuals();
        let used = || (0..self.is_in.len()).filter(|&row| self.is_in[row]);
        Ok(Standing {
            status: Status::Converged,
            sum_of_squares: used().map(|row| residuals[row].powi(2)).sum(),
            degrees_of_freedom: used().count() as i64 - self.values.len() as i64,
        })
    }

    fn tests(&mut self) -> Result<Tests, NetworkError> {
        let (v, r) = (self.residuals(), self.r());
        let mut all = Tests::inactive(v.len(), v.len(), 0);
        all.cofactors = r.diagonal().as_slice().to_vec();
        for row in (0..v.len()).filter(|&row| self.is_in[row]) {
            let test = GroupTest::new(&[v[row]], &[r[(row, row)]], None);
            all.groups[row] = TestOfGroup { shared: 0.0, ..(&test).into() };
            let (error, error_sd) = (test.error[0], test.cofactors[0].sqrt());
            all.rows[row] = TestOfRow { residual: v[row], error, error_sd };
        }
        Ok(all)
    }

    fn predictions(&mut self, groups: &[usize]) -> Result<Tests, NetworkError> {
        let residuals = self.residuals();
        let mut all = Tests::inactive(groups.len(), groups.len(), 0);
        for (k, &row) in groups.iter().enumerate().filter(|own| !self.is_in[*own.1]) {
            let a = self.partials.row(row);
            let variance = 1.0 + (a * &self.cofactors * a.transpose())[0];
            let statistic = residuals[row].powi(2) / variance;
            all.groups[k] = TestOfGroup { active: true, rank: 1, statistic, ..all.groups[k] };
            let (error, error_sd) = (residuals[row], variance.sqrt());
            all.rows[k] = TestOfRow { error, error_sd, ..all.rows[k] };
        }
        Ok(all)
    }

    fn on_points(&mut self, _: &[usize], _: bool) -> Result<Vec<ResidualBlock>, NetworkError> {
        Ok(vec![])
    }

    fn responses(&mut self) -> Result<Vec<f64>, NetworkError> {
        Ok(self.r().as_slice().to_vec())
    }

    fn robust_residuals(&mut self, _: f64) -> Result<Option<Vec<f64>>, NetworkError> {
        Ok(None)
    }
}

/// A levelling net with two gross errors; point 0 is the datum.
fn levelling() -> Linear {
    const EDGES: [[usize; 2]; 16] = [
        [0, 1],
        [1, 2],
        [2, 3],
        [3, 4],
        [4, 5],
        [5, 6],
        [6, 0],
        [0, 2],
        [1, 3],
        [2, 4],
        [3, 5],
        [4, 6],
        [5, 0],
        [6, 1],
        [0, 3],
        [1, 4],
    ];
    const OBSERVED: [f64; 16] = [
        3.0953, 2.303, -3.2028, 5.6772, -1.6013, -1.9021, -4.4017, 5.3985, -0.8742, 2.5035, 4.0963, -3.5004,
        -6.3019, -1.3015, 2.2048, 4.8025,
    ];
    let mut partials = DMatrix::zeros(16, 6);
    for (row, [start, end]) in EDGES.into_iter().enumerate() {
        [(start, -1.0), (end, 1.0)].into_iter().filter(|(point, _)| *point > 0).for_each(|(point, sign)| {
            partials[(row, point - 1)] = sign;
        });
    }
    Linear::new(partials, &OBSERVED, 0.003)
}

fn close(value: f64, expected: f64, tolerance: f64) -> bool {
    (value - expected).abs() < tolerance * expected.abs()
}

#[test]
fn a_good_observation_between_two_wrong_ones_is_excluded_first_and_returns() {
    let mut net = levelling();
    let log = net.snoop(Settings::default());
    let groups: Vec<usize> = log.removals.iter().map(|entry| entry.group).collect();
    assert_eq!(groups, [2, 3, 8]);
    for (entry, p) in log.removals.iter().zip([5.957_954_094e-7, 0.000_897_703_989_1, 1.254_789_669e-5]) {
        assert!(close(entry.log_probability.exp(), p, 1e-7), "{}", entry.log_probability.exp());
    }
    assert_eq!(
        log.removals.iter().map(|entry| entry.returned.is_some()).collect::<Vec<_>>(),
        [true, false, false]
    );
    let prediction = log.removals[0].prediction.as_ref().unwrap();
    assert!(close(prediction.log_probability.exp(), 0.034_347_862_28, 1e-7));
    assert!(close(log.after.sum_of_squares, 6.391_519_46, 1e-7));
    for (value, expected) in
        net.values.iter().zip([3.097_802_45, 5.400_727_768, 2.202_444_828, 7.901_863_793])
    {
        assert!(close(*value, expected, 1e-8));
    }
    assert_eq!(log.rounds.len(), 2);
}

#[test]
fn the_maximum_number_of_rounds_is_reported() {
    let log = levelling().snoop(Settings { max_rounds: 1, ..Settings::default() });
    assert_eq!(log.remarks, [Remark::NotEnded]);
}

#[test]
fn three_outliers_that_mask_each_other_are_found() {
    // Rosner (1983): the first two steps are not significant, the third is.
    const VALUES: [f64; 54] = [
        -0.25, 0.68, 0.94, 1.15, 1.2, 1.26, 1.26, 1.34, 1.38, 1.43, 1.49, 1.49, 1.55, 1.56, 1.58, 1.65, 1.69,
        1.7, 1.76, 1.77, 1.81, 1.91, 1.94, 1.96, 1.99, 2.06, 2.09, 2.1, 2.14, 2.15, 2.23, 2.24, 2.26, 2.35,
        2.37, 2.4, 2.47, 2.54, 2.62, 2.64, 2.9, 2.92, 2.92, 2.93, 3.21, 3.26, 3.3, 3.59, 3.68, 4.3, 4.64,
        5.34, 5.42, 6.01,
    ];
    let mut mean = Linear::new(DMatrix::from_element(54, 1, 1.0), &VALUES, 1.0);
    let log = mean.snoop(Settings { known: false, ..Settings::default() });
    let found: Vec<f64> = log.removals.iter().map(|entry| VALUES[entry.group]).collect();
    assert_eq!(found, [6.01, 5.42, 5.34]);
    for (entry, t) in log.removals.iter().zip([3.458_440_25, 3.229_273_3, 3.558_687_796]) {
        assert!(close(entry.fisher.sqrt(), t, 1e-8), "{}", entry.fisher.sqrt());
    }
}

#[test]
fn one_of_two_contradicting_observations_is_disputed() {
    // Two observations of one unknown: either explains the difference.
    let mut two = Linear::new(DMatrix::from_element(2, 1, 1.0), &[0.0, 10.0], 1.0);
    two.kind = TestKind::Observation;
    let log = two.snoop(Settings::default());
    assert_eq!(log.removals[0].kept, Some(Kept::Disputed));
    assert_eq!(log.removals[0].rivals.len(), 1);
    assert!(close(log.removals[0].rivals[0].odds, 1.0, 1e-9));
    assert!(log.out.rows.iter().all(|out| !out));
    // An observation that determines its unknown alone cannot be tested.
    let partials = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let log = Linear::new(partials, &[0.0, 0.1, 90.0], 1.0).snoop(Settings::default());
    assert!(log.removals.is_empty());
    assert_eq!(log.tests, 2);
}

#[test]
fn the_global_test_requires_a_known_unit_weight() {
    let unit = |known| UnitWeight { known, sum: 40.0, freedom: 10.0 };
    assert_eq!(unit(true).is_rejected(1.0), Some(true));
    assert_eq!(unit(true).is_rejected(4.0), Some(false));
    assert_eq!(unit(false).is_rejected(1.0), None);
    assert!((unit(true).odds((9.0, 1), (9.0, 1)) - 1.0).abs() < 1e-12);
    assert!(unit(false).fisher(39.0, 10).is_nan());
}

#[test]
fn groups_of_a_linear_model_have_no_points() {
    let groups = Groups::of_single_rows(3, TestKind::Observation);
    let out = Excluded { rows: vec![true, false, false], ..Excluded::default() };
    assert_eq!(groups.consequences(&out, 0), (None, false));
    assert_eq!(groups.affected_photos(1), BTreeSet::new());
    let rows: HashSet<usize> = (0..3).flat_map(|group| groups.rows(group)).collect();
    assert_eq!(rows.len(), 3);
}
