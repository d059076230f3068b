//! Who belongs together: the online crowd cluster of section IV-C1, and one that also looks at how people move.

use crate::geometry::Point2;
use crate::scene::People;
use crate::sight::Sight;

crate::parameters! {
    /// Who are neighbours. A chain of neighbours is a group.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Linkage {
        /// Those nearer to each other than the social distance, as in the paper (A17).
        #[default]
        Distance,
        /// Those of them whose velocities differ by less than `velocity_difference`: two who
        /// pass each other are none.
        DistanceAndVelocity,
    }
}

crate::parameters! {
    /// What room a group takes, for the terms `cnc` and `human-space`.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum GroupShape {
        /// That of the smallest circle around its people, as in the paper (A18). A long queue has little at its
        /// ends.
        #[default]
        Circle,
        /// That of their convex hull, and around it what a lone person has. It moves with each of its people.
        Hull,
    }
}

crate::parameters! {
    /// Who belongs together, and what room they take.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct GroupParams {
        /// Who are neighbours.
        pub linkage: Linkage [words] = Linkage::Distance,
        /// Two people nearer than this may be neighbours, metres: the far edge of Hall's close social phase (A17).
        /// 3.6 m joins nearly all people in dense scenes, 1.2 m hardly any.
        pub social_distance: f64 [0.0, 100.0, "m", "people farther apart do not stand together"] = 2.1,
        /// Two people whose velocities differ by this or more are no neighbours under `distance-and-velocity`, m/s.
        pub velocity_difference: f64 [0.0, 10.0, "m/s", "no two people differ by more"] = 0.6,
        /// What room a group takes.
        pub shape: GroupShape [words] = GroupShape::Circle,
    }
}

impl GroupParams {
    /// Whether two people are neighbours where no wall is between them.
    fn links(&self, people: &People, i: usize, j: usize) -> bool {
        let limit = self.social_distance * self.social_distance;
        if people.position(i).distance_squared(people.position(j)) >= limit {
            return false;
        }
        match self.linkage {
            Linkage::Distance => true,
            Linkage::DistanceAndVelocity => {
                let a = Point2::new(people.vx[i], people.vy[i]);
                let b = Point2::new(people.vx[j], people.vy[j]);
                a.distance_squared(b) < self.velocity_difference * self.velocity_difference
            }
        }
    }
}

/// People as groups of indices: two belong together when a chain of neighbours links them (strictly nearer than the
/// limits of `params`; transitive, A17). With `sight`, no wall may lie between neighbours.
///
/// Members ascend within a group and groups ascend by their first member, so the answer depends on
/// nothing but the people.
pub fn crowd_clusters(people: &People, params: &GroupParams, sight: Option<&Sight>) -> Vec<Vec<usize>> {
    let mut links = Links((0..people.len()).collect());
    for i in 0..people.len() {
        for j in 0..i {
            if !params.links(people, i, j) || links.root(i) == links.root(j) {
                continue;
            }
            if sight.is_none_or(|sight| sight.is_free(people.position(i), people.position(j))) {
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
    pub(crate) fn plain_clusters(people: &People, params: &GroupParams) -> Vec<Vec<usize>> {
        let n = people.len();
        let mut label: Vec<usize> = (0..n).collect();
        let mut changed = true;
        while changed {
            changed = false;
            for i in 0..n {
                for j in 0..n {
                    let dx = people.x[i] - people.x[j];
                    let dy = people.y[i] - people.y[j];
                    let near = dx * dx + dy * dy < params.social_distance * params.social_distance;
                    let dvx = people.vx[i] - people.vx[j];
                    let dvy = people.vy[i] - people.vy[j];
                    let alike = params.linkage == Linkage::Distance
                        || (dvx * dvx + dvy * dvy).sqrt() < params.velocity_difference;
                    if near && alike && label[j] < label[i] {
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

    fn nearer_than(social_distance: f64) -> GroupParams {
        GroupParams { social_distance, ..GroupParams::default() }
    }

    /// Those of the profile `curionav`.
    fn walking_together() -> GroupParams {
        GroupParams {
            linkage: Linkage::DistanceAndVelocity,
            social_distance: 1.25,
            velocity_difference: 0.6,
            ..GroupParams::default()
        }
    }

    fn standing(points: &[(f64, f64)]) -> People {
        let each: Vec<[f64; 4]> = points.iter().map(|&(x, y)| [x, y, 0.0, 0.0]).collect();
        People::walking(0.25, &each)
    }

    #[test]
    fn equals_the_plain_search_on_random_crowds() {
        for seed in 0..500 {
            let mut r = rng(seed, 4);
            let n = (uniform(&mut r) * 80.0) as usize;
            let side = 5.0 + 25.0 * uniform(&mut r);
            let snap = |v: f64| if seed % 2 == 0 { v } else { v.round() };
            let each: Vec<[f64; 4]> = (0..n)
                .map(|_| {
                    let place = [snap(side * uniform(&mut r)), snap(side * uniform(&mut r))];
                    [place[0], place[1], 2.0 * uniform(&mut r) - 1.0, uniform(&mut r)]
                })
                .collect();
            let crowd = People::walking(0.25, &each);
            for d in [1.0, 1.2, 2.1, 3.6] {
                for linkage in [Linkage::Distance, Linkage::DistanceAndVelocity] {
                    let params = GroupParams { linkage, ..nearer_than(d) };
                    let found = crowd_clusters(&crowd, &params, None);
                    assert_eq!(found, plain_clusters(&crowd, &params), "seed {seed}, d {d}");
                }
            }
        }
    }

    #[test]
    fn a_chain_is_one_crowd_and_the_limit_itself_is_apart() {
        let row = standing(&[(0.0, 0.0), (4.0, 0.0), (2.0, 0.0), (6.25, 0.0), (10.0, 0.0)]);
        assert_eq!(
            crowd_clusters(&row, &nearer_than(2.25), None),
            [vec![0, 1, 2], vec![3], vec![4]],
            "6.25 - 4 is the limit"
        );
        assert_eq!(crowd_clusters(&row, &nearer_than(2.26), None), [vec![0, 1, 2, 3], vec![4]]);
        assert_eq!(crowd_clusters(&row, &nearer_than(2.0), None).len(), 5, "2 m apart is not less than 2 m");
        assert!(crowd_clusters(&People::default(), &nearer_than(2.1), None).is_empty());
    }

    #[test]
    fn a_thousand_people_on_one_spot_are_one_crowd() {
        let crowd = standing(&[(3.0, -4.0); 1024]);
        assert_eq!(crowd_clusters(&crowd, &nearer_than(2.1), None), [(0..1024).collect::<Vec<_>>()]);
    }

    #[test]
    fn two_who_walk_together_are_a_group_and_two_who_pass_each_other_are_not() {
        let together = People::walking(0.25, &[[0.0, 0.0, 1.2, 0.1], [0.1, 0.8, 1.1, -0.1]]);
        let passing = People::walking(0.25, &[[0.0, 0.0, 1.2, 0.0], [0.1, 0.8, -1.1, 0.0]]);
        let beside_one_who_stands = People::walking(0.25, &[[0.0, 0.0, 1.2, 0.0], [0.1, 0.8, 0.0, 0.0]]);
        let count = |people: &People, params: &GroupParams| crowd_clusters(people, params, None).len();
        assert_eq!(count(&together, &walking_together()), 1);
        assert_eq!(count(&passing, &walking_together()), 2);
        assert_eq!(count(&beside_one_who_stands, &walking_together()), 2);
        // The paper's reading makes one of each.
        let paper = GroupParams::default();
        assert_eq!([&together, &passing, &beside_one_who_stands].map(|p| count(p, &paper)), [1, 1, 1]);
    }

    #[test]
    fn the_order_of_people_changes_no_group() {
        for seed in 0..100 {
            let mut r = rng(seed, 61);
            let each: Vec<[f64; 4]> = (0..30)
                .map(|_| [0.0; 4].map(|_| 6.0 * uniform(&mut r)))
                .map(|[x, y, vx, vy]| [x, y, 0.2 * vx, 0.2 * vy])
                .collect();
            let crowd = People::walking(0.25, &each);
            let order: Vec<usize> = (0..30).map(|k| (7 * k + seed as usize) % 30).collect();
            let ids = |people: &People| {
                let mut groups: Vec<Vec<u32>> = crowd_clusters(people, &walking_together(), None)
                    .into_iter()
                    .map(|group| {
                        let mut of: Vec<u32> = group.into_iter().map(|i| people.id[i]).collect();
                        of.sort_unstable();
                        of
                    })
                    .collect();
                groups.sort();
                groups
            };
            assert_eq!(ids(&crowd), ids(&crowd.pick(order)), "seed {seed}");
        }
    }
}
