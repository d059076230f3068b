//! `curionav demo`: a scenario in real time, with the viewer.

mod viewer;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use curionav_deployment::embedded::Embedded;
use curionav_deployment::files;
use curionav_deployment::package::{self, Choice};
use curionav_deployment::service_kind::Kind;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::print::note;
use curionav_runtime::session::{self, RouterSettings};
use curionav_runtime::shutdown::{Shutdown, on_signals};
use curionav_schemas::Clock;
use zenoh::Session;

use crate::run::{follow_or_cancel, parse_speed, show};
use viewer::Viewer;

/// A free port of this machine, which no other machine reaches.
const LISTEN: &str = "tcp/127.0.0.1:0";

/// Play a scenario in real time and show it in the viewer, or else draw it.
#[derive(Debug, Args)]
pub(crate) struct DemoOptions {
    /// Scenario file, or the built-in `quickstart`.
    #[arg(value_name = "SCENARIO.toml", default_value = "quickstart")]
    scenario: PathBuf,
    /// Planner: a built-in profile, or a profile file (.toml). Default: the scenario's.
    #[arg(long, value_name = "PROFILE")]
    planner: Option<String>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// realtime, or simulated seconds per second.
    #[arg(long, value_name = "realtime|X", default_value = "realtime", value_parser = parse_speed)]
    speed: (Clock, f64),
    /// Show it in a browser even where a window can be opened.
    #[arg(long)]
    web: bool,
    /// Print the address of the page instead of opening a browser on it.
    #[arg(long)]
    no_browser: bool,
    /// End with the run. Otherwise the viewer stays until it is closed, or until Ctrl-C.
    #[arg(long)]
    once: bool,
    /// Directory for metrics.json, trajectory.csv, cycles.csv and run.svg if there is no viewer.
    #[arg(long, value_name = "DIR", default_value = "curionav-demo")]
    out: PathBuf,
}

pub(crate) async fn run(options: DemoOptions) -> Result<u8, Exit> {
    let (clock, time_scale) = options.speed;
    let choice = Choice { planner: options.planner.clone(), seed: Some(options.seed), ..Choice::default() };
    let package = package::read(&options.scenario, &choice, clock, time_scale).map_err(Exit::bad_input)?;
    let config = ServiceConfig::default();
    let listen = [LISTEN.to_owned()];
    let router = RouterSettings { listen: &listen, ..RouterSettings::default() };
    let session = session::router(router).await?;
    let mut embedded =
        Embedded::of(&Kind::simulated(), session.clone(), &config).await.map_err(Exit::network)?;
    let played = async {
        let viewer = open_viewer(&session, &config, &options).await?;
        let out = viewer.is_none().then_some(options.out.as_path());
        out.map_or(Ok(()), files::writable_folder).context("--out").map_err(Exit::bad_input)?;
        let finished = follow_or_cancel(&session, &config, &package, out.is_some()).await?;
        let status = show(out, false, &package, finished)?;
        if let Some(viewer) = viewer {
            stay(viewer, options.once).await?;
        }
        Ok(status)
    };
    let status = tokio::select! {
        status = played => status,
        failure = embedded.failure() => Err(Exit::network(failure)),
    };
    embedded.stop().await;
    status
}

/// Starts the viewer and waits until it listens. None if there is no viewer; the user has then been told why.
async fn open_viewer(
    session: &Session,
    config: &ServiceConfig,
    options: &DemoOptions,
) -> Result<Option<Viewer>, Exit> {
    let endpoints = session::locators(session).await;
    let endpoint =
        endpoints.first().ok_or_else(|| Exit::network(anyhow::anyhow!("there is no port to listen on")))?;
    let Some(program) = viewer::program() else {
        note(format_args!(
            "There is no viewer: it comes with curionav's Python package and its extra `viewer`. \
             The run will be drawn into {}.",
            options.out.join("run.svg").display()
        ));
        return Ok(None);
    };
    let mut ways = Vec::new();
    if !options.web && viewer::has_display() {
        ways.push(vec!["--spawn"]);
    }
    ways.push(if options.no_browser { vec!["--web", "--no-browser"] } else { vec!["--web"] });
    for mut arguments in ways {
        arguments.extend(["--connect", endpoint]);
        if options.once {
            arguments.push("--once");
        }
        let mut viewer = Viewer::start(&program, &arguments).map_err(Exit::failed)?;
        match viewer.listens(session, &config.robot).await? {
            None => return Ok(Some(viewer)),
            Some(status) if status.code() == Some(viewer::NOT_INSTALLED) => break,
            Some(_) => {}
        }
    }
    note(format_args!("The run will be drawn into {}.", options.out.join("run.svg").display()));
    Ok(None)
}

/// Leaves the viewer open until it is closed, or until the end is asked for.
async fn stay(mut viewer: Viewer, ends_by_itself: bool) -> Result<(), Exit> {
    if !ends_by_itself {
        note("Drag the viewer's time line to go back. Close the viewer or press Ctrl-C to end.");
    }
    let mut signals: Shutdown = on_signals().map_err(Exit::network)?;
    tokio::select! {
        () = viewer.ended() => {}
        () = signals.requested() => viewer.end().await,
    }
    Ok(())
}
