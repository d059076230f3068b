//! Percentiles of recent durations.

use std::time::Duration;

/// The last 4096 durations: a few minutes of a planning cycle.
#[derive(Debug, Clone, Default)]
pub struct Latency {
    recent: Vec<Duration>,
    next: usize,
}

impl Latency {
    const KEPT: usize = 4096;

    /// Adds one.
    pub fn record(&mut self, duration: Duration) {
        if self.recent.len() < Self::KEPT {
            self.recent.push(duration);
        } else {
            self.recent[self.next] = duration;
        }
        self.next = (self.next + 1) % Self::KEPT;
    }

    /// The duration that a share `p` (0 to 1) of them does not exceed, milliseconds; 0 without any.
    pub fn percentile_ms(&self, p: f64) -> f64 {
        percentile_ms(&mut self.recent.clone(), p)
    }
}

/// The duration that a `share` (0 to 1) of `times` does not exceed, milliseconds; 0 without any. Sorts them.
pub fn percentile_ms(times: &mut [Duration], share: f64) -> f64 {
    times.sort_unstable();
    let rank = (share * times.len() as f64).ceil() as usize;
    times.get(rank.saturating_sub(1)).map_or(0.0, |time| time.as_micros() as f64 / 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_by_nearest_rank() {
        let mut latency = Latency::default();
        assert_eq!(latency.percentile_ms(0.99), 0.0);
        for ms in 1..=100 {
            latency.record(Duration::from_millis(ms));
        }
        assert_eq!(latency.percentile_ms(0.50), 50.0);
        assert_eq!(latency.percentile_ms(0.99), 99.0);
        assert_eq!(latency.percentile_ms(1.0), 100.0);
    }
}
