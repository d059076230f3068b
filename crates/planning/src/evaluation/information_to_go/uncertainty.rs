//! What the field distinguishes of how uncertain a pose is, and how a stretch of way changes it.

use std::f64::consts::FRAC_PI_2;

use crate::motion::OdometryNoise;
use crate::numerics::exp;

/// Levels of the position's variance (the trace of x and y), m2. The first is that of a robot among landmarks.
const POSITION: [f64; 11] = [0.01, 0.03, 0.06, 0.1, 0.16, 0.25, 0.4, 0.7, 1.2, 2.5, 5.0];
/// Levels of the heading's variance, as multiples of the first.
const HEADING: [f64; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// Pairs of one level each.
pub(super) const STATES: usize = POSITION.len() * HEADING.len();

/// Variances of position, m2, and of heading, rad2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Variances {
    pub(super) position: f64,
    pub(super) heading: f64,
}

/// What one scan tells, as a mean over headings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sight {
    /// Too little.
    Nothing,
    /// Heading, and position across a wall but not along it.
    Wall,
    /// Heading and position.
    Position,
}

impl Sight {
    /// In the order of their numbers.
    pub(super) const ALL: [Self; 3] = [Self::Nothing, Self::Wall, Self::Position];
}

/// The states around some variances, with weights that sum to 1: their weighted variances are those.
pub(super) type Mix = [(usize, f32); 4];

/// The levels, for an odometry and a laser.
#[derive(Debug, Clone)]
pub(super) struct Levels {
    noise: OdometryNoise,
    /// Metres on which the surplus of the position's variance falls to 1/e among landmarks.
    recovery: f64,
    headings: [f64; HEADING.len()],
}

impl Levels {
    /// Where something is seen, the heading is known with a standard deviation of `heading_sigma`. From there a robot
    /// turns to where it sees nothing: a quarter turn belongs to the first level.
    pub(super) fn new(noise: &OdometryNoise, heading_sigma: f64, recovery: f64) -> Self {
        let known = heading_sigma * heading_sigma + noise.heading_per_radian * FRAC_PI_2;
        Self { noise: *noise, recovery, headings: HEADING.map(|level| level * known) }
    }

    pub(super) fn of(&self, state: usize) -> Variances {
        let position = state / HEADING.len();
        let heading = state % HEADING.len();
        Variances { position: POSITION[position], heading: self.headings[heading] }
    }

    /// Beyond the last level, and for what is not a number, the nearest state.
    pub(super) fn around(&self, Variances { position, heading }: Variances) -> Mix {
        let (i, a) = between(&POSITION, position);
        let (j, b) = between(&self.headings, heading);
        let at = |i: usize, j: usize| i.min(POSITION.len() - 1) * HEADING.len() + j.min(HEADING.len() - 1);
        [
            (at(i, j), ((1.0 - a) * (1.0 - b)) as f32),
            (at(i + 1, j), (a * (1.0 - b)) as f32),
            (at(i, j + 1), ((1.0 - a) * b) as f32),
            (at(i + 1, j + 1), (a * b) as f32),
        ]
    }

    /// After so many metres, at a place where a scan tells `sight`.
    ///
    /// Blind, an error of heading displaces everything that is driven after it, so that the two are correlated
    /// (`shared`): as much as on a way on which the heading's error has grown from the first level, and no more than
    /// all of it. Where a scan tells the heading again, it also tells that part of the position.
    pub(super) fn after(&self, before: Variances, sight: Sight, metres: f64) -> Variances {
        let Variances { position, heading } = before;
        let known = self.headings[0];
        let per_metre = self.noise.heading_per_metre;
        let blind = if per_metre > 0.0 { ((heading - known) / per_metre).max(0.0) } else { 0.0 };
        let shared = (known * blind + 0.5 * per_metre * blind * blind).min((heading * position).sqrt());
        let drift = self.noise.position_per_metre * metres;
        match sight {
            Sight::Nothing => Variances {
                position: position + 2.0 * drift + 2.0 * shared * metres + heading * metres * metres,
                heading: heading + per_metre * metres,
            },
            Sight::Wall => Variances {
                position: (position - shared * shared / heading).max(POSITION[0]) + drift,
                heading: known,
            },
            Sight::Position => Variances {
                position: POSITION[0] + (position - POSITION[0]) * exp(-metres / self.recovery),
                heading: known,
            },
        }
    }
}

/// Raises the cost of each state to that of the states of its position whose heading is known better: to know it less
/// never helps.
pub(super) fn rise_with_heading(costs: &mut [f32; STATES]) {
    for of_position in costs.chunks_exact_mut(HEADING.len()) {
        for k in 1..of_position.len() {
            of_position[k] = of_position[k].max(of_position[k - 1]);
        }
    }
}

/// The level at or below x, and which share of the way to the next x has come.
fn between(levels: &[f64], x: f64) -> (usize, f64) {
    let above = levels.partition_point(|level| *level <= x);
    match (above.checked_sub(1), levels.get(above)) {
        (None, _) => (0, 0.0),
        (Some(below), None) => (below, 0.0),
        (Some(below), Some(next)) => (below, (x - levels[below]) / (next - levels[below])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels() -> Levels {
        Levels::new(&OdometryNoise::default(), 0.05, 0.5)
    }

    #[test]
    fn a_mix_has_the_variances_it_was_asked_for() {
        let levels = levels();
        for (position, heading) in [(0.02, 0.02), (0.3, 0.1), (4.9, 0.05), (0.01, 0.03)] {
            let mix = levels.around(Variances { position, heading });
            let mean = |of: fn(Variances) -> f64| -> f64 {
                mix.iter().map(|(state, weight)| f64::from(*weight) * of(levels.of(*state))).sum()
            };
            assert!((mean(|v| v.position) - position).abs() < 1e-6);
            assert!((mean(|v| v.heading) - heading).abs() < 1e-6);
        }
        for broken in [f64::NAN, -1.0, f64::INFINITY] {
            let mix = levels.around(Variances { position: broken, heading: broken });
            let sum: f32 = mix.iter().map(|(_, weight)| weight).sum();
            assert!(sum == 1.0 && mix.iter().all(|(state, _)| *state < STATES), "{broken}: {mix:?}");
        }
    }

    #[test]
    fn a_blind_way_in_steps_ends_where_the_exact_one_does() {
        // From a known heading, a straight way of u metres: the position's variance grows by 2 p u, by the first
        // heading's h u^2, and by the heading's random walk q u^3 / 3.
        let levels = levels();
        let noise = OdometryNoise::default();
        let start = Variances { position: 0.06, heading: levels.of(0).heading };
        let u = 6.0;
        let steps = 60;
        let end = (0..steps).fold(start, |v, _| levels.after(v, Sight::Nothing, u / f64::from(steps)));
        let exact = start.position
            + 2.0 * noise.position_per_metre * u
            + start.heading * u * u
            + noise.heading_per_metre * u * u * u / 3.0;
        assert!((end.position - exact).abs() < 0.05 * exact, "{} instead of {exact}", end.position);
        assert!((end.heading - start.heading - noise.heading_per_metre * u).abs() < 1e-9);
        // A wall tells the heading, and with it a part of the position but not all of it; landmarks tell all.
        let wall = levels.after(end, Sight::Wall, 0.4);
        assert!(wall.heading == start.heading && wall.position < 0.8 * end.position, "{wall:?}");
        assert!(wall.position > start.position, "{wall:?}");
        let found = (0..10).fold(wall, |v, _| levels.after(v, Sight::Position, 0.4));
        assert!(found.position < 0.011, "{found:?}");
    }
}
