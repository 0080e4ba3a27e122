//! Relative orientation: the five-point solver, planar scenes, noise and wrong points.

use photocore::geometry::{Matrix3, Pose, Vector3, rotation};
use photogram_programs::relative_orientation::{five_points, over_plane, relative_orientation};
use proptest::prelude::*;

/// Uniform generator in -1 to 1, reproducible (Numerical Recipes' quick generator).
struct Random(u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(self.0) / f64::from(u32::MAX) * 2.0 - 1.0
    }

    fn vector(&mut self) -> Vector3 {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

fn second(random: &mut Random) -> Pose {
    let base = (random.vector() + Vector3::new(1.5, 0.0, 0.0)).normalize();
    let angles = [0.3 * random.next(), 0.3 * random.next(), 2.0 * random.next()];
    Pose { position: base, attitude: rotation(angles).transpose() }
}

fn rays(points: &[Vector3], second: &Pose) -> Vec<[Vector3; 2]> {
    points.iter().map(|point| [point.normalize(), second.to_camera_frame(point).normalize()]).collect()
}

fn relief(random: &mut Random, count: usize) -> Vec<Vector3> {
    let point = |_| Vector3::new(2.0 * random.next(), 2.0 * random.next(), -5.0 + 1.5 * random.next());
    (0..count).map(point).collect()
}

fn essential(pose: &Pose) -> Matrix3 {
    let e = pose.position.cross_matrix() * pose.attitude;
    e / e.norm()
}

proptest! {
    #[test]
    fn five_points_have_the_true_essential_matrix_among_their_own(seed in any::<u32>()) {
        let mut random = Random(seed);
        let pose = second(&mut random);
        let pairs = rays(&relief(&mut random, 5), &pose);
        let truth = essential(&pose);
        let found = five_points(&[pairs[0], pairs[1], pairs[2], pairs[3], pairs[4]]);
        prop_assert!(found.len() <= 10);
        for e in &found {
            let worst = pairs.iter().map(|[first, second]| first.dot(&(e * second)).abs()).fold(0.0, f64::max);
            prop_assert!(worst < 1e-9, "{worst}");
        }
        let nearest = found.iter().map(|e| (e - truth).norm().min((e + truth).norm())).fold(f64::INFINITY, f64::min);
        prop_assert!(nearest < 1e-4, "{nearest}");
    }

    #[test]
    fn four_points_of_a_plane_have_the_true_pose_among_two(seed in any::<u32>()) {
        let mut random = Random(seed);
        let pose = second(&mut random);
        let tilt = [0.2 * random.next(), 0.2 * random.next()];
        let corners = [[-1.0, -1.0], [1.0, -1.2], [1.1, 1.0], [-0.9, 1.3]];
        let points = corners.map(|[x, y]| Vector3::new(x, y, -5.0 + tilt[0] * x + tilt[1] * y));
        let pairs = rays(&points, &pose);
        let found = over_plane(&[pairs[0], pairs[1], pairs[2], pairs[3]]);
        prop_assert!(found.len() <= 2);
        let apart = |k: usize| (found[k].attitude - pose.attitude).norm() + (found[k].base - pose.position).norm();
        prop_assert!((0..found.len()).any(|k| apart(k) < 1e-6));
    }
}

#[test]
fn a_third_of_wrong_points_and_noise_are_borne() {
    for seed in 0..20 {
        let mut random = Random(seed);
        let pose = second(&mut random);
        let mut pairs = rays(&relief(&mut random, 60), &pose);
        for (k, [_, seen]) in pairs.iter_mut().enumerate() {
            *seen = (*seen + 1e-5 * random.vector()).normalize();
            if k % 3 == 0 {
                *seen = Vector3::new(0.5 * random.next(), 0.5 * random.next(), -1.0).normalize();
            }
        }
        let best = relative_orientation(&pairs)[0].oriented;
        assert!((best.attitude - pose.attitude).norm() < 2e-2, "seed {seed}");
        assert!(best.base.angle(&pose.position) < 5e-2, "seed {seed}");
    }
}

#[test]
fn over_a_plane_the_true_pose_is_the_best_or_its_rival() {
    for seed in 0..20 {
        let mut random = Random(seed);
        let pose = second(&mut random);
        let points: Vec<Vector3> =
            (0..40).map(|_| Vector3::new(2.0 * random.next(), 2.0 * random.next(), -5.0)).collect();
        let found = relative_orientation(&rays(&points, &pose));
        let apart = |k: usize| (found[k].oriented.attitude - pose.attitude).norm();
        assert!((0..found.len()).any(|k| apart(k) < 1e-5), "seed {seed}");
    }
}

#[test]
fn too_few_points_give_nothing() {
    let mut random = Random(1);
    let pose = second(&mut random);
    assert!(relative_orientation(&rays(&relief(&mut random, 5), &pose)).is_empty());
    let same = [[Vector3::new(0.0, 0.0, -1.0); 2]; 5];
    assert!(five_points(&same).iter().all(|e| e.iter().all(|value| value.is_finite())));
}
