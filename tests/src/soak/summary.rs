//! What the soak came to, in tables.

use std::collections::BTreeMap;

use super::memory::Memory;
use super::run::{LONG, Soak};
use super::watch::Counts;

/// Resident size at the end of a long run over that at the mark, at most. In a minute not every goal has been
/// prepared for, nor every buffer been used.
const GROWTH_MAX: f64 = 1.10;
/// Metres a robot drives at least in a minute: one that stands would prove nothing.
const METRES_A_MINUTE: f64 = 2.0;

fn percentile(values: &mut [f64], p: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let rank = (p * values.len() as f64).ceil() as usize;
    values.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

impl Soak {
    /// Prints everything.
    pub(super) fn tell(&mut self, memory: &Memory) {
        let counts: Counts = self.robots.iter().map(|r| r.watch().counts).sum();
        let (late, sum) = self
            .robots
            .iter()
            .map(|r| *r.lateness.lock().unwrap())
            .fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), a.1 + b.1));
        println!("{counts:?}");
        let mut degraded: BTreeMap<&str, u64> = BTreeMap::new();
        for robot in &self.robots {
            for (why, count) in &robot.watch().degraded {
                *degraded.entry(why).or_default() += count;
            }
        }
        println!("{degraded:?}");
        let due = self.lasts.as_secs_f64() * 10.0 * self.robots.len() as f64;
        println!(
            "ticks of those due {:.3}, decisions a tick {:.3}, nominal {:.4}, ticks late by {:.1} ms in the mean, at \
             most {:.0} ms",
            counts.ticks as f64 / due,
            counts.decisions as f64 / counts.ticks.max(1) as f64,
            counts.nominal as f64 / counts.decisions.max(1) as f64,
            1e3 * sum / counts.ticks.max(1) as f64,
            1e3 * late
        );
        let gap = self.robots.iter().map(|r| r.watch().followed_gap).fold(0.0, f64::max);
        println!("longest without driving {gap:.1} s, {:.2} m out of control", counts.uncontrolled);
        println!(
            "\nfault            times  nominal after s: p50  p99  max  driving: p50  p99  max  not by the next one  degraded later"
        );
        for (kind, healing) in &mut self.healing {
            let nominal = [0.5, 0.99, 1.0].map(|p| percentile(&mut healing.nominal_after, p));
            let driven = [0.5, 0.99, 1.0].map(|p| percentile(&mut healing.driven_after, p));
            println!(
                "{kind:16} {:5} {:20.2} {:4.2} {:4.2} {:13.2} {:4.2} {:4.2} {:20} {:10}/{}",
                healing.faults,
                nominal[0],
                nominal[1],
                nominal[2],
                driven[0],
                driven[1],
                driven[2],
                healing.unfinished,
                healing.settled.1,
                healing.settled.0
            );
        }
        println!(
            "\nrole         MiB at mark  at end   most   survivors  at mark  at end  ratio  own: at mark  at end  ratio   busy s"
        );
        for (role, line) in memory.lines() {
            println!(
                "{role:12} {:11.1} {:7.1} {:6.1} {:11} {:8.1} {:7.1} {:6.3} {:13.1} {:7.1} {:6.3} {:8.1}",
                line.mark,
                line.end,
                line.most,
                line.survivors,
                line.survivors_mark,
                line.survivors_end,
                line.survivors_end / line.survivors_mark,
                line.own_mark,
                line.own_end,
                line.own_end / line.own_mark,
                line.busy.as_secs_f64()
            );
        }
        let (mark, end) = total(memory);
        println!("all          {mark:11.1} {end:7.1}, ratio {:.3}", end / mark);
    }

    /// Fails if anything was not as it must be.
    pub(super) fn judge(&self, memory: &Memory) {
        self.violations.assert_none();
        let metres = METRES_A_MINUTE / 60.0 * self.lasts.as_secs_f64();
        for robot in &self.robots {
            let watch = robot.watch();
            watch.judge();
            let counts = watch.counts;
            assert!(counts.metres > metres && counts.followed > 0 && counts.reports > 0, "{counts:?}");
        }
        if self.lasts < LONG {
            return;
        }
        let (mark, end) = total(memory);
        assert!(end <= GROWTH_MAX * mark, "{end:.1} MiB at the end, {mark:.1} at the mark");
        for (role, line) in memory.lines().into_iter().filter(|(_, line)| line.survivors > 0) {
            let (mark, end) = (line.survivors_mark, line.survivors_end);
            assert!(end <= GROWTH_MAX * mark, "{role}: {end:.1} MiB at the end, {mark:.1} at the mark");
        }
    }
}

fn total(memory: &Memory) -> (f64, f64) {
    memory.lines().values().fold((0.0, 0.0), |a, line| (a.0 + line.mark, a.1 + line.end))
}
