//! What `curionav scale` takes.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use curionav_runtime::generator;
use curionav_schemas::limits::{MAX_CANDIDATES, MAX_PEOPLE};

use crate::service::Kind;

/// Replicas, robots: more than one machine is asked to carry.
const PROCESSES_MAX: i64 = 64;
const ROBOTS_MAX: i64 = 200;

/// What can be run with more than one replica.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Pooled {
    /// Localisation uncertainty along candidates.
    Cpc,
    /// Human comfort and crowd density along candidates.
    Hccdm,
    /// Candidates themselves.
    Generator,
}

impl Pooled {
    /// What starts one.
    pub(super) fn kind(self) -> Kind {
        match self {
            Self::Cpc => Kind::Cpc,
            Self::Hccdm => Kind::Hccdm,
            Self::Generator => Kind::Generator,
        }
    }

    /// What its replicas announce themselves as; an evaluator's is its metric.
    pub(super) fn role(self) -> &'static str {
        match self {
            Self::Cpc => "cpc",
            Self::Hccdm => "cnc",
            Self::Generator => generator::ROLE,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct ScaleOptions {
    /// Which service to measure.
    #[arg(long, value_enum, required_unless_present = "overhead")]
    pub(super) service: Option<Pooled>,
    /// Numbers of replicas, separated by commas; the first is what the others are compared with. Default:
    /// 1,2,4,8; with --break-even 1,2; with --robots 2.
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
    /// How long to measure each row. Default: 10; with --break-even 1.
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
    /// Find out from which batch on asking replicas is faster than computing in the arbiter.
    #[arg(long, conflicts_with_all = ["robots", "overhead"])]
    pub(super) break_even: bool,
    /// Let this many robots plan ten times a second over one pool, e.g. 1,10,50.
    #[arg(long, value_name = "N,N", value_delimiter = ',', conflicts_with = "overhead",
        value_parser = clap::value_parser!(u16).range(1..=ROBOTS_MAX))]
    pub(super) robots: Vec<u16>,
    /// Measure what splitting the cycle into processes costs, in bare query round trips.
    #[arg(long, conflicts_with_all = ["service", "replicas", "cpu_quota", "batch", "people"])]
    pub(super) overhead: bool,
    /// Print exactly one JSON object on standard output.
    #[arg(long)]
    pub(super) json: bool,
}

impl ScaleOptions {
    /// The numbers of replicas, or `default`.
    pub(super) fn replicas_or(&self, default: &[u16]) -> Vec<usize> {
        let replicas = if self.replicas.is_empty() { default } else { &self.replicas };
        replicas.iter().map(|&n| usize::from(n)).collect()
    }
}

fn parse_quota(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(cores) if (0.01..=64.0).contains(&cores) => Ok(cores),
        _ => Err("must be processors, from 0.01 to 64".into()),
    }
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.5..=3600.0).contains(&seconds) => Ok(seconds),
        _ => Err("must be seconds, from 0.5 to 3600".into()),
    }
}
