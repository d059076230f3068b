//! A queue of one reader that is bounded in messages and in bytes; when it is full, the oldest goes.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use tokio::sync::Notify;

use crate::locked::locked;

#[derive(Debug)]
struct Waiting<T> {
    items: VecDeque<(usize, T)>,
    bytes: usize,
    is_closed: bool,
}

/// Where a reader takes items from.
#[derive(Debug)]
pub struct ByteRing<T> {
    waiting: Mutex<Waiting<T>>,
    arrived: Notify,
    items_max: usize,
    bytes_max: usize,
}

/// Where a callback puts items; the reader is told when it is dropped.
#[derive(Debug)]
pub struct Feeder<T>(Arc<ByteRing<T>>);

impl<T> ByteRing<T> {
    /// Nothing waits; at most so many items may, of so many bytes together. A single item may have more bytes.
    pub fn new(items_max: usize, bytes_max: usize) -> (Feeder<T>, Arc<Self>) {
        let waiting = Mutex::new(Waiting { items: VecDeque::new(), bytes: 0, is_closed: false });
        let ring = Arc::new(Self { waiting, arrived: Notify::new(), items_max, bytes_max });
        (Feeder(Arc::clone(&ring)), ring)
    }

    /// The oldest item that waits.
    pub fn pop(&self) -> Option<T> {
        let mut waiting = locked(&self.waiting);
        let (bytes, item) = waiting.items.pop_front()?;
        waiting.bytes -= bytes;
        Some(item)
    }

    /// The oldest item, waited for; nothing once nothing more can come. Cancel-safe.
    pub async fn next(&self) -> Option<T> {
        loop {
            if let Some(item) = self.pop() {
                return Some(item);
            }
            if locked(&self.waiting).is_closed {
                return self.pop();
            }
            self.arrived.notified().await;
        }
    }
}

impl<T> Feeder<T> {
    /// Adds an item of so many bytes; gives back how many older ones had to go for it.
    pub fn push(&self, bytes: usize, item: T) -> u64 {
        let mut gone = 0;
        let mut waiting = locked(&self.0.waiting);
        let is_full =
            |w: &Waiting<T>| w.items.len() >= self.0.items_max || w.bytes + bytes > self.0.bytes_max;
        while is_full(&waiting)
            && let Some((bytes, _)) = waiting.items.pop_front()
        {
            waiting.bytes -= bytes;
            gone += 1;
        }
        waiting.bytes += bytes;
        waiting.items.push_back((bytes, item));
        drop(waiting);
        self.0.arrived.notify_one();
        gone
    }
}

impl<T> Drop for Feeder<T> {
    fn drop(&mut self) {
        locked(&self.0.waiting).is_closed = true;
        self.0.arrived.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_when_there_are_too_many_or_too_large_ones() {
        let (feeder, ring) = ByteRing::new(3, 100);
        let gone: Vec<u64> = [(1, 10), (2, 10), (3, 10), (4, 10), (5, 85), (6, 500)]
            .map(|(item, bytes)| feeder.push(bytes, item))
            .into();
        assert_eq!(gone, [0, 0, 0, 1, 2, 2]);
        assert_eq!((ring.pop(), ring.pop()), (Some(6), None));
        assert_eq!(locked(&ring.waiting).bytes, 0);
        feeder.push(100, 7);
        feeder.push(0, 8);
        assert_eq!((ring.pop(), ring.pop()), (Some(7), Some(8)));
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_reader_gets_what_was_put_before_the_end_and_then_the_end() {
        let (feeder, ring) = ByteRing::new(3, 100);
        let reading = tokio::spawn({
            let ring = Arc::clone(&ring);
            async move { (ring.next().await, ring.next().await, ring.next().await) }
        });
        feeder.push(1, "a");
        feeder.push(1, "b");
        drop(feeder);
        assert_eq!(reading.await.unwrap(), (Some("a"), Some("b"), None));
    }
}
