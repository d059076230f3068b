//! Pure adaptive Monte Carlo localisation (AMCL): where the robot is on a known map, from odometry and
//! a planar laser, as a pose with an honest covariance.
//!
//! No I/O, no clock, no global randomness: stamps and the seed are arguments, so a run replays bit for
//! bit. Poses are in the map frame unless a name says otherwise; units are SI and radians.
//!
//! Read [`Localizer`] first; it strings together, in the order of one filter update: the motion model
//! (`particles`), the beams and the pieces they make (`scan`), the likelihood field
//! (`likelihood_field`), weighting with tempering (`weighting`), clusters and their moments (`histogram`,
//! `clusters`), the check for being lost (`scan_fit`, `recovery`), and KLD-adaptive resampling
//! (`resampling`).
//!
//! Where it differs from ROS `amcl`, and why: odometry noise is a variance per metre and radian (D6), so
//! it does not depend on the update rate; beams multiply (`likelihood_field_prob`) and the product is
//! tempered until a normalised-error test holds; mean and covariance are those of the heaviest cluster
//! (D9), recovery particles show in [`Health`] only; one occupied histogram bin asks for the least
//! number of particles, not the greatest; the filter answers every call and updates at rest (D7).
//!
//! And for crowds: beams that met one narrow thing, which may be a person, speak together and only as
//! loud as the odds of a person allow, instead of being skipped when most of the belief disagrees, which
//! in a wide belief is no sign of a person; while the belief is ambiguous, poses from which the beams would
//! have had to pass through walls are held against that, since no person can explain it; a lasting
//! contradiction makes the filter look around the estimate first and all over the map last; and the
//! estimate jumps to another cluster only when that has held its own over several scans on the move.

mod clusters;
mod estimate;
mod histogram;
mod likelihood_field;
mod localizer;
mod params;
mod particles;
mod recovery;
mod refine;
mod resampling;
mod scan;
mod scan_fit;
mod surfaces;
mod weighting;

pub use estimate::{Estimate, Health};
pub use localizer::Localizer;
pub use params::{LaserLikelihood, LocalizerParams};
pub use scan::Scan;
