//! Nearest neighbours in a plane.

/// Returns the nearest of the others to each point within a limit; None if the limit contains none of them.
///
/// `but` names one excluded neighbour per point. Equal distances are resolved by the order of cells and indices. The others are sorted into
/// cells as wide as the limit, so that only nine cells are searched. Points that are not finite yield None.
///
/// # Panics
///
/// If `but` and the points differ in length.
pub fn nearest(
    points: &[[f64; 2]],
    others: &[[f64; 2]],
    limit: f64,
    but: Option<&[Option<usize>]>,
) -> Vec<Option<usize>> {
    let least = |k: usize| others.iter().map(|other| other[k]).fold(f64::INFINITY, f64::min);
    let corner = [least(0), least(1)];
    // Indices outside of the integer range are clamped.
    let cell = |at: &[f64; 2]| -> [i64; 2] {
        std::array::from_fn(|k| (((at[k] - corner[k]) / limit).floor() as i64).clamp(-2, i64::MAX - 2))
    };
    let mut cells: Vec<([i64; 2], usize)> = others.iter().map(cell).zip(0..).collect();
    cells.sort_unstable();
    let found = |(k, point): (usize, &[f64; 2])| {
        let [column, row] = cell(point);
        let (mut best, mut square) = (None, limit * limit);
        for column in column - 1..=column + 1 {
            let first = cells.partition_point(|(cell, _)| *cell < [column, row - 1]);
            for &(_, other) in cells[first..].iter().take_while(|(cell, _)| *cell <= [column, row + 1]) {
                let [dx, dy] = [point[0] - others[other][0], point[1] - others[other][1]];
                let away = dx * dx + dy * dy;
                if away <= square && but.is_none_or(|but| but[k] != Some(other)) {
                    (best, square) = (Some(other), away);
                }
            }
        }
        best
    };
    points.iter().enumerate().map(found).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points at fractions of multiples of the golden ratio: pseudo-random positions.
    fn scattered(count: usize, start: f64) -> Vec<[f64; 2]> {
        let at = |k: usize| 0.618_033_988_749_895 * (k as f64 + start);
        (0..count).map(|k| [100.0 * at(k).fract(), 100.0 * (97.3 * at(k)).fract()]).collect()
    }

    #[test]
    fn as_all_distances_have_it() {
        let (points, others) = (scattered(300, 0.0), scattered(200, 0.37));
        let square = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        for limit in [0.5, 3.0, 40.0, f64::INFINITY] {
            let found = nearest(&points, &others, limit, None);
            let second = nearest(&points, &others, limit, Some(&found));
            for (k, point) in points.iter().enumerate() {
                let mut all: Vec<usize> = (0..others.len()).collect();
                all.sort_by(|&a, &b| square(point, &others[a]).total_cmp(&square(point, &others[b])));
                let within = |k: usize| Some(all[k]).filter(|&o| square(point, &others[o]) <= limit * limit);
                assert_eq!(found[k], within(0), "limit {limit}, point {k}");
                if found[k].is_some() {
                    assert_eq!(second[k], within(1), "limit {limit}, point {k}");
                }
            }
        }
    }

    #[test]
    fn without_others_or_numbers() {
        assert_eq!(nearest(&[[1.0, 2.0]], &[], 3.0, None), [None]);
        let points = [[f64::NAN, 0.0], [f64::INFINITY, 0.0], [0.0, 0.0]];
        assert_eq!(nearest(&points, &[[0.5, 0.0], [f64::NAN, 1.0]], 1.0, None), [None, None, Some(0)]);
        assert_eq!(nearest(&points, &[[0.5, 0.0], [0.0, 0.0]], 0.0, None)[..2], [None, None]);
    }
}
