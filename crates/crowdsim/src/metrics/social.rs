//! The standard measures of social navigation, from the true track of a run.
//!
//! Francis et al., "Principles and Guidelines for Evaluating Social Robot Navigation Algorithms" (2023),
//! Table 1; the zones of HuNavSim (Perez-Higueras et al., 2023); and freezing. Where they leave open what
//! is measured, it is said here.

use curionav_planning::geometry::{Point2, wrap_angle};
use serde::{Deserialize, Serialize};

use super::kinematics::{Spread, differences};
use super::track::{Track, TrackRow};
use crate::outcome::Outcome;

/// What the social measures depend on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SocialParams {
    /// Length of the windows in which progress is looked for, seconds (Francis et al.).
    pub progress_window_s: f64,
    /// A window in which the way to the goal got shorter by less than this is a failure, metres.
    pub progress_least_m: f64,
    /// Slower than this the robot is stalled, m/s.
    pub stalled_speed: f64,
    /// A stall of this length is a freeze, seconds: longer than letting one person pass takes.
    pub freeze_for_s: f64,
    /// Personal space of space compliance, metres of gap.
    pub compliance_gap: f64,
    /// Where intimate, personal and social distance end, metres of gap (Hall; HuNavSim's numbers).
    pub zones: [f64; 3],
    /// The robot is stopped when slower than this, m/s and rad/s (HuNavSim).
    pub stopped: [f64; 2],
}

impl Default for SocialParams {
    fn default() -> Self {
        Self {
            progress_window_s: 5.0,
            progress_least_m: 0.1,
            stalled_speed: 0.05,
            freeze_for_s: 3.0,
            compliance_gap: 0.5,
            zones: [0.45, 1.2, 3.6],
            stopped: [0.001, 0.01],
        }
    }
}

/// The social measures of one run. Shares are of the rows of the track, 0 to 1; a gap is between bodies,
/// a distance between centres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SocialMetrics {
    /// Whether the goal was reached in time without touching anything (Francis et al.: S).
    pub success: bool,
    /// Steps in which a wall stopped the robot or overlapped it (WC).
    pub wall_collision_steps: u32,
    /// Steps in contact with another robot (AC): 0 while a scenario has one robot.
    pub agent_collision_steps: u32,
    /// Steps in contact with a person, whoever moved (HC).
    pub human_collision_steps: u32,
    /// Whether the time limit passed (TO).
    pub timeout: bool,
    /// Windows of 5 s, one after the other, in which the shortest way to the goal got shorter by less than
    /// 0.1 m (FP).
    pub failures_to_progress: u32,
    /// Time slower than 0.05 m/s, seconds (ST).
    pub stalled_s: f64,
    /// Duration, seconds (T).
    pub time_s: f64,
    /// Length of the way driven, metres (PL).
    pub length_m: f64,
    /// Success weighted by path length (SPL): 0 without success, else the length of the shortest way clear
    /// of walls over the way driven, at most 1.
    pub spl: f64,
    /// Least, mean and greatest speed, m/s (V).
    pub speed_min_mps: f64,
    /// See [`Self::speed_min_mps`].
    pub speed_avg_mps: f64,
    /// See [`Self::speed_min_mps`].
    pub speed_max_mps: f64,
    /// Least, that is hardest braking, mean magnitude and greatest acceleration along the track, m/s2 (A).
    pub accel_min_mps2: f64,
    /// See [`Self::accel_min_mps2`].
    pub accel_avg_mps2: f64,
    /// See [`Self::accel_min_mps2`].
    pub accel_max_mps2: f64,
    /// Least, mean magnitude and greatest jerk along the track, m/s3 (J).
    pub jerk_min_mps3: f64,
    /// See [`Self::jerk_min_mps3`].
    pub jerk_avg_mps3: f64,
    /// See [`Self::jerk_min_mps3`].
    pub jerk_max_mps3: f64,
    /// Least gap to a wall, metres (CD).
    pub clearing_distance_min_m: f64,
    /// Mean gap to the nearest wall, metres (CD).
    pub clearing_distance_avg_m: f64,
    /// Share of steps with a person's gap under 0.5 m (SC): less is better, as Francis et al. define it; others
    /// call the complement by this name.
    pub space_compliance: f64,
    /// Least distance to a person, metres (DH); none when nobody was ever there.
    pub human_distance_min_m: Option<f64>,
    /// Least time to a contact if everybody goes on at constant velocity, seconds (TTC); none when no
    /// contact was ever ahead.
    pub time_to_collision_min_s: Option<f64>,
    /// Share of steps whose closest person's gap is under 0.45 m (HuNavSim).
    pub intimate_share: f64,
    /// Share with it from 0.45 m to 1.2 m.
    pub personal_share: f64,
    /// Share with it from 1.2 m to 3.6 m.
    pub social_share: f64,
    /// Time slower than 0.001 m/s and 0.01 rad/s, seconds (HuNavSim).
    pub stopped_s: f64,
    /// Sum of all changes of heading, radians.
    pub heading_change_rad: f64,
    /// Mean gap to the closest person, metres, overlaps as 0; none when nobody was ever there.
    pub closest_person_avg_m: Option<f64>,
    /// Least distance from the robot's body to a person's centre, metres (HuNavSim's minimum distance).
    pub people_distance_min_m: Option<f64>,
    /// Times the robot stood slower than 0.05 m/s for 3 s or longer before the end: it froze.
    pub freezes: u32,
    /// Time in these, seconds.
    pub frozen_s: f64,
}

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

impl SocialMetrics {
    /// The measures of a whole run.
    pub fn of(track: &Track, task: &Task<'_>, params: &SocialParams) -> Self {
        let rows = track.rows();
        let length_m = total(steps(rows).map(|(a, b)| a.pose.position().distance(b.pose.position())));
        let speeds: Vec<(f64, f64)> = rows.iter().map(|r| (r.time, r.twist.v)).collect();
        let accelerations = differences(&speeds);
        let jerks = differences(&accelerations);
        let speed = Spread::signed(&speeds);
        let (acceleration, jerk) = (Spread::of_changes(&accelerations), Spread::of_changes(&jerks));
        let wall_gaps: Vec<(f64, f64)> = rows.iter().map(|r| (r.time, r.wall_gap)).collect();
        let clearing = Spread::signed(&wall_gaps);
        let count = |holds: &dyn Fn(&TrackRow) -> bool| rows.iter().filter(|r| holds(r)).count() as u32;
        let share = |from: f64, to: f64| {
            let within = count(&|r| r.person_gap >= from && r.person_gap < to);
            if rows.is_empty() { 0.0 } else { f64::from(within) / rows.len() as f64 }
        };
        let walls = count(&|r| r.hit_wall || r.wall_gap < 0.0);
        let humans = count(&|r| r.person_gap < 0.0);
        let success = task.outcome == Outcome::Reached && walls + humans == 0;
        let [intimate, personal, social] = params.zones;
        let (freezes, frozen_s) = freezing(rows, params);
        let [stopped_v, stopped_omega] = params.stopped;
        Self {
            success,
            wall_collision_steps: walls,
            agent_collision_steps: 0,
            human_collision_steps: humans,
            timeout: task.outcome == Outcome::Timeout,
            failures_to_progress: failures_to_progress(rows, task.to_go, params),
            stalled_s: time_with(rows, |r| r.twist.v.abs() < params.stalled_speed),
            time_s: time_with(rows, |_| true),
            length_m,
            spl: if success { spl(task.shortest_m, length_m) } else { 0.0 },
            speed_min_mps: speed.least,
            speed_avg_mps: speed.mean,
            speed_max_mps: speed.most,
            accel_min_mps2: acceleration.least,
            accel_avg_mps2: acceleration.mean,
            accel_max_mps2: acceleration.most,
            jerk_min_mps3: jerk.least,
            jerk_avg_mps3: jerk.mean,
            jerk_max_mps3: jerk.most,
            clearing_distance_min_m: clearing.least,
            clearing_distance_avg_m: clearing.mean,
            space_compliance: share(f64::NEG_INFINITY, params.compliance_gap),
            human_distance_min_m: least(rows.iter().map(|r| r.person_distance)),
            time_to_collision_min_s: least(rows.iter().map(|r| r.time_to_collision)),
            intimate_share: share(f64::NEG_INFINITY, intimate),
            personal_share: share(intimate, personal),
            social_share: share(personal, social),
            stopped_s: time_with(rows, |r| {
                r.twist.v.abs() < stopped_v && r.twist.omega.abs() < stopped_omega
            }),
            heading_change_rad: total(
                steps(rows).map(|(a, b)| wrap_angle(b.pose.heading - a.pose.heading).abs()),
            ),
            closest_person_avg_m: mean(rows.iter().map(|r| r.person_gap.max(0.0))),
            people_distance_min_m: least(rows.iter().map(|r| r.person_distance - task.robot_radius)),
            freezes,
            frozen_s,
        }
    }
}

fn steps(rows: &[TrackRow]) -> impl Iterator<Item = (&TrackRow, &TrackRow)> {
    rows.windows(2).map(|pair| (&pair[0], &pair[1]))
}

/// Time of the rows for which this holds; a row stands for the time since the one before it.
fn time_with(rows: &[TrackRow], holds: impl Fn(&TrackRow) -> bool) -> f64 {
    total(steps(rows).filter(|(_, b)| holds(b)).map(|(a, b)| b.time - a.time))
}

/// The sum; of nothing it is 0 and not the -0 that `sum` gives.
fn total(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |sum, value| sum + value)
}

/// The least of those that are finite.
fn least(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.filter(|v| v.is_finite()).min_by(f64::total_cmp)
}

/// The mean of those that are finite.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.filter(|v| v.is_finite()).fold((0.0, 0_u32), |(sum, n), v| (sum + v, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}

fn spl(shortest: f64, driven: f64) -> f64 {
    let longer = driven.max(shortest);
    if longer > 0.0 { shortest / longer } else { 1.0 }
}

/// Half a microsecond for the rounding of times that are multiples of a tick.
const ROUNDING_S: f64 = 5e-7;

fn failures_to_progress(rows: &[TrackRow], to_go: &dyn Fn(Point2) -> f64, params: &SocialParams) -> u32 {
    let Some(first) = rows.first() else { return 0 };
    let (mut began, mut before) = (first.time, to_go(first.pose.position()));
    let mut failures = 0;
    for row in rows {
        if row.time - began < params.progress_window_s - ROUNDING_S {
            continue;
        }
        let now = to_go(row.pose.position());
        let progress = before - now;
        // From one place without a way to the goal to another is no progress.
        failures += u32::from(progress.is_nan() || progress < params.progress_least_m);
        (began, before) = (row.time, now);
    }
    failures
}

/// Number of freezes and the time in them. A stall lasts from its first slow row to its last.
fn freezing(rows: &[TrackRow], params: &SocialParams) -> (u32, f64) {
    let (mut freezes, mut frozen) = (0, 0.0);
    let mut since: Option<f64> = None;
    let mut close = |since: Option<f64>, until: f64| {
        if let Some(length) = since.map(|s| until - s).filter(|l| *l >= params.freeze_for_s - ROUNDING_S) {
            freezes += 1;
            frozen += length;
        }
    };
    let mut last = 0.0;
    for row in rows {
        if row.twist.v.abs() < params.stalled_speed {
            since = since.or(Some(row.time));
        } else {
            close(since.take(), last);
        }
        last = row.time;
    }
    close(since, last);
    (freezes, frozen)
}

#[cfg(test)]
#[path = "social_tests.rs"]
mod tests;
