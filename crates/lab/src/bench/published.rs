//! What the paper prints about its planners (Tables III, IV and V), with the known errors of those tables marked.

use super::measure::Measure;

/// A printed cell: mean, and standard deviation where one is printed.
type Cell = (f64, Option<f64>);
/// The three measures of a table for one planner in one scenario.
type Trio = [Cell; 3];

const fn pm(mean: f64, sd: f64) -> Cell {
    (mean, Some(sd))
}

const fn only(mean: f64) -> Cell {
    (mean, None)
}

/// The profiles the paper's planners are here, in its order: "Our method (CPC & CNC)", "Adding CPC", "Adding CNC",
/// "Risk-RRT", "Bi-Risk-RRT". It has no planner that looks at the distance alone.
pub(crate) const PLANNERS: [&str; 5] = ["curiosity", "cpc-only", "cnc-only", "risk-rrt", "bi-risk-rrt"];

/// The scenarios in the paper's order; `env3-sx` is S*.
pub(crate) const SCENARIOS: [&str; 13] = [
    "env1-s1", "env1-s2", "env1-s3", "env2-s1", "env2-s2", "env2-s3", "env3-s1", "env3-sx", "env3-s2",
    "env3-s3", "env4-s1", "env4-s2", "env4-s3",
];

/// A mark on a printed value that cannot be right, or hardly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Slip {
    /// The length would need more than the top speed.
    TooFast,
    /// Vel is not Length / Time within 5 %.
    Inconsistent,
    /// The standard deviation is impossible.
    Spread,
    /// Equal to the cell beside it, out of line with its column.
    Copied,
}

impl Slip {
    pub(crate) const ALL: [Self; 4] = [Self::TooFast, Self::Inconsistent, Self::Spread, Self::Copied];

    pub(crate) fn mark(self) -> &'static str {
        match self {
            Self::TooFast => "a",
            Self::Inconsistent => "b",
            Self::Spread => "c",
            Self::Copied => "d",
        }
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::TooFast => {
                "35.00 m in 31.77 s is 1.10 m/s, above the robot's top speed and the printed 0.91 m/s; about 28.9 m would fit"
            }
            Self::Inconsistent => {
                "the printed Length over the printed Time differs from this by more than 5 %"
            }
            Self::Spread => "this standard deviation is impossible or a misprint",
            Self::Copied => {
                "equal to the Risk-RRT value beside it and out of line with its column: likely a slip of copying"
            }
        }
    }
}

/// A value of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Published {
    /// In the unit of `run --json`: TCM and TD as fractions.
    pub(crate) mean: f64,
    pub(crate) sd: Option<f64>,
    pub(crate) slip: Option<Slip>,
}

/// What the paper prints for `planner` in `scenario`; nothing for what it does not have.
pub(crate) fn published(measure: Measure, planner: &str, scenario: &str) -> Option<Published> {
    let column = PLANNERS.iter().position(|p| *p == planner)?;
    let row = SCENARIOS.iter().position(|s| *s == scenario)?;
    let place = Measure::PAPER.iter().position(|m| *m == measure)?;
    let table = [&LOCALISATION, &COMFORT, &EFFICIENCY][place / 3];
    let (mean, sd) = table[row][column][place % 3];
    let unit = measure.shown_per_unit();
    Some(Published { mean: mean / unit, sd: sd.map(|sd| sd / unit), slip: slip(measure, planner, scenario) })
}

/// The errors known of the tables (methods 15).
fn slip(measure: Measure, planner: &str, scenario: &str) -> Option<Slip> {
    match (measure, planner, scenario) {
        (Measure::Length, "curiosity", "env2-s2") => Some(Slip::TooFast),
        (Measure::Vel, "cnc-only", "env2-s2" | "env2-s3" | "env4-s1")
        | (Measure::Vel, "bi-risk-rrt", "env2-s2" | "env3-sx" | "env4-s1" | "env4-s2") => {
            Some(Slip::Inconsistent)
        }
        (Measure::Md, "curiosity", "env3-s2")
        | (Measure::Md, "bi-risk-rrt", "env4-s3")
        | (Measure::Rmse, "cpc-only", "env2-s3") => Some(Slip::Spread),
        (Measure::Nt, "cnc-only", "env3-s1") => Some(Slip::Copied),
        _ => None,
    }
}

/// Table III: RMSE (m), TCM (per cent), NM; rows in the order of [`SCENARIOS`], columns of [`PLANNERS`].
#[rustfmt::skip]
const LOCALISATION: [[Trio; 5]; 13] = [
    // env1-s1
    [[pm(0.34, 0.01), pm(5.82, 0.32), only(0.0)], [pm(0.34, 0.02), pm(5.26, 0.2), only(0.0)], [pm(0.46, 0.12), pm(36.74, 11.54), only(2.0)], [pm(0.5, 0.13), pm(67.04, 29.08), only(1.0)], [pm(0.38, 0.06), pm(22.16, 12.51), only(2.0)]],
    // env1-s2
    [[pm(0.33, 0.01), pm(6.38, 0.4), only(0.0)], [pm(0.33, 0.01), pm(5.67, 0.39), only(1.0)], [pm(0.38, 0.05), pm(35.48, 6.24), only(1.0)], [pm(0.34, 0.01), pm(31.21, 5.24), only(1.0)], [pm(0.36, 0.02), pm(31.8, 5.68), only(1.0)]],
    // env1-s3
    [[pm(0.33, 0.01), pm(6.34, 0.47), only(0.0)], [pm(0.33, 0.01), pm(5.51, 0.41), only(1.0)], [pm(0.37, 0.03), pm(28.21, 7.58), only(1.0)], [pm(0.34, 0.03), pm(30.87, 1.71), only(1.0)], [pm(0.37, 0.03), pm(23.38, 7.76), only(1.0)]],
    // env2-s1
    [[pm(0.15, 0.01), pm(14.01, 0.35), only(0.0)], [pm(0.18, 0.02), pm(15.37, 2.56), only(0.0)], [pm(0.15, 0.02), pm(15.3, 1.91), only(0.0)], [pm(0.18, 0.02), pm(20.52, 7.83), only(1.0)], [pm(0.18, 0.01), pm(14.72, 1.94), only(1.0)]],
    // env2-s2
    [[pm(0.15, 0.01), pm(11.89, 0.5), only(0.0)], [pm(0.16, 0.01), pm(13.05, 1.5), only(1.0)], [pm(0.18, 0.02), pm(15.96, 2.49), only(2.0)], [pm(0.26, 0.04), pm(21.96, 6.89), only(1.0)], [pm(0.21, 0.03), pm(21.66, 12.7), only(1.0)]],
    // env2-s3
    [[pm(0.14, 0.01), pm(10.37, 0.4), only(0.0)], [pm(0.15, 0.15), pm(11.3, 1.91), only(0.0)], [pm(0.18, 0.03), pm(20.41, 4.54), only(1.0)], [pm(0.2, 0.04), pm(14.57, 3.47), only(1.0)], [pm(0.2, 0.05), pm(12.86, 1.68), only(1.0)]],
    // env3-s1
    [[pm(0.2, 0.01), pm(6.51, 0.54), only(0.0)], [pm(0.2, 0.01), pm(6.25, 0.35), only(0.0)], [pm(0.23, 0.04), pm(6.57, 0.22), only(3.0)], [pm(0.24, 0.02), pm(7.16, 0.21), only(2.0)], [pm(0.27, 0.04), pm(6.79, 0.29), only(2.0)]],
    // env3-sx
    [[pm(0.22, 0.02), pm(7.13, 0.23), only(0.0)], [pm(0.23, 0.02), pm(4.96, 0.09), only(0.0)], [pm(0.25, 0.03), pm(9.01, 4.77), only(2.0)], [pm(0.59, 0.44), pm(10.13, 2.97), only(2.0)], [pm(0.37, 0.25), pm(13.13, 6.65), only(1.0)]],
    // env3-s2
    [[pm(0.2, 0.02), pm(7.1, 0.92), only(0.0)], [pm(0.21, 0.04), pm(6.46, 0.24), only(0.0)], [pm(0.24, 0.04), pm(7.74, 0.59), only(2.0)], [pm(0.44, 0.24), pm(7.1, 0.44), only(1.0)], [pm(0.3, 0.05), pm(34.1, 37.26), only(2.0)]],
    // env3-s3
    [[pm(0.21, 0.01), pm(7.14, 0.27), only(0.0)], [pm(0.21, 0.01), pm(6.86, 0.25), only(1.0)], [pm(0.31, 0.08), pm(9.6, 2.73), only(2.0)], [pm(0.33, 0.07), pm(7.22, 0.9), only(2.0)], [pm(0.32, 0.07), pm(27.69, 33.26), only(3.0)]],
    // env4-s1
    [[pm(0.29, 0.01), pm(8.61, 1.27), only(0.0)], [pm(0.3, 0.01), pm(8.77, 1.25), only(0.0)], [pm(0.32, 0.02), pm(14.99, 7.24), only(0.0)], [pm(0.37, 0.03), pm(25.78, 15.43), only(0.0)], [pm(0.4, 0.06), pm(42.21, 3.94), only(0.0)]],
    // env4-s2
    [[pm(0.29, 0.01), pm(6.63, 0.18), only(0.0)], [pm(0.29, 0.01), pm(6.86, 0.4), only(0.0)], [pm(0.39, 0.06), pm(44.67, 8.72), only(1.0)], [pm(0.48, 0.06), pm(51.25, 8.95), only(1.0)], [pm(0.4, 0.02), pm(41.89, 3.63), only(0.0)]],
    // env4-s3
    [[pm(0.31, 0.02), pm(7.1, 0.34), only(0.0)], [pm(0.32, 0.02), pm(6.44, 0.36), only(0.0)], [pm(0.33, 0.03), pm(8.2, 1.77), only(1.0)], [pm(0.56, 0.05), pm(69.89, 2.26), only(0.0)], [pm(0.57, 0.14), pm(69.86, 10.23), only(0.0)]],
];

/// Table IV: TD (per cent), MD (m), NT.
#[rustfmt::skip]
const COMFORT: [[Trio; 5]; 13] = [
    // env1-s1
    [[only(0.0), pm(1.89, 0.26), only(0.0)], [pm(2.28, 2.25), pm(1.4, 0.22), only(1.0)], [pm(6.78, 8.64), pm(1.32, 0.26), only(2.0)], [pm(12.46, 8.64), pm(0.95, 0.49), only(5.0)], [pm(18.56, 11.14), pm(0.76, 0.22), only(8.0)]],
    // env1-s2
    [[pm(1.57, 1.55), pm(1.51, 0.25), only(1.0)], [pm(3.42, 3.12), pm(1.37, 0.4), only(1.0)], [pm(8.17, 3.02), pm(1.07, 0.22), only(2.0)], [pm(18.05, 8.6), pm(0.85, 0.06), only(4.0)], [pm(17.3, 5.19), pm(0.86, 0.19), only(3.0)]],
    // env1-s3
    [[pm(1.72, 1.86), pm(1.51, 0.27), only(1.0)], [pm(3.57, 3.72), pm(1.3, 0.33), only(1.0)], [pm(7.41, 4.83), pm(1.0, 0.19), only(2.0)], [pm(11.74, 4.37), pm(0.91, 0.21), only(4.0)], [pm(20.52, 8.33), pm(0.83, 0.03), only(3.0)]],
    // env2-s1
    [[only(0.0), pm(1.7, 0.04), only(0.0)], [pm(23.93, 18.67), pm(0.92, 0.25), only(4.0)], [pm(6.5, 2.5), pm(0.94, 0.12), only(2.0)], [pm(28.06, 9.02), pm(0.73, 0.27), only(10.0)], [pm(26.49, 6.4), pm(0.83, 0.13), only(5.0)]],
    // env2-s2
    [[pm(0.93, 0.91), pm(1.57, 0.2), only(1.0)], [pm(9.32, 8.23), pm(1.07, 0.37), only(4.0)], [pm(11.69, 2.65), pm(0.97, 0.16), only(3.0)], [pm(18.32, 14.49), pm(0.95, 0.12), only(5.0)], [pm(20.09, 5.82), pm(0.95, 0.21), only(4.0)]],
    // env2-s3
    [[pm(4.04, 1.2), pm(1.16, 0.19), only(1.0)], [pm(5.1, 2.31), pm(1.11, 0.25), only(2.0)], [pm(25.15, 12.67), pm(0.95, 0.11), only(4.0)], [pm(40.6, 25.43), pm(0.82, 0.1), only(6.0)], [pm(25.9, 5.34), pm(0.93, 0.17), only(5.0)]],
    // env3-s1
    [[pm(0.11, 0.24), pm(2.1, 0.47), only(0.0)], [pm(5.72, 1.67), pm(1.19, 0.19), only(2.0)], [pm(9.16, 6.53), pm(0.95, 0.1), only(16.0)], [pm(26.54, 9.62), pm(0.64, 0.33), only(16.0)], [pm(31.52, 21.54), pm(0.96, 0.12), only(3.0)]],
    // env3-sx
    [[only(0.0), pm(2.39, 0.48), only(0.0)], [pm(8.54, 5.76), pm(0.94, 0.22), only(2.0)], [pm(12.92, 10.57), pm(0.49, 0.34), only(3.0)], [pm(20.85, 15.7), pm(0.76, 0.26), only(3.0)], [pm(18.13, 12.76), pm(0.85, 0.26), only(4.0)]],
    // env3-s2
    [[pm(1.68, 1.86), pm(1.48, 1.86), only(1.0)], [pm(4.8, 4.63), pm(1.32, 0.63), only(1.0)], [pm(4.31, 1.7), pm(1.04, 0.17), only(2.0)], [pm(22.84, 10.14), pm(0.67, 0.39), only(4.0)], [pm(28.36, 16.89), pm(0.87, 0.12), only(5.0)]],
    // env3-s3
    [[pm(1.22, 2.19), pm(1.64, 0.37), only(1.0)], [pm(6.18, 4.66), pm(1.1, 0.3), only(2.0)], [pm(16.84, 3.19), pm(0.91, 0.22), only(5.0)], [pm(45.91, 14.67), pm(0.78, 0.1), only(7.0)], [pm(36.39, 12.63), pm(0.89, 0.19), only(7.0)]],
    // env4-s1
    [[only(0.0), pm(1.75, 0.23), only(0.0)], [pm(9.63, 3.36), pm(1.13, 0.17), only(3.0)], [pm(5.89, 6.54), pm(1.2, 0.17), only(2.0)], [pm(14.24, 2.92), pm(1.03, 0.19), only(4.0)], [pm(16.98, 8.34), pm(0.96, 0.12), only(4.0)]],
    // env4-s2
    [[pm(1.5, 1.72), pm(1.47, 0.06), only(1.0)], [pm(16.77, 6.15), pm(0.97, 0.33), only(4.0)], [pm(15.88, 8.16), pm(0.96, 0.1), only(4.0)], [pm(19.95, 2.82), pm(0.77, 0.27), only(6.0)], [pm(18.32, 1.92), pm(0.93, 0.17), only(5.0)]],
    // env4-s3
    [[pm(1.97, 1.82), pm(1.5, 0.21), only(1.0)], [pm(16.84, 1.66), pm(0.96, 0.09), only(4.0)], [pm(17.56, 6.55), pm(1.11, 0.24), only(3.0)], [pm(26.23, 4.87), pm(1.0, 0.18), only(7.0)], [pm(22.78, 11.99), pm(0.8, 6.54), only(4.0)]],
];

/// Table V: Vel (m/s), Length (m), Time (s).
#[rustfmt::skip]
const EFFICIENCY: [[Trio; 5]; 13] = [
    // env1-s1
    [[pm(0.91, 0.01), pm(39.62, 0.3), pm(43.78, 0.68)], [pm(0.85, 0.03), pm(40.76, 0.56), pm(47.99, 1.4)], [pm(0.86, 0.02), pm(38.25, 1.0), pm(44.43, 1.38)], [pm(0.88, 0.05), pm(37.14, 1.51), pm(42.17, 2.99)], [pm(0.86, 0.04), pm(35.38, 0.81), pm(40.97, 1.26)]],
    // env1-s2
    [[pm(0.92, 0.04), pm(40.05, 1.33), pm(43.33, 1.41)], [pm(0.84, 0.05), pm(40.31, 1.12), pm(47.81, 3.8)], [pm(0.82, 0.04), pm(35.85, 1.38), pm(43.72, 2.83)], [pm(0.8, 0.04), pm(37.46, 1.63), pm(46.32, 2.26)], [pm(0.85, 0.02), pm(35.23, 1.3), pm(41.25, 2.15)]],
    // env1-s3
    [[pm(0.91, 0.01), pm(40.16, 0.4), pm(43.9, 0.02)], [pm(0.83, 0.02), pm(41.07, 1.03), pm(49.91, 1.74)], [pm(0.86, 0.03), pm(37.58, 3.37), pm(44.72, 6.65)], [pm(0.86, 0.05), pm(36.51, 1.04), pm(42.15, 2.94)], [pm(0.86, 0.03), pm(34.52, 0.64), pm(40.75, 1.88)]],
    // env2-s1
    [[pm(0.88, 0.01), pm(30.97, 0.69), pm(35.07, 0.53)], [pm(0.86, 0.04), pm(28.67, 0.91), pm(33.33, 2.44)], [pm(0.84, 0.06), pm(32.07, 1.01), pm(36.62, 2.35)], [pm(0.86, 0.09), pm(27.97, 1.06), pm(33.02, 4.07)], [pm(0.85, 0.05), pm(28.03, 1.95), pm(31.85, 2.41)]],
    // env2-s2
    [[pm(0.91, 0.02), pm(35.0, 0.96), pm(31.77, 0.14)], [pm(0.83, 0.02), pm(31.18, 1.79), pm(37.61, 3.19)], [pm(0.88, 0.03), pm(29.75, 1.97), pm(35.97, 3.73)], [pm(0.89, 0.01), pm(28.86, 0.84), pm(33.7, 2.96)], [pm(0.87, 0.04), pm(27.61, 0.65), pm(30.21, 0.82)]],
    // env2-s3
    [[pm(0.89, 0.02), pm(31.4, 0.77), pm(35.31, 0.89)], [pm(0.86, 0.11), pm(31.56, 1.58), pm(37.52, 7.47)], [pm(0.83, 0.1), pm(27.59, 1.36), pm(31.23, 3.56)], [pm(0.88, 0.03), pm(27.3, 0.23), pm(30.62, 0.42)], [pm(0.89, 0.03), pm(29.75, 3.31), pm(33.52, 4.18)]],
    // env3-s1
    [[pm(0.93, 0.01), pm(39.45, 0.39), pm(42.59, 0.43)], [pm(0.9, 0.02), pm(40.55, 0.97), pm(45.08, 1.95)], [pm(0.89, 0.05), pm(38.02, 0.84), pm(42.17, 1.28)], [pm(0.91, 0.02), pm(36.56, 0.28), pm(40.34, 0.74)], [pm(0.91, 0.01), pm(36.1, 0.41), pm(39.64, 1.25)]],
    // env3-sx
    [[pm(0.88, 0.02), pm(39.59, 0.48), pm(45.29, 1.57)], [pm(0.81, 0.07), pm(45.52, 4.48), pm(56.23, 3.72)], [pm(0.9, 0.03), pm(50.92, 5.01), pm(55.63, 3.43)], [pm(0.86, 0.04), pm(44.17, 2.9), pm(51.51, 3.4)], [pm(0.89, 0.03), pm(44.88, 2.82), pm(54.86, 2.59)]],
    // env3-s2
    [[pm(0.93, 0.01), pm(39.88, 0.77), pm(42.57, 0.52)], [pm(0.91, 0.02), pm(40.45, 0.31), pm(44.29, 1.24)], [pm(0.88, 0.02), pm(39.0, 1.0), pm(43.03, 1.75)], [pm(0.85, 0.02), pm(38.59, 2.0), pm(45.4, 2.88)], [pm(0.89, 0.03), pm(37.93, 1.6), pm(42.65, 1.56)]],
    // env3-s3
    [[pm(0.92, 0.02), pm(40.97, 1.39), pm(44.72, 2.27)], [pm(0.91, 0.02), pm(39.9, 0.4), pm(43.99, 1.32)], [pm(0.83, 0.06), pm(40.35, 2.2), pm(48.49, 3.71)], [pm(0.84, 0.05), pm(38.28, 2.79), pm(45.86, 5.13)], [pm(0.88, 0.05), pm(38.11, 2.24), pm(45.15, 0.84)]],
    // env4-s1
    [[pm(0.87, 0.02), pm(42.37, 0.26), pm(48.87, 1.29)], [pm(0.88, 0.02), pm(40.13, 2.94), pm(45.86, 4.07)], [pm(0.9, 0.03), pm(42.62, 0.71), pm(52.24, 1.94)], [pm(0.84, 0.05), pm(41.37, 2.66), pm(49.43, 5.59)], [pm(0.84, 0.07), pm(41.96, 3.76), pm(47.15, 3.7)]],
    // env4-s2
    [[pm(0.89, 0.01), pm(43.27, 0.87), pm(48.47, 0.52)], [pm(0.85, 0.02), pm(46.27, 4.01), pm(54.24, 4.41)], [pm(0.86, 0.02), pm(44.43, 4.29), pm(53.51, 7.01)], [pm(0.85, 0.09), pm(44.85, 4.64), pm(53.16, 6.91)], [pm(0.87, 0.05), pm(40.93, 2.61), pm(50.99, 4.92)]],
    // env4-s3
    [[pm(0.9, 0.01), pm(41.83, 0.78), pm(46.53, 0.74)], [pm(0.85, 0.02), pm(43.03, 1.22), pm(50.46, 2.6)], [pm(0.86, 0.04), pm(42.61, 1.86), pm(49.52, 3.24)], [pm(0.86, 0.03), pm(41.46, 2.85), pm(48.46, 4.73)], [pm(0.81, 0.05), pm(40.18, 0.73), pm(50.0, 0.05)]],
];

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(measure: Measure, planner: &str, scenario: &str) -> f64 {
        published(measure, planner, scenario).unwrap().mean
    }

    #[test]
    fn cells_are_where_the_paper_has_them_and_per_cents_are_fractions() {
        let td = published(Measure::Td, "curiosity", "env2-s3").unwrap();
        assert!((td.mean - 0.0404).abs() < 1e-12 && (td.sd.unwrap() - 0.012).abs() < 1e-12);
        assert_eq!(mean(Measure::Nt, "risk-rrt", "env2-s1"), 10.0);
        assert_eq!(mean(Measure::Length, "bi-risk-rrt", "env4-s2"), 40.93);
        assert_eq!(published(Measure::Td, "distance-only", "env4-s2"), None);
        assert_eq!(published(Measure::Clearance, "curiosity", "env4-s2"), None);
    }

    #[test]
    fn the_shortest_lengths_are_those_the_scenes_are_built_for() {
        for p in &crate::paper::PUBLISHED {
            let name = format!("env{}-{}", p.environment, p.scenario);
            let least = PLANNERS.iter().map(|planner| mean(Measure::Length, planner, &name));
            assert_eq!(least.fold(f64::INFINITY, f64::min), p.shortest_m, "{name}");
        }
    }

    #[test]
    fn exactly_the_marked_speeds_disagree_with_length_and_time() {
        let mut disagree = Vec::new();
        for planner in PLANNERS {
            for scenario in SCENARIOS {
                let [vel, length, time] =
                    [Measure::Vel, Measure::Length, Measure::Time].map(|m| mean(m, planner, scenario));
                let marked =
                    [Measure::Vel, Measure::Length].iter().any(|m| slip(*m, planner, scenario).is_some());
                if (length / time / vel - 1.0).abs() > 0.05 {
                    disagree.push((planner, scenario));
                    assert!(marked, "{planner} {scenario}: {} of {vel}", length / time);
                } else {
                    assert!(!marked, "{planner} {scenario}");
                }
            }
        }
        assert_eq!(disagree.len(), 8);
    }
}
