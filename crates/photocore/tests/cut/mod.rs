//! Trees of nodes and the assignment of parameter blocks (vertices) and terms (cliques) to them.

use std::collections::BTreeSet;

pub const TREES: [&[Option<usize>]; 4] = [
    &[Some(1), None],
    &[Some(2), Some(2), None],
    &[Some(3), Some(3), Some(3), None],
    &[Some(2), Some(2), Some(6), Some(5), Some(5), Some(6), None],
];

/// Assignment of parameter blocks to the nodes of a tree.
pub struct Cut {
    pub parent: Vec<Option<usize>>,
    /// Node of each block.
    pub node_of: Vec<usize>,
    /// Node of each clique: the lowest node of its blocks.
    pub homes: Vec<usize>,
    /// Blocks of ancestors that each node or its descendants depend on.
    pub outer: Vec<Vec<usize>>,
}

impl Cut {
    /// Moves blocks up from the given nodes until the blocks of every clique are on one path to the root.
    pub fn new(parent: &[Option<usize>], cliques: &[Vec<usize>], mut node_of: Vec<usize>) -> Self {
        let above = |node: usize| std::iter::successors(Some(node), |&node| parent[node]);
        loop {
            let before = node_of.clone();
            for clique in cliques {
                for &a in clique {
                    for &b in clique {
                        let [p, q] = [node_of[a], node_of[b]];
                        let comparable = above(p).any(|node| node == q) || above(q).any(|node| node == p);
                        if let Some(common) = above(p).find(|&node| above(q).any(|other| other == node))
                            && !comparable
                        {
                            node_of[b] = common;
                        }
                    }
                }
            }
            if node_of == before {
                break;
            }
        }
        let root = parent.len() - 1;
        let home = |clique: &Vec<usize>| clique.iter().map(|&block| node_of[block]).min().unwrap_or(root);
        let homes: Vec<usize> = cliques.iter().map(home).collect();
        let mut outer: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); parent.len()];
        for (clique, &home) in cliques.iter().zip(&homes) {
            outer[home].extend(clique);
        }
        for p in 0..parent.len() {
            let own: Vec<usize> = outer[p].iter().copied().filter(|&block| node_of[block] == p).collect();
            outer[p].retain(|block| !own.contains(block));
            let handed = outer[p].clone();
            parent[p].into_iter().for_each(|above| outer[above].extend(&handed));
        }
        // Each node has its own order, different from the order of the blocks.
        let outer = outer.into_iter().map(|blocks| blocks.into_iter().rev().collect()).collect();
        Self { parent: parent.to_vec(), node_of, homes, outer }
    }

    /// Returns the children of a node, ascending.
    pub fn children(&self, node: usize) -> Vec<usize> {
        (0..node).filter(|&child| self.parent[child] == Some(node)).collect()
    }

    /// Returns the blocks of a node, then the outer ones in ascending order.
    pub fn blocks(&self, node: usize) -> Vec<usize> {
        let own = (0..self.node_of.len()).filter(|&block| self.node_of[block] == node);
        let mut outer = self.outer[node].clone();
        outer.sort_unstable();
        own.chain(outer).collect()
    }
}
