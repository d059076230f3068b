//! Every key expression of the contract, built in one place from checked names.
//!
//! Keys are relative to the session's Zenoh `namespace`, if it has one. `@v1` is a verbatim chunk: wildcards never
//! match it by accident.

use crate::limits::MAX_ID;
use crate::map::MapId;

/// What every key begins with.
pub const ROOT: &str = "curionav/@v1";

/// A name that cannot be a chunk of a key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("name `{name}` must be 1 to {MAX_ID} of the characters a-z, 0-9, `_` and `-`")]
pub struct KeyError {
    /// The name, cut to a length that can be shown.
    pub name: String,
}

/// Checks a name of a robot, instance, role, metric, world or stream.
///
/// # Errors
/// It is empty, longer than [`MAX_ID`], or has a character other than `a-z`, `0-9`, `_` and `-`.
pub fn check_id(name: &str) -> Result<(), KeyError> {
    let allowed = |byte: u8| matches!(byte, b'a'..=b'z' | b'0'..=b'9' | b'_' | b'-');
    if (1..=MAX_ID).contains(&name.len()) && name.bytes().all(allowed) {
        return Ok(());
    }
    Err(KeyError { name: name.chars().take(MAX_ID).collect() })
}

fn key(family: &str, names: [&str; 2]) -> Result<String, KeyError> {
    names.into_iter().try_for_each(check_id)?;
    Ok(format!("{ROOT}/{family}/{}/{}", names[0], names[1]))
}

/// A stream or queryable of a robot: `scan`, `odom`, `people`, `belief`, `mission`, `decision`, `cmd`, `report`,
/// `memory`, `particles`.
///
/// # Errors
/// A name is not [allowed](check_id); so for every function here.
pub fn robot(robot: &str, stream: &str) -> Result<String, KeyError> {
    key("robot", [robot, stream])
}

/// The same stream of every robot.
///
/// # Errors
/// As [`robot`].
pub fn every_robot(stream: &str) -> Result<String, KeyError> {
    check_id(stream)?;
    Ok(format!("{ROOT}/robot/*/{stream}"))
}

/// Where one generator answers.
///
/// # Errors
/// As [`robot`].
pub fn generate(instance: &str) -> Result<String, KeyError> {
    check_id(instance)?;
    Ok(format!("{ROOT}/generate/{instance}"))
}

/// All generators.
pub fn every_generator() -> String {
    format!("{ROOT}/generate/*")
}

/// Where one evaluator of a metric answers.
///
/// # Errors
/// As [`robot`].
pub fn evaluate(metric: &str, instance: &str) -> Result<String, KeyError> {
    key("evaluate", [metric, instance])
}

/// All evaluators of a metric.
///
/// # Errors
/// As [`robot`].
pub fn every_evaluator(metric: &str) -> Result<String, KeyError> {
    check_id(metric)?;
    Ok(format!("{ROOT}/evaluate/{metric}/*"))
}

/// Where a map can be asked for by its hash.
pub fn map(map: &MapId) -> String {
    format!("{ROOT}/map/{map}")
}

/// All maps.
pub fn every_map() -> String {
    format!("{ROOT}/map/*")
}

/// A channel of a simulated world: `scenario`, `check`, `robot`, `people`, `run`.
///
/// # Errors
/// As [`robot`].
pub fn world(world: &str, channel: &str) -> Result<String, KeyError> {
    key("world", [world, channel])
}

/// The liveliness token of a service, declared after its queryable.
///
/// # Errors
/// As [`robot`].
pub fn live(role: &str, instance: &str) -> Result<String, KeyError> {
    key("live", [role, instance])
}

/// A channel of every simulated world.
///
/// # Errors
/// As [`robot`].
pub fn every_world(channel: &str) -> Result<String, KeyError> {
    check_id(channel)?;
    Ok(format!("{ROOT}/world/*/{channel}"))
}

/// The liveliness tokens of a role.
///
/// # Errors
/// As [`robot`].
pub fn every_live_of(role: &str) -> Result<String, KeyError> {
    check_id(role)?;
    Ok(format!("{ROOT}/live/{role}/*"))
}

/// All liveliness tokens.
pub fn every_live() -> String {
    format!("{ROOT}/live/*/*")
}

/// Where a service answers with its `ServiceStatus`.
///
/// # Errors
/// As [`robot`].
pub fn status(role: &str, instance: &str) -> Result<String, KeyError> {
    key("status", [role, instance])
}

/// All services' status.
pub fn every_status() -> String {
    format!("{ROOT}/status/*/*")
}

/// The (role, instance) of a liveliness token's or a status key; `None` if the key is neither.
pub fn service_of(key: &str) -> Option<(&str, &str)> {
    let (family, names) = key.strip_prefix(ROOT)?.strip_prefix('/')?.split_once('/')?;
    let (role, instance) = names.split_once('/')?;
    let named = check_id(role).is_ok() && check_id(instance).is_ok();
    (matches!(family, "live" | "status") && named).then_some((role, instance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_those_of_the_table() {
        assert_eq!(robot("r1", "scan").unwrap(), "curionav/@v1/robot/r1/scan");
        assert_eq!(every_robot("report").unwrap(), "curionav/@v1/robot/*/report");
        assert_eq!(generate("g-0").unwrap(), "curionav/@v1/generate/g-0");
        assert_eq!(evaluate("cpc", "a").unwrap(), "curionav/@v1/evaluate/cpc/a");
        assert_eq!(every_evaluator("cnc").unwrap(), "curionav/@v1/evaluate/cnc/*");
        assert_eq!(map(&MapId([0xab; 32])), format!("curionav/@v1/map/{}", "ab".repeat(32)));
        assert_eq!(world("w", "run").unwrap(), "curionav/@v1/world/w/run");
        assert_eq!(live("arbiter", "x_1").unwrap(), "curionav/@v1/live/arbiter/x_1");
        assert_eq!(status("arbiter", "x_1").unwrap(), "curionav/@v1/status/arbiter/x_1");
    }

    #[test]
    fn a_name_cannot_leave_its_chunk() {
        for name in ["", "a/b", "*", "**", "@v1", "A", "a b", "ä", "$*", "a?b", "a#b", &"a".repeat(65)] {
            assert!(robot(name, "scan").is_err(), "{name:?}");
            assert!(live("arbiter", name).is_err(), "{name:?}");
        }
        assert!(check_id(&"a".repeat(64)).is_ok());
        assert!(robot("A", "scan").unwrap_err().to_string().contains("`A` must be 1 to 64"));
    }

    #[test]
    fn a_service_key_gives_back_its_names() {
        assert_eq!(service_of(&live("cpc", "a").unwrap()), Some(("cpc", "a")));
        assert_eq!(service_of(&status("cpc", "a").unwrap()), Some(("cpc", "a")));
        for key in [
            "",
            "curionav/@v1/live/cpc",
            "curionav/@v1/live/cpc/a/b",
            "curionav/@v1/world/w/run",
            "x/live/a/b",
        ] {
            assert_eq!(service_of(key), None, "{key}");
        }
    }
}
