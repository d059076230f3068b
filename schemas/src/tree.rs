//! A generator's search tree, which travels with the requests so that generators keep nothing.

use crate::array::{F64Array, U32Array};
use crate::check;
use crate::limits::{MAX_COLUMN_WIDTH, MAX_TREE_EXTRAS, MAX_TREE_NODES};
use crate::message::Validate;
use crate::reject::{Refusal, Reject};
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

impl Validate for Tree {
    fn validate(&self) -> Result<(), Reject> {
        let nodes = self.parent.len();
        check::at_most("parent", nodes, MAX_TREE_NODES)?;
        check::arrays(
            nodes,
            &[("x", &self.x), ("y", &self.y), ("heading", &self.heading), ("cost", &self.cost)],
        )?;
        check::ids("extra", self.extra.keys(), MAX_TREE_EXTRAS)?;
        for (name, array) in &self.extra {
            let field = format!("extra.{name}");
            check::at_most(&field, array.len(), nodes * MAX_COLUMN_WIDTH)?;
            if nodes > 0 && !array.len().is_multiple_of(nodes) {
                let expected = array.len().next_multiple_of(nodes);
                return check::length(&field, array.len(), expected);
            }
            check::array_numbers(&field, array)?;
        }
        check_rooted(&self.parent)
    }
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
