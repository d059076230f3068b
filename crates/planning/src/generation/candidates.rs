//! FindPathCandidates (Alg. 1, line 12): which ways out of the tree are offered, timed and free.

mod proposals;
mod selection;

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::candidates::CandidateSet;
use crate::collision::{CollisionChecker, TrajectoryChecker};
use crate::generation::branches::{Cell, branches, cell};
use crate::generation::params::CandidateParams;
use crate::generation::pose_tree::PoseTree;
use crate::generation::rollout::{Departure, Drive, RolloutParams, SpeedProfile, rollouts};
use crate::generation::{GenerationInput, Pace};
use crate::geometry::Point2;
use crate::scene::Belief;
use crate::states::States;

use proposals::{Proposal, Proposer};
pub(super) use selection::SOMEWHERE;
use selection::{Selection, Timed};

/// Rollouts between two looks at the time.
const BATCH: usize = 32;
/// Metres by which a path may be longer than the robot gets within the horizon: it looks so far ahead as it follows
/// one.
const BEYOND: f64 = 0.5;

/// Where paths are looked for.
#[derive(Clone, Copy)]
pub(super) struct Search<'a> {
    /// Its branches are offered.
    pub(super) tree: &'a PoseTree,
    /// The shortest way to the goal.
    pub(super) way: &'a [Point2],
    /// Whether the robot prefers a way that gets somewhere to one that is safe, and leaves by the way past people if
    /// nothing else gets anywhere.
    pub(super) insists: bool,
}

/// The candidates of this cycle: the continuation of `input.previous`, the shortest way to the goal and the branches of
/// `tree`, each at several speeds. What collides is left out if anything is free. At most `max_candidates` are kept,
/// spread over where they are at `differ_by` seconds and where they end. `way` is the shortest way to the goal. If the
/// time is over before it begins, there are no branches, but still the previous decision, the shortest way and the
/// arcs: a few dozen rollouts.
pub fn find_candidates(
    input: &GenerationInput<'_>,
    tree: &PoseTree,
    way: &[Point2],
    checker: &CollisionChecker<'_>,
    pace: &Pace<'_>,
) -> CandidateSet {
    find_candidates_by(input, Search { tree, way, insists: false }, checker, pace)
}

/// [`find_candidates`], in which a robot may insist on getting somewhere.
pub(super) fn find_candidates_by(
    input: &GenerationInput<'_>,
    search: Search<'_>,
    checker: &CollisionChecker<'_>,
    pace: &Pace<'_>,
) -> CandidateSet {
    let params = &input.params.generation.candidates;
    let proposer = Proposer { input, checker, reach: farthest(input) + BEYOND };
    let trajectories = &checker.over(input.params.steps, input.params.dt, farthest(input));
    let mut finder = Finder::new(input, trajectories);
    let mut proposals = proposer.goal_directed(search.way);
    if params.besides.arcs {
        proposals.extend(proposer.arcs());
    }
    finder.time(&proposals, &params.profiles, 0, &Pace::endless());
    let branches = branches_of(input, search.tree, proposer.reach);
    finder.time(&branches, &params.profiles, 0, pace);
    if params.besides.fan && !finder.selection().has_enough() {
        let fan = proposer.fan(search.way);
        finder.time(&fan, &params.profiles, 0, pace);
        let creep = [params.creep];
        let creeping = params.profiles.len();
        proposals.extend(branches);
        finder.time(&proposals, &creep, creeping, pace);
        finder.time(&fan, &creep, creeping, pace);
        if search.insists && !finder.selection().gets_somewhere() {
            finder.leave(proposer.out_of_here());
        }
    }
    finder.selection().offers(search.insists)
}

/// The rest of what was decided before, if it still leads somewhere and is free.
pub(super) fn go_on(input: &GenerationInput<'_>, checker: &CollisionChecker<'_>) -> Option<CandidateSet> {
    let reach = farthest(input);
    let proposal = Proposer { input, checker, reach }.rest_of_previous()?;
    let trajectories = &checker.over(input.params.steps, input.params.dt, reach);
    let mut finder = Finder::new(input, trajectories);
    finder.time(&[proposal], &input.params.generation.candidates.profiles, 0, &Pace::endless());
    finder.timed.retain(|timed| timed.travel >= SOMEWHERE);
    Some(finder.selection().offers(true)).filter(|found| !found.is_empty())
}

/// How far the robot gets within the horizon, metres.
fn farthest(input: &GenerationInput<'_>) -> f64 {
    input.robot.v_max * input.params.dt * input.params.steps as f64
}

fn branches_of(input: &GenerationInput<'_>, tree: &PoseTree, reach: f64) -> Vec<Proposal> {
    let generation = &input.params.generation;
    let params = &generation.candidates;
    let turning_radius = generation.tree.turning_radius;
    let most = params.max_branches as usize;
    let paths = branches(tree, most, reach, params.end_cell, turning_radius, |p| input.geodesic.at(p));
    paths.into_iter().map(Proposal::of).collect()
}

/// Times paths and keeps what came of it.
struct Finder<'a> {
    input: &'a GenerationInput<'a>,
    trajectories: &'a TrajectoryChecker<'a>,
    params: &'a CandidateParams,
    rollout_params: RolloutParams,
    from: Departure<'a>,
    /// Mean speed below which a candidate is slow, m/s.
    slow: f64,
    /// Those of all rollouts, `[rollout, state]`.
    states: States,
    timed: Vec<Timed>,
    /// Where the paths lead that have been timed, by profile.
    timed_before: BTreeSet<([Cell; 2], bool, usize)>,
}

impl<'a> Finder<'a> {
    fn new(input: &'a GenerationInput<'a>, trajectories: &'a TrajectoryChecker<'a>) -> Self {
        let Belief { pose, twist, .. } = input.scene.belief;
        let robot = input.robot;
        let steps = input.params.steps;
        let dt = input.params.dt;
        Self {
            input,
            trajectories,
            params: &input.params.generation.candidates,
            rollout_params: input.rollout_params(),
            from: Departure { pose, twist, robot, steps, dt },
            slow: robot.slow_below(input.params.min_speed, twist.v, steps, dt),
            states: States::default(),
            timed: Vec::new(),
            timed_before: BTreeSet::new(),
        }
    }

    fn selection(&self) -> Selection<'_> {
        Selection {
            input: self.input,
            trajectories: self.trajectories,
            states: &self.states,
            timed: &self.timed,
        }
    }

    /// Times every path with every profile, until told to stop. The profiles are numbered from `first_profile`.
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
            rollouts(&drives, &self.from, &self.rollout_params, &mut self.states);
            for &(proposal, k) in batch {
                self.timed.push(self.describe(self.timed.len(), proposal, first_profile + k));
            }
        }
    }

    /// Whether a path differs from all before it as far as it can be driven with a profile. Slow profiles only reach
    /// what many branches have in common, which is driven once.
    fn leads_elsewhere(&mut self, proposal: &Proposal, fraction: f64, profile: usize) -> bool {
        let Departure { robot, dt, steps, twist, .. } = self.from;
        let path = &proposal.path;
        let length = fraction.max(twist.v / robot.v_max) * robot.v_max * dt * steps as f64;
        let middle = path.at((0.5 * length).min(path.length()));
        let end = path.at((1.0 * length).min(path.length()));
        let places = [cell(middle, self.params.near_cell), cell(end, self.params.end_cell)];
        self.timed_before.insert((places, proposal.turn_first, profile)) || proposal.pinned
    }

    /// What the last rollout, number `index`, amounts to.
    fn describe(&self, index: usize, proposal: &Proposal, profile: usize) -> Timed {
        let params = self.params;
        let states = &self.states;
        let steps = self.from.steps;
        let first = index * steps;
        let last = first + steps - 1;
        let near = first + ((params.differ_by / self.from.dt).round() as usize).clamp(1, steps) - 1;
        let heading = (states.heading[near] / params.near_angle).floor() as i64;
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
            near: (cell(states.position(near), params.near_cell), heading),
            end: cell(end, params.end_cell),
            profile,
            clearance: OnceCell::new(),
        }
    }

    /// If `way` is free, keeps nothing else. The horizon is too short for a turn and for getting away after it, so all
    /// turns would look alike, and the robot would turn to and fro.
    fn leave(&mut self, way: Option<Proposal>) {
        let Some(way) = way else { return };
        let before = self.timed.len();
        self.time(&[way], &[self.params.creep], 0, &Pace::endless());
        if self.timed.get(before).is_some_and(|way| self.selection().is_free(way)) {
            self.timed.drain(..before);
        }
    }
}
