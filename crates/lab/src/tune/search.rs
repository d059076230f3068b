//! Successive halving (Jamieson and Talwalkar 2016, here by thirds), then coordinate descent from the best.

use super::space::{Setting, Space};

/// The part of the settings that goes on, and by how much more each of them is run.
const THIRD: u32 = 3;
/// First step of the descent, as a part of a parameter's range; halved from round to round.
const STEP: f64 = 0.15;

/// Tells what settings cost with the first `repeats` seeds, the same seeds for all.
pub(crate) trait Trial {
    async fn costs(&mut self, settings: &[Setting], repeats: u32) -> anyhow::Result<Vec<f64>>;
}

/// The best of `settings` by ever more seeds, up to `repeats`, and its cost with all of them.
pub(crate) async fn halving(
    trial: &mut impl Trial,
    mut settings: Vec<Setting>,
    repeats: u32,
) -> anyhow::Result<(Setting, f64)> {
    let mut seeds = 1;
    loop {
        let costs = trial.costs(&settings, seeds).await?;
        let mut ranked: Vec<(f64, Setting)> = costs.into_iter().zip(settings).collect();
        // Stable: among equals the earlier one, the base first.
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        if seeds >= repeats {
            let (cost, best) = ranked.swap_remove(0);
            return Ok((best, cost));
        }
        let kept = ranked.len().div_ceil(THIRD as usize);
        settings = ranked.into_iter().take(kept).map(|(_, setting)| setting).collect();
        seeds = (seeds * THIRD).min(repeats);
    }
}

/// Moves one parameter after the other while it helps. A move that is worse with a third of the seeds is dropped.
pub(crate) async fn descent(
    trial: &mut impl Trial,
    space: &Space,
    (mut best, mut cost): (Setting, f64),
    repeats: u32,
    rounds: u32,
) -> anyhow::Result<(Setting, f64)> {
    let few = repeats.div_ceil(THIRD);
    let mut step = STEP;
    for _ in 0..rounds {
        for index in 0..space.parameters.len() {
            let step = step.max(space.parameters[index].least_step());
            for way in [step, -step] {
                let place = (best.place[index] + way).clamp(0.0, 1.0);
                let moved = space.moved(&best, index, place)?;
                if moved.profile == best.profile {
                    continue;
                }
                let both = [best.clone(), moved];
                let first = trial.costs(&both, few).await?;
                if first[1] >= first[0] {
                    continue;
                }
                let [_, moved] = both;
                let all = trial.costs(std::slice::from_ref(&moved), repeats).await?;
                if all[0] < cost {
                    (best, cost) = (moved, all[0]);
                    break;
                }
            }
        }
        step /= 2.0;
    }
    Ok((best, cost))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bowl around places 0.3 and 0.8, and how many (setting, seed) were asked for.
    struct Bowl(u32);

    impl Trial for Bowl {
        async fn costs(&mut self, settings: &[Setting], repeats: u32) -> anyhow::Result<Vec<f64>> {
            self.0 += settings.len() as u32 * repeats;
            let cost =
                |s: &Setting| s.place.iter().zip([0.3, 0.8]).map(|(p, best)| (p - best) * (p - best)).sum();
            Ok(settings.iter().map(cost).collect())
        }
    }

    fn space() -> Space {
        let path = std::env::temp_dir().join(format!("curionav-space-{}.toml", std::process::id()));
        let parameter = |path: &str| format!("[[parameters]]\npath = \"{path}\"\nlow = 0.1\nhigh = 2.0\n");
        let text = ["base = \"curiosity\"\n", &parameter("terms.cnc.weight"), &parameter("terms.cpc.weight")];
        std::fs::write(&path, text.concat()).unwrap();
        let space = Space::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        space
    }

    #[tokio::test]
    async fn the_search_ends_near_the_least_cost_and_drops_poor_settings_early() {
        let space = space();
        let sample = space.sample(27, 1).unwrap();
        let mut bowl = Bowl(0);
        let (best, cost) = halving(&mut bowl, sample.clone(), 9).await.unwrap();
        // 27 with one seed, 9 with three, 3 with nine: not 27 with nine.
        assert_eq!(bowl.0, 27 + 9 * 3 + 3 * 9);
        let least = bowl.costs(&sample, 1).await.unwrap().into_iter().fold(f64::INFINITY, f64::min);
        assert_eq!(cost, least);
        let (best, refined) = descent(&mut bowl, &space, (best, cost), 9, 6).await.unwrap();
        assert!(refined <= cost && refined < 0.001, "{refined} after {cost}");
        assert!((best.profile.terms["cnc"].weight - (0.1 + best.place[0] * 1.9)).abs() < 1e-3);
    }
}
