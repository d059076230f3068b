//! Calls of the gateway's services by nodes of ROS: those of actions, of lifecycles and of parameters.

use curionav_ros2::cdr::CdrError;
use curionav_ros2::interface::Distribution;
use curionav_ros2::message::Message;
use curionav_ros2::messages::{self as ros, Part};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use crate::action_kind::ActionKind;
use crate::config::Ros2Config;
use crate::node::{Node, Request, Serving};
use crate::parameters::Question;

/// Calls that wait to be answered; each service has more that wait for a place here.
const WAITING: usize = 16;

/// Nodes of Nav2 that the gateway stands for: whether they are at work is asked by the services below their names.
const LOCALIZER: &str = "amcl";
const NAVIGATOR: &str = "bt_navigator";
const CONTROLLER: &str = "controller_server";

/// What a client wants.
pub(crate) enum Call {
    /// Something is to be done.
    SendGoal(Box<GoalRequest>),
    /// It is to be given up.
    CancelGoal(ActionKind, ros::CancelGoalRequest),
    /// What has become of it?
    GetResult(ActionKind, ros::Uuid),
    /// Is the localiser at work?
    LocalizerState,
    /// Would a goal be taken?
    NavigatorState,
    /// Something about the gateway's parameters.
    Parameters(Question),
}

/// A goal of an action.
pub(crate) struct GoalRequest {
    /// As the client has named it.
    pub(crate) id: ros::Uuid,
    /// Of which action.
    pub(crate) kind: ActionKind,
    /// What is to be done.
    pub(crate) wish: Wish,
}

/// What is to be done.
pub(crate) enum Wish {
    /// To go to poses.
    Go {
        /// One after the other.
        poses: Vec<ros::PoseStamped>,
        /// The first in the first round.
        first: u32,
        /// How often to begin again after the last.
        rounds: u32,
    },
    /// To follow a path.
    Follow(ros::Path),
    /// To find a path through poses.
    Plan {
        /// One after the other.
        poses: Vec<ros::PoseStamped>,
        /// Where it begins, unless at the robot.
        start: Option<ros::PoseStamped>,
    },
}

/// The calls of all services.
pub(crate) struct Calls {
    received: mpsc::Receiver<(Call, Request)>,
    tasks: JoinSet<()>,
    sender: mpsc::Sender<(Call, Request)>,
}

impl Calls {
    /// Declares the services.
    ///
    /// # Errors
    /// If one cannot be declared.
    pub(crate) fn new(node: &Node, config: &Ros2Config) -> anyhow::Result<Self> {
        let (sender, received) = mpsc::channel(WAITING);
        let mut calls = Self { received, tasks: JoinSet::new(), sender };
        for kind in ActionKind::of(config) {
            let of = OfAction { node, kind: *kind, name: kind.name(&config.topics) };
            calls.action(&of, config.distribution())?;
        }
        if config.is_controller() {
            calls.state(node, CONTROLLER, || Call::NavigatorState)?;
        } else {
            calls.state(node, LOCALIZER, || Call::LocalizerState)?;
            calls.state(node, NAVIGATOR, || Call::NavigatorState)?;
        }
        calls.parameters(node, &config.node)?;
        Ok(calls)
    }

    /// The next call, and where its answer goes. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Option<(Call, Request)> {
        self.received.recv().await
    }

    fn action(&mut self, of: &OfAction<'_>, distribution: Distribution) -> anyhow::Result<()> {
        use Distribution::{Jazzy, Lyrical};
        match (of.kind, distribution) {
            (ActionKind::NavigateToPose, _) => {
                self.parts::<ros::NavigatingTo, ros::Navigated>(of, |goal| go(vec![goal.pose]))
            }
            (ActionKind::NavigateThroughPoses, Jazzy) => {
                self.parts::<ros::ThroughPosesJazzy, ros::WentThroughJazzy>(of, |goal| go(goal.poses))
            }
            (ActionKind::NavigateThroughPoses, _) => {
                self.parts::<ros::ThroughPoses, ros::WentThrough>(of, |goal| go(goal.poses.goals))
            }
            (ActionKind::FollowWaypoints, Jazzy) => {
                self.parts::<ros::Waypoints, ros::FollowedWaypointsJazzy>(of, waypoints)
            }
            (ActionKind::FollowWaypoints, _) => {
                self.parts::<ros::Waypoints, ros::FollowedWaypoints>(of, waypoints)
            }
            (ActionKind::FollowPath, Lyrical) => self
                .parts::<ros::PathToFollowLyrical, ros::FollowedPath>(of, |goal| {
                    Wish::Follow(goal.earlier.path)
                }),
            (ActionKind::FollowPath, _) => {
                self.parts::<ros::PathToFollow, ros::FollowedPath>(of, |goal| Wish::Follow(goal.path))
            }
            (ActionKind::ComputePathToPose, Lyrical) => {
                self.parts::<ros::PathToLyrical, ros::PathFound>(of, |mut goal| {
                    goal.viapoints.push(goal.goal);
                    plan(goal.viapoints, goal.start, goal.use_start)
                })
            }
            (ActionKind::ComputePathToPose, _) => self.parts::<ros::PathTo, ros::PathFound>(of, |goal| {
                plan(vec![goal.goal], goal.start, goal.use_start)
            }),
            (ActionKind::ComputePathThroughPoses, Jazzy) => self
                .parts::<ros::PathThroughJazzy, ros::PathThroughFound>(of, |goal| {
                    plan(goal.goals, goal.start, goal.use_start)
                }),
            (ActionKind::ComputePathThroughPoses, Lyrical) => {
                self.parts::<ros::PathThrough, ros::PathThroughFoundLyrical>(of, through)
            }
            (ActionKind::ComputePathThroughPoses, _) => {
                self.parts::<ros::PathThrough, ros::PathThroughFound>(of, through)
            }
        }
    }

    /// The three services of an action whose goals and results are of these types.
    fn parts<G: Part + 'static, R: Part>(
        &mut self,
        of: &OfAction<'_>,
        wish: fn(G) -> Wish,
    ) -> anyhow::Result<()> {
        let OfAction { node, kind, .. } = *of;
        let goal = move |payload: &[u8]| -> Result<Call, CdrError> {
            let ros::SendGoalRequest { goal_id: id, goal } = ros::SendGoalRequest::<G>::decode(payload)?;
            Ok(Call::SendGoal(Box::new(GoalRequest { id, kind, wish: wish(goal) })))
        };
        let cancel = move |payload: &[u8]| {
            ros::CancelGoalRequest::decode(payload).map(|it| Call::CancelGoal(kind, it))
        };
        let result = move |payload: &[u8]| {
            ros::GetResultRequest::decode(payload).map(|it| Call::GetResult(kind, it.goal_id))
        };
        let most = ros::GetResultRequest::MAX_BYTES;
        self.serve(node.serving(&of.part("send_goal"), &G::INTERFACE, G::MAX_BYTES, Box::new(goal))?);
        self.serve(node.serving(
            &of.part("cancel_goal"),
            &ros::CancelGoalRequest::INTERFACE,
            ros::CancelGoalRequest::MAX_BYTES,
            Box::new(cancel),
        )?);
        self.serve(node.serving(&of.part("get_result"), &R::INTERFACE, most, Box::new(result))?);
        Ok(())
    }

    fn state(&mut self, node: &Node, name: &str, call: fn() -> Call) -> anyhow::Result<()> {
        let decode = move |payload: &[u8]| ros::GetStateRequest::decode(payload).map(|_| call());
        let most = ros::GetStateRequest::MAX_BYTES;
        let service = format!("{name}/get_state");
        self.serve(node.serving(&service, &ros::GetStateRequest::INTERFACE, most, Box::new(decode))?);
        Ok(())
    }

    fn parameters(&mut self, node: &Node, name: &str) -> anyhow::Result<()> {
        self.ask(node, &format!("{name}/list_parameters"), Question::List)?;
        self.ask(node, &format!("{name}/get_parameters"), Question::Get)?;
        self.ask(node, &format!("{name}/get_parameter_types"), Question::Types)?;
        self.ask(node, &format!("{name}/describe_parameters"), Question::Describe)?;
        self.ask(node, &format!("{name}/set_parameters"), |request: ros::SetParametersRequest| {
            Question::Set(request.parameters.len())
        })?;
        self.ask(
            node,
            &format!("{name}/set_parameters_atomically"),
            |_: ros::SetParametersAtomicallyRequest| Question::SetAtomically,
        )
    }

    fn ask<Q: Message + 'static>(
        &mut self,
        node: &Node,
        service: &str,
        question: fn(Q) -> Question,
    ) -> anyhow::Result<()> {
        let decode =
            move |payload: &[u8]| Q::decode(payload).map(|request| Call::Parameters(question(request)));
        self.serve(node.serving(service, &Q::INTERFACE, Q::MAX_BYTES, Box::new(decode))?);
        Ok(())
    }

    /// Takes calls of a service as they come: a flood of one service holds up no other.
    fn serve(&mut self, serving: Serving<Call>) {
        let sender = self.sender.clone();
        self.tasks.spawn(async move {
            while let Some(call) = serving.next().await {
                if sender.send(call).await.is_err() {
                    return;
                }
            }
        });
    }
}

/// An action whose services are declared.
struct OfAction<'a> {
    node: &'a Node,
    kind: ActionKind,
    name: &'a str,
}

impl OfAction<'_> {
    fn part(&self, name: &str) -> String {
        format!("{}/_action/{name}", self.name)
    }
}

fn go(poses: Vec<ros::PoseStamped>) -> Wish {
    Wish::Go { poses, first: 0, rounds: 0 }
}

fn waypoints(goal: ros::Waypoints) -> Wish {
    Wish::Go { poses: goal.poses, first: goal.goal_index, rounds: goal.number_of_loops }
}

fn plan(poses: Vec<ros::PoseStamped>, start: ros::PoseStamped, use_start: bool) -> Wish {
    Wish::Plan { poses, start: use_start.then_some(start) }
}

fn through(goal: ros::PathThrough) -> Wish {
    plan(goal.goals.goals, goal.start, goal.use_start)
}
