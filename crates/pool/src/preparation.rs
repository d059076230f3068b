//! Preparing for missions beside the work: on threads of its own, so that fetching one robot's map takes no slot from
//! another robot.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};

use anyhow::Context;
use curionav_runtime::locked::locked;
use curionav_schemas::{Refusal, Reject};

/// Preparations at once: one that waits for a map must not keep another waiting that has its own.
const THREADS: usize = 4;
/// Preparations that wait: more than robots change their goals at once. Whose does not fit asks again.
const WAITING_MAX: usize = 64;
/// Preparations that failed and whose asker has not come back for the reason.
const FAILED_MAX: usize = 256;

/// What becomes of one preparation.
#[derive(Debug, Clone)]
enum State {
    Waits,
    /// Kept until it is asked for again.
    Failed(Reject),
}

type Job = (u64, Box<dyn FnOnce() -> Result<(), Reject> + Send>);

/// Preparations under way. The threads end when it is dropped.
pub(crate) struct Preparations {
    states: Arc<Mutex<BTreeMap<u64, State>>>,
    jobs: SyncSender<Job>,
}

impl Preparations {
    /// None yet.
    pub(crate) fn start() -> anyhow::Result<Self> {
        let (jobs, taken) = sync_channel::<Job>(WAITING_MAX);
        let taken = Arc::new(Mutex::new(taken));
        let states = Arc::default();
        for thread in 0..THREADS {
            let taken = Arc::clone(&taken);
            let states = Arc::clone(&states);
            let work = move || prepare(&taken, &states);
            std::thread::Builder::new().name(format!("prepare-{thread}")).spawn(work).context("a thread")?;
        }
        Ok(Self { states, jobs })
    }

    /// Sees to it that `prepare` is done, once for all who ask with the same `key` meanwhile. The refusal says that it
    /// is not done yet, or why it has failed; asked once more after that, it is tried again.
    pub(crate) fn refuse(
        &self,
        key: u64,
        cold: Reject,
        prepare: impl FnOnce() -> Result<(), Reject> + Send + 'static,
    ) -> Reject {
        let mut states = locked(&self.states);
        match states.get(&key) {
            Some(State::Waits) => return cold,
            Some(State::Failed(reject)) => {
                let reject = reject.clone();
                states.remove(&key);
                return reject;
            }
            None => {}
        }
        if self.jobs.try_send((key, Box::new(prepare))).is_ok() {
            states.insert(key, State::Waits);
        }
        cold
    }
}

fn prepare(taken: &Mutex<Receiver<Job>>, states: &Mutex<BTreeMap<u64, State>>) {
    loop {
        let job = locked(taken).recv();
        let Ok((key, prepare)) = job else { return };
        let outcome = catch_unwind(AssertUnwindSafe(prepare))
            .unwrap_or_else(|_| Err(Refusal::failed("the service failed while it prepared").into()));
        let mut states = locked(states);
        match outcome {
            Ok(()) => drop(states.remove(&key)),
            Err(reject) => {
                states.insert(key, State::Failed(reject));
                let is_failed =
                    |(key, state): (&u64, &State)| matches!(state, State::Failed(_)).then_some(*key);
                let failed: Vec<u64> = states.iter().filter_map(is_failed).collect();
                if failed.len() > FAILED_MAX {
                    states.remove(&failed[0]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn cold() -> Reject {
        Refusal::Cold { detail: "the map".into() }.into()
    }

    /// What is said once it is no longer cold.
    fn finally(preparations: &Preparations, key: u64) -> Option<Reject> {
        loop {
            match locked(&preparations.states).get(&key) {
                Some(State::Waits) => std::thread::yield_now(),
                Some(State::Failed(reject)) => return Some(reject.clone()),
                None => return None,
            }
        }
    }

    #[test]
    fn one_that_waits_for_its_map_holds_up_no_other_and_is_begun_once() {
        let preparations = Preparations::start().unwrap();
        let (map, fetched) = channel::<()>();
        let (begun, count) = channel::<()>();
        let slow = {
            let begun = begun.clone();
            move || {
                begun.send(()).unwrap();
                fetched.recv().map_err(|_| Reject::from(Refusal::NoMap { detail: "gone".into() }))
            }
        };
        assert_eq!(preparations.refuse(1, cold(), slow), cold());
        assert_eq!(preparations.refuse(1, cold(), || unreachable!()), cold());
        for key in 2..20 {
            assert_eq!(preparations.refuse(key, cold(), || Ok(())), cold());
            assert_eq!(finally(&preparations, key), None);
        }
        map.send(()).unwrap();
        assert_eq!(finally(&preparations, 1), None);
        drop(begun);
        assert_eq!(count.iter().count(), 1);
    }

    #[test]
    fn a_failure_is_said_to_the_next_who_asks_and_then_it_is_tried_again() {
        let preparations = Preparations::start().unwrap();
        let no_map = || Reject::from(Refusal::NoMap { detail: "nothing serves it".into() });
        assert_eq!(preparations.refuse(1, cold(), move || Err(no_map())), cold());
        assert_eq!(finally(&preparations, 1), Some(no_map()));
        assert_eq!(preparations.refuse(1, cold(), || unreachable!()), no_map());
        assert_eq!(preparations.refuse(1, cold(), || panic!("expected by this test")), cold());
        assert!(matches!(finally(&preparations, 1).unwrap().why, Refusal::Failed { .. }));
    }
}
