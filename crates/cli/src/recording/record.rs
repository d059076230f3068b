//! `curionav record`: a deployment into a file.

use std::path::{Path, PathBuf};

use clap::Args;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::session;
use curionav_runtime::shutdown::on_signals;
use zenoh::Session;

use crate::connect::{ConnectOptions, LOOKS, robots_of};
use curionav_recording::{Recorder, Scope, Tally, Worlds, recover};
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::note;

/// Record what robots see, decide and do, to view it and to plan it again.
///
/// Listens until it is interrupted (Ctrl-C). OUT.mcap opens in Foxglove and in Rerun: map, laser, people,
/// candidates by cost, path, log. It also holds every message as it was sent, for `replay` and `explain`. If
/// the recorder is killed, at most the last second is missing, and `replay` and `explain` still read the file.
///
///   curionav record drive.mcap                         every robot behind the router on this machine
///   curionav record drive.mcap --robot r1 --connect tcp/10.0.0.1:7447
///   curionav run scenarios/quickstart.toml --record drive.mcap
///   curionav record whole.mcap --recover damaged.mcap  repair one that is damaged, or whose recorder was killed
///
/// Exit status: 0 recorded, or recovered without loss; 1 nothing came, the disk is full, or something was lost in what
/// is recovered; 2 bad argument, or OUT.mcap exists; 3 no router.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct RecordOptions {
    /// File to write; must not exist.
    #[arg(value_name = "OUT.mcap")]
    path: PathBuf,
    /// Record only this robot.
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Do not listen; copy what can be read of a damaged recording, or of one whose recorder was killed, and add an
    /// index. What was lost is said on standard error.
    #[arg(long, value_name = "DAMAGED.mcap", conflicts_with = "robot")]
    recover: Option<PathBuf>,
    #[command(flatten)]
    at: ConnectOptions,
}

pub(crate) async fn run(options: RecordOptions) -> Result<u8, Exit> {
    if let Some(damaged) = &options.recover {
        let recovery = recover(damaged, &options.path)?;
        note(format_args!("{}: {recovery}", options.path.display()));
        return Ok(if recovery.is_loss() { FAILED } else { SUCCESS });
    }
    let mut signals = on_signals().map_err(Exit::network)?;
    let config = options.at.config(&LOOKS, options.robot.as_deref())?;
    let session = session::client(&config).await?;
    let listed = robots_of(&config);
    let worlds = if listed.is_empty() { Worlds::All } else { Worlds::None };
    let robots = options.robot.map_or(listed, |robot| vec![robot]);
    let scope = Scope { robots, worlds };
    let recording = async {
        let mut recorder = Recorder::start(&session, &options.path, &scope).map_err(Exit::bad_input)?;
        note(format_args!("recording into {}; Ctrl-C ends it", options.path.display()));
        tokio::select! {
            () = signals.requested() => recorder.finish().await.map_err(Exit::failed),
            failure = recorder.failure() => Err(Exit::failed(failure)),
        }
    };
    let ended = recording.await;
    session::close(&session);
    let tally = ended?;
    note(format_args!("{}", summary(&options.path, &tally)));
    if tally.written == 0 {
        let robots = "no robot said anything: is one driving, in this namespace? See `curionav status`";
        return Err(Exit::failed(anyhow::anyhow!(robots)));
    }
    Ok(SUCCESS)
}

/// Records into `path` while `run` goes on: what came of the run, and what became of the recording.
pub(crate) async fn during<T>(
    session: &Session,
    path: &Path,
    config: &ServiceConfig,
    run: impl Future<Output = Result<T, Exit>>,
) -> Result<(T, Result<(), Exit>), Exit> {
    let scope = Scope { robots: vec![config.robot.clone()], worlds: Worlds::Only(config.world.clone()) };
    let recorder = Recorder::start(session, path, &scope).map_err(Exit::bad_input)?;
    let finished = run.await;
    let recording = recorder.finish().await.map_err(Exit::failed);
    let recording = recording.map(|tally| note(format_args!("{}", summary(path, &tally))));
    if let (Err(_), Err(error)) = (&finished, &recording) {
        // The program ends with what became of the run.
        tracing::error!(%error, "the recording failed as well");
    }
    Ok((finished?, recording))
}

fn summary(path: &Path, tally: &Tally) -> String {
    let size = std::fs::metadata(path).map_or(0.0, |data| data.len() as f64 / 1e6);
    let Tally { written, cycles, lost, refused } = tally;
    let mut line = format!("{}: {written} messages, {cycles} planning cycles, {size:.1} MB", path.display());
    if *lost > 0 {
        line += &format!("; {lost} messages lost, the disk was too slow");
    }
    if *refused > 0 {
        line += &format!("; {refused} messages not understood");
    }
    line
}
