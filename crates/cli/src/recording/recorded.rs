//! What a recording holds of a robot, for `localize`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::bail;
use curionav_lab::robot_log::Recorded;
use curionav_recording::{Item, Reader};

use crate::recording::robots::only_one;

/// Scans, odometry and beliefs of `robot`, or of the only robot there is; the map of its first mission; what its first
/// run came to.
pub(crate) fn recorded(path: &Path, robot: Option<&str>) -> anyhow::Result<Recorded> {
    let mut found = Recorded::default();
    let mut robots = BTreeSet::new();
    let mut maps = BTreeMap::new();
    let mut map = None;
    let mut first_run = None;
    let mut reader = Reader::open(path)?;
    while let Some(item) = reader.next_message()? {
        match item {
            Item::Scan(name, scan) if is_wanted(robot, &name) => {
                robots.insert(name);
                found.scans.push(*scan);
            }
            Item::Odometry(name, odometry) if is_wanted(robot, &name) => found.odometry.push(odometry),
            Item::Belief(name, belief) if is_wanted(robot, &name) => found.beliefs.push(*belief),
            Item::Mission(mission) if is_wanted(robot, &mission.order.robot) => {
                map = map.or(Some(mission.order.map))
            }
            Item::Map(map) => {
                maps.insert(map.map, map);
            }
            // What a later run or another world came to says nothing of this one.
            Item::Run(run) => {
                let id = (run.world.clone(), run.run);
                if *first_run.get_or_insert_with(|| id.clone()) == id {
                    found.result = run.result;
                }
            }
            _ => {}
        }
    }
    only_one(path, &robots)?;
    if robots.is_empty() {
        let whose = robot.map_or_else(|| "any robot".to_owned(), |robot| format!("robot {robot}"));
        bail!("{}: it has no scan of {whose}", path.display());
    }
    found.map = map.and_then(|map| maps.remove(&map));
    Ok(found)
}

fn is_wanted(robot: Option<&str>, name: &str) -> bool {
    robot.is_none_or(|robot| robot == name)
}
