//! What a run leaves behind: measures, the decisions' digest, and the trace for pictures and files.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use curionav_crowdsim::measures::social::{Task, social_measures};
use curionav_crowdsim::measures::{Measures, Row};
use curionav_crowdsim::outcome::Outcome;
use curionav_crowdsim::{Truth, World};
use curionav_mission::fields::Fields;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::GeodesicField;
use curionav_schemas::limits::{MAX_CONTACTS, MAX_MAGNITUDE, MAX_PEOPLE, MAX_TRACE_ROWS};
use curionav_schemas::{self as wire, Belief, Contact, Decision, PeopleTrace, Reject, RunResult, Trace};
use sha2::{Digest, Sha256};

use crate::cycle_record::CycleRecord;

/// Columns of the trace, one row per tick.
const COLUMNS: usize = 17;
/// Most bytes of a trace, so that the result which holds it can be sent.
const TRACE_BYTES_MAX: usize = 30 * 1024 * 1024;
/// Stands for an infinite distance in trace and measures, metres: numbers on the wire are finite.
const FAR_AWAY: f64 = 1e3;

/// Collects one run.
pub(crate) struct Record {
    measured: Vec<Row>,
    digest: Sha256,
    cycles: CycleRecord,
    columns: [&'static str; COLUMNS],
    rows: Vec<[f64; COLUMNS]>,
    people: Vec<Vec<(u32, f32, f32)>>,
    started: Instant,
}

impl Record {
    /// Nothing yet, of a mission planned every `plan_every` ticks.
    pub(crate) fn new(plan_every: u32) -> Self {
        Self {
            measured: Vec::new(),
            digest: Sha256::new(),
            cycles: CycleRecord::new(plan_every),
            columns: [""; COLUMNS],
            rows: Vec::new(),
            people: Vec::new(),
            started: Instant::now(),
        }
    }

    /// One decision, which came while the world was at `tick`: its scene's stamp and what was chosen go into the
    /// digest, wall times and epochs do not.
    pub(crate) fn decision(&mut self, decision: &Decision, tick: u64) {
        self.digest.update(decision.stamp.to_le_bytes());
        self.digest.update([decision.action as u8]);
        for array in [&decision.x, &decision.y, &decision.heading, &decision.v, &decision.omega] {
            for number in array.iter() {
                self.digest.update(number.to_le_bytes());
            }
        }
        self.cycles.decided(decision, tick);
    }

    /// One tick.
    pub(crate) fn tick(&mut self, truth: Truth, belief: &Belief, world: &World) {
        let people = world.people();
        let c = &belief.covariance;
        let row = [
            ("time_s", truth.time),
            ("true_x", truth.pose.x),
            ("true_y", truth.pose.y),
            ("true_heading", truth.pose.heading),
            ("belief_x", belief.x),
            ("belief_y", belief.y),
            ("belief_heading", belief.heading),
            ("cov_xx", c[0]),
            ("cov_xy", c[1]),
            ("cov_yy", c[4]),
            ("cov_hh", c[8]),
            ("v", truth.twist.v),
            ("omega", truth.twist.omega),
            ("person_distance", truth.person_distance.min(FAR_AWAY)),
            ("person_clearance", truth.person_clearance.min(FAR_AWAY)),
            ("wall_clearance", truth.wall_clearance.min(FAR_AWAY)),
            ("outside_weight", belief.health.outside_weight),
        ];
        self.columns = row.map(|(column, _)| column);
        self.rows.push(row.map(|(_, value)| value));
        let estimate = Pose2::new(belief.x, belief.y, belief.heading);
        self.measured.push(Row { truth, estimate, trace: c[0] + c[4] + c[8] });
        self.people.push(
            (0..people.len()).map(|i| (people.id[i], people.x[i] as f32, people.y[i] as f32)).collect(),
        );
    }

    /// The result, at the end of a run to `goal`.
    pub(crate) fn finish(
        self,
        world: &World,
        planner: &str,
        seed: u64,
        outcome: Outcome,
        goal: Point2,
        fields: &Fields,
    ) -> Result<RunResult, Reject> {
        // The robot's own time ends here.
        let wall = self.started.elapsed().as_secs_f64();
        let radius = world.scenario().robot.model.radius();
        let way = fields.way(world.map(), goal, radius)?;
        let measured = Measures::of(&self.measured);
        Ok(RunResult {
            scenario: world.scenario().name.clone(),
            planner: planner.to_owned(),
            seed,
            outcome: match outcome {
                Outcome::Reached => wire::Outcome::Reached,
                Outcome::Timeout => wire::Outcome::Timeout,
                Outcome::Lost => wire::Outcome::Lost,
                Outcome::NoWay => wire::Outcome::NoWay,
            },
            contacts: contacts(&measured),
            measures: measures(&measured),
            social: social(&self.measured, outcome, goal, &way, radius),
            cycles: self.cycles.finish(world.tick()),
            real_time_factor: world.time() / wall.max(1e-9),
            decisions_sha256: wire::hex(&self.digest.finalize()),
            trace: trace(self.columns, &self.rows, &self.people),
        })
    }
}

/// The rows as they are sent: all of them, or as many as a message holds, evenly spaced up to the last one.
fn trace(
    columns: [&'static str; COLUMNS],
    rows: &[[f64; COLUMNS]],
    people: &[Vec<(u32, f32, f32)>],
) -> Trace {
    let ids: BTreeSet<u32> = people.iter().flatten().map(|person| person.0).collect();
    let has_people = ids.len() <= MAX_PEOPLE;
    if !has_people {
        tracing::warn!(people = ids.len(), "too many people for one result: their ways are left out");
    }
    let row_bytes = COLUMNS * size_of::<f64>() + if has_people { 9 * ids.len() } else { 0 };
    let stride = rows.len().div_ceil((TRACE_BYTES_MAX / row_bytes).min(MAX_TRACE_ROWS)).max(1);
    if stride > 1 {
        tracing::warn!(stride, "the run is too long for one result: the trace has one tick in so many");
    }
    let kept: Vec<usize> = (0..rows.len()).filter(|i| (rows.len() - 1 - i).is_multiple_of(stride)).collect();
    let people: Vec<_> = kept.iter().filter(|_| has_people).map(|i| people[*i].as_slice()).collect();
    Trace {
        rows: kept.len() as u32,
        columns: columns.map(String::from).to_vec(),
        values: kept.iter().flat_map(|i| rows[*i]).collect(),
        people: people_trace(&people, if has_people { ids } else { BTreeSet::new() }),
    }
}

fn measures(m: &Measures) -> wire::Measures {
    wire::Measures {
        rmse_m: m.rmse_m,
        tcm: m.tcm,
        nm: m.nm,
        tce_s: m.tce_s,
        td: m.td,
        md_m: m.md_m,
        td_in_view: Some(m.td_in_view),
        md_in_view_m: m.md_in_view_m,
        nt: m.nt,
        vel_mps: m.vel_mps,
        length_m: m.length_m,
        time_s: m.time_s,
        collisions: m.collisions.len() as u32,
        clearance_min_m: m.clearance_min_m.min(FAR_AWAY),
    }
}

/// The collisions as they are sent.
fn contacts(m: &Measures) -> Vec<Contact> {
    let contacts = m.collisions.iter().take(MAX_CONTACTS).map(|c| Contact {
        time_s: c.time,
        person: c.person,
        robot_mps: c.robot_speed,
        person_mps: c.person_speed,
    });
    contacts.collect()
}

/// Spacing of the shortest way whose length is measured, metres.
const WAY_SPACING: f64 = 0.1;

/// The measures of social navigation by name.
fn social(
    rows: &[Row],
    outcome: Outcome,
    goal: Point2,
    to_goal: &GeodesicField,
    robot_radius: f64,
) -> BTreeMap<String, f64> {
    let start = rows.first().map_or(goal, |row| row.truth.pose.position());
    let way = to_goal.descend(start, WAY_SPACING);
    let driven: f64 = way.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let rest = way.last().map_or(0.0, |end| end.distance(goal));
    let task = Task { outcome, shortest_m: driven + rest, to_go: &|p| to_goal.at(p), robot_radius };
    let truth: Vec<&Truth> = rows.iter().map(|row| &row.truth).collect();
    let measures = social_measures(&truth, &task).into_iter();
    let sendable = measures.filter(|(_, value)| value.abs() < MAX_MAGNITUDE);
    sendable.map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Rows of (id, x, y) as a rectangle with a presence mask, one column per entry of `ids`.
fn people_trace(rows: &[&[(u32, f32, f32)]], ids: BTreeSet<u32>) -> PeopleTrace {
    let ids: BTreeMap<u32, usize> = ids.into_iter().enumerate().map(|(i, id)| (id, i)).collect();
    let mut xy = vec![0.0_f32; rows.len() * ids.len() * 2];
    let mut present = vec![0_u8; rows.len() * ids.len()];
    for (row, people) in rows.iter().enumerate() {
        for (id, x, y) in *people {
            let at = row * ids.len() + ids[id];
            present[at] = 1;
            xy[2 * at] = *x;
            xy[2 * at + 1] = *y;
        }
    }
    PeopleTrace {
        rows: rows.len() as u32,
        id: ids.into_keys().collect(),
        xy: xy.into(),
        present: present.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of_run(rows: usize, people: u32) -> Trace {
        let present: Vec<_> = (0..people).map(|id| (id, 1.0, 2.0)).collect();
        let rows: Vec<_> = (0..rows).map(|i| [i as f64; COLUMNS]).collect();
        trace(["column"; COLUMNS], &rows, &vec![present; rows.len()])
    }

    #[test]
    fn a_long_run_is_thinned_until_it_can_be_sent() {
        for (rows, people, stride) in [(100, 100, 1), (40_000, 100, 2), (864_000, 0, 4)] {
            let trace = of_run(rows, people);
            assert_eq!(trace.rows as usize, rows.div_ceil(stride), "{rows} rows");
            assert_eq!(trace.values.last(), Some(&(rows as f64 - 1.0)));
            let numbers = 8 * trace.values.len() + 4 * trace.people.xy.len() + trace.people.present.len();
            assert!(numbers <= TRACE_BYTES_MAX, "{numbers} bytes");
        }
    }

    #[test]
    fn more_people_than_a_result_holds_are_left_out() {
        let trace = of_run(3, MAX_PEOPLE as u32 + 1);
        assert_eq!((trace.rows, trace.people.rows, trace.people.id.len()), (3, 0, 0));
    }
}
