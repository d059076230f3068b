//! What one beam of a laser says. This is the one place where a range gets a meaning: driver, localiser, tracker,
//! gateway, recordings and logs all ask here.

/// What a range says about the way along its beam.
///
/// As REP 117 of ROS has it, but for two things. A range of 0 says nothing, because scanners give it for a beam
/// that has failed. A range below the least says that something is there, because people step up to robots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beam {
    /// Nothing: the range is no number, or 0.
    Silent,
    /// Something is so far away, metres; more than 0.
    Obstacle(f64),
    /// Nothing is nearer than the scanner's greatest range, metres.
    Free(f64),
}

impl Beam {
    /// Distance of something nearer than a least range of 0, metres: a range of 0 itself would say nothing.
    const NEAREST: f64 = 1e-3;
    /// What a greatest range loses when it is sent as a decimal, metres.
    const ROUNDING: f64 = 1e-6;

    /// What `range` says, metres, of a scanner that measures from `range_min` to `range_max` metres.
    #[inline]
    pub fn of(range: f32, range_min: f64, range_max: f64) -> Self {
        let metres = f64::from(range);
        if metres.is_nan() || metres == 0.0 {
            Self::Silent
        } else if metres >= range_max - Self::ROUNDING || range >= range_max as f32 {
            Self::Free(range_max)
        } else {
            Self::Obstacle(metres.max(range_min).max(Self::NEAREST))
        }
    }

    /// The range that says the same to every reader, whatever least range it assumes, metres.
    #[inline]
    pub fn range(self) -> f32 {
        match self {
            Self::Silent => f32::NAN,
            Self::Obstacle(metres) | Self::Free(metres) => metres as f32,
        }
    }

    /// Whether it says anything.
    #[inline]
    pub fn speaks(self) -> bool {
        self != Self::Silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_has_one_meaning() {
        let said = |range: f32| Beam::of(range, 0.1, 10.0);
        for range in [f32::NAN, -f32::NAN, 0.0, -0.0] {
            assert_eq!(said(range), Beam::Silent, "{range}");
        }
        for range in [f32::NEG_INFINITY, -1.0, 1e-30, 0.05, 0.0999] {
            assert_eq!(said(range), Beam::Obstacle(0.1), "{range}");
        }
        for range in [10.0, 10.5, f32::MAX, f32::INFINITY] {
            assert_eq!(said(range), Beam::Free(10.0), "{range}");
        }
        assert_eq!(said(3.5), Beam::Obstacle(3.5));
        // Without a least range something that is nearer still is not nothing.
        assert_eq!(Beam::of(f32::NEG_INFINITY, 0.0, 10.0), Beam::Obstacle(Beam::NEAREST));
    }

    #[test]
    fn the_greatest_range_in_single_precision_is_free() {
        // 60.1 in single precision is 1.5e-6 less, 199.9 is 6.1e-6 less.
        for range_max in [0.3, 5.6, 30.1, 60.1, 199.9] {
            assert_eq!(Beam::of(range_max as f32, 0.0, range_max), Beam::Free(range_max));
        }
    }

    #[test]
    fn the_range_of_a_beam_says_the_same_again() {
        for range in [f32::NAN, 0.0, f32::NEG_INFINITY, 0.05, 0.1, 3.5, 10.0, f32::INFINITY] {
            let beam = Beam::of(range, 0.1, 10.0);
            let again = Beam::of(beam.range(), 0.0, 10.0);
            match (beam, again) {
                (Beam::Obstacle(a), Beam::Obstacle(b)) => assert!((a - b).abs() < 1e-6, "{range}"),
                _ => assert_eq!(beam, again, "{range}"),
            }
        }
    }
}
