//! Who has to be there for a robot to drive, and the command that starts whoever is not.

use std::collections::BTreeSet;

use curionav_runtime::config::ServiceConfig;
use curionav_schemas::ServiceStatus;

use crate::connect::ConnectOptions;

/// What a robot's own computer runs.
pub(crate) const ROBOT_ROLES: [&str; 3] = ["driver", "localizer", "arbiter"];
/// What pools run, for the planner that is the default.
pub(crate) const POOL_ROLES: [&str; 3] = ["generator", "cpc", "cnc"];

/// Somebody who is alive, and what they say of themselves, if anything.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alive<'a> {
    pub(crate) role: &'a str,
    pub(crate) instance: &'a str,
    pub(crate) status: Option<&'a ServiceStatus>,
}

impl<'a> Alive<'a> {
    fn robot(&self) -> Option<&'a str> {
        self.status?.robot.as_deref()
    }

    /// Whether it is what somebody needs. One that says nothing is given the benefit of the doubt.
    fn fills(&self, need: &Need) -> bool {
        let for_them = self.status.is_none() || need.robot.as_deref() == self.robot();
        self.role == need.role && (need.robot.is_none() || for_them)
    }
}

/// Every robot that somebody works for; if there is none, the one that is the default.
pub(crate) fn robots(alive: &[Alive<'_>]) -> BTreeSet<String> {
    let mut robots: BTreeSet<String> =
        alive.iter().filter_map(|one| one.robot().map(str::to_owned)).collect();
    if robots.is_empty() {
        robots.insert(ServiceConfig::default().robot);
    }
    robots
}

/// What of `needs` nobody fills: in words, and how to mend it.
pub(crate) fn missing(needs: Vec<Need>, alive: &[Alive<'_>], at: &ConnectOptions) -> Vec<(String, String)> {
    let absent = needs.into_iter().filter(|need| !alive.iter().any(|one| one.fills(need)));
    absent
        .map(|need| {
            let same_role = alive.iter().filter(|one| one.role == need.role);
            let taken = same_role.map(|one| one.instance.to_owned()).collect();
            (need.words(), need.fix(at, &taken))
        })
        .collect()
}

/// A role that somebody must fill.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Need {
    pub(crate) role: String,
    /// Of this robot; `None` for pools.
    pub(crate) robot: Option<String>,
}

impl Need {
    /// Every role of `robots`, and of the pools they share.
    pub(crate) fn of(robots: &BTreeSet<String>, pools: &BTreeSet<String>) -> Vec<Self> {
        let pool = |role: &String| Self { role: role.clone(), robot: None };
        let of_robot = |robot: &String| {
            ROBOT_ROLES.map(|role| Self { role: role.to_owned(), robot: Some(robot.clone()) })
        };
        robots.iter().flat_map(of_robot).chain(pools.iter().map(pool)).collect()
    }

    /// What is missing, in words.
    pub(crate) fn words(&self) -> String {
        match &self.robot {
            Some(robot) => format!("{} of robot {robot}", self.role),
            None if self.role == "generator" => "trajectory generator".into(),
            None => format!("evaluator of the term {}", self.role),
        }
    }

    /// How to fill it; `taken` are the names in use in this role.
    pub(crate) fn fix(&self, at: &ConnectOptions, taken: &BTreeSet<String>) -> String {
        let command = match self.role.as_str() {
            "generator" | "cpc" | "cnc" | "driver" | "localizer" | "arbiter" => &self.role,
            term => {
                return format!(
                    "start your service that evaluates the term {term}, on the router of {}",
                    at.connect
                );
            }
        };
        let free = |base: &str| {
            let numbered = (0..).map(|n| format!("{base}-{n}"));
            std::iter::once(base.to_owned())
                .chain(numbered)
                .find(|name| !taken.contains(name))
                .unwrap_or_default()
        };
        let instance = match &self.robot {
            Some(robot) => free(robot),
            None => free(&format!("{command}-a")),
        };
        let mut line = format!("curionav {command} --connect {}", at.connect);
        if let Some(namespace) = &at.namespace {
            line += &format!(" --namespace {namespace}");
        }
        if let Some(robot) = &self.robot {
            line += &format!(" --robot {robot}");
        }
        format!("start it: {line} --instance {instance}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at() -> ConnectOptions {
        ConnectOptions { connect: "tcp/10.0.0.1:7447".into(), namespace: Some("hall-a".into()) }
    }

    #[test]
    fn the_fix_is_a_command_that_can_be_typed() {
        let need = Need { role: "cnc".into(), robot: None };
        let taken = BTreeSet::from(["cnc-a".to_owned()]);
        assert_eq!(
            need.fix(&at(), &taken),
            "start it: curionav cnc --connect tcp/10.0.0.1:7447 --namespace hall-a --instance cnc-a-0"
        );
        let need = Need { role: "arbiter".into(), robot: Some("r1".into()) };
        assert_eq!(
            need.fix(&at(), &BTreeSet::new()),
            "start it: curionav arbiter --connect tcp/10.0.0.1:7447 --namespace hall-a --robot r1 --instance r1"
        );
    }

    #[test]
    fn every_robot_needs_its_own_and_all_share_the_pools() {
        let of = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        let needs = Need::of(&of(&["r1", "r2"]), &of(&["generator", "comfort"]));
        assert_eq!(needs.len(), 8);
        assert_eq!(needs[3].words(), "driver of robot r2");
        assert_eq!(needs[6].words(), "evaluator of the term comfort");
        assert!(
            needs[6]
                .fix(&at(), &BTreeSet::new())
                .contains("start your service that evaluates the term comfort")
        );
    }
}
