//! What can be said about a scenario without its map.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::{Footprint, OdometryNoise, RobotModel};
use curionav_planning::sensor::LaserModel;

use super::{Clock, PeopleParams, Recorded, RobotSetup, Scenario, ScenarioError, WalkMode, Walker};

/// Most walkers: twenty times the densest published scenario.
const MAX_WALKERS: usize = 1000;
/// Most corners of one route.
const MAX_ROUTE_POINTS: usize = 1000;
/// Most others an HRVO person minds: the work grows with the third power.
const MAX_NEIGHBORS: f64 = 64.0;
/// Most recordings played at once.
const MAX_RECORDED: usize = 16;
/// Most laser beams: a quarter of a degree all around is 1440.
const MAX_BEAMS: u32 = 4096;
/// Most ticks of a run: a day at 0.1 s.
const MAX_TICKS: f64 = 864_000.0;
/// Longest name, bytes: it becomes a file name.
const MAX_NAME_BYTES: usize = 100;

type Check = Result<(), ScenarioError>;

impl Scenario {
    /// Whether all values are in range; the first fault names its field and the mend.
    pub fn validate(&self) -> Check {
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        require(
            !self.name.is_empty() && self.name.len() <= MAX_NAME_BYTES && self.name.chars().all(plain),
            "name",
            "is not a short plain name",
            "use 1 to 100 letters, digits, '-', '_' and '.'",
        )?;
        require(!self.map.file.is_empty(), "map.file", "is empty", "name a map_server YAML file")?;
        robot(&self.robot)?;
        laser(&self.laser)?;
        noise(&self.odometry_noise)?;
        clock(&self.clock)?;
        people(&self.people)?;
        require(
            self.walkers.len() <= MAX_WALKERS,
            "walkers",
            &format!("has {} entries", self.walkers.len()),
            &format!("give at most {MAX_WALKERS}"),
        )?;
        self.walkers.iter().enumerate().try_for_each(|(i, w)| walker(&format!("walkers[{i}]"), w))?;
        require(
            self.recorded.len() <= MAX_RECORDED,
            "recorded",
            &format!("has {} entries", self.recorded.len()),
            &format!("give at most {MAX_RECORDED}"),
        )?;
        self.recorded.iter().enumerate().try_for_each(|(i, r)| recorded(&format!("recorded[{i}]"), r))?;
        require(!self.planner.profile.is_empty(), "planner.profile", "is empty", "name a planner profile")
    }
}

fn robot(r: &RobotSetup) -> Check {
    finite_pose("robot.start", r.start)?;
    finite_point("robot.goal", r.goal)?;
    if let Some(heading) = r.goal_heading {
        require(heading.is_finite(), "robot.goal_heading", "is not finite", "give radians")?;
    }
    within("robot.goal_tolerance", r.goal_tolerance, 0.01, 10.0, "metres")?;
    for (i, sigma) in r.initial_sigma.iter().enumerate() {
        within(&format!("robot.initial_sigma[{i}]"), *sigma, 0.0, 10.0, "metres or radians")?;
    }
    within("robot.start_noise", r.start_noise, 0.0, 2.0, "as a fraction of initial_sigma")?;
    model(&r.model)
}

fn model(m: &RobotModel) -> Check {
    within("robot.model.v_max", m.v_max, 0.01, 10.0, "m/s")?;
    within("robot.model.a_max", m.a_max, 0.01, 20.0, "m/s2")?;
    within("robot.model.omega_max", m.omega_max, 0.01, 20.0, "rad/s")?;
    within("robot.model.alpha_max", m.alpha_max, 0.01, 100.0, "rad/s2")?;
    let field = "robot.model.footprint";
    if let Footprint::Polygon { vertices } = &m.footprint {
        let n = vertices.len();
        let left_turn = |i: usize| {
            let (a, b, c) = (vertices[i], vertices[(i + 1) % n], vertices[(i + 2) % n]);
            (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) > 0.0
        };
        let convex = (3..=MAX_ROUTE_POINTS).contains(&n) && (0..n).all(left_turn);
        let mend = "list at least three vertices of a convex polygon counter-clockwise";
        require(convex, field, "is not a convex polygon", mend)?;
    }
    within(field, m.radius(), 0.05, 5.0, "metres of radius")
}

fn laser(l: &LaserModel) -> Check {
    finite_pose("laser.robot_from_laser", l.robot_from_laser)?;
    within("laser.fov", l.fov, 0.01, std::f64::consts::TAU + 1e-9, "radians")?;
    within("laser.beams", f64::from(l.beams), 2.0, f64::from(MAX_BEAMS), "beams")?;
    within("laser.range_max", l.range_max, 0.1, 200.0, "metres")?;
    within("laser.range_sigma", l.range_sigma, 0.0, 1.0, "metres")
}

fn noise(n: &OdometryNoise) -> Check {
    for (name, value) in [
        ("position_per_metre", n.position_per_metre),
        ("position_per_radian", n.position_per_radian),
        ("heading_per_metre", n.heading_per_metre),
        ("heading_per_radian", n.heading_per_radian),
    ] {
        within(&format!("odometry_noise.{name}"), value, 0.0, 1.0, "as a variance per metre or radian")?;
    }
    Ok(())
}

fn clock(c: &Clock) -> Check {
    within("clock.tick_s", c.tick_s, 0.001, 1.0, "seconds")?;
    within("clock.plan_every", f64::from(c.plan_every), 1.0, 1000.0, "ticks")?;
    within("clock.time_limit_s", c.time_limit_s, c.tick_s, MAX_TICKS * c.tick_s, "seconds")
}

fn people(p: &PeopleParams) -> Check {
    within("people.radius", p.radius, 0.05, 2.0, "metres")?;
    within("people.live_patience_s", p.live_patience_s, 0.1, 600.0, "seconds")?;
    let h = &p.hrvo;
    within("people.hrvo.neighbor_distance", h.neighbor_distance, 0.1, 100.0, "metres")?;
    within("people.hrvo.max_neighbors", f64::from(h.max_neighbors), 1.0, MAX_NEIGHBORS, "people")?;
    within("people.hrvo.goal_radius", h.goal_radius, 0.01, 10.0, "metres")?;
    within("people.hrvo.max_speed_factor", h.max_speed_factor, 1.0, 10.0, "times the preferred speed")?;
    within("people.hrvo.max_accel", h.max_accel, 0.01, 1000.0, "m/s2")?;
    within("people.hrvo.uncertainty_offset", h.uncertainty_offset, 0.0, 10.0, "m/s")?;
    within("people.hrvo.wall_horizon_s", h.wall_horizon_s, 0.01, 10.0, "seconds")
}

fn walker(field: &str, w: &Walker) -> Check {
    let least = if w.mode == WalkMode::Stand { 1 } else { 2 };
    require(
        (least..=MAX_ROUTE_POINTS).contains(&w.route.len()),
        &format!("{field}.route"),
        &format!("has {} points", w.route.len()),
        &format!("give {least} to {MAX_ROUTE_POINTS} points, or one and mode = \"stand\""),
    )?;
    for (i, p) in w.route.iter().enumerate() {
        finite_point(&format!("{field}.route[{i}]"), *p)?;
    }
    within(&format!("{field}.speed"), w.speed, 0.01, 10.0, "m/s")?;
    within(&format!("{field}.pause_s"), w.pause_s, 0.0, 3600.0, "seconds")?;
    let length = w.cycle_length();
    require(
        w.mode == WalkMode::Stand || length > 0.01,
        &format!("{field}.route"),
        "leads nowhere",
        "move its points apart, or use mode = \"stand\"",
    )?;
    within(&format!("{field}.start_offset"), w.start_offset, 0.0, length, "metres along the route")
}

fn recorded(field: &str, r: &Recorded) -> Check {
    require(!r.file.is_empty(), &format!("{field}.file"), "is empty", "name a recording")?;
    within(&format!("{field}.fps"), r.fps, 0.1, 1000.0, "frames per second")?;
    within(&format!("{field}.start_s"), r.start_s, 0.0, 1e6, "seconds")?;
    finite_pose(&format!("{field}.pose"), r.pose)
}

fn require(holds: bool, field: &str, problem: &str, mend: &str) -> Check {
    if holds { Ok(()) } else { Err(ScenarioError::new(field, problem, mend)) }
}

fn within(field: &str, value: f64, least: f64, most: f64, unit: &str) -> Check {
    let holds = value >= least && value <= most;
    require(holds, field, &format!("is {value}"), &format!("give {least} to {most} {unit}"))
}

fn finite_point(field: &str, p: Point2) -> Check {
    require(p.x.is_finite() && p.y.is_finite(), field, "is not finite", "give metres")
}

fn finite_pose(field: &str, p: Pose2) -> Check {
    let holds = p.x.is_finite() && p.y.is_finite() && p.heading.is_finite();
    require(holds, field, "is not finite", "give metres and radians")
}
