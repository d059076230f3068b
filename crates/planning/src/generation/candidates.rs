//! FindPathCandidates (Alg. 1, line 12): which ways out of the tree are offered, timed and free.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::candidates::CandidateSet;
use crate::collision::{CollisionChecker, TrajectoryChecker};
use crate::generation::branches::{Cell, branches, cell, in_turns, sector};
use crate::generation::params::CandidateParams;
use crate::generation::path::Path;
use crate::generation::pose_tree::PoseTree;
use crate::generation::rollout::{Departure, Drive, RolloutParams, SpeedProfile, rollouts};
use crate::generation::way_past::way_past;
use crate::generation::{GenerationInput, Pace};
use crate::geometry::{Point2, Pose2, Twist, bearing, wrap_angle};
use crate::motion::step;
use crate::numerics::sin_cos;
use crate::scene::Belief;
use crate::states::States;

/// Directions of the straight ways tried when little else is free.
const FAN: u32 = 24;
/// Arcs offered beside the tree's branches, which tend to share their beginnings: an odd number, the
/// middle one straight.
const ARCS: u32 = 13;
/// How much of the way to the goal has to be free of people for a turn towards it to count, metres.
const BEGINNING: f64 = 1.2;
/// Where along the rest of a way its direction is looked at, metres.
const ROUND: f64 = 0.4;
/// Spacing of the lattice on which a robot that has lost patience looks for a way past people, metres.
const PASSING: f64 = 0.06;
/// The same for one that does not get away from where it is.
const LEAVING: f64 = 0.03;
/// A candidate that ends this far away gets somewhere, however slowly, metres.
pub(super) const SOMEWHERE: f64 = 0.3;

/// Rollouts between two looks at the time.
const BATCH: usize = 32;

/// A path to be timed.
struct Proposal {
    path: Path,
    turn_first: bool,
    /// Kept whatever others are better: the way to the goal and what was decided before.
    pinned: bool,
    /// Turning on the spot towards a way that lies behind: it counts as moving.
    turns_to_goal: bool,
}

impl Proposal {
    fn of(path: Path) -> Self {
        Self { path, turn_first: false, pinned: false, turns_to_goal: false }
    }
}

/// A timed path.
struct Timed {
    /// Its place among the rollouts.
    index: usize,
    pinned: bool,
    slow: bool,
    /// Distance of the last state from where the robot is, metres.
    travel: f64,
    /// Geodesic distance from the last state, metres.
    to_go: f64,
    near: (Cell, i64),
    end: Cell,
    profile: usize,
    /// Whether it is free, and whether it can also be stopped short of people who stop walking; once that is known.
    free: OnceCell<(bool, bool)>,
}

/// The candidates of this cycle: the continuation of `input.previous`, the shortest way to the goal and the
/// branches of `tree`, each at several speeds, without what collides, at most `max_candidates`, spread
/// over where they are at `differ_by` seconds and where they end. `way` is the shortest way to the goal.
/// Once told to stop, it still offers the first of these and the arcs, a few dozen rollouts, and no branches.
pub fn find_candidates(
    input: &GenerationInput<'_>,
    tree: &PoseTree,
    way: &[Point2],
    checker: &CollisionChecker<'_>,
    pace: &Pace<'_>,
) -> CandidateSet {
    find_candidates_by(input, false, (tree, way), checker, pace)
}

/// The rest of what was decided before, if it still leads somewhere and is free.
pub(super) fn go_on(input: &GenerationInput<'_>, checker: &CollisionChecker<'_>) -> Option<CandidateSet> {
    let pose = input.scene.belief.pose;
    let previous = input.previous?;
    let reach = input.robot.v_max * input.params.dt * input.params.steps as f64;
    let path = Path::new(pose.position(), previous.iter().map(|p| p.position()), reach);
    let off = wrap_angle(bearing(pose.position(), path.at(ROUND)) - pose.heading).abs();
    let params = &input.params.generation;
    let turn_first = off > params.rollout.turn_until;
    let trajectories = &checker.over(input.params.steps, input.params.dt, reach);
    let mut finder = Finder::new(input, true, checker, trajectories);
    let proposal = Proposal { turn_first, pinned: true, ..Proposal::of(path) };
    finder.time(&[proposal], &params.candidates.profiles, 0, &Pace::new(&|| 0.0));
    finder.timed.retain(|timed| timed.travel >= SOMEWHERE);
    Some(finder.emit()).filter(|found| !found.is_empty())
}

/// The same. If it `insists`, getting somewhere comes before being safe, and turning to where it can before turning elsewhere.
pub(super) fn find_candidates_by(
    input: &GenerationInput<'_>,
    insists: bool,
    (tree, way): (&PoseTree, &[Point2]),
    checker: &CollisionChecker<'_>,
    pace: &Pace<'_>,
) -> CandidateSet {
    let turning_radius = input.params.generation.tree.turning_radius;
    let params = &input.params.generation.candidates;
    let within = input.robot.v_max * input.params.dt * input.params.steps as f64;
    let reach = within + 0.5;
    let trajectories = &checker.over(input.params.steps, input.params.dt, within);
    let mut finder = Finder::new(input, insists, checker, trajectories);
    let mut proposals = finder.goal_directed(way, reach);
    if params.besides.arcs {
        proposals.extend(finder.arcs(turning_radius, reach));
    }
    let sure = proposals.len();
    let to_go = |p| input.geodesic.at(p);
    let branches =
        branches(tree, params.max_branches as usize, reach, params.end_cell, turning_radius, to_go);
    proposals.extend(branches.into_iter().map(Proposal::of));
    finder.time(&proposals[..sure], &params.profiles, 0, &Pace::new(&|| 0.0));
    finder.time(&proposals[sure..], &params.profiles, 0, pace);
    if params.besides.fan && !finder.has_enough() {
        let fan = finder.fan(way, reach);
        finder.time(&fan, &params.profiles, 0, pace);
        let creep = [params.creep];
        finder.time(&proposals, &creep, params.profiles.len(), pace);
        finder.time(&fan, &creep, params.profiles.len(), pace);
        if insists && !finder.gets_somewhere() {
            finder.leave(reach);
        }
    }
    finder.emit()
}

struct Finder<'a> {
    input: &'a GenerationInput<'a>,
    checker: &'a CollisionChecker<'a>,
    trajectories: &'a TrajectoryChecker<'a>,
    params: &'a CandidateParams,
    rollout_params: &'a RolloutParams,
    from: Departure<'a>,
    /// Mean speed below which a candidate is slow, m/s.
    slow: f64,
    /// Whether getting somewhere comes before being safe.
    insists: bool,
    /// Those of all rollouts, `[rollout, state]`.
    states: States,
    timed: Vec<Timed>,
    /// Where the paths lead that have been timed, by profile.
    led: BTreeSet<([Cell; 2], bool, usize)>,
}

impl<'a> Finder<'a> {
    fn new(
        input: &'a GenerationInput<'a>,
        insists: bool,
        checker: &'a CollisionChecker<'a>,
        trajectories: &'a TrajectoryChecker<'a>,
    ) -> Self {
        let Belief { pose, twist, .. } = input.scene.belief;
        let (robot, steps, dt) = (input.robot, input.params.steps, input.params.dt);
        Self {
            input,
            checker,
            trajectories,
            params: &input.params.generation.candidates,
            rollout_params: &input.params.generation.rollout,
            from: Departure { pose, twist, robot, steps, dt },
            slow: robot.slow_below(input.params.min_speed, twist.v, steps, dt),
            insists,
            states: States::default(),
            timed: Vec::new(),
            led: BTreeSet::new(),
        }
    }

    /// The previous decision continued, the way to the goal, and the turn towards it if it lies behind.
    fn goal_directed(&self, way: &[Point2], reach: f64) -> Vec<Proposal> {
        let pose = self.input.scene.belief.pose;
        let mut proposals = Vec::new();
        let besides = self.params.besides;
        if let Some(previous) = self.input.previous.filter(|p| besides.previous && !p.is_empty()) {
            let mut path = Path::new(pose.position(), previous.iter().map(|p| p.position()), reach);
            let rest = reach - path.length();
            if rest > Path::SPACING {
                path.extend(self.input.geodesic.descend_for(path.end(), 0.2, rest), reach);
            }
            proposals.push(Proposal { pinned: true, ..Proposal::of(path) });
        }
        if self.input.scene.impatient
            && let Some(past) = way_past(self.input, self.checker, PASSING)
        {
            let mut path = Path::new(pose.position(), past, reach);
            path.extend(self.input.geodesic.descend_for(path.end(), 0.2, reach), reach);
            let ahead = path.at(ROUND);
            proposals.extend(self.after_turning(path, ahead, |_| true));
        }
        let ahead = way.get(way.len().min(4).wrapping_sub(1));
        if let Some(&ahead) = ahead.filter(|_| besides.shortest_way) {
            let path = Path::new(pose.position(), way.iter().copied(), reach);
            proposals.extend(self.after_turning(path, ahead, |path| !self.occupied(path)));
        }
        proposals
    }

    /// A path, and the same after a turn on the spot if `ahead` lies far enough off the robot's heading.
    fn after_turning(
        &self,
        path: Path,
        ahead: Point2,
        turns_to_goal: impl FnOnce(&Path) -> bool,
    ) -> impl Iterator<Item = Proposal> {
        let pose = self.from.pose;
        let off = wrap_angle(bearing(pose.position(), ahead) - pose.heading).abs();
        let turn = (off > self.params.turn_from).then(|| {
            let turns_to_goal = turns_to_goal(&path);
            Proposal { turn_first: true, pinned: true, turns_to_goal, ..Proposal::of(path.clone()) }
        });
        turn.into_iter().chain([Proposal { pinned: true, ..Proposal::of(path) }])
    }

    /// Whether a person is in the way at the beginning of a path: turning to it leads nowhere yet.
    fn occupied(&self, path: &Path) -> bool {
        let people = &self.input.scene.people;
        let contact = self.input.robot.radius() + people.radius;
        let first = (BEGINNING / Path::SPACING) as usize;
        path.points()
            .iter()
            .take(first)
            .any(|p| (0..people.len()).any(|i| people.position(i).distance_squared(*p) < contact * contact))
    }

    /// Arcs from the tightest left to the tightest right, evenly spaced in curvature.
    fn arcs(&self, turning_radius: f64, reach: f64) -> Vec<Proposal> {
        let pose = self.from.pose;
        let middle = f64::from(ARCS / 2);
        (0..ARCS)
            .map(|k| {
                let curvature = (middle - f64::from(k)) / (middle * turning_radius);
                // Half a circle at most: more would come back to where others lead.
                let length = reach.min(std::f64::consts::PI / curvature.abs().max(1e-6));
                let points = (1..=(length / Path::SPACING) as usize).map(|n| {
                    step(pose, Twist { v: 1.0, omega: curvature }, n as f64 * Path::SPACING).position()
                });
                let path = self.until_wall(Path::new(pose.position(), points, length));
                Proposal::of(path)
            })
            .collect()
    }

    /// Straight ways in all directions, the first towards the goal.
    fn fan(&self, way: &[Point2], reach: f64) -> Vec<Proposal> {
        let pose = self.input.scene.belief.pose;
        let first = way.last().map_or(pose.heading, |&p| bearing(pose.position(), p));
        (0..FAN)
            .map(|k| {
                let angle = first + f64::from(k) * std::f64::consts::TAU / f64::from(FAN);
                let (s, c) = sin_cos(angle);
                let end = Point2::new(pose.x + reach * c, pose.y + reach * s);
                // Next to a person even a small turn has to come first.
                let turn_first = wrap_angle(angle - pose.heading).abs() > self.rollout_params.turn_until;
                let path = self.until_wall(Path::new(pose.position(), [end], reach));
                Proposal { turn_first, ..Proposal::of(path) }
            })
            .collect()
    }

    /// The part of a path that keeps clear of walls.
    fn until_wall(&self, path: Path) -> Path {
        let heading = self.input.scene.belief.pose.heading;
        let clear = path.points()[1..]
            .iter()
            .take_while(|p| self.checker.wall_clear(Pose2::new(p.x, p.y, heading)))
            .count();
        Path::new(path.points()[0], path.points()[1..].iter().copied(), clear as f64 * Path::SPACING + 1e-6)
    }

    /// Times every path with every profile, until told to stop.
    fn time(&mut self, proposals: &[Proposal], profiles: &[f64], first_profile: usize, pace: &Pace<'_>) {
        let mut chosen: Vec<(&Proposal, usize)> = Vec::with_capacity(proposals.len() * profiles.len());
        for proposal in proposals.iter().filter(|p| p.path.length() > 0.0) {
            for (k, &fraction) in profiles.iter().enumerate() {
                if self.leads_elsewhere(proposal, fraction, first_profile + k) {
                    chosen.push((proposal, k));
                }
            }
        }
        for batch in chosen.chunks(BATCH) {
            if pace.is_over(1.0) {
                return;
            }
            let drives: Vec<Drive<'_>> = (batch.iter())
                .map(|&(Proposal { path, turn_first, .. }, k)| Drive {
                    path,
                    profile: SpeedProfile { fraction: profiles[k], turn_first: *turn_first },
                })
                .collect();
            rollouts(&drives, &self.from, self.rollout_params, &mut self.states);
            for &(proposal, k) in batch {
                self.timed.push(self.describe(self.timed.len(), proposal, first_profile + k));
            }
        }
    }

    /// Whether a path differs from all before it as far as it can be driven with a profile. Slow profiles only reach what
    /// many branches have in common, which is driven once.
    fn leads_elsewhere(&mut self, proposal: &Proposal, fraction: f64, profile: usize) -> bool {
        let Departure { robot, dt, steps, twist, .. } = self.from;
        let length = fraction.max(twist.v / robot.v_max) * robot.v_max * dt * steps as f64;
        let after = |share: f64| proposal.path.at((share * length).min(proposal.path.length()));
        let places = [cell(after(0.5), self.params.near_cell), cell(after(1.0), self.params.end_cell)];
        self.led.insert((places, proposal.turn_first, profile)) || proposal.pinned
    }

    fn describe(&self, index: usize, proposal: &Proposal, profile: usize) -> Timed {
        let (params, states, steps) = (self.params, &self.states, self.from.steps);
        let first = index * steps;
        let last = first + steps - 1;
        let near = first + ((params.differ_by / self.from.dt).round() as usize).clamp(1, steps) - 1;
        let end = states.position(last);
        let to_go = self.input.geodesic.at(end);
        let arrives = to_go <= params.goal_tolerance;
        let mean_speed = states.v[first..=last].iter().sum::<f64>() / steps as f64;
        Timed {
            index,
            pinned: proposal.pinned,
            slow: mean_speed < self.slow && !proposal.turns_to_goal && !arrives,
            travel: end.distance(self.from.pose.position()),
            to_go,
            near: {
                let turn = (states.heading[near] / params.near_angle).floor() as i64;
                (cell(states.position(near), params.near_cell), turn)
            },
            end: cell(end, params.end_cell),
            profile,
            free: OnceCell::new(),
        }
    }

    /// Where a rollout ends.
    fn end(&self, timed: &Timed) -> Point2 {
        self.states.position((timed.index + 1) * self.from.steps - 1)
    }

    /// The rollouts that are free for long enough to evade, the longest first.
    fn evading(&self) -> Vec<&Timed> {
        let (collision, steps) = (&self.input.params.collision, self.from.steps);
        let free_for = |t: &Timed| {
            let poses = self.states.poses(t.index * steps..(t.index + 1) * steps);
            self.trajectories.first_collision(poses).map_or(f64::INFINITY, |collision| collision.time)
        };
        let mut evading: Vec<(f64, &Timed)> = self.timed.iter().map(|t| (free_for(t), t)).collect();
        evading.retain(|(seconds, _)| collision.evades(*seconds));
        evading.sort_by(|(a, t), (b, u)| b.total_cmp(a).then(t.index.cmp(&u.index)));
        evading.truncate(self.params.max_candidates as usize);
        evading.into_iter().map(|(_, t)| t).collect()
    }

    /// Whether a rollout is free, and whether it is safe as well: it can be stopped short of people who stop walking.
    fn is_free(&self, timed: &Timed) -> (bool, bool) {
        *timed.free.get_or_init(|| {
            let steps = self.from.steps;
            let poses = || self.states.poses(timed.index * steps..(timed.index + 1) * steps);
            let braking = || self.input.robot.stopping_distance(self.states.v[timed.index * steps]);
            let free = self.trajectories.first_collision(poses()).is_none();
            (free, free && self.trajectories.stops_short(poses(), braking()))
        })
    }

    /// The free rollouts that `fits`, with whether they are safe, lets pass: pinned ones first, then those nearest to the
    /// goal, one of each place at `differ_by`, end and profile. Only those are checked for collisions that no other
    /// makes needless.
    fn pick(&self, fits: impl Fn(&Timed, bool) -> bool) -> Vec<&Timed> {
        let mut order: Vec<&Timed> = self.timed.iter().filter(|t| fits(t, true) || fits(t, false)).collect();
        order.sort_by(|a, b| b.pinned.cmp(&a.pinned).then(a.to_go.total_cmp(&b.to_go)));
        let mut seen = BTreeSet::new();
        order.retain(|t| {
            let key = (t.near, t.end, t.profile);
            let is_picked = (t.pinned || !seen.contains(&key)) && {
                let (free, safe) = self.is_free(t);
                free && fits(t, safe)
            };
            if is_picked {
                seen.insert(key);
            }
            is_picked
        });
        order
    }

    /// Whether safe candidates lead to enough different places.
    fn has_enough(&self) -> bool {
        let is_enough = |fits: &dyn Fn(&Timed, bool) -> bool| {
            let places: BTreeSet<_> = self.pick(fits).iter().map(|t| t.near).collect();
            places.len() >= self.params.min_candidates as usize
        };
        // Most often those that are not slow are enough.
        is_enough(&|t, safe| safe && !t.slow) || is_enough(&|_, safe| safe)
    }

    /// Whether anything that is free gets somewhere.
    fn gets_somewhere(&self) -> bool {
        self.timed.iter().any(|t| t.travel >= SOMEWHERE && self.is_free(t).0)
    }

    /// Keeps nothing but the straight beginning of the way past people, after a turn on the spot, if that is free: within
    /// the horizon there is no time for both, so that all turns look alike, and the robot would turn to and fro.
    fn leave(&mut self, reach: f64) {
        let pose = self.from.pose;
        let Some(&corner) = way_past(self.input, self.checker, LEAVING).as_ref().and_then(|way| way.first())
        else {
            return;
        };
        let off = wrap_angle(bearing(pose.position(), corner) - pose.heading).abs();
        let turn_first = off > self.rollout_params.turn_until;
        let path = Path::new(pose.position(), [corner], reach);
        let timed = self.timed.len();
        let way = Proposal { turn_first, pinned: true, ..Proposal::of(path) };
        self.time(&[way], &[self.params.creep], 0, &Pace::new(&|| 0.0));
        if self.timed.get(timed).is_some_and(|way| self.is_free(way).0) {
            self.timed.drain(..timed);
        }
    }

    /// Pinned ones first, then the best of every place at `differ_by`, then of every end; ids in that order. All of them
    /// are safe, and not slow, as far as there are any such. If there are too many, the directions in which they end take
    /// turns: a way round that only some term would prefer is not left out for being the longer one.
    fn emit(&self) -> CandidateSet {
        // Turning to and fro beside a person who waits costs nothing and never ends.
        let kinds: [&dyn Fn(&Timed) -> bool; 3] = [&|t| !t.slow, &|t| t.travel >= SOMEWHERE, &|_| true];
        let mut all: Vec<_> =
            [true, false].into_iter().flat_map(|is_safe| kinds.map(|kind| (is_safe, kind))).collect();
        if self.insists {
            all = kinds[1..].iter().flat_map(|&kind| [(true, kind), (false, kind)]).collect();
        }
        let picked =
            all.into_iter().map(|(is_safe, kind)| self.pick(|t, safe| (safe || !is_safe) && kind(t)));
        let picked = { picked }.find(|picked| !picked.is_empty());
        let collision = &self.input.params.collision;
        let evades = picked.is_none() && collision.evade < collision.horizon;
        let picked = if evades { self.evading() } else { picked.unwrap_or_default() };
        let mut places = BTreeSet::new();
        let (mut offered, others): (Vec<&Timed>, Vec<&Timed>) =
            picked.into_iter().partition(|t| places.insert(t.near) || t.pinned);
        offered.extend(others);
        let most = self.params.max_candidates as usize;
        if offered.len() > most {
            let (mut kept, rest): (Vec<&Timed>, Vec<&Timed>) = offered.into_iter().partition(|t| t.pinned);
            let turns = in_turns(rest.iter().map(|t| sector(self.from.pose.position(), self.end(t))));
            kept.extend(turns.into_iter().map(|index| rest[index]));
            kept.truncate(most);
            offered = kept;
        }
        let (steps, dt) = (self.from.steps, self.from.dt);
        let (mut states, count) = (States::default(), offered.len() as u32);
        for t in offered {
            states.extend_from(&self.states, t.index * steps..(t.index + 1) * steps);
        }
        // Rollouts from a finite belief are finite and of equal length; anything else offers nothing.
        CandidateSet::new(steps, dt, (0..count).collect(), states)
            .unwrap_or_else(|_| CandidateSet::empty(steps, dt))
    }
}
