//! One service as a process: `curionav generator`, `cpc`, `cnc`, `arbiter`, `localizer`, `driver`, `simulator`, and
//! `echo`, which `scale --overhead` measures against.

use curionav_deployment::service_kind::Kind;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::process::{Service, ServiceOptions, run_service};

pub(crate) async fn one(kind: Kind, options: ServiceOptions) -> Result<u8, Exit> {
    run(kind.name(), &options, kind.service()).await
}

pub(crate) async fn echo(options: ServiceOptions) -> Result<u8, Exit> {
    run("echo", &options, curionav_runtime::echo::run).await
}

async fn run(role: &str, options: &ServiceOptions, service: Service) -> Result<u8, Exit> {
    run_service(role, options, service).await.map(|()| SUCCESS)
}
