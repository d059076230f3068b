//! How far from where they were expected 90 of 100 filmed people were, by their speed and by the time that had passed.
//!
//! The split conformal prediction of constant velocity (Lindemann and others, 2023): a radius is the 90 % quantile of
//! the errors of a class of speed after a time. Velocities are those of the last 0.4 s. The films are `seq_eth` and
//! `seq_hotel` of the dataset `peds_eth`, 13,975 predictions; `python/benchmarks/forecast_regions.py` prints the table.

/// Share of people who are within a radius.
pub const REGION: f64 = 0.9;

/// Times of the radii, seconds.
pub const HORIZONS: [f64; 6] = [0.4, 0.8, 1.6, 2.4, 3.2, 4.0];

/// Where the next class of speed begins, m/s.
const SPEEDS: [f64; 3] = [0.3, 0.8, 1.3];

/// Radii, metres, `[class of speed, horizon]`.
const RADII: [[f64; HORIZONS.len()]; SPEEDS.len() + 1] = [
    [0.09, 0.19, 0.36, 0.52, 0.68, 0.85],
    [0.21, 0.42, 0.86, 1.39, 1.83, 2.33],
    [0.19, 0.37, 0.72, 1.15, 1.58, 2.04],
    [0.17, 0.30, 0.61, 0.98, 1.38, 1.81],
];

/// Radius around the expected position in which a person is after `t` seconds with probability [`REGION`] who walks at
/// `speed` m/s now, metres. It is 0 now, and grows on beyond the last horizon as it did before.
pub fn region_radius(speed: f64, t: f64) -> f64 {
    let class = SPEEDS.iter().filter(|&&from| speed >= from).count();
    let radii = &RADII[class];
    let next = HORIZONS.iter().position(|&horizon| t <= horizon).unwrap_or(HORIZONS.len() - 1);
    let (from, at) = match next.checked_sub(1) {
        Some(before) => (HORIZONS[before], radii[before]),
        None => (0.0, 0.0),
    };
    let slope = (radii[next] - at) / (HORIZONS[next] - from);
    at + slope * (t.max(0.0) - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_radius_is_that_of_the_table_and_grows_with_time_in_every_class() {
        for speed in [0.0, 0.3, 0.79, 1.0, 1.3, 2.0] {
            let radii: Vec<f64> = (0..=60).map(|k| region_radius(speed, 0.1 * f64::from(k))).collect();
            assert_eq!(radii[0], 0.0);
            assert!(radii.windows(2).all(|pair| pair[1] > pair[0]), "at {speed} m/s: {radii:?}");
        }
        assert!((region_radius(1.0, 1.6) - 0.72).abs() < 1e-12);
        assert!((region_radius(1.0, 2.0) - 0.935).abs() < 1e-12, "half way to 1.15");
        assert!((region_radius(0.0, 4.8) - 1.02).abs() < 1e-12, "0.17 m more, as from 3.2 to 4.0 s");
    }
}
