//! Least squares: iteration, weights, convergence, statistics. Knows no photograph.
