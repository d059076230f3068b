//! What the robot's laser sees when it is well, from the driver's configuration.

use curionav_planning::sensor::LaserModel;

curionav_planning::parameters! {
    /// What a scan of the robot's laser shows at least, and how late it says so. A scan that shows less counts as
    /// blind, and the driver stops the robot. The defaults are such as usual planar lasers meet: 3.5 m and 5 scans a
    /// second at least, and 180 degrees or more.
    #[derive(Copy)]
    pub struct ScannerLimits {
        /// Least field of view, radians. Neighbouring beams count for [`WIDEST_STEP`] of it at most.
        pub fov: f64 [
            0.1, std::f64::consts::TAU, "rad", "a robot drives with less only into what it does not see"
        ] = 2.6,
        /// Least value of the scanner's greatest range, metres.
        pub range: f64 [0.1, 200.0, "m", "the least is a robot's size, and planar lasers see no farther"] = 3.0,
        /// Least share of the beams that say anything. Beams that end on the robot itself say nothing of its way.
        pub valid_share: f64 [0.0, 1.0, "", "a share of all beams"] = 0.5,
        /// Least number of scans per second of the robot's clock. A base with fewer ticks gives as many as ticks.
        pub rate: f64 [0.0, 100.0, "Hz", "0 judges no rate; planar lasers turn at most so fast"] = 4.0,
        /// How long before its stamp a scan was taken, seconds: drivers of lasers stamp late. `curionav localize --fit`
        /// estimates it from a log. The gateway of ROS 2 corrects for it.
        pub delay_s: f64 [0.0, 1.0, "s", "a later scan shows another place"] = 0.0,
    }
}

/// Between beams farther apart than this nothing is seen, radians: people can stand unseen between them from 5 m on.
pub const WIDEST_STEP: f64 = 0.1;

/// Angle over which so many beams look that are `step` radians apart.
pub fn field_of_view(beams: usize, step: f64) -> f64 {
    (beams as f64 * step.abs().min(WIDEST_STEP)).min(std::f64::consts::TAU)
}

impl ScannerLimits {
    /// What a simulated laser shows. Its scans come with the ticks, so their rate says nothing.
    pub fn of_simulated(laser: &LaserModel) -> Self {
        let step = laser.bearing(1) - laser.bearing(0);
        let fov = field_of_view(laser.beams as usize, step) - 1e-6;
        Self { fov, range: 0.999 * laser.range_max, rate: 0.0, ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::parameters::Ranged;

    #[test]
    fn usual_lasers_meet_the_defaults() {
        let own = ScannerLimits::default();
        own.check().unwrap();
        let degree = 1.0_f64.to_radians();
        // Beams, degrees between them, metres, scans per second: TurtleBot's LDS-01, RPLIDAR A1, Hokuyo URG-04LX and
        // UTM-30LX, Sick LMS100 and S300.
        let usual = [
            (360, 1.0, 3.5, 5.0),
            (360, 1.0, 12.0, 5.5),
            (683, 0.352, 4.0, 10.0),
            (1081, 0.25, 30.0, 40.0),
            (541, 0.5, 20.0, 25.0),
            (541, 0.5, 30.0, 8.0),
        ];
        for (beams, step, range, rate) in usual {
            assert!(field_of_view(beams, step * degree) >= own.fov && range >= own.range && rate >= own.rate);
        }
    }

    #[test]
    fn beams_far_apart_do_not_see_what_lies_between() {
        // Two beams half a turn apart, and one to the rear.
        assert!(field_of_view(2, std::f64::consts::PI) < 0.3);
        assert!(field_of_view(1, 0.0) < 0.11);
        assert_eq!(field_of_view(8192, 0.1), std::f64::consts::TAU);
    }

    #[test]
    fn a_simulated_laser_shows_what_its_scenario_says() {
        let laser = LaserModel::default();
        let own = ScannerLimits::of_simulated(&laser);
        let step = laser.bearing(1) - laser.bearing(0);
        assert!(field_of_view(181, step) >= own.fov && field_of_view(150, step) < own.fov);
        assert!(laser.range_max > own.range && own.range > 4.9);
    }
}
