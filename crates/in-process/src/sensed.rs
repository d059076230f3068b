//! What a world tells the robot at a tick.

use curionav_crowdsim::scenario::{PeopleFrame, PeopleSource};
use curionav_crowdsim::{Observation, World};
use curionav_mission::convert;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_schemas::{Odometry, People, Reject, Scan, Validate};

/// The messages of one tick.
#[derive(Debug, Clone)]
pub struct Sensed {
    /// What the laser shows.
    pub scan: Scan,
    /// Measured motion.
    pub odometry: Odometry,
    /// People, if the world tells of them: a tracker finds them otherwise.
    pub people: Option<People>,
}

/// What the sensors say now.
///
/// # Errors
/// The laser shows what no scan may hold: services refuse such a scan, and in lockstep would wait for a valid one in
/// vain.
pub fn sense(world: &World) -> Result<Sensed, Reject> {
    let Observation { tick, stamp, ranges, odometry, twist, people } = world.observe();
    let perception = &world.scenario().perception;
    let told = perception.source == PeopleSource::Truth;
    let people = told.then(|| convert::people_to_wire(&people, tick, stamp));
    let people = people.map(|people| match perception.frame {
        PeopleFrame::Map => people,
        PeopleFrame::Robot => convert::people_seen_from(world.truth().pose, people),
    });
    let scan = convert::scan_to_wire(&world.scenario().laser, ranges, tick, stamp);
    valid(&scan)?;
    let Pose2 { x, y, heading } = odometry;
    let Twist { v, omega } = twist;
    Ok(Sensed { scan, odometry: Odometry { tick, stamp, x, y, heading, v, omega }, people })
}

fn valid(scan: &Scan) -> Result<(), Reject> {
    scan.validate().map_err(|reject| reject.within("scan"))
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn an_invalid_scan_is_refused_and_says_what_is_wrong_with_it() {
        let mut scan = golden::scan();
        assert!(valid(&scan).is_ok());
        scan.ranges.0[1] = f32::INFINITY;
        let Err(reject) = valid(&scan) else { panic!("it is taken") };
        assert_eq!(reject.field.as_deref(), Some("scan.ranges[1]"));
    }
}
