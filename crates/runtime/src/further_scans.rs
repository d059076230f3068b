//! The newest scans of a robot's further sensors: second scanners, depth cameras, rangers and bumpers.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use curionav_schemas::limits::MAX_SENSORS;
use curionav_schemas::{Message, Refusal, Reject, Scan, keys};
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::locked::locked;
use crate::serve::ServeCounts;
use crate::topic::{Refusing, TopicError};

/// By sensor the newest message, until it is read. A name stays, so that no more sensors than allowed are kept.
type Arrived = BTreeMap<String, Option<Vec<u8>>>;

/// Follows the sensors of one robot, by their names.
pub struct FurtherScans {
    _subscriber: Subscriber<()>,
    arrived: Arc<Mutex<Arrived>>,
    refusing: Refusing,
    newest: BTreeMap<String, Scan>,
}

impl FurtherScans {
    /// Subscribes to `key`, in which `*` stands for the name; what is refused is added to `counts`.
    pub(crate) fn new(session: &Session, key: &str, counts: &Arc<ServeCounts>) -> Result<Self, TopicError> {
        let refusing = Refusing::new(key, counts);
        let arrived = Arc::<Mutex<Arrived>>::default();
        let taking = (Arc::clone(&arrived), refusing.clone());
        let subscriber = session
            .declare_subscriber(key.to_owned())
            .callback(move |sample| {
                let (arrived, refusing) = &taking;
                if let Err(reject) = keep(&mut locked(arrived), &sample) {
                    refusing.refuse(&reject);
                }
            })
            .wait()
            .map_err(TopicError::on(key))?;
        Ok(Self { _subscriber: subscriber, arrived, refusing, newest: BTreeMap::new() })
    }

    /// The newest scan of each sensor, however old it is.
    pub fn newest(&mut self) -> &BTreeMap<String, Scan> {
        for (sensor, message) in locked(&self.arrived).iter_mut() {
            let Some(bytes) = message.take() else { continue };
            match Scan::decode(&bytes, None) {
                Ok(scan) => drop(self.newest.insert(sensor.clone(), scan)),
                Err(reject) => self.refusing.refuse(&reject),
            }
        }
        &self.newest
    }

    /// Forgets all: with a new run, or a base that has started over, ticks start at 0 again.
    pub fn clear(&mut self) {
        locked(&self.arrived).clear();
        self.newest.clear();
    }
}

/// Keeps a message as the newest of its sensor, if it may be one.
fn keep(arrived: &mut Arrived, sample: &Sample) -> Result<(), Reject> {
    let payload = sample.payload();
    Scan::admit(payload.len(), Some(&sample.encoding().to_string()))?;
    let sensor = keys::sensor(sample.key_expr().as_str());
    let sensor =
        sensor.ok_or_else(|| Refusal::invalid("the last chunk of its key is no name of a sensor"))?;
    let room = room_for(arrived, sensor)?;
    // A copy, because the bytes received hold on to the whole batch that they came in.
    *room = Some(payload.to_bytes().into_owned());
    Ok(())
}

/// Where the newest message of a sensor is kept.
fn room_for<'a>(arrived: &'a mut Arrived, sensor: &str) -> Result<&'a mut Option<Vec<u8>>, Reject> {
    if !arrived.contains_key(sensor) && arrived.len() >= MAX_SENSORS {
        let found = arrived.len() as u64 + 1;
        return Err(Refusal::TooMany { found, most: MAX_SENSORS as u64 }.at("sensors"));
    }
    Ok(arrived.entry(sensor.to_owned()).or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_sensors_are_kept_than_a_robot_may_have() {
        let mut arrived = Arrived::new();
        for sensor in 0..MAX_SENSORS {
            *room_for(&mut arrived, &format!("s{sensor}")).unwrap() = Some(vec![0]);
        }
        let reject = room_for(&mut arrived, "another").unwrap_err().to_string();
        assert!(reject.starts_with("sensors: "), "{reject}");
        assert!(room_for(&mut arrived, "s3").is_ok(), "one that is known speaks on");
    }
}
