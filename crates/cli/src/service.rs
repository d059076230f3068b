//! One service as a process: `curionav generator`, `cpc`, `cpc-occluded`, `cnc`, `arbiter`, `localizer`, `tracker`,
//! `driver`, `simulator` and `ros2-gateway`.

use anyhow::Context;
use clap::Subcommand;
use curionav_deployment::service_kind::Kind;
use curionav_own_planner::{Attended, Source};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::process::{ServiceOptions, run_service};

#[derive(Debug, Subcommand)]
pub(crate) enum ServiceCommand {
    /// Run one trajectory generator.
    Generator(ServiceOptions),
    /// Run a planner of one's own: a name in a Python file, such as `mine.py:policy`, or a program.
    ///
    /// It is asked by robots whose profile names it as `generator = "own-NAME"`, such as the profile that `curionav run
    /// --planner mine.py:policy` gives. docs/own-planner.md says how to write one.
    Planner {
        /// The planner: FILE.py:NAME or a program.
        #[arg(value_name = "PLANNER")]
        planner: String,
        #[command(flatten)]
        options: ServiceOptions,
    },
    /// Run one CPC evaluator (localisation uncertainty along candidates).
    Cpc(ServiceOptions),
    /// Run one CPC evaluator that lets people hide landmarks, for planners with the term `cpc-occluded`.
    CpcOccluded(ServiceOptions),
    /// Run one CNC evaluator (human comfort and crowd density along candidates).
    Cnc(ServiceOptions),
    /// Run a robot's arbiter.
    Arbiter(ServiceOptions),
    /// Run a robot's localizer.
    Localizer(ServiceOptions),
    /// Run a robot's tracker of people, which finds them in the laser's scans.
    Tracker(ServiceOptions),
    /// Run a robot's driver, which also owns its mission.
    Driver(ServiceOptions),
    /// Run the simulator: world, people, laser and base.
    Simulator(ServiceOptions),
    /// Run the gateway to a ROS 2 robot: it acts as the robot's base and serves Nav2's actions there (docs/ros2.md).
    Ros2Gateway(ServiceOptions),
}

pub(crate) async fn run(command: ServiceCommand) -> Result<u8, Exit> {
    let (kind, options) = match command {
        ServiceCommand::Generator(options) => (Kind::Generator, options),
        ServiceCommand::Planner { planner, options } => return planner_service(planner, options).await,
        ServiceCommand::Cpc(options) => (Kind::Cpc, options),
        ServiceCommand::CpcOccluded(options) => (Kind::CpcOccluded, options),
        ServiceCommand::Cnc(options) => (Kind::Cnc, options),
        ServiceCommand::Arbiter(options) => (Kind::Arbiter, options),
        ServiceCommand::Localizer(options) => (Kind::Localizer, options),
        ServiceCommand::Tracker(options) => (Kind::Tracker, options),
        ServiceCommand::Driver(options) => (Kind::Driver, options),
        ServiceCommand::Simulator(options) => (Kind::Simulator, options),
        ServiceCommand::Ros2Gateway(options) => (Kind::Ros2Gateway, options),
    };
    if kind == Kind::Ros2Gateway {
        // What is wrong with its file is said before any router is looked for.
        let config = options.configuration(kind.name()).map_err(Exit::bad_input)?;
        curionav_ros2_gateway::check(&config).map_err(Exit::bad_input)?;
    }
    run_service(kind.name(), &options, kind.service()).await.map(|()| SUCCESS)
}

/// Serves a planner of one's own, under the role that it gives itself.
async fn planner_service(planner: String, options: ServiceOptions) -> Result<u8, Exit> {
    let source = Source::parse(&planner).map_err(Exit::bad_input)?;
    let source = source.with_context(|| format!("`{planner}` is no planner of one's own; give FILE.py:NAME"));
    let attended = Attended::start(source.map_err(Exit::bad_input)?).map_err(Exit::bad_input)?;
    let role = attended.description().generator();
    drop(attended);
    let options = ServiceOptions { planner: Some(planner), ..options };
    run_service(&role, &options, Kind::Generator.service()).await.map(|()| SUCCESS)
}

/// Answers bare queries, which `scale --overhead` measures against.
pub(crate) async fn echo(options: ServiceOptions) -> Result<u8, Exit> {
    run_service("echo", &options, curionav_runtime::echo::run).await.map(|()| SUCCESS)
}
