//! A small object in five photos, scaled by a scale bar: the first photo is the datum.

use std::error::Error;

use photocore::geometry::{self, ObjectSpace, Perspective, PoseNumbers, RotationSense};
use photocore::network::observations::Distance;
use photocore::network::{Camera, Image, Network, Options, Photo, Point, Solution};

const SPACE: ObjectSpace = ObjectSpace::Rectangular;
const SENSE: RotationSense = RotationSense::GroundToPhoto;
const CAMERA: Perspective = Perspective { principal_distance: -50.0 };
/// Length of the bar between points 0 and 1, and its standard deviation, in metres.
pub const BAR: (f64, f64) = (1.0, 2e-5);

/// Returns the points of the object; the first two are the ends of the bar.
pub fn place(i: usize) -> [f64; 3] {
    match i {
        0 | 1 => [i as f64 - 0.5, 0.0, 0.0],
        _ => [0.3 * (i % 4) as f64 - 0.5, 0.3 * (i / 4) as f64 - 0.5, 0.05 * (i * i % 7) as f64],
    }
}

/// Returns photos from 3 m above, tilted towards the centre.
fn pose(i: usize) -> [f64; 6] {
    let [x, y] = [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]][i];
    [x, y, 3.0, -f64::atan2(y, 3.0), f64::atan2(x, 3.0), 0.4 * i as f64]
}

/// Returns the network: the length of the bar is observed, poses are weighted with some centimetres, the first is fixed.
fn network() -> Network {
    let mut images = vec![];
    for photo in 0..5 {
        let [x, y, z, omega, phi, kappa] = pose(photo);
        let seen = geometry::View::new(SPACE, SENSE, [x, y, z], [omega, phi, kappa], -50.0);
        for point in 0..16 {
            let xy = seen.project(&geometry::Point::new(SPACE, place(point)));
            images.push(Image { photo, point, xy, sd: [0.001; 2] });
        }
    }
    let photo = |i: usize| {
        let off = if i == 0 { 0.0 } else { 0.03 };
        let pose = pose(i).map(|value| value + off);
        Photo { pose, observed: pose, sd: [if i == 0 { 0.0 } else { f64::INFINITY }; 6], camera: 0 }
    };
    Network {
        space: SPACE,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(CAMERA.into())],
        photos: (0..5).map(photo).collect(),
        points: vec![Point { coordinates: [f64::NAN; 3], sd: [f64::INFINITY; 3] }; 16],
        images,
        observations: vec![Distance { points: [0, 1], length: BAR.0, sd: BAR.1, instrument: None }.into()],
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

/// Adjusts the network.
pub fn adjusted() -> Result<Solution, Box<dyn Error>> {
    let network = network();
    Ok(network.adjust(&Options::default())?)
}

/// Prints the points.
pub fn main() -> Result<(), Box<dyn Error>> {
    let solution = adjusted()?;
    for (index, point) in solution.points.iter().flatten().enumerate() {
        let [x, y, z] = point.coordinates;
        let sd = [0, 1, 2].map(|k| 1e6 * point.cofactors[(k, k)].sqrt());
        println!("point {index}: {x:8.5} {y:8.5} {z:8.5} m, sd {:.0} {:.0} {:.0} um", sd[0], sd[1], sd[2]);
    }
    Ok(())
}
