//! Turns goals of ROS into missions: knows which mission is under way, and how the goal fares that asked for it.
//!
//! Pure: nothing is sent from here. What has to be sent is returned, so that every course of events can be tested
//! without a network.

use curionav_planning::geometry::Point2;
use curionav_ros2::messages::{Time, Uuid};
use curionav_schemas::{Decision, Mission, MissionCommand, MissionEnd, MissionState, Reject, words};

use crate::goals::{self, Goals, Status};

/// Why a mission was ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To go somewhere.
    Goal,
    /// To find out where the robot is. It stands meanwhile, and the mission is cancelled as soon as all services are
    /// ready for it.
    Localize,
}

/// A mission by its run and revision. A driver that was started anew counts revisions from 1 on, in a later run.
pub(crate) type Id = (u64, u64);

pub(crate) fn id(mission: &Mission) -> Id {
    (mission.run, mission.revision)
}

/// What the driver has been asked and has not answered.
#[derive(Debug, Clone, Copy)]
struct Asked {
    number: u64,
    purpose: Purpose,
    /// Whether it changes the goal of the run that is under way.
    is_change: bool,
}

/// What has to be done because of what has happened.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Effect {
    /// The driver has to be told.
    Tell(MissionCommand),
    /// How goals fare has changed.
    Goals,
    /// No trajectory is driven any more.
    NoPlan,
    /// The driver would not change the goal of its run: a new run has to be ordered.
    OrderAnew,
    /// The driver has refused a mission.
    Refused(Reject),
}

/// The robot's way through its missions.
#[derive(Debug, Default)]
pub(crate) struct Journey {
    /// The goals of the action.
    pub(crate) goals: Goals,
    mission: Option<Mission>,
    asked: Option<Asked>,
    /// The mission by which the goal of ROS is under way.
    ours: Option<Id>,
    /// The one that only localises.
    localizing: Option<Id>,
    /// The one that runs, and the tick since which it does.
    running: Option<(Id, u64)>,
    /// The one that has been told to end.
    ending: Option<Id>,
    /// The one that must not move the robot any more, whatever the driver still says of it.
    failed: Option<Id>,
}

impl Journey {
    /// The newest mission.
    pub(crate) fn mission(&self) -> Option<&Mission> {
        self.mission.as_ref()
    }

    /// Whether a mission is under way that moves the robot. After the driver has been asked for a mission that only
    /// localises, none counts until it has answered. The newest mission may be that one: its state can come before the
    /// answer.
    pub(crate) fn is_engaged(&self) -> bool {
        let may_localize = self.asked.is_some_and(|asked| asked.purpose == Purpose::Localize);
        !may_localize
            && self.mission.as_ref().is_some_and(|mission| {
                let stands = [self.localizing, self.failed].contains(&Some(id(mission)));
                !mission.is_over() && !stands
            })
    }

    /// Whether the mission that only localises is under way.
    pub(crate) fn is_localizing(&self) -> bool {
        self.mission
            .as_ref()
            .is_some_and(|mission| Some(id(mission)) == self.localizing && !mission.is_over())
    }

    /// The mission whose services are all at work.
    pub(crate) fn running(&self) -> Option<Id> {
        self.running.map(|(of, _)| of)
    }

    /// Whether the driver has been asked for a mission and has not answered.
    pub(crate) fn is_asking(&self) -> bool {
        self.asked.is_some()
    }

    /// Where the mission that is under way leads.
    pub(crate) fn goal(&self) -> Option<(Point2, Option<f64>)> {
        let order = &self.mission.as_ref().filter(|_| self.is_engaged())?.order;
        Some((Point2::new(order.goal_x, order.goal_y), order.goal_heading))
    }

    /// A goal of the action is taken; the one before, if one is under way, has failed.
    pub(crate) fn accept(&mut self, id: Uuid, now: Time) -> bool {
        if self.goals.get(&id).is_some() {
            return false;
        }
        self.goals.set(Status::Aborted, "another goal has taken its place");
        self.goals.accept(id, now)
    }

    /// A goal has come by the topic, so a goal of the action that is under way has failed.
    pub(crate) fn replaced(&mut self) -> Vec<Effect> {
        self.abort("another goal has taken its place")
    }

    /// The driver has been asked to go to a goal.
    pub(crate) fn asked_to_go(&mut self, number: u64, is_change: bool) {
        self.asked = Some(Asked { number, purpose: Purpose::Goal, is_change });
        self.localizing = None;
    }

    /// The driver has been asked for a mission that only localises.
    pub(crate) fn asked_to_localize(&mut self, number: u64) {
        self.asked = Some(Asked { number, purpose: Purpose::Localize, is_change: false });
    }

    fn abort(&mut self, why: &str) -> Vec<Effect> {
        self.goals.set(Status::Aborted, why).map(|_| Effect::Goals).into_iter().collect()
    }

    /// Whatever is under way has failed for the reason `why`, and the robot must not go on with it.
    pub(crate) fn fail(&mut self, why: &str) -> Vec<Effect> {
        let mut effects = self.abort(why);
        if self.asked.take().is_some() || self.is_engaged() {
            effects.extend([Effect::Tell(MissionCommand::Cancel), Effect::NoPlan]);
        }
        self.ours = None;
        self.running = None;
        self.failed = self.mission.as_ref().map(id);
        effects
    }

    /// The driver says nothing any more: the mission that it had is lost with it.
    pub(crate) fn forget_mission(&mut self) -> Vec<Effect> {
        let mut effects = self.abort("the driver is gone");
        let goals = std::mem::take(&mut self.goals);
        *self = Self { goals, ..Self::default() };
        effects.push(Effect::NoPlan);
        effects
    }

    /// A client gives goals up: the driver is told to cancel. If it has not answered yet which mission is theirs, it is
    /// told when it answers ([`Self::answered`]).
    pub(crate) fn canceling(&self) -> Vec<Effect> {
        if self.asked.is_some() {
            return vec![Effect::Goals];
        }
        vec![Effect::Goals, Effect::Tell(MissionCommand::Cancel)]
    }

    /// The driver has answered.
    pub(crate) fn answered(
        &mut self,
        number: u64,
        outcome: Result<Mission, Reject>,
        tick: u64,
    ) -> Vec<Effect> {
        let Some(asked) = self.asked.filter(|asked| asked.number == number) else {
            // It answers the command to end a mission, or an order that a later order has replaced.
            return outcome.map_or_else(|_| Vec::new(), |mission| self.said(mission, tick));
        };
        self.asked = None;
        let mission = match outcome {
            Ok(mission) => mission,
            Err(_) if asked.is_change => return vec![Effect::OrderAnew],
            Err(reject) => {
                let mut effects = self.abort(&words::say("refusal", &reject.why));
                effects.push(Effect::Refused(reject));
                return effects;
            }
        };
        let mut effects = Vec::new();
        let ordered = Some(id(&mission));
        match asked.purpose {
            Purpose::Localize => self.localizing = ordered,
            Purpose::Goal => {
                self.ours = ordered;
                self.localizing = None;
                match self.goals.active().map(|goal| goal.status) {
                    Some(Status::Canceling) => effects.push(Effect::Tell(MissionCommand::Cancel)),
                    Some(_) => {
                        self.goals.set(Status::Executing, "");
                        effects.push(Effect::Goals);
                    }
                    None => {}
                }
            }
        }
        // The driver also publishes the mission. If that has come before the answer, it is newer than the answer.
        let newest = self.mission.take_if(|known| Some(id(known)) >= ordered).unwrap_or(mission);
        self.running = None;
        effects.extend(self.said(newest, tick));
        effects
    }

    /// The driver has said how the mission stands, at `tick` of the robot.
    pub(crate) fn said(&mut self, mission: Mission, tick: u64) -> Vec<Effect> {
        let mut effects = Vec::new();
        let newest = id(&mission);
        if self.mission.as_ref().is_some_and(|known| newest < id(known)) {
            return effects;
        }
        if mission.state == MissionState::Running && self.running.is_none_or(|(of, _)| of != newest) {
            self.running = Some((newest, tick));
            if self.localizing == Some(newest) {
                effects.push(Effect::Tell(MissionCommand::Cancel));
            }
        }
        let was_engaged = self.is_engaged();
        match self.ours {
            Some(ours) if ours == newest && mission.is_over() => {
                self.ours = None;
                let (status, why) = end(&mission, self.goals.active().map(|goal| goal.status));
                let ended = match mission.end.as_ref().and_then(goals::error_of) {
                    Some(error) => self.goals.end(status, &why, error),
                    None => self.goals.set(status, &why),
                };
                effects.extend(ended.map(|_| Effect::Goals));
            }
            Some(ours) if ours < newest && self.asked.is_none() => {
                self.ours = None;
                effects.extend(self.abort("another mission has been ordered"));
            }
            _ => {}
        }
        self.mission = Some(mission);
        if was_engaged && !self.is_engaged() {
            effects.push(Effect::NoPlan);
        }
        effects
    }

    /// The arbiter has decided: if the robot is at the goal of the mission that runs, the run is over.
    pub(crate) fn decided(&mut self, decision: &Decision) -> Vec<Effect> {
        let Some(mission) = self.mission.as_ref().filter(|m| m.state == MissionState::Running) else {
            return Vec::new();
        };
        let running = id(mission);
        let revision = mission.revision;
        // A decision from before this mission ran is about the previous goal.
        let is_of_it = self.running.is_some_and(|(of, since)| of == running && decision.tick >= since);
        let is_end = decision.arrived && is_of_it && self.is_engaged() && self.ending != Some(running);
        if !is_end {
            return Vec::new();
        }
        self.ending = Some(running);
        vec![Effect::Tell(MissionCommand::Finish { revision, end: MissionEnd::Reached })]
    }
}

/// How the goal of a mission that has ended fares from now on, and why. `until_now` is how it has fared so far.
fn end(mission: &Mission, until_now: Option<Status>) -> (Status, String) {
    match &mission.end {
        Some(MissionEnd::Reached) => (Status::Succeeded, String::new()),
        Some(MissionEnd::Cancelled) if until_now == Some(Status::Canceling) => {
            (Status::Canceled, String::new())
        }
        Some(end) => (Status::Aborted, words::say("end", end)),
        None => (Status::Aborted, mission.state.name().to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::Refusal;
    use curionav_testing::golden;

    use super::*;

    fn mission(revision: u64, state: MissionState, end: Option<MissionEnd>) -> Mission {
        Mission { run: 1, revision, state, end, ..golden::mission() }
    }

    const NOW: Time = Time { sec: 1, nanosec: 0 };
    const GOAL: Uuid = [7; 16];

    /// A goal of the action that runs as revision 3, since tick 10.
    fn under_way() -> Journey {
        let mut journey = Journey::default();
        assert!(journey.accept(GOAL, NOW));
        journey.asked_to_go(1, false);
        let effects = journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 8);
        assert_eq!(effects, [Effect::Goals]);
        assert_eq!(journey.said(mission(3, MissionState::Running, None), 10), []);
        assert!(journey.is_engaged());
        journey
    }

    fn status(journey: &Journey) -> (Status, String) {
        let goal = journey.goals.get(&GOAL).unwrap();
        (goal.status, goal.why.clone())
    }

    fn arrived(tick: u64) -> Decision {
        Decision { tick, arrived: true, ..golden::stop() }
    }

    #[test]
    fn a_robot_that_arrives_has_reached_its_goal() {
        let mut journey = under_way();
        assert_eq!(journey.decided(&arrived(9)), [], "it was decided for the goal before");
        let finish = MissionCommand::Finish { revision: 3, end: MissionEnd::Reached };
        assert_eq!(journey.decided(&arrived(12)), [Effect::Tell(finish)]);
        assert_eq!(journey.decided(&arrived(13)), [], "once is enough");
        let effects = journey.said(mission(3, MissionState::Finished, Some(MissionEnd::Reached)), 14);
        assert_eq!(effects, [Effect::Goals, Effect::NoPlan]);
        assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Succeeded, false));
    }

    #[test]
    fn a_goal_is_canceled_only_if_its_client_gave_it_up() {
        let cancelled = || mission(3, MissionState::Cancelled, Some(MissionEnd::Cancelled));
        let mut journey = under_way();
        journey.goals.cancel(&Default::default());
        assert_eq!(journey.canceling(), [Effect::Goals, Effect::Tell(MissionCommand::Cancel)]);
        journey.said(cancelled(), 20);
        assert_eq!(status(&journey).0, Status::Canceled);
        let mut journey = under_way();
        journey.said(cancelled(), 20);
        assert_eq!(status(&journey).0, Status::Aborted);
    }

    #[test]
    fn a_goal_given_up_before_the_driver_answers_never_runs() {
        let mut journey = Journey::default();
        journey.accept(GOAL, NOW);
        journey.asked_to_go(1, false);
        journey.goals.cancel(&Default::default());
        assert_eq!(journey.canceling(), [Effect::Goals]);
        let effects = journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 8);
        assert_eq!(effects, [Effect::Tell(MissionCommand::Cancel)]);
        journey.said(mission(3, MissionState::Cancelled, Some(MissionEnd::Cancelled)), 9);
        assert_eq!(status(&journey).0, Status::Canceled);
    }

    #[test]
    fn a_new_goal_takes_the_place_of_the_one_before() {
        let mut journey = under_way();
        assert!(!journey.accept(GOAL, NOW), "a name counts once");
        assert!(journey.accept([8; 16], NOW));
        assert_eq!(status(&journey).0, Status::Aborted);
        journey.asked_to_go(2, true);
        // What the driver says of the old revision meanwhile concerns no goal any more.
        assert_eq!(journey.said(mission(3, MissionState::Running, None), 20), []);
        journey.answered(2, Ok(mission(4, MissionState::Preparing, None)), 21);
        assert_eq!(
            journey.goals.active().map(|goal| (goal.id, goal.status)),
            Some(([8; 16], Status::Executing))
        );
        assert_eq!(journey.said(mission(3, MissionState::Running, None), 22), [], "it is older");
        journey.said(mission(4, MissionState::Running, None), 23);
        assert_eq!(journey.decided(&arrived(22)), []);
        assert_eq!(journey.decided(&arrived(23)).len(), 1);
    }

    #[test]
    fn another_clients_mission_replaces_the_goal_and_moves_the_base() {
        let mut journey = under_way();
        assert_eq!(journey.said(mission(4, MissionState::Preparing, None), 20), [Effect::Goals]);
        assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Aborted, true));
        journey.said(mission(4, MissionState::Running, None), 22);
        assert_eq!(journey.decided(&arrived(25)).len(), 1, "the base ends that run too");
    }

    #[test]
    fn a_robot_that_only_localises_stands() {
        let mut journey = Journey::default();
        journey.asked_to_localize(1);
        journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 0);
        assert!(!journey.is_engaged());
        let effects = journey.said(mission(1, MissionState::Running, None), 5);
        assert_eq!((effects, journey.is_engaged()), (vec![Effect::Tell(MissionCommand::Cancel)], false));
        assert_eq!(journey.decided(&arrived(6)), []);
    }

    #[test]
    fn a_state_that_comes_before_the_answer_is_kept_and_moves_no_localising_robot() {
        let mut journey = Journey::default();
        journey.asked_to_localize(1);
        assert_eq!(journey.said(mission(1, MissionState::Running, None), 5), []);
        assert!(!journey.is_engaged());
        let effects = journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 6);
        assert_eq!((effects, journey.is_engaged()), (vec![Effect::Tell(MissionCommand::Cancel)], false));
        assert!(journey.is_localizing() && journey.running() == Some((1, 1)));
        // A mission of another client came meanwhile: that one moves the robot.
        let mut journey = Journey::default();
        journey.asked_to_localize(1);
        journey.said(mission(2, MissionState::Running, None), 5);
        assert_eq!(journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 6), []);
        assert!(journey.is_engaged() && !journey.is_localizing());
        // A goal whose mission has ended before the answer has come.
        let mut journey = Journey::default();
        journey.accept(GOAL, NOW);
        journey.asked_to_go(1, false);
        journey.said(mission(3, MissionState::Finished, Some(MissionEnd::Reached)), 20);
        journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 21);
        assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Succeeded, false));
    }

    #[test]
    fn a_restarted_driver_has_new_missions_even_with_the_same_revision() {
        let of_later_run = |state| Mission { run: 2, ..mission(3, state, None) };
        let mut journey = under_way();
        journey.decided(&arrived(12));
        journey.fail("the robot's clock was set back");
        journey.accept([8; 16], NOW);
        journey.asked_to_go(2, false);
        journey.answered(2, Ok(of_later_run(MissionState::Preparing)), 20);
        assert!(journey.is_engaged(), "only the mission before had failed");
        journey.said(of_later_run(MissionState::Running), 21);
        assert_eq!(journey.decided(&arrived(22)).len(), 1, "only the mission before was told to end");
        // A restart while a goal is under way: it is of no mission any more.
        let mut journey = under_way();
        let fresh = Mission { run: 2, ..mission(1, MissionState::Preparing, None) };
        assert_eq!(journey.said(fresh, 20), [Effect::Goals]);
        assert_eq!(status(&journey).0, Status::Aborted);
    }

    #[test]
    fn a_refused_goal_fails_but_a_refused_change_is_ordered_anew() {
        let reject = || Reject::from(curionav_schemas::Refusal::NoMission);
        let mut journey = Journey::default();
        journey.accept(GOAL, NOW);
        journey.asked_to_go(1, true);
        assert_eq!(journey.answered(1, Err(reject()), 0), [Effect::OrderAnew]);
        assert_eq!(status(&journey).0, Status::Accepted);
        journey.asked_to_go(2, false);
        assert_eq!(journey.answered(2, Err(reject()), 0), [Effect::Goals, Effect::Refused(reject())]);
        assert_eq!(status(&journey).0, Status::Aborted);
        assert!(!status(&journey).1.is_empty());
    }

    #[test]
    fn a_role_that_cannot_prepare_fails_the_goal_and_says_why() {
        let (role, instance) = ("localizer".to_owned(), "a".to_owned());
        let reject = curionav_schemas::Refusal::PoseLost.at("localizer");
        let mut journey = under_way();
        let end = MissionEnd::Unprepared { role, instance, reject };
        journey.said(mission(3, MissionState::Finished, Some(end)), 20);
        assert!(status(&journey).0 == Status::Aborted && status(&journey).1.contains("localizer"));
    }

    #[test]
    fn a_goal_without_a_way_fails_with_the_number_that_nav2_has_for_it() {
        let unprepared = |refusal: Refusal| MissionEnd::Unprepared {
            role: "arbiter".into(),
            instance: "a".into(),
            reject: refusal.at("goal"),
        };
        for (end, error) in [
            (MissionEnd::NoWayToGoal, 208),
            (MissionEnd::GoalOccupied, 206),
            (unprepared(Refusal::UnreachableGoal { x: 1.0, y: 2.0 }), 208),
            (unprepared(Refusal::NoRoomAtGoal { x: 1.0, y: 2.0, room: 0.1, radius: 0.3 }), 206),
            (MissionEnd::Lost, 9000),
        ] {
            let mut journey = under_way();
            journey.said(mission(3, MissionState::Finished, Some(end)), 20);
            let goal = journey.goals.get(&GOAL).unwrap();
            assert_eq!((goal.status, goal.error), (Status::Aborted, error), "{goal:?}");
        }
    }

    #[test]
    fn a_goal_fails_when_the_clock_is_set_back_or_the_driver_goes() {
        let mut journey = under_way();
        let effects = journey.fail("the robot's clock was set back");
        assert_eq!(effects, [Effect::Goals, Effect::Tell(MissionCommand::Cancel), Effect::NoPlan]);
        assert!(!journey.is_engaged());
        journey.said(mission(3, MissionState::Running, None), 21);
        assert!(!journey.is_engaged(), "the driver has not heard of it yet");
        let mut journey = under_way();
        assert_eq!(journey.forget_mission(), [Effect::Goals, Effect::NoPlan]);
        assert!(!journey.is_engaged() && status(&journey).0 == Status::Aborted);
        // A driver that was started anew counts its revisions from 1 on, in a later run.
        let fresh = Mission { run: 2, ..mission(1, MissionState::Preparing, None) };
        journey.said(fresh, 0);
        assert!(journey.is_engaged());
    }
}
