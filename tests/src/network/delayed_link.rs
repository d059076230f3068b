//! A TCP relay that keeps everything for a while: delay and jitter where the kernel cannot make them.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_planning::random;

/// Relays connections to a router, each way with the delay that is set.
pub(super) struct DelayedLink {
    /// Where clients connect.
    pub(super) address: String,
    state: Arc<State>,
}

#[derive(Default)]
struct State {
    delay_us: AtomicU64,
    jitter_us: AtomicU64,
    over: AtomicBool,
    connections: Mutex<Vec<TcpStream>>,
}

impl DelayedLink {
    /// Listens on a free port of `ours` and relays to the Zenoh endpoint `to`; no delay yet.
    pub(super) fn new(ours: &str, to: &str) -> Self {
        let listener = TcpListener::bind((ours, 0)).unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let state = Arc::new(State::default());
        let (shared, to) = (Arc::clone(&state), to.split_once('/').unwrap().1.to_owned());
        std::thread::spawn(move || {
            for (stream, near) in (0..).zip(listener.incoming().map_while(Result::ok)) {
                if shared.over.load(Ordering::Relaxed) {
                    break;
                }
                let Ok(far) = TcpStream::connect(&to) else { continue };
                relay(&near, &far, &shared, 2 * stream);
                relay(&far, &near, &shared, 2 * stream + 1);
                shared.connections.lock().unwrap().extend([near, far]);
            }
        });
        Self { address, state }
    }

    /// From now on each piece is kept for `delay` and up to `jitter` more, each way, in order.
    pub(super) fn set(&self, delay: Duration, jitter: Duration) {
        self.state.delay_us.store(delay.as_micros() as u64, Ordering::Relaxed);
        self.state.jitter_us.store(jitter.as_micros() as u64, Ordering::Relaxed);
    }
}

impl Drop for DelayedLink {
    fn drop(&mut self) {
        self.state.over.store(true, Ordering::Relaxed);
        // This wakes the thread that listens; closing wakes those that read.
        let _ = TcpStream::connect(&self.address);
        for connection in self.state.connections.lock().unwrap().iter() {
            let _ = connection.shutdown(Shutdown::Both);
        }
    }
}

/// One direction: a thread that reads and says when each piece is due, and one that waits and writes.
fn relay(from: &TcpStream, to: &TcpStream, state: &Arc<State>, stream: u64) {
    let (sender, due) = channel();
    let (mut from, to, state) = (from.try_clone().unwrap(), to.try_clone().unwrap(), Arc::clone(state));
    let _ = to.set_nodelay(true);
    std::thread::spawn(move || write_when_due(to, &due));
    std::thread::spawn(move || {
        let mut rng = random::rng(7, stream);
        let mut buffer = vec![0; 65536];
        while let Ok(count @ 1..) = from.read(&mut buffer) {
            let jitter = state.jitter_us.load(Ordering::Relaxed) as f64 * random::uniform(&mut rng);
            let wait = state.delay_us.load(Ordering::Relaxed) + jitter as u64;
            let at = Instant::now() + Duration::from_micros(wait);
            if sender.send((at, buffer[..count].to_vec())).is_err() {
                break;
            }
        }
    });
}

fn write_when_due(mut to: TcpStream, due: &Receiver<(Instant, Vec<u8>)>) {
    for (at, piece) in due {
        std::thread::sleep(at.saturating_duration_since(Instant::now()));
        if to.write_all(&piece).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
}
