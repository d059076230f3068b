//! Examples of maps, of what a simulated world is asked and tells, and of a service's status.

use super::{MAP, ZONED_MAP, parameters};
use curionav_schemas::{
    Clock, Contact, Cycles, InjectRequest, Measures, OccupancyGrid, Outcome, PeopleTrace, Pose, Prepared,
    RunResult, RunState, RunStatus, ServiceStatus, Trace,
};
use serde_bytes::ByteBuf;
use std::collections::BTreeMap;

/// A map of 4 x 3 cells, named by the hash of its content.
pub fn occupancy_grid() -> OccupancyGrid {
    OccupancyGrid {
        width: 4,
        height: 3,
        resolution: 0.05,
        origin: Pose { x: -1.0, y: 2.5, heading: 0.0 },
        cells: vec![0, 0, 100, -1, 0, 0, 0, 100, 100, 0, 0, 0].into(),
        limits: None,
        map: MAP,
    }
}

/// The same map with two cells of keepout and three in which a robot is slow.
pub fn zoned_occupancy_grid() -> OccupancyGrid {
    let limits = vec![100, 100, 100, 100, 0, 0, 30, 30, 100, 100, 30, 100];
    OccupancyGrid { limits: Some(limits.into()), map: ZONED_MAP, ..occupancy_grid() }
}

/// A scenario with its map.
pub fn inject_request() -> InjectRequest {
    InjectRequest {
        scenario: parameters(&[("name", "two-people".into()), ("map", "maps/tiny.pgm".into())]),
        files: BTreeMap::from([("maps/tiny.pgm".into(), ByteBuf::from(*b"P5 2 1 255\n\x00\xff"))]),
        profile: parameters(&[("name", "paper".into())]),
        seed: Some(17),
        clock: Clock::Realtime,
        time_scale: 2.0,
    }
}

/// A finished run.
pub fn run_status() -> RunStatus {
    RunStatus {
        run: 1,
        world: "w1".into(),
        state: RunState::Finished,
        tick: 250,
        time_s: 25.0,
        distance_to_goal: 0.28,
        error: None,
        result: Some(run_result()),
    }
}

/// A result with a trace of two rows and two people; one of them comes late.
pub fn run_result() -> RunResult {
    RunResult {
        scenario: "two-people".into(),
        planner: "paper".into(),
        seed: 17,
        outcome: Outcome::Reached,
        measures: Measures {
            rmse_m: 0.12,
            tcm: 0.05,
            nm: Some(1),
            tce_s: Some(1.5),
            td: 0.02,
            md_m: Some(1.3),
            td_in_view: Some(0.01),
            md_in_view_m: Some(1.4),
            nt: 2,
            vel_mps: 0.76,
            length_m: 19.1,
            time_s: 25.0,
            collisions: 0,
            clearance_min_m: 0.4,
        },
        contacts: vec![
            Contact { time_s: 3.5, person: Some(7), robot_mps: -0.25, person_mps: 1.25 },
            Contact { time_s: 9.0, person: None, robot_mps: 0.5, person_mps: 0.0 },
        ],
        social: BTreeMap::from([("spl".into(), 0.93), ("personal_share".into(), 0.25)]),
        cycles: Cycles {
            count: 83,
            skipped: 2,
            late: 1,
            first_choice: 70,
            other_choice: BTreeMap::from([("least_cost_free".into(), 10), ("none_free".into(), 3)]),
            degraded: 1,
            degraded_by: BTreeMap::from([("cut_short".into(), 1), ("evaluated_locally".into(), 1)]),
            p50_ms: 8.5,
            p99_ms: 21.0,
            max_ms: 30.5,
        },
        real_time_factor: 24.0,
        decisions_sha256: "00112233445566778899aabbccddeeff".repeat(2),
        trace: Trace {
            rows: 2,
            columns: vec!["time_s".into(), "x".into(), "y".into()],
            values: vec![0.0, 0.5, -0.5, 0.1, 0.58, -0.49].into(),
            people: PeopleTrace {
                rows: 2,
                id: vec![7, 11].into(),
                xy: vec![3.0, 1.0, 0.0, 0.0, 2.95, 1.01, 4.1, -0.7].into(),
                present: vec![1, 0, 1, 1].into(),
            },
        },
    }
}

/// A busy evaluator.
pub fn service_status() -> ServiceStatus {
    ServiceStatus {
        role: "cpc".into(),
        instance: "cpc-1".into(),
        robot: Some("r1".into()),
        version: "0.1.0".into(),
        uptime_s: 3600.5,
        time_s: 1_700_000_000.25,
        load: 0.35,
        requests: 12_001,
        rejected: 2,
        p50_ms: 1.2,
        p99_ms: 4.75,
        prepared: vec![
            Prepared::Map { map: MAP },
            Prepared::Sensor { map: MAP, beams: 181, fov: 3.125, range_max: 5.0 },
        ],
        metrics: BTreeMap::from([
            ("curionav_requests_total{role=\"cpc\",name=\"cpc-1\"}".into(), 12_001.0),
            ("curionav_refused_total{role=\"cpc\",name=\"cpc-1\",reason=\"overloaded\"}".into(), 2.0),
        ]),
    }
}
