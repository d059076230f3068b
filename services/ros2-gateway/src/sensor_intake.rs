//! What further sensors say, read by a task for each: a large cloud holds up nothing else.

use curionav_ros2::interface::Distribution;
use curionav_ros2::message::Message;
use curionav_ros2::messages as ros;
use curionav_ros2::qos::Qos;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use crate::config::Ros2Config;
use crate::costmap::Costmap;
use crate::fault::Fault;
use crate::node::{Intake, Node};
use crate::sensor_config::SensorKind;

/// Messages that are read and wait: what is older than the newest few is of no use.
const WAITING: usize = 2;

/// What a further sensor has said.
pub(crate) enum Said {
    /// Points of a camera.
    Cloud(ros::PointCloud2),
    /// A scan.
    Scan(ros::LaserScan),
    /// A distance.
    Range(ros::Range),
    /// Whether a bumper is pressed.
    Bumper(ros::Bool),
    /// A costmap as it is now, or what is wrong with a change of it.
    Costmap(Result<ros::OccupancyGrid, Fault>),
}

/// What all of them say, each with its place in the configuration.
pub(crate) struct SensorIntake {
    said: mpsc::Receiver<(usize, Said)>,
    /// Without sensors nothing is ever said, and that is no end.
    _sender: mpsc::Sender<(usize, Said)>,
    _tasks: JoinSet<()>,
}

impl SensorIntake {
    /// Subscribes to the topics of all.
    ///
    /// # Errors
    /// If one cannot be declared.
    pub(crate) fn new(node: &Node, config: &Ros2Config) -> anyhow::Result<Self> {
        let (sender, said) = mpsc::channel(WAITING);
        let mut tasks = JoinSet::new();
        for (index, sensor) in config.sensors.iter().enumerate() {
            let to = To { index, sender: sender.clone() };
            let topic = &sensor.topic;
            match sensor.kind {
                SensorKind::Cloud => {
                    drop(tasks.spawn(to.pass_on(node.intake(topic, Qos::SENSOR)?, Said::Cloud)))
                }
                SensorKind::Scan => {
                    drop(tasks.spawn(to.pass_on(node.intake(topic, Qos::SENSOR)?, Said::Scan)))
                }
                SensorKind::Bumper => {
                    drop(tasks.spawn(to.pass_on(node.intake(topic, Qos::SENSOR)?, Said::Bumper)))
                }
                SensorKind::Costmap => {
                    let whole = node.intake(topic, Qos::LATCHED)?;
                    let updates = node.intake(&sensor.updates(), Qos::LATCHED)?;
                    drop(tasks.spawn(to.keep_up(whole, updates)));
                }
                SensorKind::Range if config.distribution() == Distribution::Humble => {
                    let intake = node.intake(topic, Qos::SENSOR)?;
                    drop(tasks.spawn(to.pass_on(intake, |said: ros::RangeHumble| Said::Range(said.into()))));
                }
                SensorKind::Range => {
                    drop(tasks.spawn(to.pass_on(node.intake(topic, Qos::SENSOR)?, Said::Range)))
                }
            }
        }
        Ok(Self { said, _sender: sender, _tasks: tasks })
    }

    /// What one of them says next. Cancel-safe.
    pub(crate) async fn next(&mut self) -> Option<(usize, Said)> {
        self.said.recv().await
    }
}

/// Where a task puts what it has read.
struct To {
    index: usize,
    sender: mpsc::Sender<(usize, Said)>,
}

impl To {
    /// Passes on a costmap as often as it or a part of it comes, until nothing more can.
    async fn keep_up(self, whole: Intake<ros::OccupancyGrid>, updates: Intake<ros::OccupancyGridUpdate>) {
        let mut kept = Costmap::default();
        loop {
            let costmap = tokio::select! {
                biased;
                Some(costmap) = whole.next() => Ok(kept.replace(costmap)),
                Some(update) = updates.next() => kept.update(update),
                else => return,
            };
            if self.sender.send((self.index, Said::Costmap(costmap))).await.is_err() {
                return;
            }
        }
    }

    /// Passes on what comes until nothing more can.
    async fn pass_on<M: Message>(self, intake: Intake<M>, said: fn(M) -> Said) {
        while let Some(message) = intake.next().await {
            if self.sender.send((self.index, said(message))).await.is_err() {
                return;
            }
        }
    }
}
