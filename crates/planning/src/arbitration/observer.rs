//! From beliefs and people to the scene of a cycle (Alg. 2, lines 3 to 7).

use crate::geometry::{Point2, Pose2};
use crate::motion::RobotModel;
use crate::profile::{Patience, Profile};
use crate::scene::{Belief, Moment, People, Scene};

/// What the arbiter remembers between cycles to form scenes: the two hystereses, where the robot has stayed, and
/// whether it is impatient. A new observer, as after a restart, is certain, knows no people, is patient, and has just
/// come to where it is.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Observer {
    /// Whether the last scene was uncertain.
    pub uncertain: bool,
    /// Ids of the people of the last scene, ascending.
    pub members: Vec<u32>,
    /// The place that the robot has not left.
    pub place: Option<Place>,
    /// The wider place that it has not left while it was patient; nothing for a planner that never loses patience.
    pub region: Option<Place>,
    /// Since when it is impatient, seconds of the robot's clock.
    pub impatient_since: Option<f64>,
    /// Something that only the driver sees: where it stands, and when the driver last braked for it.
    pub unseen: Option<Place>,
}

/// Somewhere that the robot came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Map frame.
    pub position: Point2,
    /// When it came there, seconds of the robot's clock.
    pub since: f64,
}

impl Place {
    /// The place of a robot that is `here` now. It stays the `last` one until the robot is `radius` metres away from
    /// there; it is a new one as well if the robot's clock has started over.
    fn of(here: Self, last: Option<Self>, radius: f64) -> Self {
        match last {
            Some(last) if last.position.distance(here.position) < radius && last.since <= here.since => last,
            _ => here,
        }
    }
}

impl Observer {
    /// The scene at `stamp` seconds of the robot's clock. `people` are all that the tracker reports, in any order; the
    /// scene holds those inside the Working Zone, by ascending id.
    pub fn form_scene(
        &mut self,
        profile: &Profile,
        robot: &RobotModel,
        moment: Moment,
        belief: Belief,
        people: &People,
    ) -> Scene {
        let Moment { tick, stamp } = moment;
        self.uncertain = self.next_uncertain(profile, belief.uncertainty());
        let here = belief.pose.position();
        let mut people = self.inside(profile, robot, here, people);
        self.unseen = self.unseen.filter(|it| it.since <= stamp && stamp - it.since <= profile.unseen.keep);
        if let Some(it) = self.unseen {
            people.push_standing(People::UNSEEN, it.position);
        }
        self.members.clone_from(&people.id);
        let here = Place { position: here, since: stamp };
        let place = Place::of(here, self.place, profile.generation.recovery.radius);
        self.place = Some(place);
        self.update_patience(&profile.patience, robot, here, place.since);
        let in_place = stamp - place.since;
        let impatient = self.impatient_since.is_some();
        let uncertain = self.uncertain;
        Scene { tick, stamp, uncertain, in_place, impatient, ..Scene::new(belief, people) }
    }

    /// The driver has braked for so many seconds now, at `stamp`, because something is too close to a robot that is at
    /// `pose`. If that is long enough, something stands right ahead that the planner does not know of,
    /// or knows elsewhere.
    pub fn observe_braking(
        &mut self,
        profile: &Profile,
        robot: &RobotModel,
        pose: Pose2,
        stamp: f64,
        seconds: f64,
    ) {
        if profile.unseen.after > 0.0 && seconds >= profile.unseen.after {
            let ahead = robot.radius() + People::UNSEEN_RADIUS;
            let position = pose.transform(Point2::new(ahead, 0.0));
            self.unseen = Some(Place { position, since: stamp });
        }
    }

    /// Makes the robot patient, and its time in this place begin anew. For a robot that was told to stop: it stays
    /// where it is because of that, and not because it finds no way.
    pub fn forget_progress(&mut self) {
        self.place = None;
        self.region = None;
        self.impatient_since = None;
    }

    /// Says whether the robot is impatient from now on. It is `here`, and has been in one place since `in_place_since`.
    ///
    /// It loses patience after [`Patience::after`] seconds in one region, and finds it again [`Patience::lasts`]
    /// seconds later, or when it has stood for [`Patience::stands`] seconds meanwhile.
    fn update_patience(&mut self, patience: &Patience, robot: &RobotModel, here: Place, in_place_since: f64) {
        if patience.after <= 0.0 {
            self.region = None;
            self.impatient_since = None;
            return;
        }
        let now = here.since;
        let region = Place::of(here, self.region, patience.radius.min(0.5 * robot.v_max * patience.after));
        self.region = Some(region);
        let impatient_since = self.impatient_since.filter(|&since| since <= now);
        let goes_on = match impatient_since {
            Some(since) => !has_passed(patience.lasts, since, now),
            None => has_passed(patience.after, region.since, now),
        };
        // Only standing while it is impatient counts: having stood before is why it is.
        let since = impatient_since.unwrap_or(now);
        let is_impatient = goes_on && !has_passed(patience.stands, in_place_since.max(since), now);
        if impatient_since.is_some() && !is_impatient {
            // Its patience begins anew where its impatience ends.
            self.region = Some(here);
        }
        self.impatient_since = is_impatient.then_some(since);
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

/// Whether `seconds` have passed since `since`. Stamps are sums of steps: a rounding error must not add a cycle.
fn has_passed(seconds: f64, since: f64, now: f64) -> bool {
    now - since >= seconds - 1e-6
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
        let profile = Profile::default();
        let robot = RobotModel::default();
        observer.form_scene(&profile, &robot, Moment { tick: 7, stamp: 2.1 }, belief(trace), &people(at))
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
            observer.form_scene(&profile, &robot, Moment { tick: 7, stamp }, belief, &people(&[])).in_place
        };
        // The place is where it came to, not where it was last; half a metre away is another one.
        assert_eq!([seconds(2.0, 1.0), seconds(3.0, 1.4), seconds(4.0, 0.6)], [0.0, 1.0, 2.0]);
        assert_eq!([seconds(5.0, 1.6), seconds(6.0, 1.3)], [0.0, 1.0]);
        // The robot's clock has started over.
        assert_eq!([seconds(0.5, 1.3), seconds(1.0, 1.3)], [0.0, 0.5]);
    }

    #[test]
    fn a_robot_that_does_not_get_away_loses_patience_for_a_while() {
        let (mut observer, mut profile, robot): (Observer, Profile, RobotModel) = Default::default();
        let paper = profile.clone();
        profile.patience = Patience { after: 4.0, radius: 1.5, lasts: 2.5, stands: 1.5, ..profile.patience };
        let mut impatient = |profile: &Profile, stamp: f64, x: f64| {
            let belief = Belief { pose: Pose2::new(x, 0.0, 0.0), ..belief(0.0) };
            observer.form_scene(profile, &robot, Moment { tick: 7, stamp }, belief, &people(&[])).impatient
        };
        // Seconds of the clock, where the robot is, and whether it is impatient then.
        for (stamp, x, expected) in [
            (1.0, 0.0, false),
            // It gets away in time, by 1.5 m.
            (3.0, 1.4, false),
            (4.9, 1.5, false),
            // It does not, and drives to and fro.
            (7.0, 2.9, false),
            (8.8, 0.1, false),
            (8.9, 1.0, true),
            // However far it gets now, it stays impatient for 2.5 s. Then it begins anew.
            (10.0, 4.0, true),
            (11.3, 5.0, true),
            (11.4, 6.0, false),
            (15.3, 7.0, false),
            (15.4, 7.0, true),
            // It stands for 1.5 s, and gives way.
            (16.8, 7.1, true),
            (16.9, 7.1, false),
            // Where it stands it loses patience as anywhere else, for as long as before.
            (20.8, 7.1, false),
            (20.9, 7.1, true),
            (22.3, 7.1, true),
            (22.4, 7.1, false),
            // The robot's clock has started over.
            (0.5, 7.1, false),
            (4.4, 7.1, false),
            (4.5, 7.1, true),
            (0.5, 7.1, false),
        ] {
            assert_eq!(impatient(&profile, stamp, x), expected, "at {stamp} s");
        }
        assert!(!impatient(&paper, 100.0, 7.1), "the paper's planner never is");
    }

    #[test]
    fn a_slow_robot_need_not_get_as_far_away() {
        let mut profile = Profile::default();
        let robot = RobotModel { v_max: 0.4, ..Default::default() };
        profile.patience = Patience { after: 4.0, radius: 1.5, ..profile.patience };
        let is_impatient_after = |metres: f64| {
            let mut observer = Observer::default();
            let mut form = |stamp: f64, x: f64| {
                let belief = Belief { pose: Pose2::new(x, 0.0, 0.0), ..belief(0.0) };
                observer
                    .form_scene(&profile, &robot, Moment { tick: 7, stamp }, belief, &people(&[]))
                    .impatient
            };
            form(0.0, 0.0) || form(4.0, metres)
        };
        assert!(is_impatient_after(0.79) && !is_impatient_after(0.81));
    }

    #[test]
    fn what_the_driver_keeps_braking_for_is_in_the_scene_until_it_has_been_passed() {
        let (mut observer, mut profile, robot): (Observer, Profile, RobotModel) = Default::default();
        let pose = Pose2::new(2.0, 1.0, std::f64::consts::FRAC_PI_2);
        observer.observe_braking(&profile, &robot, pose, 5.0, 100.0);
        assert_eq!(observer.unseen, None, "the paper's planner knows of no such thing");
        profile.unseen.after = 1.0;
        observer.observe_braking(&profile, &robot, pose, 5.0, 0.9);
        assert_eq!(observer.unseen, None);
        observer.observe_braking(&profile, &robot, pose, 5.0, 1.0);
        let mut people_at = |stamp: f64| {
            let belief = Belief { pose, ..belief(0.0) };
            observer
                .form_scene(&profile, &robot, Moment { tick: 7, stamp }, belief, &people(&[(3, 1.0)]))
                .people
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
        observer.observe_braking(&profile, &robot, pose, 5.0, 1.0);
        let tracked =
            People { position_variance: vec![0.01], velocity_variance: vec![0.04], ..people(&[(3, 1.0)]) };
        let scene =
            observer.form_scene(&profile, &robot, Moment { tick: 7, stamp: 5.0 }, belief(0.0), &tracked);
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
