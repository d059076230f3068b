//! Which roles a robot needs to drive, and the command that starts one that is missing.

use std::collections::BTreeSet;

use curionav_runtime::config::ServiceConfig;
use curionav_schemas::{ServiceStatus, keys};
use serde::Serialize;

use crate::connect::ConnectOptions;

/// What a robot's own computer runs.
pub(crate) const ROBOT_ROLES: [&str; 3] = ["driver", "localizer", "arbiter"];

/// What pools run, for the planner that is the default.
pub(crate) fn default_pools() -> BTreeSet<String> {
    ["generator", "cpc", "cnc"].map(str::to_owned).into()
}

/// Whether this program has a service for the pool of that name.
fn is_ours(pool: &str) -> bool {
    pool == "cpc-occluded" || default_pools().contains(pool)
}

/// A service that is alive, and what it says of itself, if anything.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Alive<'a> {
    pub(crate) role: &'a str,
    pub(crate) instance: &'a str,
    pub(crate) status: Option<&'a ServiceStatus>,
}

impl Alive<'_> {
    /// Whether it is what is needed. One that says nothing is given the benefit of the doubt.
    fn fills(&self, need: &Need) -> bool {
        let is_for_robot = self.status.is_none_or(|status| status.robot == need.robot);
        self.role == need.role && (need.robot.is_none() || is_for_robot)
    }
}

/// The robots that are `listed`, or else every robot that a service works for; if there is none, the one that is the
/// default.
pub(crate) fn robots(alive: &[Alive<'_>], listed: &[String]) -> BTreeSet<String> {
    if !listed.is_empty() {
        return listed.iter().cloned().collect();
    }
    let mut robots: BTreeSet<String> = alive.iter().filter_map(|one| one.status?.robot.clone()).collect();
    if robots.is_empty() {
        robots.insert(ServiceConfig::default().robot);
    }
    robots
}

/// A role that no service fills: in words, and how to mend it.
#[derive(Debug, Serialize)]
pub(crate) struct Missing {
    pub(crate) what: String,
    pub(crate) fix: String,
}

/// What `robots`, the `tracked` of them whose missions require a tracker of people, and the `pools` that they share
/// need and is not alive.
pub(crate) fn missing(
    robots: &BTreeSet<String>,
    tracked: &BTreeSet<String>,
    pools: &BTreeSet<String>,
    alive: &[Alive<'_>],
    at: &ConnectOptions,
) -> Vec<Missing> {
    let absent =
        Need::of(robots, tracked, pools).into_iter().filter(|need| !alive.iter().any(|one| one.fills(need)));
    absent
        .map(|need| {
            let same_role = alive.iter().filter(|one| one.role == need.role);
            let taken = same_role.map(|one| one.instance.to_owned()).collect();
            Missing { what: need.words(), fix: need.fix(at, &taken) }
        })
        .collect()
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Need {
    pub(crate) role: String,
    /// Of this robot; `None` for pools.
    pub(crate) robot: Option<String>,
}

impl Need {
    fn of(robots: &BTreeSet<String>, tracked: &BTreeSet<String>, pools: &BTreeSet<String>) -> Vec<Self> {
        let of_robots = robots.iter().flat_map(|robot| ROBOT_ROLES.map(|role| (role, Some(robot))));
        let trackers = tracked.iter().map(|robot| (keys::TRACKER, Some(robot)));
        let pools = pools.iter().map(|role| (role.as_str(), None));
        of_robots
            .chain(trackers)
            .chain(pools)
            .map(|(role, robot)| Self { role: role.to_owned(), robot: robot.cloned() })
            .collect()
    }

    fn words(&self) -> String {
        match &self.robot {
            Some(robot) => format!("{} of robot {robot}", self.role),
            None if self.role == "generator" => "trajectory generator".into(),
            None => format!("evaluator of the term {}", self.role),
        }
    }

    /// How to fill it; `taken` are the names in use in this role.
    pub(crate) fn fix(&self, at: &ConnectOptions, taken: &BTreeSet<String>) -> String {
        let Self { role, robot } = self;
        let of_robot = ROBOT_ROLES.contains(&role.as_str()) || role == keys::TRACKER;
        if !(of_robot || is_ours(role)) {
            return format!(
                "start your service that evaluates the term {role}, on the router of {}",
                at.place()
            );
        }
        let base = robot.clone().unwrap_or_else(|| format!("{role}-a"));
        let numbered = (0..).map(|n| format!("{base}-{n}"));
        let free = std::iter::once(base.clone()).chain(numbered).find(|name| !taken.contains(name));
        let instance = free.unwrap_or_default();
        let mut line = format!("curionav {role} {}", at.arguments());
        if let Some(robot) = robot {
            line += &format!(" --robot {robot}");
        }
        format!("start it: {line} --instance {instance}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at() -> ConnectOptions {
        ConnectOptions {
            connect: Some("tcp/10.0.0.1:7447".into()),
            namespace: Some("hall-a".into()),
            ..ConnectOptions::default()
        }
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
        let needs = Need::of(&of(&["r1", "r2"]), &of(&["r2"]), &of(&["generator", "comfort"]));
        assert_eq!(needs.len(), 9);
        assert_eq!(needs[3].words(), "driver of robot r2");
        assert_eq!(needs[6].words(), "tracker of robot r2");
        assert!(needs[6].fix(&at(), &BTreeSet::new()).contains("curionav tracker"));
        assert_eq!(needs[7].words(), "evaluator of the term comfort");
        assert!(
            needs[7]
                .fix(&at(), &BTreeSet::new())
                .contains("start your service that evaluates the term comfort")
        );
    }
}
