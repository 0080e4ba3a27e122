//! Photos of unknown cameras from a file in the format of "Bundle Adjustment in the Large". Poses, focal lengths and distortions are
//! adjusted from coarse initial values, with covariances.
//!
//! `cargo run --release --example collection -- problem.txt`

use std::error::Error;
use std::{env, fs};

use photocore::adjustment::{self, Method, Stop};
use photocore::geometry::{Bal, CameraModel, PoseNumbers};
use photocore::network::{Camera, Image, Network, Options, Photo, Point, Solution, Start};

/// Reads the numbers of photos, points and observations, the observations (photo, point, x, y), nine values per photo and three per point.
pub fn read(text: &str) -> Result<Network, Box<dyn Error>> {
    let values = text.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    let short = || Box::<dyn Error>::from("the file ends too early");
    let ([photos, points, images], rest) = values.split_first_chunk().ok_or_else(short)?;
    let (seen, rest) = rest.split_at_checked(4 * *images as usize).ok_or_else(short)?;
    let (photos, points) =
        rest.split_at_checked(9 * *photos as usize).map(|(a, b)| (a, (b, points))).ok_or_else(short)?;
    let points = points.0.get(..3 * *points.1 as usize).ok_or_else(short)?;
    let image = |&[photo, point, x, y]: &[f64; 4]| Image {
        photo: photo as usize,
        point: point as usize,
        xy: [x, y],
        sd: [1.0; 2],
    };
    let photo = |(camera, &[a, b, c, d, e, f, ..]): (usize, &[f64; 9])| {
        let pose = [a, b, c, d, e, f];
        Photo::free(pose, camera)
    };
    let camera = |&[.., f, k1, k2]: &[f64; 9]| {
        Camera::new(Bal::with_parameters([f, k1, k2]).into(), vec![f64::INFINITY; 3])
    };
    let photos = photos.as_chunks().0;
    Ok(Network {
        poses: PoseNumbers::Vectors,
        cameras: photos.iter().map(camera).collect(),
        photos: photos.iter().enumerate().map(photo).collect(),
        points: points
            .as_chunks()
            .0
            .iter()
            .map(|&coordinates| Point { coordinates, sd: [f64::INFINITY; 3] })
            .collect(),
        images: seen.as_chunks().0.iter().map(image).collect(),
        ..Network::new()
    })
}

/// Adjusts a network from coarse initial values; as the datum is undefined, some unknowns are fixed.
pub fn adjusted(network: &Network) -> Result<Solution, Box<dyn Error>> {
    let adjustment =
        adjustment::Options { method: Method::TrustRegion(Stop::Decrease(1e-9)), ..Default::default() };
    let options = Options { adjustment, start: Start::Given, hold_unused: true, ..Options::default() };
    Ok(network.adjust(&options)?)
}

/// Prints the focal lengths.
pub fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args().nth(1).ok_or("say which file")?;
    let solution = adjusted(&read(&fs::read_to_string(path)?)?)?;
    let variance = solution.variance_of_unit_weight.unwrap_or(1.0);
    println!("{:?} after {} steps", solution.adjustment.status, solution.adjustment.iterations.len());
    for (index, photo) in solution.photos.iter().enumerate() {
        let sd = (variance * photo.cofactors[6 * 10]).sqrt();
        println!("photo {index}: focal length {:.3} px, sd {sd:.3} px", photo.camera[0]);
    }
    Ok(())
}
