//! The arbiter crashes and is started again.

use std::time::{Duration, Instant};

use super::figures::{Figures, measured};
use super::invariants;
use super::site::{Layout, Site};

const LIMIT: Duration = Duration::from_secs(15);

#[test]
fn without_its_arbiter_the_robot_stops_and_goes_on_with_the_next_one() {
    let Some(mut site) = Site::start("killing the arbiter", &Layout::default()) else { return };
    let soon = |f: &Figures| f.recovered.is_some_and(|time| time < Duration::from_secs(5));
    measured("SIGKILL of the arbiter", &mut site, soon, |site| {
        site.recorder().await_nominal("nominal before the fault", Duration::from_secs(20));
        let before = site.recorder().record().decisions.last().map(|(_, d)| d.epoch).unwrap();
        let from = Instant::now();
        site.kill("arbiter");
        site.recorder().await_until("stands", from, LIMIT, |r| {
            r.record().odometry.last().is_some_and(|(at, o)| *at > from && o.v == 0.0)
        });
        let returned = Instant::now();
        site.restart("arbiter");
        let recovered = site.recorder().await_until("drives again", returned, LIMIT, |r| {
            let record = r.record();
            record.decisions.last().is_some_and(|(_, d)| d.epoch > before)
                && record.commands.last().is_some_and(|(_, c)| c.epoch > before && c.v > 0.0)
        });
        site.recorder().await_nominal("nominal again", LIMIT);
        let figures = Figures::since(&site.recorder().record(), from);
        Figures { recovered: Some(recovered), ..figures }
    });
    invariants::check(site.recorder());
}
