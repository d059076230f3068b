//! Who stands together: the online crowd cluster of section IV-C1.

use crate::scene::People;
use crate::sight::Sight;

/// People as groups of indices: two belong together when a chain of neighbours links them, each nearer
/// to the next than `social_distance` metres (strictly; transitive, A17). With `sight`, no wall may lie between
/// neighbours.
///
/// Members ascend within a group and groups ascend by their first member, so the answer depends on
/// nothing but the people.
pub fn crowd_clusters(people: &People, social_distance: f64, sight: Option<&Sight>) -> Vec<Vec<usize>> {
    let mut links = Links((0..people.len()).collect());
    let limit = social_distance * social_distance;
    for i in 0..people.len() {
        for j in 0..i {
            let a = people.position(i);
            let b = people.position(j);
            if a.distance_squared(b) >= limit || links.root(i) == links.root(j) {
                continue;
            }
            if sight.is_none_or(|sight| sight.is_free(a, b)) {
                links.join(i, j);
            }
        }
    }
    let mut clusters: Vec<Vec<usize>> = Vec::new();
    let mut cluster_of_root = vec![usize::MAX; people.len()];
    for i in 0..people.len() {
        let root = links.root(i);
        if cluster_of_root[root] == usize::MAX {
            cluster_of_root[root] = clusters.len();
            clusters.push(Vec::new());
        }
        clusters[cluster_of_root[root]].push(i);
    }
    clusters
}

/// Disjoint sets; every root is the least member of its set.
struct Links(Vec<usize>);

impl Links {
    fn root(&mut self, i: usize) -> usize {
        let mut root = i;
        while self.0[root] != root {
            self.0[root] = self.0[self.0[root]];
            root = self.0[root];
        }
        root
    }

    fn join(&mut self, i: usize, j: usize) {
        let a = self.root(i);
        let b = self.root(j);
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    /// The slow reference: labels spread over all pairs until nothing changes.
    pub(crate) fn plain_clusters(people: &People, social_distance: f64) -> Vec<Vec<usize>> {
        let n = people.len();
        let mut label: Vec<usize> = (0..n).collect();
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..n {
                for j in 0..n {
                    let dx = people.x[i] - people.x[j];
                    let dy = people.y[i] - people.y[j];
                    let near = dx * dx + dy * dy < social_distance * social_distance;
                    if near && label[j] < label[i] {
                        label[i] = label[j];
                        changed = true;
                    }
                }
            }
        }
        (0..n)
            .map(|l| (0..n).filter(|&i| label[i] == l).collect())
            .filter(|c: &Vec<usize>| !c.is_empty())
            .collect()
    }

    fn people(points: &[(f64, f64)]) -> People {
        People {
            id: (0..points.len() as u32).collect(),
            x: points.iter().map(|p| p.0).collect(),
            y: points.iter().map(|p| p.1).collect(),
            vx: vec![0.0; points.len()],
            vy: vec![0.0; points.len()],
            radius: 0.25,
            ..People::default()
        }
    }

    #[test]
    fn equals_the_plain_search_on_random_crowds() {
        for seed in 0..500 {
            let mut r = rng(seed, 4);
            let n = (uniform(&mut r) * 80.0) as usize;
            let side = 5.0 + 25.0 * uniform(&mut r);
            let snap = |v: f64| if seed % 2 == 0 { v } else { v.round() };
            let points: Vec<(f64, f64)> =
                (0..n).map(|_| (snap(side * uniform(&mut r)), snap(side * uniform(&mut r)))).collect();
            let crowd = people(&points);
            for d in [1.0, 1.2, 2.1, 3.6] {
                assert_eq!(crowd_clusters(&crowd, d, None), plain_clusters(&crowd, d), "seed {seed}, d {d}");
            }
        }
    }

    #[test]
    fn a_chain_is_one_crowd_and_the_limit_itself_is_apart() {
        let row = people(&[(0.0, 0.0), (4.0, 0.0), (2.0, 0.0), (6.25, 0.0), (10.0, 0.0)]);
        assert_eq!(
            crowd_clusters(&row, 2.25, None),
            [vec![0, 1, 2], vec![3], vec![4]],
            "6.25 - 4 is the limit"
        );
        assert_eq!(crowd_clusters(&row, 2.26, None), [vec![0, 1, 2, 3], vec![4]]);
        assert_eq!(crowd_clusters(&row, 2.0, None).len(), 5, "2 m apart is not less than 2 m");
        assert!(crowd_clusters(&People::default(), 2.1, None).is_empty());
    }

    #[test]
    fn a_thousand_people_on_one_spot_are_one_crowd() {
        assert_eq!(crowd_clusters(&people(&[(3.0, -4.0); 1024]), 2.1, None), [(0..1024).collect::<Vec<_>>()]);
    }
}
