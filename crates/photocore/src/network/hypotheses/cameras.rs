//! Parameters of cameras: fixed principal distance, principal point and terms of distortion; exchanged coordinates of the principal point;
//! the principal distance of some photos.

use super::super::trial::Trial;
use super::catalogue::{Catalogue, put};
use crate::adjustment::{Equation, Shared};
use crate::geometry::camera::each_camera;
use crate::geometry::{Camera, CameraModel};

/// Cameras that are tested, those with the most photos.
pub(super) const MOST_CAMERAS: usize = 4;
/// Different cameras from which on none is tested: each photo has its own.
const MOST_GROUPS: usize = 32;
/// Terms of distortion of each.
const MOST_TERMS: usize = 6;
/// Sets of photos of each: strips, or cameras with equal parameters.
const MOST_SETS: usize = 8;
/// Plausible error of the principal distance, relative.
const DISTANCE: f64 = 0.05;
/// Plausible error of the principal point, in widths of the image.
const POINT: f64 = 0.02;
/// Plausible share of an exchange of its coordinates, or of a change of the image size: all of it.
const SHARE: f64 = 1.0;
/// Photos of each half of a flight.
const FEWEST_OF_HALF: usize = 3;

const DISTANCES: [&str; 4] = ["f", "c", "fx", "fy"];
pub(super) const POINTS: [&str; 4] = ["cx", "cy", "xp", "yp"];

pub(super) fn add(catalogue: &mut Catalogue<'_>, trial: &Trial) {
    for photos in equal_cameras(catalogue).into_iter().take(MOST_CAMERAS) {
        let distance = of_camera(catalogue, trial, trial.camera_of_photo[photos[0]], &photos);
        of_sets(catalogue, trial, &photos, distance);
    }
}

/// The photos of each camera, those of the most photos first. Cameras with equal parameters are one: a block may have one for each photo.
pub(super) fn equal_cameras(catalogue: &Catalogue<'_>) -> Vec<Vec<usize>> {
    let bundle = catalogue.bundle;
    let mut groups: Vec<(&'static str, Vec<f64>, Vec<usize>)> = vec![];
    for (photo, images) in bundle.images_on.iter().enumerate() {
        // What a scanned film sees is not the image of its camera.
        if *images == 0 || !bundle.image_corrections.is_empty() {
            continue;
        }
        let camera = &catalogue.linearization.photos[photo].camera;
        let (name, parameters) = (camera.name(), camera.parameters());
        match groups.iter().position(|own| own.0 == name && own.1 == parameters) {
            Some(place) => groups[place].2.push(photo),
            None if groups.len() < MOST_GROUPS => groups.push((name, parameters, vec![photo])),
            None => return vec![],
        }
    }
    groups.sort_by_key(|own| std::cmp::Reverse(own.2.len()));
    groups.into_iter().map(|own| own.2).collect()
}

/// The parameters of a camera; the column of the principal distance, if it is fixed.
fn of_camera(catalogue: &mut Catalogue<'_>, trial: &Trial, camera: usize, photos: &[usize]) -> Option<usize> {
    let own: Camera = catalogue.linearization.photos[photos[0]].camera.clone();
    let fixed = trial.fixed_parameters(photos[0], own.parameter_names().len());
    let fixed: Vec<(usize, &'static str)> =
        fixed.into_iter().map(|parameter| (parameter, own.parameter_names()[parameter].0)).collect();
    let width = catalogue.facts.widths.get(camera).copied().unwrap_or(f64::NAN);
    let of = |names: &[&str]| -> Vec<(usize, &'static str)> {
        fixed.iter().filter(|own| names.contains(&own.1)).copied().collect()
    };
    let (distances, points) = (of(&DISTANCES), of(&POINTS));
    let others = fixed.iter().filter(|own| !DISTANCES.contains(&own.1) && !POINTS.contains(&own.1));
    let mut hypotheses =
        vec![("camera-f", distances, DISTANCE * own.scale()), ("camera-point", points, POINT * width)];
    hypotheses.extend(others.take(MOST_TERMS).map(|&own| ("camera-term", vec![own], f64::NAN)));
    let count = own.parameter_names().iter().filter(|own| DISTANCES.contains(&own.0)).count();
    let (mut whole, mut exchanged, mut middle) = (None, None, vec![]);
    for (code, parameters, size) in hypotheses.into_iter().filter(|own| !own.1.is_empty()) {
        let names: Vec<&'static str> = parameters.iter().map(|own| own.1).collect();
        // One error of both principal distances; another scale of one axis is an affinity.
        let names = if names == ["fx", "fy"] { vec!["fx, fy"] } else { names };
        let plausible = if size.is_finite() { vec![size; names.len()] } else { vec![] };
        let columns = catalogue.add((code, Some(camera)), &names, &plausible);
        for &photo in photos {
            let own = parameters.iter().zip(columns.iter().cycle());
            catalogue.cameras[photo].extend(own.map(|(own, &column)| (own.0, column)));
        }
        match (code, &columns[..], &parameters[..]) {
            ("camera-f", &[column], own) if own.len() == count => whole = Some(column),
            ("camera-point", &[first, second], &[(x, _), (y, name)]) => {
                let between = own.parameters()[y] - own.parameters()[x];
                if name == POINTS[1] {
                    middle = vec![(first, own.parameters()[x]), (second, own.parameters()[y])];
                }
                let exchange = [(first, between), (second, -between)];
                exchanged = (between != 0.0).then_some(exchange);
            }
            _ => {}
        }
    }
    if let Some(columns) = exchanged {
        catalogue.add_combination(
            ("camera-exchanged", Some(camera)),
            &["share"],
            &[SHARE],
            vec![columns.to_vec()],
        );
    }
    if let (Some(column), false) = (whole, middle.is_empty()) {
        // Images of another size: all pixels of the camera change by one factor.
        middle.push((column, own.scale()));
        catalogue.add_combination(("camera-size", Some(camera)), &["share"], &[SHARE], vec![middle]);
    }
    whole
}

/// The principal distance, fixed or free, of the photos of a strip, of the first and the second half of the photos, and of one of several
/// cameras with equal parameters.
fn of_sets(catalogue: &mut Catalogue<'_>, trial: &Trial, photos: &[usize], whole: Option<usize>) {
    let camera: Camera = catalogue.linearization.photos[photos[0]].camera.clone();
    let named = camera.parameter_names().iter().enumerate();
    let distances: Vec<usize> = named.filter(|own| DISTANCES.contains(&own.1.0)).map(|own| own.0).collect();
    let strips = &catalogue.facts.position_sets;
    let of_strips = photos.iter().filter_map(|&photo| Some((photo, strips.get(photo).copied().flatten()?)));
    let of_cameras = photos.iter().map(|&photo| (photo, trial.camera_of_photo[photo]));
    let (of_strips, of_cameras): (Vec<_>, Vec<_>) = (of_strips.collect(), of_cameras.collect());
    let half = photos.len() / 2;
    // Two strips are these halves.
    let are_strips = of_strips.iter().map(|own| own.1).max() == Some(1);
    let of_halves = if half < FEWEST_OF_HALF || are_strips { &[] } else { photos };
    let of_halves: Vec<_> =
        of_halves.iter().enumerate().map(|(k, &photo)| (photo, usize::from(k >= half))).collect();
    let sets = [("camera-f-strip", of_strips), ("camera-f-half", of_halves), ("camera-f-single", of_cameras)];
    for (code, of) in sets {
        let mut sets: Vec<usize> = of.iter().map(|own| own.1).collect();
        sets.sort_unstable();
        sets.dedup();
        if distances.is_empty() || !(2..=MOST_SETS).contains(&sets.len()) {
            continue;
        }
        let (mut first, size) = (None, DISTANCE * camera.scale());
        for set in sets {
            if let ("camera-f-half", Some(first), Some(whole)) = (code, first, whole) {
                // The second half is the rest.
                let rest = vec![vec![(whole, 1.0), (first, -1.0)]];
                catalogue.add_combination((code, Some(set)), &["f"], &[size], rest);
                continue;
            }
            let column = catalogue.add((code, Some(set)), &["f"], &[size])[0];
            first = Some(column);
            for &(photo, _) in of.iter().filter(|own| own.1 == set) {
                catalogue.cameras[photo].extend(distances.iter().map(|&parameter| (parameter, column)));
            }
        }
    }
}

impl Catalogue<'_> {
    /// Partials of an image by parameters of its camera.
    pub(super) fn camera_partials(
        &self,
        (image, local, row): (usize, usize, usize),
        equation: &Equation<'_>,
        shared: &mut Shared,
        partials: &mut Vec<(usize, f64)>,
    ) {
        let observed = &self.bundle.images[image];
        let columns = &self.cameras[observed.photo];
        if columns.is_empty() || equation.sd.is_infinite() {
            return;
        }
        if shared.group.replace(image) != Some(image) {
            shared.values.clear();
            self.write_camera_partials((image, local), &mut shared.values);
        }
        for (&(_, column), values) in columns.iter().zip(shared.values.chunks_exact(2)) {
            put(partials, column, values[row] / equation.sd);
        }
    }

    /// Appends the partials of both coordinates of an image by each tested parameter of its camera.
    fn write_camera_partials(&self, (image, local): (usize, usize), values: &mut Vec<f64>) {
        let observed = &self.bundle.images[image];
        let station = &self.linearization.photos[observed.photo];
        let to_camera_frame = match self.linearization.plain {
            false => self.bundle.corrected_sight(&self.linearization, image, local),
            true => station.orientation.to_camera_frame(&self.linearization.points[local]),
        };
        each_camera!(&station.camera, camera => {
            let (_, computed) = camera.compare(&to_camera_frame, observed.xy);
            let by_parameters = computed.by_parameters.each_ref().map(|row| row.as_ref());
            for &(parameter, _) in &self.cameras[observed.photo] {
                values.extend(by_parameters.map(|row| row[parameter]));
            }
        });
    }
}

impl Trial {
    /// Parameters of the camera of a photo that are fixed.
    fn fixed_parameters(&self, photo: usize, count: usize) -> Vec<usize> {
        let (model, problem) = (&self.assembled.problem.model, &self.assembled.problem);
        let first = match model.blocks.of_camera[photo] {
            Some(block) => model.of_block(block).start,
            None if model.has_own_camera(photo) => model.of_block(photo).start + 6,
            None => return (0..count).collect(),
        };
        (0..count).filter(|k| problem.sd.get(first + k).is_some_and(|&sd| sd == 0.0)).collect()
    }
}
