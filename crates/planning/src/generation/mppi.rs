//! The anchor `mppi`: model predictive path integral control (Williams, Aldrich and Theodorou, 2017) with critics in
//! the manner of Nav2's controller, whose numbers of rollouts and steps it has.
//!
//! Each cycle perturbs the command sequence of the last one many times, drives and judges every perturbed sequence, and
//! takes their mean, weighted by `exp(-cost / temperature)`. The sequence travels between cycles as the tree. The mean
//! is offered first, then slower versions of it, one step of it and the best of the rollouts, in case the final check
//! refuses the mean.

use crate::collision::CollisionChecker;
use crate::generation::commanded::Commanded;
use crate::generation::commanded_params::MppiParams;
use crate::generation::{Generated, GenerationInput, Pace, Tree};
use crate::geometry::{Point2, Pose2, Twist, wrap_angle};
use crate::motion::step;
use crate::numerics::{exp, sin_cos};
use crate::occupancy::Detour;
use crate::random::standard_normal;

/// Shares of the mean's speed at which it is offered again.
const SLOWER: [f64; 2] = [0.7, 0.45];
/// Gap beyond which walls and people cost nothing, metres: at the default decay, a hundredth.
const FELT_M: f64 = 1.0;
/// Rollouts between two looks at the time.
const BATCH: u32 = 32;
/// What carries the sequence: when its first command begins, seconds of the robot's clock, and the commands.
const COLUMNS: [&str; 3] = ["omega", "since", "v"];

/// The candidates of one cycle.
pub fn generate(input: &GenerationInput<'_>, tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let params = &input.params.generation.mppi;
    let length = params.commands as usize;
    let nominal = nominal(input, tree);
    let judge = Judge::new(input);
    let mut random = input.samples();
    // [rollout, command], speeds and turn rates apart.
    let room = length * params.rollouts as usize;
    let mut v = Vec::with_capacity(room);
    let mut omega = Vec::with_capacity(room);
    let mut costs = Vec::with_capacity(params.rollouts as usize);
    for k in 0..params.rollouts {
        if k > 0 && k % BATCH == 0 && pace.is_over(Pace::GROWTH) {
            break;
        }
        let first = v.len();
        let mut draw = |sigma: f64| sigma * standard_normal(&mut random);
        for commands in nominal.chunks(params.hold as usize) {
            let dv = draw(params.sigma_v);
            let domega = draw(params.sigma_omega);
            v.extend(commands.iter().map(|twist| twist.v + dv));
            omega.extend(commands.iter().map(|twist| twist.omega + domega));
        }
        costs.push(judge.cost(&nominal, &mut v[first..], &mut omega[first..]));
    }
    // A question that only warms the generator up asks for no rollout.
    let mean = if costs.is_empty() { nominal } else { weighted_mean(&costs, &v, &omega, params.temperature) };

    let mut offered = Commanded::new(input, params.offers);
    for share in [1.0].into_iter().chain(SLOWER) {
        offered.add(|time, _, _| {
            let twist = command_at(params, time).map_or_else(Twist::default, |k| mean[k]);
            Twist { v: share * twist.v, omega: share * twist.omega }
        });
    }
    // Where the robot could not stop after the whole sequence, one step of it.
    offered.add(|time, _, _| {
        let first = command_at(params, time).filter(|_| time < input.params.dt);
        first.map_or_else(Twist::default, |k| mean[k])
    });
    let mut ranked: Vec<usize> = (0..costs.len()).collect();
    ranked.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    for rollout in ranked.into_iter().take(params.offers as usize) {
        let first = rollout * length;
        offered.add(|time, _, _| match command_at(params, time) {
            Some(k) => Twist { v: v[first + k], omega: omega[first + k] },
            None => Twist::default(),
        });
    }
    Generated { candidates: offered.into_candidates(), tree: carried(input, &mean) }
}

/// Which command of a sequence holds after `time` seconds; none once it is over, and the robot stands.
fn command_at(params: &MppiParams, time: f64) -> Option<usize> {
    Some((time / params.period + 1e-9) as usize).filter(|k| *k < params.commands as usize)
}

/// The sequence of the last cycle from now on, its last command repeated; at the start the robot's own twist.
fn nominal(input: &GenerationInput<'_>, tree: Option<Tree>) -> Vec<Twist> {
    let params = &input.params.generation.mppi;
    let length = params.commands as usize;
    let now = input.scene.belief.twist;
    let carried = tree.as_ref().and_then(|tree| tree.columns(COLUMNS));
    let carried =
        carried.filter(|[omega, since, v]| [omega.len(), since.len(), v.len()] == [length, 1, length]);
    let Some([omega, since, v]) = carried else { return vec![now; length] };
    let passed = ((input.scene.stamp - since[0]) / params.period).round();
    if !(0.0..length as f64).contains(&passed) {
        return vec![now; length];
    }
    let at = |k: usize| (k + passed as usize).min(length - 1);
    (0..length).map(|k| Twist { v: v[at(k)], omega: omega[at(k)] }).collect()
}

/// The mean of the rollouts' commands, `[rollout, command]`, weighted by `exp(-cost / temperature)`.
fn weighted_mean(costs: &[f64], v: &[f64], omega: &[f64], temperature: f64) -> Vec<Twist> {
    let length = v.len() / costs.len();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let mut mean = vec![Twist::default(); length];
    let mut sum = 0.0;
    for ((cost, v), omega) in costs.iter().zip(v.chunks(length)).zip(omega.chunks(length)) {
        let weight = exp((least - cost) / temperature);
        sum += weight;
        for ((twist, v), omega) in mean.iter_mut().zip(v).zip(omega) {
            twist.v += weight * v;
            twist.omega += weight * omega;
        }
    }
    mean.iter_mut().for_each(|twist| (twist.v, twist.omega) = (twist.v / sum, twist.omega / sum));
    mean
}

/// What it costs to leave a command of the sequence, in units of `gamma`.
fn deviation(params: &MppiParams, wanted: Twist, twist: Twist) -> f64 {
    wanted.v * (twist.v - wanted.v) / (params.sigma_v * params.sigma_v)
        + wanted.omega * (twist.omega - wanted.omega) / (params.sigma_omega * params.sigma_omega)
}

/// The sequence as a value.
fn carried(input: &GenerationInput<'_>, mean: &[Twist]) -> Tree {
    let omega = mean.iter().map(|twist| twist.omega).collect();
    let v = mean.iter().map(|twist| twist.v).collect();
    Tree::new(Vec::new(), [("omega", omega), ("since", vec![input.scene.stamp]), ("v", v)])
}

/// Seconds from now at the end of command `k`; always now for one who takes people to stand still.
fn moment(params: &MppiParams, k: u32) -> f64 {
    if params.forecast { f64::from(k + 1) * params.period } else { 0.0 }
}

/// What rollouts are judged by.
struct Judge<'a> {
    input: &'a GenerationInput<'a>,
    checker: CollisionChecker<'a>,
    ways: Detour<'a>,
    /// Where people are after each command, and how near the robot's centre may come, `[command, person]`.
    people: Vec<(Point2, f64)>,
    /// Who can come near within the horizon.
    near: usize,
}

impl<'a> Judge<'a> {
    fn new(input: &'a GenerationInput<'a>) -> Self {
        let params = &input.params.generation.mppi;
        let all = &input.scene.people;
        let here = input.scene.belief.pose.position();
        let horizon = f64::from(params.commands) * params.period;
        let body = input.robot.radius() + all.radius;
        let touch = body + FELT_M + input.robot.v_max * horizon;
        let last = moment(params, params.commands);
        let near: Vec<usize> = (0..all.len())
            .filter(|&i| {
                let walks = all.position(i).distance(all.position_after(i, last));
                all.position(i).distance(here) <= touch + walks
            })
            .collect();
        let checker = input.checker();
        let mut people = Vec::with_capacity(params.commands as usize * near.len());
        for k in 0..params.commands {
            let time = moment(params, k);
            let places =
                near.iter().map(|&i| (all.position_after(i, time), body + checker.gap_asked(i, time)));
            people.extend(places);
        }
        Self { input, ways: input.ways_past(params.around), people, near: near.len(), checker }
    }

    /// The cost of a perturbed sequence, whose commands are first cut to what the robot can do.
    fn cost(&self, nominal: &[Twist], v: &mut [f64], omega: &mut [f64]) -> f64 {
        let input = self.input;
        let params = &self.input.params.generation.mppi;
        let (mut pose, mut twist) = input.scene.belief.motion();
        let mut cost = 0.0;
        for (k, wanted) in nominal.iter().enumerate() {
            twist = input.robot.limit(twist, Twist { v: v[k], omega: omega[k] }, params.period);
            (v[k], omega[k]) = (twist.v, twist.omega);
            pose = step(pose, twist, params.period);
            let p = pose.position();
            let mut gap = self.checker.wall_gap(pose).min(FELT_M);
            for (person, contact) in &self.people[k * self.near..(k + 1) * self.near] {
                let square = person.distance_squared(p);
                let felt = contact + gap;
                if square < felt * felt {
                    gap = square.sqrt() - contact;
                }
            }
            if gap < 0.0 {
                // Nothing after a contact makes it better; earlier ones are worse.
                return cost + params.contact * (2.0 - k as f64 / nominal.len() as f64);
            }
            if gap < FELT_M {
                cost += params.obstacle * params.period * exp(-params.decay * gap);
            }
            cost += params.gamma * deviation(params, *wanted, twist);
        }
        cost + params.goal * self.to_go(pose) + params.angle * self.aside(pose)
    }

    fn to_go(&self, pose: Pose2) -> f64 {
        // Where the goal cannot be reached from, it costs more than any way there is.
        let metres = self.ways.at(pose.position());
        if metres.is_finite() { metres } else { 1e4 }
    }

    /// 0 when the robot faces its way on, 1 when it turns its back to it.
    fn aside(&self, pose: Pose2) -> f64 {
        const AHEAD_M: f64 = 0.3;
        let (sine, cosine) = sin_cos(pose.heading);
        let ahead = Pose2::new(pose.x + AHEAD_M * cosine, pose.y + AHEAD_M * sine, wrap_angle(pose.heading));
        let gained = self.to_go(pose) - self.to_go(ahead);
        (0.5 - 0.5 * gained / AHEAD_M).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sequence_is_updated_as_by_another_implementation() {
        const ROLLOUTS: usize = 8;
        const COMMANDS: usize = 5;
        let rows = include_str!("mppi/reference.txt").lines().filter(|line| !line.starts_with('#'));
        for row in rows.clone() {
            let mut numbers = row.split(' ').map(|word| word.parse::<f64>().unwrap());
            let mut next = |count: usize| numbers.by_ref().take(count).collect::<Vec<f64>>();
            let scalars = next(3);
            let params = MppiParams {
                temperature: scalars[0],
                sigma_v: scalars[1],
                sigma_omega: scalars[2],
                ..MppiParams::default()
            };
            let twists = |v: Vec<f64>, omega: Vec<f64>| {
                v.into_iter().zip(omega).map(|(v, omega)| Twist { v, omega }).collect::<Vec<Twist>>()
            };
            let nominal = twists(next(COMMANDS), next(COMMANDS));
            let mut costs = next(ROLLOUTS);
            let v = next(ROLLOUTS * COMMANDS);
            let omega = next(ROLLOUTS * COMMANDS);
            for (k, cost) in costs.iter_mut().enumerate() {
                let of = |all: &[f64]| all[k * COMMANDS..(k + 1) * COMMANDS].to_vec();
                let twists = twists(of(&v), of(&omega));
                let pairs = nominal.iter().zip(twists);
                // There, leaving the sequence costs in units of the temperature.
                *cost += params.temperature
                    * pairs.map(|(wanted, twist)| deviation(&params, *wanted, twist)).sum::<f64>();
            }
            let found = weighted_mean(&costs, &v, &omega, params.temperature);
            let expected = twists(next(COMMANDS), next(COMMANDS));
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found.v - expected.v).abs() < 1e-9, "{found:?} {expected:?}");
                assert!((found.omega - expected.omega).abs() < 1e-9, "{found:?} {expected:?}");
            }
            assert_eq!((found.len(), numbers.next()), (COMMANDS, None));
        }
        assert_eq!(rows.count(), 8);
    }
}
