//! Points in an order in which neighbours on the ground are neighbours in memory.
//!
//! The engine walks through a block region by region; points whose data lie scattered would have to be fetched one by one.

use super::Network;
use super::screening::PointImages;
use crate::geometry::Vector3;

/// Cells of the curve along each axis.
const CELLS: f64 = (1_u32 << 20) as f64;

impl Network {
    /// The points along a Morton curve through the mean positions of the photos that show them; `images_of` are the images
    /// of each point. Points of equal place stay in their order.
    pub(super) fn along_curve(&self, images_of: &PointImages) -> Vec<usize> {
        let centres: Vec<Vector3> = self.photos.iter().map(|photo| self.centre(&photo.pose)).collect();
        let lowest = centres.iter().fold(Vector3::repeat(f64::INFINITY), |low, centre| low.inf(centre));
        let extent = centres.iter().flat_map(|centre| (centre - lowest).data.0[0]).fold(0.0, f64::max);
        let key = |point: usize| {
            let images = images_of.of(point);
            let count = images.len().max(1) as f64;
            let mean: Vector3 = images.iter().map(|&image| centres[self.images[image].photo] / count).sum();
            // What is not finite comes first.
            interleaved(std::array::from_fn(|k| ((mean[k] - lowest[k]) / extent * (CELLS - 1.0)) as u32))
        };
        let mut keyed: Vec<(u64, usize)> = (0..self.points.len()).map(|point| (key(point), point)).collect();
        keyed.sort_unstable();
        keyed.into_iter().map(|(_, point)| point).collect()
    }
}

/// The bits of three numbers of twenty bits in turn (Morton 1966).
fn interleaved(cell: [u32; 3]) -> u64 {
    let spread = |value: u32| (0..20).fold(0, |bits, i| bits | u64::from(value >> i & 1) << (3 * i));
    spread(cell[0]) | spread(cell[1]) << 1 | spread(cell[2]) << 2
}
