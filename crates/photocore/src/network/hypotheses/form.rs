//! The form of the network as control and positions of photos have it: its scale, its bending.

use nalgebra::Vector3;

use super::catalogue::{Catalogue, Seen};

/// Plausible error of scale.
const SCALE: f64 = 1e-2;
/// Observed positions that bending takes.
const FEWEST: usize = 5;

pub(super) fn add(catalogue: &mut Catalogue<'_>, points: &[(usize, usize)]) {
    let centre = catalogue.centre();
    let mut places: Vec<(Seen, usize, Vector3<f64>)> = catalogue
        .positions()
        .into_iter()
        .map(|(_, first, place)| (Seen::Positions, first, place - centre))
        .collect();
    places.extend(points.iter().map(|&(_, place)| {
        (Seen::Control, catalogue.bundle.of_point(place).start, catalogue.place(place) - centre)
    }));
    if places.len() < 2 {
        return;
    }
    let scale = catalogue.add(("scale", None), &["scale"], &[SCALE]);
    for (seen, first, place) in &places {
        catalogue.displace_all(*seen, *first, scale[0], place);
    }
    // Heights bend by d (x / half width)^2 and the same in y: d is the error at the edge, relative to the middle.
    let half = |axis: usize| places.iter().map(|own| own.2[axis].abs()).fold(0.0, f64::max);
    if places.len() >= FEWEST && half(0) > 0.0 && half(1) > 0.0 {
        let halves = [half(0), half(1)];
        let mut bend = |code, places: &[(Seen, usize, Vector3<f64>)]| {
            let columns = catalogue.add((code, None), &["x2", "y2"], &[]);
            for (seen, first, place) in places {
                for axis in 0..2 {
                    let height = (place[axis] / halves[axis]).powi(2);
                    catalogue.displace(*seen, first + 2, columns[axis], height);
                }
            }
        };
        bend("bending", &places);
        // Control behind the positions, which may contradict it.
        let of_control = &places[places.len() - points.len()..];
        if (FEWEST..places.len()).contains(&of_control.len()) {
            bend("control-bending", of_control);
        }
    }
}
