//! A mission of one of the paper's scenarios, ready to be planned, without a network.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context;
use curionav_crowdsim::World;
use curionav_deployment::package::{self, Choice};
use curionav_planning::arbitration::Observer;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::nalgebra::{Matrix3, Vector3};
use curionav_planning::planner::Course;
use curionav_planning::scene::{Belief, Moment, Scene};
use curionav_pool::context::PlanContext;
use curionav_robot::arbiter::cycle::Observation;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_schemas::{self as wire, Clock, Confidence, Health, MissionState};

/// Metres of the shortest way that the robot has behind it: people are then around it on all sides.
const DRIVEN: f64 = 12.0;

/// A robot on its way through env4-s2, a hall with 27 people.
#[derive(Clone)]
pub(crate) struct OnTheWay {
    pub(crate) context: Arc<PlanContext>,
    pub(crate) world: World,
    pub(crate) map: wire::OccupancyGrid,
    pub(crate) pose: Pose2,
}

impl OnTheWay {
    /// With `planner`, a built-in profile.
    pub(crate) fn with(planner: &str) -> anyhow::Result<Self> {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/paper/env4-s2.toml");
        let choice = Choice { planner: Some(planner.to_owned()), seed: Some(1), ..Choice::default() };
        let package = package::read(&file, &choice, Clock::Lockstep, 1.0)?;
        let fields = Fields::of_maps([]);
        let prepared =
            curionav_in_process::prepare(&package.request, "robot", &fields).context("scenario")?;
        let mission = wire::Mission {
            lease: 1,
            run: 1,
            revision: 1,
            order: prepared.order,
            ready: Vec::new(),
            state: MissionState::Running,
            has_run: true,
            end: None,
        };
        let start = convert::pose(mission.order.initial_pose).position();
        let context = PlanContext::new(mission, &fields, true).context("mission")?;
        let way = context.course.geodesic.descend_for(start, 0.2, DRIVEN);
        let [.., before, here] = way[..] else { anyhow::bail!("the goal cannot be reached") };
        let pose = Pose2::new(here.x, here.y, heading(before, here));
        Ok(Self { context: Arc::new(context), world: prepared.world, map: prepared.map, pose })
    }

    /// What the robot knows at `tick` at `pose`. The variance of each coordinate is `variance` m2; of the heading, a
    /// fifth of that in rad2.
    fn belief(&self, pose: Pose2, variance: f64) -> Belief {
        let covariance = Matrix3::from_diagonal(&Vector3::new(variance, variance, 0.2 * variance));
        Belief { pose, covariance, twist: Twist { v: 0.8, omega: 0.0 } }
    }

    /// The scene `tick` ticks after the start for a robot at `pose` that is sure of its position.
    pub(crate) fn scene(&self, pose: Pose2, tick: u64) -> Scene {
        let belief = self.belief(pose, 0.01);
        let people = self.world.people();
        let Course { profile, robot, .. } = &self.context.course;
        let moment = Moment { tick, stamp: 0.1 * tick as f64 };
        Observer::default().form_scene(profile, robot, moment, belief, people)
    }

    /// The same as messages, for a position known with `variance` m2.
    pub(crate) fn observation(&self, pose: Pose2, tick: u64, variance: f64) -> Observation {
        let health =
            Health { outside_weight: 0.0, scan_fit: 1.0, particles: 500, confidence: Confidence::Sure };
        let belief = self.belief(pose, variance);
        let stamp = 0.1 * tick as f64;
        Observation {
            belief: convert::belief_to_wire(&belief, tick, stamp, health),
            people: convert::people_to_wire(self.world.people(), tick, stamp),
        }
    }
}

fn heading(from: Point2, to: Point2) -> f64 {
    (to.y - from.y).atan2(to.x - from.x)
}
