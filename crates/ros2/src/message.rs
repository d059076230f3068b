//! A type that is sent by itself.

use crate::cdr::{Cdr, CdrError, from_bytes, to_bytes};
use crate::interface::Interface;

/// A message, or the request or response of a service.
pub trait Message: Cdr {
    /// Its name in ROS, such as `sensor_msgs/msg/LaserScan`.
    const NAME: &'static str;
    /// What stands in keys: of a request or response that of the service.
    const INTERFACE: Interface;
    /// Bytes of a payload at most; a longer one is refused before it is read.
    const MAX_BYTES: usize;

    /// The payload: encapsulation and content, little-endian.
    ///
    /// # Errors
    /// If a text, a sequence or the whole is longer than its limit; then nothing may be sent.
    fn encode(&self) -> Result<Vec<u8>, CdrError> {
        to_bytes(self, Self::MAX_BYTES)
    }

    /// The message in a payload, of either byte order.
    ///
    /// # Errors
    /// If it is none.
    fn decode(payload: &[u8]) -> Result<Self, CdrError> {
        from_bytes(payload, Self::MAX_BYTES)
    }
}
