//! One fixed example of every message, so that all readers and writers can be held to the same bytes.
//!
//! `schemas/golden/` holds [`all`] encoded; `cargo run --release -p curionav-testing --example golden` writes it anew.
//! The bytes may only change together with the contract.

mod files;
mod planning;
pub mod sentences;
mod world;

pub use files::{Golden, all, files};
pub use planning::{
    candidate_set, cut_generate_reply, cycle_report, decision, evaluate_request,
    evaluate_request_of_positions, explained_cycle_report, generate_reply, generate_request, memory, scores,
    stop, tree, tree_of_two_roots, twist,
};
pub use world::{
    inject_request, occupancy_grid, run_result, run_status, service_status, zoned_occupancy_grid,
};

use curionav_schemas::{
    Belief, Clock, Confidence, Footprint, Frame, Health, LaserModel, Lease, LeaseRequest, LeaseWish, MapId,
    Mission, MissionEnd, MissionOrder, MissionState, Odometry, OdometryNoise, Particles, PauseReply, People,
    Pose, Readiness, Refusal, Reject, RobotModel, Scan, Scene, Value,
};

const MAP: MapId = MapId(
    *b"\x1c\xb8\x56\x12\x80\xd7\xa2\xb9\x63\xee\x89\x2a\x88\x08\xf6\x82\
                           \xd4\xb8\xc8\x71\xfc\x5e\x3e\x16\x12\x4d\x47\xb7\x7d\x02\xa9\x71",
);

const ZONED_MAP: MapId = MapId(
    *b"\xc6\xf0\x4b\x4e\x92\xfa\xfd\x30\x03\x2e\xcb\x96\x29\x96\xfc\xa0\
                           \xea\x92\x3e\x60\x1e\x03\x71\xc4\xe4\x50\x5c\x0c\xaa\x16\xe1\x2e",
);

fn parameters(entries: &[(&str, Value)]) -> Value {
    Value::Map(entries.iter().map(|(key, value)| (Value::from(*key), value.clone())).collect())
}

/// A lease that another driver would like to have.
pub fn lease() -> Lease {
    Lease { lease: 17, holder: Some("driver-a".into()), wanted_by: Some("driver-b".into()), paused: true }
}

/// The wish of that other driver.
pub fn lease_request() -> LeaseRequest {
    LeaseRequest { driver: "driver-b".into(), lease: 0, wish: LeaseWish::TakeOver, paused: false }
}

/// The answer of the driver that holds the lease to a pause.
pub fn pause_reply() -> PauseReply {
    PauseReply { role: "driver".into(), instance: "driver-a".into(), lease: 17, paused: true }
}

/// Half a turn seen by five beams.
pub fn scan() -> Scan {
    Scan {
        tick: 42,
        stamp: 4.2,
        angle_min: -1.5,
        angle_increment: 0.75,
        range_min: None,
        range_max: 5.0,
        laser: Pose { x: 0.1, y: 0.0, heading: 0.0 },
        ranges: vec![5.0, 2.5, 1.1, 2.5, 5.0].into(),
    }
}

/// Half a turn seen by as many beams as the mission's laser has, all of this range, metres.
pub fn dense_scan(range: f64) -> Scan {
    let angle_increment = std::f64::consts::PI / 180.0;
    Scan {
        angle_min: -90.0 * angle_increment,
        angle_increment,
        ranges: vec![range as f32; 181].into(),
        ..scan()
    }
}

/// A scan of which two beams say nothing, and one that something is too near to be measured.
pub fn spotty_scan() -> Scan {
    Scan { range_min: Some(0.25), ranges: vec![5.0, f32::NAN, 0.125, 0.0, 2.5].into(), ..scan() }
}

/// A robot on its way.
pub fn odometry() -> Odometry {
    Odometry { tick: 42, stamp: 4.2, x: 1.25, y: -0.5, heading: 0.3, v: 0.8, omega: -0.1 }
}

/// Two people in the map frame.
pub fn people() -> People {
    People {
        tick: 42,
        stamp: 4.2,
        frame: Frame::Map,
        radius: 0.3,
        id: vec![7, 11].into(),
        x: vec![3.0, 4.1].into(),
        y: vec![1.0, -0.7].into(),
        vx: vec![-0.5, 0.0].into(),
        vy: vec![0.1, 0.0].into(),
        position_covariance: None,
        velocity_covariance: None,
        age: None,
        probability: None,
    }
}

/// The same as a tracker on the robot sees them; one is hidden.
pub fn tracked_people() -> People {
    People {
        frame: Frame::Robot,
        position_covariance: Some(vec![0.01, 0.002, 0.02, 0.09, -0.01, 0.16].into()),
        velocity_covariance: Some(vec![0.04, 0.0, 0.05, 0.2, 0.01, 0.25].into()),
        age: Some(vec![0.0, 0.5].into()),
        probability: Some(vec![1.0, 0.75].into()),
        ..people()
    }
}

/// A converged belief.
pub fn belief() -> Belief {
    Belief {
        tick: 42,
        stamp: 4.2,
        x: 1.3,
        y: -0.45,
        heading: 0.31,
        covariance: vec![0.04, 0.001, 0.0, 0.001, 0.05, 0.0, 0.0, 0.0, 0.01].into(),
        v: 0.8,
        omega: -0.1,
        health: Health { outside_weight: 0.02, scan_fit: 0.9, particles: 512, confidence: Confidence::Sure },
    }
}

/// Three of the poses behind it.
pub fn particles() -> Particles {
    Particles {
        tick: 42,
        stamp: 4.2,
        x: vec![1.25, 1.375, 4.5].into(),
        y: vec![-0.5, -0.375, 2.0].into(),
        heading: vec![0.3125, 0.25, -3.0].into(),
        weight: vec![0.5, 0.375, 0.125].into(),
    }
}

/// The belief and the people of one moment.
pub fn scene() -> Scene {
    Scene {
        tick: 42,
        stamp: 4.2,
        belief: belief(),
        people: people(),
        obstacles: vec![17, 3, 40, 1].into(),
        passage_m: Some(0.125),
        uncertain: true,
        in_place_s: 0.6,
        impatient: false,
    }
}

fn laser() -> LaserModel {
    LaserModel {
        robot_from_laser: Pose { x: 0.1, y: 0.0, heading: 0.0 },
        fov: std::f64::consts::PI,
        beams: 181,
        range_max: 5.0,
        range_sigma: 0.03,
    }
}

fn robot_model(footprint: Footprint) -> RobotModel {
    RobotModel { footprint, v_max: 1.0, a_max: 0.5, omega_max: 1.5, alpha_max: 3.0, v_reverse: 0.0 }
}

fn odometry_noise() -> OdometryNoise {
    OdometryNoise {
        position_per_metre: 0.01,
        position_per_radian: 0.001,
        heading_per_metre: 0.002,
        heading_per_radian: 0.02,
    }
}

/// A mission about to run.
pub fn mission() -> Mission {
    let polygon =
        Footprint::Polygon { x: vec![0.3, -0.3, -0.3, 0.3].into(), y: vec![0.2, 0.2, -0.2, -0.2].into() };
    let order = MissionOrder {
        robot: "r1".into(),
        map: MAP,
        initial_pose: Pose { x: 0.5, y: -0.5, heading: 0.25 },
        initial_covariance: vec![0.25, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0625].into(),
        initial_doubtful: true,
        goal_x: 8.0,
        goal_y: 6.5,
        goal_heading: Some(1.57),
        way: None,
        goal_tolerance: 0.3,
        profile: parameters(&[
            ("name", "paper".into()),
            ("terms", Value::Array(vec![parameters(&[("term", "cpc".into()), ("weight", 1.0.into())])])),
        ]),
        localizer: parameters(&[("particles_max", 5000.into())]),
        tracker: Some(parameters(&[("confirm", 3.into())])),
        laser: laser(),
        robot_model: robot_model(polygon),
        odometry_noise: odometry_noise(),
        seed: 17,
        clock: Clock::Lockstep,
        time_scale: 1.0,
        tick_s: 0.1,
        plan_every: 3,
        require: vec!["arbiter".into(), "localizer".into()],
    };
    Mission {
        lease: 17,
        run: 2,
        revision: 3,
        order,
        ready: vec!["localizer".into()],
        state: MissionState::Preparing,
        has_run: false,
        end: None,
    }
}

/// The same mission, which the arbiter could not prepare for.
pub fn refused_mission() -> Mission {
    let (role, instance) = ("arbiter".into(), "arbiter-0".into());
    let end = MissionEnd::Unprepared { role, instance, reject: no_replica() };
    Mission { state: MissionState::Finished, end: Some(end), ..mission() }
}

fn no_replica() -> Reject {
    let detail = "comfort-0: params.radius: 0 is not greater than 0".into();
    Refusal::NoReplica { term: "comfort".into(), may_come: false, detail }.at("terms.comfort")
}

fn readiness() -> Readiness {
    Readiness { role: "localizer".into(), instance: "localizer-0".into(), revision: 3, refused: None }
}
