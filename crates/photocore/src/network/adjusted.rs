//! Adjusted photos, cameras, points and shared parameters.

use std::ops::Range;

use nalgebra::DMatrix;

use super::commons::Common;
use super::input::{Camera, Network, Point};
use super::linearization_point::LinearizationPoint;
use super::model::Bundle;
use super::neighbourhood::TOGETHER;
use super::problem::Assembled;
use crate::adjustment::{Adjustment, Problem};
use crate::geometry::{AttitudeNumbers, Matrix3, POSE, PoseNumbers};
use crate::normals::Cofactors;
use crate::parallel;

/// An adjusted photo.
#[derive(Debug, Clone)]
pub struct AdjustedPhoto {
    /// Six parameters of its pose; for a photo on a frame, the equivalent parameters of the composed pose.
    pub pose: [f64; POSE],
    /// Parameters of its camera.
    pub camera: Vec<f64>,
    /// Cofactors (a priori unit weight) of the pose and its own free camera; NaN without cofactors.
    pub cofactors: DMatrix<f64>,
    /// Redundancy numbers of these parameters as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: Vec<f64>,
    /// Number of active images.
    pub images: usize,
}

/// An adjusted point.
#[derive(Debug, Clone, Copy)]
pub struct AdjustedPoint {
    /// Coordinates in the object space.
    pub coordinates: [f64; 3],
    /// Cofactors (a priori unit weight); NaN without cofactors.
    pub cofactors: Matrix3,
    /// Redundancy numbers of its coordinates as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: [f64; 3],
    /// Correction in the last iteration.
    pub last_correction: [f64; 3],
    /// Number of images.
    pub rays: usize,
    /// Number of images with the point behind the camera.
    pub behind: usize,
}

/// Minimum number of photos per thread.
const PHOTOS_TOGETHER: usize = 128;
pub(super) fn adjusted_photos(
    network: &Network,
    Assembled { problem, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<AdjustedPhoto> {
    let model = &problem.model;
    let origin = model.origin;
    let positions = if let PoseNumbers::Angles(_) = network.poses { 3 } else { 0 };
    let linearization = model.without_points(&unknowns[model.parameter_unknowns()]);
    let photo = |index: usize| {
        let photo = &network.photos[index];
        let range = model.of_photo(index);
        let (first, end) = (range.start, range.end);
        let values = &unknowns[range];
        let angles = reported_angles(model, index, values);
        let absolute = |k: usize| {
            let counted = if k < positions { values[k] + origin[k] } else { values[k] };
            let counted = angles.filter(|_| k >= 3).map_or(counted, |angles| angles[k - 3]);
            // Fixed coordinates are returned bit by bit.
            if k < positions && photo.sd[k] == 0.0 { photo.pose[k] } else { counted }
        };
        // Cofactors of a fixed photo without images are undefined.
        let asked = model.images_on[index] > 0 || problem.sd[first..end].iter().any(|&sd| sd != 0.0);
        let cofactors = adjustment.cofactors.as_ref().filter(|_| asked);
        let redundancy = adjustment.prior_redundancy.as_ref();
        let camera = match model.blocks.of_camera[index] {
            Some(block) => unknowns[model.of_block(block)].to_vec(),
            None if values.len() > POSE => values[POSE..].to_vec(),
            None => model.cameras[index].parameters(),
        };
        if model.is_carried(index) {
            // In a node of a larger network, its images may belong to child nodes.
            let asked = model.images_on[index] > 0 || !problem.layout().contributions().is_empty();
            let cofactors = adjustment.cofactors.as_ref().filter(|_| asked);
            let (pose, cofactors) = mounted_pose(network, problem, &linearization, index, cofactors);
            let redundancy = vec![if cofactors[0].is_nan() { f64::NAN } else { 0.0 }; POSE];
            return AdjustedPhoto { pose, camera, cofactors, redundancy, images: model.images_on[index] };
        }
        AdjustedPhoto {
            pose: std::array::from_fn(absolute),
            camera,
            cofactors: cofactors.map_or_else(
                || DMatrix::repeat(values.len(), values.len(), f64::NAN),
                |all| {
                    let (width, own) = (model.of_block(index).len(), values.len());
                    let square = DMatrix::from_row_slice(width, width, model.cofactors_of_block(all, index));
                    in_angles(model, index, values, square.view((0, 0), (own, own)).into_owned())
                },
            ),
            redundancy: redundancy
                .map_or_else(|| vec![f64::NAN; end - first], |all| all[first..end].to_vec()),
            images: model.images_on[index],
        }
    };
    parallel::map(network.photos.len(), PHOTOS_TOGETHER, photo)
}

/// Returns the six pose parameters of a mounted photo and their cofactors; NaN without cofactors.
fn mounted_pose(
    network: &Network,
    problem: &Problem<Bundle>,
    LinearizationPoint { photos, mounted, .. }: &LinearizationPoint,
    photo: usize,
    cofactors: Option<&Cofactors>,
) -> ([f64; POSE], DMatrix<f64>) {
    let (model, orientation) = (&problem.model, &photos[photo].orientation);
    let (mut pose, taken) = model.reported(orientation);
    let own = mounted.as_ref().and_then(|mounted| mounted.of(photo));
    let found = cofactors.zip(own).zip(taken).map(|((all, own), taken)| {
        let cofactors = model.mounted_cofactors(problem.layout(), own, all);
        DMatrix::from_column_slice(POSE, POSE, (taken * cofactors * taken.transpose()).as_slice())
    });
    if let PoseNumbers::Angles(_) = network.poses {
        (0..3).for_each(|k| pose[k] += model.origin[k]);
    }
    (pose, found.unwrap_or_else(|| DMatrix::repeat(POSE, POSE, f64::NAN)))
}

/// Returns the angles of a photo that steps by a rotation vector; at a singular attitude kappa is zero and omega is the sum.
fn reported_angles(model: &Bundle, photo: usize, values: &[f64]) -> Option<[f64; 3]> {
    let numbers = AttitudeNumbers::OmegaPhiKappa(model.rotation_vector_sense(photo)?);
    let angles = [values[3], values[4], values[5]];
    Some(if numbers.is_singular(angles) { numbers.numbers(&numbers.attitude(angles)) } else { angles })
}

/// Converts cofactors of a photo to its angles by diag(I, K^-1, I) if its attitude steps by a rotation vector rho = K d(angles). NaN for
/// undetermined angles, if phi is 90 degrees.
fn in_angles(model: &Bundle, photo: usize, values: &[f64], mut found: DMatrix<f64>) -> DMatrix<f64> {
    let Some(sense) = model.rotation_vector_sense(photo) else { return found };
    let (numbers, angles) = (AttitudeNumbers::OmegaPhiKappa(sense), [values[3], values[4], values[5]]);
    let inverse = numbers.by_step(angles).unwrap_or_else(|| Matrix3::repeat(f64::NAN));
    let rows = inverse * found.fixed_rows::<3>(3);
    found.fixed_rows_mut::<3>(3).copy_from(&rows);
    let columns = found.fixed_columns::<3>(3) * inverse.transpose();
    found.fixed_columns_mut::<3>(3).copy_from(&columns);
    (&found + found.transpose()) / 2.0
}

pub(super) fn adjusted_points(
    network: &Network,
    Assembled { problem, points, .. }: &Assembled,
    adjustment: &Adjustment,
    unknowns: &[f64],
) -> Vec<Option<AdjustedPoint>> {
    let (model, origin) = (&problem.model, problem.model.origin);
    let cofactors = adjustment.cofactors.as_ref();
    let corrections = &adjustment.last_corrections;
    let (local, retained) = model.all_coordinates(unknowns);
    in_order(network.points.len(), points, |point, i| {
        let values = i.checked_sub(model.locals).map_or_else(|| &local[i], |index| &retained[index]);
        let Point { coordinates, sd } = network.points[point];
        let absolute = |k: usize| if sd[k] == 0.0 { coordinates[k] } else { values[k] + origin[k] };
        let first = model.of_point(i).start;
        let own = cofactors.map(|all| match i.checked_sub(model.locals) {
            None => &all.local[9 * i..],
            // Points are the last retained blocks.
            Some(index) => &all.retained[all.retained.len() - 9 * (points.len() - model.locals - index)..],
        });
        let found =
            || own.map_or_else(|| Matrix3::repeat(f64::NAN), |own| Matrix3::from_row_slice(&own[..9]));
        let shifted = model.shifted(i, &unknowns[model.parameter_unknowns()], cofactors);
        let (coordinates, cofactors) = match shifted {
            Some((place, cofactors)) => (std::array::from_fn(|k| place[k] + origin[k]), cofactors),
            None => (std::array::from_fn(absolute), found()),
        };
        AdjustedPoint {
            coordinates,
            cofactors,
            redundancy: adjustment.prior_redundancy(first),
            last_correction: std::array::from_fn(|k| corrections[first + k]),
            rays: model.images_of(i).len(),
            behind: 0,
        }
    })
}

/// Returns `each` for every active item of a network, in the order of the network; None for others. `order` lists the active items in the
/// order of the problem; `each` is called with both indices.
pub(super) fn in_order<T: Send>(
    count: usize,
    order: &[usize],
    each: impl Fn(usize, usize) -> T + Sync,
) -> Vec<Option<T>> {
    let mut place = vec![u32::MAX; count];
    order.iter().zip(0..).for_each(|(&thing, own)| place[thing] = own);
    let of = |thing: usize| {
        let own = place[thing];
        (own != u32::MAX).then(|| each(thing, own as usize))
    };
    parallel::map_in_place(count, TOGETHER, &of)
}

/// An adjusted shared parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCommon {
    /// Adjusted minus given values of its components: the negative of observed minus adjusted.
    pub change: Vec<f64>,
    /// Position, as in [`Common`]; for planes and lines the given position, displaced along their own axes by the offsets in rectangular
    /// space.
    pub position: [f64; 3],
    /// Rotation, as in [`Common`].
    pub attitude: Matrix3,
    /// Cofactors (a priori unit weight) of the components, with rotations about the own axes: zero for fixed components, NaN without
    /// cofactors.
    pub cofactors: DMatrix<f64>,
    /// Cofactors of the components (rows) with the components of the preceding shared parameter of the block; empty for the first.
    pub with_former: DMatrix<f64>,
    /// Redundancy numbers of the components as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: Vec<f64>,
    /// Number of active observations, including images of rigs, that depend on it.
    pub observations: usize,
}

impl Network {
    /// Returns the adjusted shared parameters, in the order of the network.
    pub(super) fn adjusted_commons(
        &self,
        Assembled { problem, .. }: &Assembled,
        adjustment: &Adjustment,
        unknowns: &[f64],
    ) -> Vec<AdjustedCommon> {
        let model = &problem.model;
        let states = model.common_states(&unknowns[model.parameter_unknowns()]);
        let each = |(index, common): (usize, &Common)| {
            let (width, state) = (common.sd.len(), &states[index]);
            let missing = if adjustment.cofactors.is_some() && common.is_held() { 0.0 } else { f64::NAN };
            let mut found = AdjustedCommon {
                change: vec![0.0; width],
                position: common.position,
                attitude: common.attitude,
                cofactors: DMatrix::repeat(width, width, missing),
                with_former: DMatrix::zeros(width, 0),
                redundancy: vec![missing; width],
                observations: model.commons[index].uses,
            };
            let Some(range) = model.of_common(index) else { return found };
            found.change = unknowns[range.clone()].to_vec();
            (found.position, found.attitude) = model.commons[index].reported(state);
            if found.observations == 0 {
                return found;
            }
            if let Some(all) = &adjustment.cofactors {
                let steps = state.about_own_axes();
                let own = &steps * model.cofactors_of_common(all, index) * steps.transpose();
                found.cofactors = (&own + own.transpose()) / 2.0;
                if let Some(former) = model.former_in_block(index) {
                    let turned = states[former].about_own_axes();
                    let mixed = model.cofactors_in_block(all, index, former);
                    found.with_former = &steps * mixed * turned.transpose();
                }
            }
            if let Some(all) = &adjustment.prior_redundancy {
                found.redundancy = all[range].to_vec();
            }
            found
        };
        self.commons.iter().enumerate().map(each).collect()
    }
}

/// An adjusted camera.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedCamera {
    /// Adjusted parameters.
    pub parameters: Vec<f64>,
    /// Cofactors of the parameters (a priori unit weight): zero for fixed ones, NaN without cofactors.
    pub cofactors: DMatrix<f64>,
    /// Redundancy numbers of the parameters as their own observations; zero unless weighted, NaN without cofactors.
    pub redundancy: Vec<f64>,
    /// Diagonal of the normal equations including weights: the reciprocal cofactors if all other parameters were fixed. Zero for fixed
    /// parameters, NaN without cofactors.
    pub information: Vec<f64>,
    /// Number of photos.
    pub photos: usize,
    /// Number of active images of these photos.
    pub images: usize,
}

impl Network {
    /// Returns the adjusted cameras, in the order of the network; `photos` are the adjusted photos.
    pub(super) fn adjusted_cameras(
        &self,
        Assembled { problem, .. }: &Assembled,
        adjustment: &Adjustment,
        unknowns: &[f64],
        photos: &[AdjustedPhoto],
    ) -> Vec<AdjustedCamera> {
        let model = &problem.model;
        let given = |camera: &Camera| {
            let parameters = camera.camera.parameters();
            let count = parameters.len();
            // Results of a camera without photos are undefined.
            let missing = if adjustment.cofactors.is_some() && camera.is_held() { 0.0 } else { f64::NAN };
            AdjustedCamera {
                parameters,
                cofactors: DMatrix::repeat(count, count, missing),
                redundancy: vec![missing; count],
                information: vec![missing; count],
                photos: 0,
                images: 0,
            }
        };
        let mut cameras: Vec<AdjustedCamera> = self.cameras.iter().map(given).collect();
        for (index, (given, photo)) in self.photos.iter().zip(photos).enumerate() {
            let camera = &mut cameras[given.camera];
            camera.photos += 1;
            camera.images += photo.images;
            if model.has_own_camera(index) {
                camera.take_over(photo);
                let own = model.of_photo(index);
                camera.inform(problem, own.start + 6..own.end, adjustment);
            }
        }
        for (shared, &index) in model.blocks.shared.iter().enumerate() {
            let block = model.cameras.len() + shared;
            cameras[index].take_block(model, block, adjustment, unknowns);
            cameras[index].inform(problem, model.of_block(block), adjustment);
        }
        for (camera, given) in cameras.iter_mut().zip(&self.cameras) {
            if let Some(redundancy) = given.redundancy(&camera.cofactors) {
                camera.redundancy = redundancy;
            }
        }
        cameras
    }
}

impl AdjustedCamera {
    /// Copies the results of the camera of one photo, the last parameters of its block.
    fn take_over(&mut self, photo: &AdjustedPhoto) {
        let own = photo.camera.len();
        self.parameters.clone_from(&photo.camera);
        self.redundancy = photo.redundancy[6..].to_vec();
        self.cofactors = photo.cofactors.view((6, 6), (own, own)).into_owned();
    }

    /// Copies the diagonal of the normal equations; zero for fixed parameters.
    fn inform(&mut self, problem: &Problem<Bundle>, unknowns: Range<usize>, adjustment: &Adjustment) {
        let Some(all) = &adjustment.cofactors else { return };
        let first = problem.layout().all_retained().start;
        let of = |unknown: usize| {
            if problem.sd[unknown] == 0.0 { 0.0 } else { all.information[unknown - first] }
        };
        self.information = unknowns.map(of).collect();
    }

    /// Copies the results of a retained block.
    fn take_block(&mut self, model: &Bundle, block: usize, adjustment: &Adjustment, unknowns: &[f64]) {
        let own = model.of_block(block);
        self.parameters = unknowns[own.clone()].to_vec();
        if let Some(all) = &adjustment.cofactors {
            self.cofactors =
                DMatrix::from_row_slice(own.len(), own.len(), model.cofactors_of_block(all, block));
        }
        if let Some(all) = &adjustment.prior_redundancy {
            self.redundancy = all[own].to_vec();
        }
    }
}
