//! What becomes of goals of actions, and of questions whether Nav2 is at work.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_ros2::messages as ros;

use super::Gateway;
use crate::action_kind::{ActionKind, Failure};
use crate::action_publishers::Progress;
use crate::calls::{Call, GoalRequest, Wish};
use crate::fault::{Fault, FaultKind};
use crate::given_path::GivenPath;
use crate::goals::{Goal, Goals, Status, Task};
use crate::node::Request;
use crate::path_planner::PathMade;
use crate::tour::{Destination, Place, PlaceEnd, Tour};

/// Requests for results that wait for the end of their goals.
const RESULTS_MAX: usize = 64;

impl Gateway {
    /// A client has called.
    pub(crate) fn called(&mut self, call: Call, asked: Request) {
        match call {
            Call::SendGoal(request) => {
                let GoalRequest { id, kind, wish } = *request;
                let stamp = self.parts.gate.robot_time();
                let accepted = match wish {
                    Wish::Go { poses, first, rounds } => {
                        let tour = self.tour(poses, first, rounds);
                        self.send_goal(kind, id, tour, None, stamp)
                    }
                    Wish::Follow(path) => self.send_path(kind, id, path, stamp),
                    Wish::Plan { poses, start } => self.send_path_goal(kind, id, (poses, start), stamp),
                };
                asked.reply(&ros::SendGoalResponse { accepted, stamp });
                if accepted {
                    self.goals_changed();
                    self.path_goals_changed();
                }
            }
            Call::CancelGoal(kind, request) => self.cancel_goal(kind, &request, &asked),
            Call::GetResult(kind, id) => self.get_result(kind, id, asked),
            Call::LocalizerState => asked.reply(&state(true)),
            Call::Parameters(question) => self.parts.parameters.answer(&question, &asked),
            Call::NavigatorState => asked.reply(&state(self.takes_goals())),
        }
    }

    /// Whether everything is there that a goal needs.
    fn takes_goals(&self) -> bool {
        self.map.is_some() && self.parts.robot_state.laser.is_some() && self.starting().is_ok()
    }

    /// The places that a client has said.
    fn tour(&self, poses: Vec<ros::PoseStamped>, first: u32, rounds: u32) -> Result<Tour, Fault> {
        let place = |pose: ros::PoseStamped| {
            let destination = self.destination_of(&pose)?;
            Ok(Place { pose, destination, end: PlaceEnd::Pending })
        };
        let places = poses.into_iter().map(place).collect::<Result<Vec<_>, Fault>>()?;
        let first = first as usize;
        if first > 0 && first >= places.len() {
            let count = places.len();
            return Err(Fault::unusable(format!("goal_index is {first}, and there are {count} waypoints")));
        }
        Ok(Tour::new(places, first, rounds))
    }

    /// Takes a goal that moves the robot, or refuses it. Waypoints without any are a goal that fails, as in Nav2.
    fn send_goal(
        &mut self,
        kind: ActionKind,
        id: ros::Uuid,
        tour: Result<Tour, Fault>,
        given: Option<GivenPath>,
        stamp: ros::Time,
    ) -> bool {
        let outcome = tour.and_then(|tour| {
            if self.journey.goals.get(&id).is_some() {
                return Err(Fault::unusable("a goal of this name is known already"));
            }
            match tour.destination() {
                Some(destination) => self.go(destination, given)?,
                None if kind == ActionKind::FollowWaypoints => {}
                None => return Err(Fault::unusable("it has no pose")),
            }
            Ok(tour)
        });
        let topic = kind.name(&self.parts.config.topics).to_owned();
        let Some(tour) = self.parts.robot_state.used(&topic, outcome) else { return false };
        let is_empty = tour.destination().is_none();
        let goal = Goal::new(id, kind, Task::Tour(tour), stamp);
        if !is_empty {
            return self.journey.accept(goal);
        }
        let status = Status::Aborted;
        let error = kind.error(Failure::NoPoses);
        self.journey.goals.accept(Goal { status, error, why: "no waypoint is given".into(), ..goal })
    }

    /// Takes a path to follow, or refuses it. It takes the place of the one before without a stop. One that is no way
    /// is a goal that fails, as in Nav2.
    fn send_path(&mut self, kind: ActionKind, id: ros::Uuid, path: ros::Path, stamp: ros::Time) -> bool {
        let end = path.poses.last().cloned().unwrap_or_default();
        let pose = ros::PoseStamped { header: path.header.clone(), ..end };
        match GivenPath::of(&path, &self.parts.config.frames.map) {
            Ok(given) => {
                let destination = given.destination();
                let place = Place { pose, destination, end: PlaceEnd::Pending };
                self.send_goal(kind, id, Ok(Tour::new(vec![place], 0, 0)), Some(given), stamp)
            }
            Err(fault) => {
                let is_frame = fault.kind == FaultKind::UnknownFrame;
                let failure = if is_frame { Failure::Transform } else { Failure::NoPoses };
                let goal = Goal::new(id, kind, Task::Tour(Tour::default()), stamp);
                let error = kind.error(failure);
                let failed = Goal { status: Status::Aborted, error, why: fault.to_string(), ..goal };
                self.parts.robot_state.used::<()>(&self.parts.config.topics.follow_path.clone(), Err(fault));
                self.journey.goals.accept(failed)
            }
        }
    }

    /// Begins to look for a path, or refuses to.
    fn send_path_goal(
        &mut self,
        kind: ActionKind,
        id: ros::Uuid,
        (poses, start): (Vec<ros::PoseStamped>, Option<ros::PoseStamped>),
        stamp: ros::Time,
    ) -> bool {
        let is_known = self.path_goals.get(&id).is_some();
        if is_known || !self.parts.path_planner.has_room() {
            return false;
        }
        let places = poses.iter().map(|pose| self.destination_of(pose)).collect::<Result<Vec<_>, _>>();
        let start = match start {
            Some(pose) => self.destination_of(&pose).map(|(place, _)| place),
            None => self.starting().map(|start| start.pose.position()),
        };
        let both: Result<(Vec<Destination>, Point2), Fault> = places.and_then(|places| Ok((places, start?)));
        let path = Task::Path(Vec::new(), std::time::Duration::ZERO);
        let goal = Goal::new(id, kind, path, stamp);
        match both {
            Ok((places, start)) => {
                self.parts.path_planner.begin(id, start, places);
                self.path_goals.accept(Goal { status: Status::Executing, ..goal })
            }
            Err(fault) => {
                let error = kind.error(Failure::Transform);
                let why = fault.to_string();
                self.path_goals.accept(Goal { status: Status::Aborted, error, why, ..goal })
            }
        }
    }

    /// A path is found, or not.
    pub(crate) fn path_made(&mut self, path: PathMade) {
        self.parts.path_planner.taken();
        self.path_goals.path_made(&path.id, path.outcome, path.took);
        self.path_goals_changed();
    }

    /// Goals of an action are to be given up.
    fn cancel_goal(&mut self, kind: ActionKind, said: &ros::CancelGoalRequest, asked: &Request) {
        let goals = if kind.drives() { &mut self.journey.goals } else { &mut self.path_goals };
        let answer = goals.cancel(kind, said);
        asked.reply(&answer);
        if answer.goals_canceling.is_empty() {
            return;
        }
        if kind.drives() {
            let effects = self.journey.canceling();
            self.act(effects);
        } else {
            self.path_goals_changed();
        }
    }

    fn goals_of(&self, kind: ActionKind) -> &Goals {
        if kind.drives() { &self.journey.goals } else { &self.path_goals }
    }

    /// A client wants to know what has become of a goal: it is told when the goal has ended.
    fn get_result(&mut self, kind: ActionKind, id: ros::Uuid, asked: Request) {
        let goal = self.goals_of(kind).get(&id).filter(|goal| goal.kind == kind);
        if goal.is_none_or(|goal| goal.status.is_end()) {
            return self.parts.actions.result(kind, goal, self.parts.gate.robot_time(), &asked);
        }
        if self.results.len() < RESULTS_MAX {
            self.results.push((kind, id, asked));
        }
    }

    /// How goals that move the robot fare has changed.
    pub(super) fn goals_changed(&mut self) {
        self.parts.actions.status(&self.journey.goals, true);
        self.tell_results();
    }

    fn path_goals_changed(&mut self) {
        self.parts.actions.status(&self.path_goals, false);
        self.tell_results();
    }

    /// Answers those that wait for the end of goals that have ended.
    fn tell_results(&mut self) {
        let now = self.parts.gate.robot_time();
        let waiting = std::mem::take(&mut self.results);
        for (kind, id, asked) in waiting {
            match self.goals_of(kind).get(&id) {
                Some(goal) if !goal.status.is_end() => self.results.push((kind, id, asked)),
                goal => self.parts.actions.result(kind, goal, now, &asked),
            }
        }
    }

    /// Says how far the goal under way is.
    pub(super) fn feedback(&self) {
        let (Some(goal), Some((belief, ..))) = (self.journey.goals.active(), &self.belief) else { return };
        let Some(tour) = goal.tour().filter(|_| goal.status == Status::Executing) else { return };
        let at = Pose2::new(belief.x, belief.y, belief.heading);
        let beside = self.given.as_ref().map(|given| given.beside(at));
        let distance = beside.map_or_else(|| tour.distance(at.position()), |beside| beside.remaining);
        let remaining = distance / belief.v.max(0.1);
        let now = self.parts.gate.robot_time();
        let speed = belief.v;
        self.parts.actions.feedback(goal, &Progress { at, distance, remaining, speed, beside, now });
    }
}

/// The state of a node that is at work, or waits for what it needs.
fn state(is_active: bool) -> ros::GetStateResponse {
    let (id, label) = if is_active { (3, "active") } else { (2, "inactive") };
    ros::GetStateResponse { current_state: ros::LifecycleState { id, label: label.to_owned() } }
}
