//! Fields derived from a map, computed once and kept: what makes a replica warm.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// The few most recently used values of an expensive function.
pub struct Kept<K, V> {
    entries: Mutex<VecDeque<(K, Arc<V>)>>,
    limit: usize,
}

impl<K: PartialEq + Clone, V> Kept<K, V> {
    /// Keeps at most `limit` values.
    pub fn new(limit: usize) -> Self {
        Self { entries: Mutex::new(VecDeque::new()), limit }
    }

    /// The value of `key`, computed if it is not here. Others who ask meanwhile wait for it rather than
    /// computing it again.
    pub fn get_or_try<E>(&self, key: &K, compute: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        // A panic while computing leaves the list whole: nothing is inserted before it is done.
        let mut entries = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = entries.iter().position(|(k, _)| k == key)
            && let Some(entry) = entries.remove(at)
        {
            let value = Arc::clone(&entry.1);
            entries.push_front(entry);
            return Ok(value);
        }
        let value = Arc::new(compute()?);
        entries.push_front((key.clone(), Arc::clone(&value)));
        entries.truncate(self.limit);
        Ok(value)
    }

    /// How many values are kept now.
    pub fn len(&self) -> usize {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// Whether nothing is kept.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computes_once_and_forgets_the_oldest() {
        let kept = Kept::new(2);
        let mut computed = 0;
        for key in [1, 1, 2, 1, 3, 1, 2] {
            let value = kept.get_or_try(&key, || {
                computed += 1;
                Ok::<_, ()>(key * 10)
            });
            assert_eq!(*value.unwrap(), key * 10);
        }
        // 1, 2, 3 once each, and 2 again after 3 had pushed it out.
        assert_eq!(computed, 4);
        assert!(kept.get_or_try(&9, || Err::<i32, _>("no")).is_err());
        assert_eq!(kept.len(), 2);
    }
}
