//! The planar laser as the planner and the localiser model it.

use serde::{Deserialize, Deserializer};

use crate::parameters::FieldError;

use crate::geometry::{Point2, Pose2, wrap_angle};

crate::parameters! {
    /// A planar scanner: equally spaced beams, counter-clockwise, the first at `-fov/2`.
    /// Default: the paper's Sick laser as its map scale implies (180 degrees, 181 beams).
    #[derive(Copy)]
    pub struct LaserModel {
        /// Where the scanner sits on the robot.
        pub robot_from_laser: Pose2 [table] = Pose2::new(0.0, 0.0, 0.0),
        /// Field of view, radians; 2 pi means all around, the last beam next to the first.
        #[serde(deserialize_with = "full_turn")]
        pub fov: f64 [
            0.01, std::f64::consts::TAU, "rad", "a full turn is all there is, and one direction is no scan"
        ] = std::f64::consts::PI,
        /// Number of beams, at least 2.
        pub beams: u32
            [2.0, 8192.0, "beams", "the densest lidars have some 4000, and a scan of one beam has no spacing"] = 181,
        /// Greatest range, metres; a beam that meets nothing reports this value.
        pub range_max: f64 [
            0.1, 200.0, "m", "the robot is as large as the least, and planar lasers see no farther than the greatest"
        ] = 5.0,
        /// Standard deviation of one range, metres.
        pub range_sigma: f64 [0.0, 1.0, "m", "a worse laser sees nothing"] = 0.03,
    } check Self::sits_on_the_robot
}

/// A full turn, whether it is written 6.2832 or with more digits.
fn full_turn<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
    #[expect(clippy::approx_constant, reason = "the end of a range as it is written, to four digits")]
    const WRITTEN: f64 = 6.2832;
    f64::deserialize(d).map(|fov| if fov == WRITTEN { std::f64::consts::TAU } else { fov })
}

impl LaserModel {
    /// Farthest from the robot's centre that a scanner may sit, metres: outside of any robot.
    const MOST_OFFSET: f64 = 10.0;

    fn sits_on_the_robot(&self) -> Result<(), FieldError> {
        let offset = self.robot_from_laser.position().distance(Point2::default());
        if offset <= Self::MOST_OFFSET {
            return Ok(());
        }
        let problem = format!("puts the laser {offset} m from the robot's centre");
        Err(FieldError::new("robot_from_laser", problem, format!("keep it within {} m", Self::MOST_OFFSET)))
    }

    /// Bearing of beam `i` in the laser frame, radians.
    pub fn bearing(&self, i: u32) -> f64 {
        -0.5 * self.fov + self.fov * f64::from(i) / f64::from(self.gaps())
    }

    /// Whether the last beam has the first for a neighbour.
    pub fn sees_all_around(&self) -> bool {
        self.fov >= std::f64::consts::TAU - 1e-9
    }

    /// Whether it looks at all that a robot may meet which drives backwards: an eighth of a turn to either side of
    /// straight back.
    pub fn sees_behind(&self) -> bool {
        let off = wrap_angle(std::f64::consts::PI - self.robot_from_laser.heading).abs();
        self.sees_all_around() || off + std::f64::consts::FRAC_PI_4 <= 0.5 * self.fov
    }

    /// How many gaps there are between neighbouring beams.
    fn gaps(&self) -> u32 {
        if self.sees_all_around() { self.beams } else { self.beams.saturating_sub(1).max(1) }
    }

    /// The same laser with a view all around, its beams as far apart.
    #[must_use]
    pub fn all_round(&self) -> Self {
        let beams = f64::from(self.gaps()) * std::f64::consts::TAU / self.fov;
        Self { fov: std::f64::consts::TAU, beams: beams.round() as u32, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::read;

    #[test]
    fn a_full_turn_is_taken_as_messages_write_it() {
        for text in ["6.2832", "6.283185307179586"] {
            let laser: LaserModel = read(&format!("fov = {text}\nbeams = 360\n")).unwrap();
            assert_eq!((laser.fov, laser.sees_all_around()), (std::f64::consts::TAU, true), "{text}");
        }
        let error = read::<LaserModel>("fov = 6.2833\n").unwrap_err().to_string();
        assert!(error.contains("fov: is 6.2833; give 0.01 to 6.2832 rad"), "{error}");
    }

    #[test]
    fn a_laser_that_sees_all_around_has_its_beams_as_far_apart() {
        let half = LaserModel::default();
        let around = half.all_round();
        assert_eq!((half.beams, around.beams, around.fov), (181, 360, std::f64::consts::TAU));
        let spacing = |laser: &LaserModel| laser.bearing(1) - laser.bearing(0);
        assert!((spacing(&half) - spacing(&around)).abs() < 1e-12);
        assert_eq!(around.all_round(), around);
    }

    #[test]
    fn a_laser_sees_behind_if_it_looks_there() {
        let half = LaserModel::default();
        let to_the_rear = LaserModel { robot_from_laser: Pose2::new(-0.2, 0.0, 3.1), ..half };
        let wide = LaserModel { fov: 1.5 * std::f64::consts::PI, ..half };
        assert!(half.all_round().sees_behind() && to_the_rear.sees_behind());
        assert!(!half.sees_behind() && !wide.sees_behind());
    }
}
