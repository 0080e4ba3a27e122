//! Adjustment of a single photo.

use super::degenerate::Degeneracy;
use super::solution::{SinglePhoto, Solution, Solved};
use super::{ControlPoint, Pose, Resection, ResectionError};
use photocore::adjustment::{self, AdjustError, Options, Problem, Requests};
use photocore::geometry::{ObjectSpace, POSE, rotation, rotation_angles};
use photocore::normals::{Layout, LayoutError, Ordering, System};
use photocore::{Context, Threads};

impl Resection {
    /// Adjusts the photo by least squares, on a new thread pool.
    ///
    /// # Errors
    /// The errors of [`Resection::adjust_on`], or threads that cannot be started.
    pub fn adjust(&self, options: &Options) -> Result<Solution, ResectionError> {
        self.adjust_on(options, &mut Context::new(&Threads::new(options.threads)?))
    }

    /// Adjusts the photo on the caller's threads, with progress.
    ///
    /// Without initial values, every distinct pose of a direct method is adjusted. The solution has the least sum of squares; other poses
    /// that fit about as well are returned as alternatives (see [`Alternative`](super::Alternative)).
    ///
    /// # Errors
    /// A configuration without a determined pose, or an interruption.
    pub fn adjust_on(
        &self,
        options: &Options,
        context: &mut Context<'_>,
    ) -> Result<Solution, ResectionError> {
        let starts = match self.start {
            Some(start) => {
                // Rounding may hide the rank defect of the points from the adjustment.
                if self.position.sd.iter().chain(&self.attitude.sd).all(|sd| sd.is_infinite()) {
                    self.enough_points()?;
                }
                vec![start]
            }
            None => self.starts()?,
        };
        let mut solved: Vec<Solved> = Vec::new();
        let mut failure = ResectionError::NoPlacement;
        let mut undetermined = None;
        for start in starts {
            let mut adjusted = self.adjust_from(start, options, context);
            if let (None, Some(turned)) = (self.start, adjusted.as_ref().ok().and_then(|a| self.upright(a))) {
                adjusted = self.adjust_from(turned, options, context);
            }
            match adjusted {
                Ok(adjusted) if self.start.is_none() && !adjusted.behind().is_empty() => {}
                Ok(adjusted) => solved.push(adjusted),
                Err(stop @ ResectionError::Stopped(_)) => return Err(stop),
                Err(other) => {
                    if let ResectionError::Undetermined(why) = other {
                        undetermined = Some(why);
                    }
                    failure = other;
                }
            }
        }
        solved.sort_by(|a, b| {
            b.converged().cmp(&a.converged()).then(a.sum_of_squares().total_cmp(&b.sum_of_squares()))
        });
        Solution::new(self, solved, undetermined).ok_or(failure)
    }

    fn adjust_from(
        &self,
        start: Pose,
        options: &Options,
        context: &mut Context<'_>,
    ) -> Result<Solved, ResectionError> {
        let origin = self.origin(&start);
        let problem = context.threads.install(|| self.problem(&start, origin))?;
        let requests = Requests { history: POSE, ..Requests::default() };
        let adjusted = adjustment::adjust_with(&problem, options, requests, context);
        let adjustment = adjusted.map_err(|error| match error {
            AdjustError::Layout(error) => error.into(),
            AdjustError::Stopped(stopped) => ResectionError::Stopped(stopped),
            AdjustError::NotFinite => ResectionError::NotFinite,
            AdjustError::Undetermined(_) | AdjustError::UndeterminedLocals(_) => {
                ResectionError::Undetermined(self.degeneracy(&start))
            }
        })?;
        Ok(Solved { problem, adjustment, start, origin })
    }

    /// Returns the pose with |phi| <= 90 degrees, if the iteration has passed this limit and the angles are free.
    fn upright(&self, solved: &Solved) -> Option<Pose> {
        let Pose { position, attitude } = solved.pose();
        let beyond = attitude[1].abs() > std::f64::consts::FRAC_PI_2;
        let free = self.attitude.sd.iter().all(|sd| sd.is_infinite());
        (beyond && free).then(|| Pose { position, attitude: rotation_angles(&rotation(attitude)) })
    }

    /// Returns the degeneracy of the points seen from a pose.
    fn degeneracy(&self, pose: &Pose) -> Degeneracy {
        Degeneracy::of(&self.sight().points, &self.space.cartesian(pose.position))
    }

    /// Returns the local origin of the adjustment, which preserves the digits of large coordinates.
    fn origin(&self, start: &Pose) -> [f64; 3] {
        match self.space {
            ObjectSpace::Rectangular => start.position.map(f64::round),
            ObjectSpace::Geographic(_) => [0.0; 3],
        }
    }

    /// Builds the least-squares problem: points are local blocks of three, the photo is the retained block of six.
    fn problem(&self, start: &Pose, origin: [f64; 3]) -> Result<Problem<SinglePhoto>, LayoutError> {
        let count = self.points.len();
        let shifted = |point: &ControlPoint| ControlPoint {
            coordinates: std::array::from_fn(|k| point.coordinates[k] - origin[k]),
            ..*point
        };
        let points: Vec<ControlPoint> = self.points.iter().map(shifted).collect();
        let layout = Layout::new(2, 3, &[6], (0..=count).collect(), vec![0; count])?;
        let known = Pose { position: self.position.value, attitude: self.attitude.value };
        let own: Vec<f64> = points.iter().flat_map(|point| point.coordinates).collect();
        let with_photo = |pose: &Pose| [&own[..], &pose.counted_from(origin).unknowns()].concat();
        let photo_sd = [self.position.sd, self.attitude.sd].concat();
        Ok(Problem {
            system: System::new(layout, Ordering::Input)?,
            observation_sd: points.iter().flat_map(|point| point.xy_sd).collect(),
            initial: with_photo(start),
            prior: with_photo(&known),
            sd: points.iter().flat_map(|point| point.sd).chain(photo_sd).collect(),
            model: SinglePhoto {
                space: self.space,
                sense: self.sense,
                principal_distance: self.principal_distance,
                partials: self.partials,
                points,
            },
        })
    }
}
