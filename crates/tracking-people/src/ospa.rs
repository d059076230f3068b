//! How far tracks are from where people are known to be: OSPA (Schuhmacher, Vo and Vo, 2008), and who is found.

use curionav_planning::geometry::Point2;
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// Distances are compared to a micrometre: the library counts in whole numbers.
const UNITS_PER_METRE: f64 = 1e6;
/// What pairs that are too far apart cost, in these units: more than all near ones together.
const TOO_FAR: i64 = 1 << 40;

/// A person and the track that is given to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Partner {
    /// Position of the person among those that are known.
    pub truth: usize,
    /// Position of the track among the tracks.
    pub track: usize,
    /// Distance between the two, metres, without a cut.
    pub metres: f64,
}

/// Gives each of the fewer points one of the more, for the least sum of distances. A distance counts `cut` metres at
/// most.
pub fn partners(truth: &[Point2], tracks: &[Point2], cut: f64) -> Vec<Partner> {
    assigned(truth, tracks, |metres| units(metres.min(cut)))
}

/// As many pairs as possible that are at most `within` metres apart; of several such sets the one with the least sum of
/// distances.
pub fn matches(truth: &[Point2], tracks: &[Point2], within: f64) -> Vec<Partner> {
    let mut pairs = assigned(truth, tracks, |metres| if metres <= within { units(metres) } else { TOO_FAR });
    pairs.retain(|pair| pair.metres <= within);
    pairs
}

/// OSPA of order 1, metres: the mean over the greater number, with `cut` metres for each that has no partner.
pub fn ospa(truth: &[Point2], tracks: &[Point2], cut: f64) -> f64 {
    let most = truth.len().max(tracks.len());
    if most == 0 {
        return 0.0;
    }
    let pairs = partners(truth, tracks, cut);
    let near: f64 = pairs.iter().map(|pair| pair.metres.min(cut)).sum();
    (near + cut * (most - pairs.len()) as f64) / most as f64
}

/// The assignment of the least sum of costs, each of a distance in metres.
fn assigned(truth: &[Point2], tracks: &[Point2], cost: impl Fn(f64) -> i64) -> Vec<Partner> {
    // The library wants no more rows than columns.
    let is_swapped = truth.len() > tracks.len();
    let few = if is_swapped { tracks } else { truth };
    let many = if is_swapped { truth } else { tracks };
    if few.is_empty() {
        return Vec::new();
    }
    let costs = Matrix::from_fn(few.len(), many.len(), |(i, j)| cost(few[i].distance(many[j])));
    let given = kuhn_munkres_min(&costs).1.into_iter().enumerate();
    given
        .map(|(i, j)| if is_swapped { pair(truth, tracks, j, i) } else { pair(truth, tracks, i, j) })
        .collect()
}

fn pair(truths: &[Point2], tracks: &[Point2], truth: usize, track: usize) -> Partner {
    Partner { truth, track, metres: truths[truth].distance(tracks[track]) }
}

fn units(metres: f64) -> i64 {
    (metres * UNITS_PER_METRE) as i64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn p(x: f64) -> Point2 {
        Point2::new(x, 0.0)
    }

    #[test]
    fn ospa_counts_distance_and_number() {
        assert_eq!(ospa(&[], &[], 1.0), 0.0);
        assert_eq!(ospa(&[p(0.0)], &[], 1.0), 1.0);
        // 0.2 m and 0.1 m to the nearer ones, and one too many.
        let found = ospa(&[p(0.0), p(1.0)], &[p(1.1), p(0.2), p(9.0)], 1.0);
        assert!((found - 1.3 / 3.0).abs() < 1e-9, "{found}");
        assert_eq!(ospa(&[p(0.0)], &[p(7.0)], 1.0), 1.0);
    }

    #[test]
    fn two_that_are_found_a_little_off_are_better_than_one_that_is_found_well() {
        // Nearest first, 0.4 would take the track at 0.45, and 0.0 would be left without one.
        let truth = [p(0.0), p(0.4)];
        let tracks = [p(0.45), p(0.85)];
        let found = matches(&truth, &tracks, 0.5);
        let pairs: Vec<[usize; 2]> = found.iter().map(|pair| [pair.truth, pair.track]).collect();
        assert_eq!(pairs, [[0, 0], [1, 1]]);
        assert_eq!(matches(&truth, &[p(3.0)], 0.5), []);
        // More people than tracks.
        assert_eq!(matches(&truth, &[p(0.3)], 0.5).len(), 1);
    }
}
