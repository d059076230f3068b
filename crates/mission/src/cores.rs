//! The processor's cores, which do long work of pure code together.

use std::num::NonZero;
use std::sync::Mutex;

use curionav_planning::workers::{Piece, Workers};

use crate::locked::locked;

/// So many threads, which are there only while there is work.
#[derive(Debug, Clone, Copy)]
pub struct Cores(NonZero<usize>);

impl Cores {
    /// As many as this process may use.
    pub fn all() -> Self {
        Self(std::thread::available_parallelism().unwrap_or(NonZero::<usize>::MIN))
    }
}

impl Workers for Cores {
    fn run(&self, pieces: Vec<Piece<'_>>) {
        let others = self.0.get().min(pieces.len()).saturating_sub(1);
        let left = Mutex::new(pieces.into_iter());
        let next = || locked(&left).next();
        let work = || std::iter::from_fn(next).for_each(|piece| piece());
        std::thread::scope(|scope| {
            (0..others).for_each(|_| drop(scope.spawn(work)));
            work();
        });
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::evaluation::cpc::{InformationField, InformationParams};
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use curionav_planning::random::{rng, uniform};
    use curionav_planning::sensor::LaserModel;
    use curionav_planning::workers::Alone;

    use super::*;

    #[test]
    fn fields_are_the_same_for_any_number_of_workers() {
        for seed in 0..5 {
            println!("seed {seed}");
            let mut r = rng(seed, 0);
            let cells = (0..250 * 190).map(|_| if uniform(&mut r) < 0.004 { 100 } else { 0 }).collect();
            let grid = OccupancyGrid::new(250, 190, 0.1, Pose2::new(1.0, -2.0, 0.3), cells).unwrap();
            let laser = LaserModel::default();
            let params = InformationParams::default();
            let fields = |workers: &dyn Workers| {
                let map = StaticMap::by(workers, grid.clone());
                let information = InformationField::by(workers, &map, &laser, &params);
                // All numbers, written such that different ones differ.
                format!("{:?} {:?} {information:?}", map.to_obstacle, map.to_occupied)
            };
            let alone = fields(&Alone);
            for threads in [1, 2, 3, 8, 64] {
                let together = fields(&Cores(NonZero::new(threads).unwrap()));
                assert!(alone == together, "{threads} threads");
            }
        }
    }

    #[test]
    fn every_piece_is_done_once() {
        for (threads, count) in [(1, 5), (4, 0), (4, 1), (4, 3), (3, 1000)] {
            let mut done = vec![0; count];
            let pieces = done.iter_mut().map(|times| -> Piece<'_> { Box::new(|| *times += 1) });
            Cores(NonZero::new(threads).unwrap()).run(pieces.collect());
            assert_eq!(done, vec![1; count]);
        }
    }
}
