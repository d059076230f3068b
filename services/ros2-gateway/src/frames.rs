//! Frames and where they are in each other.

use std::collections::BTreeMap;

use curionav_planning::geometry::Pose2;
use curionav_planning::numerics::atan2;
use curionav_ros2::limits::TRANSFORMS;
use curionav_ros2::messages::{Pose, Quaternion, TfMessage};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::fault::Fault;

/// Frames between two that are joined by transforms: more than a robot with arms has.
const CHAIN_MAX: usize = 64;
/// A quaternion whose length is farther from 1 than this is no rotation.
const LENGTH_SLACK: f64 = 0.01;
/// Cosine of how far a frame may lean that counts as upright: eight degrees.
const UPRIGHT: f64 = 0.99;
/// Largest coordinate that means anything, m.
const FAR: f64 = 1e6;

/// A rotation.
///
/// # Errors
/// If the numbers are none.
pub(crate) fn rotation(q: Quaternion) -> Result<UnitQuaternion<f64>, Fault> {
    let q = nalgebra::Quaternion::new(q.w, q.x, q.y, q.z);
    if (q.norm() - 1.0).abs() > LENGTH_SLACK || !q.norm().is_finite() {
        return Err(Fault::malformed(format!("a rotation of length {} is none; its length is 1", q.norm())));
    }
    Ok(UnitQuaternion::from_quaternion(q))
}

/// A place and rotation.
///
/// # Errors
/// If the numbers are none.
pub(crate) fn isometry(place: [f64; 3], turned: Quaternion) -> Result<Isometry3<f64>, Fault> {
    if place.iter().any(|number| !number.is_finite() || number.abs() > FAR) {
        return Err(Fault::malformed(format!("{place:?} is no place")));
    }
    let [x, y, z] = place;
    Ok(Isometry3::from_parts(Translation3::new(x, y, z), rotation(turned)?))
}

/// A pose of ROS in the plane: upright frames alone have one.
///
/// # Errors
/// If the numbers are none, or the frame leans.
pub(crate) fn planar(pose: &Pose) -> Result<Pose2, Fault> {
    let p = pose.position;
    let isometry = isometry([p.x, p.y, p.z], pose.orientation)?;
    match Mount::of(&isometry) {
        Some(Mount { pose, is_upside_down: false }) => Ok(pose),
        _ => Err(Fault::unusable("the pose does not lie in the plane")),
    }
}

/// How something is mounted on the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mount {
    /// Where, seen from above.
    pub(crate) pose: Pose2,
    /// Whether its z axis points down, so that what it calls counter-clockwise is clockwise.
    pub(crate) is_upside_down: bool,
}

impl Mount {
    /// Of a frame at this pose; nothing if it leans.
    pub(crate) fn of(isometry: &Isometry3<f64>) -> Option<Self> {
        let turned = isometry.rotation.to_rotation_matrix();
        let up = turned[(2, 2)];
        let place = isometry.translation;
        let heading = atan2(turned[(1, 0)], turned[(0, 0)]);
        let pose = Pose2::new(place.x, place.y, heading);
        (up.abs() > UPRIGHT).then_some(Self { pose, is_upside_down: up < 0.0 })
    }
}

/// The frames of one robot, as far as transforms have been told.
#[derive(Debug, Default)]
pub(crate) struct FrameTree {
    /// By child: its parent, and its pose there.
    parents: BTreeMap<String, (String, Isometry3<f64>)>,
}

impl FrameTree {
    /// Takes note of transforms. Those of `localized`, which localisation moves, are not of interest.
    ///
    /// # Errors
    /// The first that is none, or for which there is no room; the others are taken.
    pub(crate) fn take_in(&mut self, message: &TfMessage, localized: &str) -> Result<(), Fault> {
        let mut outcome = Ok(());
        for one in &message.transforms {
            let child = &one.child_frame_id;
            let parent = &one.header.frame_id;
            if child == localized {
                continue;
            }
            let t = one.transform.translation;
            let taken = isometry([t.x, t.y, t.z], one.transform.rotation).and_then(|pose| {
                if !self.parents.contains_key(child) && self.parents.len() >= TRANSFORMS {
                    return Err(Fault::unusable(format!("there are more than {TRANSFORMS} frames")));
                }
                self.parents.insert(child.clone(), (parent.clone(), pose));
                Ok(())
            });
            outcome = outcome.and(taken);
        }
        outcome
    }

    /// The frame and those that it lies in, each with the pose of the frame there.
    fn ancestors<'a>(&'a self, frame: &'a str) -> Vec<(&'a str, Isometry3<f64>)> {
        let mut chain = vec![(frame, Isometry3::identity())];
        while let Some((parent, pose)) = chain.last().and_then(|(name, _)| self.parents.get(*name)) {
            if chain.len() > CHAIN_MAX {
                break;
            }
            let below = chain.last().map_or_else(Isometry3::identity, |(_, below)| *below);
            chain.push((parent, pose * below));
        }
        chain
    }

    /// The pose of `frame` in `of`; nothing if no transforms join them.
    pub(crate) fn pose_in(&self, of: &str, frame: &str) -> Option<Isometry3<f64>> {
        let to = self.ancestors(of);
        let from = self.ancestors(frame);
        from.iter().find_map(|(common, common_from_frame)| {
            let (_, common_from_of) = to.iter().find(|(name, _)| name == common)?;
            Some(common_from_of.inverse() * common_from_frame)
        })
    }
}

#[cfg(test)]
mod tests {
    use curionav_ros2::messages::{Header, Transform, TransformStamped, Vector3};
    use nalgebra::Vector3 as V;

    use super::*;

    const LEVEL: Quaternion = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

    fn transform(parent: &str, child: &str, x: f64, rotation: Quaternion) -> TransformStamped {
        TransformStamped {
            header: Header { frame_id: parent.into(), ..Header::default() },
            child_frame_id: child.into(),
            transform: Transform { translation: Vector3 { x, y: 0.0, z: 0.3 }, rotation },
        }
    }

    fn tree(transforms: Vec<TransformStamped>) -> (FrameTree, Result<(), Fault>) {
        let mut tree = FrameTree::default();
        let outcome = tree.take_in(&TfMessage { transforms }, "odom");
        (tree, outcome)
    }

    #[test]
    fn a_mount_is_found_through_several_frames_in_either_direction() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let left = Quaternion { z: half, w: half, ..Quaternion::default() };
        let (tree, outcome) = tree(vec![
            transform("base_footprint", "base_link", 0.0, LEVEL),
            transform("base_link", "mast", 0.1, left),
            transform("mast", "laser", 0.2, LEVEL),
        ]);
        assert_eq!(outcome, Ok(()));
        let mount = Mount::of(&tree.pose_in("base_link", "laser").unwrap()).unwrap();
        // 0.1 ahead, then 0.2 along the mast's x, which points to the left.
        let expected = Pose2::new(0.1, 0.2, std::f64::consts::FRAC_PI_2);
        assert!(mount.pose.position().distance(expected.position()) < 1e-12 && !mount.is_upside_down);
        assert!((mount.pose.heading - expected.heading).abs() < 1e-12);
        let back = tree.pose_in("laser", "base_footprint").unwrap()
            * tree.pose_in("base_footprint", "laser").unwrap();
        assert!(back.translation.vector.norm() < 1e-12);
        assert!(tree.pose_in("base_link", "camera").is_none() && tree.pose_in("map", "laser").is_none());
    }

    #[test]
    fn a_laser_may_hang_but_not_lean() {
        let rolled = |angle| Mount::of(&Isometry3::new(V::zeros(), V::x() * angle));
        assert!(!rolled(0.05).unwrap().is_upside_down);
        assert!(rolled(std::f64::consts::PI).unwrap().is_upside_down);
        assert!(rolled(0.5).is_none());
    }

    #[test]
    fn what_is_no_transform_is_refused_and_the_others_count() {
        let nothing = Quaternion::default();
        let (tree, outcome) = tree(vec![
            transform("base_link", "laser", 0.0, nothing),
            transform("base_link", "camera", 1.0, LEVEL),
        ]);
        assert!(outcome.is_err());
        assert!(
            tree.pose_in("base_link", "laser").is_none() && tree.pose_in("base_link", "camera").is_some()
        );
        assert!(
            isometry([f64::NAN, 0.0, 0.0], LEVEL).is_err() && isometry([1e300, 0.0, 0.0], LEVEL).is_err()
        );
    }

    #[test]
    fn a_circle_of_frames_ends() {
        let (tree, _) = tree(vec![transform("a", "b", 0.0, LEVEL), transform("b", "a", 0.0, LEVEL)]);
        assert!(tree.pose_in("c", "a").is_none());
        let mut full = FrameTree::default();
        for i in 0..2 * TRANSFORMS {
            let _ = full
                .take_in(&TfMessage { transforms: vec![transform("a", &i.to_string(), 0.0, LEVEL)] }, "odom");
        }
        assert_eq!(full.parents.len(), TRANSFORMS);
    }
}
