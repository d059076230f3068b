//! A log driven through the filter, and how well that went.

use std::time::Instant;

use curionav_localization::{Localizer, LocalizerParams, Scan};
use curionav_planning::geometry::{Pose2, Twist, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::robot_log::Log;
pub(super) use crate::robot_log::drive_arguments::Start;
use crate::statistics::{mean, median};

/// How the filter works.
pub(super) struct Filter {
    pub(super) params: LocalizerParams,
    pub(super) noise: OdometryNoise,
    pub(super) seed: u64,
}

/// A log, and what drives it.
pub(super) struct Drive {
    pub(super) log_name: String,
    pub(super) map_name: Option<String>,
    /// Where the picture of the tracks goes.
    pub(super) picture: String,
    pub(super) log: Log,
    /// How long before their stamps its scans were taken, seconds.
    pub(super) delay_s: f64,
    pub(super) references_are: String,
    pub(super) map: StaticMap,
    pub(super) start: Start,
    pub(super) params: LocalizerParams,
    pub(super) noise: OdometryNoise,
}

impl Drive {
    pub(super) fn track(&self, seed: u64, progress: impl FnMut(usize)) -> anyhow::Result<Track> {
        self.track_delayed(self.delay_s, seed, progress)
    }

    /// The track if scans were taken so many seconds before their stamps.
    pub(super) fn track_delayed(
        &self,
        delay_s: f64,
        seed: u64,
        progress: impl FnMut(usize),
    ) -> anyhow::Result<Track> {
        let filter = Filter { params: self.params.clone(), noise: self.noise, seed };
        Track::of(&self.log.delayed(delay_s), &self.map, self.start, filter, progress)
    }
}

/// What the filter said at each reading.
pub(super) struct Track {
    pub(super) poses: Vec<Pose2>,
    pub(super) covariances: Vec<Matrix3<f64>>,
    pub(super) converged: Vec<bool>,
    /// Filter updates, and the seconds of wall time that all of it took.
    pub(super) updates: usize,
    pub(super) wall_s: f64,
}

impl Track {
    /// Drives the log. `progress` is told how many readings are done.
    pub(super) fn of(
        log: &Log,
        map: &StaticMap,
        start: Start,
        filter: Filter,
        mut progress: impl FnMut(usize),
    ) -> anyhow::Result<Self> {
        let Filter { params, noise, seed } = filter;
        let laser = log.readings[0].laser;
        let mut localizer = match start {
            Start::Anywhere => Localizer::new(map.clone(), laser, noise, params, seed)?,
            Start::At(pose) => {
                let covariance = params.start_covariance();
                Localizer::starting_at(map.clone(), laser, noise, params, seed, (pose, &covariance))?
            }
        };
        let count = log.readings.len();
        let mut track = Self {
            poses: Vec::with_capacity(count),
            covariances: Vec::with_capacity(count),
            converged: Vec::with_capacity(count),
            updates: 0,
            wall_s: 0.0,
        };
        let began = Instant::now();
        for (k, reading) in log.readings.iter().enumerate() {
            let scan = Scan { ranges: &reading.ranges, laser: reading.laser };
            let estimate = localizer.update(reading.odometry, Twist::default(), reading.stamp, &scan);
            track.poses.push(estimate.pose);
            track.covariances.push(estimate.covariance);
            track.converged.push(estimate.health.converged);
            track.updates += usize::from(estimate.observed);
            progress(k + 1);
        }
        track.wall_s = began.elapsed().as_secs_f64();
        Ok(track)
    }
}

/// Odometry alone, as if it had started where the first reference is; or without references, where the filter was when
/// it first had converged, or at the beginning.
pub(super) fn by_odometry(log: &Log, track: &Track) -> Vec<Pose2> {
    let referred = log.readings.iter().position(|reading| reading.reference.is_some());
    let at = referred.or_else(|| track.converged.iter().position(|is| *is)).unwrap_or(0);
    let known = log.readings[at].reference.unwrap_or(track.poses[at]);
    let origin = log.readings[at].odometry;
    log.readings.iter().map(|reading| known.compose(origin.relative(reading.odometry))).collect()
}

/// Errors of one track against the references.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Errors {
    /// Position, metres.
    pub(super) median_m: f64,
    pub(super) mean_m: f64,
    pub(super) p95_m: f64,
    pub(super) greatest_m: f64,
    pub(super) at_end_m: f64,
    /// Heading, degrees.
    pub(super) heading_median_deg: f64,
}

impl Errors {
    /// Of the poses that have a reference; nothing if none has.
    pub(super) fn of(pairs: &[(Pose2, Pose2)]) -> Option<Self> {
        let metres: Vec<f64> = pairs.iter().map(|(a, b)| a.position().distance(b.position())).collect();
        let degrees: Vec<f64> =
            pairs.iter().map(|(a, b)| wrap_angle(a.heading - b.heading).abs().to_degrees()).collect();
        let mut sorted = metres.clone();
        sorted.sort_by(f64::total_cmp);
        Some(Self {
            median_m: median(&metres)?,
            mean_m: mean(&metres)?,
            p95_m: sorted[(sorted.len() * 95 / 100).min(sorted.len() - 1)],
            greatest_m: *sorted.last()?,
            at_end_m: *metres.last()?,
            heading_median_deg: median(&degrees)?,
        })
    }
}

/// How honest the covariances are: the normalised squared error of x, y and heading should have mean 3, and exceed 7.81
/// one time in twenty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Consistency {
    pub(super) mean: f64,
    pub(super) share_within_95: f64,
}

impl Consistency {
    pub(super) fn of(pairs: &[(Pose2, Pose2)], covariances: &[Matrix3<f64>]) -> Option<Self> {
        const QUANTILE: f64 = 7.814_727_903_251_178;
        let one = |((estimate, truth), covariance): (&(Pose2, Pose2), &Matrix3<f64>)| {
            let turned = wrap_angle(estimate.heading - truth.heading);
            let error = Vector3::new(estimate.x - truth.x, estimate.y - truth.y, turned);
            covariance.try_inverse().map(|inverse| (error.transpose() * inverse * error)[0])
        };
        let errors: Vec<f64> = pairs.iter().zip(covariances).filter_map(one).collect();
        let within = errors.iter().filter(|error| **error <= QUANTILE).count();
        Some(Self { mean: mean(&errors)?, share_within_95: within as f64 / errors.len() as f64 })
    }
}
