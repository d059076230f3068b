//! The last sure belief in a file, so that a localizer that is started again in mid-run goes on from there.

use std::path::PathBuf;

use curionav_planning::geometry::Pose2;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::kept_pose::KeptPose;
use curionav_schemas::{Belief, Confidence, Mission, Odometry, Pose};
use tokio::task::JoinHandle;

/// Between two writes, seconds of the robot's clock: so far a robot drives that loses its power.
const PERIOD: f64 = 1.0;
/// A robot that has moved less has not moved, metres and radians.
const MOVED: f64 = 0.02;

/// Keeps the belief of one robot in a file.
pub(crate) struct Keeper {
    path: PathBuf,
    last: Option<(KeptPose, f64)>,
    writing: Option<JoinHandle<()>>,
}

impl Keeper {
    /// For a localizer of this configuration, if it names a file.
    pub(crate) fn new(config: &ServiceConfig) -> Option<Self> {
        config.kept_pose().map(|path| Self { path, last: None, writing: None })
    }

    /// The pose that was kept in this run, if any.
    pub(crate) fn of_run(&self, mission: &Mission) -> Option<KeptPose> {
        let kept = match KeptPose::read(&self.path) {
            Ok(kept) => kept?,
            Err(error) => {
                tracing::warn!(%error, "the kept pose is not used");
                return None;
            }
        };
        let order = &mission.order;
        (kept.robot == order.robot && kept.map == order.map.to_string() && kept.run == mission.run)
            .then_some(kept)
    }

    /// Keeps a belief if it is sure, and the robot has moved since the last one. The file is written aside: a slow disk
    /// delays no belief.
    pub(crate) fn keep(&mut self, mission: &Mission, odometry: &Odometry, belief: &Belief) {
        let is_writing = self.writing.as_ref().is_some_and(|task| !task.is_finished());
        if is_writing || belief.health.confidence != Confidence::Sure {
            return;
        }
        let next = KeptPose {
            robot: mission.order.robot.clone(),
            map: mission.order.map.to_string(),
            run: mission.run,
            tick: odometry.tick,
            odometry: Pose { x: odometry.x, y: odometry.y, heading: odometry.heading },
            pose: Pose { x: belief.x, y: belief.y, heading: belief.heading },
        };
        let is_new = self.last.as_ref().is_none_or(|(last, at)| {
            let is_due = !(0.0..PERIOD).contains(&(belief.stamp - at));
            is_due && (last.run != next.run || has_moved(last.pose, next.pose))
        });
        if !is_new {
            return;
        }
        self.last = Some((next.clone(), belief.stamp));
        let path = self.path.clone();
        self.writing = Some(tokio::task::spawn_blocking(move || {
            if let Err(error) = next.write(&path) {
                tracing::warn!(path = %path.display(), %error, "the pose is not kept");
            }
        }));
    }
}

fn has_moved(from: Pose, to: Pose) -> bool {
    let from: Pose2 = convert::pose(from);
    let moved = from.relative(convert::pose(to));
    moved.position().distance(Default::default()) >= MOVED || moved.heading.abs() >= MOVED
}

/// Where a robot is now that was at a kept pose: what odometry has measured since, unless the base was started again.
pub(crate) fn moved_since(kept: &KeptPose, odometry: &Odometry) -> Pose2 {
    let then = convert::pose(kept.odometry);
    let now = Pose2::new(odometry.x, odometry.y, odometry.heading);
    let driven = if odometry.tick >= kept.tick { then.relative(now) } else { Pose2::default() };
    convert::pose(kept.pose).compose(driven)
}

#[cfg(test)]
mod tests {
    use curionav_schemas::Pose;
    use curionav_testing::golden;

    use super::*;

    fn kept() -> KeptPose {
        let order = golden::mission().order;
        let odometry = Pose { x: 2.0, y: 0.0, heading: 0.0 };
        let pose = Pose { x: 5.0, y: 5.0, heading: std::f64::consts::FRAC_PI_2 };
        KeptPose { robot: order.robot, map: order.map.to_string(), run: 1, tick: 50, odometry, pose }
    }

    #[test]
    fn what_was_driven_since_is_added_unless_the_base_began_anew() {
        let odometry = Odometry { tick: 60, x: 3.0, y: 0.0, heading: 0.0, ..golden::odometry() };
        let now = moved_since(&kept(), &odometry);
        assert!(
            now.position().distance(curionav_planning::geometry::Point2::new(5.0, 6.0)) < 1e-12,
            "{now:?}"
        );
        let anew = Odometry { tick: 3, ..odometry };
        assert_eq!(moved_since(&kept(), &anew), convert::pose(kept().pose));
    }

    #[tokio::test]
    async fn only_a_sure_belief_of_a_robot_that_has_moved_is_kept_and_only_for_its_run() {
        let folder = tempfile::tempdir().unwrap();
        let keep_pose = Some(folder.path().join("pose.json"));
        let mut keeper = Keeper::new(&ServiceConfig { keep_pose, ..ServiceConfig::default() }).unwrap();
        let mission = golden::mission();
        let odometry = golden::odometry();
        let mut belief = golden::belief();
        belief.health.confidence = Confidence::Doubtful;
        let mut at = async |belief: &Belief| {
            keeper.keep(&mission, &odometry, belief);
            if let Some(writing) = keeper.writing.take() {
                writing.await.unwrap();
            }
            keeper.of_run(&mission).map(|kept| kept.pose.x)
        };
        assert_eq!(at(&belief).await, None);
        belief.health.confidence = Confidence::Sure;
        let x = belief.x;
        assert_eq!(at(&belief).await, Some(x));
        (belief.x, belief.stamp) = (x + 0.5, belief.stamp + 0.5);
        assert_eq!(at(&belief).await, Some(x), "too soon");
        belief.stamp += 0.6;
        assert_eq!(at(&belief).await, Some(x + 0.5));
        let other = Mission { run: mission.run + 1, ..mission.clone() };
        assert_eq!(keeper.of_run(&other), None);
    }
}
