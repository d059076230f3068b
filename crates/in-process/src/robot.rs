//! All roles of a robot, answering one tick after the other.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use curionav_mission::convert;
use curionav_mission::fields::Fields;
use curionav_mission::guard_settings::GuardSettings;
use curionav_mission::mission_course::{MissionCourse, past_obstacles};
use curionav_mission::robot_limits::Base;
use curionav_planning::arbitration::Localising;
use curionav_planning::geometry::{Point2, Twist};
use curionav_planning::occupancy::StaticMap;
use curionav_planning::planner::Course;
use curionav_robot::arbiter::cycle::{Failure, look_around, observe, plan_with, stand};
use curionav_robot::arbiter::memory::Memory;
use curionav_robot::arbiter::obstacle_watch::{Explained, ObstacleWatch};
use curionav_robot::arbiter::own_planner::OwnPlanner;
use curionav_robot::driver::decision_fence::DecisionFence;
use curionav_robot::driver::drive::{Drive, Grounds, Now, given_up};
use curionav_robot::driver::guard::Guard;
use curionav_robot::driver::mission_state::CurrentMission;
use curionav_robot::localizer::Localization;
use curionav_robot::tracker::PeopleTracking;
use curionav_schemas::{
    self as wire, Belief, Clock, Decision, Mission, MissionCommand, MissionEnd, MissionOrder, Odometry,
    People, Readiness, Refusal, Reject, keys,
};

use crate::sensed::Sensed;

/// Names the roles of this process, where services have the names of their instances.
const INSTANCE: &str = "in-process";
/// The only grant of a base that nothing else drives.
const LEASE: u64 = 1;

/// A robot with its mission, its belief and its planner.
pub struct Robot {
    fields: Fields,
    current: CurrentMission,
    /// The mission as it stands.
    mission: Mission,
    map: Arc<StaticMap>,
    localization: Localization,
    tracking: Option<PeopleTracking>,
    course: Course,
    watch: ObstacleWatch,
    /// What proposes candidates in the place of a built-in generator.
    own: Option<Box<dyn OwnPlanner>>,
    memory: Memory,
    localising: Localising,
    fence: DecisionFence,
    drive: Drive,
    commanded: Option<wire::Twist>,
}

/// What a robot answers to a tick.
#[derive(Debug, Clone)]
pub struct Answer {
    /// Where it believes to be.
    pub belief: Belief,
    /// What it has decided, in a tick in which it plans.
    pub decision: Option<Decision>,
    /// What its base is to do.
    pub command: Twist,
}

impl Robot {
    /// A robot that is ready to begin `order`; a second or so passes on a large map that `fields` does not have yet.
    ///
    /// # Errors
    /// The mission is refused, as a driver or a role would refuse it.
    pub fn new(order: MissionOrder, fields: &Fields) -> Result<Self, Box<MissionEnd>> {
        Self::planned_by(None, order, fields)
    }

    /// As [`Self::new`], with the planner of one's own that the profile of `order` names as its generator.
    ///
    /// # Errors
    /// As [`Self::new`], and if the profile names such a planner and there is none.
    pub fn planned_by(
        own: Option<Box<dyn OwnPlanner>>,
        order: MissionOrder,
        fields: &Fields,
    ) -> Result<Self, Box<MissionEnd>> {
        let mut current = CurrentMission::new(Base::Simulated, 1);
        current.set_lease(LEASE);
        let set = MissionCommand::Set { order: Box::new(order) };
        let mission = current.command(set).map_err(world_failed)?;
        let map = fields.map(mission.order.map).map_err(world_failed)?;
        let localization = Localization::new(&mission, &map).map_err(unprepared("localizer"))?;
        let tracks = mission.order.requires(keys::TRACKER);
        let tracking = tracks.then(|| PeopleTracking::new(&mission.order, Arc::clone(&map))).transpose();
        let tracking = tracking.map_err(unprepared(keys::TRACKER))?;
        let course = course(&mission, fields, own.is_some()).map_err(unprepared("arbiter"))?;
        let mut watch = ObstacleWatch::default();
        let tracker = convert::parameters("tracker", &mission.order.tracker_parameters());
        watch.follow(tracker.map_err(unprepared("arbiter"))?);
        let mut drive = Drive::new(Base::Simulated, None, Guard::new(GuardSettings::default(), Vec::new()));
        drive.begin(&mission);
        let mut robot = Self {
            fields: fields.clone(),
            current,
            map,
            localization,
            tracking,
            course,
            watch,
            own,
            memory: Memory::new(0),
            localising: Localising::default(),
            fence: DecisionFence::default(),
            drive,
            commanded: None,
            mission,
        };
        for role in robot.mission.order.require.clone() {
            let revision = robot.mission.revision;
            let ready = Readiness { role, instance: INSTANCE.into(), revision, refused: None };
            robot.mission = robot.current.readiness(ready).map_err(world_failed)?;
        }
        Ok(robot)
    }

    /// The mission as it stands.
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Answers a tick; ticks are answered in order, from 0 on.
    ///
    /// # Errors
    /// The scan describes no scanner, and people are found in scans.
    pub fn answer(&mut self, sensed: Sensed) -> Result<Answer, Box<MissionEnd>> {
        let Sensed { scan, odometry, people } = sensed;
        let order = &self.mission.order;
        let (belief, _) = self.localization.update(&odometry, Some(&scan), convert::laser(&order.laser));
        let people = match &mut self.tracking {
            Some(tracking) => {
                let range_sigma = order.laser.range_sigma;
                let people = tracking.update(&odometry, &scan, &belief, range_sigma);
                Some(people.map_err(world_failed)?)
            }
            None => people,
        };
        self.watch.measured([odometry.clone()]);
        let range_sigma = order.laser.range_sigma;
        let explained =
            Explained { belief: &belief, people: people.as_ref(), map: &self.course.map, range_sigma };
        self.watch.see(scan.clone(), &BTreeMap::new(), &explained);
        if let Some(own) = &mut self.own {
            own.see(&scan);
        }
        let is_due = odometry.tick.is_multiple_of(u64::from(order.plan_every.max(1)));
        let decision = is_due.then(|| self.decide(&belief, people));
        self.drive.measured(odometry.clone());
        self.drive.believed(belief.clone());
        if let Some(decision) = &decision {
            self.fence.admit(decision.clone(), odometry.stamp, Clock::Lockstep);
        }
        let command = self.command(&odometry, &scan);
        self.give_up()?;
        Ok(Answer { belief, decision, command })
    }

    /// One cycle of the arbiter.
    fn decide(&mut self, belief: &Belief, people: Option<People>) -> Decision {
        let began = Instant::now();
        if let Some(command) = &self.commanded {
            self.memory.observe_command(command);
        }
        let obstructed = self.obstructed(Point2::new(belief.x, belief.y));
        self.memory.seq += 1;
        let mission = &self.mission;
        let memory = &mut self.memory;
        let ready = match &obstructed {
            Ok(Some(course)) => Ok(course),
            Ok(None) => Ok(&self.course),
            Err(failure) => Err(failure.clone()),
        };
        let observed =
            ready.and_then(|course| Ok((course, observe(course, memory, mission, belief.clone(), people)?)));
        let decision = match observed {
            Ok((course, observation)) => {
                let own = self.own.as_deref_mut().map(|own| own as &mut dyn OwnPlanner);
                plan_with(course, memory, mission, &observation, own, &|| began.elapsed()).0
            }
            Err(failure) => stand(memory, failure, belief, mission),
        };
        let believed = convert::belief(belief);
        let decision = look_around(decision, &mut self.localising, &self.watch, &believed, mission);
        if self.memory.are_ways_closed() {
            self.watch.look_again(decision.stamp);
        }
        decision
    }

    /// The course past the obstacles that are known now, if there are any.
    fn obstructed(&self, here: Point2) -> Result<Option<Course>, Failure> {
        let obstacles = self.watch.obstacles();
        if obstacles.is_empty() {
            return Ok(None);
        }
        let past = past_obstacles(&self.course, &self.mission, obstacles, here, &self.fields);
        past.map(Some).map_err(|reject| {
            tracing::warn!(%reject, "there is no course past obstacles");
            Failure::not_prepared()
        })
    }

    /// One tick of the driver.
    fn command(&mut self, odometry: &Odometry, scan: &wire::Scan) -> Twist {
        let (command, _) = self.drive.command(&Now {
            mission: &self.mission,
            odometry,
            scan: Some(scan),
            refused: None,
            map: Some(&self.map),
            decision: self.fence.in_force(),
        });
        let decision = self.fence.newest().map_or((0, 0), |d| (d.epoch, d.seq));
        let told = self.drive.tell(&self.mission, odometry, &command, Grounds { lease: LEASE, decision });
        let twist = Twist { v: told.v, omega: told.omega };
        self.commanded = Some(told);
        twist
    }

    /// Ends the mission if the arbiter has given it up.
    fn give_up(&mut self) -> Result<(), Box<MissionEnd>> {
        if let Some(end) = self.fence.in_force().and_then(given_up) {
            let finish = MissionCommand::Finish { revision: self.mission.revision, end };
            self.mission = self.current.command(finish).map_err(world_failed)?;
        }
        Ok(())
    }
}

/// The course of a mission, whose terms are all built in: no other process is asked for one. Its generator is built in
/// unless the robot `has_own` planner.
fn course(mission: &Mission, fields: &Fields, has_own: bool) -> Result<Course, Reject> {
    let MissionCourse { course, .. } = MissionCourse::new(mission.clone(), fields)?;
    if course.asks_own() && !has_own {
        let detail = "a run in one process has no generators; use a deployment, or `curionav bench`";
        return Err(Refusal::no_replica(&course.profile.generator, false, detail.to_owned()).at("generator"));
    }
    let counted = course.profile.terms.iter().filter(|(_, term)| term.weight > 0.0);
    match counted.map(|(name, _)| name).find(|name| course.evaluator(name).is_none()) {
        Some(term) => {
            let detail = "a run in one process has no evaluators; use a deployment".to_owned();
            Err(Refusal::no_replica(term, false, detail).at(format!("terms.{term}")))
        }
        None => Ok(course),
    }
}

fn world_failed(reject: Reject) -> Box<MissionEnd> {
    Box::new(MissionEnd::WorldFailed { reject })
}

/// How a mission ends for which this role cannot be prepared.
fn unprepared(role: &str) -> impl Fn(Reject) -> Box<MissionEnd> {
    let role = role.to_owned();
    move |reject| Box::new(MissionEnd::Unprepared { role: role.clone(), instance: INSTANCE.into(), reject })
}
