//! The filter: one call per tick.

use nalgebra::Matrix3;

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters::{FieldError, Ranged};
use curionav_planning::random::{Rng, rng, uniform};
use curionav_planning::scene::Belief;
use curionav_planning::sensor::LaserModel;

use crate::branch_and_bound::Pyramid;
use crate::clusters::Clusters;
use crate::confidence::{Confidence, Elsewhere, MIXED_ABOVE, Trust};
use crate::estimate::{Estimate, Health};
use crate::hypotheses::{Hypotheses, Hypothesis, Observation, PARTICLES, is_near, shown};
use crate::likelihood_field::LikelihoodField;
use crate::params::LocalizerParams;
use crate::particles::{Motion, Particles};
use crate::recovery::{FreeSpace, Recovery};
use crate::relocalisation::{Found, Relocalisation, SearchPlan, Wish};
use crate::resampling::{needed, roughened, thinned};
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
    /// Where else the robot may be, as of the last filter update.
    elsewhere: Elsewhere,
    health: Health,
    recovery: Recovery,
    trust: Trust,
    /// Whether there is an estimate, or the particles lie all over the map still.
    is_placed: bool,
    /// Weight of the particles outside the cluster that the estimate describes.
    other_clusters: f64,
    hypotheses: Hypotheses,
    search: Option<Relocalisation>,
    search_plan: SearchPlan,
    /// How far the robot has yet to drive until a place that was found or kept is believed, metres: others are looked
    /// for meanwhile.
    unconfirmed: f64,
    /// When the last call was.
    ticked: Option<f64>,
    /// Made for the first search.
    pyramid: Option<Pyramid>,
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

/// A place that a search has found, or that was kept, is believed after so far, metres.
const CONFIRMED_AFTER_M: f64 = 6.0;

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
        let cluster = localizer.describe(None);
        localizer.judge_health(cluster);
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
            elsewhere: Elsewhere::default(),
            health: Health::without_estimate(most),
            recovery: Recovery::default(),
            trust: Trust::default(),
            is_placed: false,
            other_clusters: 1.0,
            hypotheses: Hypotheses::default(),
            search: None,
            search_plan: SearchPlan::default(),
            unconfirmed: CONFIRMED_AFTER_M,
            ticked: None,
            pyramid: None,
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
        self.trust = Trust::default();
        self.is_placed = true;
        self.hypotheses.clear();
        self.search = None;
        self.search_plan = SearchPlan::default();
        self.unconfirmed = 0.0;
        self.clusters = Clusters::default();
        self.anchor = None;
        self.credit = 1.0;
        self.updates_since_resampling = 0;
        self.health.scan_fit = 1.0;
        let cluster = self.describe(None);
        self.judge_health(cluster);
        self.pose = pose;
        self.covariance = *covariance;
    }

    /// Starts over around a pose that may be wrong: the estimate is in doubt until scans have confirmed it.
    pub fn resume(&mut self, pose: Pose2, covariance: &Matrix3<f64>) {
        self.initialise(pose, covariance);
        self.unconfirmed = CONFIRMED_AFTER_M;
        self.health.confidence = Confidence::Doubtful;
        self.health.converged = false;
    }

    /// Takes note that odometry now counts from another origin, as after a restart of the base. The leap between the
    /// two origins is no motion: the robot is taken to be where it was.
    pub fn restart_odometry(&mut self) {
        let Some(anchor) = self.anchor.take() else { return };
        // The estimate has moved on with odometry since the last filter update. The particles have not, so they do now.
        let motion = Motion::between(anchor.pose, self.pose, &self.noise);
        let mut random = self.next_stream();
        self.particles.advance(&motion, &self.noise, &mut random);
        self.hypotheses.advance(&motion, &self.noise, &mut random);
        self.search = None;
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
            let observed = self.filter(&motion, seconds, odometry, scan);
            self.anchor = Some(Anchor { odometry, stamp, pose: self.pose, covariance: self.covariance });
            observed
        });
        let ticked = self.ticked.replace(stamp);
        self.search_on(stamp - ticked.unwrap_or(stamp));
        // Otherwise the pose is the refined one still.
        if observed || has_moved {
            self.refine(scan);
        }
        let own = 1.0 - self.health.outside_weight;
        let covariance = self.elsewhere.covariance_about((self.pose, self.covariance), own);
        Estimate { pose: self.pose, covariance, twist, health: self.health, observed }
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
    fn filter(&mut self, motion: &Motion, seconds: f64, odometry: Pose2, scan: &Scan) -> bool {
        let mut random = self.next_stream();
        self.particles.advance(motion, &self.noise, &mut random);
        self.hypotheses.advance(motion, &self.noise, &mut random);
        self.search_plan.pass(shown(motion, &scan.laser), seconds);
        self.unconfirmed = (self.unconfirmed - motion.travel).max(0.0);
        self.seen = Selection::of(scan, self.streams, &self.params);
        let observed = !self.seen.ends.is_empty();
        if observed && self.is_placed {
            self.observe(motion, scan, &mut random);
        }
        let cluster = self.describe(observed.then_some(motion));
        if observed && self.is_placed {
            self.check_fit(scan.laser.robot_from_laser, motion.travel, seconds);
        }
        self.judge_health(cluster);
        if observed {
            self.consider_search(odometry, scan);
        }
        self.updates_since_resampling += 1;
        if self.is_placed && self.updates_since_resampling >= self.params.resample_interval {
            self.resample(observed, &mut random);
        }
        observed
    }

    /// Takes the selected beams into the belief, and compares it with the other places.
    fn observe(&mut self, motion: &Motion, scan: &Scan, random: &mut Rng) {
        // Where the belief is wide or in several parts, some of its poses may have a wall before what was seen.
        // Then it also counts which beams would have had to pass through a wall.
        let ambiguous = self.other_clusters > 0.0 || !self.is_narrow();
        let params = &self.params;
        let exponent = params.temper * self.credit.max(params.rest_temper);
        let observation = Observation { field: &self.field, scan, seen: &self.seen, exponent, params };
        let way = shown(motion, &scan.laser);
        let winner = self.hypotheses.judge(&observation, self.pose, way, random);
        let used = weigh(&mut self.particles, &self.field, &self.seen, exponent, ambiguous, params);
        self.credit = (self.credit - used / params.temper).max(0.0);
        if let Some(winner) = winner {
            self.succeed(winner);
        }
    }

    /// Another place has explained the scans better, so it becomes the estimate.
    fn succeed(&mut self, winner: Hypothesis) {
        let former = Hypothesis::of_estimate(thinned(&self.particles, PARTICLES), self.pose, self.covariance);
        self.hypotheses.succeed(&winner, former);
        self.place(winner);
    }

    fn place(&mut self, at: Hypothesis) {
        self.pose = at.pose;
        self.covariance = at.covariance;
        self.particles = at.particles;
        self.clusters = Clusters::default();
        self.is_placed = true;
        self.unconfirmed = CONFIRMED_AFTER_M;
    }

    /// Begins to look for other places, where the estimate is in doubt or has not been checked for long.
    fn consider_search(&mut self, odometry: Pose2, scan: &Scan) {
        if self.search.is_some() {
            return;
        }
        let doubted_metres = self.recovery.doubted_metres(&self.params);
        // An estimate that a search has found lately is judged as any other place.
        let is_lost = self.health.confidence == Confidence::Lost
            && self.unconfirmed == 0.0
            && self.trust.awaits_search();
        let doubted_metres = doubted_metres.or((self.unconfirmed > 0.0 || is_lost).then_some(0.0));
        let wish = match self.is_placed {
            true => self.search_plan.next(doubted_metres, is_lost, self.pose, &self.params),
            false => Some(Wish::ANYWHERE),
        };
        let Some(wish) = wish else { return };
        self.search = Relocalisation::begin(scan, odometry, wish, self.map.grid.resolution(), &self.params);
    }

    /// Goes on with a search as so many seconds have passed, and takes up what it has found.
    fn search_on(&mut self, seconds: f64) {
        let Some(search) = &mut self.search else { return };
        let pyramid = self.pyramid.get_or_insert_with(|| Pyramid::new(&self.field, &self.map.grid));
        if !search.advance(pyramid, &self.map.grid, seconds) {
            return;
        }
        let Some(search) = self.search.take() else { return };
        let found = search.found(&self.field, &self.params);
        if found.is_everywhere {
            self.trust.has_searched_everywhere();
        }
        self.take_up(&found);
    }

    fn take_up(&mut self, found: &Found) {
        let Some(anchor) = &self.anchor else { return };
        // The particles are those of the last filter update.
        let moved = found.odometry.relative(anchor.odometry);
        let poses: Vec<Pose2> = found.poses.iter().map(|pose| pose.compose(moved)).collect();
        let mut random = self.next_stream();
        let Some((best, others)) = poses.split_first() else { return };
        if self.is_placed {
            let estimate = self.anchor.map_or(self.pose, |anchor| anchor.pose);
            self.hypotheses.add(&poses, found.odds, |pose| is_near(pose, estimate), &mut random);
            return;
        }
        self.hypotheses.add(others, found.odds, |pose| is_near(pose, *best), &mut random);
        self.place(Hypothesis::found_at(*best, 0.0, &mut random));
        if let Some(anchor) = &mut self.anchor {
            anchor.pose = self.pose;
            anchor.covariance = self.covariance;
        }
    }

    /// Moves an estimate that is known well to where the scan fits best. Any other may lie nearer to the wrong wall.
    fn refine(&mut self, scan: &Scan<'_>) {
        let is_known = self.is_converged() && self.position_sigma() <= REFINED_SIGMA;
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
            self.trust.observe(share, evidence, seconds, self.recovery.usual_fit());
        }
    }

    /// Sets the estimate by the heaviest cluster of particles, and returns that. `scanned` is given after a scan: the
    /// motion since the last one. Then a cluster beyond the reach of the estimate has to be the heaviest for several
    /// scans before it counts. Until then the heaviest one within reach counts. If there is none, the estimate only
    /// follows odometry.
    fn describe(&mut self, scanned: Option<&Motion>) -> Option<u32> {
        let heaviest = self.clusters.find(&self.particles, &self.params)?;
        let estimate = (self.pose, &self.covariance);
        let chosen = match scanned {
            Some(motion) => self.clusters.choose(&self.particles, heaviest, estimate, motion, &self.params),
            None => Some(heaviest),
        };
        let cell = self.map.grid.resolution();
        let moments = chosen.and_then(|cluster| self.clusters.moments(&self.particles, cluster, cell));
        if let Some((pose, covariance)) = moments {
            self.pose = pose;
            self.covariance = covariance;
        }
        let inside = chosen.map_or(0.0, |c| self.clusters.weight(&self.particles, c));
        self.other_clusters = (1.0 - inside).clamp(0.0, 1.0);
        chosen
    }

    /// Says how far the estimate, which describes this cluster, can be trusted, and where else the robot may be.
    fn judge_health(&mut self, cluster: Option<u32>) {
        let other_places = 1.0 - self.followed();
        let nowhere_known = self.trust.elsewhere();
        let followed = (1.0 - other_places) * (1.0 - nowhere_known);
        self.health.outside_weight = (1.0 - followed).clamp(0.0, 1.0);
        self.health.particles = self.particles.len();
        let judged = self.trust.judge(self.health.outside_weight);
        self.health.confidence = match self.is_placed {
            true if self.unconfirmed > 0.0 => judged.max(Confidence::Doubtful),
            true => judged,
            false => Confidence::Lost,
        };
        self.health.converged = self.is_converged() && self.health.confidence == Confidence::Sure;
        let share = self.hypotheses.share();
        self.elsewhere.clear();
        if self.health.outside_weight <= MIXED_ABOVE && self.is_placed {
            return;
        }
        self.elsewhere.add(nowhere_known, self.free.anywhere());
        if let Some(best) = self.hypotheses.best() {
            self.elsewhere.add((1.0 - nowhere_known) * share, (best.pose, best.covariance));
        }
        if let Some(others) = self.clusters.moments_outside(&self.particles, cluster) {
            self.elsewhere.add((1.0 - nowhere_known) * (1.0 - share) * self.other_clusters, others);
        }
    }

    /// The weight of the estimate among the places that are followed.
    fn followed(&self) -> f64 {
        (1.0 - self.other_clusters) * (1.0 - self.hypotheses.share())
    }

    /// Whether the estimate is narrow, and of all places that are followed the one.
    fn is_converged(&self) -> bool {
        self.is_narrow() && 1.0 - self.followed() <= self.params.converged_outside && self.unconfirmed == 0.0
    }

    /// Draws a new set when the weights have become uneven or the belief needs more or far fewer particles. Without a
    /// scan only growing makes sense: nothing was learnt.
    fn resample(&mut self, observed: bool, random: &mut Rng) {
        let n = self.particles.len();
        let start = uniform(random);
        let wanted = needed(&self.particles, start, &self.params);
        let uneven = self.particles.effective_size() < self.params.resample_ess * n as f64;
        let resize = wanted > n + n / 4 || (observed && wanted < n / 2);
        if !(uneven || resize) {
            return;
        }
        self.updates_since_resampling = 0;
        self.particles = roughened(&self.particles, wanted, start, &self.params, random);
        self.health.particles = self.particles.len();
    }

    fn next_stream(&mut self) -> Rng {
        self.streams += 1;
        rng(self.seed, self.streams)
    }
}
