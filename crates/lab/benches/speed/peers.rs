//! What others need for the same, in r.

/// Name of a case, what the peer needs for it in r, and who that is.
const PEERS: [(&str, f64, &str); 3] = [
    // 6.8 ms for 2000 x 56 and all its critics, as published, for a machine whose r in C is 2.3 ms.
    ("term/cnc+cpc+distance/2000x56", 3.7, "Nav2 MPPI"),
    // Debian's OMPL 1.5, turning radius 0.5 m, the same map, start and goal: 642 samples in 1 s,
    // no way; r was 1.84 ms.
    ("rrt-star/depot/1s", 0.85, "OMPL RRT*, Dubins"),
    // 1127 samples in 3 s, 29.15 m; r was 1.78 ms.
    ("rrt-star/depot/3s", 1.5, "OMPL RRT*, Dubins"),
];

/// The peer of a case.
pub(crate) fn of(name: &str) -> Option<(f64, &'static str)> {
    PEERS.iter().find(|peer| peer.0 == name).map(|&(_, ratio, who)| (ratio, who))
}
