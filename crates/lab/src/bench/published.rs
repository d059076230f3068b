//! What the paper prints about its planners (Tables III to VI), with the known errors of those tables marked.

use super::measure::Measure;

/// A line for each scenario and planner, with a cell for each of [`Measure::PAPER`]: the printed mean, the standard
/// deviation where one is printed, and the mark of a slip. The planners are the profiles that the paper's are here:
/// "Our method (CPC & CNC)", "Adding CPC", "Adding CNC", "Risk-RRT", "Bi-Risk-RRT"; and of Table VI, which has RMSE, TD and
/// Vel of four scenarios, its references 15, 6 and 8. TD's deviations there are left out: they are per cent or shares, which it does
/// not say. It has no planner that looks at the distance alone.
const TABLES: &str = include_str!("published.csv");

/// Marks on printed values that cannot be right, or hardly (methods 15), and why.
pub(crate) const SLIPS: [(char, &str); 4] = [
    (
        'a',
        "35.00 m in 31.77 s is 1.10 m/s, above the robot's top speed and the printed 0.91 m/s; about 28.9 m would fit",
    ),
    ('b', "the printed Length over the printed Time differs from this by more than 5 %"),
    ('c', "this standard deviation is impossible or a misprint"),
    ('d', "equal to the Risk-RRT value beside it and out of line with its column: likely a slip of copying"),
];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Published {
    /// In the unit of `run --json`: TCM and TD as fractions.
    pub(crate) mean: f64,
    pub(crate) sd: Option<f64>,
    /// One of [`SLIPS`].
    pub(crate) slip: Option<char>,
}

/// What the paper prints for `planner` in `scenario`; nothing for what it does not have.
pub(crate) fn published(measure: Measure, planner: &str, scenario: &str) -> Option<Published> {
    let column = Measure::PAPER.iter().position(|m| *m == measure)?;
    let start = format!("{scenario},{planner},");
    let cell = TABLES.lines().find_map(|line| line.strip_prefix(&start))?.split(',').nth(column)?;
    let slip = cell.chars().last().filter(char::is_ascii_lowercase);
    let mut numbers = cell.trim_end_matches(|c: char| Some(c) == slip).split('\u{b1}').map(str::parse::<f64>);
    let mean = numbers.next()?.ok()?;
    let unit = measure.shown_per_unit();
    Some(Published { mean: mean / unit, sd: numbers.next().and_then(Result::ok).map(|sd| sd / unit), slip })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::PUBLISHED;

    const PLANNERS: [&str; 5] = ["curiosity", "cpc-only", "cnc-only", "risk-rrt", "bi-risk-rrt"];

    fn mean(measure: Measure, planner: &str, scenario: &str) -> f64 {
        published(measure, planner, scenario).unwrap().mean
    }

    #[test]
    fn cells_are_where_the_paper_has_them_and_per_cents_are_fractions() {
        let td = published(Measure::Td, "curiosity", "env2-s3").unwrap();
        assert!((td.mean - 0.0404).abs() < 1e-12 && (td.sd.unwrap() - 0.012).abs() < 1e-12);
        assert_eq!(mean(Measure::Nt, "risk-rrt", "env2-s1"), 10.0);
        assert_eq!(mean(Measure::Length, "bi-risk-rrt", "env4-s2"), 40.93);
        assert_eq!(mean(Measure::Vel, "transient-goal", "env4-s3"), 0.69);
        assert_eq!(published(Measure::Time, "human-space", "env4-s3"), None);
        assert_eq!(published(Measure::Td, "distance-only", "env4-s2"), None);
        assert_eq!(published(Measure::Clearance, "curiosity", "env4-s2"), None);
    }

    #[test]
    fn the_shortest_lengths_are_those_the_scenes_are_built_for() {
        for p in &PUBLISHED {
            let least = PLANNERS.iter().map(|planner| mean(Measure::Length, planner, p.name));
            assert_eq!(least.fold(f64::INFINITY, f64::min), p.shortest_m, "{}", p.name);
        }
    }

    #[test]
    fn exactly_the_marked_speeds_disagree_with_length_and_time() {
        let mut disagree = Vec::new();
        for planner in PLANNERS {
            for scenario in PUBLISHED.iter().map(|p| p.name) {
                let [vel, length, time] =
                    [Measure::Vel, Measure::Length, Measure::Time].map(|m| mean(m, planner, scenario));
                let marked = [Measure::Vel, Measure::Length]
                    .iter()
                    .any(|m| published(*m, planner, scenario).unwrap().slip.is_some());
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

    #[test]
    fn every_mark_is_explained_and_every_cell_is_a_number() {
        let cells = TABLES.lines().skip(1).flat_map(|line| line.split(',').skip(2));
        let marks: Vec<char> =
            cells.filter_map(|cell| cell.chars().last().filter(|c| !c.is_ascii_digit())).collect();
        assert_eq!(marks.len(), 12);
        assert!(marks.iter().all(|mark| SLIPS.iter().any(|(explained, _)| explained == mark)), "{marks:?}");
        for scenario in PUBLISHED.iter().map(|p| p.name) {
            for planner in PLANNERS {
                assert!(
                    Measure::PAPER.iter().all(|m| published(*m, planner, scenario).is_some()),
                    "{scenario}"
                );
            }
        }
    }
}
