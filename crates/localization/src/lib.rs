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
//! (`resampling`). Other places where the robot may be are looked for (`relocalisation`, `branch_and_bound`) and
//! followed (`hypotheses`) beside the filter.
//!
//! Where it differs from ROS `amcl`, and why:
//!
//! - Odometry noise is a variance per metre and radian (D6), so it does not depend on the update rate.
//! - Beams multiply (`likelihood_field_prob`), and the product is tempered until a normalised-error test holds.
//! - Mean and covariance are those of the heaviest cluster (D9); other places show in [`Health`] only.
//! - One occupied histogram bin asks for the least number of particles, not the greatest.
//! - The filter answers every call and updates at rest (D7).
//! - No random poses are mixed into the belief. Where a map explains real scans badly, they take over tracks that are
//!   right. Another place takes over when it has explained the scans along some metres better than the estimate has.
//!
//! And for crowds:
//!
//! - Beams that met one narrow thing, which may be a person, speak together and only as loud as the odds of a person
//!   allow. ROS skips beams with which most of the belief disagrees, which in a wide belief is no sign of a person.
//! - While the belief is ambiguous, poses from which the beams would have had to pass through walls are held against
//!   that, since no person can explain it.
//! - The estimate jumps to another cluster only when that has held its own over several scans on the move.

mod branch_and_bound;
mod clusters;
mod confidence;
mod estimate;
mod histogram;
mod hypotheses;
mod likelihood_field;
mod localizer;
mod params;
mod particles;
mod recovery;
mod refine;
mod relocalisation;
mod resampling;
mod scan;
mod scan_fit;
mod surfaces;
mod weighting;

pub use confidence::Confidence;
pub use estimate::{Estimate, Health};
pub use localizer::Localizer;
pub use params::{LaserLikelihood, LocalizerParams};
pub use refine::ScanMatcher;
pub use scan::Scan;
