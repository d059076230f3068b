//! Every key expression of the contract, built in one place from checked names.
//!
//! Keys are relative to the session's Zenoh `namespace`, if it has one. `@v1` is a verbatim chunk: wildcards never
//! match it by accident. Every function that takes names fails if one is not [allowed](check_id).

use crate::map::MapId;
pub use crate::names::{KeyError, check_id, check_identity};

/// What every key begins with.
pub const ROOT: &str = "curionav/@v1";

fn key(family: &str, names: [&str; 2]) -> Result<String, KeyError> {
    names.into_iter().try_for_each(check_id)?;
    Ok(format!("{ROOT}/{family}/{}/{}", names[0], names[1]))
}

/// A stream or queryable of a robot: `scan`, `odom`, `people`, `belief`, `mission`, `decision`, `cmd`, `report`,
/// `memory`, `particles`, `lease`.
pub fn robot(robot: &str, stream: &str) -> Result<String, KeyError> {
    key("robot", [robot, stream])
}

/// Where a further sensor of a robot sends its scans: a second scanner, a depth camera, a ranger or a bumper.
pub fn further_scan(name: &str, sensor: &str) -> Result<String, KeyError> {
    check_id(sensor)?;
    Ok(format!("{}/{sensor}", robot(name, "scan")?))
}

/// Where all further sensors of a robot send theirs.
pub fn further_scans(name: &str) -> Result<String, KeyError> {
    Ok(format!("{}/*", robot(name, "scan")?))
}

/// Where all further sensors of every robot send theirs.
pub fn every_further_scan() -> String {
    format!("{ROOT}/robot/*/scan/*")
}

/// The sensor that the key of a further scan names; nothing if its last chunk is not a plain name.
pub fn sensor(key: &str) -> Option<&str> {
    last_name(key)
}

/// What a robot is commanded to do: each kind has a key of its own, whose last chunk says who commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Commanded {
    /// The driver, about the mission.
    Mission,
    /// The base and every driver, to pause or to go on.
    Pause,
    /// The base, by drivers that wish to drive.
    Lease,
}

impl Commanded {
    /// Where commands come in from everyone.
    pub fn from_all(self, robot: &str) -> Result<String, KeyError> {
        Ok(format!("{}/*", self.of(robot)?))
    }

    /// Where `by` commands.
    pub fn by(self, robot: &str, by: &str) -> Result<String, KeyError> {
        check_identity(by)?;
        Ok(format!("{}/{by}", self.of(robot)?))
    }

    fn of(self, name: &str) -> Result<String, KeyError> {
        match self {
            Self::Mission => Ok(format!("{}/command", robot(name, "mission")?)),
            Self::Pause => robot(name, "pause"),
            Self::Lease => Ok(format!("{}/request", robot(name, "lease")?)),
        }
    }
}

/// Who commands, as the last chunk of a command's key says; nothing if that is no name.
pub fn commander(key: &str) -> Option<&str> {
    key.rsplit_once('/').map(|(_, by)| by).filter(|by| check_identity(by).is_ok())
}

/// Where services tell the driver whether they are ready for a robot's mission.
pub fn mission_ready(name: &str) -> Result<String, KeyError> {
    Ok(format!("{}/ready", robot(name, "mission")?))
}

/// The same stream of every robot.
pub fn every_robot(stream: &str) -> Result<String, KeyError> {
    check_id(stream)?;
    Ok(format!("{ROOT}/robot/*/{stream}"))
}

/// The role of trajectory generators. An evaluator's role is the name of its term.
pub const GENERATOR: &str = "generator";

/// What the role of a planner of one's own begins with: it is `own-` and the planner's name. It generates, and is asked
/// under the keys of a term of that name.
pub const OWN_PLANNER: &str = "own-";

/// Whether a role is asked for candidates, and not what they cost.
pub fn generates(role: &str) -> bool {
    role == GENERATOR || role.starts_with(OWN_PLANNER)
}

/// The role of drivers.
pub const DRIVER: &str = "driver";

/// The role of what tracks people. A mission that requires it takes people from it alone.
pub const TRACKER: &str = "tracker";

/// The role of what joins a robot of ROS 2.
pub const ROS2_GATEWAY: &str = "ros2-gateway";

/// Everything before the instance in the key of a question to `role`.
fn pool_of(role: &str) -> Result<String, KeyError> {
    check_id(role)?;
    Ok(if role == GENERATOR { format!("{ROOT}/generate") } else { format!("{ROOT}/evaluate/{role}") })
}

/// Where one replica of `role` (the generator, or a term) takes the questions of one robot.
pub fn question(role: &str, instance: &str, robot: &str) -> Result<String, KeyError> {
    [instance, robot].into_iter().try_for_each(check_id)?;
    Ok(format!("{}/{instance}/{robot}", pool_of(role)?))
}

/// Where one replica of `role` takes the questions of every robot.
pub fn questions(role: &str, instance: &str) -> Result<String, KeyError> {
    check_id(instance)?;
    Ok(format!("{}/{instance}/*", pool_of(role)?))
}

/// The names in a key of a family; nothing if they are more or fewer, or one is not plain.
fn names_of<'a, const N: usize>(key: &'a str, family: &str) -> Option<[&'a str; N]> {
    let names = key.strip_prefix(ROOT)?.strip_prefix('/')?.strip_prefix(family)?.strip_prefix('/')?;
    let names: [&str; N] = names.split('/').collect::<Vec<_>>().try_into().ok()?;
    names.iter().all(|name| check_id(name).is_ok()).then_some(names)
}

/// The robot that a question's key names; nothing if its last chunk is not a plain name.
pub fn asker(key: &str) -> Option<&str> {
    last_name(key)
}

fn last_name(key: &str) -> Option<&str> {
    key.rsplit_once('/').map(|(_, name)| name).filter(|name| check_id(name).is_ok())
}

/// Where a map can be asked for by its hash.
pub fn map(map: &MapId) -> String {
    format!("{ROOT}/map/{map}")
}

/// A channel of a simulated world: `scenario`, `check`, `robot`, `people`, `run`.
pub fn world(world: &str, channel: &str) -> Result<String, KeyError> {
    key("world", [world, channel])
}

/// The liveliness token of a service, declared after its queryable.
pub fn live(role: &str, instance: &str) -> Result<String, KeyError> {
    key("live", [role, instance])
}

/// A channel of every simulated world.
pub fn every_world(channel: &str) -> Result<String, KeyError> {
    check_id(channel)?;
    Ok(format!("{ROOT}/world/*/{channel}"))
}

/// All liveliness tokens.
pub fn every_live() -> String {
    format!("{ROOT}/live/*/*")
}

/// The liveliness tokens of one role.
pub fn every_live_of(role: &str) -> Result<String, KeyError> {
    check_id(role)?;
    Ok(format!("{ROOT}/live/{role}/*"))
}

/// Where a bare query is answered with as many bytes as it asks for.
pub fn echo(instance: &str) -> String {
    format!("{ROOT}/echo/{instance}")
}

/// Where a service answers with its `ServiceStatus`.
pub fn status(role: &str, instance: &str) -> Result<String, KeyError> {
    key("status", [role, instance])
}

/// All services' status.
pub fn every_status() -> String {
    format!("{ROOT}/status/*/*")
}

/// The (role, instance) of a liveliness token's or a status key; `None` if the key is neither.
pub fn service_of(key: &str) -> Option<(&str, &str)> {
    ["live", "status"].into_iter().find_map(|family| names_of(key, family)).map(<(&str, &str)>::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_those_of_the_table() {
        assert_eq!(robot("r1", "scan").unwrap(), "curionav/@v1/robot/r1/scan");
        assert_eq!(further_scan("r1", "camera").unwrap(), "curionav/@v1/robot/r1/scan/camera");
        assert_eq!(further_scans("r1").unwrap(), "curionav/@v1/robot/r1/scan/*");
        assert_eq!(every_further_scan(), "curionav/@v1/robot/*/scan/*");
        assert_eq!(every_robot("report").unwrap(), "curionav/@v1/robot/*/report");
        assert_eq!(every_live_of("cpc").unwrap(), "curionav/@v1/live/cpc/*");
        let operator = "operator.ward3";
        assert_eq!(
            Commanded::Mission.by("r1", operator).unwrap(),
            "curionav/@v1/robot/r1/mission/command/operator.ward3"
        );
        assert_eq!(Commanded::Mission.from_all("r1").unwrap(), "curionav/@v1/robot/r1/mission/command/*");
        assert_eq!(
            Commanded::Pause.by("r1", operator).unwrap(),
            "curionav/@v1/robot/r1/pause/operator.ward3"
        );
        assert_eq!(Commanded::Lease.from_all("r1").unwrap(), "curionav/@v1/robot/r1/lease/request/*");
        assert_eq!(mission_ready("r1").unwrap(), "curionav/@v1/robot/r1/mission/ready");
        assert_eq!(question("generator", "g-0", "r1").unwrap(), "curionav/@v1/generate/g-0/r1");
        assert_eq!(question("cpc", "a", "r1").unwrap(), "curionav/@v1/evaluate/cpc/a/r1");
        assert_eq!(questions("generator", "g-0").unwrap(), "curionav/@v1/generate/g-0/*");
        assert_eq!(questions("cnc", "a").unwrap(), "curionav/@v1/evaluate/cnc/a/*");
        assert_eq!(map(&MapId([0xab; 32])), format!("curionav/@v1/map/{}", "ab".repeat(32)));
        assert_eq!(world("w", "run").unwrap(), "curionav/@v1/world/w/run");
        assert_eq!(live("arbiter", "x_1").unwrap(), "curionav/@v1/live/arbiter/x_1");
        assert_eq!(status("arbiter", "x_1").unwrap(), "curionav/@v1/status/arbiter/x_1");
    }

    #[test]
    fn a_name_cannot_leave_its_chunk() {
        for name in ["", "a/b", "*", "**", "@v1", "A", "a b", "ä", "$*", "a?b", "a#b", &"a".repeat(65)] {
            assert!(robot(name, "scan").is_err(), "{name:?}");
            assert!(further_scan("r1", name).is_err(), "{name:?}");
            assert!(live("arbiter", name).is_err(), "{name:?}");
        }
        assert!(check_id(&"a".repeat(64)).is_ok());
        assert!(robot("A", "scan").unwrap_err().to_string().contains("`A` must be 1 to 64"));
    }

    #[test]
    fn a_question_names_its_robot_or_is_of_none() {
        assert_eq!(asker(&question("cpc", "a", "r1").unwrap()), Some("r1"));
        for key in [&questions("cpc", "a").unwrap(), "curionav/@v1/evaluate/cpc/a/**", "curionav/@v1/x/R", ""]
        {
            assert_eq!(asker(key), None, "{key}");
        }
    }

    #[test]
    fn a_command_names_who_gives_it_or_is_of_nobody() {
        let key = Commanded::Pause.by("r1", "simulator.w.r1.a").unwrap();
        assert_eq!(commander(&key), Some("simulator.w.r1.a"));
        let long = format!("x/{}", "a".repeat(65));
        for key in [
            &Commanded::Pause.from_all("r1").unwrap(),
            "x/a..b",
            "x/.",
            "x/a.",
            "x/\u{1b}[0m",
            "a",
            "",
            &long,
        ] {
            assert_eq!(commander(key), None, "{key}");
        }
        for by in ["", "a b", "a/b", "*", "a.b.c.d.e", "A"] {
            assert!(Commanded::Mission.by("r1", by).is_err(), "{by:?}");
        }
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
