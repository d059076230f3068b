//! The doctor's own certificate: whether it allows what the doctor does.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::secure;
use curionav_schemas::keys::{ROOT, every_live};
use curionav_security::table::Verb;

use super::finding::Finding;
use crate::connect::robots_of;

/// What the doctor does, with any names in the keys, and the robot in braces.
const NEEDED: [(Verb, &str); 8] = [
    (Verb::Serve, "echo/a"),
    (Verb::Ask, "echo/a"),
    (Verb::Ask, "status/a/a"),
    (Verb::Ask, "robot/{}/mission"),
    (Verb::Ask, "map/a"),
    (Verb::Ask, "generate/a/{}"),
    (Verb::Ask, "evaluate/a/a/{}"),
    (Verb::Subscribe, "robot/{}/scan"),
];

pub(super) fn examine(config: &ServiceConfig, robot: Option<&str>) -> Vec<Finding> {
    let Some(folder) = &config.secure else { return Vec::new() };
    let Some(name) = secure::shown(folder, &config.certificates) else { return Vec::new() };
    let link = format!("certificate {name}");
    let namespace = config.namespace.as_deref();
    let root = namespace.map_or_else(|| ROOT.to_owned(), |namespace| format!("{namespace}/{ROOT}"));
    let tokens = every_live();
    let tokens = tokens.strip_prefix(&format!("{ROOT}/")).unwrap_or(&tokens);
    let listed = robots_of(config);
    let robot = robot.or(listed.first().map(String::as_str)).unwrap_or("a");
    let needed = NEEDED.iter().map(|(verb, of)| (*verb, of.replace("{}", robot)));
    let lacking: Vec<String> = needed
        .chain([(Verb::Watch, tokens.to_owned())])
        .filter(|(verb, of)| !name.may(*verb, &format!("{root}/{of}"), namespace))
        .map(|(verb, of)| format!("{} {of}", verb.word()))
        .collect();
    if lacking.is_empty() {
        let until = secure::until(folder, &name);
        return vec![Finding::proven(link, format!("allows what the doctor does{until}"))];
    }
    let detail = format!("does not allow what the doctor does: {}", lacking.join(", "));
    vec![Finding::missing(
        link,
        detail,
        "use an operator's certificate: --as operator, or one that lists the robot",
    )]
}
