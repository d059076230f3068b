//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::ServiceOptions;

use crate::doctor::DoctorOptions;
use crate::explain::ExplainOptions;
use crate::record::RecordOptions;
use crate::replay::ReplayOptions;
use crate::scale::ScaleOptions;

/// Cross crowds without getting lost and without bothering people.
///
/// Start with `curionav run scenarios/quickstart.toml`. Exit status: 0 reached without collision; 1 ran
/// but failed (collision, timeout, lost); 2 bad input; 3 lost the network or a required service.
#[derive(Debug, Parser)]
#[command(name = "curionav", version, propagate_version = true, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// What to log on standard error: error, warn, info, debug, or a filter as of RUST_LOG.
    #[arg(long, global = true, default_value = "warn", value_name = "FILTER")]
    pub(crate) log: String,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a scenario and show its metrics.
    Run(RunOptions),
    /// Run planners over scenarios many times and compare them with each other and with the paper.
    ///
    /// Every planner runs in every scenario with every seed, in lockstep, on several processes. A finished run is kept in DIR/journal.jsonl at once: after an interruption the same command goes on where
    /// it was. A run counts as finished while its scenario, map, planner and this program are what they were.
    /// results.csv is the same, byte for byte, whatever --jobs; what depends on the clock is in timings.csv.
    ///
    /// Exit status: 0 every run took place, however it ended; 1 a run could not take place, or interrupted;
    /// 2 bad input; 3 the worker processes cannot be started.
    Bench(BenchOptions),
    /// Search for better planner settings, on seeds that no report uses.
    ///
    /// Searches the settings of a planner that cost least, and prints the best one as a profile.
    ///
    /// The cost of a run is 25 TD + 4 RMSE/m + 12 TCM + Length/40 m + Time/45 s + max(0, 3.6 m - MD)/3 m +
    /// max(0, 0.3 m - gap)/0.3 m, about 1 each for the paper's planner, and 20 if it did not reach the goal and 20 if it collided; of a setting, the mean over
    /// all scenarios and seeds, the same ones for every setting. [objective] in SPACE.toml changes the weights.
    ///
    /// First the base and a quasi-random sample of settings run with one seed, the best third of them with three
    /// times as many, and so on up to --repeats. Then the best one's parameters are moved one by one, ever less far.
    ///
    /// SPACE.toml: `base = "curiosity"` (a profile, or a profile file), and for each parameter a table
    /// [[parameters]] with `path = "terms.cnc.weight"` and either `low`, `high` and perhaps `scale = "log"`, or
    /// `values = [...]`.
    ///
    /// Exit status: 0 done; 1 a run could not take place, or interrupted (the same command goes on); 2 bad input.
    Tune(TuneOptions),
    /// Take runs from standard input and answer each with a row (started by `bench` and `tune`).
    #[command(hide = true)]
    Worker(WorkerOptions),
    /// Start router and services as processes on this machine and supervise them.
    Up(UpOptions),
    /// Run a Zenoh router: what services and clients connect to.
    Router(RouterOptions),
    /// Run one trajectory generator.
    Generator(ServiceOptions),
    /// Run one CPC evaluator (localisation uncertainty along candidates).
    Cpc(ServiceOptions),
    /// Run one HCCDM evaluator (human comfort and crowd density along candidates).
    Hccdm(ServiceOptions),
    /// Run a robot's arbiter.
    Arbiter(ServiceOptions),
    /// Run a robot's localizer.
    Localizer(ServiceOptions),
    /// Run a robot's driver, which also owns its mission.
    Driver(ServiceOptions),
    /// Run the simulator: world, people, laser and base.
    Simulator(ServiceOptions),
    /// Send a robot to another goal.
    Goal(GoalOptions),
    /// Stop a robot until `resume`.
    Pause(RobotOptions),
    /// Let a paused robot go on.
    Resume(RobotOptions),
    /// End a robot's mission.
    Cancel(RobotOptions),
    /// Say who is alive, how loaded and how fast, and who is missing.
    Status(StatusOptions),
    /// Ask over every link a deployment needs; say what is missing and how to mend it.
    ///
    /// Looks for the router, asks every live instance for its status and for work, checks missions and maps,
    /// and listens to each robot's streams. Needs nothing but the router.
    ///
    /// Exit status: 0 all well; 1 something is missing; 2 bad input; 3 no router.
    Doctor(DoctorOptions),
    /// Record everything robots see, decide and do, to look at and to plan again.
    ///
    /// Listens until it is interrupted (Ctrl-C). OUT.mcap opens in Foxglove and in Rerun: map, laser, people,
    /// candidates by cost, path, log. Beside these it holds every message as it was sent, for `replay` and `explain`. A
    /// recording that is killed lacks its last second at most; `replay` and `explain` read it as it is.
    ///
    ///   curionav record drive.mcap                         every robot behind the router on this machine
    ///   curionav record drive.mcap --robot r1 --connect tcp/10.0.0.1:7447
    ///   curionav run scenarios/quickstart.toml --record drive.mcap
    ///   curionav record whole.mcap --recover killed.mcap   what is left of a killed one, for viewers that want an index
    ///
    /// Exit status: 0 recorded; 1 nothing came, or the disk is full; 2 bad argument, or OUT.mcap exists; 3 no router.
    #[command(verbatim_doc_comment)]
    Record(RecordOptions),
    /// Plan every cycle of a recording again, in this process, and say where decisions differ.
    ///
    /// Each cycle starts from what was recorded: scene, search trees and the trajectory being driven. With the planner
    /// and version of the recording no decision differs, except perhaps in cycles that were degraded: what these lacked, a
    /// replica or time, is there in a replay. With --planner another planner is asked what it would have done at each of
    /// these moments; one with another generator grows trees of its own along the recording.
    ///
    ///   curionav replay drive.mcap                         must say: 0 differ
    ///   curionav replay drive.mcap --planner distance-only
    ///
    /// Exit status: 0 no decision differs; 1 some do; 2 the recording cannot be read, is of another version, or holds
    /// nothing to plan.
    #[command(verbatim_doc_comment)]
    Replay(ReplayOptions),
    /// Say why a cycle was decided as it was: every candidate's costs, and what other weights would have led to.
    ///
    ///   curionav explain drive.mcap --cycle 40             a cycle of a recording; without --cycle the last one
    ///   curionav explain --robot r1                        the next cycle of a robot that is driving
    ///
    /// The cost of a candidate of K states is the sum of weight x raw cost / (scale x K) over the terms whose condition
    /// holds (of the paper: w1 weighs cpc, w2 cnc, w3 distance). What another weight would have led to is computed by the arbiter in
    /// the cycle itself, collisions included.
    ///
    /// Exit status: 0 explained; 1 no such cycle; 2 bad input; 3 no router, or no report came.
    #[command(verbatim_doc_comment)]
    Explain(ExplainOptions),
    /// Measure what more replicas bring, for how many robots, and what the split into processes costs.
    ///
    /// Drives through a scenario to have real scenes and candidates, starts a router and replicas of one service
    /// as processes on this machine, and asks them as arbiters do.
    ///
    ///   curionav scale --service cpc --cpu-quota 0.1            throughput with 1, 2, 4 and 8 replicas
    ///   curionav scale --service hccdm --break-even             when asking beats computing in the arbiter
    ///   curionav scale --service cpc --robots 1,10,50           many robots over one pool, ten times a second
    ///   curionav scale --overhead                               what splitting the cycle into processes costs
    ///
    /// Throughput is measured with so many batches in flight that no replica waits for work; p50 and p99 are the
    /// times of a batch that has the pool to itself. Efficiency is the throughput of a replica as a share of that
    /// in the first row. `cores` is what the replicas used, `asking` what router and robots used: when both
    /// together come near what the machine has, it is the limit and not the pool; --cpu-quota 0.1 makes room.
    ///
    /// --json prints {service, rows: [{replicas, candidates_per_s, p50_ms, p99_ms, efficiency, ...}], ...}.
    /// Exit status: 0 measured; 1 interrupted, or the drive failed; 2 bad argument, or no control groups for
    /// --cpu-quota; 3 a process could not be started or did not answer. docs/scaling.md says more.
    #[command(verbatim_doc_comment)]
    Scale(ScaleOptions),
    /// Answer bare queries (started by `scale --overhead`).
    #[command(hide = true)]
    Echo(ServiceOptions),
    /// Check, draw or generate scenario files.
    #[command(subcommand)]
    Scenario(ScenarioCommand),
}

/// Where the deployment is.
#[derive(Debug, Clone, Args)]
pub(crate) struct ConnectOptions {
    /// Router endpoint, e.g. tcp/10.0.0.1:7447.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    pub(crate) connect: String,
    /// Key prefix of the deployment.
    #[arg(long, value_name = "NS")]
    pub(crate) namespace: Option<String>,
}

impl ConnectOptions {
    /// That of a client there.
    pub(crate) fn config(&self) -> ServiceConfig {
        ServiceConfig {
            connect: vec![self.connect.clone()],
            namespace: self.namespace.clone(),
            ..ServiceConfig::default()
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct RunOptions {
    /// Scenario file.
    #[arg(value_name = "SCENARIO.toml")]
    pub(crate) scenario: PathBuf,
    /// Planner: a built-in profile, or a profile file (.toml). Default: the scenario's.
    #[arg(long, value_name = "PROFILE")]
    pub(crate) planner: Option<String>,
    /// Seed of everything random: start error, odometry, laser, localiser, generator.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// max (lockstep: as fast as the machine allows, bit for bit repeatable), realtime, or simulated
    /// seconds per second.
    #[arg(long, value_name = "max|realtime|X", default_value = "max", value_parser = parse_speed)]
    pub(crate) speed: Speed,
    /// Write metrics.json, trajectory.csv, cycles.csv and run.svg into this directory.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Print exactly one JSON object on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// Record the run into this file, as `curionav record` does.
    #[arg(long, value_name = "OUT.mcap")]
    pub(crate) record: Option<PathBuf>,
    /// Drive the services of a running deployment instead of embedding them.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) connect: Option<String>,
    /// Key prefix of the deployment.
    #[arg(long, value_name = "NS", requires = "connect")]
    pub(crate) namespace: Option<String>,
    /// World of the deployment's simulator.
    #[arg(long, value_name = "NAME", default_value = "world")]
    pub(crate) world: String,
    /// Robot of the deployment.
    #[arg(long, value_name = "NAME", default_value = "robot")]
    pub(crate) robot: String,
}

#[derive(Debug, Args)]
pub(crate) struct BenchOptions {
    /// Planners: built-in profiles or profile files (.toml), separated by commas. Default: all built-in ones.
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub(crate) planners: Vec<String>,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/paper/*.toml")]
    pub(crate) scenarios: Vec<String>,
    /// Runs of each planner in each scenario, with consecutive seeds.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) repeats: u32,
    /// First seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) first_seed: u64,
    /// Runs at the same time. Default: one a core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) jobs: Option<u16>,
    /// Directory of results.csv, timings.csv, summary.json, report.html and the journal.
    #[arg(long, value_name = "DIR", default_value = "out/bench")]
    pub(crate) out: PathBuf,
    /// Keep finished runs of another build of this program, e.g. to render the report anew.
    #[arg(long)]
    pub(crate) any_build: bool,
}

#[derive(Debug, Args)]
pub(crate) struct TuneOptions {
    /// What to search.
    #[arg(value_name = "SPACE.toml")]
    pub(crate) space: PathBuf,
    /// Scenario files, as a pattern with * and ?, or several files.
    #[arg(long, value_name = "GLOB", num_args = 1.., default_value = "scenarios/paper/*.toml")]
    pub(crate) scenarios: Vec<String>,
    /// Settings to sample.
    #[arg(long, value_name = "N", default_value_t = 26, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub(crate) settings: u32,
    /// Seeds a setting is run with in each scenario before it can win.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) repeats: u32,
    /// Times every parameter is moved up and down.
    #[arg(long, value_name = "N", default_value_t = 2)]
    pub(crate) rounds: u32,
    /// First seed of the runs, at least 1000: the ones below are for reports.
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1000..))]
    pub(crate) first_seed: u64,
    /// Seed of the sample.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) search_seed: u64,
    /// Runs at the same time. Default: one a core.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub(crate) jobs: Option<u16>,
    /// Directory of best.toml, tune.csv, the settings and the journal.
    #[arg(long, value_name = "DIR", default_value = "out/tune")]
    pub(crate) out: PathBuf,
}

#[derive(Debug, Args)]
pub(crate) struct WorkerOptions {
    /// Digest of the program, as it shall be in every row.
    #[arg(long)]
    pub(crate) program: String,
}

/// How fast simulated time passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Speed {
    /// Lockstep.
    Max,
    /// Simulated seconds per second of the wall clock.
    Factor(f64),
}

fn parse_speed(text: &str) -> Result<Speed, String> {
    match text {
        "max" => Ok(Speed::Max),
        "realtime" => Ok(Speed::Factor(1.0)),
        _ => match text.parse::<f64>() {
            Ok(factor) if factor > 0.0 && factor <= 100.0 => Ok(Speed::Factor(factor)),
            _ => Err("must be max, realtime, or a factor above 0 and up to 100".into()),
        },
    }
}

#[derive(Debug, Args)]
pub(crate) struct UpOptions {
    /// Deployment file; see deploy/local.toml.
    #[arg(value_name = "DEPLOYMENT.toml")]
    pub(crate) deployment: PathBuf,
    /// Port of the router on 127.0.0.1, 0 for a free one. Default: the deployment's.
    #[arg(long, value_name = "P")]
    pub(crate) port: Option<u16>,
}

#[derive(Debug, Args)]
pub(crate) struct RouterOptions {
    /// Endpoint to listen on; port 0 takes a free one.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/0.0.0.0:7447")]
    pub(crate) listen: String,
    /// Another router to link with; may be given several times. Nobody waits for it: this one serves
    /// whether it is there or not.
    #[arg(long, value_name = "ENDPOINT")]
    pub(crate) connect: Vec<String>,
    /// Zenoh configuration file (json5) instead of --listen and --connect; see deploy/router.json5.
    #[arg(long, value_name = "F", conflicts_with = "connect")]
    pub(crate) config: Option<PathBuf>,
    /// End when standard input closes (set by `curionav up`).
    #[arg(long, hide = true)]
    pub(crate) supervised: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RobotOptions {
    /// Robot's name.
    pub(crate) robot: String,
    #[command(flatten)]
    pub(crate) at: ConnectOptions,
}

#[derive(Debug, Args)]
pub(crate) struct GoalOptions {
    /// Robot's name.
    pub(crate) robot: String,
    /// Metres, map frame.
    #[arg(allow_negative_numbers = true)]
    pub(crate) x: f64,
    /// Metres, map frame.
    #[arg(allow_negative_numbers = true)]
    pub(crate) y: f64,
    /// Radians, map frame.
    #[arg(allow_negative_numbers = true)]
    pub(crate) yaw: Option<f64>,
    #[command(flatten)]
    pub(crate) at: ConnectOptions,
}

#[derive(Debug, Args)]
pub(crate) struct StatusOptions {
    #[command(flatten)]
    pub(crate) at: ConnectOptions,
    /// Print one JSON object on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// Check scenario files and the maps and recordings they name.
    Check {
        /// Scenario files.
        #[arg(required = true, value_name = "SCENARIO.toml")]
        files: Vec<PathBuf>,
    },
    /// Draw scenarios before anything moves, NAME.svg each: map, start, goal, shortest way, people and their
    /// routes, and where no landmark is within the laser's range.
    Draw {
        /// Scenario files.
        #[arg(required = true, value_name = "SCENARIO.toml")]
        files: Vec<PathBuf>,
        /// Directory to write into.
        #[arg(long, value_name = "DIR", default_value = ".")]
        out: PathBuf,
    },
    /// Write the generated scenarios and their maps, as committed under scenarios/.
    Generate {
        /// Directory to write into.
        #[arg(value_name = "DIR")]
        out: PathBuf,
    },
}
