//! How fast a robot may drive now, so that it is slow enough when it comes into a speed zone.

use crate::geometry::Point2;
use crate::motion::RobotModel;
use crate::occupancy::OccupancyGrid;

/// The share of its greatest speed that the robot may plan with now, (0, 1]; it is `here`, map frame. A decision may be
/// driven for `held` seconds.
///
/// The centre of the robot counts. A zone at a distance d allows the speed u with `d = u * held + (u^2 - v^2) / (2 a)`,
/// where v is the speed inside and a the robot's acceleration: a robot at u that drives on for as long as a decision
/// may be driven can still brake to v before the zone. As it comes nearer at u, u falls by less than a per second, so
/// braking never has to be harder than the robot can. The least of all zones counts, also of those behind walls.
pub fn allowed_share(robot: &RobotModel, grid: &OccupancyGrid, here: Point2, held: f64) -> f64 {
    if grid.limits().is_empty() {
        return 1.0;
    }
    let cell = grid.resolution();
    // A cell begins half a diagonal before its centre at most.
    let half_diagonal = std::f64::consts::FRAC_1_SQRT_2 * cell;
    let reach = robot.v_max * held + robot.stopping_distance(robot.v_max) + half_diagonal;
    let (column, row) = grid.grid_from_map(here);
    let span = |at: f64, end: usize| {
        let from = (at - reach / cell).floor().clamp(0.0, end as f64) as usize;
        let to = (at + reach / cell).ceil().clamp(0.0, end as f64) as usize;
        from..to
    };
    let columns = span(column, grid.width());
    let mut share: f64 = 1.0;
    for r in span(row, grid.height()) {
        for c in columns.clone() {
            let limit = f64::from(grid.limit(grid.index(c, r))) / f64::from(OccupancyGrid::NO_LIMIT);
            // Keepout is no slow floor but none at all.
            if limit > 0.0 && limit < share {
                let distance = grid.centre(c, r).distance(here) - half_diagonal;
                share = share.min(allowed_at(robot, limit, distance.max(0.0), held));
            }
        }
    }
    share
}

/// The share that a zone of the share `limit` allows so many metres before it.
fn allowed_at(robot: &RobotModel, limit: f64, distance: f64, held: f64) -> f64 {
    let slow = limit * robot.v_max;
    if distance <= slow * held {
        return limit;
    }
    let lost = robot.a_max * held;
    let speed = (lost * lost + slow * slow + 2.0 * robot.a_max * distance).sqrt() - lost;
    (speed / robot.v_max).clamp(limit, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    const HELD: f64 = 1.2;

    /// 20 m by 1 m in cells of 0.1 m; from x = 10 m on, `limit` per cent are allowed.
    fn corridor(limit: u8) -> OccupancyGrid {
        let grid = OccupancyGrid::new(200, 10, 0.1, Pose2::default(), vec![0; 2000]).unwrap();
        grid.with_limits((0..2000).map(|i| if i % 200 < 100 { 100 } else { limit }).collect()).unwrap()
    }

    fn share(grid: &OccupancyGrid, x: f64) -> f64 {
        allowed_share(&RobotModel::default(), grid, Point2::new(x, 0.45), HELD)
    }

    #[test]
    fn nothing_is_limited_without_zones_far_from_them_and_by_keepout() {
        let open = corridor(100);
        assert_eq!((open.limits().len(), share(&open, 15.0)), (0, 1.0));
        assert_eq!(share(&corridor(0), 15.0), 1.0);
        // 1.2 m at full speed and 1 m of braking.
        assert_eq!(share(&corridor(30), 7.7), 1.0);
        assert!(share(&corridor(30), 8.2) < 1.0);
    }

    #[test]
    fn inside_a_zone_and_right_before_it_its_limit_holds() {
        for x in [9.7, 10.0, 10.05, 13.0, 19.9, 25.0] {
            let on_floor = x < 20.0;
            assert_eq!(share(&corridor(30), x), if on_floor { 0.3 } else { 1.0 }, "{x}");
        }
    }

    /// A robot on its way along the corridor.
    #[derive(Clone, Copy)]
    struct Moving {
        x: f64,
        v: f64,
    }

    impl Moving {
        /// Drives as fast as it may for some seconds, in a world where from x = 10 m on `most` m/s are allowed.
        fn drive(mut self, robot: &RobotModel, seconds: f64, most: f64) -> Self {
            const H: f64 = 0.01;
            for _ in 0..(seconds / H).round() as usize {
                self.v = robot.limit_speed(self.v, 1.0, H);
                self.x += self.v * H;
                assert!(self.x < 10.0 || self.v <= most + 1e-9, "{} m/s at {} m", self.v, self.x);
            }
            self
        }
    }

    #[test]
    fn who_plans_with_the_share_arrives_slow_enough_and_never_brakes_harder_than_it_can() {
        for (period, limit, a_max) in
            [(0.1, 30, 0.5), (0.3, 30, 0.5), (0.3, 10, 0.5), (0.3, 5, 0.2), (0.3, 50, 2.0)]
        {
            let robot = RobotModel { a_max, ..RobotModel::default() };
            let grid = corridor(limit);
            let most = f64::from(limit) / 100.0;
            let mut at = Moving { x: 0.5, v: 1.0 };
            while at.x < 12.0 {
                let slowed = robot.slowed(allowed_share(&robot, &grid, Point2::new(at.x, 0.45), HELD));
                // Whatever comes after a decision, it may be held to its end.
                at.drive(&slowed, HELD, most);
                at = at.drive(&slowed, period, most);
                assert!(at.v <= slowed.v_max + 1e-9, "it did not brake in time: {} m/s at {} m", at.v, at.x);
            }
        }
    }

    #[test]
    fn a_robot_that_is_too_fast_brakes_as_hard_as_it_can_and_no_harder() {
        let slow = RobotModel::default().slowed(0.1);
        assert_eq!(slow.limit_speed(0.8, 1.0, 0.1), 0.75);
        assert_eq!(slow.limit_speed(0.12, 1.0, 0.1), 0.1);
        assert_eq!(slow.limit_speed(0.0, 1.0, 0.1), 0.05);
    }
}
