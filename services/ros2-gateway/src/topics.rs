//! Names of topics, services and actions: the table `[ros2.topics]` of the gateway's configuration file.

use curionav_planning::parameters::Ranged;

/// What mends an empty name.
pub(crate) const NAME: &str = "give a name, or leave the field out";

curionav_planning::parameters! {
    /// Names of topics. One that does not begin with a slash lies within the namespace.
    pub struct Topics {
        /// The laser (`sensor_msgs/LaserScan`).
        pub scan: String [name, NAME] = "scan".to_owned(),
        /// Dead reckoning (`nav_msgs/Odometry`); each message is one tick.
        pub odom: String [name, NAME] = "odom".to_owned(),
        /// Moving frames (`tf2_msgs/TFMessage`).
        pub tf: String [name, NAME] = "tf".to_owned(),
        /// Frames that stay where they are.
        pub tf_static: String [name, NAME] = "tf_static".to_owned(),
        /// The map (`nav_msgs/OccupancyGrid`, transient local).
        pub map: String [name, NAME] = "map".to_owned(),
        /// People (`people_msgs/People`).
        pub people: String [name, NAME] = "people".to_owned(),
        /// Where to go (`geometry_msgs/PoseStamped`), as rviz sends it.
        pub goal_pose: String [name, NAME] = "goal_pose".to_owned(),
        /// Where the robot is (`geometry_msgs/PoseWithCovarianceStamped`), as rviz sends it.
        pub initialpose: String [name, NAME] = "initialpose".to_owned(),
        /// The action for one goal (`nav2_msgs/NavigateToPose`).
        pub navigate_to_pose: String [name, NAME] = "navigate_to_pose".to_owned(),
        /// The action for a way through poses (`nav2_msgs/NavigateThroughPoses`).
        pub navigate_through_poses: String [name, NAME] = "navigate_through_poses".to_owned(),
        /// The action for a tour with a stop at each waypoint (`nav2_msgs/FollowWaypoints`).
        pub follow_waypoints: String [name, NAME] = "follow_waypoints".to_owned(),
        /// The action for a path that Nav2 has found (`nav2_msgs/FollowPath`).
        pub follow_path: String [name, NAME] = "follow_path".to_owned(),
        /// The action for a path that is not driven (`nav2_msgs/ComputePathToPose`).
        pub compute_path_to_pose: String [name, NAME] = "compute_path_to_pose".to_owned(),
        /// The same through poses (`nav2_msgs/ComputePathThroughPoses`).
        pub compute_path_through_poses: String [name, NAME] = "compute_path_through_poses".to_owned(),
        /// Velocities for the base.
        pub cmd_vel: String [name, NAME] = "cmd_vel".to_owned(),
        /// Where the robot believes it is (`geometry_msgs/PoseWithCovarianceStamped`).
        pub amcl_pose: String [name, NAME] = "amcl_pose".to_owned(),
        /// What it will drive (`nav_msgs/Path`, transient local).
        pub plan: String [name, NAME] = "plan".to_owned(),
        /// What it will drive, in the mode `controller`, where `plan` is that of Nav2's planner.
        pub local_plan: String [name, NAME] = "local_plan".to_owned(),
        /// How fast it may drive (`nav2_msgs/SpeedLimit`).
        pub speed_limit: String [name, NAME] = "speed_limit".to_owned(),
        /// What it could drive (`visualization_msgs/MarkerArray`), while something subscribes.
        pub candidates: String [name, NAME] = "curionav/candidates".to_owned(),
        /// Where it sees people and crowds (`visualization_msgs/MarkerArray`), while something subscribes.
        pub crowd: String [name, NAME] = "curionav/crowd".to_owned(),
        /// Service that pauses the robot (`std_srvs/srv/Trigger`).
        pub stop: String [name, NAME] = "curionav/stop".to_owned(),
        /// Service that lets a paused robot go on (`std_srvs/srv/Trigger`).
        pub resume: String [name, NAME] = "curionav/resume".to_owned(),
        /// How it is (`diagnostic_msgs/DiagnosticArray`).
        pub diagnostics: String [name, NAME] = "/diagnostics".to_owned(),
        /// The time of a simulation (`rosgraph_msgs/Clock`), with `use_sim_time`.
        pub clock: String [name, NAME] = "/clock".to_owned(),
    }
}

impl Topics {
    /// All of them with the names of their fields.
    pub fn named(&self) -> Vec<(&'static str, &str)> {
        let values = [
            &self.scan,
            &self.odom,
            &self.tf,
            &self.tf_static,
            &self.map,
            &self.people,
            &self.goal_pose,
            &self.initialpose,
            &self.navigate_to_pose,
            &self.navigate_through_poses,
            &self.follow_waypoints,
            &self.follow_path,
            &self.compute_path_to_pose,
            &self.compute_path_through_poses,
            &self.cmd_vel,
            &self.amcl_pose,
            &self.plan,
            &self.local_plan,
            &self.speed_limit,
            &self.candidates,
            &self.crowd,
            &self.stop,
            &self.resume,
            &self.diagnostics,
            &self.clock,
        ];
        Self::FIELDS.iter().map(|field| field.name).zip(values.map(String::as_str)).collect()
    }
}
