//! Closed-loop claims about the localiser: drives on a real map and in simple halls.

mod simulation;

use curionav_localization::LocalizerParams;
use simulation::*;

#[test]
fn explore() {
    let Some(map) = real_map() else { return };
    let path = long_path(&map, 60.0);
    let length: f64 = path.windows(2).map(|w| w[0].distance(w[1])).sum();
    println!("path {} points {length:.1} m from {:?} to {:?}", path.len(), path[0], path.last());
    let f = |n: &str, d: f64| std::env::var(n).map_or(d, |v| v.parse().unwrap());
    let d = LocalizerParams::default();
    let params = LocalizerParams {
        temper: f("T", d.temper),
        sigma_hit: f("S", d.sigma_hit),
        roughening_position: f("RP", d.roughening_position),
        roughening_heading: f("RH", d.roughening_heading),
        ..d
    };
    for blocked in [0.0, 0.4] {
        for seed in 1..=5 {
            let t = std::time::Instant::now();
            let r = drive_path(&map, &path, &params, blocked, seed);
            let mean =
                |f: &dyn Fn(usize) -> f64| (0..r.nees.len()).map(|i| f(i)).sum::<f64>() / r.nees.len() as f64;
            println!(
                "blocked {blocked} seed {seed}: {} ticks final {:.3} rmse {:.3} max(after 5 s) {:.3} nees {:.2} sx {:.3} sa {:.4} n {:.0} fit {:.2} outside {:.3} conv {:.2} first conv {:?} ms {:.0}",
                r.nees.len(),
                r.position_error.last().unwrap(),
                r.rmse(),
                r.position_error[50..].iter().fold(0.0_f64, |a, &b| a.max(b)),
                r.mean_nees(),
                mean(&|i| (0.5 * (r.estimates[i].covariance[(0, 0)] + r.estimates[i].covariance[(1, 1)]))
                    .sqrt()),
                mean(&|i| r.estimates[i].covariance[(2, 2)].sqrt()),
                mean(&|i| r.estimates[i].health.particles as f64),
                mean(&|i| r.estimates[i].health.scan_fit),
                mean(&|i| r.estimates[i].health.outside_weight),
                mean(&|i| f64::from(u8::from(r.estimates[i].health.converged))),
                r.estimates.iter().position(|e| e.health.converged),
                t.elapsed().as_secs_f64() * 1e3
            );
        }
    }
}
