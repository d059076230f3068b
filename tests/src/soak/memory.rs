//! What every process takes, sampled every second.

use std::collections::BTreeMap;
use std::time::Duration;

use super::process::{Usage, usage};

/// Processes of one role.
#[derive(Debug, Default)]
pub(super) struct Line {
    /// Resident size of all of them, MiB: mean before the mark, mean before the end, most.
    pub(super) mark: f64,
    pub(super) end: f64,
    pub(super) most: f64,
    /// The same of those that lived from the mark to the end.
    pub(super) survivors: usize,
    pub(super) survivors_mark: f64,
    pub(super) survivors_end: f64,
    /// Of these what is not of the program itself.
    pub(super) own_mark: f64,
    pub(super) own_end: f64,
    /// On a processor, all together.
    pub(super) busy: Duration,
}

/// Resident sizes at two times, and what was used in between.
pub(super) struct Memory {
    window: Duration,
    mark: Duration,
    end: Duration,
    /// By name and process: sums and counts of samples at the mark and at the end.
    sizes: BTreeMap<(String, u32), [Sum; 2]>,
    last: BTreeMap<(String, u32), Usage>,
    busy: BTreeMap<String, Duration>,
    most: BTreeMap<String, f64>,
}

fn role(name: &str) -> String {
    name.split_once('-').map_or(name, |(role, _)| role).to_owned()
}

/// Sizes added up, and how many.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    resident: f64,
    own: f64,
    count: u32,
}

impl Memory {
    /// Sizes are means over `window` before `mark` and before `end`.
    pub(super) fn new(window: Duration, mark: Duration, end: Duration) -> Self {
        let (sizes, last) = (BTreeMap::new(), BTreeMap::new());
        Self { window, mark, end, sizes, last, busy: BTreeMap::new(), most: BTreeMap::new() }
    }

    /// Samples every process, `at` that time; gives the size of all together, MiB.
    pub(super) fn sample(&mut self, at: Duration, pids: &[(String, u32)]) -> f64 {
        let near = |time: Duration| at <= time && at + self.window > time;
        let when = [near(self.mark), near(self.end)];
        let mut of_role: BTreeMap<String, f64> = BTreeMap::new();
        for (name, pid) in pids {
            let Some(now) = usage(*pid) else { continue };
            let key = (name.clone(), *pid);
            let before = self.last.insert(key.clone(), now).unwrap_or_default();
            *self.busy.entry(role(name)).or_default() += now.busy.saturating_sub(before.busy);
            *of_role.entry(role(name)).or_default() += now.resident;
            for (index, _) in when.into_iter().enumerate().filter(|(_, is_now)| *is_now) {
                let sum = &mut self.sizes.entry(key.clone()).or_default()[index];
                sum.resident += now.resident;
                sum.own += now.own;
                sum.count += 1;
            }
        }
        self.last.retain(|key, _| pids.contains(key));
        let all = of_role.values().sum();
        for (role, size) in of_role {
            let most = self.most.entry(role).or_default();
            *most = most.max(size);
        }
        all
    }

    /// What came of it, by role.
    pub(super) fn lines(&self) -> BTreeMap<String, Line> {
        let mut lines: BTreeMap<String, Line> = BTreeMap::new();
        for ((name, _), [mark, end]) in &self.sizes {
            let line = lines.entry(role(name)).or_default();
            let samples = self.samples();
            // A process that was there for a part of the time counts for as much.
            line.mark += mark.resident / samples[0];
            line.end += end.resident / samples[1];
            if mark.count > 0 && end.count > 0 {
                line.survivors += 1;
                line.survivors_mark += mark.resident / f64::from(mark.count);
                line.survivors_end += end.resident / f64::from(end.count);
                line.own_mark += mark.own / f64::from(mark.count);
                line.own_end += end.own / f64::from(end.count);
            }
        }
        for (role, line) in &mut lines {
            line.busy = self.busy.get(role).copied().unwrap_or_default();
            line.most = self.most.get(role).copied().unwrap_or_default();
        }
        lines
    }

    /// How often there was a look at the mark and at the end.
    fn samples(&self) -> [f64; 2] {
        [0, 1].map(|i| self.sizes.values().map(|sums| sums[i].count).max().unwrap_or(1).max(1).into())
    }
}
