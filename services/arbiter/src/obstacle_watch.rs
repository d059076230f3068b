//! What the arbiter sees around the robot that is on no map.

use std::sync::Arc;

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::Obstacles;
use curionav_planning::scene as planning;
use curionav_planning::sensor::LaserModel;
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::lockstep::Latest;
use curionav_schemas::{Belief, Clock, Odometry, People, Scan};
use curionav_tracking_people::{self as perception, Detector, Look, TrackerParams};

/// Messages remembered in real time, to be paired with those of their tick.
const KEPT: usize = 4;
/// A person explains what lies so near to its disc, metres: a stride, and the delay of a tracker. People may be told on
/// the map, where the robot is only known as its belief is: three standard deviations of that come on top.
const PERSON_ERROR: f64 = 0.35;
const SIGMAS: f64 = 3.0;
/// Where all ways are closed, what closes them is forgotten if it has not been seen for so long, seconds.
const LOOK_AGAIN: f64 = 6.0;

/// Gathers scans, and says what stands where.
pub(crate) struct ObstacleWatch {
    scans: Latest<Scan>,
    odometry: Latest<Odometry>,
    recent: Vec<Odometry>,
    seen: perception::Obstacles,
    obstacles: Obstacles,
}

impl ObstacleWatch {
    pub(crate) fn new(scans: Latest<Scan>, odometry: Latest<Odometry>) -> Self {
        let seen = perception::Obstacles::new(perception::ObstacleParams::default());
        Self { scans, odometry, recent: Vec::new(), seen, obstacles: Obstacles::default() }
    }

    /// Forgets everything: a run is over, or the base has started over.
    pub(crate) fn forget(&mut self) {
        self.scans.clear();
        self.odometry.clear();
        self.recent.clear();
        self.seen.restart();
        self.obstacles = Obstacles::default();
    }

    /// Forgets at `stamp` what has not been seen for a while: all ways are closed, and the robot is to look again.
    pub(crate) fn look_again(&mut self, stamp: f64) {
        self.seen.forget_unseen(stamp - LOOK_AGAIN);
    }

    /// What stands where, as cells of the map.
    pub(crate) fn obstacles(&self) -> &Obstacles {
        &self.obstacles
    }

    /// Takes in the scan of a belief's tick; in real time the newest one.
    pub(crate) async fn see(
        &mut self,
        belief: &Belief,
        people: Option<&People>,
        context: &PlanContext,
        clock: Clock,
    ) {
        let Some(scan) = self.scans.of_tick(belief.tick, clock).await.cloned() else { return };
        self.recent.extend(self.odometry.of_tick(belief.tick, clock).await.cloned());
        self.recent.drain(..self.recent.len().saturating_sub(KEPT));
        let Some(odometry) = self.recent.iter().find(|odometry| odometry.tick == scan.tick) else { return };
        let odometry = Pose2::new(odometry.x, odometry.y, odometry.heading);
        let seen = convert::scan(&scan, context.mission.order.laser.range_sigma);
        let Ok((ranges, laser)) = seen else { return };
        let belief = convert::belief(belief);
        let people = people.map(|people| convert::people_at(people, &belief, scan.stamp));
        let map = &context.course.map;
        let beams = beams(&ranges, &laser);
        let mut explained = Detector::new(Arc::clone(map), TrackerParams::default()).explained(
            &ranges,
            &laser,
            belief.pose,
            &belief.covariance,
        );
        explain_people(&mut explained, &beams, &laser, &belief, &people.unwrap_or_default());
        self.seen.see(&Look {
            stamp: scan.stamp,
            laser: odometry.compose(laser.robot_from_laser).into(),
            angle_min: laser.bearing(0),
            increment: laser.bearing(1) - laser.bearing(0),
            beams: &beams,
            explained: &explained,
        });
        let map_from_odometry = belief.pose.compose(odometry.relative(Pose2::default()));
        let occupied = self.seen.occupied().map(|p| map_from_odometry.transform(p));
        self.obstacles = Obstacles::at(occupied, &map.grid);
    }
}

fn beams(ranges: &[f32], laser: &LaserModel) -> Vec<Beam> {
    ranges.iter().map(|range| Beam::of(*range, 0.0, laser.range_max)).collect()
}

/// Marks the beams that may have ended on a person.
fn explain_people(
    explained: &mut [bool],
    beams: &[Beam],
    laser: &LaserModel,
    belief: &planning::Belief,
    people: &planning::People,
) {
    let near = people.radius + PERSON_ERROR + SIGMAS * belief.position_sigma();
    let at = belief.pose.compose(laser.robot_from_laser);
    for (index, (beam, explained)) in beams.iter().zip(explained).enumerate() {
        let Beam::Obstacle(range) = *beam else { continue };
        let (sin, cos) = sin_cos(laser.bearing(index as u32));
        let end = at.transform(Point2::new(range * cos, range * sin));
        *explained |= (0..people.len()).any(|i| people.position(i).distance(end) < near);
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Twist;
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn beams_that_may_have_ended_on_a_person_are_explained() {
        let laser = LaserModel { beams: 3, fov: 0.2, ..LaserModel::default() };
        let pose = Pose2::new(5.0, 5.0, 0.0);
        let people = planning::People::walking(0.25, &[[8.0, 5.0, 0.0, 0.0]]);
        let beams = [Beam::Obstacle(2.75), Beam::Free(8.0), Beam::Obstacle(1.0)];
        let explained = |sigma: f64| {
            let covariance = Matrix3::from_diagonal(&Vector3::new(sigma * sigma, sigma * sigma, 1e-4));
            let belief = planning::Belief { pose, covariance, twist: Twist::default() };
            let mut explained = vec![false, true, false];
            explain_people(&mut explained, &beams, &laser, &belief, &people);
            explained
        };
        assert_eq!(explained(0.02), [true, true, false]);
        assert_eq!(explained(0.5), [true, true, true]);
    }
}
