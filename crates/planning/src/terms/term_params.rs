//! Parameters of terms that look a field up, with those of the field.

use super::task::Task;
use crate::evaluation::cpc::{CpcParams, InformationField, InformationParams};
use crate::evaluation::information_to_go::{InformationToGoField, InformationToGoParams};
use crate::occupancy::StaticMap;
use crate::parameters::Range;
use crate::profile::UncertaintySwitch;

crate::parameters! {
    /// Parameters of [`CpcEvaluator`](crate::evaluation::cpc::CpcEvaluator) and of the field it looks up.
    #[derive(Copy)]
    pub struct CpcTermParams {
        /// When observations are credited.
        pub cpc: CpcParams [table],
        /// What they are worth.
        pub information: InformationParams [table],
    }
}

crate::parameters! {
    /// Parameters of
    /// [`InformationToGoEvaluator`](crate::evaluation::information_to_go::InformationToGoEvaluator) and of the field it
    /// looks up.
    #[derive(Copy)]
    pub struct InformationToGoTermParams {
        /// What counts as uncertain.
        pub uncertainty: UncertaintySwitch [table],
        /// Error of position with which the robot still counts as being at the goal, metres.
        pub tolerance: f64 [in Range::GOAL_TOLERANCE],
        /// What predicts how uncertain the robot will be.
        pub prediction: CpcTermParams [table],
        /// What that costs.
        pub information_to_go: InformationToGoParams [table],
    }
}

impl InformationToGoTermParams {
    /// The field, from the information field of the same map and laser.
    pub fn field(&self, map: &StaticMap, seen: &InformationField, task: &Task) -> InformationToGoField {
        let way = (task.goal, self.tolerance, task.robot.radius());
        let threshold = self.uncertainty.threshold;
        InformationToGoField::new(map, seen, way, &task.noise, threshold, &self.information_to_go)
    }
}
