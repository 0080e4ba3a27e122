//! Networks in the nodes of a tree (Helmert blocking) against the same in one piece.

#![allow(clippy::unwrap_used, clippy::panic)]

mod cut;

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use cut::{Cut, TREES};
use photocore::adjustment::{self, Event, Method, Stop};
use photocore::geometry::{ObjectSpace, Orientation, Perspective, Point as At, PoseNumbers, RotationSense};
use photocore::network::observations::Distance;
use photocore::network::{
    BlockOf, Camera, Image, Network, NetworkError, Node, Options, Photo, Point, Solution, Surroundings,
};
use photocore::normals::Contribution;
use proptest::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

const FREE: f64 = f64::INFINITY;
const SD: f64 = 0.005;
const POSES: PoseNumbers = PoseNumbers::Angles(RotationSense::GroundToPhoto);
const SPACE: ObjectSpace = ObjectSpace::Rectangular;

/// A number between -1 and 1 for each index.
fn noise(seed: u64, index: usize) -> f64 {
    ((seed as f64 * 0.37 + index as f64 * 12.9898).sin() * 43758.5453).fract()
}

/// What of a network is drawn.
#[derive(Debug, Clone)]
struct Drawn {
    seed: u64,
    photos: [usize; 2],
    /// Of every second photo, positions are weighted, some attitudes too, and one is fixed.
    weighted: bool,
    /// Whether the photos share a camera of unknown principal distance.
    calibrated: bool,
    lengths: usize,
}

/// Photos in strips over uneven ground, control at its corners.
fn network(drawn: &Drawn) -> Network {
    let [strips, length] = drawn.photos;
    let noise = |index: usize| noise(drawn.seed, index);
    let pose = |index: usize| {
        let (strip, photo) = (index / length, index % length);
        let [x, y] = [
            400.0 * photo as f64 + 20.0 * noise(7 * index),
            700.0 * strip as f64 + 20.0 * noise(7 * index + 1),
        ];
        let angles: [f64; 3] = std::array::from_fn(|k| 0.02 * noise(7 * index + 2 + k));
        // Far from zero: coordinates are counted from the middle.
        [
            500_000.0 + x,
            5_000_000.0 + y,
            1500.0 + 10.0 * noise(7 * index + 5),
            angles[0],
            angles[1],
            angles[2],
        ]
    };
    let rows = [200.0_f64, 230.0].map(|step| ((700.0 * strips as f64 + 200.0) / step) as usize + 2);
    let columns = ((400.0 * length as f64 + 200.0) / 200.0) as usize;
    let place = |row: usize, column: usize| {
        let own = 100_000 + 3 * (row * columns + column);
        let [x, y] = [
            200.0 * column as f64 - 300.0 + 60.0 * noise(own),
            230.0 * row as f64 - 300.0 + 60.0 * noise(own + 1),
        ];
        [500_000.0 + x, 5_000_000.0 + y, 80.0 * noise(own + 2)]
    };
    let places: Vec<[f64; 3]> = (0..rows[1])
        .flat_map(|row| (0..columns).map(move |column| (row, column)))
        .map(|(row, column)| place(row, column))
        .collect();
    let camera = Perspective { principal_distance: -150.0 };
    let mut images = Vec::new();
    for photo in 0..strips * length {
        let orientation = Orientation::new(POSES, SPACE, &pose(photo));
        let view = photocore::geometry::Photo { orientation, camera };
        for (point, &at) in places.iter().enumerate() {
            let xy = view.project(&At::new(SPACE, at));
            if xy.iter().all(|value| value.abs() < 62.0) {
                let n = 2 * images.len() + 500_000;
                let xy = [0, 1].map(|k| xy[k] + SD * noise(n + k));
                images.push(Image { photo, point, xy, sd: [SD; 2] });
            }
        }
    }
    let photo = |index: usize| {
        let (truth, own) = (pose(index), 300_000 + 12 * index);
        let start = std::array::from_fn(|k| truth[k] + if k < 3 { 3.0 } else { 0.003 } * noise(own + k));
        let mut sd = [FREE; 6];
        if drawn.weighted && index.is_multiple_of(2) {
            sd[..3].fill(0.3);
            sd[3..].fill(if index.is_multiple_of(4) { 1e-3 } else { FREE });
        }
        let mut photo = Photo {
            pose: start,
            observed: std::array::from_fn(|k| truth[k] + sd[k].min(1.0) * noise(own + 6 + k)),
            sd,
            camera: 0,
        };
        if drawn.weighted && index == 1 {
            (photo.sd[5], photo.pose[5]) = (0.0, truth[5]);
        }
        photo
    };
    let corner = |point: usize| {
        let (row, column) = (point / columns, point % columns);
        [2, rows[1] / 2, rows[1] - 3].contains(&row) && column % 5 == 2
    };
    let point =
        |point: usize| Point { coordinates: places[point], sd: [if corner(point) { 0.02 } else { FREE }; 3] };
    let mut seen = vec![0; places.len()];
    images.iter().for_each(|image| seen[image.point] += 1);
    let good: Vec<usize> = (0..places.len()).filter(|&point| seen[point] > 1).collect();
    let any = |index: usize| good[((noise(index).abs() * good.len() as f64) as usize).min(good.len() - 1)];
    let ends = (0..drawn.lengths).map(|k| [any(900 + 2 * k), any(901 + 2 * k)]).filter(|[a, b]| a != b);
    let length = |points: [usize; 2]| {
        let squares = (0..3).map(|k| (places[points[0]][k] - places[points[1]][k]).powi(2));
        let length = squares.sum::<f64>().sqrt() + 0.02 * noise(points[0] + 77);
        Distance { points, length, sd: 0.02, instrument: None }.into()
    };
    let sd = vec![if drawn.calibrated { 0.5 } else { 0.0 }];
    let start = Perspective { principal_distance: if drawn.calibrated { -150.02 } else { -150.0 } };
    Network {
        space: SPACE,
        poses: POSES,
        refraction: None,
        cameras: vec![Camera::new(start.into(), sd)],
        photos: (0..strips * drawn.photos[1]).map(photo).collect(),
        points: (0..places.len()).map(point).collect(),
        images,
        observations: ends.map(length).collect(),
        commons: vec![],
        mounts: vec![],
    }
}

/// What is at home in a node: its network, and its photos, points and images in the whole one.
struct Piece {
    node: Node,
    photos: Vec<usize>,
    points: Vec<usize>,
    images: Vec<usize>,
    observations: Vec<usize>,
    /// Whether a photo or point is at home.
    own: (Vec<bool>, Vec<bool>),
}

fn options() -> Options {
    let method = Method::Damped(Stop::Fraction(1e-6));
    Options { adjustment: adjustment::Options { method, ..Default::default() }, ..Options::default() }
}

fn go(_: Event) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn pool() -> ThreadPool {
    ThreadPoolBuilder::new().num_threads(2).build().unwrap()
}

/// Blocks of unknowns as vertices: photos, then the camera, then points that lengths touch. With them what stands together: the points that
/// only images touch, the images of the others, the lengths.
fn cliques(network: &Network, tied: &[usize]) -> Vec<Vec<usize>> {
    let photos = network.photos.len();
    let camera = (!network.cameras[0].is_held()).then_some(photos);
    let vertex = |point: usize| tied.iter().position(|&own| own == point).map(|place| photos + 1 + place);
    let mut of_points = vec![BTreeSet::new(); network.points.len()];
    let mut of_images = vec![];
    for image in &network.images {
        let blocks = std::iter::once(image.photo).chain(camera);
        match vertex(image.point) {
            None => of_points[image.point].extend(blocks),
            Some(own) => of_images.push(blocks.chain([own]).collect()),
        }
    }
    let of_points = of_points.into_iter().map(|blocks| blocks.into_iter().collect());
    let lengths = network
        .observations
        .iter()
        .map(|own| own.touches().points.iter().filter_map(|&point| vertex(point)).collect::<Vec<usize>>());
    of_points.chain(of_images).chain(lengths).collect()
}

fn pieces(network: &Network, tree: &[Option<usize>], seed: u64) -> (Cut, Vec<Piece>) {
    let touched: BTreeSet<usize> = network.observations.iter().flat_map(|own| own.touches().points).collect();
    let tied: Vec<usize> = touched.into_iter().collect();
    let photos = network.photos.len();
    let leaves: Vec<usize> = (0..tree.len()).filter(|node| !tree.contains(&Some(*node))).collect();
    let along =
        |photo: usize| (network.photos[photo].pose[0] - 499_900.0) / 4000.0 + 0.05 * noise(seed, photo);
    let leaf = |photo| leaves[((along(photo).clamp(0.0, 0.99)) * leaves.len() as f64) as usize];
    let node_of: Vec<usize> =
        (0..photos).map(leaf).chain([tree.len() - 1]).chain(vec![leaves[0]; tied.len()]).collect();
    let cut = Cut::new(tree, &cliques(network, &tied), node_of);
    let pieces = (0..tree.len()).map(|p| piece(network, &cut, &tied, p)).collect();
    (cut, pieces)
}

fn piece(network: &Network, cut: &Cut, tied: &[usize], p: usize) -> Piece {
    let count = network.photos.len();
    let blocks = cut.blocks(p);
    let photos: Vec<usize> = blocks.iter().copied().filter(|&block| block < count).collect();
    let is_tied = |point: usize| tied.binary_search(&point).is_ok();
    let mut tied_images = 0;
    let mut home = |image: &Image| {
        if !is_tied(image.point) {
            return cut.homes[image.point];
        }
        tied_images += 1;
        cut.homes[network.points.len() + tied_images - 1]
    };
    let images: Vec<usize> =
        (0..network.images.len()).filter(|&image| home(&network.images[image]) == p).collect();
    let first = network.points.len() + network.images.iter().filter(|image| is_tied(image.point)).count();
    let observations: Vec<usize> =
        (0..network.observations.len()).filter(|&row| cut.homes[first + row] == p).collect();
    let seen = images.iter().map(|&image| network.images[image].point);
    let named = blocks.iter().filter(|&&block| block > count).map(|&block| tied[block - count - 1]);
    let points: BTreeSet<usize> = seen.chain(named).collect();
    let points: Vec<usize> = points.into_iter().collect();
    let place = |all: &[usize], own: usize| all.iter().position(|&each| each == own).unwrap();
    let image = |&row: &usize| {
        let given = network.images[row];
        Image { photo: place(&photos, given.photo), point: place(&points, given.point), ..given }
    };
    let length = |&row: &usize| {
        let photocore::network::Observation::Distance(mut own) = network.observations[row].clone() else {
            panic!("a length");
        };
        own.points = own.points.map(|point| place(&points, point));
        own.into()
    };
    let own = Network {
        photos: photos.iter().map(|&photo| network.photos[photo]).collect(),
        points: points.iter().map(|&point| network.points[point]).collect(),
        images: images.iter().map(image).collect(),
        observations: observations.iter().map(length).collect(),
        ..network.clone()
    };
    let name = |&block: &usize| match block.checked_sub(count) {
        None => BlockOf::Photo(place(&photos, block)),
        Some(0) => BlockOf::Camera(0),
        Some(point) => BlockOf::Point(place(&points, tied[point - 1])),
    };
    let names = |blocks: &Vec<usize>| blocks.iter().map(name).collect::<Vec<BlockOf>>();
    let below = cut.children(p).iter().map(|&child| names(&cut.outer[child])).collect();
    let surroundings =
        Surroundings { outer: names(&cut.outer[p]), below, middle: Some([502_000.0, 5_000_500.0, 1500.0]) };
    let node = own.node(&options(), surroundings, &pool()).unwrap();
    let at_home = |point: &usize| match tied.binary_search(point) {
        Ok(place) => cut.node_of[count + 1 + place] == p,
        Err(_) => true,
    };
    let own =
        (photos.iter().map(|&photo| cut.node_of[photo] == p).collect(), points.iter().map(at_home).collect());
    Piece { node, photos, points, images, observations, own }
}

/// The network adjusted in its nodes by full steps: the solution of each, and the largest changes.
fn adjusted(cut: &Cut, pieces: &[Piece]) -> (Vec<Solution>, Vec<f64>) {
    let pool = pool();
    let mut states: Vec<Vec<f64>> = pieces.iter().map(|piece| piece.node.initial().to_vec()).collect();
    let mut changes: Vec<f64> = vec![];
    loop {
        let (mut formed, mut left, mut decrease) = (vec![], vec![], 0.0);
        for (p, piece) in pieces.iter().enumerate() {
            let given: Vec<Contribution<'_>> =
                cut.children(p).iter().map(|&child| std::mem::take(&mut left[child])).collect();
            let mut own = piece.node.form(&states[p], &given, 0.0, &pool, &mut go).unwrap();
            assert_eq!(piece.node.undetermined(&own), None);
            decrease += own.decrease();
            left.push(own.take_contribution());
            formed.push(own);
        }
        let change = decrease.sqrt();
        let rate = changes.last().map_or(1.0, |before| change / before);
        changes.push(change);
        let mut handed = vec![vec![]; pieces.len()];
        for (p, piece) in pieces.iter().enumerate().rev() {
            let step = piece.node.solve(&formed[p], &handed[p], &pool, &mut go).unwrap();
            for (child, places) in cut.children(p).into_iter().zip(piece.node.below()) {
                handed[child] = places.iter().map(|&place| step[place]).collect();
            }
            states[p] = piece.node.advance(&states[p], &step).unwrap();
        }
        if change <= 1e-6 || change <= 1e-3 && rate < 1.0 && rate / (1.0 - rate) * change <= 1e-6 {
            let mut handed = vec![vec![]; pieces.len()];
            let mut solutions = vec![];
            for ((p, piece), formed) in pieces.iter().enumerate().zip(formed).rev() {
                let (solution, below) =
                    piece.node.invert(formed, &handed[p], &states[p], &pool, &mut go).unwrap();
                for (child, cofactors) in cut.children(p).into_iter().zip(below) {
                    handed[child] = cofactors;
                }
                solutions.insert(0, solution);
            }
            return (solutions, changes);
        }
        assert!(changes.len() < 20);
    }
}

fn assert_close(actual: f64, expected: f64, tolerance: f64, what: &str) {
    let same = (actual - expected).abs() <= tolerance || actual.is_nan() && expected.is_nan();
    assert!(same, "{what}: {actual:e} instead of {expected:e}");
}

/// Every element of a cofactor matrix, in the root of the product of its diagonal elements.
fn compare_cofactors(found: &[f64], exact: &[f64], what: &str) {
    let width = exact.len().isqrt();
    for (k, (a, b)) in found.iter().zip(exact).enumerate() {
        let scale = (exact[k / width * (width + 1)] * exact[k % width * (width + 1)]).sqrt();
        assert_close(*a, *b, 1e-9 * scale.max(1e-300), what);
    }
}

fn compare(drawn: &Drawn, tree: &[Option<usize>]) {
    let network = network(drawn);
    let exact = network.adjust(&options(), &pool(), &mut go).unwrap();
    let (cut, pieces) = pieces(&network, tree, drawn.seed);
    let (solutions, changes) = adjusted(&cut, &pieces);
    assert_eq!(changes.len(), exact.adjustment.iterations.len());
    let (mut sum, mut freedom) = (0.0, 0);
    for (piece, found) in pieces.iter().zip(&solutions) {
        sum += found.sums_of_squares.total();
        freedom += found.adjustment.counts.degrees_of_freedom();
        for (i, &photo) in piece.photos.iter().enumerate().filter(|&(i, _)| piece.own.0[i]) {
            let (a, b) = (&found.photos[i], &exact.photos[photo]);
            for k in 0..6 {
                let sd = b.cofactors[7 * k].sqrt();
                assert_close(a.pose[k], b.pose[k], 1e-9 * sd + 1e-15 * b.pose[k].abs(), "pose");
                assert_close(a.redundancy[k], b.redundancy[k], 1e-9, "redundancy of a pose");
            }
            compare_cofactors(&a.cofactors, &b.cofactors, "cofactors of a photo");
        }
        for (i, &point) in piece.points.iter().enumerate().filter(|&(i, _)| piece.own.1[i]) {
            let (Some(a), Some(b)) = (&found.points[i], &exact.points[point]) else {
                assert!(found.points[i].is_none() && exact.points[point].is_none());
                continue;
            };
            for k in 0..3 {
                let sd = b.cofactors[k][k].sqrt();
                assert_close(
                    a.coordinates[k],
                    b.coordinates[k],
                    1e-9 * sd + 1e-15 * b.coordinates[k].abs(),
                    "point",
                );
                assert_close(a.redundancy[k], b.redundancy[k], 1e-9, "redundancy of control");
            }
            compare_cofactors(a.cofactors.as_flattened(), b.cofactors.as_flattened(), "cofactors of a point");
        }
        for (i, &image) in piece.images.iter().enumerate() {
            let (a, b) = (&found.images[i], &exact.images[image]);
            let Some((a, b)) = a.as_ref().zip(b.as_ref()) else { continue };
            for k in 0..2 {
                assert_close(a.residual[k], b.residual[k], 1e-8 * SD, "residual");
                assert_close(a.redundancy[k], b.redundancy[k], 1e-9, "redundancy of an image");
            }
        }
        for (i, &row) in piece.observations.iter().enumerate() {
            let [a, b] = [&found.observations[i], &exact.observations[row]].map(|own| own.as_ref().unwrap());
            assert_close(a.residual[0], b.residual[0], 1e-8, "residual of a length");
            assert_close(a.redundancy[0], b.redundancy[0], 1e-9, "redundancy of a length");
        }
    }
    let total = exact.sums_of_squares.total();
    assert_close(sum, total, 1e-9 * total, "sum of squares");
    assert_eq!(freedom, exact.adjustment.counts.degrees_of_freedom());
    let (root, camera) = (&solutions[solutions.len() - 1].cameras[0], &exact.cameras[0]);
    assert_close(root.parameters[0], camera.parameters[0], 1e-9 * camera.cofactors[0].sqrt(), "camera");
    compare_cofactors(&root.cofactors, &camera.cofactors, "cofactors of the camera");
    assert_close(root.redundancy[0], camera.redundancy[0], 1e-9, "redundancy of the camera");
}

fn networks() -> impl Strategy<Value = Drawn> {
    let shape = (any::<u32>(), 2..4usize, 6..11usize, any::<bool>(), any::<bool>(), 0..5usize);
    shape.prop_map(|(seed, strips, length, weighted, calibrated, lengths)| Drawn {
        seed: u64::from(seed % 1000),
        photos: [strips, length],
        weighted,
        calibrated,
        lengths,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    #[test]
    fn nodes_agree_with_one_piece(drawn in networks(), tree in 0..TREES.len()) {
        compare(&drawn, TREES[tree]);
    }
}

#[test]
fn seven_nodes_with_everything_agree_with_one_piece() {
    compare(&Drawn { seed: 5, photos: [3, 10], weighted: true, calibrated: true, lengths: 4 }, TREES[3]);
}

#[test]
fn blocks_that_are_not_there_are_refused() {
    let network = network(&Drawn { seed: 1, photos: [2, 4], weighted: false, calibrated: false, lengths: 0 });
    let missing = BlockOf::Photo(8);
    // A camera that is known has no unknowns.
    for block in
        [missing, BlockOf::Camera(0), BlockOf::Camera(1), BlockOf::Common(0), BlockOf::Point(100_000)]
    {
        let surroundings = Surroundings { outer: vec![block], ..Surroundings::default() };
        let refused = network.node(&options(), surroundings, &pool()).err();
        assert_eq!(refused, Some(NetworkError::NoBlock(block)));
    }
}
