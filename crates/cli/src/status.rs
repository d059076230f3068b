//! `curionav status`: who is alive, how loaded, how fast.

use std::time::Duration;

use comfy_table::Table;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::membership::Membership;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_schemas::{ServiceStatus, keys};
use serde::Serialize;

use crate::arguments::StatusOptions;
use crate::exit::{Exit, SUCCESS};

/// Tokens of those alive arrive with the declaration; this covers a slow router.
const SETTLE: Duration = Duration::from_millis(300);
const TIMEOUT: Duration = Duration::from_secs(1);

#[derive(Debug, Serialize)]
struct Line {
    role: String,
    instance: String,
    /// Absent for services that answer no questions of this kind.
    status: Option<ServiceStatus>,
}

pub(crate) async fn status(options: StatusOptions) -> Result<u8, Exit> {
    let config = ServiceConfig {
        connect: vec![options.at.connect.clone()],
        namespace: options.at.namespace.clone(),
        ..ServiceConfig::default()
    };
    let session = session::client(&config).await.map_err(|e| Exit::network(e.into()))?;
    let membership = Membership::follow(&session).map_err(|e| Exit::network(e.into()))?;
    tokio::time::sleep(SETTLE).await;
    let mut lines = Vec::new();
    for (role, instances) in membership.all() {
        for instance in instances {
            let key = keys::status(&role, &instance).map_err(|e| Exit::network(e.into()))?;
            let status = fetch::<ServiceStatus>(&session, &key, TIMEOUT).await.ok();
            lines.push(Line { role: role.clone(), instance, status });
        }
    }
    drop(membership);
    session::close(&session);
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    if options.json {
        println!("{}", serde_json::json!({ "services": lines }));
    } else if lines.is_empty() {
        println!("nobody is alive behind {}", options.at.connect);
    } else {
        println!("{}", table(&lines));
    }
    Ok(SUCCESS)
}

fn table(lines: &[Line]) -> Table {
    let mut table = Table::new();
    table.set_header(["role", "instance", "up", "in flight", "answered", "refused", "p50 ms", "p99 ms"]);
    for line in lines {
        let mut row = vec![line.role.clone(), line.instance.clone()];
        match &line.status {
            Some(s) => row.extend([
                format!("{:.0} s", s.uptime_s),
                format!("{:.0}", s.load),
                s.requests.to_string(),
                s.rejected.to_string(),
                format!("{:.2}", s.p50_ms),
                format!("{:.2}", s.p99_ms),
            ]),
            None => row.push("alive".into()),
        }
        table.add_row(row);
    }
    table
}
