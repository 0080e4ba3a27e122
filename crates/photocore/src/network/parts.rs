//! What of a network hangs together.

/// Photos that hang together by points and observations; a shared camera does not join them.
#[derive(Debug)]
pub(super) struct Part {
    pub photos: Vec<usize>,
    /// The one to hold: what the user says or has placed, else that with most images.
    pub central: usize,
}

/// The parts of a network that have photos with images, the largest first, and the part of each photo, point and common unknown.
#[derive(Debug)]
pub(super) struct Parts {
    pub all: Vec<Part>,
    pub of_photo: Vec<Option<usize>>,
    pub of_point: Vec<Option<usize>>,
    pub of_common: Vec<Option<usize>>,
}

/// Shifts along, rotations about the axes of cartesian space, and scale.
pub(super) const MOTIONS: usize = 7;

/// Parts that are given a datum at the most: a network in more of them is a mistake.
pub(super) const MOST_PARTS: usize = 8;

/// Joins what hangs together.
pub(super) struct Joined(pub Vec<usize>);

impl Joined {
    pub fn root(&mut self, mut node: usize) -> usize {
        while self.0[node] != node {
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    pub fn join(&mut self, nodes: impl IntoIterator<Item = usize>) {
        let mut nodes = nodes.into_iter();
        let Some(first) = nodes.next() else { return };
        for node in nodes {
            let [a, b] = [first, node].map(|node| self.root(node));
            self.0[a.max(b)] = a.min(b);
        }
    }
}
