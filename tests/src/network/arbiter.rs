//! The arbiter crashes and is started again.

use std::time::{Duration, Instant};

use super::figures::Figures;
use super::pace::{Kept, measured, play};
use super::site::{Layout, NOMINAL_LIMIT, Site};

const LIMIT: Duration = Duration::from_secs(15);

#[test]
fn without_its_arbiter_the_robot_stops_and_goes_on_with_the_next_one() {
    play(&Layout::default(), |site| {
        let pace = site.pace;
        let soon = |f: &Figures| f.recovered.is_some_and(|time| time < pace.scaled(Duration::from_secs(5)));
        measured("SIGKILL of the arbiter", site, soon, killed_and_restarted)
    });
}

fn killed_and_restarted(site: &mut Site) -> Kept<Figures> {
    site.recorder().await_nominal("nominal before the fault", NOMINAL_LIMIT)?;
    let before = site.recorder().record().decisions.last().map(|(_, d)| d.epoch).unwrap();
    let from = Instant::now();
    site.kill("arbiter");
    site.recorder().await_until("stands", from, LIMIT, |r| {
        r.record().odometry.last().is_some_and(|(at, o)| *at > from && o.v == 0.0)
    })?;
    let returned = Instant::now();
    site.restart("arbiter");
    let recovered = site.recorder().await_until("drives again", returned, LIMIT, |r| {
        let record = r.record();
        record.decisions.last().is_some_and(|(_, d)| d.epoch > before)
            && record.commands.last().is_some_and(|(_, c)| c.epoch > before && c.v > 0.0)
    })?;
    site.recorder().await_nominal("nominal again", LIMIT)?;
    Ok(Figures { recovered: Some(recovered), ..site.recorder().figures_since(from) })
}
