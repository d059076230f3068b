//! The filter: one call per tick.

use nalgebra::Matrix3;

use curionav_planning::geometry::{Point2, Pose2, Twist, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters::{FieldError, Ranged};
use curionav_planning::random::{Rng, rng, standard_normal, uniform};
use curionav_planning::scene::Belief;
use curionav_planning::sensor::LaserModel;

use crate::clusters::Clusters;
use crate::estimate::{Estimate, Health};
use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;
use crate::particles::{Motion, Particles, normal};
use crate::recovery::{FreeSpace, Recovery, Search, draw_fitting};
use crate::resampling::{needed, systematic};
use crate::scan::{Scan, Selection};
use crate::scan_fit::ScanFit;
use crate::surfaces::Surfaces;
use crate::weighting::weigh;

/// Adaptive Monte Carlo localisation on one map with one laser.
pub struct Localizer {
    map: StaticMap,
    noise: OdometryNoise,
    params: LocalizerParams,
    seed: u64,
    field: LikelihoodField,
    free: FreeSpace,
    surfaces: Option<Surfaces>,

    particles: Particles,
    pose: Pose2,
    covariance: Matrix3<f64>,
    health: Health,
    recovery: Recovery,
    anchor: Option<Anchor>,
    /// With which share of `temper` the next scan may count, 0 to 1. Each scan from one place uses some of it up, and
    /// motion restores it.
    credit: f64,
    /// Random streams used so far: one per filter update, so that a run depends on the updates made
    /// and not on how many numbers each of them drew.
    streams: u64,
    updates_since_resampling: u32,

    clusters: Clusters,
    seen: Selection,
}

/// The last filter update: where odometry was then, and what was known. After a start there is none until the first
/// scan. That scan is taken in at once and in full.
#[derive(Debug, Clone, Copy)]
struct Anchor {
    odometry: Pose2,
    stamp: f64,
    pose: Pose2,
    covariance: Matrix3<f64>,
}

/// Most particles that one update replaces to search for a lost robot. Each of them takes `recovery_tournament` draws,
/// of which the likeliest is kept.
const SEARCH_LIMIT: f64 = 300.0;

/// An estimate with a greater deviation on its worst axis is not refined, metres.
const REFINED_SIGMA: f64 = 0.1;

/// Ticks a nanosecond early still count as a full interval.
const CLOCK_ROUNDING: f64 = 1e-9;

impl Localizer {
    /// A filter that knows nothing of the pose yet: particles all over the free cells. Call
    /// [`Self::initialise`] when the start is known.
    pub fn new(
        map: StaticMap,
        laser: LaserModel,
        noise: OdometryNoise,
        params: LocalizerParams,
        seed: u64,
    ) -> Result<Self, FieldError> {
        let mut localizer = Self::without_particles(map, laser, noise, params, seed)?;
        let most = localizer.params.particles_max;
        // The first stream.
        let mut random = rng(seed, 1);
        for _ in 0..most {
            let pose = localizer.free.draw(&localizer.map.grid, &mut random);
            localizer.particles.push(pose, 1.0 / most as f64);
        }
        localizer.describe(None);
        Ok(localizer)
    }

    /// The same filter, started around a known pose: [`Self::initialise`] without a search all over the map before.
    pub fn starting_at(
        map: StaticMap,
        laser: LaserModel,
        noise: OdometryNoise,
        params: LocalizerParams,
        seed: u64,
        start: (Pose2, &Matrix3<f64>),
    ) -> Result<Self, FieldError> {
        let mut localizer = Self::without_particles(map, laser, noise, params, seed)?;
        localizer.initialise(start.0, start.1);
        Ok(localizer)
    }

    fn without_particles(
        map: StaticMap,
        laser: LaserModel,
        noise: OdometryNoise,
        params: LocalizerParams,
        seed: u64,
    ) -> Result<Self, FieldError> {
        params.check()?;
        let most = params.particles_max;
        let surfaces = Surfaces::new(&map);
        Ok(Self {
            field: LikelihoodField::new(&surfaces, laser.range_max, &params),
            free: FreeSpace::new(&map.grid),
            surfaces: params.refine.then_some(surfaces),
            particles: Particles::default(),
            pose: Pose2::default(),
            covariance: Matrix3::zeros(),
            health: Health { outside_weight: 1.0, scan_fit: 1.0, particles: most, converged: false },
            recovery: Recovery::default(),
            anchor: None,
            credit: 1.0,
            // The first stream belongs to the particles that `new` draws all over the map.
            streams: 1,
            updates_since_resampling: 0,
            clusters: Clusters::default(),
            seen: Selection::default(),
            map,
            noise,
            params,
            seed,
        })
    }

    /// Starts over around a known pose.
    pub fn initialise(&mut self, pose: Pose2, covariance: &Matrix3<f64>) {
        let mut random = self.next_stream();
        self.particles = Particles::draw_gaussian(self.params.particles_max, pose, covariance, &mut random);
        self.recovery = Recovery::default();
        self.clusters = Clusters::default();
        self.anchor = None;
        self.credit = 1.0;
        self.updates_since_resampling = 0;
        self.health.scan_fit = 1.0;
        self.describe(None);
        self.pose = pose;
        self.covariance = *covariance;
    }

    /// Takes note that odometry now counts from another origin, as after a restart of the base. The leap between the
    /// two origins is no motion: the robot is taken to be where it was.
    pub fn restart_odometry(&mut self) {
        let Some(anchor) = self.anchor.take() else { return };
        // The estimate has moved on with odometry since the last filter update. The particles have not, so they do now.
        let motion = Motion::between(anchor.pose, self.pose, &self.noise);
        let mut random = self.next_stream();
        self.particles.advance(&motion, &self.noise, &mut random);
    }

    /// The covariance that the parameters state for a start.
    pub fn start_covariance(&self) -> Matrix3<f64> {
        self.params.start_covariance()
    }

    /// One tick: the robot's pose and twist by odometry (odometry frame), the time in seconds on the robot's
    /// clock, and the scan of the tick. Always answers; takes the scan in when the robot has moved or turned
    /// enough since the last one, or `update_max_interval` has passed (D7).
    pub fn update(&mut self, odometry: Pose2, twist: Twist, stamp: f64, scan: &Scan) -> Estimate {
        let before = self.pose;
        let due = self.dead_reckon(odometry, stamp);
        let has_moved = self.pose != before;
        let observed = due.is_some_and(|(motion, seconds)| {
            let observed = self.filter(&motion, seconds, scan);
            self.anchor = Some(Anchor { odometry, stamp, pose: self.pose, covariance: self.covariance });
            observed
        });
        // Otherwise the pose is the refined one still.
        if observed || has_moved {
            self.refine(scan);
        }
        Estimate { pose: self.pose, covariance: self.covariance, twist, health: self.health, observed }
    }

    /// Pose and weight of every particle as of the last tick. Between filter updates they go along with odometry, as
    /// the estimate does.
    pub fn particles(&self) -> impl ExactSizeIterator<Item = (Pose2, f64)> + '_ {
        let moved = self.anchor.map_or_else(Pose2::default, |anchor| anchor.pose.relative(self.pose));
        let Particles { x, y, heading, weight } = &self.particles;
        (0..weight.len()).map(move |i| (Pose2::new(x[i], y[i], heading[i]).compose(moved), weight[i]))
    }

    /// Moves the estimate of the last filter update along with odometry, its covariance by `A Sigma A' +
    /// M'`. When a filter update is due, returns the motion and the seconds since the last one.
    fn dead_reckon(&mut self, odometry: Pose2, stamp: f64) -> Option<(Motion, f64)> {
        let fresh = self.anchor.is_none();
        let now = Anchor { odometry, stamp, pose: self.pose, covariance: self.covariance };
        let anchor = *self.anchor.get_or_insert(now);
        let motion = Motion::between(anchor.odometry, odometry, &self.noise);
        if !motion.is_none() {
            self.pose = anchor.pose.compose(motion.displacement);
            let displacement = Point2::new(self.pose.x - anchor.pose.x, self.pose.y - anchor.pose.y);
            self.covariance =
                self.noise.propagate(&anchor.covariance, displacement, motion.travel, motion.turn);
        }
        let moved = (motion.travel / self.params.update_min_d).max(motion.turn / self.params.update_min_a);
        let waited = stamp - anchor.stamp;
        // A clock that steps back must not silence the filter.
        let patient = (0.0..self.params.update_max_interval - CLOCK_ROUNDING).contains(&waited);
        if !fresh && moved < 1.0 && patient {
            return None;
        }
        self.credit = (self.credit + moved).min(1.0);
        Some((motion, waited.max(0.0)))
    }

    /// One filter update after this motion and time; whether a scan was taken in.
    fn filter(&mut self, motion: &Motion, seconds: f64, scan: &Scan) -> bool {
        let mut random = self.next_stream();
        self.particles.advance(motion, &self.noise, &mut random);
        self.seen = Selection::of(scan, self.streams, &self.params);
        let observed = !self.seen.ends.is_empty();
        if observed {
            // Where the belief is wide or in several parts, some of its poses may have a wall before what was seen.
            // Then it also counts which beams would have had to pass through a wall.
            let ambiguous = self.health.outside_weight > 0.0 || !self.is_narrow();
            let params = &self.params;
            let exponent = params.temper * self.credit.max(params.rest_temper);
            let used = weigh(&mut self.particles, &self.field, &self.seen, exponent, ambiguous, params);
            self.credit = (self.credit - used / params.temper).max(0.0);
        }
        self.describe(observed.then_some(motion));
        if observed {
            self.check_fit(scan.laser.robot_from_laser, motion.travel, seconds);
        }
        self.updates_since_resampling += 1;
        if self.updates_since_resampling >= self.params.resample_interval {
            self.resample(observed, &mut random);
        }
        observed
    }

    /// Moves an estimate that is known well to where the scan fits best. Any other may lie nearer to the wrong wall.
    fn refine(&mut self, scan: &Scan<'_>) {
        let is_known = self.health.converged && self.position_sigma() <= REFINED_SIGMA;
        let surfaces = self.surfaces.as_ref().filter(|_| is_known);
        if let Some(pose) = surfaces.and_then(|it| it.refined(self.pose, &self.covariance, scan)) {
            self.pose = pose;
        }
    }

    fn is_narrow(&self) -> bool {
        self.position_sigma() <= self.params.converged_sigma
    }

    fn position_sigma(&self) -> f64 {
        let belief = Belief { pose: self.pose, covariance: self.covariance, twist: Twist::default() };
        belief.position_sigma()
    }

    fn check_fit(&mut self, laser: Pose2, metres: f64, seconds: f64) {
        let fit = ScanFit::of(&self.map, self.pose, laser, &self.seen.ends, self.params.agreement_distance);
        if let Some(share) = fit.share() {
            self.health.scan_fit = share;
            let evidence = (fit.agree + fit.through) as f64 / self.seen.looked_at as f64;
            self.recovery.observe(share, evidence, metres, seconds, &self.params);
        }
    }

    /// Sets estimate and health by the heaviest cluster of particles. `scanned` is given after a scan: the motion since
    /// the last one. Then a cluster beyond the reach of the estimate has to be the heaviest for several scans before it
    /// counts. Until then the heaviest one within reach counts. If there is none, the estimate only follows odometry.
    fn describe(&mut self, scanned: Option<&Motion>) {
        let Some(heaviest) = self.clusters.find(&self.particles, &self.params) else { return };
        let estimate = (self.pose, &self.covariance);
        let chosen = match scanned {
            Some(motion) => self.clusters.choose(&self.particles, heaviest, estimate, motion, &self.params),
            None => Some(heaviest),
        };
        if let Some((pose, covariance)) = chosen.and_then(|c| self.clusters.moments(&self.particles, c)) {
            self.pose = pose;
            self.covariance = covariance;
        }
        let inside = chosen.map_or(0.0, |c| self.clusters.weight(&self.particles, c));
        self.health.outside_weight = (1.0 - inside).clamp(0.0, 1.0);
        self.health.particles = self.particles.len();
        self.health.converged =
            self.is_narrow() && self.health.outside_weight <= self.params.converged_outside;
    }

    /// Draws a new set when the weights have become uneven, the belief needs more or far fewer particles,
    /// or the robot seems lost. Without a scan only growing makes sense: nothing was learnt.
    fn resample(&mut self, observed: bool, random: &mut Rng) {
        let n = self.particles.len();
        let start = uniform(random);
        let search = if observed { self.recovery.search(&self.params) } else { Search::Nowhere };
        let lost = if search == Search::Nowhere { 0.0 } else { self.recovery.share(&self.params) };
        let mut wanted = needed(&self.particles, start, &self.params);
        if lost > 0.0 {
            wanted = wanted.max(self.params.recovery_particles.min(self.params.particles_max));
        }
        let uneven = self.particles.effective_size() < self.params.resample_ess * n as f64;
        let resize = wanted > n + n / 4 || (observed && wanted < n / 2);
        if !(uneven || resize || lost > 0.0) {
            return;
        }
        self.updates_since_resampling = 0;
        let position = self.params.roughening_position;
        let heading = self.params.roughening_heading;
        let searching = (lost * wanted as f64).min(SEARCH_LIMIT) as usize;
        let weight = 1.0 / wanted as f64;
        let old = &self.particles;
        let mut new = Particles::default();
        systematic(&old.weight, wanted - searching, start, |i| {
            let pose = Pose2::new(
                old.x[i] + position * standard_normal(random),
                old.y[i] + position * standard_normal(random),
                wrap_angle(old.heading[i] + heading * standard_normal(random)),
            );
            new.push(pose, weight);
        });
        let mut around = self.start_covariance();
        if let Search::Around(width) = search {
            around[(0, 0)] *= width * width;
            around[(1, 1)] *= width * width;
        }
        for _ in 0..searching {
            let pose = draw_fitting(&self.field, &self.seen, &self.params, || match search {
                Search::Around(_) => normal(self.pose, &around, random),
                _ => self.free.draw(&self.map.grid, random),
            });
            new.push(pose, weight);
        }
        self.particles = new;
        self.health.particles = self.particles.len();
    }

    fn next_stream(&mut self) -> Rng {
        self.streams += 1;
        rng(self.seed, self.streams)
    }
}
