//! The robot is paused, or let go on, by a service of ROS.

use std::time::Duration;

use curionav_ros2::messages as ros;
use curionav_runtime::command::{Commander, Halted};
use curionav_runtime::lease::BaseLease;
use curionav_schemas::PauseRequest;

use crate::node::Request;

/// How long a client waits for the driver.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Pauses the robot or lets it go on: this base at once, and then every driver, whose answers are awaited beside
/// everything else. `asked` is answered with success once the driver that holds the lease has obeyed, too.
pub(crate) fn pause(commander: Commander, lease: &BaseLease, paused: bool, asked: Request) {
    lease.pause(PauseRequest { paused }, commander.by());
    tokio::spawn(async move {
        let obeyed = commander.pause(paused, TIMEOUT).await;
        let success = obeyed.as_ref().is_ok_and(Halted::is_complete);
        let message = match (success, paused) {
            (true, true) => "paused",
            (true, false) => "goes on",
            (false, _) => "the base has obeyed; the driver that holds its lease does not answer",
        };
        asked.reply(&ros::TriggerResponse { success, message: message.to_owned() });
    });
}
