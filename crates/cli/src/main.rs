//! `curionav`: run scenarios, start and supervise deployments, talk to robots. Each command has a file of its own with
//! its arguments and their help.

mod cancel;
mod connect;
mod doctor;
mod goal;
#[cfg(feature = "lab")]
mod lab;
mod mission_request;
mod output;
mod pause;
#[cfg(feature = "recording")]
mod recording;
#[cfg(not(all(feature = "lab", feature = "recording")))]
mod left_out;
mod required_roles;
mod resume;
mod router;
mod run;
mod scenario;
mod service;
mod status;
mod up;

use clap::{Parser, Subcommand};
#[cfg(not(feature = "lab"))]
use left_out::lab;
#[cfg(not(feature = "recording"))]
use left_out::recording;
use curionav_deployment::service_kind::Kind;
use curionav_runtime::exit::Exit;
use curionav_runtime::process::ServiceOptions;
use curionav_runtime::zenoh_threads::{self, Links};

/// Cross crowds without getting lost and without bothering people.
///
/// Start with `curionav run scenarios/quickstart.toml`. Exit status: 0 reached without collision; 1 ran
/// but failed (collision, timeout, lost); 2 bad input; 3 lost the network or a required service.
#[derive(Debug, Parser)]
#[command(name = "curionav", version, propagate_version = true, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// What to log on standard error: error, warn, info, debug, or a filter as of RUST_LOG.
    #[arg(long, global = true, default_value = "warn", value_name = "FILTER")]
    log: String,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(run::RunOptions),
    #[command(flatten)]
    Lab(lab::LabCommand),
    Up(up::UpOptions),
    Router(router::RouterOptions),
    /// Run one trajectory generator.
    Generator(ServiceOptions),
    /// Run one CPC evaluator (localisation uncertainty along candidates).
    Cpc(ServiceOptions),
    /// Run one CNC evaluator (human comfort and crowd density along candidates).
    Cnc(ServiceOptions),
    /// Run a robot's arbiter.
    Arbiter(ServiceOptions),
    /// Run a robot's localizer.
    Localizer(ServiceOptions),
    /// Run a robot's driver, which also owns its mission.
    Driver(ServiceOptions),
    /// Run the simulator: world, people, laser and base.
    Simulator(ServiceOptions),
    Goal(goal::GoalOptions),
    Pause(pause::PauseOptions),
    Resume(resume::ResumeOptions),
    Cancel(cancel::CancelOptions),
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
    let arguments = Arguments::parse();
    curionav_runtime::telemetry::init(&arguments.log);
    match &arguments.command {
        Command::Router(_) => zenoh_threads::provide(Links::OfRouter),
        command if service_of(command).is_some() => zenoh_threads::provide(Links::OfClient),
        _ => {}
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build();
    let outcome = match runtime {
        Ok(runtime) => {
            let outcome = runtime.block_on(dispatch(arguments));
            // Zenoh's own threads must not keep the process: everything of ours has ended by now.
            runtime.shutdown_timeout(std::time::Duration::from_secs(1));
            outcome
        }
        Err(error) => Err(Exit::network(error.into())),
    };
    match outcome {
        Ok(code) => code.into(),
        Err(exit) => {
            // One clear line, whatever the chain of causes.
            eprintln!("error: {}", exit.line());
            exit.code.into()
        }
    }
}

/// The service a command runs, if that is what it does.
fn service_of(command: &Command) -> Option<Kind> {
    Some(match command {
        Command::Generator(_) => Kind::Generator,
        Command::Cpc(_) => Kind::Cpc,
        Command::Cnc(_) => Kind::Cnc,
        Command::Arbiter(_) => Kind::Arbiter,
        Command::Localizer(_) => Kind::Localizer,
        Command::Driver(_) => Kind::Driver,
        Command::Simulator(_) => Kind::Simulator,
        _ => return None,
    })
}

async fn dispatch(arguments: Arguments) -> Result<u8, Exit> {
    let log = arguments.log.clone();
    match arguments.command {
        Command::Run(options) => run::run(options).await,
        Command::Lab(command) => lab::run(command, &log).await,
        Command::Up(options) => up::run(options, &log).await,
        Command::Router(options) => router::run(options).await,
        Command::Generator(options) => service::one(Kind::Generator, options).await,
        Command::Cpc(options) => service::one(Kind::Cpc, options).await,
        Command::Cnc(options) => service::one(Kind::Cnc, options).await,
        Command::Arbiter(options) => service::one(Kind::Arbiter, options).await,
        Command::Localizer(options) => service::one(Kind::Localizer, options).await,
        Command::Driver(options) => service::one(Kind::Driver, options).await,
        Command::Simulator(options) => service::one(Kind::Simulator, options).await,
        Command::Goal(options) => goal::run(options).await,
        Command::Pause(options) => pause::run(options).await,
        Command::Resume(options) => resume::run(options).await,
        Command::Cancel(options) => cancel::run(options).await,
        Command::Status(options) => status::run(options).await,
        Command::Doctor(options) => doctor::run(options).await,
        Command::Recording(command) => recording::run(command).await,
        Command::Echo(options) => service::echo(options).await,
        Command::Scenario(command) => scenario::run(command),
    }
}
