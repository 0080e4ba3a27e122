//! Supernodes: blocks that are eliminated together.

use std::ops::Range;

use super::layout::Layout;

/// Widest panel, in unknowns. Wide panels reduce the cost of updates between panels; narrow ones reduce the serial inversion of the
/// diagonal triangle.
const WIDEST_PANEL: usize = 768;

/// Blocks and coupled rows of a supernode, as positions.
pub(super) type Merged = (Range<usize>, Vec<usize>);

/// Merges each column with its parent if they are adjacent and the merge adds few explicit zeros (relaxed supernodes, Ashcraft and Grimes
/// 1989). Returns the blocks and the coupled rows of each supernode.
pub(super) fn merge_columns(columns: Vec<Vec<usize>>, offset: &[usize]) -> Vec<Merged> {
    let dim = |position: usize| offset[position + 1] - offset[position];
    let size = |rows: &[usize]| rows.iter().map(|&row| dim(row)).sum::<usize>();
    let mut merged: Vec<Merged> = Vec::new();
    let mut filled = 0.0;
    for (position, rows) in columns.into_iter().enumerate() {
        let entries = |width: usize, below: usize| (width * (width + 1) / 2 + width * below) as f64;
        let own = entries(dim(position), size(&rows));
        if let Some((blocks, above)) = merged.last_mut() {
            let width = offset[position + 1] - offset[blocks.start];
            // All rows of the child except its parent are in the parent's pattern, so the merged rows are the parent's.
            let zeros = 1.0 - (filled + own) / entries(width, size(&rows));
            let few = zeros < 0.05 || (width <= 48 && zeros < 0.2) || (width <= 24 && zeros < 0.4);
            if above.first() == Some(&position) && width <= WIDEST_PANEL && few {
                blocks.end = position + 1;
                *above = rows;
                filled += own;
                continue;
            }
        }
        merged.push((position..position + 1, rows));
        filled = own;
    }
    merged
}

/// Inverts an order: returns the index of each block.
pub(super) fn places(order: &[usize]) -> Vec<usize> {
    let mut place = vec![0; order.len()];
    for (k, &block) in order.iter().enumerate() {
        place[block] = k;
    }
    place
}

/// Returns the offset of the unknowns of each block of an order, and the end of the last.
pub(super) fn offsets(layout: &Layout, order: &[usize]) -> Vec<usize> {
    let ends = order.iter().scan(0, |end, &block| {
        *end += layout.retained_dim(block);
        Some(*end)
    });
    std::iter::once(0).chain(ends).collect()
}

/// Sorts shared blocks by index within each supernode, so that the columns of shared block lists are mostly contiguous.
pub(super) fn sort_commons(layout: &Layout, block_at: &mut [usize], merged: &mut [Merged]) {
    if !layout.has_shared() {
        return;
    }
    let main = layout.are_main();
    let before = places(block_at);
    for (blocks, _) in merged.iter() {
        let places: Vec<usize> = blocks.clone().filter(|&place| !main[block_at[place]]).collect();
        let mut commons: Vec<usize> = places.iter().map(|&place| block_at[place]).collect();
        commons.sort_unstable();
        places.into_iter().zip(commons).for_each(|(place, block)| block_at[place] = block);
    }
    let mut moved = vec![0; block_at.len()];
    block_at.iter().enumerate().for_each(|(place, &block)| moved[before[block]] = place);
    for (_, rows) in merged {
        rows.iter_mut().for_each(|row| *row = moved[*row]);
        rows.sort_unstable();
    }
}
