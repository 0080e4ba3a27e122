//! Initial values of a ring of photos about an object: wrong observations, wrong control, observations without control.

#![allow(clippy::unwrap_used)]

use photocore::geometry::{Matrix3, Pose, Vector3};
use photocore::{Context, Threads};
use photogram_programs::first_values::{
    FirstValues, Found, Frame, KnownPhoto, KnownPoint, Missing, Sighting, Source,
};

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

/// Returns photos on a circle of radius 8; their axes are level and pass through the centre.
fn ring(photos: usize) -> Vec<Pose> {
    let pose = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / photos as f64;
        let back = Vector3::new(turn.cos(), turn.sin(), 0.0);
        let right = Vector3::new(-turn.sin(), turn.cos(), 0.0);
        Pose { position: 8.0 * back, attitude: Matrix3::from_columns(&[right, Vector3::z(), back]) }
    };
    (0..photos).map(pose).collect()
}

/// Returns the ring with some points, `control` known points, and a fraction of wrong observations.
fn given(seed: u32, photos: usize, control: usize, wrong: f64) -> (FirstValues, Vec<Pose>) {
    let mut random = Random(seed);
    let (poses, points) = (ring(photos), (0..60).map(|_| 2.0 * random.vector()).collect::<Vec<_>>());
    let mut sightings = vec![];
    for (photo, pose) in poses.iter().enumerate() {
        for (point, at) in points.iter().enumerate() {
            let seen = pose.to_camera_frame(at).normalize() + 5e-5 * random.vector();
            let other = Vector3::new(0.4 * random.next(), 0.4 * random.next(), -1.0);
            let bad = 0.5 * (random.next() + 1.0) < wrong;
            let direction = if bad { other } else { seen }.normalize();
            sightings.push(Sighting { photo, point, direction, sd: 5e-5 });
        }
    }
    let known = |(k, at): (usize, &Vector3)| {
        let sd = if k < control { [0.001; 3] } else { [f64::INFINITY; 3] };
        KnownPoint { coordinates: if k < control { (*at).into() } else { [f64::NAN; 3] }, sd }
    };
    let points = points.iter().enumerate().map(known).collect();
    (FirstValues { photos: vec![KnownPhoto::default(); photos], points, sightings }, poses)
}

fn found(given: &FirstValues) -> Found {
    let threads = Threads::new(1).unwrap();
    given.find(&mut Context::new(&threads)).unwrap()
}

fn farthest(found: &Found, truth: &[Pose]) -> f64 {
    let apart = |(pose, truth): (&Result<(Pose, Source), Missing>, &Pose)| {
        pose.map_or(f64::INFINITY, |(pose, _)| (pose.position - truth.position).norm())
    };
    found.poses.iter().zip(truth).map(apart).fold(0.0, f64::max)
}

#[test]
fn control_and_wrong_images() {
    for (seed, wrong) in [(1, 0.0), (2, 0.1), (3, 0.2), (4, 0.1), (5, 0.2)] {
        let (given, truth) = given(seed, 8, 6, wrong);
        let found = found(&given);
        assert!(farthest(&found, &truth) < 0.01, "seed {seed}");
        assert_eq!(found.frame, Frame::Known);
    }
}

/// Photos resected from four points, one of them wrong, must not prevent the solution of the others.
#[test]
fn a_third_of_wrong_images_never_ends_in_wrong_poses() {
    let mut whole = 0;
    for seed in 0..12 {
        let (given, truth) = given(100 + seed, 7, 4, 0.3);
        let found = found(&given);
        let started = found.poses.iter().flatten().count();
        if started > 3 {
            assert!(found.misfit.unwrap() < 1e-3, "seed {seed}: {:?}", found.misfit);
        }
        whole += usize::from(farthest(&found, &truth) < 0.02);
    }
    assert!(whole >= 9, "{whole} of 12");
}

#[test]
fn images_alone_give_the_form() {
    let (given, truth) = given(7, 9, 0, 0.1);
    let found = found(&given);
    assert_eq!(found.frame, Frame::FirstPhoto(0));
    let base = (truth[1].position - truth[0].position).norm();
    let place = |k: usize| found.poses[k].unwrap().0.position;
    for k in 2..9 {
        let (own, real) =
            ((place(k) - place(1)).norm(), (truth[k].position - truth[1].position).norm() / base);
        assert!((own - real).abs() < 1e-3 * real.max(1.0), "photo {k}: {own} for {real}");
    }
}
