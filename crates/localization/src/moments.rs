//! Mean and covariance of poses.

use nalgebra::{Matrix3, Vector3};

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::numerics::{atan2, sin_cos};

use crate::particles::Particles;

/// Weighted mean and covariance of the particles for which `belongs` holds. The heading's mean is the
/// direction of the mean unit vector, and deviations of heading are taken the short way round, so
/// that the cross terms with position are right too. None when they carry no weight.
pub(crate) fn moments(
    particles: &Particles,
    belongs: impl Fn(usize) -> bool,
) -> Option<(Pose2, Matrix3<f64>)> {
    let (mut total, mut x, mut y, mut c, mut s) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for i in (0..particles.len()).filter(|&i| belongs(i)) {
        let w = particles.weight[i];
        let (sin, cos) = sin_cos(particles.heading[i]);
        total += w;
        x += w * particles.x[i];
        y += w * particles.y[i];
        c += w * cos;
        s += w * sin;
    }
    if total <= 0.0 {
        return None;
    }
    let mean = Pose2::new(x / total, y / total, atan2(s, c));
    let (mut xx, mut xy, mut xa, mut yy, mut ya, mut aa) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for i in (0..particles.len()).filter(|&i| belongs(i)) {
        let w = particles.weight[i] / total;
        let (dx, dy) = (particles.x[i] - mean.x, particles.y[i] - mean.y);
        let da = wrap_angle(particles.heading[i] - mean.heading);
        xx += w * dx * dx;
        xy += w * dx * dy;
        xa += w * dx * da;
        yy += w * dy * dy;
        ya += w * dy * da;
        aa += w * da * da;
    }
    Some((mean, Matrix3::new(xx, xy, xa, xy, yy, ya, xa, ya, aa)))
}

/// `A Sigma A' + M'`: the covariance after a displacement of (dx, dy) metres in the map frame (eq. 7). A
/// heading error swings the displacement around.
pub(crate) fn propagate(
    covariance: &Matrix3<f64>,
    displacement: Vector3<f64>,
    process: &Matrix3<f64>,
) -> Matrix3<f64> {
    let a = Matrix3::new(1.0, 0.0, -displacement.y, 0.0, 1.0, displacement.x, 0.0, 0.0, 1.0);
    a * covariance * a.transpose() + process
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_on_both_sides_of_pi_average_to_pi() {
        let mut p = Particles::default();
        p.push(Pose2::new(0.0, 0.0, 3.1), 0.5);
        p.push(Pose2::new(2.0, 0.0, -3.1), 0.5);
        let (mean, covariance) = moments(&p, |_| true).unwrap();
        let off = std::f64::consts::PI - 3.1;
        assert!((wrap_angle(mean.heading - std::f64::consts::PI)).abs() < 1e-12);
        assert!((mean.x - 1.0).abs() < 1e-12);
        assert!((covariance[(0, 0)] - 1.0).abs() < 1e-12);
        assert!((covariance[(2, 2)] - off * off).abs() < 1e-12);
        // x grows while the heading passes pi counter-clockwise
        assert!((covariance[(0, 2)] - off).abs() < 1e-12);
        assert!(moments(&p, |_| false).is_none());
    }
}
