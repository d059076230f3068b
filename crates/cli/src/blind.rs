//! That a driver takes its robot's laser for blind, as its status says it.

use curionav_schemas::{ServiceStatus, words};

use crate::denied::label;

/// Why this service keeps its robot standing as if blind, with the numbers; nothing if it does not.
pub(crate) fn blindness(status: &ServiceStatus) -> Option<String> {
    let sample = status.metrics.keys().find(|sample| sample.starts_with("curionav_blind{"))?;
    let reason = words::say("command_reason", &label(sample, "reason")?);
    let detail = label(sample, "detail").unwrap_or_default();
    Some(format!("{reason}: {detail}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_blind_laser_is_said_with_its_numbers() {
        let mut status = golden::service_status();
        assert_eq!(blindness(&status), None);
        let sample = "curionav_blind{role=\"driver\",name=\"a\",robot=\"r1\",reason=\"blind_silent\",\
                      detail=\"12 of 181 beams say anything, at least 91 are needed\"}";
        status.metrics.insert(sample.into(), 1.0);
        assert_eq!(
            blindness(&status).as_deref(),
            Some(
                "blind: too few beams of the scan say anything: 12 of 181 beams say anything, at least 91 are needed"
            )
        );
    }
}
