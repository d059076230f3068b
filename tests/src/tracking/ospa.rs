//! How far a set of tracks is from the truth: OSPA (Schuhmacher, Vo and Vo, 2008), and identities that change.

use std::collections::BTreeMap;

use curionav_planning::geometry::Point2;
use curionav_tracking_people::partners;

/// Greatest distance that counts, and what a person too many or too few costs, metres.
const CUT: f64 = 1.0;

/// OSPA of order 1 with this cut, metres.
pub(super) fn ospa(truth: &[Point2], tracks: &[Point2]) -> f64 {
    curionav_tracking_people::ospa(truth, tracks, CUT)
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
        for pair in partners(&places(truth), &places(tracks), CUT) {
            if pair.metres < 0.5 {
                let track = tracks[pair.track].0;
                let before = self.last.insert(truth[pair.truth].0, (track, self.scan));
                let switched = |(last, scan)| last != track && self.scan - scan <= LOST;
                self.switches += usize::from(before.is_some_and(switched));
            }
        }
    }
}
