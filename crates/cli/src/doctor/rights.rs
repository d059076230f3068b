//! The doctor's own certificate: whether it allows what the doctor does.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::secure;
use curionav_schemas::keys::{ROOT, every_live};
use curionav_security::table::Verb;

use super::finding::Finding;

/// What the doctor does, with any names in the keys.
const NEEDED: [(Verb, &str); 8] = [
    (Verb::Serve, "echo/a"),
    (Verb::Ask, "echo/a"),
    (Verb::Ask, "status/a/a"),
    (Verb::Ask, "robot/a/mission"),
    (Verb::Ask, "map/a"),
    (Verb::Ask, "generate/a/a"),
    (Verb::Ask, "evaluate/a/a/a"),
    (Verb::Subscribe, "robot/a/scan"),
];

pub(super) fn examine(config: &ServiceConfig) -> Vec<Finding> {
    let Some(folder) = &config.secure else { return Vec::new() };
    let Some(name) = secure::shown(folder, &config.certificates) else { return Vec::new() };
    let link = format!("certificate {name}");
    let namespace = config.namespace.as_deref();
    let root = namespace.map_or_else(|| ROOT.to_owned(), |namespace| format!("{namespace}/{ROOT}"));
    let tokens = every_live();
    let tokens = tokens.strip_prefix(&format!("{ROOT}/")).unwrap_or(&tokens);
    let needed = NEEDED.iter().copied().chain([(Verb::Watch, tokens)]);
    let lacking: Vec<String> = needed
        .filter(|(verb, of)| !name.may(*verb, &format!("{root}/{of}"), namespace))
        .map(|(verb, of)| format!("{} {of}", verb.word()))
        .collect();
    if lacking.is_empty() {
        let until = secure::until(folder, &name);
        return vec![Finding::proven(link, format!("allows what the doctor does{until}"))];
    }
    let detail = format!("does not allow what the doctor does: {}", lacking.join(", "));
    vec![Finding::missing(link, detail, "use the operator's certificate: --as operator")]
}
