//! Fields derived from a map, computed once and kept: what makes a replica warm.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock};

use crate::locked::locked;

/// One value, and who computes it. To look for it takes no lock, or two who look at once would be in each other's way.
struct Cell<V> {
    value: OnceLock<Arc<V>>,
    computing: Mutex<()>,
}

impl<V> Default for Cell<V> {
    fn default() -> Self {
        Self { value: OnceLock::new(), computing: Mutex::default() }
    }
}

/// Values that are remembered, those being computed included: looking for one stays quick.
const ENTRIES_MAX: usize = 1024;

/// The most recently used values of an expensive function.
pub struct SingleFlightCache<K, V> {
    entries: Mutex<VecDeque<(K, Arc<Cell<V>>)>>,
    bytes_max: usize,
    /// Bytes of a value.
    weigh: fn(&V) -> usize,
}

impl<K: PartialEq + Clone, V> SingleFlightCache<K, V> {
    /// Keeps values of at most `bytes_max` bytes together, as `weigh` says; the newest is kept whatever it weighs.
    pub fn new(bytes_max: usize, weigh: fn(&V) -> usize) -> Self {
        Self { entries: Mutex::new(VecDeque::new()), bytes_max, weigh }
    }

    /// The value of `key`, computed if it is not here. Others who ask for the same meanwhile wait for it
    /// rather than computing it again; those who ask for another are not held up.
    pub fn get_or_try<E>(&self, key: &K, compute: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        let cell = self.cell(key);
        let _computing = locked(&cell.computing);
        if let Some(value) = cell.value.get() {
            return Ok(Arc::clone(value));
        }
        let computed = Arc::new(compute()?);
        let value = Arc::clone(cell.value.get_or_init(|| computed));
        self.make_room(&value);
        Ok(value)
    }

    /// Forgets the values that have not been used for longest, if there are too many bytes of them.
    fn make_room(&self, newest: &Arc<V>) {
        let mut bytes = (self.weigh)(newest);
        locked(&self.entries).retain(|(_, cell)| match cell.value.get() {
            Some(value) if !Arc::ptr_eq(value, newest) => {
                let more = (self.weigh)(value);
                let fits = bytes.saturating_add(more) <= self.bytes_max;
                bytes += if fits { more } else { 0 };
                fits
            }
            _ => true,
        });
    }

    /// The value of `key` if it is here; nothing while it is still being computed.
    pub fn get(&self, key: &K) -> Option<Arc<V>> {
        let mut entries = locked(&self.entries);
        let at = entries.iter().position(|(k, _)| k == key)?;
        let value = Arc::clone(entries[at].1.value.get()?);
        // The entry is in use: it moves to the front of those kept.
        let entry = entries.remove(at)?;
        entries.push_front(entry);
        Some(value)
    }

    /// Keys whose values are kept now, the most recently used first.
    pub fn keys(&self) -> Vec<K> {
        let entries = locked(&self.entries);
        let done = entries.iter().filter(|(_, cell)| cell.value.get().is_some());
        done.map(|(key, _)| key.clone()).collect()
    }

    fn cell(&self, key: &K) -> Arc<Cell<V>> {
        let mut entries = locked(&self.entries);
        let at = entries.iter().position(|(k, _)| k == key);
        let entry = at.and_then(|at| entries.remove(at)).unwrap_or_else(|| (key.clone(), Arc::default()));
        let cell = Arc::clone(&entry.1);
        entries.push_front(entry);
        entries.truncate(ENTRIES_MAX);
        cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computes_once_and_forgets_the_oldest() {
        let kept = SingleFlightCache::new(2, |_| 1);
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
        assert_eq!(kept.keys(), [2, 1]);
        assert_eq!((kept.get(&1).as_deref(), kept.get(&3)), (Some(&10), None));
        assert_eq!(kept.keys(), [1, 2]);
    }

    #[test]
    fn many_small_values_are_kept_or_one_that_is_too_large() {
        let kept = SingleFlightCache::new(100, |value: &usize| *value);
        let keep = |weight: usize| *kept.get_or_try(&weight, || Ok::<_, ()>(weight)).unwrap();
        (1..=10).for_each(|weight| assert_eq!(keep(weight), weight));
        assert_eq!(kept.keys().len(), 10);
        // 60, 10, 9, 8, 7 and 6 are 100.
        keep(60);
        assert_eq!(kept.keys(), [60, 10, 9, 8, 7, 6]);
        keep(1000);
        assert_eq!(kept.keys(), [1000]);
        keep(3);
        assert_eq!(kept.keys(), [3]);
    }

    #[test]
    fn what_could_not_be_computed_is_not_here() {
        let kept = SingleFlightCache::<i32, i32>::new(2, |_| 1);
        assert!(kept.get_or_try(&9, || Err::<i32, _>("no")).is_err());
        assert!(kept.get(&9).is_none() && kept.keys().is_empty());
    }

    #[test]
    fn a_panic_while_computing_is_forgotten_once_it_is_computed() {
        let kept = SingleFlightCache::<i32, i32>::new(2, |_| 1);
        let panics = || kept.get_or_try(&1, || -> Result<i32, ()> { panic!("expected by this test") });
        assert!(std::panic::catch_unwind(std::panic::AssertUnwindSafe(panics)).is_err());
        kept.get_or_try(&1, || Ok::<_, ()>(10)).unwrap();
        assert_eq!((kept.get(&1).as_deref(), kept.keys()), (Some(&10), vec![1]));
    }

    #[test]
    fn what_is_kept_is_found_however_many_look_for_it_at_once() {
        let kept = SingleFlightCache::new(2, |_| 1);
        kept.get_or_try(&1, || Ok::<_, ()>(10)).unwrap();
        let look = || (0..20_000).filter(|_| kept.get(&1).is_none() || kept.keys().is_empty()).count();
        let missed: usize = std::thread::scope(|scope| {
            let looking: Vec<_> = (0..4).map(|_| scope.spawn(look)).collect();
            looking.into_iter().map(|thread| thread.join().unwrap()).sum()
        });
        assert_eq!(missed, 0);
    }

    #[test]
    fn computing_one_value_holds_up_no_question_for_another() {
        let kept = SingleFlightCache::new(4, |_| 1);
        kept.get_or_try(&1, || Ok::<_, ()>(10)).unwrap();
        let value = kept.get_or_try(&2, || {
            assert_eq!(kept.get(&2), None);
            Ok::<_, ()>(*kept.get(&1).unwrap() * 2)
        });
        assert_eq!(*value.unwrap(), 20);
    }
}
