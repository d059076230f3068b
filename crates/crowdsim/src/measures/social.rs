//! The standard measures of social navigation, from the true track of a run.
//!
//! Francis et al., "Principles and Guidelines for Evaluating Social Robot Navigation Algorithms" (2023),
//! Table 1; the zones of HuNavSim (Perez-Higueras et al., 2023); and freezing. Where they leave open what
//! is measured, it is said here.

use std::collections::BTreeMap;
use std::ops::Range;

use curionav_planning::geometry::{Point2, wrap_angle};

use super::overlaps::overlaps;
use super::total;
use crate::outcome::Outcome;
use crate::world::Truth;

/// Length of the windows in which progress is looked for, seconds (Francis et al.).
const PROGRESS_WINDOW_S: f64 = 5.0;
/// A window in which the way to the goal got shorter by less than this is a failure, metres.
const PROGRESS_LEAST_M: f64 = 0.1;
/// Slower than this the robot is stalled, m/s.
const STALLED_SPEED: f64 = 0.05;
/// A stall of this length is a freeze, seconds: longer than letting one person pass takes.
const FREEZE_FOR_S: f64 = 3.0;
/// Personal space of space compliance, metres of gap.
const COMPLIANCE_GAP: f64 = 0.5;
/// Where intimate, personal and social distance end, metres of gap (Hall; HuNavSim's numbers).
const ZONES: [f64; 3] = [0.45, 1.2, 3.6];
/// The robot is stopped when slower than this, m/s and rad/s (HuNavSim).
const STOPPED: [f64; 2] = [0.001, 0.01];

/// What the track is judged against.
pub struct Task<'a> {
    /// How the run ended.
    pub outcome: Outcome,
    /// Length of the shortest way from start to goal, metres: `L*`.
    pub shortest_m: f64,
    /// Length of the shortest way from a point to the goal, metres.
    pub to_go: &'a dyn Fn(Point2) -> f64,
    /// The robot's radius, metres.
    pub robot_radius: f64,
}

/// The social measures of one run by name, from the truth of every tick; yes is 1, no is 0, and what there is none of
/// is left out. Shares are of the rows of the track, 0 to 1; a gap is between bodies, a distance between centres.
pub fn social_measures(rows: &[&Truth], task: &Task<'_>) -> BTreeMap<&'static str, f64> {
    let mut measures = BTreeMap::new();
    measures.extend(success(rows, task));
    measures.extend(motion(rows));
    measures.extend(space(rows, task.robot_radius));
    measures.extend(company(rows));
    measures.extend(overlaps(rows));
    measures.retain(|_, value| value.is_finite());
    measures
}

/// How the run ended, and how well it got on.
fn success(rows: &[&Truth], task: &Task<'_>) -> [(&'static str, f64); 13] {
    let length_m = total(steps(rows).map(|(a, b)| a.pose.position().distance(b.pose.position())));
    let walls = count(rows, |r| r.wall_impact.is_some() || r.wall_clearance < 0.0);
    let humans = count(rows, |r| r.person_clearance < 0.0);
    let success = task.outcome == Outcome::Reached && walls + humans == 0;
    let freezes = freezes(rows);
    [
        // Whether the goal was reached in time without touching anything (Francis et al.: S).
        ("success", f64::from(u8::from(success))),
        // Steps in which a wall stopped the robot or overlapped it (WC).
        ("wall_collision_steps", f64::from(walls)),
        // Steps in contact with another robot (AC): 0 while a scenario has one robot.
        ("agent_collision_steps", 0.0),
        // Steps in contact with a person, whether or not the robot moved (HC).
        ("human_collision_steps", f64::from(humans)),
        // Whether the time limit passed (TO).
        ("timeout", f64::from(u8::from(task.outcome == Outcome::Timeout))),
        // Windows of 5 s, one after the other, in which the shortest way to the goal got shorter by less than
        // 0.1 m (FP).
        ("failures_to_progress", f64::from(failures_to_progress(rows, task.to_go))),
        // Time slower than 0.05 m/s, seconds (ST).
        ("stalled_s", time_with(rows, is_stalled)),
        // Duration, seconds (T).
        ("time_s", time_with(rows, |_| true)),
        // Length of the way driven, metres (PL).
        ("length_m", length_m),
        // Length of the shortest way clear of walls, metres.
        ("shortest_m", task.shortest_m),
        // Success weighted by path length (SPL): 0 without success, else the length of the shortest way clear
        // of walls over the way driven, at most 1.
        ("spl", if success { spl(task.shortest_m, length_m) } else { 0.0 }),
        // Times the robot stood slower than 0.05 m/s for 3 s or longer before the end: it froze.
        ("freezes", freezes.len() as f64),
        // Time in these, seconds.
        ("frozen_s", total(freezes.into_iter())),
    ]
}

/// How the robot moved.
fn motion(rows: &[&Truth]) -> [(&'static str, f64); 12] {
    let speeds: Vec<(f64, f64)> = rows.iter().map(|r| (r.time, r.twist.v)).collect();
    let accelerations = differences(&speeds);
    let jerks = differences(&accelerations);
    // A robot that starts and ends at rest has a mean acceleration of nothing: here magnitudes are averaged.
    let speed = Spread::of(speeds.iter().map(|(_, v)| *v), |v| v);
    let acceleration = Spread::of(accelerations.iter().map(|(_, a)| *a), f64::abs);
    let jerk = Spread::of(jerks.iter().map(|(_, j)| *j), f64::abs);
    let turns = steps(rows).map(|(a, b)| wrap_angle(b.pose.heading - a.pose.heading));
    let turns: Vec<f64> = turns.collect();
    let turned = total(turns.iter().map(|turn| turn.abs()));
    let unneeded = turned - total(turns.into_iter()).abs();
    let driven = total(steps(rows).map(|(a, b)| a.pose.position().distance(b.pose.position())));
    [
        // Least, mean and greatest speed, m/s (V).
        ("speed_min_mps", speed.least),
        ("speed_avg_mps", speed.mean),
        ("speed_max_mps", speed.most),
        // Least, that is hardest braking, mean magnitude and greatest acceleration along the track, m/s2 (A).
        ("accel_min_mps2", acceleration.least),
        ("accel_avg_mps2", acceleration.mean),
        ("accel_max_mps2", acceleration.most),
        // Least, mean magnitude and greatest jerk along the track, m/s3 (J).
        ("jerk_min_mps3", jerk.least),
        ("jerk_avg_mps3", jerk.mean),
        ("jerk_max_mps3", jerk.most),
        // Time slower than 0.001 m/s and 0.01 rad/s, seconds (HuNavSim).
        ("stopped_s", time_with(rows, is_stopped)),
        // Sum of all changes of heading, radians.
        ("heading_change_rad", turned),
        // Turning that is not needed to get from the first heading to the last, per metre driven, rad/m: path
        // irregularity (Guzzi et al., 2013); none if the robot never drove.
        ("path_irregularity_radpm", unneeded / driven),
    ]
}

/// How near it came to walls and people.
fn space(rows: &[&Truth], robot_radius: f64) -> [(&'static str, f64); 10] {
    let clearing = Spread::of(rows.iter().map(|r| r.wall_clearance), |gap| gap);
    let [intimate, personal, social] = ZONES;
    [
        // Least and mean gap to the nearest wall, metres (CD).
        ("clearing_distance_min_m", clearing.least),
        ("clearing_distance_avg_m", clearing.mean),
        // Share of steps with a person's gap under 0.5 m (SC): less is better, as Francis et al. define it; others
        // call the complement by this name.
        ("space_compliance", share_within(rows, f64::NEG_INFINITY..COMPLIANCE_GAP)),
        // Least distance to a person, metres (DH); none when no person was ever there.
        ("human_distance_min_m", least(rows.iter().map(|r| r.person_distance))),
        // Least time to a contact if all go on at constant velocity, seconds (TTC); none when no
        // contact was ever ahead.
        ("time_to_collision_min_s", least(rows.iter().map(|r| r.time_to_collision))),
        // Shares of steps whose closest person's gap is under 0.45 m, under 1.2 m and under 3.6 m (HuNavSim).
        ("intimate_share", share_within(rows, f64::NEG_INFINITY..intimate)),
        ("personal_share", share_within(rows, intimate..personal)),
        ("social_share", share_within(rows, personal..social)),
        // Mean gap to the closest person, metres, overlaps as 0; none when no person was ever there.
        ("closest_person_avg_m", mean(rows.iter().map(|r| r.person_clearance.max(0.0)))),
        // Least distance from the robot's body to a person's centre, metres (HuNavSim's minimum distance).
        ("people_distance_min_m", least(rows.iter().map(|r| r.person_distance - robot_radius))),
    ]
}

/// What it did to people who are together, or on their way.
fn company(rows: &[&Truth]) -> [(&'static str, f64); 4] {
    let entered = steps(rows).filter(|(a, b)| !a.is_in_group && b.is_in_group).count();
    let began_inside = rows.first().is_some_and(|row| row.is_in_group);
    let within = f64::from(count(rows, |row| row.is_in_group)) / rows.len().max(1) as f64;
    [
        // Times the robot came between people who stand or walk together, and the share of steps in which it was there.
        ("group_intrusions", entered as f64 + f64::from(u8::from(began_inside))),
        ("group_intrusion_share", within),
        // Time that all people with routes together lost against walking on at their preferred speed, seconds; and
        // the part of it of those within 3.6 m of the robot.
        ("people_delay_s", total(steps(rows).map(|(a, b)| b.held_up * (b.time - a.time)))),
        ("people_delay_near_s", total(steps(rows).map(|(a, b)| b.held_up_near * (b.time - a.time)))),
    ]
}

fn count(rows: &[&Truth], holds: impl Fn(&Truth) -> bool) -> u32 {
    rows.iter().filter(|row| holds(row)).count() as u32
}

/// The share of the rows whose closest person's gap lies in this range.
fn share_within(rows: &[&Truth], gaps: Range<f64>) -> f64 {
    let within = count(rows, |row| gaps.contains(&row.person_clearance));
    if rows.is_empty() { 0.0 } else { f64::from(within) / rows.len() as f64 }
}

fn is_stalled(row: &Truth) -> bool {
    row.twist.v.abs() < STALLED_SPEED
}

fn is_stopped(row: &Truth) -> bool {
    row.twist.v.abs() < STOPPED[0] && row.twist.omega.abs() < STOPPED[1]
}

/// Extremes and mean of a quantity; all zero without any value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Spread {
    least: f64,
    mean: f64,
    most: f64,
}

impl Spread {
    /// Of these values; the mean is that of what `averaged` makes of them.
    fn of(values: impl ExactSizeIterator<Item = f64> + Clone, averaged: fn(f64) -> f64) -> Self {
        if values.len() == 0 {
            return Self::default();
        }
        Self {
            least: values.clone().fold(f64::INFINITY, f64::min),
            mean: values.clone().map(averaged).sum::<f64>() / values.len() as f64,
            most: values.fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// Rates of change between neighbours of (time, value) rows, each at the later row's time.
fn differences(rows: &[(f64, f64)]) -> Vec<(f64, f64)> {
    rows.windows(2)
        .filter(|pair| pair[1].0 > pair[0].0)
        .map(|pair| (pair[1].0, (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)))
        .collect()
}

fn steps<'a>(rows: &'a [&'a Truth]) -> impl Iterator<Item = (&'a Truth, &'a Truth)> {
    rows.windows(2).map(|pair| (pair[0], pair[1]))
}

/// Time of the rows for which this holds; a row stands for the time since the one before it.
fn time_with(rows: &[&Truth], holds: impl Fn(&Truth) -> bool) -> f64 {
    total(steps(rows).filter(|(_, b)| holds(b)).map(|(a, b)| b.time - a.time))
}

/// The least of those that are finite; infinite if there is none.
fn least(values: impl Iterator<Item = f64>) -> f64 {
    values.filter(|v| v.is_finite()).fold(f64::INFINITY, f64::min)
}

/// The mean of those that are finite; not a number if there is none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.filter(|v| v.is_finite()).fold((0.0, 0_u32), |(sum, n), v| (sum + v, n + 1));
    sum / f64::from(n)
}

fn spl(shortest: f64, driven: f64) -> f64 {
    let longer = driven.max(shortest);
    if longer > 0.0 { shortest / longer } else { 1.0 }
}

/// Half a microsecond for the rounding of times that are multiples of a tick.
const ROUNDING_S: f64 = 5e-7;

fn failures_to_progress(rows: &[&Truth], to_go: &dyn Fn(Point2) -> f64) -> u32 {
    let Some(first) = rows.first() else { return 0 };
    let mut began = first.time;
    let mut before = to_go(first.pose.position());
    let mut failures = 0;
    for row in rows {
        if row.time - began < PROGRESS_WINDOW_S - ROUNDING_S {
            continue;
        }
        let now = to_go(row.pose.position());
        let progress = before - now;
        // From one place without a way to the goal to another is no progress.
        failures += u32::from(progress.is_nan() || progress < PROGRESS_LEAST_M);
        began = row.time;
        before = now;
    }
    failures
}

/// How long each freeze took, seconds: from the first slow row of a stall to its last.
fn freezes(rows: &[&Truth]) -> Vec<f64> {
    rows.chunk_by(|a, b| is_stalled(a) == is_stalled(b))
        .filter(|rows| is_stalled(rows[0]))
        .map(|rows| rows[rows.len() - 1].time - rows[0].time)
        .filter(|length| *length >= FREEZE_FOR_S - ROUNDING_S)
        .collect()
}

#[cfg(test)]
#[path = "social_tests.rs"]
mod tests;
