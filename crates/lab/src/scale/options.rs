//! What to measure, and with what.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::{Args, ValueEnum};
use curionav_runtime::exit::Exit;
use curionav_schemas::limits::{MAX_CANDIDATES, MAX_PEOPLE};
use strum::IntoStaticStr;

/// Replicas, robots: more than one machine is asked to carry.
const PROCESSES_MAX: i64 = 64;
const ROBOTS_MAX: i64 = 200;
/// Search trees of a cycle, as in a profile.
const TREES_MAX: i64 = 8;

/// What can be run with more than one replica.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
pub(super) enum Service {
    /// Localisation uncertainty along candidates.
    Cpc,
    /// The same with people who hide landmarks; for planners that have this term.
    CpcOccluded,
    /// Human comfort and crowd density along candidates.
    Cnc,
    /// Candidates themselves.
    Generator,
}

impl Service {
    /// The command that runs it, and what its replicas announce themselves as.
    pub(super) fn name(self) -> &'static str {
        self.into()
    }
}

/// Measure what more replicas bring, for how many robots, and what the split into processes costs.
///
/// Drives through a scenario to have real scenes and candidates, starts a router and replicas of one service
/// as processes on this machine, and asks them as arbiters do.
///
///   curionav scale --service cpc --cpu-quota 0.1            throughput with 1, 2, 4 and 8 replicas
///   curionav scale --service cnc --break-even               when asking beats computing in the arbiter
///   curionav scale --service generator --trees 1,2,4,8      what several search trees per cycle bring
///   curionav scale --service cpc --robots 1,10,50           many robots over one pool, ten times a second
///   curionav scale --overhead                               what splitting the cycle into processes costs
///
/// Throughput is measured with so many batches in flight that no replica waits for work; p50 and p99 are the
/// times of a batch that has the pool to itself. Efficiency is the throughput of a replica as a share of that
/// in the first row. `cores` is what the replicas used, `asking` what router and robots used: when both
/// together come near what the machine has, it is the limit and not the pool; --cpu-quota 0.1 makes room.
///
/// With --trees the robot's other services run in this process without a quota. `candidates` is the mean per
/// cycle; `cut_short` is the share of cycles in which the time ended the growth of a tree, `grown_locally` the
/// share in which the arbiter grew one itself; `reached` counts drives to the goal without a collision.
///
/// --json prints {service, rows: [{replicas, candidates_per_s, p50_ms, p99_ms, efficiency, ...}], ...}.
/// Exit status: 0 measured; 1 interrupted, or the drive failed; 2 bad argument, or no control groups for
/// --cpu-quota; 3 a process could not be started or did not answer. docs/scaling.md says more.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub struct Options {
    /// Which service to measure.
    #[arg(long, value_enum, required_unless_present = "overhead")]
    pub(super) service: Option<Service>,
    /// Numbers of replicas, separated by commas; the first is what the others are compared with. Default:
    /// 1,2,4,8; with --break-even 1,2, of generators 1,2,4; with --robots 2; with --trees as many as trees.
    #[arg(long, value_name = "N,N", value_delimiter = ',',
        value_parser = clap::value_parser!(u16).range(1..=PROCESSES_MAX))]
    pub(super) replicas: Vec<u16>,
    /// Give each replica only this much of a processor, e.g. 0.1, so that a small machine can carry many.
    /// Needs Linux control groups that may be written (root, as a rule).
    #[arg(long, value_name = "CORES", value_parser = parse_quota)]
    pub(super) cpu_quota: Option<f64>,
    /// Candidates in a batch; several with --break-even. Default: 2000; with --robots 100; with --break-even
    /// 16 to 4000.
    #[arg(long, value_name = "N,N", value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(1..=MAX_CANDIDATES as i64))]
    pub(super) batch: Vec<u32>,
    /// People around the robot; several with --break-even. Default: as many as the scenario has there; with
    /// --break-even 5,20,80.
    #[arg(long, value_name = "N,N", value_delimiter = ',',
        value_parser = clap::value_parser!(u32).range(0..=MAX_PEOPLE as i64))]
    pub(super) people: Vec<u32>,
    /// How long to measure each row. Default: 10; with --break-even 1; with --overhead 20.
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub(super) seconds: Option<f64>,
    /// Batches in flight for each replica while throughput is measured, each a robot's.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u16).range(1..=16))]
    pub(super) in_flight: u16,
    /// Scenario that scenes and candidates are taken from.
    #[arg(long, value_name = "SCENARIO.toml", default_value = "scenarios/paper/env4-s3.toml")]
    pub(super) scenario: PathBuf,
    /// Planner: a built-in profile, or a profile file (.toml). Default: the scenario's.
    #[arg(long, value_name = "PROFILE")]
    pub(super) planner: Option<String>,
    /// Find out from which batch on, or from how many trees on, asking replicas is faster than computing in the
    /// arbiter.
    #[arg(long, conflicts_with_all = ["robots", "overhead"])]
    pub(super) break_even: bool,
    /// Drive through the scenario in real time with so many search trees per cycle, e.g. 1,2,4,8, each grown by a
    /// generator of its own unless --replicas names one number of them. With --break-even only the trees of single
    /// cycles are grown; default there: 1,2,4,8.
    #[arg(long, value_name = "N,N", value_delimiter = ',', conflicts_with_all = ["robots", "overhead"],
        value_parser = clap::value_parser!(u16).range(1..=TREES_MAX))]
    pub(super) trees: Vec<u16>,
    /// Drives for each number of trees, with the seeds from 1 on.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(super) drives: u16,
    /// Let this many robots plan ten times a second over one pool, e.g. 1,10,50.
    #[arg(long, value_name = "N,N", value_delimiter = ',', conflicts_with = "overhead",
        value_parser = clap::value_parser!(u16).range(1..=ROBOTS_MAX))]
    pub(super) robots: Vec<u16>,
    /// Measure what splitting the cycle into processes costs, in bare query round trips.
    #[arg(long, conflicts_with_all = ["service", "replicas", "cpu_quota", "batch", "people"])]
    pub(super) overhead: bool,
    /// With --overhead: measure over TLS, with the certificates of this folder, which are made if they are absent.
    #[arg(long, value_name = "DIR", requires = "overhead")]
    pub(super) secure: Option<PathBuf>,
    /// Print exactly one JSON object on standard output.
    #[arg(long)]
    pub(super) json: bool,
}

fn parse_quota(text: &str) -> Result<f64, String> {
    let within = text.parse::<f64>().ok().filter(|cores| (0.01..=64.0).contains(cores));
    within.ok_or_else(|| "must be processors, from 0.01 to 64".into())
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    let within = text.parse::<f64>().ok().filter(|seconds| (0.5..=3600.0).contains(seconds));
    within.ok_or_else(|| "must be seconds, from 0.5 to 3600".into())
}

impl Options {
    /// What the arguments say one by one makes sense together.
    pub(super) fn check(&self) -> Result<(), Exit> {
        let Self { service, batch, people, break_even, trees, replicas, drives, seconds, .. } = self;
        let is_generator = *service == Some(Service::Generator);
        let drives_through = self.drives_through();
        let faults = [
            (!break_even && batch.len() > 1, "--batch: several batches are only compared with --break-even"),
            (!break_even && people.len() > 1, "--people: several crowds are only compared with --break-even"),
            (
                is_generator && !(batch.is_empty() && people.is_empty()),
                "--batch, --people: are for evaluators; a generator is asked what the scenario asks",
            ),
            (!is_generator && !trees.is_empty(), "--trees: is for --service generator, which grows them"),
            (drives_through && replicas.len() > 1, "--replicas: with --trees it is one number for all rows"),
            (
                drives_through && seconds.is_some(),
                "--seconds: with --trees a drive ends at the goal; see --drives",
            ),
            (!drives_through && *drives != 1, "--drives: is for --trees, which drives through the scenario"),
        ];
        let fault = faults.into_iter().find(|(is_one, _)| *is_one);
        fault.map_or(Ok(()), |(_, fault)| Err(Exit::bad_input(anyhow!("{fault}"))))
    }

    /// Whether several search trees are measured in drives.
    pub(super) fn drives_through(&self) -> bool {
        !self.trees.is_empty() && !self.break_even
    }

    /// The numbers of replicas, or `default`.
    pub(super) fn replicas_or(&self, default: &[u16]) -> Vec<usize> {
        let replicas = if self.replicas.is_empty() { default } else { &self.replicas };
        replicas.iter().map(|&n| usize::from(n)).collect()
    }
}
