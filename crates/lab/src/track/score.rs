//! How well the people who are tracked agree with those who are annotated.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::{atan2, hypot};
use curionav_planning::sensor::LaserModel;
use curionav_tracking_people::{matches, ospa};
use serde::Serialize;

use super::follow::{Course, Scanned};
use crate::robot_log::annotations::{Annotated, Frame};

/// An annotated person is found if the tracker has a person so near, metres.
const FOUND_M: f64 = 0.5;
/// The cut of OSPA, metres: the greatest distance that counts, and what one too many or too few costs.
const OSPA_CUT_M: f64 = 1.0;
/// A person seen at most so long ago counts as tracked, seconds. Annotators mark the people that the scan shows, and
/// the tracker remembers those who are hidden.
const SEEN_S: f64 = 0.25;

/// Figures over all annotated scans.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Score {
    annotated_scans: usize,
    /// Lines of the table that are of no scan of the log.
    of_no_scan: usize,
    /// Annotated people within view and range of the laser.
    annotated: usize,
    /// Annotated people who are left out, because they are out of view or range.
    out_of_view: usize,
    /// Annotated people with a tracked person at most half a metre off.
    found: usize,
    /// Tracked people within view and range who are none of those.
    false_positives: usize,
    /// `found` of `annotated`.
    recall: Option<f64>,
    /// `found` of all who are tracked within view and range.
    precision: Option<f64>,
    /// Harmonic mean of recall and precision.
    f1: Option<f64>,
    /// Mean over the annotated scans of OSPA of order 1 with a cut of 1 m, metres.
    ospa_m: f64,
    /// Mean distance of those who are found from where they are tracked, metres.
    off_m: Option<f64>,
}

/// What became of an annotated or a tracked person in one scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Found,
    Missed,
    FalsePositive,
}

/// A person of an annotated scan, for the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Judged {
    pub(super) outcome: Outcome,
    /// Map frame.
    pub(super) place: Point2,
}

/// The score of one log, as it is summed up.
#[derive(Default)]
pub(super) struct Judgement {
    pub(super) judged: Vec<Judged>,
    annotated_scans: usize,
    of_no_scan: usize,
    out_of_view: usize,
    annotated: usize,
    found: usize,
    false_positives: usize,
    ospa_sum: f64,
    off_sum: f64,
}

impl Judgement {
    /// Compares each annotated scan with the people that the tracker followed at it.
    pub(super) fn of(course: &Course, annotated: &Annotated, frame: Frame) -> Self {
        let mut judgement = Self { of_no_scan: annotated.of_no_scan, ..Self::default() };
        for (scan, places) in &annotated.scans {
            judgement.take(&course.scans[*scan], places, frame);
        }
        judgement
    }

    fn take(&mut self, scanned: &Scanned, places: &[Point2], frame: Frame) {
        let mut truth = Vec::new();
        for place in places {
            let place = frame.in_robot(*place, scanned.pose, &scanned.laser);
            // A robot that does not know its place tracks no person; on the map its view cannot be told.
            if scanned.pose.is_none() || is_in_view(place, &scanned.laser) {
                truth.push(place);
            }
        }
        let fresh = scanned.people.iter().filter(|person| person.age <= SEEN_S);
        let tracks: Vec<Point2> = fresh.map(|person| person.position).collect();
        let pairs = matches(&truth, &tracks, FOUND_M);
        // One beyond the view may be the one who is annotated within.
        let mut counted = Vec::new();
        for (track, place) in tracks.iter().enumerate() {
            if pairs.iter().any(|pair| pair.track == track) || is_in_view(*place, &scanned.laser) {
                counted.push(track);
            }
        }
        let seen: Vec<Point2> = counted.iter().map(|track| tracks[*track]).collect();
        self.annotated_scans += 1;
        self.out_of_view += places.len() - truth.len();
        self.annotated += truth.len();
        self.found += pairs.len();
        self.false_positives += seen.len() - pairs.len();
        self.ospa_sum += ospa(&truth, &seen, OSPA_CUT_M);
        self.off_sum += pairs.iter().map(|pair| pair.metres).sum::<f64>();
        for (nth, place) in truth.iter().enumerate() {
            let is_found = pairs.iter().any(|pair| pair.truth == nth);
            self.note(scanned, if is_found { Outcome::Found } else { Outcome::Missed }, *place);
        }
        for track in counted {
            if pairs.iter().all(|pair| pair.track != track) {
                self.note(scanned, Outcome::FalsePositive, tracks[track]);
            }
        }
    }

    fn note(&mut self, scanned: &Scanned, outcome: Outcome, place: Point2) {
        self.judged.extend(scanned.on_map(place).map(|place| Judged { outcome, place }));
    }

    pub(super) fn score(&self) -> Score {
        let recall = share(self.found, self.annotated);
        let precision = share(self.found, self.found + self.false_positives);
        Score {
            annotated_scans: self.annotated_scans,
            of_no_scan: self.of_no_scan,
            annotated: self.annotated,
            out_of_view: self.out_of_view,
            found: self.found,
            false_positives: self.false_positives,
            recall,
            precision,
            f1: share(2 * self.found, self.annotated + self.found + self.false_positives),
            ospa_m: self.ospa_sum / self.annotated_scans.max(1) as f64,
            off_m: (self.found > 0).then(|| self.off_sum / self.found as f64),
        }
    }
}

impl Score {
    /// A line each.
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = vec![
            format!(
                "against {} annotated people in {} scans: {} found within {FOUND_M} m, {} false positives",
                self.annotated, self.annotated_scans, self.found, self.false_positives
            ),
            format!(
                "recall {}, precision {}, F1 {}, OSPA {:.2} m; those who are found are {} m off on average",
                number(self.recall),
                number(self.precision),
                number(self.f1),
                self.ospa_m,
                number(self.off_m)
            ),
        ];
        if self.out_of_view > 0 {
            lines.push(format!("  {} annotated people out of view or range are left out", self.out_of_view));
        }
        if self.of_no_scan > 0 {
            lines.push(format!("  {} annotations are of the time of no scan", self.of_no_scan));
        }
        lines
    }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

/// Whether a place in the robot's frame is within the laser's view and range.
fn is_in_view(place: Point2, laser: &LaserModel) -> bool {
    let p = laser.robot_from_laser.inverse_transform(place);
    let is_within = laser.sees_all_around() || atan2(p.y, p.x).abs() <= 0.5 * laser.fov;
    is_within && hypot(p.x, p.y) <= laser.range_max
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use curionav_planning::geometry::Pose2;
    use curionav_tracking_people::Person;
    use nalgebra::Matrix2;

    use super::*;

    fn person(x: f64, y: f64, age: f64) -> Person {
        Person {
            id: 1,
            position: Point2::new(x, y),
            velocity: Point2::default(),
            position_covariance: Matrix2::identity(),
            velocity_covariance: Matrix2::identity(),
            age,
            probability: 1.0,
        }
    }

    /// A robot at (10, 0) that looks along y; its laser looks a quarter of a turn to its right, 5 m far.
    fn scanned(people: Vec<Person>) -> Scanned {
        let turn = std::f64::consts::FRAC_PI_2;
        let laser = LaserModel { robot_from_laser: Pose2::new(0.0, 0.0, -turn), ..LaserModel::default() };
        Scanned { stamp: 0.0, laser, pose: Some(Pose2::new(10.0, 0.0, turn)), people }
    }

    fn judged(scans: Vec<Scanned>, places: &[&[Point2]], frame: Frame) -> Judgement {
        let scans = Course { scans, wall_s: 1.0 };
        let annotated: BTreeMap<usize, Vec<Point2>> =
            places.iter().map(|places| places.to_vec()).enumerate().collect();
        Judgement::of(&scans, &Annotated { scans: annotated, of_no_scan: 0 }, frame)
    }

    #[test]
    fn figures_are_those_that_are_counted_by_hand() {
        // In the robot's frame, whose laser sees what has a negative y. The first is found 0.3 m off, the second is
        // missed, the third is no person, the fourth is out of range, the fifth was last seen a second ago.
        let people = vec![person(1.0, -2.0, 0.0), person(3.0, -1.0, 0.1), person(0.0, -6.0, 0.0)];
        let first = scanned(people.into_iter().chain([person(-1.0, -1.0, 1.0)]).collect());
        let places = [Point2::new(1.3, -2.0), Point2::new(-1.0, -1.0), Point2::new(0.0, 2.0)];
        let score = judged(vec![first, scanned(vec![])], &[&places, &[]], Frame::Robot).score();
        assert_eq!((score.annotated_scans, score.annotated, score.out_of_view), (2, 2, 1));
        assert_eq!((score.found, score.false_positives), (1, 1));
        assert_eq!((score.recall, score.precision, score.f1), (Some(0.5), Some(0.5), Some(0.5)));
        // (0.3 + 1) / 2 in the first scan, and 0 in the second, which has no people.
        assert!((score.ospa_m - 0.325).abs() < 1e-6, "{score:?}");
        assert!((score.off_m.unwrap() - 0.3).abs() < 1e-9, "{score:?}");
    }

    #[test]
    fn a_place_is_the_same_in_every_frame() {
        // 2 m ahead of the laser: to the right of the robot, which is along x on the map.
        let frames = [
            (Frame::Laser, Point2::new(2.0, 0.0)),
            (Frame::Robot, Point2::new(0.0, -2.0)),
            (Frame::Map, Point2::new(12.0, 0.0)),
        ];
        for (frame, place) in frames {
            let judgement = judged(vec![scanned(vec![person(0.0, -2.0, 0.0)])], &[&[place]], frame);
            assert!(judgement.score().off_m.unwrap() < 1e-9, "{frame:?}");
            let [one] = judgement.judged[..] else { panic!("{frame:?}: {:?}", judgement.judged) };
            assert_eq!(one.outcome, Outcome::Found);
            assert!(one.place.distance(Point2::new(12.0, 0.0)) < 1e-9, "{frame:?}: {one:?}");
        }
    }

    #[test]
    fn a_robot_that_does_not_know_its_place_misses_all() {
        let lost = Scanned { pose: None, ..scanned(vec![]) };
        let score = judged(vec![lost], &[&[Point2::new(300.0, 5.0)]], Frame::Map).score();
        assert_eq!((score.annotated, score.recall, score.precision), (1, Some(0.0), None));
        assert_eq!(score.ospa_m, 1.0);
    }
}
