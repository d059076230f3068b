//! Turns goals of ROS into missions: knows which mission is under way, and how the goal fares that asked for it.
//!
//! Pure: nothing is sent from here. What has to be sent is returned, so that every course of events can be tested
//! without a network.

use curionav_planning::geometry::Point2;
use curionav_schemas::{Decision, Mission, MissionCommand, MissionEnd, MissionState, Reject, words};

use crate::action_kind::ActionKind;
use crate::goals::{Goal, Goals, Missed, Status, failure_of};
use crate::tour::Destination;

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
    /// The goal leads on from where the robot is, to its next place.
    GoOn(Destination),
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
    pub(crate) fn goal(&self) -> Option<Destination> {
        let order = &self.mission.as_ref().filter(|_| self.is_engaged())?.order;
        Some((Point2::new(order.goal_x, order.goal_y), order.goal_heading))
    }

    /// A goal of an action is taken; the one before, if one is under way, has failed.
    pub(crate) fn accept(&mut self, goal: Goal) -> bool {
        if self.goals.get(&goal.id).is_some() {
            return false;
        }
        self.goals.set(Status::Aborted, "another goal has taken its place");
        self.goals.accept(goal)
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
                effects.extend(self.ended(&mission));
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

    /// What becomes of the goal whose mission has ended.
    fn ended(&mut self, mission: &Mission) -> Vec<Effect> {
        let (status, why) = end(mission, self.goals.active().map(|goal| goal.status));
        let failure = mission.end.as_ref().and_then(failure_of);
        let ended = match failure {
            Some(failure) => match self.goals.missed_place(failure, &why) {
                Some(Missed::GoesOn(next)) => return vec![Effect::GoOn(next)],
                Some(Missed::Last) => self.goals.set(Status::Succeeded, ""),
                None => self.goals.end(status, &why, Some(failure)),
            },
            None => self.goals.set(status, &why),
        };
        ended.map(|_| Effect::Goals).into_iter().collect()
    }

    /// The robot is `here`: a way through poses goes on without a stop once it has come near to one.
    pub(crate) fn is_at(&mut self, here: Point2) -> Vec<Effect> {
        let may_pass = self.ours.is_some() && self.running() == self.ours && self.ending != self.ours;
        let passes = may_pass
            && self.asked.is_none()
            && self.goals.active().is_some_and(|goal| {
                goal.kind == ActionKind::NavigateThroughPoses
                    && goal.tour().is_some_and(|tour| tour.is_passed(here))
            });
        if !passes {
            return Vec::new();
        }
        self.ending = self.ours;
        self.goals.reached_place().map(Effect::GoOn).into_iter().collect()
    }

    /// The arbiter has decided: if the robot is at the goal of the mission that runs, the run is over, or
    /// leads on to its next place.
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
        if self.ours == Some(running)
            && let Some(next) = self.goals.reached_place()
        {
            return vec![Effect::GoOn(next)];
        }
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
#[path = "journey_tests.rs"]
mod tests;
