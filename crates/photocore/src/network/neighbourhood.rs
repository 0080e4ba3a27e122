//! Spatial order of points: neighbours on the ground are neighbours in memory.
//!
//! The engine processes a block region by region; scattered points would cause cache misses.

use rayon::prelude::*;

use super::input::Network;
use crate::geometry::Vector3;
use crate::parallel;

/// Minimum number of points per thread.
pub(super) const TOGETHER: usize = 1024;
/// Number of cells of the curve along each axis.
const CELLS: f64 = (1_u32 << 20) as f64;

/// Images of the active points, or their test groups, sorted by point: `order[start[i]..start[i + 1]]` lists those of point i.
#[derive(Debug, Default)]
pub(super) struct ByPoint {
    pub start: Vec<usize>,
    pub order: Vec<usize>,
}

impl ByPoint {
    /// Sorts pairs of a point below `count` and an image or group, which remain in their order at each point.
    pub fn new(count: usize, pairs: impl Iterator<Item = (usize, usize)> + Clone) -> Self {
        let mut start = vec![0; count + 1];
        pairs.clone().for_each(|(point, _)| start[point + 1] += 1);
        for point in 0..count {
            start[point + 1] += start[point];
        }
        let (mut next, mut order) = (start.clone(), vec![0; start[count]]);
        pairs.for_each(|(point, index)| {
            order[next[point]] = index;
            next[point] += 1;
        });
        Self { start, order }
    }

    pub fn of(&self, i: usize) -> &[usize] {
        &self.order[self.start[i]..self.start[i + 1]]
    }
}

impl Network {
    /// Returns the points along a Morton curve through the mean positions of their photos; `images_of` lists the images of each point.
    /// Points with equal positions remain in their order.
    pub(super) fn along_curve(&self, images_of: &ByPoint) -> Vec<usize> {
        let centres: Vec<Vector3> = self.photos.iter().map(|photo| self.centre(&photo.pose)).collect();
        let lowest = centres.iter().fold(Vector3::repeat(f64::INFINITY), |low, centre| low.inf(centre));
        let extent = centres.iter().flat_map(|centre| (centre - lowest).data.0[0]).fold(0.0, f64::max);
        let key = |point: usize| {
            let images = images_of.of(point);
            let count = images.len().max(1) as f64;
            let mean: Vector3 = images.iter().map(|&image| centres[self.images[image].photo] / count).sum();
            // Nonfinite positions are first.
            interleaved(std::array::from_fn(|k| ((mean[k] - lowest[k]) / extent * (CELLS - 1.0)) as u32))
        };
        let mut keyed = parallel::map(self.points.len(), TOGETHER, |point| (key(point), point));
        keyed.par_sort_unstable();
        keyed.into_iter().map(|(_, point)| point).collect()
    }
}

/// Interleaves the bits of three numbers of twenty bits (Morton 1966).
fn interleaved(cell: [u32; 3]) -> u64 {
    // Separates halves, then quarters, until single bits are separated.
    let steps = [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    let spread = |value: u32| {
        let low = u64::from(value & ((1 << 20) - 1));
        steps.iter().fold(low, |bits, (by, mask)| (bits | bits << by) & mask)
    };
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}

#[cfg(test)]
mod tests {
    use super::interleaved;

    #[test]
    fn bits_stand_in_turn() {
        for (cell, bits) in [([1, 0, 0], 1), ([0, 1, 0], 2), ([0, 0, 1], 4), ([2, 3, 0], 0b01_1010)] {
            assert_eq!(interleaved(cell), bits);
        }
        assert_eq!(interleaved([u32::MAX; 3]), (1 << 60) - 1);
        (0..20).for_each(|k| assert_eq!(interleaved([0, 1 << k, 0]), 2 << (3 * k)));
    }
}
