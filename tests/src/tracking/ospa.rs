//! How far a set of tracks is from the truth: OSPA (Schuhmacher, Vo and Vo, 2008), and identities that change.

use std::collections::BTreeMap;

use curionav_planning::geometry::Point2;
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Greatest distance that counts, and what a person too many or too few costs, metres.
const CUT: f64 = 1.0;

/// For each of the fewer points, as (truth, track), its partner in the assignment of the least sum of distances, each
/// cut.
fn partners(truth: &[Point2], tracks: &[Point2]) -> Vec<(usize, usize)> {
    let swapped = truth.len() > tracks.len();
    let (few, many) = if swapped { (tracks, truth) } else { (truth, tracks) };
    if few.is_empty() {
        return Vec::new();
    }
    let cost = |(i, j): (usize, usize)| (few[i].distance(many[j]).min(CUT) * 1e6) as i64;
    let costs = Matrix::from_fn(few.len(), many.len(), cost);
    let pairs = kuhn_munkres_min(&costs).1.into_iter().enumerate();
    pairs.map(|(i, j)| if swapped { (j, i) } else { (i, j) }).collect()
}

/// OSPA of order 1, metres: the mean over the greater number, with a cut for each that has no partner.
pub(super) fn ospa(truth: &[Point2], tracks: &[Point2]) -> f64 {
    let most = truth.len().max(tracks.len());
    if most == 0 {
        return 0.0;
    }
    let pairs = partners(truth, tracks);
    let near: f64 = pairs.iter().map(|(i, j)| truth[*i].distance(tracks[*j]).min(CUT)).sum();
    (near + CUT * (most - pairs.len()) as f64) / most as f64
}

/// Scans after which a person who was not tracked in between may have another track: a second.
const LOST: usize = 10;

/// Counts how often a person's track is another than the one of the last second.
#[derive(Default)]
pub(super) struct Identities {
    /// Of each person the track, and in which scan it was seen last.
    last: BTreeMap<u32, (u32, usize)>,
    scan: usize,
    pub(super) switches: usize,
}

impl Identities {
    /// Takes in one scan: ids and places of people and of tracks.
    pub(super) fn take(&mut self, truth: &[(u32, Point2)], tracks: &[(u32, Point2)]) {
        self.scan += 1;
        let places = |of: &[(u32, Point2)]| of.iter().map(|one| one.1).collect::<Vec<_>>();
        for (i, j) in partners(&places(truth), &places(tracks)) {
            if truth[i].1.distance(tracks[j].1) < 0.5 {
                let before = self.last.insert(truth[i].0, (tracks[j].0, self.scan));
                let switched = |(track, scan)| track != tracks[j].0 && self.scan - scan <= LOST;
                self.switches += usize::from(before.is_some_and(switched));
            }
        }
    }
}

#[test]
fn ospa_counts_distance_and_number() {
    let p = |x: f64| Point2::new(x, 0.0);
    assert_eq!(ospa(&[], &[]), 0.0);
    assert_eq!(ospa(&[p(0.0)], &[]), 1.0);
    // 0.2 m and 0.1 m to the nearer ones, and one too many.
    assert!((ospa(&[p(0.0), p(1.0)], &[p(1.1), p(0.2), p(9.0)]) - 1.3 / 3.0).abs() < 1e-9);
    assert_eq!(ospa(&[p(0.0)], &[p(7.0)]), 1.0);
}
