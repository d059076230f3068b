//! Percentile bootstrap of a mean (Efron 1979).

use curionav_planning::random::{rng, uniform};

/// Samples drawn; the ends of a 95 % interval then rest on 100 of them each.
const RESAMPLES: usize = 4000;
/// Share of the samples beyond each end.
const TAIL: f64 = 0.025;

/// The 95 % interval of the mean of `values`, the same for the same `seed`; nothing of nothing.
pub(crate) fn mean_interval(values: &[f64], seed: u64) -> Option<(f64, f64)> {
    cluster_interval(&[values.to_vec()], seed)
}

/// The 95 % interval of the mean of the means of `clusters`: clusters are drawn anew, and in each its values (Davison and
/// Hinkley 1997, section 3.8). Values of one cluster are no independent samples of the whole. Clusters without values are
/// left out.
pub(crate) fn cluster_interval(clusters: &[Vec<f64>], seed: u64) -> Option<(f64, f64)> {
    let clusters: Vec<&[f64]> =
        clusters.iter().map(Vec::as_slice).filter(|values| !values.is_empty()).collect();
    let first = *clusters.first()?.first()?;
    if clusters.iter().all(|values| values.iter().all(|v| *v == first)) {
        return Some((first, first));
    }
    let mut rng = rng(seed, 0);
    let mut index = |count: usize| ((uniform(&mut rng) * count as f64) as usize).min(count - 1);
    let mut resampled = || {
        let of_clusters = (0..clusters.len()).map(|_| {
            let values = clusters[if clusters.len() > 1 { index(clusters.len()) } else { 0 }];
            (0..values.len()).map(|_| values[index(values.len())]).sum::<f64>() / values.len() as f64
        });
        of_clusters.sum::<f64>() / clusters.len() as f64
    };
    let mut means: Vec<f64> = (0..RESAMPLES).map(|_| resampled()).collect();
    means.sort_by(f64::total_cmp);
    let at = |share: f64| means[(share * (RESAMPLES - 1) as f64).round() as usize];
    Some((at(TAIL), at(1.0 - TAIL)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_near_that_of_the_normal_law_and_repeats() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let (low, high) = mean_interval(&values, 7).unwrap();
        // 49.5 +- 1.96 * 28.866 / 10, the standard deviation of 0..99 being sqrt((100^2 - 1) / 12).
        assert!((low - (49.5 - 5.658)).abs() < 0.35 && (high - (49.5 + 5.658)).abs() < 0.35, "{low} {high}");
        assert_eq!(mean_interval(&values, 7), Some((low, high)));
        assert_ne!(mean_interval(&values, 8), Some((low, high)));
    }

    #[test]
    fn equal_values_leave_no_doubt_and_none_leave_nothing() {
        assert_eq!(mean_interval(&[0.3, 0.3, 0.3], 1), Some((0.3, 0.3)));
        assert_eq!(mean_interval(&[], 1), None);
    }

    #[test]
    fn many_runs_of_few_scenes_do_not_make_a_mean_certain() {
        // Ten runs in each of four scenes that differ: what counts is the spread of the scenes.
        let clusters: Vec<Vec<f64>> = (0..4)
            .map(|scene| (0..10).map(|run| f64::from(scene) + 0.001 * f64::from(run)).collect())
            .collect();
        let width = |(low, high): (f64, f64)| high - low;
        let by_scene = width(cluster_interval(&clusters, 3).unwrap());
        let by_run = width(mean_interval(&clusters.concat(), 3).unwrap());
        // The deviation of the mean: sqrt(1.25 / 4) = 0.56 by scene, sqrt(1.25 / 40) = 0.18 by run.
        assert!(by_scene > 1.8 && by_run < 0.8, "{by_scene} {by_run}");
        assert_eq!(cluster_interval(&[vec![], vec![2.0]], 1), Some((2.0, 2.0)));
    }
}
