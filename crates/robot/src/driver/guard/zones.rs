//! Zones around the robot in which something stops or slows it.

use curionav_mission::guard_settings::Zone;
use curionav_planning::geometry::{Direction, Point2, Pose2};

use super::sweep::Sweep;

/// The greatest speed that the zones allow to a robot at `pose` of the odometry, m/s: 0 if one stops it, none if
/// nothing that was seen is in any.
pub(super) fn limit(zones: &[Zone], seen: &[&Sweep], pose: Pose2) -> Option<f64> {
    let occupied = zones.iter().filter(|zone| is_occupied(zone, seen, pose));
    occupied.map(|zone| zone.speed.unwrap_or(0.0)).min_by(f64::total_cmp)
}

fn is_occupied(zone: &Zone, seen: &[&Sweep], pose: Pose2) -> bool {
    let reach = zone.reach() * zone.reach();
    let direction = Direction::of(pose.heading);
    let mut inside = 0;
    for (x, y) in seen.iter().flat_map(|sweep| sweep.x.iter().zip(&sweep.y)) {
        let at = Point2::new(*x, *y);
        // A beam that has met nothing has no place, and none is nearer than another.
        if at.distance_squared(pose.position()) <= reach {
            let (ahead, left) = direction.ahead_and_left(pose.position(), at);
            inside += u32::from(zone.holds(ahead, left));
            if inside >= zone.points {
                return true;
            }
        }
    }
    false
}
