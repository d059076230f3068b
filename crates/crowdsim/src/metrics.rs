//! The paper's nine measures of a run, collisions and the least gap, summed up tick by tick; the standard
//! social measures are in [`social`].
//!
//! Distances to people are between centres (A28), except the gap. Every row stands for the time since the
//! row before it; the first has none.

mod kinematics;
pub mod social;
pub mod track;

use curionav_planning::geometry::Pose2;
use serde::{Deserialize, Serialize};

use crate::world::Truth;

/// What the measures depend on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MetricsParams {
    /// `Thr_c`: the localiser has converged while the trace of its covariance is at most this, m2 + rad2.
    /// Default 0.1, the threshold that switches CPC on in the shipped planners (A9, A10). Runs are judged by it
    /// whatever the planner's own threshold is.
    pub converged_trace: f64,
    /// The trace must stay converged this long to count, seconds.
    pub converged_for_s: f64,
    /// Another loss of convergence is counted only after the trace fell below this share of `Thr_c`.
    pub rearm_share: f64,
    /// Comfortable distance between centres, metres (A16).
    pub comfort_distance: f64,
    /// A contact counts as a collision when the robot is faster than this, m/s (D11).
    pub collision_speed: f64,
    /// A contact with a wall lasts until the gap exceeds this, metres.
    pub wall_release: f64,
}

impl Default for MetricsParams {
    fn default() -> Self {
        Self {
            converged_trace: 0.1,
            converged_for_s: 1.0,
            rearm_share: 0.8,
            comfort_distance: 1.5,
            collision_speed: 0.05,
            wall_release: 0.02,
        }
    }
}

/// The measures of one run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metrics {
    /// Root mean square of the position error of the estimate, metres.
    pub rmse_m: f64,
    /// Share of the run before the localiser first converged, 0 to 1; 1 when it never did.
    pub tcm: f64,
    /// Times the localiser lost convergence again.
    pub nm: u32,
    /// Share of the run with somebody nearer than the comfortable distance, 0 to 1.
    pub td: f64,
    /// Least distance to a person, metres; none when nobody was ever there.
    pub md_m: Option<f64>,
    /// Times somebody came nearer than the comfortable distance.
    pub nt: u32,
    /// Mean speed, m/s.
    pub vel_mps: f64,
    /// Length of the way driven, metres.
    pub length_m: f64,
    /// Duration, seconds.
    pub time_s: f64,
    /// Contacts with people or walls in which the robot was moving; one for each episode (D11).
    pub collisions: u32,
    /// All contacts, moving or not.
    pub contacts: u32,
    /// Least gap between the robot's body and a wall or a person, metres; negative for an overlap.
    pub clearance_min_m: f64,
    /// What that gap was to.
    pub clearance_min_to: Neighbour,
}

/// What a gap is to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Neighbour {
    /// A wall or unknown space.
    Wall,
    /// A person.
    Person,
}

/// Sums up a run, one row a tick.
#[derive(Debug, Clone)]
pub struct Recorder {
    params: MetricsParams,
    rows: u64,
    first_time: f64,
    last: Option<(f64, Pose2)>,
    squared_error: f64,
    length: f64,
    convergence: Convergence,
    comfort: Comfort,
    contacts: Contacts,
    clearance: (f64, Neighbour),
}

impl Recorder {
    /// A recorder that has seen nothing.
    pub fn new(params: MetricsParams) -> Self {
        Self {
            params,
            rows: 0,
            first_time: 0.0,
            last: None,
            squared_error: 0.0,
            length: 0.0,
            convergence: Convergence::default(),
            comfort: Comfort::default(),
            contacts: Contacts::default(),
            clearance: (f64::INFINITY, Neighbour::Wall),
        }
    }

    /// One tick: the truth, the localiser's mean pose and the trace of its covariance.
    pub fn record(&mut self, truth: &Truth, estimate: Pose2, trace: f64) {
        let here = truth.pose.position();
        let elapsed = match self.last {
            Some((time, pose)) => {
                self.length += pose.position().distance(here);
                truth.time - time
            }
            None => {
                self.first_time = truth.time;
                0.0
            }
        };
        self.rows += 1;
        self.squared_error += estimate.position().distance_squared(here);
        self.convergence.add(&self.params, truth.time, trace);
        self.comfort.add(truth.person_distance, elapsed, self.params.comfort_distance);
        self.contacts.add(&self.params, truth);
        for (gap, to) in
            [(truth.wall_clearance, Neighbour::Wall), (truth.person_clearance, Neighbour::Person)]
        {
            if gap < self.clearance.0 {
                self.clearance = (gap, to);
            }
        }
        self.last = Some((truth.time, truth.pose));
    }

    /// The measures so far.
    pub fn metrics(&self) -> Metrics {
        let last_time = self.last.map_or(self.first_time, |(time, _)| time);
        let time = last_time - self.first_time;
        let share = |part: f64| if time > 0.0 { part / time } else { 0.0 };
        let converged = self.convergence.since.map_or(time, |t| t - self.first_time);
        Metrics {
            rmse_m: if self.rows > 0 { (self.squared_error / self.rows as f64).sqrt() } else { 0.0 },
            tcm: if self.convergence.since.is_some() { share(converged) } else { 1.0 },
            nm: self.convergence.losses,
            td: share(self.comfort.time_near),
            md_m: self.comfort.least.filter(|d| d.is_finite()),
            nt: self.comfort.intrusions,
            vel_mps: share(self.length),
            length_m: self.length,
            time_s: time,
            collisions: self.contacts.collisions,
            contacts: self.contacts.total,
            clearance_min_m: self.clearance.0,
            clearance_min_to: self.clearance.1,
        }
    }
}

/// TCM and NM.
#[derive(Debug, Clone, Default)]
struct Convergence {
    /// When the trace fell to the threshold for good (or is on trial since).
    since: Option<f64>,
    /// Whether it has stayed there long enough.
    certain: bool,
    losses: u32,
    lost: bool,
}

impl Convergence {
    fn add(&mut self, params: &MetricsParams, time: f64, trace: f64) {
        let low = trace <= params.converged_trace;
        if !self.certain {
            self.since = if low { self.since.or(Some(time)) } else { None };
            // Half a microsecond for the rounding of times that are multiples of a tick.
            self.certain = self.since.is_some_and(|t| time - t >= params.converged_for_s - 5e-7);
            return;
        }
        if !low && !self.lost {
            self.losses += 1;
            self.lost = true;
        }
        if trace < params.rearm_share * params.converged_trace {
            self.lost = false;
        }
    }
}

/// TD, MD and NT.
#[derive(Debug, Clone, Default)]
struct Comfort {
    time_near: f64,
    least: Option<f64>,
    intrusions: u32,
    near: Option<bool>,
}

impl Comfort {
    fn add(&mut self, distance: f64, elapsed: f64, comfortable: f64) {
        let near = distance < comfortable;
        if near {
            self.time_near += elapsed;
        }
        // Somebody near from the first row on has not come near.
        if near && self.near == Some(false) {
            self.intrusions += 1;
        }
        self.near = Some(near);
        self.least = Some(self.least.map_or(distance, |least| least.min(distance)));
    }
}

/// Contacts, each an episode with one person or with walls.
#[derive(Debug, Clone, Default)]
struct Contacts {
    /// Person and whether the episode has been counted as a collision; ascending ids.
    people: Vec<(u32, bool)>,
    wall: Option<bool>,
    collisions: u32,
    total: u32,
}

impl Contacts {
    fn add(&mut self, params: &MetricsParams, truth: &Truth) {
        let moving = truth.twist.v > params.collision_speed;
        let before = std::mem::take(&mut self.people);
        for &id in &truth.touching {
            let counted = before.iter().find(|(known, _)| *known == id).map(|(_, counted)| *counted);
            let now = self.count(counted, moving);
            self.people.push((id, now));
        }
        let hit = truth.wall_impact.is_some_and(|speed| speed > params.collision_speed);
        let lasts = self.wall.is_some() && truth.wall_clearance <= params.wall_release;
        self.wall = (truth.wall_impact.is_some() || lasts).then(|| self.count(self.wall, hit));
    }

    /// One tick of an episode: `counted` is none when it begins, else whether it is a collision already.
    fn count(&mut self, counted: Option<bool>, moving: bool) -> bool {
        self.total += u32::from(counted.is_none());
        let was = counted.unwrap_or(false);
        self.collisions += u32::from(moving && !was);
        was || moving
    }
}

#[cfg(test)]
mod tests;
