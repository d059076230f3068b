//! Every instance that is alive: what it says of itself, and whether it answers where work is asked of it.

use std::collections::BTreeSet;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use curionav_pool::context::PlanContext;
use curionav_ros2_gateway::problem::{Problem, ProblemKind};
use curionav_runtime::latency::Latency;
use curionav_runtime::probe::{RawReply, ask_all};
use curionav_schemas::{
    EvaluateRequest, GenerateReply, GenerateRequest, Message, Refusal, Reject, Scores, ServiceStatus, keys,
};
use zenoh::Session;

use super::finding::Finding;
use crate::blind::blindness;
use crate::connect::ConnectOptions;
use crate::doubt::doubt;
use crate::required_roles::{Alive, Need, ROBOT_ROLES};

const TIMEOUT: Duration = Duration::from_secs(1);
/// To fetch a map and derive its fields may take as long as this.
const WARM_UP_TIMEOUT: Duration = Duration::from_secs(10);
/// Between two questions to a replica that prepares.
const COLD_PAUSE: Duration = Duration::from_millis(50);
const QUESTIONS: usize = 7;
/// A smaller offset of a clock, or one below a round trip, is not worth saying.
const OFFSET_WORTH_SAYING_MS: f64 = 100.0;

#[derive(Default)]
pub(super) struct Instance {
    pub(super) role: String,
    name: String,
    status: Option<ServiceStatus>,
    /// Processes that answer under this name.
    answering: usize,
    bytes: usize,
    round_trip_ms: f64,
    clock_offset_ms: Option<f64>,
}

impl Instance {
    pub(super) async fn ask(session: &Session, role: &str, name: &str) -> anyhow::Result<Self> {
        let key = keys::status(role, name)?;
        let mut times = Latency::default();
        let mut fastest = Duration::MAX;
        let mut instance = Self { role: role.to_owned(), name: name.to_owned(), ..Self::default() };
        for _ in 0..QUESTIONS {
            let asked = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64();
            let (replies, took) = ask_all(session, &key, None, TIMEOUT).await?;
            let statuses: Vec<ServiceStatus> = replies.iter().filter_map(|r| r.decode()?.ok()).collect();
            let Some(status) = statuses.first() else { break };
            instance.answering = instance.answering.max(statuses.len());
            instance.bytes += replies.iter().map(RawReply::bytes).sum::<usize>();
            times.record(took);
            // The fastest answer says most exactly what time it was.
            if took < fastest {
                fastest = took;
                instance.clock_offset_ms = Some((status.time_s - asked - took.as_secs_f64() / 2.0) * 1e3);
            }
            instance.status = Some(status.clone());
        }
        instance.round_trip_ms = times.percentile_ms(0.5);
        Ok(instance)
    }

    /// That it is there. One that does not answer is found to be missing by itself.
    pub(super) fn alive(&self) -> Alive<'_> {
        Alive { role: &self.role, instance: &self.name, status: self.status.as_ref() }
    }

    /// What there is to say about it. Work is asked for in the name of the robot `asker`, and `context` is of a mission
    /// that asks its role for work, if there is one.
    pub(super) async fn examine(
        &self,
        session: &Session,
        at: &ConnectOptions,
        asker: &str,
        context: Option<&PlanContext>,
    ) -> anyhow::Result<Vec<Finding>> {
        let link = format!("{} {}", self.role, self.name);
        let is_pool = !ROBOT_ROLES.contains(&self.role.as_str())
            && ![keys::TRACKER, keys::ROS2_GATEWAY, "simulator"].contains(&self.role.as_str());
        let work = if is_pool { Some(self.work(session, asker, context).await?) } else { None };
        let Some(status) = &self.status else {
            return Ok(vec![match work {
                Some(Ok(work)) => Finding::proven(link, format!("keeps no status; {work}")),
                _ => Finding::missing(
                    link,
                    "is alive by its token, but answers no question",
                    "it hangs, or the router's access_control keeps questions from it: look at its log, restart it",
                ),
            }]);
        };
        let seen = format!("{:.1} kB of status in {:.2} ms", self.bytes as f64 / 1e3, self.round_trip_ms);
        let finding = match &work {
            Some(Err(failure)) => Finding::missing(
                &link,
                format!("{seen}, but its work is not done: {failure}"),
                "look at its log; restart it if it hangs",
            ),
            Some(Ok(work)) => Finding::proven(&link, format!("{seen}; {work}{}", self.clock())),
            None => Finding::proven(&link, format!("{seen}{}", self.clock())),
        };
        let mut findings = vec![Finding {
            round_trip_ms: Some(self.round_trip_ms),
            bytes: Some(self.bytes as u64),
            clock_offset_ms: self.clock_offset_ms,
            ..finding
        }];
        findings.extend(self.oddities(&link, status, at));
        if ["arbiter", "driver", keys::ROS2_GATEWAY].contains(&self.role.as_str()) {
            findings.push(control_session(&link, status));
        }
        let problems = status.metrics.keys().filter_map(|sample| Problem::of_sample(sample));
        findings.extend(problems.map(|problem| on_the_robot(&link, &problem)));
        findings.extend(blindness(status).map(|why| Finding::missing(&link, why, LOOK_AT_THE_LASER)));
        findings.extend(doubt(status).map(|why| Finding::missing(&link, why, UNSURE)));
        Ok(findings)
    }

    fn clock(&self) -> String {
        let worth_saying = OFFSET_WORTH_SAYING_MS.max(self.round_trip_ms);
        let offset = self.clock_offset_ms.filter(|offset| offset.abs() >= worth_saying);
        offset.map_or(String::new(), |offset| {
            let side = if offset > 0.0 { "ahead" } else { "behind" };
            format!("; its clock is {:.1} s {side}", offset.abs() / 1e3)
        })
    }

    fn oddities(&self, link: &str, status: &ServiceStatus, at: &ConnectOptions) -> Vec<Finding> {
        let mut findings = Vec::new();
        if self.answering > 1 {
            findings.push(Finding::missing(
                format!("{link}: name"),
                format!("{} processes call themselves that", self.answering),
                "give each an --instance of its own",
            ));
        }
        let ours = env!("CARGO_PKG_VERSION");
        if status.version != ours {
            findings.push(Finding::note(
                format!("{link}: version"),
                format!("is curionav {}, this is {ours}", status.version),
                "run the same version everywhere",
            ));
        }
        if status.load > 2.0 {
            let another = Need { role: self.role.clone(), robot: None };
            let another = another.fix(at, &BTreeSet::from([self.name.clone()]));
            findings.push(Finding::note(
                format!("{link}: load"),
                format!("{:.1} questions for each it can compute at once", status.load),
                format!("start another on a machine with free cores: {another}"),
            ));
        }
        findings
    }

    /// Asks for work as the arbiter does, but without candidates, which prepares a replica for the mission. Without a
    /// mission the question has no content: that it is refused shows that work arrives.
    async fn work(
        &self,
        session: &Session,
        asker: &str,
        context: Option<&PlanContext>,
    ) -> anyhow::Result<Result<String, String>> {
        let key = keys::question(
            &self.role,
            &self.name,
            context.map_or(asker, |context| &context.mission.order.robot),
        )?;
        let budget_ms = WARM_UP_TIMEOUT.as_millis() as u32;
        let is_generator = keys::generates(&self.role);
        let question = match context {
            None => Vec::new(),
            Some(context) if is_generator => context.warm_up_generator().encode(budget_ms),
            Some(context) => context.warm_up().shard(&self.role, 0, 0..0).encode(budget_ms),
        };
        let encoding = if is_generator { GenerateRequest::ENCODING } else { EvaluateRequest::ENCODING };
        let sent = question.len() as f64 / 1e3;
        // A replica that has to prepare says so at once, and prepares.
        let asked = tokio::time::Instant::now();
        let (reply, took) = loop {
            let (replies, took) =
                ask_all(session, &key, Some((question.clone(), encoding)), WARM_UP_TIMEOUT).await?;
            let Some(reply) = replies.into_iter().next() else {
                return Ok(Err("no answer where work is asked for".into()));
            };
            let is_cold = matches!(&reply.answer, Err(Reject { why: Refusal::Cold { .. }, .. }));
            if !is_cold || asked.elapsed() > WARM_UP_TIMEOUT {
                break (reply, took);
            }
            tokio::time::sleep(COLD_PAUSE).await;
        };
        let took_ms = took.as_secs_f64() * 1e3;
        let fault = match is_generator {
            true => reply.decode::<GenerateReply>().map(Result::err),
            false => reply.decode::<Scores>().map(Result::err),
        };
        Ok(match (fault, &reply.answer) {
            (Some(None), _) => {
                Ok(format!("{sent:.1} kB of work asked, answered in {took_ms:.2} ms: ready for the mission"))
            }
            (Some(Some(fault)), _) => Err(format!("an answer that is none: {fault}")),
            (None, Err(reject)) if context.is_some() => Err(format!("refused: {reject}")),
            (None, _) => {
                Ok(format!("asked for work, answered in {took_ms:.2} ms (there is no mission to do it for)"))
            }
        })
    }
}

/// What to do about a laser that sees too little.
const LOOK_AT_THE_LASER: &str = "look at the laser, and at [scanner] in the driver's configuration";

/// What to do about a robot that is not sure where it is.
const UNSURE: &str = "wait until it has found itself, or begin a mission with its present pose";

/// What a gateway has found wrong among the nodes of its robot.
fn on_the_robot(link: &str, problem: &Problem) -> Finding {
    let fix = match problem.kind {
        ProblemKind::SecondPublisher => "end that node, or give one of both another topic: docs/ros2.md",
        ProblemKind::OtherType => "give `stamped` and `distribution` in [ros2] as the robot has them",
        ProblemKind::NotUsed => "mend what publishes it, or the names of topics and frames in [ros2]",
        ProblemKind::Silent => "look at the node that publishes it, or at the driver",
        ProblemKind::Unheard => {
            "look at the node that publishes it, or take the sensor out of [[ros2.sensors]]"
        }
        ProblemKind::Pressed => {
            "look what the robot touches; a bumper that sticks says so until it is released"
        }
        ProblemKind::Blind => LOOK_AT_THE_LASER,
        ProblemKind::Rate => "give limits.tick_s the time that lies between two messages of odometry",
        ProblemKind::Paused => "curionav resume ROBOT",
        ProblemKind::Stopped => {
            "look at the service that it names: the arbiter decides, the localizer believes"
        }
        ProblemKind::Unsure => UNSURE,
        ProblemKind::Refused => "look at the driver's log and at [limits]",
        ProblemKind::Awaited => {
            "start what publishes it, or mend `endpoint` and the names of topics in [ros2]"
        }
    };
    Finding::missing(format!("{link}: {}", problem.topic), problem.sentence(), fix)
}

fn control_session(link: &str, status: &ServiceStatus) -> Finding {
    let link = format!("{link}: control session");
    let is_control =
        |name: &str| name.starts_with("curionav_router_links{") && name.contains("session=\"control\"");
    match status.metrics.iter().find(|(name, _)| is_control(name)).map(|(_, routers)| *routers) {
        Some(routers) if routers > 0.0 => Finding::proven(link, "two sessions, both with a router"),
        Some(_) => Finding::missing(
            link,
            "the session for decisions and commands has no router",
            "wait a second for it to come back, then restart the service",
        ),
        None => Finding::missing(
            link,
            "decisions and commands share a session with everything else",
            "restart the service while its router is reachable",
        ),
    }
}
