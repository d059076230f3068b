//! A generator's search tree, which travels with the requests so that generators keep nothing.

use crate::check::{checks, keys, length, numbers, size};
use crate::limits::{MAX_COLUMN_NUMBERS, MAX_TREE_COLUMNS, MAX_TREE_NODES};
use crate::{F64Array, Refusal, Reject, U32Array};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Parent of a root.
pub const NO_PARENT: u32 = u32::MAX;

/// A search tree, or whatever else a generator goes on with: what it cannot work out again. May have several roots.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tree {
    /// Of each node the index of the parent; [`NO_PARENT`] for a root.
    pub parent: U32Array,
    /// Numbers by name; the names are the generator's own, and tell one kind of tree from another.
    pub columns: BTreeMap<String, F64Array>,
}

checks! { tree: Tree {
    parent: length(0, MAX_TREE_NODES);
    columns: keys(MAX_TREE_COLUMNS);
    columns: |_: &str, columns: &BTreeMap<String, F64Array>| check_columns(columns);
    parent: |_: &str, parent: &U32Array| check_rooted(parent);
}}

fn check_columns(columns: &BTreeMap<String, F64Array>) -> Result<(), Reject> {
    columns.iter().try_for_each(|(name, column)| {
        let field = format!("columns.{name}");
        size(&field, column.len(), 0, MAX_COLUMN_NUMBERS)?;
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
    use crate::Message;

    #[test]
    fn a_tree_has_no_more_nodes_columns_and_numbers_than_the_limits_say() {
        let tree = |nodes: usize, columns: usize, numbers: usize| Tree {
            parent: vec![NO_PARENT; nodes].into(),
            columns: (0..columns).map(|k| (format!("c{k}"), vec![0.0; numbers].into())).collect(),
        };
        let field = |tree: &Tree| {
            Tree::decode(&tree.encode(), None).map(|_| ()).map_err(|reject| reject.field.unwrap_or_default())
        };
        let nodes = MAX_TREE_NODES;
        let columns = MAX_TREE_COLUMNS;
        let numbers = MAX_COLUMN_NUMBERS;
        assert_eq!(field(&tree(nodes, columns, numbers)), Ok(()));
        assert_eq!(field(&tree(nodes + 1, 0, 0)), Err("parent".to_owned()));
        assert_eq!(field(&tree(0, columns + 1, 0)), Err("columns".to_owned()));
        assert_eq!(field(&tree(0, 1, numbers + 1)), Err("columns.c0".to_owned()));
    }

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
