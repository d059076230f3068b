//! One filter update of the localiser, with as many particles as it is told to keep.

use std::cell::RefCell;
use std::rc::Rc;

use curionav_crowdsim::Observation;
use curionav_localization::{Localizer, LocalizerParams, Scan};
use curionav_planning::geometry::Twist;

use crate::case::Case;
use crate::mission::OnTheWay;

/// Updates in one repeat.
const UPDATES: u32 = 8;
/// Ticks between two of them: the robot drives 0.24 m, which is enough for the filter to take a scan in.
const TICKS: u32 = 3;

/// Updates along the first metres of env4-s2, with 500, 2000 and 5000 particles.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let OnTheWay { mut world, .. } = OnTheWay::with("curiosity")?;
    let start = world.scenario().robot.start;
    let scenario = world.scenario().clone();
    let drive: Rc<Vec<Observation>> = Rc::new((0..UPDATES).map(|_| observe_after(&mut world)).collect());
    let of = |particles: usize| {
        let params = LocalizerParams {
            particles_min: particles,
            particles_max: particles,
            ..LocalizerParams::default()
        };
        let map = world.map().clone();
        let localizer = Localizer::new(map, scenario.laser, scenario.odometry_noise, params, 1)?;
        let localizer = Rc::new(RefCell::new(localizer));
        let started = Rc::clone(&localizer);
        let drive = Rc::clone(&drive);
        let start_over = move || {
            let mut localizer = started.borrow_mut();
            let covariance = localizer.start_covariance();
            localizer.initialise(start, &covariance);
        };
        let laser = scenario.laser;
        let update = move |()| {
            let mut localizer = localizer.borrow_mut();
            for seen in drive.iter() {
                let scan = Scan { ranges: &seen.ranges, laser };
                localizer.update(seen.odometry, seen.twist, seen.stamp, &scan);
            }
        };
        Ok(Case::after(format!("localize/{particles}"), UPDATES, start_over, update))
    };
    [500, 2000, 5000].into_iter().map(of).collect()
}

/// What the sensors say after a stretch at 0.8 m/s.
fn observe_after(world: &mut curionav_crowdsim::World) -> Observation {
    (0..TICKS).for_each(|_| world.step(Twist { v: 0.8, omega: 0.0 }));
    world.observe()
}
