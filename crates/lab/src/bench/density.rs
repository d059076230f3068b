//! Success over density, where scenes of several kinds have the same densities of people.

use super::comparison::Comparison;
use super::plan::Scene;
use super::row::Tally;

/// How many kinds of scenes each density must have. One scene per density would show the scene and not the density.
const KINDS_LEAST: usize = 2;

/// The runs of every planner at every density.
pub(crate) struct Densities {
    /// People per m2, ascending.
    pub(crate) levels: Vec<f64>,
    /// `[planner][level]`
    tallies: Vec<Vec<Tally>>,
}

impl Densities {
    /// Nothing unless there are several densities with several scenes each.
    pub(crate) fn of(comparison: &Comparison<'_>, scenes: &[Scene]) -> Option<Self> {
        let densities: Vec<f64> = scenes.iter().map(Scene::density).collect();
        Self::at(comparison, &densities)
    }

    /// `densities` are those of the scenarios, people per m2.
    fn at(comparison: &Comparison<'_>, densities: &[f64]) -> Option<Self> {
        let levels: Vec<f64> = densities.iter().map(|density| rounded(*density)).collect();
        let mut distinct = levels.clone();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup();
        let scenes =
            |level: f64| -> Vec<usize> { (0..levels.len()).filter(|&s| levels[s] == level).collect() };
        let by_level: Vec<Vec<usize>> = distinct.iter().map(|level| scenes(*level)).collect();
        if distinct.len() < 2 || by_level.iter().any(|scenes| scenes.len() < KINDS_LEAST) {
            return None;
        }
        let tally =
            |p: usize, scenes: &Vec<usize>| Tally::of(scenes.iter().flat_map(|&s| comparison.runs(s, p)));
        let planners = 0..comparison.planners.len();
        let tallies = planners.map(|p| by_level.iter().map(|scenes| tally(p, scenes)).collect()).collect();
        Some(Self { levels: distinct, tallies })
    }

    /// The runs of a planner, level by level.
    pub(crate) fn runs_of(&self, planner: &usize) -> &[Tally] {
        &self.tallies[*planner]
    }

    /// Where a planner's success falls to half, in words: a density, or on which side of all of them.
    pub(crate) fn half(&self, planner: &usize) -> String {
        let (Some(first), Some(last)) = (self.levels.first(), self.levels.last()) else {
            return String::new();
        };
        let shares = self.runs_of(planner).iter().map(Tally::share);
        let points: Vec<(f64, f64)> = self.levels.iter().copied().zip(shares).collect();
        if points[0].1 < 0.5 {
            return format!("below {first}");
        }
        let falls = points.array_windows().find(|[_, (_, share)]| *share < 0.5);
        let Some(&[(less, above), (more, below)]) = falls else { return format!("above {last}") };
        format!("{:.2}", less + (more - less) * (above - 0.5) / (above - below))
    }
}

/// To two digits: the number of people is whole, so scenes of one density differ a little.
fn rounded(density: f64) -> f64 {
    format!("{density:.1e}").parse().unwrap_or(density)
}

#[cfg(test)]
mod tests {
    use super::super::comparison::tests::names;
    use super::super::row::Row;
    use super::super::row::tests::row;
    use super::*;
    use curionav_schemas::Outcome;

    /// Two scenes at each of three densities; planner `a` succeeds in so many of ten runs at each.
    fn densities(successes: [u64; 3], of_scenes: &[f64]) -> Option<Densities> {
        let scenarios: Vec<String> = (0..6).map(|s| format!("s{s}")).collect();
        let rows: Vec<Row> = scenarios
            .iter()
            .enumerate()
            .flat_map(|(s, name)| {
                (0..5).map(move |seed| {
                    let is_lost = 2 * seed >= successes[s / 2];
                    let outcome = if is_lost { Outcome::Lost } else { Outcome::Reached };
                    let mut row = Row { outcome, ..row(name, "a", seed) };
                    row.measures.collisions = 0;
                    row
                })
            })
            .collect();
        let all: Vec<&Row> = rows.iter().collect();
        Densities::at(&Comparison::new(names(&["a"]), scenarios, (0..6).collect(), &all), of_scenes)
    }

    const SIX: [f64; 6] = [0.1, 0.1004, 0.2, 0.1996, 0.4, 0.4];

    #[test]
    fn half_is_met_between_two_densities_or_beyond_all_of_them() {
        let found = densities([10, 8, 2], &SIX).unwrap();
        assert_eq!(found.levels, [0.1, 0.2, 0.4]);
        let successes: Vec<usize> = found.tallies[0].iter().map(|tally| tally.success).collect();
        assert_eq!((successes, found.tallies[0][1].runs), (vec![10, 8, 2], 10));
        // From 0.8 at 0.2 to 0.2 at 0.4.
        assert_eq!(found.half(&0), "0.30");
        assert_eq!(densities([4, 8, 8], &SIX).unwrap().half(&0), "below 0.1");
        assert_eq!(densities([10, 8, 6], &SIX).unwrap().half(&0), "above 0.4");
    }

    #[test]
    fn a_density_with_one_scene_says_nothing_of_densities() {
        assert!(densities([10, 8, 2], &[0.1, 0.1, 0.2, 0.2, 0.4, 0.5]).is_none());
        assert!(densities([10, 8, 2], &[0.1; 6]).is_none());
    }
}
