//! `curionav`: run scenarios, start and supervise deployments, talk to robots.

mod arguments;
mod bench;
mod doctor;
mod embedded;
mod exit;
mod explain;
mod mission;
mod needs;
mod output;
mod package;
mod picture;
mod record;
mod recording;
mod replay;
mod run;
mod scale;
mod scenario;
mod service;
mod status;
mod supervise;
mod tune;

use clap::Parser;
use curionav_runtime::zenoh_threads::{self, Links};

use crate::arguments::{Arguments, Command};
use crate::exit::Exit;

fn main() -> std::process::ExitCode {
    let arguments = Arguments::parse();
    curionav_runtime::telemetry::init(&arguments.log);
    match &arguments.command {
        Command::Router(_) => zenoh_threads::provide(Links::OfRouter),
        command if service::Kind::of(command).is_some() => zenoh_threads::provide(Links::OfClient),
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

async fn dispatch(arguments: Arguments) -> Result<u8, Exit> {
    let log = arguments.log.clone();
    match arguments.command {
        Command::Run(options) => run::run(options).await,
        Command::Bench(options) => bench::bench(options).await,
        Command::Tune(options) => tune::tune(options).await,
        Command::Worker(options) => bench::worker(options).await,
        Command::Up(options) => service::up(options, &log).await,
        Command::Router(options) => service::router(options).await,
        Command::Generator(options) => service::one(service::Kind::Generator, options).await,
        Command::Cpc(options) => service::one(service::Kind::Cpc, options).await,
        Command::Hccdm(options) => service::one(service::Kind::Hccdm, options).await,
        Command::Arbiter(options) => service::one(service::Kind::Arbiter, options).await,
        Command::Localizer(options) => service::one(service::Kind::Localizer, options).await,
        Command::Driver(options) => service::one(service::Kind::Driver, options).await,
        Command::Simulator(options) => service::one(service::Kind::Simulator, options).await,
        Command::Goal(options) => mission::goal(options).await,
        Command::Pause(options) => mission::pause(options).await,
        Command::Resume(options) => mission::resume(options).await,
        Command::Cancel(options) => mission::cancel(options).await,
        Command::Status(options) => status::status(options).await,
        Command::Doctor(options) => doctor::doctor(options).await,
        Command::Record(options) => record::record(options).await,
        Command::Replay(options) => replay::replay(options).await,
        Command::Explain(options) => explain::explain(options).await,
        Command::Scale(options) => scale::scale(options, &log).await,
        Command::Echo(options) => service::echo(options).await,
        Command::Scenario(command) => scenario::scenario(command),
    }
}
