//! Composition of a pose from mounts, and the parameter blocks on which it depends.

use nalgebra::{Matrix6, Matrix6xX, Vector6};
use smallvec::{SmallVec, smallvec};

use crate::geometry::{Matrix3, ObjectSpace, Orientation, POSE, Pose, Steps, Vector3};
use crate::network::commons::InBlock;
use crate::normals::GroupRows;

/// Parameters of retained blocks with proportional partials of the pose: coefficients of a trajectory.
#[derive(Debug, Clone, Default)]
struct Proportional {
    /// Partials for a factor of one.
    steps: Steps,
    blocks: SmallVec<[(InBlock, f64); 4]>,
}

/// A block among the blocks of a pose.
#[derive(Debug, Clone, Copy)]
struct ChainBlock {
    block: usize,
    width: usize,
    /// First column of its parameters behind the main block.
    first: usize,
}

/// A partially composed pose, with its partials by parameters of retained blocks.
#[derive(Debug, Clone)]
pub struct PartialPose {
    pose: Pose,
    /// Whether partials are requested.
    stepping: bool,
    /// Partials of the pose by parameters of retained blocks; only the first `used` elements are valid.
    proportional: Vec<Proportional>,
    used: usize,
}

/// Returns the partials dC and rho of three parameters of position.
pub fn shifting(shifts: &Matrix3) -> impl Iterator<Item = (Vector3, Vector3)> {
    shifts.column_iter().map(|own| (own.into(), Vector3::zeros()))
}

/// Returns the partials dC and rho of three parameters of rotation.
pub fn turning(turns: &Matrix3) -> impl Iterator<Item = (Vector3, Vector3)> {
    turns.column_iter().map(|own| (Vector3::zeros(), own.into()))
}

impl PartialPose {
    /// Returns true if partials are requested.
    pub fn steps(&self) -> bool {
        self.stepping
    }

    /// Returns the composed pose.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Appends a pose in the axes of the current one, with its partials by the parameters of a block.
    pub fn lead_to(
        &mut self,
        inner: &Pose,
        own: Option<(InBlock, impl Iterator<Item = (Vector3, Vector3)>)>,
    ) {
        let from = self.pose;
        let carried = from.carried(inner);
        self.proportional[..self.used].iter_mut().for_each(|all| all.steps.map(&carried));
        if let Some((block, steps)) = own {
            self.add([(block, 1.0)].into_iter(), steps.map(|(shift, rho)| (from.attitude * shift, rho)));
        }
        self.pose = from.of_inner(inner);
    }

    /// Restarts the composition from an independent pose.
    pub fn set_pose(&mut self, pose: Pose) {
        self.pose = pose;
        self.used = 0;
    }

    /// Adds partials by parameters of blocks, each with a factor.
    pub fn add(
        &mut self,
        blocks: impl Iterator<Item = (InBlock, f64)>,
        steps: impl IntoIterator<Item = (Vector3, Vector3)>,
    ) {
        if self.used == self.proportional.len() {
            self.proportional.push(Proportional::default());
        }
        let own = &mut self.proportional[self.used];
        own.blocks.clear();
        own.blocks.extend(blocks);
        if !own.blocks.is_empty() {
            own.steps.put(steps);
            self.used += 1;
        }
    }

    fn proportional(&self) -> &[Proportional] {
        &self.proportional[..self.used]
    }

    /// Converts the partials from steps of the pose to parameters of an orientation.
    pub(super) fn lead_by(&mut self, unknowns: &Matrix6<f64>) {
        self.proportional[..self.used].iter_mut().for_each(|own| own.steps.lead_by(unknowns));
    }
}

/// A pose composed from the parameters of several blocks. It is reused for consecutive poses to avoid allocations.
#[derive(Debug, Clone)]
pub(in crate::network) struct Composed {
    /// Orientation with six parameters of its own: coordinates and a rotation about its axes.
    pub orientation: Orientation,
    /// Partials of these six parameters.
    pub(super) chain: PartialPose,
    /// Distinct blocks, the main block first, then in the order of the composition.
    slots: Vec<ChainBlock>,
    /// Slot of each block of the chain.
    numbers: Vec<usize>,
    /// Number of parameters outside the main block.
    width: usize,
}

impl Composed {
    /// Returns storage for poses; `stepping` requests their partials.
    pub fn new(stepping: bool) -> Self {
        let pose = Pose { position: Vector3::zeros(), attitude: Matrix3::identity() };
        Self {
            orientation: Orientation::of_pose(ObjectSpace::Rectangular, &pose),
            chain: PartialPose { pose, stepping, proportional: vec![], used: 0 },
            slots: vec![],
            numbers: vec![],
            width: 0,
        }
    }

    /// Numbers the blocks of the pose; the main block may be none of them.
    pub(super) fn number(&mut self, main: usize) {
        self.slots.clear();
        self.slots.push(ChainBlock { block: main, width: POSE, first: 0 });
        self.numbers.clear();
        self.width = 0;
        for &(InBlock { block, width, .. }, _) in self.chain.proportional().iter().flat_map(|own| &own.blocks)
        {
            let known = self.slots.iter().position(|slot| slot.block == block);
            self.numbers.push(known.unwrap_or(self.slots.len()));
            match known {
                Some(0) => self.slots[0].width = width,
                Some(_) => {}
                None => {
                    self.slots.push(ChainBlock { block, width, first: self.width });
                    self.width += width;
                }
            }
        }
    }

    /// Returns the columns of all blocks, possibly with repeated blocks: block, number of the parameter and partials of the pose.
    pub fn columns(&self) -> impl Iterator<Item = (usize, usize, Vector6<f64>)> {
        self.chain.proportional().iter().flat_map(|own| {
            let of_block = |&(InBlock { block, first, .. }, factor): &(InBlock, f64)| {
                let steps = (first..).zip(own.steps.columns());
                steps.map(move |(k, step)| (block, k, factor * step))
            };
            own.blocks.iter().flat_map(of_block)
        })
    }

    /// Returns the distinct blocks with the partials of the pose by their parameters; the main block first.
    pub fn parts(&self) -> Vec<(usize, Matrix6xX<f64>)> {
        let of_slot = |slot: &ChainBlock| (slot.block, Matrix6xX::zeros(slot.width));
        let mut all: Vec<_> = self.slots.iter().map(of_slot).collect();
        for (block, k, step) in self.columns() {
            if let Some((_, own)) = all.iter_mut().find(|own| own.0 == block) {
                let mut column = own.column_mut(k);
                column += step;
            }
        }
        all
    }

    /// Writes an image. `write` computes it for six own parameters, which are then mapped to the main block and the shared columns. The
    /// camera occupies the last shared columns.
    pub fn write(&self, rows: &mut GroupRows<'_>, write: impl FnOnce(&mut GroupRows<'_>)) {
        let (main, common) = (rows.retained.len() / 2, rows.shared.len() / 2);
        let parameters = common - self.width;
        let mut pose = [0.0; 2 * POSE];
        let mut camera: SmallVec<[f64; 32]> = smallvec![0.0; 2 * parameters];
        let (constant, local) = (&mut *rows.constant, &mut *rows.local);
        write(&mut GroupRows { constant, local, retained: &mut pose, shared: &mut camera });
        rows.retained.fill(0.0);
        rows.shared.fill(0.0);
        for (row, pose) in pose.as_chunks::<POSE>().0.iter().enumerate() {
            let (pose, retained) = (Vector6::from(*pose), &mut rows.retained[main * row..][..main]);
            let (others, own_camera) = rows.shared[common * row..][..common].split_at_mut(self.width);
            own_camera.copy_from_slice(&camera[parameters * row..][..parameters]);
            let mut numbers = self.numbers.iter();
            for own in self.chain.proportional() {
                let by: SmallVec<[f64; POSE]> =
                    own.steps.columns().iter().map(|step| step.dot(&pose)).collect();
                for (&(InBlock { first, .. }, factor), &number) in own.blocks.iter().zip(&mut numbers) {
                    let to = match number {
                        0 => &mut retained[first..],
                        _ => &mut others[self.slots[number].first + first..],
                    };
                    to.iter_mut().zip(&by).for_each(|(to, by)| *to += factor * by);
                }
            }
        }
    }
}
