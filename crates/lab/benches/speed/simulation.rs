//! The simulated world: the laser among people, and people who avoid each other.

use std::fmt::Write;
use std::sync::Arc;

use curionav_crowdsim::{Scenario, World};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};

use crate::case::Case;
use crate::mission::OnTheWay;

/// Ticks that a crowd walks in one repeat.
const TICKS: u32 = 10;

/// One scan of 181 beams among 27 people, and a tick of crowds of three sizes.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let OnTheWay { world, .. } = OnTheWay::with("curiosity")?;
    let mut cases = vec![Case::new("simulate/laser", move || world.observe())];
    for people in [25, 100, 250] {
        let world = Arc::new(crowd(people)?);
        let walk = |mut world: World| (0..TICKS).for_each(|_| world.step(Twist::default()));
        cases.push(Case::after(format!("simulate/hrvo/{people}"), TICKS, move || (*world).clone(), walk));
    }
    Ok(cases)
}

/// `people` in rows, who cross a hall of 30 m x 30 m to the point that mirrors their start at its middle.
fn crowd(people: usize) -> anyhow::Result<World> {
    let mut text = String::from(
        "name = \"crossing\"\nmap = { file = \"none.yaml\" }\nrobot = { start = [15.0, 28.5, 0.0], goal = [1.5, 28.5] }\n\
         people = { motion = \"hrvo\" }\n",
    );
    for k in 0..people {
        let x = 1.5 + 1.1 * (k % 12) as f64;
        let y = 1.5 + 1.1 * (k / 12) as f64;
        let to_x = 29.0 - x;
        let to_y = 26.0 - y;
        write!(text, "[[walkers]]\nroute = [[{x}, {y}], [{to_x}, {to_y}]]\n")?;
    }
    let scenario = Scenario::from_toml(&text)?;
    let grid = OccupancyGrid::new(300, 300, 0.1, Pose2::default(), vec![0; 90_000])?;
    Ok(World::new(&scenario, StaticMap::new(grid), Vec::new(), 1)?)
}
