//! Runs of the examples, compared with expected results.

#![allow(clippy::unwrap_used, clippy::expect_used, dead_code)]

use std::fs;
use std::path::Path;

use photocore::adjustment::Status;

#[path = "../examples/block.rs"]
mod block;
#[path = "../examples/collection.rs"]
mod collection;
#[path = "../examples/scale_bar.rs"]
mod scale_bar;

#[test]
fn the_stations_of_the_block_come_out_within_their_standard_deviations() {
    let solution = block::adjusted().unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    assert!(solution.points.iter().all(Option::is_some));
    for (index, photo) in solution.photos.iter().enumerate() {
        let truth = [600.0 * (index % 4) as f64, 900.0 * (index / 4) as f64, 1500.0, 0.0, 0.0, 0.1];
        for (k, (found, truth)) in photo.pose.iter().zip(truth).enumerate() {
            assert!(
                (found - truth).abs() < 4.0 * photo.cofactors[7 * k].sqrt(),
                "photo {index}, unknown {k}"
            );
        }
    }
    block::main().unwrap();
}

#[test]
fn a_file_of_bundle_adjustment_in_the_large_is_adjusted() {
    let packaged = "../../python/photogram/examples/collection/ring.txt";
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(packaged);
    let text = fs::read_to_string(file).expect("the example of the Python package");
    let solution = collection::adjusted(&collection::read(&text).unwrap()).unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    assert_eq!(solution.datum.held.len(), 7);
    assert!(solution.photos.iter().all(|photo| photo.camera[0] > 0.0 && photo.cofactors[60] > 0.0));
    assert!(collection::read("8 60 379 0 0").is_err());
}

#[test]
fn a_scale_bar_gives_the_object_its_size() {
    let solution = scale_bar::adjusted().unwrap();
    assert_eq!(solution.adjustment.status, Status::Converged);
    for (index, point) in solution.points.iter().enumerate() {
        let found = point.unwrap();
        for k in 0..3 {
            assert!((found.coordinates[k] - scale_bar::place(index)[k]).abs() < 1e-8, "point {index}");
        }
    }
    // The length of the bar is not checked by other observations.
    let bar = solution.observations[0].as_ref().unwrap();
    assert!(bar.residual[0].abs() < 1e-9 && bar.redundancy[0].abs() < 1e-9);
    scale_bar::main().unwrap();
}
