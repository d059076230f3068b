//! Parameters of detection and tracking.

curionav_planning::parameters! {
    /// Everything the tracker of people can be told.
    #[derive(Copy)]
    pub struct TrackerParams {
        /// Radius of the disc that stands for a person, metres: what a laser at the height of the trunk sees, and what
        /// planners keep clear of.
        pub radius: f64 [0.05, 2.0, "m", "thinner bodies are poles, wider ones are groups"] = 0.25,
        /// Radius of a leg, metres.
        pub leg_radius: f64 [0.02, 0.5, "m", "thinner ones are sticks, thicker ones are trunks"] = 0.06,
        /// Narrowest thing that may be a leg, metres.
        pub leg_width_min: f64 [0.0, 1.0, "m", "a wider one is not a leg"] = 0.05,
        /// Widest thing that may be a leg, metres; wider ones may be trunks, or two legs beside each other.
        pub leg_width_max: f64 [0.01, 1.0, "m", "a wider one is not a leg"] = 0.25,
        /// Greatest distance between the legs of one person, metres.
        pub leg_distance: f64 [0.05, 2.0, "m", "no stride is longer"] = 0.6,
        /// Standard deviation of a leg around the middle of its person on each axis, metres: half a stride at most.
        pub leg_spread: f64 [0.01, 1.0, "m", "a leg farther away is of another person"] = 0.12,
        /// Standard deviation of mapped walls around where they really are, metres.
        pub map_sigma: f64 [0.0, 1.0, "m", "a map that is worse explains nothing"] = 0.05,
        /// The map explains a beam that ends within so many standard deviations of a wall.
        pub explained_sigmas: f64 [0.0, 20.0, "standard deviations", "twenty are certainty"] = 3.0,
        /// Greatest gap between neighbouring beams' ends that belong to one thing, metres, besides what the laser's
        /// resolution leaves between them.
        pub jump: f64 [0.01, 1.0, "m", "farther apart are two people"] = 0.12,
        /// Power of the random acceleration of people who change their way, m2/s3: a velocity is off by its root after
        /// a second.
        pub acceleration: f64 [1e-6, 100.0, "m2/s3", "no person moves more wildly"] = 0.5,
        /// Power of the random acceleration of people who walk on as before, m2/s3.
        pub steady_acceleration: f64 [1e-6, 100.0, "m2/s3", "no person moves more wildly"] = 0.02,
        /// How fast the position of a person who stands spreads, as the growth of its variance on each axis, m2/s.
        pub standing_drift: f64 [1e-9, 1.0, "m2/s", "a person who drifts more does not stand"] = 0.002,
        /// How often a person goes over from one of standing, walking on and changing its way to another, 1/s.
        pub change_rate: f64 [0.0, 100.0, "1/s", "no person changes its way more often"] = 0.4,
        /// Standard deviation of the velocity of a person who has just been seen first, m/s, on each axis.
        pub velocity_sigma: f64 [0.01, 10.0, "m/s", "no person runs faster"] = 0.7,
        /// Greatest squared Mahalanobis distance of a detection from where its person was expected: 9.21 holds 99 % of
        /// them in the plane.
        pub gate: f64 [0.1, 1000.0, "", "a detection farther away is of another person"] = 9.21,
        /// A person counts once it has been seen in so many of the last `confirm_of` scans.
        pub confirm: u32 [1.0, 32.0, "scans", "the history is as long"] = 3,
        /// The scans of which `confirm` have to show a person.
        pub confirm_of: u32 [1.0, 32.0, "scans", "the history is as long"] = 5,
        /// A person who cannot be seen now, behind another person or outside of the view, is remembered until its
        /// position is known worse than this, metres: the standard deviation on an axis. One who stands is remembered
        /// for longer.
        pub forget_sigma: f64 [0.0, 10.0, "m", "beyond that the place is unknown"] = 1.0,
        /// Longest that a person is remembered who should be seen now and is not, seconds.
        pub forget_in_view: f64 [0.0, 60.0, "s", "after a minute a person may be anywhere"] = 0.5,
        /// What has not walked for so long since it was seen first is a thing, unless it is as round as a person,
        /// seconds.
        pub standing: f64 [0.1, 60.0, "s", "after a minute it is known what stands"] = 3.0,
        /// A person walks from this speed on, m/s.
        pub walking: f64 [0.05, 2.0, "m/s", "faster people run"] = 0.25,
        /// What has gone so far from where it was seen first, and walks, is a person, metres.
        pub walked: f64 [0.1, 10.0, "m", "a step is enough"] = 0.6,
        /// Two tracks nearer than this are of one person, metres.
        pub merge_distance: f64 [0.0, 1.0, "m", "people do not stand in each other"] = 0.3,
    }
}

impl TrackerParams {
    /// Of the last `confirm_of` scans, how many have to show a person: no more than there are.
    pub(crate) fn needed(&self) -> u32 {
        self.confirm.min(self.confirm_of)
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;

    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_a_wrong_field_is_named() {
        assert_eq!(TrackerParams::default().check(), Ok(()));
        let wrong = TrackerParams { forget_sigma: -1.0, ..Default::default() };
        assert_eq!(wrong.check().unwrap_err().field, "forget_sigma");
    }
}
