//! The belief as a sparse histogram of poses, and its clusters: sets of connected bins.

use curionav_planning::geometry::Pose2;
use rustc_hash::FxHashMap;

/// Histogram over (x, y, heading). Bins are numbered in the order in which they were first hit.
#[derive(Default)]
pub(crate) struct Histogram {
    bin_position: f64,
    sectors: i64,
    numbers: FxHashMap<Bin, u32>,
    bins: Vec<Bin>,
    weight: Vec<f64>,
    /// The bin of the last pose: poses that follow each other are often neighbours.
    last: Option<(Bin, u32)>,
    parent: Vec<u32>,
}

/// Column, row and sector.
type Bin = [i64; 3];

impl Histogram {
    /// Of bins of `bin_position` metres squared and about `bin_heading` radians.
    pub(crate) fn new(bin_position: f64, bin_heading: f64) -> Self {
        let sectors = (std::f64::consts::TAU / bin_heading).round().max(4.0) as i64;
        Self { bin_position, sectors, ..Self::default() }
    }

    pub(crate) fn len(&self) -> usize {
        self.bins.len()
    }

    /// Adds weight at a pose; returns the bin's number.
    pub(crate) fn add(&mut self, pose: Pose2, weight: f64) -> u32 {
        let sector = (pose.heading / std::f64::consts::TAU * self.sectors as f64).floor() as i64;
        let bin = [
            (pose.x / self.bin_position).floor() as i64,
            (pose.y / self.bin_position).floor() as i64,
            sector.rem_euclid(self.sectors),
        ];
        if let Some((_, number)) = self.last.filter(|(last, _)| *last == bin) {
            self.weight[number as usize] += weight;
            return number;
        }
        let number = *self.numbers.entry(bin).or_insert_with(|| {
            let number = self.bins.len() as u32;
            self.bins.push(bin);
            self.weight.push(0.0);
            self.parent.push(number);
            number
        });
        self.last = Some((bin, number));
        self.weight[number as usize] += weight;
        number
    }

    /// Joins bins that touch, corners included; heading wraps around.
    pub(crate) fn connect(&mut self) {
        // Half of the 26 neighbours of a bin; the other half find it from their side.
        let forward: Vec<[i64; 3]> =
            (0..18).map(|i| [i / 9, i / 3 % 3 - 1, i % 3 - 1]).filter(|step| *step > [0; 3]).collect();
        for number in 0..self.bins.len() {
            let [x, y, sector] = self.bins[number];
            for [turn, dy, dx] in &forward {
                let next = [x + dx, y + dy, (sector + turn).rem_euclid(self.sectors)];
                if let Some(&found) = self.numbers.get(&next) {
                    let a = self.root(number as u32);
                    let b = self.root(found);
                    self.parent[a.max(b) as usize] = a.min(b);
                }
            }
        }
    }

    /// The cluster a bin belongs to, named by its first bin. Valid after [`Self::connect`].
    pub(crate) fn root(&mut self, bin: u32) -> u32 {
        let mut bin = bin;
        while self.parent[bin as usize] != bin {
            let grandparent = self.parent[self.parent[bin as usize] as usize];
            self.parent[bin as usize] = grandparent;
            bin = grandparent;
        }
        bin
    }

    /// The heaviest cluster, the first of equals; None when empty. Leaves cluster sums in the weights.
    pub(crate) fn heaviest(&mut self) -> Option<u32> {
        for bin in 0..self.bins.len() {
            let root = self.root(bin as u32) as usize;
            if root != bin {
                self.weight[root] += self.weight[bin];
                self.weight[bin] = 0.0;
            }
        }
        // The last of equals in reverse is the first.
        let bins = (0..self.bins.len()).rev();
        bins.max_by(|a, b| self.weight[*a].total_cmp(&self.weight[*b])).map(|bin| bin as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::random::{rng, uniform};

    #[test]
    fn clusters_equal_flood_fill_over_all_pairs() {
        for seed in 0..30 {
            let mut r = rng(seed, 0);
            let mut h = Histogram::new(0.5, 10.0_f64.to_radians());
            for _ in 0..60 {
                let pose = Pose2::new(
                    5.0 * uniform(&mut r) - 2.5,
                    5.0 * uniform(&mut r) - 2.5,
                    1.5 * uniform(&mut r) + 2.5,
                );
                h.add(pose, uniform(&mut r));
            }
            let bins = h.bins.clone();
            let mut label: Vec<usize> = (0..bins.len()).collect();
            let touch = |a: &[i64; 3], b: &[i64; 3]| {
                let turn = (a[2] - b[2]).rem_euclid(36);
                (a[0] - b[0]).abs() <= 1 && (a[1] - b[1]).abs() <= 1 && (turn <= 1 || turn == 35)
            };
            for _ in 0..bins.len() {
                for i in 0..bins.len() {
                    for j in 0..bins.len() {
                        if touch(&bins[i], &bins[j]) {
                            label[i] = label[i].min(label[j]);
                        }
                    }
                }
            }
            h.connect();
            for (i, expected) in label.iter().enumerate() {
                assert_eq!(h.root(i as u32) as usize, *expected, "seed {seed}");
            }
        }
    }

    #[test]
    fn heading_bins_touch_across_the_turn() {
        let mut h = Histogram::new(0.5, 10.0_f64.to_radians());
        h.add(Pose2::new(0.1, 0.1, 3.1), 0.2);
        h.add(Pose2::new(0.1, 0.1, -3.1), 0.2);
        h.add(Pose2::new(3.1, 0.1, 0.0), 0.3);
        h.connect();
        assert_eq!(h.len(), 3);
        assert_eq!(h.heaviest(), Some(0));
    }
}
