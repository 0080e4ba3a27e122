//! SIMD computation of the equations of several images of one photo.

use pulp::{Arch, Simd, WithSimd};

use super::input::Image;
use crate::geometry::{self, CameraModel, Orientation, POSE, Pose, Vector3};
use crate::normals::GroupRows;

/// Number of images per vector.
const LANES: usize = 8;
/// Minimum number of images for SIMD.
pub(super) const FEWEST: usize = 2;
/// Maximum number of camera parameters; images of larger cameras are computed one by one.
const PARAMETERS: usize = 16;

/// One number per image.
type Lanes = [f64; LANES];

/// A point, its image observation, and the standard deviations.
pub(super) struct ImageObservation<'a> {
    pub point: &'a geometry::Point,
    pub image: &'a Image,
    pub sd: [f64; 2],
}

/// Writes the whitened equations of `count` images of one photo; returns false if the camera or pose does not support SIMD.
#[inline(always)]
pub(super) fn linearize_simd<'s, C: CameraModel>(
    orientation: &Orientation,
    camera: &C,
    count: usize,
    to_camera_frame: &impl Fn(usize) -> ImageObservation<'s>,
    rows: &mut GroupRows<'_>,
) -> bool {
    if C::IN_LANES
        && C::PARAMETERS.len() <= PARAMETERS
        && let Some(pose) = orientation.stepping_pose()
    {
        let mut lanes = Input::default();
        for first in (0..count).step_by(LANES) {
            let own = LANES.min(count - first);
            // Results of unused lanes are computed but ignored.
            for t in 0..own {
                lanes.put(t, &to_camera_frame(first + t));
            }
            write(pose, camera, &lanes, first..first + own, count, rows);
        }
        return true;
    }
    false
}

/// Input numbers of the images.
#[derive(Default, Clone, Copy)]
struct Input {
    point: [Lanes; 3],
    image: [Lanes; 2],
    sd: [Lanes; 2],
}

impl Input {
    #[inline(always)]
    fn put(&mut self, t: usize, to_camera_frame: &ImageObservation<'_>) {
        let position = to_camera_frame.point.position();
        for k in 0..3 {
            self.point[k][t] = position[k];
        }
        for k in 0..2 {
            (self.image[k][t], self.sd[k][t]) = (to_camera_frame.image.xy[k], to_camera_frame.sd[k]);
        }
    }
}

/// Equations of x or y by column.
struct LaneColumns {
    constant: Lanes,
    point: [Lanes; 3],
    photo: [Lanes; POSE],
    camera: [Lanes; PARAMETERS],
}

impl LaneColumns {
    const ZERO: Self = Self {
        constant: [0.0; LANES],
        point: [[0.0; LANES]; 3],
        photo: [[0.0; LANES]; POSE],
        camera: [[0.0; LANES]; PARAMETERS],
    };

    /// Writes one equation into a lane.
    #[inline(always)]
    fn put(
        &mut self,
        t: usize,
        residual: f64,
        (by_photo, by_point): &([f64; POSE], [f64; 3]),
        by_camera: &[f64],
        sd: f64,
    ) {
        let weight = sd.recip();
        self.constant[t] = residual / sd;
        for k in 0..3 {
            self.point[k][t] = by_point[k] * weight;
        }
        for k in 0..POSE {
            self.photo[k][t] = by_photo[k] * weight;
        }
        for k in 0..by_camera.len() {
            self.camera[k][t] = by_camera[k] * weight;
        }
    }
}

/// Computes some images and writes them to their positions among `count`.
#[inline(never)]
fn write<C: CameraModel>(
    pose: &Pose,
    camera: &C,
    input: &Input,
    places: std::ops::Range<usize>,
    count: usize,
    rows: &mut GroupRows<'_>,
) {
    Arch::new().dispatch(Compute { pose, camera, input, places, count, rows });
}

struct Compute<'a, 'r, C> {
    pose: &'a Pose,
    camera: &'a C,
    input: &'a Input,
    places: std::ops::Range<usize>,
    count: usize,
    rows: &'a mut GroupRows<'r>,
}

impl<C: CameraModel> WithSimd for Compute<'_, '_, C> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { input, places, count, rows, .. } = self;
        // Copies without aliases, so that the compiler vectorizes the lanes.
        let (pose, camera) = (*self.pose, self.camera.clone());
        let Input { point, image, sd } = *input;
        let (mut x, mut y) = (LaneColumns::ZERO, LaneColumns::ZERO);
        for t in 0..LANES {
            let u = pose.to_camera_frame(&Vector3::new(point[0][t], point[1][t], point[2][t]));
            let (residual, computed) = camera.compare(&u, [image[0][t], image[1][t]]);
            // Unrolled: a loop would store them in memory.
            let [by_x, by_y] = &computed.by_parameters;
            x.put(t, residual[0], &pose.chain(&u, &computed.by_u[0]), by_x.as_ref(), sd[0][t]);
            y.put(t, residual[1], &pose.chain(&u, &computed.by_u[1]), by_y.as_ref(), sd[1][t]);
        }
        let (width, shared) = (rows.retained.len() / (2 * count), rows.shared.len() / (2 * count));
        let parameters = C::PARAMETERS.len();
        for (t, place) in places.enumerate() {
            for (row, own) in [&x, &y].into_iter().enumerate() {
                let at = 2 * place + row;
                if sd[row][t].is_infinite() {
                    rows.exclude(at);
                    continue;
                }
                rows.constant[at] = own.constant[t];
                put(&mut rows.local[3 * at..][..3], &own.point, t);
                put(&mut rows.retained[width * at..][..POSE], &own.photo, t);
                if width > POSE {
                    put(&mut rows.retained[width * at + POSE..][..parameters], &own.camera, t);
                }
                if shared > 0 {
                    put(&mut rows.shared[shared * at..][..parameters], &own.camera, t);
                }
            }
        }
    }
}

/// Copies one lane of some columns.
#[inline(always)]
fn put(target: &mut [f64], columns: &[Lanes], t: usize) {
    for (value, column) in target.iter_mut().zip(columns) {
        *value = column[t];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::camera::{Perspective, Unit};
    use crate::geometry::{Camera, Matrix3, ObjectSpace, Point, rotation};

    /// Returns the rows of `count` images with a shared camera.
    fn rows_of(count: usize, parameters: usize, fill: impl FnOnce(&mut GroupRows<'_>)) -> Vec<f64> {
        let mut parts = [1, 3, POSE, parameters].map(|width| vec![0.0; 2 * count * width]);
        let [constant, local, retained, shared] = &mut parts;
        fill(&mut GroupRows { constant, local, retained, shared });
        parts.concat()
    }

    fn compare(camera: &Camera, orientation: &Orientation) {
        let count = LANES + 3;
        let points: Vec<Point> = (0..count)
            .map(|t| {
                let t = t as f64;
                Point::new(ObjectSpace::Rectangular, [17.0 * t - 80.0, 90.0 - 13.0 * t, (5.0 * t) % 7.0])
            })
            .collect();
        let images: Vec<Image> = points
            .iter()
            .map(|point| {
                let [x, y] = camera.image(&orientation.to_camera_frame(point));
                Image { photo: 0, point: 0, xy: [x + 0.01, y - 0.02], sd: [0.004, 0.005] }
            })
            .collect();
        let to_camera_frame =
            |t: usize| ImageObservation { point: &points[t], image: &images[t], sd: images[t].sd };
        let parameters = camera.parameters().len();
        let found = rows_of(count, parameters, |rows| {
            let written = crate::geometry::camera::each_camera!(
                camera, camera => linearize_simd(orientation, camera, count, &to_camera_frame, rows)
            );
            assert!(written, "{}", camera.name());
        });
        let expected = rows_of(count, parameters, |rows| {
            for t in 0..count {
                let ImageObservation { point, image, sd } = to_camera_frame(t);
                let u = orientation.to_camera_frame(point);
                let (residual, computed) = camera.compare(&u, image.xy);
                let projection = orientation.projection(
                    &u,
                    &geometry::camera::Image {
                        xy: computed.xy,
                        by_u: computed.by_u,
                        by_parameters: [[0.0]; 2],
                    },
                    point,
                );
                for row in 0..2 {
                    let (at, weight) = (2 * t + row, sd[row].recip());
                    rows.constant[at] = residual[row] * weight;
                    (0..3).for_each(|k| rows.local[3 * at + k] = projection.point[row][k] * weight);
                    (0..POSE).for_each(|k| rows.retained[POSE * at + k] = projection.photo[row][k] * weight);
                    let own = &computed.by_parameters[row];
                    (0..parameters).for_each(|k| rows.shared[parameters * at + k] = own[k] * weight);
                }
            }
        });
        for (found, expected) in found.iter().zip(&expected) {
            let size = expected.abs().max(1e-6);
            assert!((found - expected).abs() < 1e-12 * size, "{}: {found} {expected}", camera.name());
        }
    }

    #[test]
    fn lanes_write_what_single_images_do() {
        let attitude: Matrix3 = rotation([0.02, -0.03, 1.1]).transpose();
        let orientation = Orientation::stepping(ObjectSpace::Rectangular, [3.0, -4.0, 150.0], &attitude);
        let cameras: [(&str, &[f64]); 4] = [
            ("perspective", &[-152.7]),
            ("opencv", &[152.7, 152.6, 0.02, -0.015, -6e-4, 2e-4, 2e-5, -3e-5]),
            ("simple_radial", &[152.7, 0.1, -0.2, -6e-4]),
            ("brown", &[-152.7, 0.01, -0.02, 1e-8, 1e-12, 0.0, 1e-7, -1e-7, 1e-5, -1e-5, 0.0]),
        ];
        for (name, parameters) in cameras {
            compare(&Camera::named(name, parameters).unwrap(), &orientation);
        }
    }

    #[test]
    fn excluded_images_may_not_be_finite() {
        let attitude: Matrix3 = rotation([0.02, -0.03, 1.1]).transpose();
        let centre = [3.0, -4.0, 150.0];
        let orientation = Orientation::stepping(ObjectSpace::Rectangular, centre, &attitude);
        let camera = Camera::named("perspective", &[-152.7]).unwrap();
        let point = Point::new(ObjectSpace::Rectangular, [1.0, 2.0, 3.0]);
        let at_centre = Point::new(ObjectSpace::Rectangular, centre);
        let image = Image { photo: 0, point: 0, xy: [1.0, 2.0], sd: [0.004; 2] };
        let excluded = [f64::INFINITY; 2];
        let sights = [(&point, image.sd), (&at_centre, excluded), (&point, [image.sd[0], f64::INFINITY])];
        let to_camera_frame =
            |t: usize| ImageObservation { point: sights[t].0, image: &image, sd: sights[t].1 };
        let mut parts = [1, 3, POSE, 1].map(|width| vec![f64::NAN; 2 * sights.len() * width]);
        let [constant, local, retained, shared] = &mut parts;
        let mut rows = GroupRows { constant, local, retained, shared };
        assert!(crate::geometry::camera::each_camera!(
            &camera, camera => linearize_simd(&orientation, camera, sights.len(), &to_camera_frame, &mut rows)
        ));
        for part in parts {
            let rows: Vec<&[f64]> = part.chunks_exact(part.len() / 6).collect();
            assert!(rows[2..4].iter().all(|row| row.iter().all(|&value| value == 0.0)));
            assert!(rows[5].iter().all(|&value| value == 0.0));
            assert_eq!(rows[4], rows[0]);
            assert!(rows[1].iter().all(|value| value.is_finite()) && rows[1] != rows[5]);
        }
    }

    /// A camera with one parameter above the limit; only the first parameter matters.
    #[derive(Clone, Copy)]
    struct Wide([f64; PARAMETERS + 1]);

    impl Wide {
        fn plain(&self) -> Perspective {
            Perspective { principal_distance: self.0[0] }
        }
    }

    impl CameraModel for Wide {
        type Parameters = [f64; PARAMETERS + 1];

        const NAME: &'static str = "wide";
        const PARAMETERS: &'static [(&'static str, Unit)] = &[("c", Unit::Image); PARAMETERS + 1];
        const IN_LANES: bool = true;
        const FORMULA: &'static str = "image = c (P1, P2) / P3";

        fn with_parameters(parameters: Self::Parameters) -> Self {
            Self(parameters)
        }

        fn parameters(&self) -> Self::Parameters {
            self.0
        }

        fn scale(&self) -> f64 {
            self.plain().scale()
        }

        fn image(&self, u: &Vector3) -> [f64; 2] {
            self.plain().image(u)
        }

        fn linearize(&self, u: &Vector3) -> geometry::camera::Image<Self::Parameters> {
            let geometry::camera::Image { xy, by_u, by_parameters } = self.plain().linearize(u);
            let widened = |[by_c]: [f64; 1]| std::array::from_fn(|k| if k == 0 { by_c } else { 0.0 });
            geometry::camera::Image { xy, by_u, by_parameters: by_parameters.map(widened) }
        }

        fn direction(&self, xy: [f64; 2]) -> Option<Vector3> {
            self.plain().direction(xy)
        }
    }

    #[test]
    fn images_of_a_camera_with_more_parameters_than_lanes_hold_are_left_to_others() {
        let mut camera = Wide([0.0; PARAMETERS + 1]);
        camera.0[0] = -152.7;
        let attitude: Matrix3 = rotation([0.02, -0.03, 1.1]).transpose();
        let orientation = Orientation::stepping(ObjectSpace::Rectangular, [3.0, -4.0, 150.0], &attitude);
        let point = Point::new(ObjectSpace::Rectangular, [1.0, 2.0, 3.0]);
        let image = Image {
            photo: 0,
            point: 0,
            xy: camera.image(&orientation.to_camera_frame(&point)),
            sd: [0.004; 2],
        };
        let to_camera_frame = |_| ImageObservation { point: &point, image: &image, sd: image.sd };
        let found = rows_of(FEWEST, PARAMETERS + 1, |rows| {
            assert!(!linearize_simd(&orientation, &camera, FEWEST, &to_camera_frame, rows));
        });
        assert!(found.iter().all(|&value| value == 0.0));
    }
}
