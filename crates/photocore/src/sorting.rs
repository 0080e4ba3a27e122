//! Sorting functions for code in which speed is irrelevant.
//!
//! The sort of the standard library is compiled for every type of items and closure. These functions compile it once, for indices of items.

use std::cmp::Ordering;

/// Sorts a vector stably.
pub fn sort_by<T>(items: &mut Vec<T>, compare: &dyn Fn(&T, &T) -> Ordering) {
    let order = order(items.len(), &|a, b| compare(&items[a], &items[b]));
    let mut taken: Vec<Option<T>> = items.drain(..).map(Some).collect();
    items.extend(order.into_iter().filter_map(|number| taken[number].take()));
}

/// Returns the indices below `count`, stably sorted by `compare`.
pub fn order(count: usize, compare: &dyn Fn(usize, usize) -> Ordering) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| compare(a, b));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_that_compare_equal_stay_in_their_order() {
        let mut items: Vec<(usize, String)> = (0..50).map(|k| (k * 7 % 5, k.to_string())).collect();
        let mut expected = items.clone();
        expected.sort_by_key(|item| item.0);
        sort_by(&mut items, &|a, b| a.0.cmp(&b.0));
        assert_eq!(items, expected);
        assert_eq!(order(3, &|a, b| b.cmp(&a)), [2, 1, 0]);
    }
}
