//! Time that stands still while any task has something to do: tasks run in a fixed order, and when all wait
//! the clock jumps to the first timer. So a run is a function of its seed, and hours take seconds.

use std::collections::{BTreeMap, VecDeque};
use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::task::{Context, Poll, Wake, Waker};
use std::time::Duration;

type Task = Pin<Box<dyn Future<Output = ()> + Send>>;

#[derive(Default)]
struct State {
    now: Duration,
    next: u64,
    timers: BTreeMap<(Duration, u64), Waker>,
    tasks: BTreeMap<u64, Option<Task>>,
    ready: VecDeque<u64>,
    stopped: bool,
}

/// The clock, its tasks and its timers.
#[derive(Clone, Default)]
pub(super) struct Executor(Arc<Mutex<State>>);

struct TaskWaker {
    executor: Executor,
    task: u64,
    queued: AtomicBool,
}

impl Wake for TaskWaker {
    fn wake(self: Arc<Self>) {
        if !self.queued.swap(true, Ordering::Relaxed) {
            self.executor.state().ready.push_back(self.task);
        }
    }
}

/// A task, to be ended.
#[derive(Clone, Copy)]
pub(super) struct TaskId(u64);

impl Executor {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    pub(super) fn now(&self) -> Duration {
        self.state().now
    }

    /// Lets time pass for work that waits for nothing.
    pub(super) fn pass(&self, time: Duration) {
        self.state().now += time;
    }

    pub(super) fn spawn(&self, task: impl Future<Output = ()> + Send + 'static) -> TaskId {
        let mut state = self.state();
        state.next += 1;
        let id = state.next;
        state.tasks.insert(id, Some(Box::pin(task)));
        state.ready.push_back(id);
        TaskId(id)
    }

    /// Ends a task where it stands.
    pub(super) fn kill(&self, task: TaskId) {
        // What it holds may lock the state when it goes.
        let gone = self.state().tasks.remove(&task.0);
        drop(gone);
    }

    /// (tasks, timers): what would grow if anything leaked.
    pub(super) fn load(&self) -> (usize, usize) {
        let state = self.state();
        (state.tasks.len(), state.timers.len())
    }

    pub(super) fn sleep(&self, time: Duration) -> Sleep {
        Sleep { executor: self.clone(), at: self.now() + time, timer: None }
    }

    /// Runs everything until `until`.
    pub(super) fn run(&self, until: Duration) {
        loop {
            self.run_ready();
            let mut state = self.state();
            let Some((&(at, _), _)) = state.timers.first_key_value() else { return };
            if at > until || state.stopped {
                state.now = state.now.max(at.min(until));
                return;
            }
            state.now = state.now.max(at);
            let waker = state.timers.pop_first().map(|(_, waker)| waker);
            drop(state);
            waker.unwrap().wake();
        }
    }

    fn run_ready(&self) {
        loop {
            let mut state = self.state();
            let Some(id) = state.ready.pop_front() else { return };
            let Some(mut task) = state.tasks.get_mut(&id).and_then(Option::take) else { continue };
            drop(state);
            let waker = TaskWaker { executor: self.clone(), task: id, queued: AtomicBool::new(false) };
            let waker = Waker::from(Arc::new(waker));
            let outcome = task.as_mut().poll(&mut Context::from_waker(&waker));
            let mut state = self.state();
            if outcome.is_ready() {
                state.tasks.remove(&id);
            } else if let Some(slot) = state.tasks.get_mut(&id) {
                *slot = Some(task);
                continue;
            }
            drop(state);
            drop(task);
        }
    }

    /// Lets no more time pass.
    pub(super) fn stop(&self) {
        self.state().stopped = true;
    }

    /// Ends everything: tasks hold the world, which holds the clock.
    pub(super) fn end(&self) {
        let tasks = std::mem::take(&mut self.state().tasks);
        drop(tasks);
        self.state().timers.clear();
    }
}

/// Completes at its time.
pub(super) struct Sleep {
    executor: Executor,
    at: Duration,
    timer: Option<u64>,
}

impl Future for Sleep {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        let executor = self.executor.clone();
        let mut state = executor.state();
        if state.now >= self.at {
            return Poll::Ready(());
        }
        let id = *self.timer.get_or_insert_with(|| {
            state.next += 1;
            state.next
        });
        state.timers.insert((self.at, id), context.waker().clone());
        Poll::Pending
    }
}

impl Drop for Sleep {
    fn drop(&mut self) {
        if let Some(id) = self.timer {
            let waker = self.executor.state().timers.remove(&(self.at, id));
            drop(waker);
        }
    }
}
