//! Connected components of a network.

/// Photos connected by points and observations; a shared camera does not connect them.
#[derive(Debug)]
pub(super) struct Component {
    pub photos: Vec<usize>,
    /// Photo of the preferred datum: chosen by the user or by fixed positions, else the one with most images.
    pub central: usize,
}

/// Components of a network that contain images, the largest first, and the component of each photo, point and shared parameter.
#[derive(Debug)]
pub(super) struct Components {
    pub all: Vec<Component>,
    pub of_photo: Vec<Option<usize>>,
    pub of_point: Vec<Option<usize>>,
    pub of_common: Vec<Option<usize>>,
}

/// Number of datum parameters: translations, rotations about Cartesian axes, and scale.
pub(super) const MOTIONS: usize = 7;

/// Maximum number of components with a datum: a network with more of them is assumed to be a mistake.
pub(super) const MOST_PARTS: usize = 8;

/// Disjoint sets of nodes (union-find).
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
