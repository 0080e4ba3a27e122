//! Places that an error displaces: points of the model, and positions of photos.

use nalgebra::{Matrix3, Vector3};

use super::super::trial::Trial;
use super::catalogue::{Catalogue, Seen};
use crate::geometry::{ObjectSpace, Pose, local_vertical};

/// A point or the position of a photo at the adjusted values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// First of its three unknowns.
    pub first: usize,
    /// Cartesian position, counted from the origin of the model.
    pub position: Vector3<f64>,
    /// In geographic space the partials of the coordinates by the Cartesian position; None: I.
    to_coordinates: Option<Matrix3<f64>>,
}

impl Place {
    /// Change of its coordinates by a Cartesian vector.
    pub fn change(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        self.to_coordinates.map_or(*vector, |to| to * vector)
    }
}

impl Catalogue<'_> {
    /// A point of the model.
    pub fn place_of_point(&self, place: usize) -> Place {
        let point = &self.linearization.points[place];
        self.place_at(self.bundle.of_point(place).start, point.position(), point.partials())
    }

    fn place_at(&self, first: usize, position: Vector3<f64>, partials: Matrix3<f64>) -> Place {
        let to_coordinates = match self.bundle.space {
            ObjectSpace::Rectangular => None,
            ObjectSpace::Geographic(_) => partials.try_inverse(),
        };
        Place { first, position, to_coordinates }
    }

    /// Points with observed or fixed coordinates: the point of the network, its place.
    pub fn control_points(&self, trial: &Trial) -> Vec<(usize, Place)> {
        let active = self.bundle.observations.iter().filter(|active| active.observation.kind() == "control");
        let mut observed = vec![false; trial.assembled.points.len()];
        active.flat_map(|active| &active.touches.points).for_each(|&place| observed[place] = true);
        let given = |place: usize| self.sd[self.bundle.of_point(place)].iter().any(|sd| sd.is_finite());
        let points = trial.assembled.points.iter().enumerate();
        let control = points.filter(|(place, _)| given(*place) || observed[*place]);
        control.map(|(place, &point)| (point, self.place_of_point(place))).collect()
    }

    /// Photos whose position was observed, or is fixed.
    pub fn positions(&self) -> Vec<(usize, Place)> {
        let active = self.bundle.observations.iter().filter(|active| active.observation.kind() == "position");
        let active: Vec<usize> = active.flat_map(|active| active.touches.photos.iter().copied()).collect();
        let mut observed = vec![false; self.bundle.cameras.len()];
        active.into_iter().for_each(|photo| observed[photo] = true);
        let of = |(photo, observed): (usize, bool)| {
            let first = self.bundle.of_block(photo).start;
            let given = self.sd[first..first + 3].iter().any(|sd| sd.is_finite());
            (given || observed).then(|| (photo, self.place_of_photo(photo)))
        };
        observed.into_iter().enumerate().filter_map(of).collect()
    }

    /// The position of a photo.
    pub fn place_of_photo(&self, photo: usize) -> Place {
        let own = &self.linearization.photos[photo].orientation;
        self.place_at(self.bundle.of_block(photo).start, own.centre(), own.centre_partials())
    }

    pub fn pose(&self, photo: usize) -> &Pose {
        self.linearization.photos[photo].orientation.pose()
    }

    /// The Cartesian position of coordinates, counted from the origin of the model.
    pub fn position(&self, coordinates: [f64; 3]) -> Vector3<f64> {
        self.bundle.space.cartesian(std::array::from_fn(|k| coordinates[k] - self.bundle.origin[k]))
    }

    /// Centre of scale, rotation and bending.
    pub fn centre(&self) -> Vector3<f64> {
        match (self.facts.centre, self.bundle.space) {
            (Some(centre), _) => self.position(centre),
            (None, ObjectSpace::Rectangular) => Vector3::zeros(),
            (None, ObjectSpace::Geographic(_)) => {
                let photos = &self.linearization.photos;
                let sum: Vector3<f64> = photos.iter().map(|own| own.orientation.centre()).sum();
                sum / photos.len().max(1) as f64
            }
        }
    }

    /// X, Y, Z or, in geographic space, east, north and up at a position, as rows.
    pub fn axes_at(&self, position: Vector3<f64>) -> Matrix3<f64> {
        match self.bundle.space {
            ObjectSpace::Rectangular => Matrix3::identity(),
            ObjectSpace::Geographic(ellipsoid) => {
                let [longitude, latitude, _] = ellipsoid.geographic(position);
                local_vertical(longitude, latitude)
            }
        }
    }

    /// Names of these axes.
    pub fn axis_names(&self) -> [&'static str; 3] {
        match self.bundle.space {
            ObjectSpace::Rectangular => ["X", "Y", "Z"],
            ObjectSpace::Geographic(_) => ["east", "north", "up"],
        }
    }

    /// Displaces a place, as some observations see it, by a Cartesian vector with a parameter.
    pub fn displace_place(&mut self, seen: Seen, place: &Place, column: usize, vector: &Vector3<f64>) {
        let change = place.change(vector);
        (0..3).for_each(|k| self.displace(seen, place.first + k, column, change[k]));
    }

    /// Shifts a place along X, Y, Z or, in geographic space, east, north and up, with a parameter for each.
    pub fn shift_place(&mut self, seen: Seen, place: &Place, columns: &[usize], share: f64) {
        let axes = self.axes_at(place.position);
        for (k, &column) in columns.iter().enumerate() {
            match place.to_coordinates {
                None => self.displace(seen, place.first + k, column, share),
                Some(_) => self.displace_place(seen, place, column, &(axes.row(k).transpose() * share)),
            }
        }
    }
}
