//! The Gauss-Crout scheme of TB 19, section 4.

/// Seven normal equations with their right-hand side as the eighth column.
pub type Normal = [[f64; 8]; 7];

/// A pivot below this fraction of its diagonal element before reduction is rounding error.
const SINGULAR: f64 = 1e-13;

/// Solves seven normal equations C (column 8: right-hand side) by the auxiliary matrix D (equation 4.4: columns from left to
/// right, unscaled on and below the diagonal, divided by the diagonal above) and the back solution E (equation 4.5).
///
/// Returns D and E; None when a pivot vanishes, which the bulletin does not look at.
pub fn gauss_crout(c: &Normal) -> Option<(Normal, [f64; 7])> {
    let mut d = [[0.0; 8]; 7];
    for j in 0..8 {
        for i in 0..7 {
            let sum: f64 = (0..i.min(j)).map(|k| d[i][k] * d[k][j]).sum();
            d[i][j] = c[i][j] - sum;
            if i < j {
                d[i][j] /= d[i][i];
            } else if i == j && (d[i][i].is_nan() || d[i][i] <= SINGULAR * c[i][i]) {
                return None;
            }
        }
    }
    let mut e = [0.0; 7];
    for i in (0..7).rev() {
        e[i] = d[i][7] - (i + 1..7).map(|j| d[i][j] * e[j]).sum::<f64>();
    }
    Some((d, e))
}
