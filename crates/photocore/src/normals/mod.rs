//! Block normal equations: formed, reduced, ordered, factored, solved, selectively inverted.
