//! Groups of the observations of a network, and the effect of errors of some observations on the residuals of others.

use super::covariance::Covariances;
use super::error::NetworkError;
use super::model::Owner;
use crate::Context;
use crate::adjustment::{EquationGroups, GroupSquares, Probing};
use crate::geometry::POSE;

/// Group number of each observation, in the order of the network; a number of `count` or more means none.
#[derive(Debug, Clone, Default)]
pub struct Groups {
    /// Number of groups.
    pub count: usize,
    /// Groups of x and y of every image.
    pub images: Vec<[usize; 2]>,
    /// Groups of the components of every point.
    pub points: Vec<[usize; 3]>,
    /// Groups of the six parameters of every pose.
    pub photos: Vec<[usize; POSE]>,
    /// Groups of the cameras.
    pub cameras: Vec<usize>,
    /// Groups of the shared parameters.
    pub commons: Vec<usize>,
    /// Groups of the additional observations.
    pub observations: Vec<usize>,
}

impl Covariances {
    /// Returns sums of `R_ij^2` over every two groups. R maps standardized errors of the observations to residuals.
    ///
    /// # Errors
    /// Groups that do not fit the network, an interruption.
    pub fn group_squares(
        &self,
        groups: &Groups,
        probing: &Probing,
        context: &mut Context<'_>,
    ) -> Result<GroupSquares, NetworkError> {
        let groups = self.equation_groups(groups)?;
        let found = self.linearized.group_squares(&self.assembled.problem, &groups, probing, context);
        found.map_err(|error| NetworkError::new(error, &self.assembled))
    }

    /// Returns the sums within each of many groups, in `classes` column classes (see [`crate::adjustment::Linearized::own_squares`]).
    ///
    /// # Errors
    /// Errors of [`Covariances::group_squares`].
    pub fn own_squares(
        &self,
        groups: &Groups,
        classes: usize,
        probing: &Probing,
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let groups = self.equation_groups(groups)?;
        let found = self.linearized.own_squares(&self.assembled.problem, &groups, classes, probing, context);
        found.map_err(|error| NetworkError::new(error, &self.assembled))
    }

    /// Returns the residuals that errors of the images cause, both in standard deviations. Columns contain x and y of every image, column
    /// by column. Excluded images neither contribute errors nor have residuals.
    ///
    /// # Errors
    /// Columns of wrong length, an interruption.
    pub fn project_images(
        &self,
        columns: &[f64],
        context: &mut Context<'_>,
    ) -> Result<Vec<f64>, NetworkError> {
        let problem = &self.assembled.problem;
        let (width, height) = (2 * self.images, problem.equations());
        if width == 0 || !columns.len().is_multiple_of(width) {
            return Err(NetworkError::Partials { unknowns: width, numbers: columns.len() });
        }
        let order = &problem.model.point_images.order;
        let mut z = vec![0.0; columns.len() / width * height];
        for (z, column) in z.chunks_exact_mut(height).zip(columns.chunks_exact(width)) {
            for (row, &image) in order.iter().enumerate() {
                z[2 * row..][..2].copy_from_slice(&column[2 * image..][..2]);
            }
        }
        let u = self.linearized.project(problem, z, context);
        let u = u.map_err(|error| NetworkError::new(error, &self.assembled))?;
        let mut found = vec![0.0; columns.len()];
        for (found, u) in found.chunks_exact_mut(width).zip(u.chunks_exact(height)) {
            for (row, &image) in order.iter().enumerate() {
                found[2 * image..][..2].copy_from_slice(&u[2 * row..][..2]);
            }
        }
        Ok(found)
    }

    /// Returns the groups of the equations of the adjustment.
    fn equation_groups(&self, groups: &Groups) -> Result<EquationGroups, NetworkError> {
        let problem = &self.assembled.problem;
        let model = &problem.model;
        let given = [groups.images.len(), groups.points.len(), groups.photos.len(), groups.cameras.len()];
        let own = [self.images, self.point.len(), self.camera_of_photo.len(), self.photo_of_camera.len()];
        let others = [groups.commons.len(), groups.observations.len()];
        if given != own || others != [model.commons.len(), self.observations] {
            return Err(NetworkError::State);
        }
        let mut of = Vec::with_capacity(problem.equations());
        of.extend(model.point_images.order.iter().flat_map(|&image| groups.images[image]));
        for active in &model.observations {
            of.extend(std::iter::repeat_n(groups.observations[active.index], active.root.nrows()));
        }
        let first = of.len();
        of.resize(problem.equations(), groups.count);
        for (place, &point) in self.assembled.points.iter().enumerate() {
            for (unknown, group) in model.of_point(place).zip(groups.points[point]) {
                of[first + unknown] = group;
            }
        }
        for (owner, unknowns) in (0..model.parameter_blocks()).flat_map(|block| model.owners(block)) {
            let unknowns = unknowns.map(|unknown| first + unknown);
            match owner {
                Owner::Photo(photo) => {
                    let own = groups.photos[photo].into_iter();
                    let camera = groups.cameras[self.camera_of_photo[photo]];
                    unknowns
                        .zip(own.chain(std::iter::repeat(camera)))
                        .for_each(|(row, group)| of[row] = group);
                }
                Owner::Camera(camera) => unknowns.for_each(|row| of[row] = groups.cameras[camera]),
                Owner::Common(common) => unknowns.for_each(|row| of[row] = groups.commons[common]),
            }
        }
        Ok(EquationGroups { count: groups.count, of })
    }
}
