//! Tests of the crate as one program, so that dependencies are linked once instead of per file.

#![allow(clippy::unwrap_used)]

use std::fs;

use photocore::geometry::Vector3;

mod adjustment;
mod attitudes;
mod block;
mod camera_models;
mod cameras;
mod close_range;
mod collection;
mod cut;
mod examples;
mod forward;
mod free_networks;
mod free_unknowns;
mod geometry;
mod golden;
mod golden_network;
mod golden_unknowns;
mod normals;
mod observations;
mod parts;
mod refraction;
mod shared_cameras;
mod slow_steps;
mod splined_camera;
mod terms;
mod trajectories;

/// Returns deterministic noise from incommensurable angles.
fn noise(index: usize) -> f64 {
    (1.7 * index as f64 * index as f64 + 0.3).sin()
}

/// Returns a reproducible number between -1 and 1 for each index.
fn scatter(index: usize) -> f64 {
    ((index as f64 * 12.9898).sin() * 43758.5453).fract()
}

fn noises(index: usize) -> Vector3 {
    Vector3::from([3 * index, 3 * index + 1, 3 * index + 2].map(noise))
}

/// This file, and separate programs: a table for the page, global threads of the process.
const OTHERS: [&str; 2] = ["main", "nist"];

#[test]
fn every_file_is_part_of_the_program() {
    let named = include_str!("main.rs");
    for each in fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests")).unwrap() {
        let path = each.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap();
        assert!(OTHERS.contains(&name) || named.contains(&format!("\nmod {name};")), "{name}");
    }
}
