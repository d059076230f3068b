//! The people around a robot, scan by scan.

use std::sync::Arc;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::numerics::{atan2, hypot};
use curionav_planning::occupancy::StaticMap;
use curionav_planning::scene::Belief;
use curionav_planning::sensor::LaserModel;

use crate::assignment::{Pair, assign};
use crate::detector::{Detection, Detector, Kind, Seen};
use crate::ego_motion::EgoMotion;
use crate::params::TrackerParams;
use crate::track::{Person, Track};

/// What the robot knows at the moment of a scan.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// Robot's clock, seconds.
    pub stamp: f64,
    /// One a beam, metres.
    pub ranges: &'a [f32],
    /// The scanner.
    pub laser: &'a LaserModel,
    /// Where odometry says the robot is, in a frame of its own.
    pub odometry: Pose2,
    /// Where the robot believes it is on the map.
    pub belief: &'a Belief,
}

/// Most things that are followed at a time, people and what may become some: as many as a message may hold.
const MOST_TRACKS: usize = 1024;
/// Longest step between scans, seconds: after a longer silence all begins anew.
const LONGEST_STEP: f64 = 2.0;
/// How much likelier a pair of legs is a person's than a thing's, as a logarithm.
const PAIR: f64 = 1.0;
/// What a second leg costs besides its distance, so that a leg is rather the first of one person than the second of
/// another.
const SECOND_LEG: f64 = 1.0;

/// Follows the people around one robot on a known map.
#[derive(Debug, Clone)]
pub struct Tracker {
    detector: Detector,
    params: TrackerParams,
    ego: EgoMotion,
    /// By ascending id.
    tracks: Vec<Track>,
    next_id: u32,
    stamp: Option<f64>,
}

impl Tracker {
    /// A tracker that knows no people yet, on a robot with this odometry. `params` are such as their check passes.
    pub fn new(map: Arc<StaticMap>, params: TrackerParams, noise: OdometryNoise) -> Self {
        Self {
            detector: Detector::new(map, params),
            params,
            ego: EgoMotion::new(noise),
            tracks: Vec::new(),
            next_id: 1,
            stamp: None,
        }
    }

    /// Forgets all people, as after a restart of the base; ids go on.
    pub fn restart(&mut self) {
        self.tracks.clear();
        self.ego.restart();
        self.stamp = None;
    }

    /// Takes in a scan; gives the people there are, by ascending id, and what was seen.
    pub fn update(&mut self, now: &Observation<'_>) -> (Vec<Person>, Seen) {
        let step = self.stamp.map_or(0.0, |last| now.stamp - last);
        if !(0.0..=LONGEST_STEP).contains(&step) {
            self.restart();
        } else {
            self.tracks.iter_mut().for_each(|track| track.predict(step, &self.params));
        }
        self.stamp = Some(now.stamp);
        let expected = self.ego.expect(now.odometry, now.belief);
        let seen = self.detector.see(now.ranges, now.laser, expected.pose, &expected.covariance);
        let robot = seen.pose;
        if let Some(from) = expected.instead_of {
            self.tracks.iter_mut().for_each(|track| track.carry(from, robot));
        }
        self.ego.settle(now.odometry, robot, seen.covariance);
        let found: Vec<Detection> = seen
            .detections
            .iter()
            .map(|one| Detection { position: robot.transform(one.position), ..*one })
            .collect();
        let left = self.follow(&found, now.stamp);
        self.begin(&left, now.stamp);
        self.forget(now, robot);
        self.merge();
        let people = self.tracks.iter().filter(|track| track.is_person(now.stamp, &self.params));
        (people.map(|track| track.person(now.stamp, robot, &self.params)).collect(), seen)
    }

    /// Gives each track the detections that are most likely its own; gives back those of none.
    fn follow(&mut self, found: &[Detection], stamp: f64) -> Vec<Detection> {
        let pairs = self.pairs(found);
        let most = pairs.iter().map(|pair| pair.cost).fold(0.0, f64::max);
        let given = assign(2 * self.tracks.len(), &pairs, most);
        let mut taken = vec![false; found.len()];
        for (track, own) in self.tracks.iter_mut().zip(given.chunks_exact(2)) {
            let mut own: Vec<usize> = own.iter().flatten().copied().collect();
            if let [a, b] = own[..]
                && are_apart(&found[a], &found[b], &self.params)
            {
                own.truncate(1);
            }
            own.iter().for_each(|d| taken[*d] = true);
            match own[..] {
                [a, b] if is_leg(&found[a]) && is_leg(&found[b]) => {
                    let (position, sigma) = middle_of_legs(&found[a], &found[b]);
                    track.update(position, sigma, stamp, &self.params);
                    track.take_shape(PAIR);
                }
                // A leg beside a trunk is a part of the same person.
                [a, ..] => {
                    track.update(found[a].position, spread(&found[a], &self.params), stamp, &self.params);
                    track.take_shape(found[a].roundness);
                }
                [] => track.miss(&self.params),
            }
        }
        let free = found.iter().zip(&taken).filter(|(_, taken)| !**taken);
        free.map(|(one, _)| *one).collect()
    }

    /// Which detections may be of which track. A track has two rows, the second one for a second leg.
    fn pairs(&self, found: &[Detection]) -> Vec<Pair> {
        let mut pairs = Vec::new();
        for (t, track) in self.tracks.iter().enumerate() {
            for (column, one) in found.iter().enumerate() {
                let sigma = spread(one, &self.params);
                let distance = track.estimate().distance(one.position, sigma);
                if distance > self.params.gate {
                    continue;
                }
                // How unlikely it is: of two who may both be there, the one whose place is known better is likelier.
                let cost = distance + track.estimate().ln_determinant(sigma);
                pairs.push(Pair { row: 2 * t, column, cost });
                if is_leg(one) && distance + SECOND_LEG <= self.params.gate {
                    pairs.push(Pair { row: 2 * t + 1, column, cost: cost + SECOND_LEG });
                }
            }
        }
        pairs
    }

    /// Begins tracks of what is of no track: of legs in pairs, the nearest first, of trunks, and of legs alone.
    fn begin(&mut self, left: &[Detection], stamp: f64) {
        let params = self.params;
        let legs: Vec<&Detection> = left.iter().filter(|one| is_leg(one)).collect();
        let mut begun: Vec<(Point2, f64)> = Vec::new();
        let mut paired = vec![false; legs.len()];
        for (a, b) in neighbours(&legs, params.leg_distance) {
            if !paired[a] && !paired[b] {
                paired[a] = true;
                paired[b] = true;
                begun.push(middle_of_legs(legs[a], legs[b]));
            }
        }
        let alone = legs.iter().zip(&paired).filter(|(_, paired)| !**paired).map(|(one, _)| *one);
        let trunks = left.iter().filter(|one| !is_leg(one));
        begun.extend(trunks.chain(alone).map(|one| (one.position, spread(one, &params))));
        for (position, sigma) in begun {
            // What is left inside of a person who has just been seen is a part of it.
            let is_part = self.tracks.iter().any(|track| {
                track.seen == stamp && track.estimate().position().distance(position) < params.merge_distance
            });
            if !is_part && self.tracks.len() < MOST_TRACKS {
                self.tracks.push(Track::new(self.next_id, position, sigma, stamp, &params));
                self.next_id = self.next_id.wrapping_add(1);
            }
        }
    }

    /// Forgets who should be seen and is not, and whose place is no longer known.
    fn forget(&mut self, now: &Observation<'_>, robot: Pose2) {
        let params = self.params;
        self.tracks.retain(|track| {
            let unseen = now.stamp - track.seen;
            let estimate = track.estimate();
            let place = robot.inverse_transform(estimate.position());
            let is_somewhere = unseen > 0.0 && estimate.sigma() > params.forget_sigma;
            // The rounding of stamps must not cost a scan.
            let is_gone = unseen > params.forget_in_view + 1e-6 && is_in_view(place, now, &params);
            !(track.is_hopeless(&params) || is_somewhere || is_gone)
        });
    }

    /// Of two tracks in one place the older one stays, or the one that is a person.
    fn merge(&mut self) {
        let mut at = 0;
        while at < self.tracks.len() {
            let one = &self.tracks[at];
            let later = &self.tracks[at + 1..];
            match later.iter().position(|other| are_one(one, other, &self.params)) {
                None => at += 1,
                Some(offset) if later[offset].confirmed && !one.confirmed => {
                    self.tracks.remove(at);
                }
                Some(offset) => {
                    self.tracks.remove(at + 1 + offset);
                }
            }
        }
    }
}

/// Two tracks whose velocities differ by more than this are of people who pass each other, m/s.
const TOGETHER: f64 = 0.5;

/// Whether two tracks are of one person.
fn are_one(one: &Track, other: &Track, params: &TrackerParams) -> bool {
    let a = one.estimate();
    let b = other.estimate();
    a.position().distance(b.position()) < params.merge_distance
        && a.velocity().distance(b.velocity()) < TOGETHER
}

fn is_leg(one: &Detection) -> bool {
    one.kind == Kind::Leg
}

/// Whether two legs are too far from each other to be of one person.
fn are_apart(a: &Detection, b: &Detection, params: &TrackerParams) -> bool {
    is_leg(a) && is_leg(b) && a.position.distance(b.position) > params.leg_distance
}

/// Pairs of legs at most `most` metres from each other, the nearest first.
fn neighbours(legs: &[&Detection], most: f64) -> Vec<(usize, usize)> {
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for a in 0..legs.len() {
        for b in a + 1..legs.len() {
            let apart = legs[a].position.distance(legs[b].position);
            if apart <= most {
                pairs.push((apart, a, b));
            }
        }
    }
    // The sort is stable: pairs as near as each other stay in the order of the beams.
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
    pairs.into_iter().map(|(_, a, b)| (a, b)).collect()
}

/// Standard deviation of a person's position by a detection, metres.
fn spread(one: &Detection, params: &TrackerParams) -> f64 {
    match one.kind {
        Kind::Leg => hypot(one.sigma, params.leg_spread),
        Kind::Trunk => one.sigma,
    }
}

/// The middle of two legs, and its standard deviation on each axis, metres.
fn middle_of_legs(a: &Detection, b: &Detection) -> (Point2, f64) {
    (a.position.toward(b.position, 0.5), hypot(a.sigma, b.sigma))
}

/// Whether a person at a place in the robot's frame would be seen by this scan: in the laser's view, and with nothing
/// nearer in the way.
fn is_in_view(position: Point2, now: &Observation<'_>, params: &TrackerParams) -> bool {
    let laser = now.laser;
    let p = laser.robot_from_laser.inverse_transform(position);
    let distance = hypot(p.x, p.y);
    if distance - params.radius >= laser.range_max {
        return false;
    }
    let gap = laser.bearing(1) - laser.bearing(0);
    let beam = ((atan2(p.y, p.x) - laser.bearing(0)) / gap).round();
    if beam < 0.0 || beam >= now.ranges.len() as f64 {
        return false;
    }
    let range = f64::from(now.ranges[beam as usize]);
    range >= distance - params.radius - params.jump
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::OccupancyGrid;

    use super::*;

    #[test]
    fn who_is_seen_is_rather_the_person_who_is_known_to_be_there_than_one_who_may_be() {
        let grid = OccupancyGrid::new(10, 10, 1.0, Pose2::default(), vec![0; 100]).unwrap();
        let params = TrackerParams::default();
        let mut tracker = Tracker::new(Arc::new(StaticMap::new(grid)), params, OdometryNoise::default());
        // The first has not been seen for 1.5 s, half a metre from the second.
        let (hidden, known) = (Point2::new(5.0, 5.5), Point2::new(5.0, 5.0));
        let (mut first, mut second) =
            (Track::new(1, hidden, 0.05, 0.0, &params), Track::new(2, known, 0.05, 0.0, &params));
        for _ in 0..15 {
            first.predict(0.1, &params);
            second.predict(0.1, &params);
            second.update(known, 0.03, 1.5, &params);
        }
        tracker.tracks = vec![first, second];
        let seen =
            Detection { position: Point2::new(5.0, 5.1), kind: Kind::Trunk, sigma: 0.03, roundness: 0.0 };
        let distance = |at: usize| tracker.tracks[at].estimate().distance(seen.position, seen.sigma);
        assert!(distance(0) < distance(1) && distance(1) < params.gate, "{} {}", distance(0), distance(1));
        assert_eq!(tracker.follow(&[seen], 1.6), []);
        assert_eq!([tracker.tracks[0].seen, tracker.tracks[1].seen], [0.0, 1.6]);
    }
}
