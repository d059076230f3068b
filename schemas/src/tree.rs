//! A generator's search tree, which travels with the requests so that generators keep nothing.

use crate::check::{array, checks, keys, length, numbers, shape, size};
use crate::limits::{MAX_COLUMN_WIDTH, MAX_TREE_EXTRAS, MAX_TREE_NODES};
use crate::{F64Array, Refusal, Reject, U32Array};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parent of a root.
pub const NO_PARENT: u32 = u32::MAX;

/// Nodes as a structure of arrays, one entry per node unless said otherwise; map frame. May have several roots.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tree {
    /// Metres.
    pub x: F64Array,
    /// Metres.
    pub y: F64Array,
    /// Radians.
    pub heading: F64Array,
    /// Cost from the root, in the generator's own unit.
    pub cost: F64Array,
    /// Index of the parent; [`NO_PARENT`] for a root.
    pub parent: U32Array,
    /// Further quantities by name (time, depth, risk, ...), each `[nodes, width]` with a width of its own.
    pub extra: BTreeMap<String, F64Array>,
}

checks! { tree: Tree {
    parent: length(0, MAX_TREE_NODES);
    x, y, heading, cost: array(tree.parent.len());
    extra: keys(MAX_TREE_EXTRAS);
    extra: |_: &str, extra: &BTreeMap<String, F64Array>| check_columns(extra, tree.parent.len());
    parent: |_: &str, parent: &U32Array| check_rooted(parent);
}}

/// The length of every column is a multiple of the number of nodes.
fn check_columns(extra: &BTreeMap<String, F64Array>, nodes: usize) -> Result<(), Reject> {
    extra.iter().try_for_each(|(name, column)| {
        let field = format!("extra.{name}");
        size(&field, column.len(), 0, nodes * MAX_COLUMN_WIDTH)?;
        if nodes > 0 {
            shape(&field, column.len(), column.len().next_multiple_of(nodes))?;
        }
        numbers(&field, column)
    })
}

/// Every node leads to a root: parents exist and there is no cycle, so a walk to the root ends.
fn check_rooted(parent: &[u32]) -> Result<(), Reject> {
    const UNSEEN: u32 = u32::MAX;
    // The walk on which each node was first met: meeting one's own walk again is a cycle.
    let mut walk_of = vec![UNSEEN; parent.len()];
    for start in 0..parent.len() {
        let mut node = start;
        while walk_of[node] == UNSEEN {
            walk_of[node] = start as u32;
            if parent[node] == NO_PARENT {
                break;
            }
            let next = parent[node] as usize;
            if next >= parent.len() {
                return Err(Refusal::NoSuchIndex { found: next as u64 }.at(format!("parent[{node}]")));
            }
            if walk_of[next] == start as u32 {
                return Err(Refusal::CyclicParents.at(format!("parent[{node}]")));
            }
            node = next;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tree_leads_to_a_root_or_is_refused() {
        for good in
            [&[][..], &[NO_PARENT], &[NO_PARENT, 0, 0, 2], &[1, 2, NO_PARENT], &[NO_PARENT, NO_PARENT, 1]]
        {
            assert!(check_rooted(good).is_ok(), "{good:?}");
        }
        for bad in [&[0][..], &[1, 0], &[NO_PARENT, 2, 3, 1], &[NO_PARENT, 5], &[1, 2, 1]] {
            assert!(check_rooted(bad).is_err(), "{bad:?}");
        }
    }
}
