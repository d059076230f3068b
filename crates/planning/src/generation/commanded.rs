//! Trajectories of a robot that is given commands, for generators that choose by themselves: the best is offered first,
//! and the term `order` keeps it first.

use crate::candidates::CandidateSet;
use crate::generation::GenerationInput;
use crate::geometry::{Pose2, Twist};
use crate::motion::step;
use crate::states::States;

/// What is offered so far, the best first.
pub(super) struct Commanded<'a> {
    input: &'a GenerationInput<'a>,
    states: States,
    count: u32,
    most: u32,
}

impl<'a> Commanded<'a> {
    /// Nothing yet; `most` candidates at most.
    pub(super) fn new(input: &'a GenerationInput<'a>, most: u32) -> Self {
        Self { input, states: States::default(), count: 0, most }
    }

    /// Whether nothing more is taken.
    pub(super) fn is_full(&self) -> bool {
        self.count >= self.most
    }

    /// Adds what becomes of the robot that is asked for `command(seconds, pose, twist)` before each step, and brakes in
    /// time to stand at the end; nothing if it is full.
    pub(super) fn add(&mut self, command: impl FnMut(f64, Pose2, Twist) -> Twist) {
        if self.is_full() {
            return;
        }
        drive(self.input, &mut self.states, command);
        self.count += 1;
    }

    /// Those that are free, in their order; of these, those that can be stopped short of people, if there are such.
    pub(super) fn into_candidates(self) -> CandidateSet {
        let steps = self.input.params.steps;
        let dt = self.input.params.dt;
        let ids = (0..self.count).collect();
        // Commands within limits from a finite pose give finite poses; anything else offers nothing.
        let Ok(all) = CandidateSet::new(steps, dt, ids, self.states) else {
            return CandidateSet::empty(steps, dt);
        };
        let checker = self.input.checker();
        let people = checker.over(steps, dt, self.input.robot.v_max * dt * steps as f64);
        let is_free = |&i: &usize| people.first_collision(all.all_states().poses(all.range(i))).is_none();
        let free: Vec<usize> = (0..all.len()).filter(is_free).collect();
        self.input.stoppable(CandidateSet::concat(steps, dt, vec![all.pick(free)]))
    }
}

/// Appends the states of [`Commanded::add`].
pub(super) fn drive(
    input: &GenerationInput<'_>,
    states: &mut States,
    mut command: impl FnMut(f64, Pose2, Twist) -> Twist,
) {
    let robot = input.robot;
    let params = input.params;
    let (mut pose, mut twist) = input.scene.belief.motion();
    let per_state = (params.dt / params.generation.rollout.substep - 1e-9).ceil().max(1.0) as usize;
    let h = params.dt / per_state as f64;
    let all = per_state * params.steps;
    let mut brakes = false;
    for k in 0..all {
        // After one more command there is one step less to brake in, and maybe more speed to lose.
        let needed = (twist.v.abs() / robot.a_max).max(twist.omega.abs() / robot.alpha_max) + 2.0 * h;
        brakes |= needed > (all - k) as f64 * h + 1e-9;
        let wanted = if brakes { Twist::default() } else { command(k as f64 * h, pose, twist) };
        twist = robot.limit(twist, wanted, h);
        pose = step(pose, twist, h);
        if (k + 1) % per_state == 0 {
            states.push(pose, twist);
        }
    }
}
