//! That a localizer is not sure where its robot is, as its status says it.

use curionav_schemas::{Confidence, ServiceStatus, words};

/// How far this service's robot can be trusted to know its place, in words; nothing if it is sure.
pub(crate) fn doubt(status: &ServiceStatus) -> Option<String> {
    let sample = status.metrics.iter().find(|(sample, _)| sample.starts_with("curionav_belief_doubt{"));
    let doubts = [Confidence::Doubtful, Confidence::Lost];
    let confidence =
        doubts.into_iter().find(|doubt| sample.is_some_and(|(_, at)| *at == f64::from(*doubt as u8)));
    confidence.map(|confidence| words::say("confidence", &confidence))
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_robot_that_is_lost_is_said() {
        let mut status = golden::service_status();
        assert_eq!(doubt(&status), None);
        let sample = "curionav_belief_doubt{role=\"localizer\",name=\"a\",robot=\"r1\"}";
        for (level, said) in [(0.0, None), (2.0, Some("lost: the robot does not know where it is"))] {
            status.metrics.insert(sample.into(), level);
            assert_eq!(doubt(&status).as_deref(), said);
        }
    }
}
