//! Which of the timed paths are offered.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::candidates::CandidateSet;
use crate::collision::TrajectoryChecker;
use crate::generation::GenerationInput;
use crate::generation::branches::{Cell, in_turns, sector};
use crate::geometry::{Point2, Pose2};
use crate::states::States;

/// A candidate that ends this far away gets somewhere, however slowly, metres.
pub(in crate::generation) const SOMEWHERE: f64 = 0.3;

/// A timed path.
pub(super) struct Timed {
    /// Its place among the rollouts.
    pub(super) index: usize,
    pub(super) pinned: bool,
    pub(super) slow: bool,
    /// Distance of the last state from where the robot is, metres.
    pub(super) travel: f64,
    /// Geodesic distance from the last state, metres.
    pub(super) to_go: f64,
    /// Where it is, and which way it heads, at `differ_by` seconds.
    pub(super) near: (Cell, i64),
    pub(super) end: Cell,
    pub(super) profile: usize,
    /// Looked up on first use: most rollouts are never asked for it.
    pub(super) clearance: OnceCell<Clearance>,
}

/// What a rollout runs into.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Clearance {
    Collides,
    Free,
    /// Free, and the robot can stop on it short of people who stop walking.
    Safe,
}

/// How far a candidate has to get.
#[derive(Clone, Copy)]
enum Progress {
    NotSlow,
    Somewhere,
    Any,
}

/// What a candidate has to be besides free.
#[derive(Clone, Copy)]
struct Demand {
    safe: bool,
    progress: Progress,
}

/// Demands from the strictest to the least: the first that anything meets decides.
const CAUTIOUS: &[Demand] = &[
    Demand { safe: true, progress: Progress::NotSlow },
    // Turning to and fro beside a person who waits costs nothing and never ends.
    Demand { safe: true, progress: Progress::Somewhere },
    Demand { safe: true, progress: Progress::Any },
    Demand { safe: false, progress: Progress::NotSlow },
    Demand { safe: false, progress: Progress::Somewhere },
    Demand { safe: false, progress: Progress::Any },
];

/// The same for a robot to which getting somewhere comes before being safe.
const INSISTENT: &[Demand] = &[
    Demand { safe: true, progress: Progress::Somewhere },
    Demand { safe: false, progress: Progress::Somewhere },
    Demand { safe: true, progress: Progress::Any },
    Demand { safe: false, progress: Progress::Any },
];

impl Demand {
    fn admits(self, timed: &Timed) -> bool {
        match self.progress {
            Progress::NotSlow => !timed.slow,
            Progress::Somewhere => timed.travel >= SOMEWHERE,
            Progress::Any => true,
        }
    }
}

/// Chooses among timed paths.
pub(super) struct Selection<'a> {
    pub(super) input: &'a GenerationInput<'a>,
    pub(super) trajectories: &'a TrajectoryChecker<'a>,
    /// Those of all rollouts, `[rollout, state]`.
    pub(super) states: &'a States,
    pub(super) timed: &'a [Timed],
}

impl<'a> Selection<'a> {
    /// Pinned ones first, then the best of every place at `differ_by`, then of every end; ids in that order. All of
    /// them are safe, and not slow, as far as there are any such.
    pub(super) fn offers(&self, insists: bool) -> CandidateSet {
        let demands = if insists { INSISTENT } else { CAUTIOUS };
        let met = demands.iter().map(|&demand| self.pick(demand)).find(|picked| !picked.is_empty());
        let picked = met.unwrap_or_default();
        let mut places = BTreeSet::new();
        let (first, others): (Vec<&Timed>, Vec<&Timed>) =
            picked.into_iter().partition(|timed| places.insert(timed.near) || timed.pinned);
        let offered = self.as_many_as_allowed([first, others].concat());
        self.set_of(&offered)
    }

    /// Whether safe candidates lead to enough different places.
    pub(super) fn has_enough(&self) -> bool {
        // Most often those that are not slow are enough.
        [Progress::NotSlow, Progress::Any].into_iter().any(|progress| {
            let places: BTreeSet<_> =
                self.pick(Demand { safe: true, progress }).iter().map(|timed| timed.near).collect();
            places.len() >= self.input.params.generation.candidates.min_candidates as usize
        })
    }

    /// Whether anything that is free gets somewhere.
    pub(super) fn gets_somewhere(&self) -> bool {
        self.timed.iter().any(|timed| timed.travel >= SOMEWHERE && self.is_free(timed))
    }

    pub(super) fn is_free(&self, timed: &Timed) -> bool {
        self.clearance(timed) != Clearance::Collides
    }

    /// The free rollouts that meet a demand: pinned ones first, then those nearest to the goal, one of each place at
    /// `differ_by`, end and profile. A rollout whose place is taken already is not checked for collisions.
    fn pick(&self, demand: Demand) -> Vec<&'a Timed> {
        let mut order: Vec<&Timed> = self.timed.iter().filter(|timed| demand.admits(timed)).collect();
        order.sort_by(|a, b| b.pinned.cmp(&a.pinned).then(a.to_go.total_cmp(&b.to_go)));
        let mut seen = BTreeSet::new();
        order.retain(|timed| {
            let place = (timed.near, timed.end, timed.profile);
            if !timed.pinned && seen.contains(&place) {
                return false;
            }
            let is_picked = match self.clearance(timed) {
                Clearance::Collides => false,
                Clearance::Free => !demand.safe,
                Clearance::Safe => true,
            };
            if is_picked {
                seen.insert(place);
            }
            is_picked
        });
        order
    }

    /// If there are too many, the best of each direction in which they end are kept: only some term may prefer a way
    /// round, which a choice by length alone would drop.
    fn as_many_as_allowed(&self, offered: Vec<&'a Timed>) -> Vec<&'a Timed> {
        if offered.len() <= self.most() {
            return offered;
        }
        let robot = self.input.scene.belief.pose.position();
        let (mut kept, rest): (Vec<&Timed>, Vec<&Timed>) =
            offered.into_iter().partition(|timed| timed.pinned);
        let turns = in_turns(rest.iter().map(|timed| sector(robot, self.end(timed))));
        kept.extend(turns.into_iter().map(|index| rest[index]));
        kept.truncate(self.most());
        kept
    }

    fn set_of(&self, offered: &[&Timed]) -> CandidateSet {
        let steps = self.input.params.steps;
        let dt = self.input.params.dt;
        let mut states = States::default();
        for timed in offered {
            states.extend_from(self.states, self.range(timed));
        }
        // Rollouts from a finite belief are finite and of equal length; anything else offers nothing.
        CandidateSet::new(steps, dt, (0..offered.len() as u32).collect(), states)
            .unwrap_or_else(|_| CandidateSet::empty(steps, dt))
    }

    fn clearance(&self, timed: &Timed) -> Clearance {
        *timed.clearance.get_or_init(|| {
            if self.trajectories.first_collision(self.poses(timed)).is_some() {
                return Clearance::Collides;
            }
            let braking = self.input.robot.stopping_distance(self.states.v[self.range(timed).start]);
            let stops = self.trajectories.stops_short(self.poses(timed), braking);
            if stops { Clearance::Safe } else { Clearance::Free }
        })
    }

    fn poses(&self, timed: &Timed) -> impl ExactSizeIterator<Item = Pose2> {
        self.states.poses(self.range(timed))
    }

    fn end(&self, timed: &Timed) -> Point2 {
        self.states.position(self.range(timed).end - 1)
    }

    fn range(&self, timed: &Timed) -> std::ops::Range<usize> {
        let steps = self.input.params.steps;
        timed.index * steps..(timed.index + 1) * steps
    }

    fn most(&self) -> usize {
        self.input.params.generation.candidates.max_candidates as usize
    }
}
