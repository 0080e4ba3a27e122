//! Distances between points: a scale of all of them, such as another temperature or unit of the bars.

use super::catalogue::Catalogue;
use crate::adjustment::EquationOf;

/// Plausible error of scale.
const SCALE: f64 = 1e-2;

pub(super) fn add(catalogue: &mut Catalogue<'_>) {
    let bundle = catalogue.bundle;
    let active = bundle.observations.iter().enumerate();
    let lengths: Vec<(EquationOf, f64)> = active
        .filter_map(|(number, active)| match (active.observation.kind(), &active.touches.points[..]) {
            ("distance", &[first, second]) => {
                let length = (catalogue.place_of_point(first).position
                    - catalogue.place_of_point(second).position)
                    .norm();
                let of = EquationOf::Term { term: bundle.image_terms() + number, row: 0 };
                Some((of, length / active.root[(0, 0)]))
            }
            _ => None,
        })
        .collect();
    // One distance alone is a hypothesis of single observations.
    if lengths.len() > 1 {
        let column = catalogue.add(("distance-scale", None), &["scale"], &[SCALE])[0];
        catalogue.add_to(column, &lengths);
    }
}
