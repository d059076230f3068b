//! The gateway's publishers to ROS, except those of velocities and of actions.

use curionav_planning::geometry::Pose2;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use curionav_schemas::{Belief, CycleReport, Decision};

use crate::config::{Frames, Ros2Config};
use crate::drawing::{self, header};
use crate::node::{Node, Outlet};

/// For how long a transform from map to odometry holds, nanoseconds: it is stamped so much later, as AMCL does, so that
/// who looks up where the robot is now need not wait for the next belief. Beliefs come with odometry, and the robot
/// stands before that is silent for so long.
const HOLDS_NS: i64 = 300_000_000;

/// The gateway's publishers.
pub(crate) struct Publishers {
    frames: Frames,
    /// Unless the robot localises itself.
    amcl_pose: Option<Outlet<ros::PoseWithCovarianceStamped>>,
    tf: Option<Outlet<ros::TfMessage>>,
    plan: Outlet<ros::Path>,
    candidates: Outlet<ros::MarkerArray>,
    crowd: Outlet<ros::MarkerArray>,
    diagnostics: Outlet<ros::DiagnosticArray>,
}

impl Publishers {
    /// Declares them all.
    ///
    /// # Errors
    /// If one cannot be declared.
    pub(crate) fn new(node: &Node, config: &Ros2Config) -> anyhow::Result<Self> {
        let topics = &config.topics;
        Ok(Self {
            frames: config.frames.clone(),
            amcl_pose: (!config.is_controller())
                .then(|| node.outlet(&topics.amcl_pose, Qos::LATCHED))
                .transpose()?,
            tf: config.publish_tf.then(|| node.outlet(&topics.tf, Qos::DEFAULT)).transpose()?,
            plan: node.outlet(config.plan(), Qos::LATCHED)?,
            candidates: node.outlet(&topics.candidates, Qos::DEFAULT)?,
            crowd: node.outlet(&topics.crowd, Qos::DEFAULT)?,
            diagnostics: node.outlet(&topics.diagnostics, Qos::DEFAULT)?,
        })
    }

    /// Where the robot believes it is at `stamp`, when odometry says `odometry`.
    pub(crate) fn belief(&self, belief: &Belief, odometry: Pose2, stamp: ros::Time) {
        if let Some(amcl_pose) = &self.amcl_pose {
            amcl_pose.put(&drawing::believed(belief, header(stamp, &self.frames.map)));
        }
        if let Some(tf) = &self.tf {
            let at = drawing::map_from_odom(belief, odometry);
            let until = ros::Time::from_nanoseconds(stamp.nanoseconds() + HOLDS_NS);
            tf.put(&drawing::transform(header(until, &self.frames.map), &self.frames.odom, at));
        }
    }

    /// What the robot will drive.
    pub(crate) fn plan(&self, decision: &Decision, stamp: ros::Time) {
        self.plan.put(&drawing::path(decision, header(stamp, &self.frames.map)));
    }

    /// That the robot will drive nowhere.
    pub(crate) fn no_plan(&self, stamp: ros::Time) {
        self.plan.put(&ros::Path { header: header(stamp, &self.frames.map), poses: Vec::new() });
    }

    /// Whether something wants to see what a cycle's report shows.
    pub(crate) fn wants_reports(&self) -> bool {
        self.candidates.is_heard() || self.crowd.is_heard()
    }

    /// What a cycle has weighed.
    pub(crate) fn report(&self, report: &CycleReport, stamp: ros::Time) {
        let header = header(stamp, &self.frames.map);
        if self.candidates.is_heard() {
            self.candidates.put(&drawing::candidates(report, &header));
        }
        if self.crowd.is_heard() {
            self.crowd.put(&drawing::crowd(report, &header));
        }
    }

    /// How the robot is.
    pub(crate) fn diagnostics(&self, status: Vec<ros::DiagnosticStatus>, stamp: ros::Time) {
        self.diagnostics.put(&ros::DiagnosticArray { header: header(stamp, ""), status });
    }
}
