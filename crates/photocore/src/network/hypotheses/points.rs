//! Object points with several observations: the target of one point is misplaced in all images, which its control and distances show; the
//! fixed coordinates of one point are wrong, which all its observations show.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};

/// Points that are tested, those with the most other observations.
const MOST: usize = 16;
/// Other observations of a point: an error of a single one is a hypothesis of its own.
const FEWEST: usize = 2;

pub(super) fn add(catalogue: &mut Catalogue<'_>, names: &[usize]) {
    let bundle = catalogue.bundle;
    // Only images of points that are not local are terms with other observations.
    let mut counts = vec![0; bundle.points.len()];
    for active in &bundle.observations {
        active.touches.points.iter().for_each(|&place| counts[place] += 1);
    }
    for (place, count) in counts.iter_mut().enumerate() {
        let weighted = catalogue.sd[bundle.of_point(place)].iter().any(|sd| sd.is_finite());
        *count += usize::from(weighted);
    }
    let retained = bundle.locals..bundle.points.len();
    let mut places: Vec<usize> = retained.filter(|&place| counts[place] >= FEWEST).collect();
    places.sort_by_key(|&place| std::cmp::Reverse(counts[place]));
    places.truncate(MOST);
    for place in places {
        let own = catalogue.place_of_point(place);
        if catalogue.sd[bundle.of_point(place)].iter().all(|&sd| sd == 0.0) {
            let columns = catalogue.add(("fixed-point", Some(names[place])), &catalogue.axis_names(), &[]);
            catalogue.shift_place(Seen::Control, &own, &columns, 1.0);
        }
        let axes = catalogue.axes_at(own.position);
        let columns = catalogue.add(("object-point", Some(names[place])), &catalogue.axis_names(), &[]);
        for (k, &column) in columns.iter().enumerate() {
            let change: Vector3<f64> = own.change(&axes.row(k).transpose());
            (0..3).for_each(|axis| {
                catalogue.displace_seen(Seen::Images, own.first + axis, column, change[axis])
            });
        }
    }
}
