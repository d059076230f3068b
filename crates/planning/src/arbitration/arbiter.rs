//! Taking the best candidate that can be driven, or saying why none can.

use crate::arbitration::{
    Action, Decision, Lack, Previous, PreviousState, Reason, Rejection, Scores, Totals, last_turn,
    occupied_goal, total_costs,
};
use crate::candidates::CandidateSet;
use crate::collision::{Collision, CollisionChecker};
use crate::geometry::{Point2, wrap_angle};
use crate::motion::{Footprint, RobotModel};
use crate::occupancy::StaticMap;
use crate::profile::Profile;
use crate::scene::Scene;
use crate::speed_zones::allowed_share;
use crate::trajectory::Trajectory;

/// Seconds in one place after which a robot at its goal no longer tries to come nearer.
const LINGERING: f64 = 5.0;

/// What a decision depends on besides the candidates' scores.
#[derive(Debug, Clone, Copy)]
pub struct Context<'a> {
    /// How to plan.
    pub profile: &'a Profile,
    /// What is known now.
    pub scene: &'a Scene,
    /// Where walls are.
    pub map: &'a StaticMap,
    /// What can be driven.
    pub robot: &'a RobotModel,
    /// Where to go, map frame.
    pub goal: Point2,
    /// Heading to end with, map frame, radians; none if any will do.
    pub goal_heading: Option<f64>,
    /// What could be driven.
    pub candidates: &'a CandidateSet,
    /// The last decision that moved the robot.
    pub previous: Option<&'a Previous>,
}

impl<'a> Context<'a> {
    pub(super) fn checker(&self) -> CollisionChecker<'a> {
        let Self { profile, scene, map, robot, .. } = *self;
        CollisionChecker::new(map, robot, scene, profile.forecast, &profile.collision)
    }

    /// Mean speed below which a candidate is slow (D4), m/s, in comparison with what speed zones allow.
    fn slow_below(&self) -> f64 {
        let Self { profile, scene, map, candidates, .. } = *self;
        let here = scene.belief.pose.position();
        let share = allowed_share(self.robot, &map.grid, here, profile.hold.max_age);
        let robot = self.robot.slowed(share);
        robot.slow_below(share * profile.min_speed, scene.belief.twist.v, candidates.steps(), candidates.dt())
    }
}

/// A decision with what led to it, one entry per candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What is to be done.
    pub decision: Decision,
    /// Costs, whole and by term.
    pub totals: Totals,
    /// Why each candidate was ruled out; `None` for the chosen one and for those that only cost more.
    /// Collisions are looked for from the best on, so those are not known to be free.
    pub rejected: Vec<Option<Rejection>>,
    /// Index of the candidate followed.
    pub chosen: Option<usize>,
}

/// Eq. 4: the candidate of least L' that is scored by every active term, reachable and free, ties to
/// the lower id; slow ones only if no faster one is free (D4). Without one, the tail of the previous
/// trajectory while it is valid and free; else stop. At the goal the robot stops, turns to the heading that is
/// asked for, or goes on for a while if it is not sure to be there and its way ends nearer. It waits before a goal at
/// which people stand. Same inputs, same verdict.
///
/// Candidates beyond the length of `scores` count as not scored.
pub fn arbitrate(context: &Context<'_>, scores: &Scores) -> Verdict {
    let checker = context.checker();
    let is_checked = context.profile.collision.final_check;
    let first_collision =
        |t: &Trajectory| is_checked.then(|| checker.first_collision(t.states(), t.dt())).flatten();
    let mut verdict = decide(context, scores, &first_collision);
    let Context { profile, scene, robot, goal, .. } = *context;
    let tolerance = profile.goal.arrive_distance;
    let goal = occupied_goal::Goal { at: goal, tolerance, scene, robot, checker: &checker };
    let decision = &verdict.decision;
    if !decision.is_at_goal() && occupied_goal::is_awaited(&goal, &decision.trajectory) {
        verdict.decision = Decision::stop(Reason::WaitsForGoal, context.candidates.dt());
        verdict.chosen = None;
    }
    verdict
}

pub(super) type CollisionCheck<'a> = dyn Fn(&Trajectory) -> Option<Collision> + 'a;

fn decide(context: &Context<'_>, scores: &Scores, first_collision: &CollisionCheck<'_>) -> Verdict {
    let Context { profile, scene, goal, candidates, .. } = *context;
    let totals = total_costs(profile, scene, candidates.steps(), scores);
    let mut rejected: Vec<Option<Rejection>> =
        (0..candidates.len()).map(|i| reject_unseen(context, &totals, i)).collect();
    let to_go = scene.belief.pose.position().distance(goal);
    let at_goal = to_go < profile.goal.arrive_distance;
    let sure = profile.goal.is_sure(to_go, scene.belief.position_sigma());
    if at_goal && (sure || scene.in_place >= LINGERING) {
        return Verdict { decision: arrive(context, first_collision), totals, rejected, chosen: None };
    }
    let order = preference(context, &totals, &rejected);
    let mut chosen = None;
    for &Contender { index, slow, .. } in &order {
        let trajectory = Trajectory::of(candidates, index, scene.belief.motion());
        match first_collision(&trajectory) {
            Some(collision) => rejected[index] = Some(Rejection::Collides(collision)),
            None => {
                chosen = Some((index, slow, trajectory));
                break;
            }
        }
    }
    let end = chosen.as_ref().map(|(index, ..)| candidates.end(*index));
    if at_goal && !end.is_some_and(|end| occupied_goal::is_nearer(end, goal, to_go)) {
        return Verdict { decision: arrive(context, first_collision), totals, rejected, chosen: None };
    }
    let Some((index, slow, trajectory)) = chosen else {
        let decision = hold_or_stop(context, lack(&rejected), first_collision);
        return Verdict { decision, totals, rejected, chosen: None };
    };
    rejected[index] = None;
    if !slow {
        for rank in order.iter().filter(|rank| rank.slow) {
            rejected[rank.index] = Some(Rejection::Slow);
        }
    }
    let is_first = order.first().is_some_and(|first| first.index == index);
    let reason = match (slow, is_first) {
        (true, _) => Reason::OnlySlowFree,
        (false, true) => Reason::LeastCost,
        (false, false) => Reason::LeastCostFree,
    };
    let horizon = candidates.steps() as f64 * candidates.dt();
    let decision = Decision {
        action: Action::Follow,
        reason,
        candidate: Some(candidates.id()[index]),
        trajectory,
        valid_for: horizon.min(profile.hold.max_age),
        arrived: false,
    };
    Verdict { decision, totals, rejected, chosen: Some(index) }
}

/// What a robot does that has come to its goal: it turns, if a heading is asked for that it does not have yet, or has
/// arrived. A disc takes no more room for the turn than if it stood; another footprint waits until there is room.
fn arrive(context: &Context<'_>, first_collision: &CollisionCheck<'_>) -> Decision {
    let Context { profile, scene, robot, candidates, .. } = *context;
    let steps = candidates.steps();
    let dt = candidates.dt();
    let turn = context.goal_heading.and_then(|heading| last_turn::turn(scene, robot, heading, steps, dt));
    let Some(trajectory) = turn else { return Decision::stop(Reason::Arrived, dt) };
    let reason = Reason::TurnsToHeading;
    let is_disc = matches!(robot.footprint, Footprint::Disc { .. });
    if !is_disc && first_collision(&trajectory).is_some() {
        return Decision::stop(reason, dt);
    }
    let valid_for = trajectory.duration().min(profile.hold.max_age);
    Decision { action: Action::Follow, reason, candidate: None, trajectory, valid_for, arrived: false }
}

/// What rules a candidate out before anything is checked for collisions.
fn reject_unseen(context: &Context<'_>, totals: &Totals, index: usize) -> Option<Rejection> {
    let candidates = context.candidates;
    if index >= totals.total.len() {
        return Some(Rejection::NotScored { term: totals.terms.first()?.term.clone() });
    }
    if let Some(term) = totals.missing_term(index) {
        return Some(Rejection::NotScored { term: term.to_owned() });
    }
    let reach = context.robot.v_max * candidates.dt() + context.profile.hold.reach_tolerance;
    let mut from = context.scene.belief.pose.position();
    for (step, at) in candidates.range(index).enumerate() {
        let to = candidates.all_states().position(at);
        if from.distance(to) > reach {
            return Some(Rejection::Unreachable { step });
        }
        from = to;
    }
    None
}

/// A candidate that may be followed unless it collides.
pub(super) struct Contender {
    pub(super) index: usize,
    /// It competes only if no other is free (D4).
    pub(super) slow: bool,
    /// What is taken off its cost for going on with the previous decision.
    pub(super) discount: f64,
}

/// Those of which `may_compete` is true, in their order.
pub(super) fn contenders(context: &Context<'_>, may_compete: &[bool]) -> Vec<Contender> {
    let persistence = context.profile.persistence;
    let tail = context.previous.filter(|_| persistence.margin > 0.0);
    let tail = tail.and_then(|previous| valid_tail(context, previous).ok());
    let slow_below = context.slow_below();
    (0..context.candidates.len())
        .filter(|&i| may_compete[i])
        .map(|index| {
            let continues = tail.as_ref().is_some_and(|tail| {
                mean_distance(context.candidates, index, tail) <= persistence.same_within
            });
            let discount = if continues { persistence.margin } else { 0.0 };
            Contender { index, slow: is_slow(context, index, slow_below), discount }
        })
        .collect()
}

/// Who may be followed, best first: fast before slow, then by cost, then by id.
fn preference(context: &Context<'_>, totals: &Totals, rejected: &[Option<Rejection>]) -> Vec<Contender> {
    let may_compete: Vec<bool> = rejected.iter().map(Option::is_none).collect();
    let contenders = contenders(context, &may_compete);
    let mut order: Vec<(f64, Contender)> =
        contenders.into_iter().filter_map(|c| Some((totals.total[c.index]? - c.discount, c))).collect();
    let id = context.candidates.id();
    order.sort_by(|(cost_a, a), (cost_b, b)| {
        a.slow.cmp(&b.slow).then(cost_a.total_cmp(cost_b)).then(id[a.index].cmp(&id[b.index]))
    });
    order.into_iter().map(|(_, contender)| contender).collect()
}

/// Whether D4 holds a candidate back: its mean speed is too low, and it neither ends at the goal, where
/// being slow is what is wanted, nor turns towards a way that lies elsewhere.
fn is_slow(context: &Context<'_>, index: usize, slow_below: f64) -> bool {
    let Context { profile, candidates, .. } = *context;
    let end = candidates.end(index);
    let turn = wrap_angle(end.heading - context.scene.belief.pose.heading);
    let speeds = &candidates.all_states().v[candidates.range(index)];
    let mean_speed = speeds.iter().sum::<f64>() / candidates.steps() as f64;
    mean_speed < slow_below
        && turn.abs() < profile.min_turn
        && end.position().distance(context.goal) >= profile.goal.arrive_distance
}

fn mean_distance(candidates: &CandidateSet, index: usize, tail: &Trajectory) -> f64 {
    let states = candidates.range(index);
    let pairs = states.zip(tail.states().x.iter().zip(&tail.states().y));
    let distances =
        pairs.map(|(at, (&x, &y))| candidates.all_states().position(at).distance(Point2::new(x, y)));
    distances.sum::<f64>() / candidates.steps().min(tail.len()).max(1) as f64
}

fn lack(rejected: &[Option<Rejection>]) -> Lack {
    let mut missing: Option<&String> = None;
    for rejection in rejected {
        match rejection {
            Some(Rejection::NotScored { term }) => {
                missing = Some(missing.map_or(term, |least| least.min(term)));
            }
            _ => return Lack::NoneFree,
        }
    }
    missing.map_or(Lack::NoCandidates, |term| Lack::NotScored { term: term.clone() })
}

fn hold_or_stop(context: &Context<'_>, lack: Lack, first_collision: &CollisionCheck<'_>) -> Decision {
    let held = context.previous.ok_or(PreviousState::Absent).and_then(|previous| {
        let tail = valid_tail(context, previous)?;
        match first_collision(&tail) {
            Some(collision) => Err(PreviousState::Collides(collision)),
            None => Ok((previous, tail)),
        }
    });
    match held {
        Ok((previous, trajectory)) => Decision {
            action: Action::Hold,
            reason: Reason::Degraded { lack, previous: PreviousState::Held },
            candidate: previous.candidate,
            trajectory,
            valid_for: previous.valid_for - (context.scene.stamp - previous.stamp),
            arrived: false,
        },
        Err(previous) => Decision::stop(Reason::Degraded { lack, previous }, context.candidates.dt()),
    }
}

/// What is left of the previous trajectory, if it is valid now and the robot is still on it.
fn valid_tail(context: &Context<'_>, previous: &Previous) -> Result<Trajectory, PreviousState> {
    let elapsed = context.scene.stamp - previous.stamp;
    // Stamps are sums of steps: a rounding error must not add or take a cycle.
    if !(elapsed >= 0.0 && elapsed < previous.valid_for - 1e-6) {
        return Err(PreviousState::Expired);
    }
    let belief = &context.scene.belief;
    let (expected, _) = previous.trajectory.at(elapsed);
    let metres = expected.position().distance(belief.pose.position());
    if metres > context.profile.hold.max_deviation {
        return Err(PreviousState::Strayed { metres });
    }
    Ok(previous.trajectory.tail(elapsed, belief.motion()))
}

#[cfg(test)]
mod tests;
