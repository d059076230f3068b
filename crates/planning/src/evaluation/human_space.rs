//! Human space after the paper's reference 6, inferred: the room around people who walk, and around groups.

use crate::candidates::CandidateSet;
use crate::convex_hull::{convex_hull, distance_squared};
use crate::crowd_cluster::{GroupParams, GroupShape, crowd_clusters};
use crate::evaluation::enclosing_circle::smallest_enclosing_circle;
use crate::evaluation::{Costs, Evaluator, each};
use crate::geometry::Point2;
use crate::numerics::{exp, hypot};
use crate::scene::{People, Scene};
use crate::sight::{Sight, View};

crate::parameters! {
    /// Parameters of the terms `human-space` and `doppler`.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct HumanSpaceParams {
        /// Standard deviation of the room around a person who stands, metres.
        pub personal: f64 [0.01, 10.0, "m", "Hall's public space begins nearer"] = 0.55,
        /// How much farther it reaches ahead of one who walks, per speed, s/m.
        pub ahead: f64 [0.0, 100.0, "s/m", "farther ahead is beyond the horizon"] = 11.0 / 6.0,
        /// How far ahead of its middle the room of a group lies, seconds of its way.
        pub shift: f64 [0.0, 10.0, "s", "farther ahead is beyond the horizon"] = 0.5,
        /// Distance beyond a group's circle at which its room has fallen to one half, along its way, metres.
        pub group_along: f64 [0.01, 10.0, "m", "Hall's public space begins nearer"] = 0.55,
        /// The same across its way, metres.
        pub group_across: f64 [0.01, 10.0, "m", "Hall's public space begins nearer"] = 0.40,
        /// Speed of the waves of the Doppler effect, m/s. Speeds of robot and people count up to 2 m/s.
        pub wave_speed: f64 [2.5, 1000.0, "m/s", "slower waves are overtaken, and in faster ones no motion shows"] = 5.0,
        /// Distance in which the effect falls to a third, metres.
        pub wave_reach: f64 [0.01, 100.0, "m", "farther away people do not matter"] = 2.1,
    }
}

/// Term `human-space`: the greatest of all rooms at each state, summed over the states, without unit. If walls hide
/// people, the room of a group counts where any of it is in view.
///
/// With [`GroupShape::Hull`] each person of a group has a room as if alone, and the group has one around the convex
/// hull of where they are expected, as wide as that of one who stands. So a group takes nowhere less
/// room than one of it.
#[derive(Debug, Clone)]
pub struct HumanSpaceEvaluator {
    /// How large the rooms are.
    pub params: HumanSpaceParams,
    /// Who belongs together.
    pub groups: GroupParams,
    /// What hides people; nothing does if there is none.
    pub sight: Option<Sight>,
}

/// The room of a person or a group.
#[derive(Debug, Clone)]
enum Room {
    Oval(Oval),
    Hull(HullRoom),
}

impl Room {
    /// How many standard deviations `p` is away from it at state `step` of a candidate, after `t` seconds, squared.
    fn away(&self, p: Point2, step: usize, t: f64) -> f64 {
        match self {
            Self::Oval(oval) => oval.away(p, t),
            Self::Hull(room) => distance_squared(&room.hulls[step], p) / (room.sigma * room.sigma),
        }
    }
}

/// A Gaussian of height one around the convex hull of people.
#[derive(Debug, Clone)]
struct HullRoom {
    /// Of the people as they are expected at each state.
    hulls: Vec<Vec<Point2>>,
    /// Standard deviation, metres.
    sigma: f64,
}

impl HullRoom {
    fn new(people: &People, members: &[usize], sigma: f64, candidates: &CandidateSet) -> Self {
        let hull = |step: usize| {
            let t = (step + 1) as f64 * candidates.dt();
            let expected: Vec<Point2> = members.iter().map(|&i| people.position_after(i, t)).collect();
            convex_hull(&expected)
        };
        Self { hulls: (0..candidates.steps()).map(hull).collect(), sigma }
    }
}

/// Rooms, and the people of each as indices.
struct Rooms {
    rooms: Vec<Room>,
    members: Vec<Vec<usize>>,
}

impl Rooms {
    /// One of each group.
    fn of_circles(people: &People, groups: Vec<Vec<usize>>, params: &HumanSpaceParams) -> Self {
        let room = |members: &Vec<usize>| match members[..] {
            [person] => Room::Oval(Oval::of_person(people, person, params)),
            _ => Room::Oval(Oval::of_group(people, members, params)),
        };
        Self { rooms: groups.iter().map(room).collect(), members: groups }
    }

    /// One of each person, and one of each group of several.
    fn of_hulls(
        people: &People,
        groups: Vec<Vec<usize>>,
        params: &HumanSpaceParams,
        candidates: &CandidateSet,
    ) -> Self {
        let mut rooms = Vec::with_capacity(people.len() + groups.len());
        let mut members = Vec::with_capacity(people.len() + groups.len());
        for person in 0..people.len() {
            rooms.push(Room::Oval(Oval::of_person(people, person, params)));
            members.push(vec![person]);
        }
        for group in groups {
            if group.len() > 1 {
                rooms.push(Room::Hull(HullRoom::new(people, &group, params.personal, candidates)));
                members.push(group);
            }
        }
        Self { rooms, members }
    }
}

/// A Gaussian of height one in the frame of motion.
#[derive(Debug, Clone, Copy)]
struct Oval {
    centre: Point2,
    velocity: (f64, f64),
    /// Unit vector along the way; any where there is none.
    along: (f64, f64),
    /// Standard deviations ahead, behind and to the sides, metres.
    sigmas: [f64; 3],
    /// The room is one within this distance of its centre, metres.
    core: f64,
}

impl Oval {
    fn of_person(people: &People, i: usize, params: &HumanSpaceParams) -> Self {
        let vx = people.vx[i];
        let vy = people.vy[i];
        let ahead = params.personal * (1.0 + params.ahead * people.speed(i));
        let sigmas = [ahead, params.personal, params.personal];
        Self { centre: people.position(i), velocity: (vx, vy), along: direction(vx, vy), sigmas, core: 0.0 }
    }

    /// The room of those who belong together, who are at least two.
    fn of_group(people: &People, members: &[usize], params: &HumanSpaceParams) -> Self {
        let points: Vec<Point2> = members.iter().map(|&i| people.position(i)).collect();
        let core = smallest_enclosing_circle(&points).map_or(0.0, |circle| circle.radius);
        let mean =
            |of: &dyn Fn(usize) -> f64| members.iter().map(|&i| of(i)).sum::<f64>() / members.len() as f64;
        let vx = mean(&|i| people.vx[i]);
        let vy = mean(&|i| people.vy[i]);
        let centre = Point2::new(
            mean(&|i| people.x[i]) + params.shift * vx,
            mean(&|i| people.y[i]) + params.shift * vy,
        );
        // Half at `core + group`.
        let sigma = |beyond: f64| (core + beyond) / (2.0 * std::f64::consts::LN_2).sqrt();
        let along = sigma(params.group_along);
        let across = sigma(params.group_across);
        Self { centre, velocity: (vx, vy), along: direction(vx, vy), sigmas: [along, along, across], core }
    }

    /// How many standard deviations `p` is away from it after `t` seconds, squared; 0 within its core.
    fn away(&self, p: Point2, t: f64) -> f64 {
        let dx = p.x - self.centre.x - t * self.velocity.0;
        let dy = p.y - self.centre.y - t * self.velocity.1;
        if dx * dx + dy * dy < self.core * self.core {
            return 0.0;
        }
        let (c, s) = self.along;
        let ahead = c * dx + s * dy;
        let aside = c * dy - s * dx;
        let [front, rear, side] = self.sigmas;
        let a = ahead / if ahead >= 0.0 { front } else { rear };
        let b = aside / side;
        a * a + b * b
    }
}

/// Unit vector along a velocity; the first axis for one who stands.
fn direction(vx: f64, vy: f64) -> (f64, f64) {
    let speed = hypot(vx, vy);
    if speed > 0.0 { (vx / speed, vy / speed) } else { (1.0, 0.0) }
}

impl Evaluator for HumanSpaceEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let people = &scene.people;
        let params = &self.params;
        let sight = self.sight.as_ref();
        let groups = crowd_clusters(people, &self.groups, sight);
        let Rooms { rooms, members } = match self.groups.shape {
            GroupShape::Circle => Rooms::of_circles(people, groups, params),
            GroupShape::Hull => Rooms::of_hulls(people, groups, params, candidates),
        };
        let states = candidates.all_states();
        let dt = candidates.dt();
        let mut view = sight.map(|sight| View::new(sight, scene, &members, candidates.steps(), dt));
        each(candidates, should_stop, |i| {
            let mut sum = 0.0;
            for (k, state) in candidates.range(i).enumerate() {
                let p = states.position(state);
                let t = (k + 1) as f64 * dt;
                let mut view = view.as_mut().map(|view| (view.place_of(candidates, i, k), view));
                // The greatest room is the nearest one.
                let away = nearest(&rooms, p, (k, t), |group| {
                    view.as_mut().is_none_or(|(place, view)| view.shows(*place, group))
                });
                sum += exp(-0.5 * away);
            }
            sum
        })
    }
}

/// How far away the nearest room in view is, as [`Room::away`] has it; infinite without one.
fn nearest(
    rooms: &[Room],
    p: Point2,
    (step, t): (usize, f64),
    mut is_in_view: impl FnMut(usize) -> bool,
) -> f64 {
    let mut nearest = f64::INFINITY;
    for (number, room) in rooms.iter().enumerate() {
        let away = room.away(p, step, t);
        if away < nearest && is_in_view(number) {
            nearest = away;
        }
    }
    nearest
}

/// Term `doppler`: how robot and people come towards each other, as waves from one would sound to the other:
/// `(c + v_r) / (c - v_h) exp(-d / reach)` summed over people and states, without unit.
#[derive(Debug, Clone)]
pub struct DopplerEvaluator {
    /// Its waves.
    pub params: HumanSpaceParams,
    /// What hides people; nothing does if there is none.
    pub sight: Option<Sight>,
}

/// Speeds count up to this one, m/s.
const SPEED_MOST: f64 = 2.0;

impl Evaluator for DopplerEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let people = &scene.people;
        let states = candidates.all_states();
        let HumanSpaceParams { wave_speed, wave_reach, .. } = self.params;
        let mut view = View::of_each(self.sight.as_ref(), scene, candidates);
        each(candidates, should_stop, |i| {
            let mut sum = 0.0;
            for (k, state) in candidates.range(i).enumerate() {
                let pose = states.pose(state);
                let t = (k + 1) as f64 * candidates.dt();
                let (s, c) = crate::numerics::sin_cos(pose.heading);
                let vx = states.v[state] * c;
                let vy = states.v[state] * s;
                let place = view.as_mut().map_or(0, |view| view.place_of(candidates, i, k));
                for j in 0..people.len() {
                    if view.as_mut().is_some_and(|view| !view.shows(place, j)) {
                        continue;
                    }
                    let person = people.position_after(j, t);
                    let dx = pose.x - person.x;
                    let dy = pose.y - person.y;
                    let (nx, ny) = direction(dx, dy);
                    let towards = |speed: f64| speed.clamp(-SPEED_MOST, SPEED_MOST);
                    let of_robot = towards(-(vx * nx + vy * ny));
                    let of_person = towards(people.vx[j] * nx + people.vy[j] * ny);
                    let factor = (wave_speed + of_robot) / (wave_speed - of_person);
                    sum += factor * exp(-hypot(dx, dy) / wave_reach);
                }
            }
            sum
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose2, Twist};
    use crate::scene::Belief;
    use crate::states::States;

    fn scene(people: People) -> Scene {
        let covariance = nalgebra::Matrix3::zeros();
        let belief = Belief { pose: Pose2::default(), covariance, twist: Twist::default() };
        Scene::new(belief, people)
    }

    /// A robot that stands at (x, y), or goes on along x with 0.8 m/s.
    fn way(x: f64, y: f64, goes: bool) -> CandidateSet {
        let mut states = States::default();
        let v = if goes { 0.8 } else { 0.0 };
        for k in 1..=5 {
            states.push(Pose2::new(x + v * 0.3 * f64::from(k), y, 0.0), Twist { v, omega: 0.0 });
        }
        CandidateSet::new(5, 0.3, vec![0], states).unwrap()
    }

    fn human_space(of: &[[f64; 4]], candidates: &CandidateSet) -> f64 {
        let term = HumanSpaceEvaluator {
            params: HumanSpaceParams::default(),
            groups: GroupParams::default(),
            sight: None,
        };
        term.evaluate(&scene(People::walking(0.25, of)), candidates, &|| false).unwrap()[0]
    }

    fn doppler(of: &[[f64; 4]], candidates: &CandidateSet) -> f64 {
        let term = DopplerEvaluator { params: HumanSpaceParams::default(), sight: None };
        term.evaluate(&scene(People::walking(0.25, of)), candidates, &|| false).unwrap()[0]
    }

    #[test]
    fn one_who_approaches_costs_more_than_one_who_stands_and_one_who_goes_away_least() {
        let at = |vx: f64| [[3.0, 0.3, vx, 0.0]];
        let robot = way(0.0, 0.0, false);
        for cost in [human_space, doppler] {
            let [comes, stands, goes] = [-0.8, 0.0, 0.8].map(|vx| cost(&at(vx), &robot));
            assert!(comes > stands && stands > goes, "{comes}, {stands}, {goes}");
        }
        // The effect itself, at equal distances: the robot that goes towards a person costs more.
        let towards = doppler(&[[3.0, 0.0, 0.0, 0.0]], &way(0.0, 0.0, true));
        let away = doppler(&[[-1.8, 0.0, 0.0, 0.0]], &way(0.0, 0.0, true));
        assert!(towards > away, "{towards}, {away}");
    }

    #[test]
    fn around_one_who_stands_all_sides_are_alike() {
        let stands = [[5.0, 5.0, 0.0, 0.0]];
        let around = [(6.0, 5.0), (4.0, 5.0), (5.0, 6.0), (5.0, 4.0)];
        for (x, y) in around {
            let robot = way(x, y, false);
            assert!((human_space(&stands, &robot) - 5.0 * exp(-0.5 / 0.3025)).abs() < 1e-12);
            let expected = 5.0 * exp(-1.0 / 2.1);
            assert!((doppler(&stands, &robot) - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn the_room_ahead_of_one_who_walks_is_longer_than_behind() {
        // Judged one step of 0.3 s from now, 1 m ahead and 1 m behind.
        let walks = [[5.0, 5.0, 0.6, 0.0]];
        let at = |x: f64| {
            let mut states = States::default();
            states.push(Pose2::new(x + 0.18, 5.0, 0.0), Twist::default());
            human_space(&walks, &CandidateSet::new(1, 0.3, vec![0], states).unwrap())
        };
        assert!(at(6.0) > 2.0 * at(4.0), "{} and {}", at(6.0), at(4.0));
    }

    #[test]
    fn a_group_of_ten_takes_more_room_than_one_of_them() {
        let ten: Vec<[f64; 4]> =
            (0..10).map(|k| [5.0 + f64::from(k % 5), 5.0 + f64::from(k / 5), 0.0, 0.0]).collect();
        for (x, y) in [(4.0, 5.0), (7.0, 3.8), (7.0, 5.5)] {
            let robot = way(x, y, false);
            let group = human_space(&ten, &robot);
            assert!(ten.iter().all(|one| human_space(&[*one], &robot) < group), "at ({x}, {y})");
            assert!(doppler(&ten, &robot) > doppler(&ten[..1], &robot));
        }
        // One inside, and one half at the stated distance from the circle.
        assert_eq!(human_space(&ten, &way(7.0, 5.5, false)), 5.0);
        let radius = hypot(2.0, 0.5);
        let half = human_space(&ten, &way(7.0 + radius + 0.55, 5.5, false));
        assert!((half - 2.5).abs() < 1e-9, "{half}");
    }
}
