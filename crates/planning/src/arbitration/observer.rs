//! From beliefs and people to the scene of a cycle (Alg. 2, lines 3 to 7).

use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::profile::{Patience, Profile};
use crate::scene::{Belief, People, Scene};

/// What the arbiter remembers between cycles to form scenes: the two hystereses, where the robot has stayed, and how it
/// comes nearer to its goal. A new observer, as after a restart, is certain, knows no people, and has just come to where
/// it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observer {
    /// Whether the last scene was uncertain.
    pub uncertain: bool,
    /// Ids of the people of the last scene, ascending.
    pub members: Vec<u32>,
    /// The place that the robot has not left.
    pub place: Option<Place>,
    /// Where something stands that only the driver sees, and since when the driver has not braked for it.
    pub unseen: Option<Place>,
    /// How the robot comes nearer to its goal; nothing for a planner that never loses patience.
    pub progress: Option<Progress>,
}

/// Somewhere that the robot came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Map frame.
    pub position: Point2,
    /// When it came there, seconds of the robot's clock.
    pub since: f64,
}

/// How a robot comes nearer to its goal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The least distance to go so far, metres.
    pub nearest: f64,
    /// Seconds by which it lags behind the pace of [`Patience`].
    pub lag: f64,
    /// When it was observed last, seconds of the robot's clock.
    pub stamp: f64,
    /// Since when it is impatient.
    pub impatient_since: Option<f64>,
}

impl Progress {
    /// What follows from it at `stamp` with `to_go` metres left, after `in_place` seconds in one place.
    fn next(&self, patience: &Patience, robot: &RobotModel, stamp: f64, to_go: f64, in_place: f64) -> Self {
        // Stamps are sums of steps: a rounding error must not add a cycle.
        let is_over = |seconds: f64, limit: f64| seconds >= limit - 1e-6;
        let nearest = self.nearest.min(to_go);
        let gained = (self.nearest - to_go).max(0.0);
        let pace = patience.pace.min(0.5 * robot.v_max);
        let lag = (self.lag + (stamp - self.stamp) - gained / pace).max(0.0);
        let is_wanted = match self.impatient_since {
            Some(since) => !is_over(stamp - since, patience.lasts),
            None => is_over(lag, patience.after),
        };
        // What it stood before it became impatient is what made it so.
        let stands = in_place.min(stamp - self.impatient_since.unwrap_or(stamp));
        let is_impatient = is_wanted && !is_over(stands, patience.stands);
        let impatient_since = is_impatient.then(|| self.impatient_since.unwrap_or(stamp));
        // What it lags behind begins anew with its impatience, and again with its end.
        let lag = if is_impatient || self.impatient_since.is_some() { 0.0 } else { lag };
        Self { nearest, lag, stamp, impatient_since }
    }
}

impl Observer {
    /// The scene at `stamp` seconds of the robot's clock, with `to_go` metres left to the goal by the shortest way.
    /// `people` are all that the tracker reports, in any order; the scene holds those inside the Working Zone, by
    /// ascending id.
    pub fn form_scene(
        &mut self,
        profile: &Profile,
        robot: &RobotModel,
        (tick, stamp): (u64, f64),
        belief: Belief,
        to_go: f64,
        people: &People,
    ) -> Scene {
        self.uncertain = self.next_uncertain(profile, belief.uncertainty());
        let here = belief.pose.position();
        let mut people = self.inside(profile, robot, here, people);
        self.unseen = self.unseen.filter(|it| it.since <= stamp && stamp - it.since <= profile.unseen.keep);
        if let Some(it) = self.unseen {
            people.push_standing(People::UNSEEN, it.position);
        }
        self.members.clone_from(&people.id);
        let radius = profile.generation.recovery.radius;
        let stays = |place: &Place| place.position.distance(here) < radius && place.since <= stamp;
        let place = self.place.filter(stays).unwrap_or(Place { position: here, since: stamp });
        self.place = Some(place);
        let (uncertain, in_place) = (self.uncertain, stamp - place.since);
        self.progress = self.next_progress(profile, robot, stamp, to_go, in_place);
        let impatient = self.progress.is_some_and(|progress| progress.impatient_since.is_some());
        Scene { tick, stamp, belief, people, uncertain, in_place, impatient }
    }

    /// The driver has braked for so many seconds now, at `stamp`, because something is too close to a robot that is at
    /// `pose`. If that is long enough, something stands right ahead which the planner does not know of, or knows elsewhere.
    pub fn observe_braking(
        &mut self,
        profile: &Profile,
        robot: &RobotModel,
        (pose, stamp): (Pose2, f64),
        seconds: f64,
    ) {
        if profile.unseen.after > 0.0 && seconds >= profile.unseen.after {
            let ahead = robot.radius() + People::UNSEEN_RADIUS;
            let position = pose.transform(Point2::new(ahead, 0.0));
            self.unseen = Some(Place { position, since: stamp });
        }
    }

    /// How the robot comes nearer to its goal. It begins anew after a time without cycles, and where there has been no
    /// way.
    fn next_progress(
        &self,
        profile: &Profile,
        robot: &RobotModel,
        stamp: f64,
        to_go: f64,
        in_place: f64,
    ) -> Option<Progress> {
        let patience = &profile.patience;
        if patience.after <= 0.0 {
            return None;
        }
        let is_recent = |last: &Progress| (0.0..=profile.hold.max_age).contains(&(stamp - last.stamp));
        let begun = Progress { nearest: to_go, lag: 0.0, stamp, impatient_since: None };
        let last = self.progress.filter(is_recent).or(to_go.is_finite().then_some(begun))?;
        Some(last.next(patience, robot, stamp, to_go, in_place))
    }

    /// Eq. 5's case with D3's hysteresis: on above Thr', off below a share of it, else as before. A
    /// trace that is not a number counts as uncertain.
    fn next_uncertain(&self, profile: &Profile, uncertainty: f64) -> bool {
        let threshold = profile.uncertainty.threshold;
        let limit = if self.uncertain { threshold * profile.uncertainty.release_ratio } else { threshold };
        let below = if self.uncertain { uncertainty < limit } else { uncertainty <= limit };
        !below
    }

    /// Those within the zone's radius, or a little beyond it if they were inside before; sorted by id, the
    /// first of two with the same id.
    fn inside(&self, profile: &Profile, robot: &RobotModel, centre: Point2, people: &People) -> People {
        let enter = profile.working_zone_radius(robot.v_max);
        let leave = enter + profile.working_zone.hysteresis;
        let mut order: Vec<usize> = (0..people.len())
            .filter(|&i| {
                let limit = if self.members.binary_search(&people.id[i]).is_ok() { leave } else { enter };
                people.position(i).distance(centre) <= limit
            })
            .collect();
        order.sort_by_key(|&i| people.id[i]);
        order.dedup_by_key(|i| people.id[*i]);
        people.pick(order)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::geometry::Twist;

    fn belief(trace: f64) -> Belief {
        Belief {
            pose: Pose2::default(),
            covariance: Matrix3::identity() * (trace / 3.0),
            twist: Twist::default(),
        }
    }

    fn people(at: &[(u32, f64)]) -> People {
        let n = at.len();
        People {
            id: at.iter().map(|p| p.0).collect(),
            x: at.iter().map(|p| p.1).collect(),
            y: vec![0.0; n],
            vx: at.iter().map(|p| f64::from(p.0)).collect(),
            vy: vec![0.0; n],
            radius: 0.3,
            ..People::default()
        }
    }

    fn form(observer: &mut Observer, trace: f64, at: &[(u32, f64)]) -> Scene {
        let (profile, robot) = (Profile::default(), RobotModel::default());
        observer.form_scene(&profile, &robot, (7, 2.1), belief(trace), 9.0, &people(at))
    }

    #[test]
    fn uncertainty_rises_at_the_threshold_and_falls_below_its_release() {
        let mut observer = Observer::default();
        // Thr' = 0.1, release 0.08
        let traces = [0.09, 0.099, 0.101, 0.09, 0.081, 0.079, 0.09, 0.101, f64::NAN];
        let seen: Vec<bool> = traces.iter().map(|&t| form(&mut observer, t, &[]).uncertain).collect();
        assert_eq!(seen, [false, false, true, true, true, false, false, true, true]);
        assert!(form(&mut Observer::default(), f64::NAN, &[]).uncertain);
    }

    #[test]
    fn who_is_inside_stays_until_clearly_outside() {
        let mut observer = Observer::default();
        // radius 9.3 m, hysteresis 0.5 m
        let distances = [9.5, 9.2, 9.5, 9.79, 9.81, 9.5];
        let seen: Vec<usize> =
            distances.iter().map(|&d| form(&mut observer, 0.0, &[(1, d)]).people.len()).collect();
        assert_eq!(seen, [0, 1, 1, 1, 0, 0]);
    }

    #[test]
    fn time_in_a_place_counts_until_the_robot_has_left_it() {
        let (mut observer, profile, robot): (Observer, Profile, RobotModel) = Default::default();
        let mut seconds = |stamp: f64, x: f64| {
            let belief = Belief { pose: Pose2::new(x, 0.0, 0.0), ..belief(0.0) };
            observer.form_scene(&profile, &robot, (7, stamp), belief, 9.0, &people(&[])).in_place
        };
        // The place is where it came to, not where it was last; half a metre away is another one.
        assert_eq!([seconds(2.0, 1.0), seconds(3.0, 1.4), seconds(4.0, 0.6)], [0.0, 1.0, 2.0]);
        assert_eq!([seconds(5.0, 1.6), seconds(6.0, 1.3)], [0.0, 1.0]);
        // The robot's clock has started over.
        assert_eq!([seconds(0.5, 1.3), seconds(1.0, 1.3)], [0.0, 0.5]);
    }

    #[test]
    fn a_robot_that_comes_no_nearer_loses_patience_for_a_while() {
        let (mut observer, mut profile, robot): (Observer, Profile, RobotModel) = Default::default();
        let paper = profile.clone();
        profile.hold.max_age = 2.0;
        profile.patience = Patience { after: 2.0, pace: 0.4, lasts: 1.5, stands: 1.0, ..profile.patience };
        let mut impatient = |profile: &Profile, stamp: f64, x: f64, to_go: f64| {
            let belief = Belief { pose: Pose2::new(x, 0.0, 0.0), ..belief(0.0) };
            observer.form_scene(profile, &robot, (7, stamp), belief, to_go, &people(&[])).impatient
        };
        // Seconds of the clock, where the robot is, metres to go, and whether it is impatient then.
        for (stamp, x, to_go, expected) in [
            (1.0, 0.0, 9.0, false),
            // It lags for 1.5 s. 0.4 m make up for one of them; farther away, and where there is no way, for none.
            (2.5, 1.0, 9.0, false),
            (2.5, 2.0, 8.6, false),
            (3.5, 3.0, 8.8, false),
            (3.9, 4.0, f64::INFINITY, false),
            (4.0, 5.0, 8.6, true),
            // Whatever it gains now, it lasts for 1.5 s. Then it begins anew.
            (5.4, 6.0, 5.0, true),
            (5.5, 7.0, 5.0, false),
            (6.5, 8.0, 5.0, false),
            (7.5, 9.0, 5.0, true),
            // It stands for 1 s, and gives way.
            (8.4, 9.1, 5.0, true),
            (8.5, 9.1, 5.0, false),
            // Where it stands it loses patience as anywhere else, for as long as before.
            (10.4, 9.1, 5.0, false),
            (10.5, 9.1, 5.0, true),
            (11.4, 9.1, 5.0, true),
            (11.5, 9.1, 5.0, false),
            (12.9, 9.1, 5.0, false),
            // Nothing was planned for longer than decisions hold.
            (15.0, 9.1, 5.0, false),
            (16.5, 11.0, 5.0, false),
            (17.0, 12.0, 5.0, true),
            // The robot's clock has started over.
            (0.5, 13.0, 5.0, false),
            (2.5, 14.0, 5.0, true),
        ] {
            assert_eq!(impatient(&profile, stamp, x, to_go), expected, "at {stamp} s");
        }
        assert!(!impatient(&paper, 2.6, 15.0, 5.0), "the paper's planner never is");
    }

    #[test]
    fn what_the_driver_keeps_braking_for_is_in_the_scene_until_it_has_been_passed() {
        let (mut observer, mut profile, robot): (Observer, Profile, RobotModel) = Default::default();
        let pose = Pose2::new(2.0, 1.0, std::f64::consts::FRAC_PI_2);
        observer.observe_braking(&profile, &robot, (pose, 5.0), 100.0);
        assert_eq!(observer.unseen, None, "the paper's planner knows of no such thing");
        profile.unseen.after = 1.0;
        observer.observe_braking(&profile, &robot, (pose, 5.0), 0.9);
        assert_eq!(observer.unseen, None);
        observer.observe_braking(&profile, &robot, (pose, 5.0), 1.0);
        let mut people_at = |stamp: f64| {
            let belief = Belief { pose, ..belief(0.0) };
            observer.form_scene(&profile, &robot, (7, stamp), belief, 9.0, &people(&[(3, 1.0)])).people
        };
        let seen = people_at(5.0);
        assert_eq!(seen.id, [3, People::UNSEEN]);
        // Ahead of the robot, as near as it touches it.
        let ahead = 1.0 + robot.radius() + 0.25;
        assert!((seen.x[1] - 2.0).abs() < 1e-12 && (seen.y[1] - ahead).abs() < 1e-12);
        assert_eq!(people_at(5.0 + profile.unseen.keep).id, [3, People::UNSEEN]);
        assert_eq!(people_at(5.1 + profile.unseen.keep).id, [3]);
        // The robot's clock has started over.
        assert_eq!(people_at(1.0).id, [3]);
        // It has variances, too, where people have them.
        observer.observe_braking(&profile, &robot, (pose, 5.0), 1.0);
        let tracked =
            People { position_variance: vec![0.01], velocity_variance: vec![0.04], ..people(&[(3, 1.0)]) };
        let scene = observer.form_scene(&profile, &robot, (7, 5.0), belief(0.0), 9.0, &tracked);
        assert_eq!((scene.people.variances(0), scene.people.variances(1)), ((0.01, 0.04), (0.0, 0.0)));
        assert_eq!((scene.people.position_variance.len(), scene.people.velocity_variance.len()), (2, 2));
    }

    #[test]
    fn the_order_of_the_tracker_does_not_matter() {
        let a = form(&mut Observer::default(), 0.0, &[(3, 1.0), (1, 2.0), (2, 30.0)]);
        let b = form(&mut Observer::default(), 0.0, &[(2, 30.0), (1, 2.0), (3, 1.0)]);
        assert_eq!(a, b);
        assert_eq!(a.people.id, [1, 3]);
        assert_eq!(a.people.x, [2.0, 1.0]);
        assert_eq!(a.people.vx, [1.0, 3.0]);
        assert_eq!((a.tick, a.stamp), (7, 2.1));
    }
}
