//! Whether something is allowed, as the table has it: what tests expect of a router, and what `doctor` explains with.

use zenoh::key_expr::keyexpr;

use crate::name::Name;
use crate::rules::absolute;
use crate::table::Verb;

impl Name {
    /// Whether it may do this with `key`, which is as on the network, in a deployment with this namespace. A key with
    /// wildcards must lie within one key of the table: what several of them cover together does not count.
    pub fn may(&self, verb: Verb, key: &str, namespace: Option<&str>) -> bool {
        let Ok(key) = keyexpr::new(key) else { return false };
        self.rights().filter(|right| right.verb == verb).any(|right| {
            let filled = right.keys.iter().flat_map(|key| self.fill(key));
            let mut allowed = filled.map(|key| absolute(right.space, namespace, &key));
            allowed.any(|allowed| keyexpr::new(&allowed).is_ok_and(|allowed| allowed.includes(key)))
        })
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::keys::{self, Commanded};

    use super::*;
    use crate::table::TABLE;

    fn name(text: &str) -> Name {
        text.parse().unwrap()
    }

    /// A name for every row, for robot `r1` and world `w`.
    fn everyone() -> Vec<Name> {
        let part = |what: &&str| match *what {
            "robot" | "robots" => "r1",
            "world" => "w",
            _ => "x",
        };
        let role = |row: &crate::table::Row| match row.role {
            "{term}" => "cpc",
            "own-{planner}" => "own-mine",
            role => role,
        };
        TABLE
            .iter()
            .map(|row| Name::new(role(row), &row.names.iter().map(part).collect::<Vec<_>>()).unwrap())
            .collect()
    }

    #[test]
    fn only_a_robots_own_driver_may_command_it_and_only_people_may_command_missions() {
        let cmd = keys::robot("r1", "cmd").unwrap();
        let who = |verb, key: &str| -> Vec<String> {
            let may = everyone().into_iter().filter(|name| name.may(verb, key, None));
            may.map(|name| name.to_string()).collect()
        };
        assert_eq!(who(Verb::Put, &cmd), ["driver.r1.x"]);
        assert_eq!(who(Verb::Serve, &Commanded::Mission.from_all("r1").unwrap()), ["driver.r1.x"]);
        for name in everyone() {
            // Each under its own name, and none under that of another.
            let by = name.to_string();
            let may = ["ros2-gateway.r1.x", "simulator.w.r1.x", "operator", "experimenter", "operator.r1"];
            let expected: Vec<&str> = may.into_iter().filter(|one| *one == by).collect();
            assert_eq!(who(Verb::Ask, &Commanded::Mission.by("r1", &by).unwrap()), expected);
        }
        assert_eq!(who(Verb::Put, &keys::robot("r1", "decision").unwrap()), ["arbiter.r1.x"]);
        assert_eq!(
            who(Verb::Ask, &keys::mission_ready("r1").unwrap()),
            ["localizer.r1.x", "tracker.r1.x", "arbiter.r1.x"]
        );
    }

    #[test]
    fn nothing_that_changes_a_robot_reaches_another_one() {
        let streams =
            ["scan", "odom", "people", "belief", "particles", "mission", "decision", "cmd", "report"];
        for other in everyone().iter().filter(|name| name.to_string().contains("r1")) {
            for key in streams.map(|stream| keys::robot("r2", stream).unwrap()) {
                for verb in [Verb::Put, Verb::Serve, Verb::Subscribe, Verb::Ask] {
                    assert!(!other.may(verb, &key, None), "{other} {verb:?} {key}");
                }
            }
            let question = keys::question("cpc", "a", "r2").unwrap();
            assert!(!other.may(Verb::Ask, &question, None), "{other}");
        }
    }

    #[test]
    fn one_who_lists_robots_sees_and_commands_these_alone_and_their_own_name_only() {
        let ward = name("operator.ward3").for_robots(&["r1".into(), "r2".into()]).unwrap();
        let viewer = name("viewer.ward3").for_robots(&["r1".into(), "r2".into()]).unwrap();
        for robot in ["r1", "r2", "r3", "ward3", "*"] {
            let is_theirs = ["r1", "r2"].contains(&robot);
            let scan = format!("curionav/@v1/robot/{robot}/scan");
            let pause = |by: &str| format!("curionav/@v1/robot/{robot}/pause/{by}");
            assert_eq!(ward.may(Verb::Subscribe, &scan, None), is_theirs, "{robot}");
            assert_eq!(viewer.may(Verb::Subscribe, &scan, None), is_theirs, "{robot}");
            assert_eq!(ward.may(Verb::Ask, &pause("operator.ward3"), None), is_theirs, "{robot}");
            for by in ["operator", "operator.r1", "*", "viewer.ward3"] {
                assert!(!ward.may(Verb::Ask, &pause(by), None), "{robot} {by}");
                assert!(!viewer.may(Verb::Ask, &pause(by), None), "{robot} {by}");
            }
        }
    }

    #[test]
    fn wildcards_of_an_intruder_are_never_covered() {
        for name in everyone() {
            for key in ["**", "@/**", "curionav/**", "curionav/@v1/**", "curionav/@v1/robot/**", "*/@v1/**"] {
                for &verb in Verb::ALL {
                    assert!(!name.may(verb, key, None), "{name} {verb:?} {key}");
                }
            }
        }
    }

    #[test]
    fn the_namespace_is_part_of_every_key_but_the_routers() {
        let (viewer, scan) = (name("viewer"), keys::robot("r1", "scan").unwrap());
        assert!(viewer.may(Verb::Subscribe, &scan, None));
        assert!(!viewer.may(Verb::Subscribe, &scan, Some("hall-a")));
        assert!(viewer.may(Verb::Subscribe, &format!("hall-a/{scan}"), Some("hall-a")));
        assert!(!viewer.may(Verb::Subscribe, &format!("hall-b/{scan}"), Some("hall-a")));
        let router = keys::status("router", "abc").unwrap();
        assert!(viewer.may(Verb::Ask, &router, Some("hall-a")));
    }

    #[test]
    fn every_service_says_how_it_is_and_that_it_lives_under_its_own_name_alone() {
        for name in everyone().iter().filter(|name| name.row().is_service) {
            let role = name.to_string();
            let role = role.split('.').next().unwrap();
            for (verb, key) in [(Verb::Serve, keys::status(role, "x")), (Verb::Hold, keys::live(role, "x"))] {
                assert!(name.may(verb, &key.unwrap(), None), "{name}");
            }
            assert!(!name.may(Verb::Hold, &keys::live(role, "y").unwrap(), None), "{name}");
            assert!(!name.may(Verb::Hold, &keys::live("driver", "y").unwrap(), None), "{name}");
        }
    }
}
