//! One world, and what the robot in it is told at each tick.

use std::sync::Arc;

use curionav_crowdsim::World;
use curionav_crowdsim::outcome::Outcome;
use curionav_in_process::judge::Judge;
use curionav_in_process::prepare;
use curionav_in_process::sensed::{Sensed, sense};
use curionav_mission::convert;
use curionav_mission::robot_limits::Base;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::occupancy::GeodesicField;
use curionav_planning::sensor::LaserModel;
use curionav_robot::driver::mission_state::CurrentMission;
use curionav_robot::localizer::Localization;
use curionav_robot::tracker::PeopleTracking;
use curionav_schemas::{
    Belief, Confidence, Frame, Health, InjectRequest, Mission, MissionCommand, Odometry, People, Refusal,
    Reject, RunResult, keys,
};

use crate::fields::FIELDS;

/// Numbers that a [`Seen`] has of what really is; `python/src/curionav_gym/facts.py` names them.
pub(crate) const FACTS: usize = 12;

/// The only grant of a base that nothing else drives.
const LEASE: u64 = 1;

/// A world with the robot in it, from a reset to the end.
pub(crate) struct Episode {
    world: World,
    mission: Mission,
    laser: LaserModel,
    localization: Option<Localization>,
    tracking: Option<PeopleTracking>,
    way: Arc<GeodesicField>,
    judge: Judge,
}

/// A tick as a policy sees it.
pub(crate) struct Seen {
    /// Metres by beam; 0 of a beam that says nothing.
    pub(crate) ranges: Vec<f32>,
    /// Measured speed and turn rate.
    pub(crate) velocity: [f32; 2],
    /// Believed x, y and heading, and the standard deviations of place and heading.
    pub(crate) belief: [f32; 5],
    /// The goal seen from the believed pose: x ahead, y left.
    pub(crate) goal: [f32; 2],
    /// x, y, vx, vy and radius by person, seen from the robot, the nearest first.
    pub(crate) people: Vec<[f32; 5]>,
    /// What really is.
    pub(crate) facts: [f64; FACTS],
}

impl Episode {
    /// The world of `request` at its start. The robot knows its true pose, unless it `localizes`.
    pub(crate) fn begin(request: &InjectRequest, localizes: bool) -> Result<Self, Reject> {
        let prepared = prepare(request, "robot", &FIELDS)?;
        let (world, order) = (prepared.world, prepared.order);
        let mut current = CurrentMission::new(Base::Simulated, 1);
        current.set_lease(LEASE);
        let mission = current.command(MissionCommand::Set { order: Box::new(order) })?;
        let order = &mission.order;
        let map = FIELDS.map(order.map)?;
        let localization = localizes.then(|| Localization::new(&mission, &map)).transpose()?;
        let tracks = order.requires(keys::TRACKER);
        let tracking = tracks.then(|| PeopleTracking::new(order, Arc::clone(&map))).transpose()?;
        let goal = Point2::new(order.goal_x, order.goal_y);
        let way = FIELDS.way(world.map(), goal, world.scenario().robot.model.radius())?;
        let laser = convert::laser(&order.laser);
        let judge = Judge::new(order.plan_every);
        Ok(Self { world, laser, localization, tracking, way, judge, mission })
    }

    /// One tick, in which the base is told to drive so.
    pub(crate) fn step(&mut self, command: Twist) {
        self.world.step(command);
    }

    /// What the robot is told now; asked once in a tick.
    pub(crate) fn look(&mut self) -> Result<Seen, Reject> {
        let Sensed { scan, odometry, people } = sense(&self.world)?;
        let belief = match &mut self.localization {
            Some(localization) => localization.update(&odometry, Some(&scan), self.laser).0,
            None => sure(self.world.truth().pose, &odometry),
        };
        let people = match &mut self.tracking {
            Some(tracking) => tracking.update(&odometry, &scan, &belief, self.laser.range_sigma)?,
            None => people.ok_or_else(|| Refusal::failed("nothing tells where people are"))?,
        };
        let believed = Pose2::new(belief.x, belief.y, belief.heading);
        let goal = believed.inverse_transform(self.goal());
        let c = &belief.covariance;
        let deviations = [(c[0] + c[4]).sqrt(), c[8].sqrt()];
        let standing = self.judge.tick(&self.world, &self.mission, Some(belief), &[]);
        Ok(Seen {
            ranges: scan.ranges.0.iter().map(|range| if range.is_nan() { 0.0 } else { *range }).collect(),
            velocity: [odometry.v as f32, odometry.omega as f32],
            belief: [believed.x, believed.y, believed.heading, deviations[0], deviations[1]]
                .map(|n| n as f32),
            goal: [goal.x as f32, goal.y as f32],
            people: rows(believed, people),
            facts: self.facts(standing.to_go, standing.outcome.is_some()),
        })
    }

    fn facts(&self, to_go: f64, is_late: bool) -> [f64; FACTS] {
        let truth = self.world.truth();
        let reached = to_go <= self.mission.order.goal_tolerance;
        [
            truth.time,
            truth.pose.x,
            truth.pose.y,
            truth.pose.heading,
            truth.twist.v,
            truth.twist.omega,
            self.way.at(truth.pose.position()),
            truth.person_clearance,
            truth.wall_clearance,
            f64::from(u8::from(!truth.touching.is_empty()))
                + 2.0 * f64::from(u8::from(truth.wall_impact.is_some())),
            f64::from(u8::from(reached)),
            f64::from(u8::from(is_late)),
        ]
    }

    fn goal(&self) -> Point2 {
        Point2::new(self.mission.order.goal_x, self.mission.order.goal_y)
    }

    /// x, y and radius of everyone who is really there.
    pub(crate) fn everyone(&self) -> Vec<[f64; 3]> {
        let people = self.world.people();
        (0..people.len()).map(|i| [people.x[i], people.y[i], people.radius]).collect()
    }

    /// The result of the run so far; what follows counts as another one.
    pub(crate) fn finish(&mut self) -> Result<RunResult, Reject> {
        let truth = self.world.truth();
        let tolerance = self.mission.order.goal_tolerance;
        let outcome = match Outcome::of_arrival(truth.pose, self.goal(), tolerance) {
            Outcome::Reached => Outcome::Reached,
            _ => Outcome::Timeout,
        };
        let judge = std::mem::replace(&mut self.judge, Judge::new(self.mission.order.plan_every));
        judge.finish(&self.world, &self.mission, "policy", outcome, &FIELDS)
    }
}

/// The belief of a robot that knows where it is.
fn sure(pose: Pose2, odometry: &Odometry) -> Belief {
    Belief {
        tick: odometry.tick,
        stamp: odometry.stamp,
        x: pose.x,
        y: pose.y,
        heading: pose.heading,
        covariance: vec![0.0; 9].into(),
        v: odometry.v,
        omega: odometry.omega,
        health: Health { outside_weight: 0.0, scan_fit: 1.0, particles: 0, confidence: Confidence::Sure },
    }
}

/// People as seen from a robot that believes to be at `believed`, the nearest first.
fn rows(believed: Pose2, people: People) -> Vec<[f32; 5]> {
    let seen = match people.frame {
        Frame::Robot => people,
        Frame::Map => convert::people_seen_from(believed, people),
    };
    let mut rows: Vec<[f64; 5]> =
        (0..seen.id.len()).map(|i| [seen.x[i], seen.y[i], seen.vx[i], seen.vy[i], seen.radius]).collect();
    rows.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    rows.into_iter().map(|row| row.map(|number| number as f32)).collect()
}
