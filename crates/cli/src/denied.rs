//! What routers say of themselves, and what they have denied.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::probe::ask_all;
use curionav_runtime::session;
use curionav_schemas::{ServiceStatus, keys};
use curionav_security::name::Name;
use curionav_security::table::Verb;
use serde::Serialize;

const TIMEOUT: Duration = Duration::from_secs(1);

/// What the routers say of themselves. They know no namespace, so they are asked without.
pub(crate) async fn routers(config: &ServiceConfig) -> Result<Vec<ServiceStatus>, Exit> {
    let plain = session::client(&ServiceConfig { namespace: None, ..config.clone() }).await?;
    let key = format!("{}/status/router/*", keys::ROOT);
    let asked = ask_all(&plain, &key, None, TIMEOUT).await;
    session::close(&plain);
    let (replies, _) = asked.map_err(Exit::network)?;
    Ok(replies.iter().filter_map(|reply| reply.decode()?.ok()).collect())
}

/// Messages of one kind that routers have denied to the holders of one certificate.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Denied {
    certificate: String,
    message: String,
    pub(crate) count: u64,
}

/// All that these routers have denied since they started.
pub(crate) fn denied(routers: &[ServiceStatus]) -> Vec<Denied> {
    let mut counts = BTreeMap::<(String, String), u64>::new();
    for (sample, count) in routers.iter().flat_map(|router| &router.metrics) {
        if !sample.starts_with("curionav_denied{") {
            continue;
        }
        if let (Some(who), Some(what)) = (label(sample, "certificate"), label(sample, "message")) {
            // A router declares all that it knows to every other router. The rules deny it the streams of robots on
            // purpose, so that is nothing to report.
            if what == "declare" && who.split('.').next() == Some("router") {
                continue;
            }
            *counts.entry((who.to_owned(), what.to_owned())).or_default() += *count as u64;
        }
    }
    counts.into_iter().map(|((certificate, message), count)| Denied { certificate, message, count }).collect()
}

/// The value of a label of a sample, in Prometheus's format.
pub(crate) fn label<'a>(sample: &'a str, name: &str) -> Option<&'a str> {
    sample.split_once(&format!("{name}=\""))?.1.split('"').next()
}

impl Denied {
    /// What was denied, in one line.
    pub(crate) fn words(&self) -> String {
        let Self { certificate, message, count } = self;
        format!("{count} messages of the kind `{message}` of the certificate `{certificate}`")
    }

    /// Which right was missing, and what the certificate does allow.
    pub(crate) fn missing_right(&self) -> String {
        let verbs: &[Verb] = match self.message.as_str() {
            "put" => &[Verb::Put],
            "query" => &[Verb::Ask],
            "reply" | "reply-err" => &[Verb::Serve],
            "declare" => &[Verb::Subscribe, Verb::Serve, Verb::Hold],
            "interest" => &[Verb::Watch],
            _ => return format!("no certificate allows `{}`", self.message),
        };
        let Ok(name) = self.certificate.parse::<Name>() else {
            return "the certificate has no rights: see docs/security.md for names that have".into();
        };
        let allowed: Vec<String> = verbs
            .iter()
            .map(|&verb| {
                let rights = name.rights().filter(|right| right.verb == verb);
                let keys: Vec<String> =
                    rights.flat_map(|right| right.keys).flat_map(|key| name.fill(key)).collect();
                let keys = if keys.is_empty() { "nothing".to_owned() } else { keys.join(", ") };
                format!("{} {keys}", verb.word())
            })
            .collect();
        format!("`{name}` may {}; a program that needs more needs another certificate", allowed.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn what_routers_have_denied_is_added_up_and_the_missing_right_is_named() {
        let sample = |who: &str, what: &str| {
            format!("curionav_denied{{role=\"router\",name=\"a\",certificate=\"{who}\",message=\"{what}\"}}")
        };
        let metrics = [(sample("echo.a", "put"), 3.0), (sample("viewer", "query"), 1.0)];
        let router = ServiceStatus { metrics: metrics.into(), ..golden::service_status() };
        let found = denied(&[router.clone(), router]);
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].words(), "6 messages of the kind `put` of the certificate `echo.a`");
        assert!(
            found[0].missing_right().starts_with("`echo.a` may put nothing;"),
            "{}",
            found[0].missing_right()
        );
        let viewer = found[1].missing_right();
        assert!(viewer.contains("`viewer` may ask robot/*/mission, robot/*/lease, world/*/run"), "{viewer}");
    }
}
