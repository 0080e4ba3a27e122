//! A pose on its way from mount to mount, and what it is made of.

use nalgebra::{Matrix6, Matrix6xX, Vector6};
use smallvec::{SmallVec, smallvec};

use crate::geometry::{Matrix3, ObjectSpace, Orientation, POSE, Pose, Steps, Vector3};
use crate::network::in_block::InBlock;
use crate::normals::GroupRows;

/// Unknowns of retained blocks that step a pose alike, each up to a factor of its own: coefficients of a trajectory.
#[derive(Debug, Clone, Default)]
struct Alike {
    /// How it steps with a factor of one.
    steps: Steps,
    blocks: SmallVec<[(InBlock, f64); 4]>,
}

/// A block among those that a pose is made of.
#[derive(Debug, Clone, Copy)]
struct Slot {
    block: usize,
    width: usize,
    /// Where its unknowns stand among those of all but the main block.
    first: usize,
}

/// A pose on the way from mount to mount, and what it is made of.
#[derive(Debug, Clone)]
pub struct Chain {
    pose: Pose,
    /// Whether it is asked how the pose steps.
    stepping: bool,
    /// How the pose steps with unknowns of retained blocks; so many of these as are used.
    alike: Vec<Alike>,
    used: usize,
}

/// dC and rho of three unknowns that shift a pose so.
pub fn shifting(shifts: &Matrix3) -> impl Iterator<Item = (Vector3, Vector3)> {
    shifts.column_iter().map(|own| (own.into(), Vector3::zeros()))
}

/// dC and rho of three unknowns that turn it so.
pub fn turning(turns: &Matrix3) -> impl Iterator<Item = (Vector3, Vector3)> {
    turns.column_iter().map(|own| (Vector3::zeros(), own.into()))
}

impl Chain {
    /// Whether it is asked how the pose steps.
    pub fn steps(&self) -> bool {
        self.stepping
    }

    /// The pose that is reached.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Goes on to a pose that is given in the axes of this one, and there steps so with unknowns of a block.
    pub fn lead_to(
        &mut self,
        inner: &Pose,
        own: Option<(InBlock, impl Iterator<Item = (Vector3, Vector3)>)>,
    ) {
        let from = self.pose;
        let carried = from.carried(inner);
        self.alike[..self.used].iter_mut().for_each(|all| all.steps.map(&carried));
        if let Some((block, steps)) = own {
            self.add([(block, 1.0)].into_iter(), steps.map(|(shift, rho)| (from.attitude * shift, rho)));
        }
        self.pose = from.of_inner(inner);
    }

    /// Goes on from a pose that nothing before has made.
    pub fn stand(&mut self, pose: Pose) {
        self.pose = pose;
        self.used = 0;
    }

    /// Steps so with unknowns of blocks, each times a factor, besides.
    pub fn add(
        &mut self,
        blocks: impl Iterator<Item = (InBlock, f64)>,
        steps: impl IntoIterator<Item = (Vector3, Vector3)>,
    ) {
        if self.used == self.alike.len() {
            self.alike.push(Alike::default());
        }
        let own = &mut self.alike[self.used];
        own.blocks.clear();
        own.blocks.extend(blocks);
        if !own.blocks.is_empty() {
            own.steps.put(steps);
            self.used += 1;
        }
    }

    fn alike(&self) -> &[Alike] {
        &self.alike[..self.used]
    }

    /// Unknowns of an orientation instead of steps of its pose.
    pub(super) fn lead_by(&mut self, unknowns: &Matrix6<f64>) {
        self.alike[..self.used].iter_mut().for_each(|own| own.steps.lead_by(unknowns));
    }
}

/// A pose that is made of the unknowns of several blocks. The same is taken for one pose after the other, so that nothing has to be
/// allocated for each.
#[derive(Debug, Clone)]
pub(in crate::network) struct Composed {
    /// With six unknowns of its own: its coordinates and a rotation about its axes.
    pub orientation: Orientation,
    /// How these six step.
    pub(super) chain: Chain,
    /// Each block once, the main one first, then in the order in which they are named.
    slots: Vec<Slot>,
    /// Which of them each block of the chain is.
    numbers: Vec<usize>,
    /// How many unknowns of all but the main block.
    width: usize,
}

impl Composed {
    /// For poses that are yet to be found; `stepping` where it is asked what they are made of.
    pub fn new(stepping: bool) -> Self {
        let pose = Pose { position: Vector3::zeros(), attitude: Matrix3::identity() };
        Self {
            orientation: Orientation::of_pose(ObjectSpace::Rectangular, &pose),
            chain: Chain { pose, stepping, alike: vec![], used: 0 },
            slots: vec![],
            numbers: vec![],
            width: 0,
        }
    }

    /// Finds out which blocks the pose is made of; the main block may be none of them.
    pub(super) fn number(&mut self, main: usize) {
        self.slots.clear();
        self.slots.push(Slot { block: main, width: POSE, first: 0 });
        self.numbers.clear();
        self.width = 0;
        for &(InBlock { block, width, .. }, _) in self.chain.alike().iter().flat_map(|own| &own.blocks) {
            let known = self.slots.iter().position(|slot| slot.block == block);
            self.numbers.push(known.unwrap_or(self.slots.len()));
            match known {
                Some(0) => self.slots[0].width = width,
                Some(_) => {}
                None => {
                    self.slots.push(Slot { block, width, first: self.width });
                    self.width += width;
                }
            }
        }
    }

    /// The blocks, some of them more than once, with the number of an unknown in each and how the pose steps with it.
    pub fn columns(&self) -> impl Iterator<Item = (usize, usize, Vector6<f64>)> {
        self.chain.alike().iter().flat_map(|own| {
            let of_block = |&(InBlock { block, first, .. }, factor): &(InBlock, f64)| {
                let steps = (first..).zip(own.steps.columns());
                steps.map(move |(k, step)| (block, k, factor * step))
            };
            own.blocks.iter().flat_map(of_block)
        })
    }

    /// Each block once, with how the pose steps with its unknowns; the main block first.
    pub fn parts(&self) -> Vec<(usize, Matrix6xX<f64>)> {
        let of_slot = |slot: &Slot| (slot.block, Matrix6xX::zeros(slot.width));
        let mut all: Vec<_> = self.slots.iter().map(of_slot).collect();
        for (block, k, step) in self.columns() {
            if let Some((_, own)) = all.iter_mut().find(|own| own.0 == block) {
                let mut column = own.column_mut(k);
                column += step;
            }
        }
        all
    }

    /// Writes an image: `write` does so as if its photo had six unknowns of its own. They become those of the main block and of all others,
    /// which are the first of what is common with others; the camera is the last of that.
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
            for own in self.chain.alike() {
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
