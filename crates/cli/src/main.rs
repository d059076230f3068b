//! `curionav`: run scenarios, start and supervise deployments, talk to robots. Each command has a file of its own with
//! its arguments and their help.

mod about;
mod blind;
mod connect;
mod demo;
mod denied;
mod doctor;
mod doubt;
mod goal;
mod lab;
mod mission;
mod output;
mod recording;
mod required_roles;
mod router;
mod run;
mod scenario;
mod secure;
mod service;
mod status;
mod things;
mod up;

use clap::{Parser, Subcommand};
use curionav_runtime::environment::{self, Links};
use curionav_runtime::exit::Exit;
use curionav_runtime::print::note;
use curionav_runtime::process::ServiceOptions;

/// Cross crowds without getting lost and without bothering people.
///
/// Start with `curionav demo` or `curionav run quickstart`. Exit status: 0 reached without collision; 1 ran
/// but failed (collision, timeout, lost); 2 bad input; 3 no connection, or a required service was lost.
/// `curionav --version --verbose` shows the commit, the target, and the licences of what is inside.
#[derive(Debug, Parser)]
#[command(name = "curionav", version, propagate_version = true, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// What to log on standard error: error, warn, info, debug, or a filter in the syntax of RUST_LOG.
    /// If RUST_LOG is set, it overrides this option.
    #[arg(long, global = true, default_value = "warn", value_name = "FILTER")]
    log: String,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::RunOptions),
    Demo(demo::DemoOptions),
    #[command(flatten)]
    Lab(lab::LabCommand),
    Up(up::UpOptions),
    #[command(subcommand)]
    Secure(secure::SecureCommand),
    Router(router::RouterOptions),
    #[command(flatten)]
    Service(service::ServiceCommand),
    #[command(flatten)]
    Mission(mission::MissionRequest),
    Status(status::StatusOptions),
    Doctor(doctor::DoctorOptions),
    #[command(flatten)]
    Recording(recording::RecordingCommand),
    /// Answer bare queries (started by `scale --overhead`).
    #[command(hide = true)]
    Echo(ServiceOptions),
    #[command(subcommand)]
    Scenario(scenario::ScenarioCommand),
}

fn main() -> std::process::ExitCode {
    if about::is_wanted(std::env::args().skip(1)) {
        return finish(about::show());
    }
    let arguments = Arguments::parse();
    curionav_runtime::telemetry::init(&arguments.log, matches!(arguments.command, Command::Service(_)));
    match &arguments.command {
        Command::Router(_) => environment::provide(Links::OfRouter),
        Command::Service(_) => environment::provide(Links::OfClient),
        _ => {}
    }
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    if takes_turns(&arguments.command) {
        runtime.worker_threads(1);
    }
    let runtime = runtime.enable_all().build();
    let outcome = match runtime {
        Ok(runtime) => {
            let outcome = runtime.block_on(dispatch(arguments));
            // Zenoh's own threads must not keep the process: everything of ours has ended by now.
            runtime.shutdown_timeout(std::time::Duration::from_secs(1));
            outcome
        }
        Err(error) => Err(Exit::network(error)),
    };
    finish(outcome)
}

fn finish(outcome: Result<u8, Exit>) -> std::process::ExitCode {
    match outcome {
        Ok(code) => code.into(),
        Err(exit) => {
            // One clear line, whatever the chain of causes.
            note(format_args!("error: {}", exit.line()));
            exit.code.into()
        }
    }
}

/// Whether the command runs services that only take turns. On one thread no message between them wakes another thread,
/// which on a busy machine may come late.
fn takes_turns(command: &Command) -> bool {
    match command {
        Command::Run(options) => options.is_lockstep(),
        Command::Lab(lab::LabCommand::Worker { .. }) => true,
        _ => false,
    }
}

async fn dispatch(arguments: Arguments) -> Result<u8, Exit> {
    let log = arguments.log.clone();
    match arguments.command {
        Command::Run(options) => run::run(options).await,
        Command::Demo(options) => demo::run(options).await,
        Command::Lab(command) => lab::run(command, &log).await,
        Command::Up(options) => up::run(options, &log).await,
        Command::Secure(command) => secure::run(command),
        Command::Router(options) => router::run(options).await,
        Command::Service(command) => service::run(command).await,
        Command::Mission(request) => mission::run(request).await,
        Command::Status(options) => status::run(options).await,
        Command::Doctor(options) => doctor::run(options).await,
        Command::Recording(command) => recording::run(command).await,
        Command::Echo(options) => service::echo(options).await,
        Command::Scenario(command) => scenario::run(command),
    }
}
