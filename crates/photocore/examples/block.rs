//! A small aerial block: eight photos in two strips over four control points, with the precision of every station.

use std::error::Error;

use photocore::geometry::{self, ObjectSpace, Perspective, PoseNumbers, RotationSense};
use photocore::network::{Camera, Image, Network, Options, Photo, Point, Solution};

const SPACE: ObjectSpace = ObjectSpace::Rectangular;
const SENSE: RotationSense = RotationSense::GroundToPhoto;
/// Negative: the positive plane.
const PRINCIPAL_DISTANCE: f64 = -150.0;
/// Standard deviation of image coordinates in millimetres.
const IMAGE_SD: f64 = 0.005;

/// Returns a reproducible number between -1 and 1 for each index.
fn noise(index: usize) -> f64 {
    let turned = (index as f64 + 1.0) * 0.618_033_988_749_895;
    2.0 * turned.fract() - 1.0
}

/// Returns a block with photos every 600 m from 1,500 m above ground and points every 300 m; the corners are control points.
fn block() -> Network {
    let station = |i: usize| [600.0 * (i % 4) as f64, 900.0 * (i / 4) as f64, 1500.0];
    let ground = |i: usize| [300.0 * (i % 7) as f64, 300.0 * (i / 7) as f64, 20.0 * noise(i)];
    let corner = |i: usize| (i % 7).is_multiple_of(6) && (i / 7).is_multiple_of(3);
    let mut images = vec![];
    for photo in 0..8 {
        let seen = geometry::View::new(SPACE, SENSE, station(photo), [0.0, 0.0, 0.1], PRINCIPAL_DISTANCE);
        for point in 0..28 {
            let [x, y] = seen.project(&geometry::Point::new(SPACE, ground(point)));
            if x.abs() < 115.0 && y.abs() < 115.0 {
                let at = 2 * images.len();
                let xy = [x + IMAGE_SD * noise(at), y + IMAGE_SD * noise(at + 1)];
                images.push(Image { photo, point, xy, sd: [IMAGE_SD; 2] });
            }
        }
    }
    let photo = |i: usize| {
        let [x, y, z] = station(i);
        let pose = [x + 20.0, y - 15.0, z + 10.0, 0.01, -0.01, 0.12];
        Photo::free(pose, 0)
    };
    let point = |i: usize| {
        if corner(i) {
            Point { coordinates: ground(i), sd: [0.05; 3] }
        } else {
            Point { coordinates: [f64::NAN; 3], sd: [f64::INFINITY; 3] }
        }
    };
    Network {
        space: SPACE,
        poses: PoseNumbers::Angles(SENSE),
        refraction: None,
        cameras: vec![Camera::held(Perspective { principal_distance: PRINCIPAL_DISTANCE }.into())],
        photos: (0..8).map(photo).collect(),
        points: (0..28).map(point).collect(),
        images,
        observations: vec![],
        commons: vec![],
        mounts: vec![],
        trajectories: vec![],
        image_times: vec![],
        image_corrections: vec![],
    }
}

/// Adjusts the block.
pub fn adjusted() -> Result<Solution, Box<dyn Error>> {
    let network = block();
    Ok(network.adjust(&Options::default())?)
}

/// Prints the stations.
pub fn main() -> Result<(), Box<dyn Error>> {
    let solution = adjusted()?;
    let variance = solution.variance_of_unit_weight.unwrap_or(1.0);
    println!("{} degrees of freedom, variance of unit weight {variance:.2}", solution.degrees_of_freedom);
    for (index, photo) in solution.photos.iter().enumerate() {
        let [x, y, z, ..] = photo.pose;
        let sd = |k: usize| (variance * photo.cofactors[7 * k]).sqrt();
        println!("photo {index}: {x:9.3} {y:9.3} {z:9.3} m, sd {:.3} {:.3} {:.3} m", sd(0), sd(1), sd(2));
    }
    Ok(())
}
