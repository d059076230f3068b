//! `curionav worker`: a process that `bench` and `tune` hand runs to.

use clap::Args;
use curionav_lab::bench;
use curionav_runtime::exit::Exit;

/// Take runs from standard input and answer each with a row (started by `bench` and `tune`).
#[derive(Debug, Args)]
pub(crate) struct WorkerOptions {
    /// Digest of the program, as it shall be in every row.
    #[arg(long)]
    program: String,
}

pub(crate) async fn run(options: WorkerOptions) -> Result<u8, Exit> {
    bench::worker(&options.program).await
}
