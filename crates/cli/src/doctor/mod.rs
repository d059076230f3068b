//! `curionav doctor`: asks over every link a deployment needs, and says what is missing and how to mend it.

mod finding;
mod instances;
mod rights;
mod robot;
mod router;

use std::collections::BTreeSet;
use std::time::Duration;

use clap::Args;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::membership::members;
use curionav_runtime::print::print;
use curionav_runtime::session::{self, SessionError};
use curionav_schemas::keys;
use zenoh::Session;

use crate::connect::{ConnectOptions, EXAMINES, is_of, robots_of};
use crate::denied::{denied, routers};
use crate::required_roles::{self, Alive, Missing, default_pools};
use curionav_runtime::exit::{Exit, FAILED, NO_NETWORK, SUCCESS};
use finding::{Finding, Report};
use instances::Instance;

/// How long a router is looked for, seconds: a person is waiting.
const CONNECT_TIMEOUT_S: f64 = 3.0;

/// Check every link that a deployment needs; report what is missing and how to fix it.
///
/// Looks for the router, asks every live instance for its status and for work, checks missions and maps,
/// and listens to each robot's streams. Needs nothing but the router.
///
/// Exit status: 0 all well; 1 something is missing; 2 bad input; 3 no router.
#[derive(Debug, Args)]
pub(crate) struct DoctorOptions {
    #[command(flatten)]
    at: ConnectOptions,
    /// Robot to check. Default: every robot that has a service.
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Seconds to listen to each robot's streams.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = parse_listen)]
    listen: f64,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

fn parse_listen(text: &str) -> Result<f64, String> {
    let within = text.parse::<f64>().ok().filter(|seconds| (0.1..=60.0).contains(seconds));
    within.ok_or_else(|| "must be 0.1 to 60 seconds".into())
}

pub(crate) async fn run(options: DoctorOptions) -> Result<u8, Exit> {
    let robot = options.robot.as_deref().map_or(Ok(()), keys::check_id);
    robot.map_err(|e| Exit::bad_input(anyhow::Error::from(e).context("robot")))?;
    let config = ServiceConfig {
        connect_timeout_s: CONNECT_TIMEOUT_S,
        ..options.at.config(&EXAMINES, options.robot.as_deref())?
    };
    let session = match session::client(&config).await {
        Ok(session) => session,
        Err(error @ SessionError::NoRouter { .. }) => {
            let fix = format!(
                "start it there: curionav router --listen tcp/0.0.0.0:7447; or use --connect to name one other than {}",
                options.at.place()
            );
            say(&options, vec![Finding::missing("router", error.to_string(), fix)])?;
            return Ok(NO_NETWORK);
        }
        Err(error) => return Err(error.into()),
    };
    let findings = examine(&options, &config, &session).await;
    session::close(&session);
    let report = say(&options, findings.map_err(Exit::network)?)?;
    Ok(if report.ok { SUCCESS } else { FAILED })
}

fn say(options: &DoctorOptions, findings: Vec<Finding>) -> Result<Report, Exit> {
    let report = Report::new(&options.at, findings);
    let printed = if options.json { print(serde_json::json!(report)) } else { print(&report) };
    printed.map(|()| report)
}

async fn examine(
    options: &DoctorOptions,
    config: &ServiceConfig,
    session: &Session,
) -> anyhow::Result<Vec<Finding>> {
    let mut findings = rights::examine(config, options.robot.as_deref());
    let routers = routers(config).await?;
    findings.push(router::examine(config, session, &routers).await?);
    findings
        .extend(denied(&routers).iter().map(|one| Finding::note("denied", one.words(), one.missing_right())));
    let listed = robots_of(config);
    let mut instances = Vec::new();
    for (role, names) in &members(session).await? {
        for name in names {
            let instance = Instance::ask(session, role, name).await?;
            instances.extend(is_of(instance.alive().status, &listed).then_some(instance));
        }
    }
    let alive: Vec<Alive<'_>> = instances.iter().map(Instance::alive).collect();
    let robots = match &options.robot {
        Some(robot) => BTreeSet::from([robot.clone()]),
        None => required_roles::robots(&alive, &listed),
    };
    let mut missions = Vec::new();
    for robot in &robots {
        missions.push(robot::Mission::ask(session, robot).await?);
    }
    let asked_of_pools: BTreeSet<String> = missions.iter().flat_map(robot::Mission::pool_roles).collect();
    let pools = if asked_of_pools.is_empty() { default_pools() } else { asked_of_pools };
    let asker = robots.first().map_or("doctor", String::as_str);
    for instance in &instances {
        // Robots may have different planners: a mission that has no use for a role has no work for it.
        let context = missions.iter().find_map(|mission| mission.asking(&instance.role));
        findings.extend(instance.examine(session, &options.at, asker, context).await?);
    }
    let tracked = missions.iter().filter_map(robot::Mission::tracked).collect();
    let missing = required_roles::missing(&robots, &tracked, &pools, &alive, &options.at).into_iter();
    findings.extend(missing.map(|Missing { what, fix }| Finding::missing(what, "none is alive", fix)));
    let gateways = alive.iter().filter(|one| one.role == keys::ROS2_GATEWAY);
    let gateways = gateways.filter_map(|one| one.status?.robot.as_deref()).collect();
    for mission in &missions {
        findings.extend(mission.findings(&options.at, &gateways));
    }
    findings.extend(robot::streams(session, &missions, Duration::from_secs_f64(options.listen)).await?);
    Ok(findings)
}
