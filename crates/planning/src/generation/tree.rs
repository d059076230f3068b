//! What a generator carries from one cycle into the next, as a value that travels between services (D15).

use std::collections::BTreeMap;

/// A search tree, or whatever else a generator goes on with: who hangs on whom, and numbers by name.
///
/// A generator writes only what it cannot work out again, because the value travels in every question and every answer.
/// The names tell the kinds apart: a generator goes on with a value that has exactly the columns it writes itself, and
/// starts afresh from any other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tree {
    /// Index of each node's parent, [`Tree::NO_PARENT`] for a root. Parents come before their children.
    pub parent: Vec<u32>,
    /// Numbers by name: one per node, or of the whole.
    pub columns: BTreeMap<String, Vec<f64>>,
}

impl Tree {
    /// A root's entry in [`Self::parent`].
    pub const NO_PARENT: u32 = u32::MAX;

    /// A value of these columns.
    pub fn new<const N: usize>(parent: Vec<u32>, columns: [(&str, Vec<f64>); N]) -> Self {
        Self { parent, columns: columns.map(|(name, numbers)| (name.to_owned(), numbers)).into() }
    }

    /// The index of a node's parent by its entry in [`Self::parent`], `None` for a root.
    pub(super) fn parent_of(entry: u32) -> Option<usize> {
        (entry != Self::NO_PARENT).then_some(entry as usize)
    }

    /// Whether there is nothing to go on with.
    pub fn is_empty(&self) -> bool {
        self.parent.is_empty() && self.columns.is_empty()
    }

    /// The columns of these names, if they are all there are, and the value is sound.
    pub fn columns<const N: usize>(&self, names: [&str; N]) -> Option<[&[f64]; N]> {
        if self.columns.len() != N || !self.is_sound() {
            return None;
        }
        let mut found = [&[][..]; N];
        for (column, name) in found.iter_mut().zip(names) {
            *column = self.columns.get(name)?;
        }
        Some(found)
    }

    /// Whether it is what a value that came from elsewhere must be: finite numbers, and every parent before its
    /// children.
    pub fn is_sound(&self) -> bool {
        let comes_first = |(node, &entry)| Self::parent_of(entry).is_none_or(|parent| parent < node);
        self.columns.values().flatten().all(|number| number.is_finite())
            && self.parent.iter().enumerate().all(comes_first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_read_if_the_names_are_these_and_everything_is_sound() {
        let tree = Tree::new(vec![Tree::NO_PARENT, 0], [("b", vec![1.0, 2.0]), ("a", vec![3.0])]);
        assert_eq!(tree.columns(["a", "b"]), Some([&[3.0][..], &[1.0, 2.0][..]]));
        assert_eq!(tree.columns(["a"]), None);
        assert_eq!(tree.columns(["a", "c"]), None);
        assert_eq!(tree.columns(["a", "b", "c"]), None);
        assert!(!tree.is_empty() && Tree::default().is_empty());

        let forward = Tree { parent: vec![Tree::NO_PARENT, 2, 0], ..tree.clone() };
        assert_eq!(forward.columns(["a", "b"]), None);
        let mut not_a_number = tree.clone();
        not_a_number.columns.insert("a".to_owned(), vec![f64::NAN]);
        assert_eq!(not_a_number.columns(["a", "b"]), None);
    }
}
