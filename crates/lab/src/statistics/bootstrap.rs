//! Percentile bootstrap of a mean (Efron 1979).

use curionav_planning::random::{rng, uniform};

/// Samples drawn; the ends of a 95 % interval then rest on 100 of them each.
const RESAMPLES: usize = 4000;
/// Share of the samples beyond each end.
const TAIL: f64 = 0.025;

/// The 95 % interval of the mean of `values`, the same for the same `seed`; nothing of nothing.
pub(crate) fn mean_interval(values: &[f64], seed: u64) -> Option<(f64, f64)> {
    cluster_interval(&[vec![values.to_vec()]], seed)
}

/// The 95 % interval of the mean over `places` of the mean over their scenes of the mean of a scene's values: places are
/// drawn anew, in each its scenes, and in each its values (Davison and Hinkley 1997, section 3.8). Values of one scene, and
/// scenes in one place, are no independent samples of the whole. What is empty is left out.
pub(crate) fn cluster_interval(places: &[Vec<Vec<f64>>], seed: u64) -> Option<(f64, f64)> {
    let filled = |place: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        place.iter().filter(|values| !values.is_empty()).cloned().collect()
    };
    let places: Vec<Vec<Vec<f64>>> = places.iter().map(filled).filter(|place| !place.is_empty()).collect();
    let first = *places.first()?.first()?.first()?;
    if places.iter().flatten().flatten().all(|value| *value == first) {
        return Some((first, first));
    }
    let mut rng = rng(seed, 0);
    let mut index = |count: usize| ((uniform(&mut rng) * count as f64) as usize).min(count - 1);
    // What is there once is taken and not drawn.
    let mut one_of = |count: usize| if count > 1 { index(count) } else { 0 };
    let mut resampled = || {
        let mut of_places = 0.0;
        for _ in 0..places.len() {
            let scenes = &places[one_of(places.len())];
            let mut of_scenes = 0.0;
            for _ in 0..scenes.len() {
                let values = &scenes[one_of(scenes.len())];
                of_scenes += (0..values.len()).map(|_| values[one_of(values.len())]).sum::<f64>()
                    / values.len() as f64;
            }
            of_places += of_scenes / scenes.len() as f64;
        }
        of_places / places.len() as f64
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
        let by_scene = width(cluster_interval(std::slice::from_ref(&clusters), 3).unwrap());
        let by_run = width(mean_interval(&clusters.concat(), 3).unwrap());
        // The deviation of the mean: sqrt(1.25 / 4) = 0.56 by scene, sqrt(1.25 / 40) = 0.18 by run.
        assert!(by_scene > 1.8 && by_run < 0.8, "{by_scene} {by_run}");
        // As two places of two scenes each, 0.5 and 2.5: sqrt(1 / 2 + 0.25 / 4) = 0.75.
        let places = [clusters[..2].to_vec(), clusters[2..].to_vec()];
        let by_place = width(cluster_interval(&places, 3).unwrap());
        assert!(by_place > 1.1 * by_scene, "{by_place} {by_scene}");
        assert_eq!(cluster_interval(&[vec![], vec![vec![], vec![2.0]]], 1), Some((2.0, 2.0)));
    }
}
