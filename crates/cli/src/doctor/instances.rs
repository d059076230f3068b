//! Every instance that is alive: what it says of itself, and whether it answers where work is asked of it.

use std::collections::BTreeSet;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use curionav_pool::context::PlanContext;
use curionav_pool::generator;
use curionav_runtime::latency::Latency;
use curionav_runtime::probe::{RawReply, ask_everybody};
use curionav_schemas::{
    EvaluateRequest, GenerateReply, GenerateRequest, Message, Reject, Scores, ServiceStatus, keys,
};
use zenoh::Session;

use super::finding::Finding;
use crate::connect::ConnectOptions;
use crate::required_roles::{Alive, Need, ROBOT_ROLES};

const TIMEOUT: Duration = Duration::from_secs(1);
/// To fetch a map and derive its fields may take as long as this.
const WARM_UP_TIMEOUT: Duration = Duration::from_secs(10);
/// Example questions of the contract, for a replica of a robot without a mission.
const GENERATE_EXAMPLE: &[u8] = include_bytes!("../../../../schemas/golden/generate_request.cbor");
const EVALUATE_EXAMPLE: &[u8] = include_bytes!("../../../../schemas/golden/evaluate_request.cbor");
/// Questions a round trip is the median of.
const QUESTIONS: usize = 7;
/// Below this share of a round trip a clock's offset says nothing.
const OFFSET_WORTH_SAYING_MS: f64 = 100.0;

/// One service that has a liveliness token, and what it says.
pub(super) struct Instance {
    role: String,
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
        let (mut times, mut offsets) = (Latency::default(), Vec::new());
        let mut instance = Self {
            role: role.to_owned(),
            name: name.to_owned(),
            status: None,
            answering: 0,
            bytes: 0,
            round_trip_ms: 0.0,
            clock_offset_ms: None,
        };
        for _ in 0..QUESTIONS {
            let asked = now_s();
            let (replies, took) = ask_everybody(session, &key, None, TIMEOUT).await?;
            let statuses: Vec<ServiceStatus> = replies.iter().filter_map(|r| r.decode()?.ok()).collect();
            let Some(status) = statuses.first() else { break };
            instance.answering = instance.answering.max(statuses.len());
            instance.bytes += replies.iter().map(RawReply::bytes).sum::<usize>();
            times.record(took);
            offsets.push((took, (status.time_s - asked - took.as_secs_f64() / 2.0) * 1e3));
            instance.status = Some(status.clone());
        }
        instance.round_trip_ms = times.percentile_ms(0.5);
        // The fastest answer says most exactly what time it was.
        instance.clock_offset_ms =
            offsets.into_iter().min_by_key(|(took, _)| *took).map(|(_, offset)| offset);
        Ok(instance)
    }

    /// That it is there. One that does not answer is found to be missing by itself.
    pub(super) fn alive(&self) -> Alive<'_> {
        Alive { role: &self.role, instance: &self.name, status: self.status.as_ref() }
    }

    /// What it does.
    pub(super) fn role(&self) -> &str {
        &self.role
    }

    fn link(&self) -> String {
        format!("{} {}", self.role, self.name)
    }

    /// What there is to say about it. `context` is of a mission that asks its role for work, if there is one.
    pub(super) async fn examine(
        &self,
        session: &Session,
        at: &ConnectOptions,
        context: Option<&PlanContext>,
    ) -> anyhow::Result<Vec<Finding>> {
        let link = self.link();
        let is_pool = !ROBOT_ROLES.contains(&self.role.as_str()) && self.role != "simulator";
        let work = if is_pool { Some(self.work(session, context).await?) } else { None };
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
        let mut findings = Vec::new();
        let seen = format!("{:.1} kB of status in {:.2} ms", self.bytes as f64 / 1e3, self.round_trip_ms);
        let mut finding = match &work {
            Some(Err(failure)) => Finding::missing(
                link.clone(),
                format!("{seen}, but its work is not done: {failure}"),
                "look at its log; restart it if it hangs",
            ),
            Some(Ok(work)) => Finding::proven(link.clone(), format!("{seen}; {work}{}", self.clock())),
            None => Finding::proven(link.clone(), format!("{seen}{}", self.clock())),
        };
        finding.round_trip_ms = Some(self.round_trip_ms);
        finding.bytes = Some(self.bytes as u64);
        finding.clock_offset_ms = self.clock_offset_ms;
        findings.push(finding);
        findings.extend(self.oddities(status, at));
        if matches!(self.role.as_str(), "arbiter" | "driver") {
            findings.push(self.control_session(status));
        }
        Ok(findings)
    }

    fn clock(&self) -> String {
        match self.clock_offset_ms {
            Some(offset) if offset.abs() >= OFFSET_WORTH_SAYING_MS.max(self.round_trip_ms) => {
                format!(
                    "; its clock is {:.1} s {}",
                    offset.abs() / 1e3,
                    if offset > 0.0 { "ahead" } else { "behind" }
                )
            }
            _ => String::new(),
        }
    }

    /// Whether decisions and commands have a link of their own.
    fn control_session(&self, status: &ServiceStatus) -> Finding {
        let link = format!("{}: control session", self.link());
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

    fn oddities(&self, status: &ServiceStatus, at: &ConnectOptions) -> Vec<Finding> {
        let mut findings = Vec::new();
        let link = self.link();
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
            findings.push(Finding::note(
                format!("{link}: load"),
                format!("{:.1} questions for each it can compute at once", status.load),
                format!("start another on a machine with free cores: {}", self.another(at)),
            ));
        }
        findings
    }

    fn another(&self, at: &ConnectOptions) -> String {
        let taken = BTreeSet::from([self.name.clone()]);
        Need { role: self.role.clone(), robot: None }.fix(at, &taken)
    }

    /// Asks for work as the arbiter does: for nothing, which prepares a replica for the mission; without a
    /// mission for what it must refuse, its time being over.
    async fn work(
        &self,
        session: &Session,
        context: Option<&PlanContext>,
    ) -> anyhow::Result<Result<String, String>> {
        let robot = context.map_or("doctor", |context| &context.mission.order.robot);
        let key = keys::question(&self.role, &self.name, robot)?;
        if self.role == generator::ROLE {
            let request = match context {
                Some(context) => GenerateRequest { budget_ms: budget_ms(), ..context.warm_up_generator()? },
                None => {
                    let example = GenerateRequest::decode(GENERATE_EXAMPLE, None)?;
                    GenerateRequest { budget_ms: 0, iterations: 1, ..example }
                }
            };
            return asked::<_, GenerateReply>(session, &key, &request, context.is_some()).await;
        }
        let request = match context {
            Some(context) => EvaluateRequest { budget_ms: budget_ms(), ..context.warm_up(&self.role) },
            None => EvaluateRequest { budget_ms: 0, ..EvaluateRequest::decode(EVALUATE_EXAMPLE, None)? },
        };
        asked::<_, Scores>(session, &key, &request, context.is_some()).await
    }
}

fn budget_ms() -> u32 {
    WARM_UP_TIMEOUT.as_millis() as u32
}

/// Asks and judges: with a mission the answer must be one; without, a refusal shows as well that work arrives.
async fn asked<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    question: &Q,
    for_mission: bool,
) -> anyhow::Result<Result<String, String>> {
    let question = question.encode();
    let sent = question.len();
    let (replies, took) = ask_everybody(session, key, Some((question, Q::ENCODING)), WARM_UP_TIMEOUT).await?;
    let took_ms = took.as_secs_f64() * 1e3;
    let Some(reply) = replies.first() else { return Ok(Err("no answer where work is asked for".into())) };
    let crossed = format!("{:.1} kB of work asked, answered in {took_ms:.2} ms", sent as f64 / 1e3);
    Ok(match (reply.decode::<A>(), &reply.answer) {
        (Some(Ok(_)), _) if for_mission => Ok(format!("{crossed}: ready for the mission")),
        (Some(Ok(_)), _) => Ok(crossed),
        (Some(Err(error)), _) => Err(format!("an answer that is none: {error}")),
        (None, Err(Some(reject))) if for_mission => Err(refusal(reject)),
        (None, _) => Ok(format!("{crossed} (there is no mission to do it for)")),
    })
}

fn refusal(reject: &Reject) -> String {
    format!("refused: {reject}")
}

fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64())
}
