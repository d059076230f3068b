//! Ways out for a robot that does not get away from where it is, as navigation stacks have in a recovery.
//!
//! A generator that chooses by itself can stand before a person who waits for it, because nothing that it tries is free
//! or costs less than to stand. After some time in one place, ways out are offered instead of what the generator
//! offers.

use crate::candidates::CandidateSet;
use crate::collision::CollisionChecker;
use crate::generation::candidates::{SOMEWHERE, Search, find_candidates_by, go_on};
use crate::generation::commanded::drive;
use crate::generation::params::Besides;
use crate::generation::pose_tree::PoseTree;
use crate::generation::{GenerationInput, Pace};
use crate::geometry::{Twist, wrap_angle};
use crate::motion::RobotModel;
use crate::states::States;

/// How far a robot backs that finds no other way out, metres: as far as it may, or less.
const BACKING: [f64; 3] = [0.3, 0.2, 0.1];
/// A way out that ends turned by as much leads to another direction, radians.
const TURNED: f64 = 0.75;
/// When less of backing is left it is looked for another way out, metres: the robot still rolls in the next cycle.
const DONE: f64 = 0.05;
/// A robot that is faster than this backwards is backing, m/s: nothing else leads backwards, and odometry errs by less.
const ROLLS: f64 = 0.02;

/// The shortest way and straight ways in all directions, with turns on the spot and slow ones, those that end nearest
/// to the goal first; none of them stands if there is another. If the robot insists and nothing gets anywhere, it is
/// the beginning of the way out between people who stand alone. Where none of these leads anywhere, the robot backs, at
/// no more than `v_reverse` m/s, until something else does. `None` while the robot's time in its place is not over, and
/// where nothing is free.
pub(super) fn ways_out(input: &GenerationInput<'_>, v_reverse: f64, pace: &Pace<'_>) -> Option<CandidateSet> {
    let recovery = &input.params.generation.recovery;
    if recovery.patience <= 0.0 {
        return None;
    }
    let is_backing = v_reverse > 0.0 && input.scene.belief.twist.v < -ROLLS;
    if input.scene.in_place < recovery.patience && !is_backing {
        return None;
    }
    let checker = input.checker();
    let backing = (v_reverse > 0.0).then_some(Backing { input, checker: &checker, v_reverse });
    if let Some(rest) = backing.as_ref().filter(|_| is_backing).and_then(Backing::rest) {
        return Some(rest);
    }
    // A way out that has been begun is gone, or the robot would turn to and fro between two.
    if let Some(rest) = recovery.insist.then(|| go_on(input, &checker)).flatten() {
        return Some(rest);
    }
    let mut params = input.params.clone();
    let horizon = params.dt * params.steps as f64;
    params.min_speed = SOMEWHERE / horizon;
    params.generation.candidates.besides = Besides { previous: false, arcs: false, ..Besides::default() };
    let here = input.scene.belief.pose.position();
    let way = input.geodesic.descend_for(here, 0.2, input.robot.v_max * horizon);
    let search = Search { tree: &PoseTree::default(), way: &way, insists: recovery.insist };
    let found = find_candidates_by(&GenerationInput { params: &params, ..*input }, search, &checker, pace);
    if let Some(backing) = backing
        && !backing.has_another(&found)
        && let Some(back) = backing.by(&BACKING)
    {
        return Some(back);
    }
    Some(found).filter(|found| !found.is_empty())
}

/// Driving straight back.
struct Backing<'a> {
    input: &'a GenerationInput<'a>,
    checker: &'a CollisionChecker<'a>,
    /// Greatest speed, m/s, more than 0.
    v_reverse: f64,
}

impl Backing<'_> {
    /// Whether any of the other ways is free and turns the robot, or gets somewhere nearer to the goal: the way
    /// on into a dead end would undo what it has backed.
    fn has_another(&self, ways: &CandidateSet) -> bool {
        let here = self.input.scene.belief.pose;
        let to_go = self.input.geodesic.at(here.position());
        let trajectories = self.checker.over(ways.steps(), ways.dt(), f64::INFINITY);
        (0..ways.len()).any(|i| {
            let end = ways.end(i);
            let gets_on = end.position().distance(here.position()) >= SOMEWHERE
                && self.input.geodesic.at(end.position()) < to_go;
            let turns = wrap_angle(end.heading - here.heading).abs() >= TURNED;
            (gets_on || turns)
                && trajectories.first_collision(ways.all_states().poses(ways.range(i))).is_none()
        })
    }

    /// What is left of backing that has been begun, if it was decided last.
    fn rest(&self) -> Option<CandidateSet> {
        let previous = self.input.previous?;
        let goes_forwards = previous.windows(2).any(|pair| pair[0].relative(pair[1]).x > 1e-6);
        let left = -self.input.scene.belief.pose.relative(*previous.last()?).x;
        if goes_forwards || left <= DONE { None } else { self.by(&[left]) }
    }

    /// Straight back by so many metres each, and a stop. Those that are not free are left out; `None` if none is free.
    fn by(&self, metres: &[f64]) -> Option<CandidateSet> {
        let params = self.input.params;
        let robot = &RobotModel { v_reverse: self.v_reverse, ..self.input.robot.clone() };
        let input = &GenerationInput { robot, ..*self.input };
        let start = input.scene.belief.pose;
        let mut free = States::default();
        let mut count = 0;
        for metres in metres {
            let mut states = States::default();
            drive(input, &mut states, |_, pose, _| {
                let left = (metres + start.relative(pose).x).max(0.0);
                let v =
                    (2.0 * robot.a_max * left).sqrt() - 0.5 * robot.a_max * params.generation.rollout.substep;
                Twist { v: 0.0 - v.max(0.0), omega: 0.0 }
            });
            if self.checker.first_collision(&states, params.dt).is_none() {
                free.append(states);
                count += 1;
            }
        }
        // From a finite pose all states are finite; anything else offers nothing.
        let set = CandidateSet::new(params.steps, params.dt, (0..count).collect(), free).ok()?;
        Some(set).filter(|set| !set.is_empty())
    }
}
