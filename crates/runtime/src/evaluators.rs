//! The same evaluators in two homes: behind a service, and in the arbiter that falls back on itself.

use std::sync::Arc;

use curionav_planning::evaluation::{
    CpcEvaluator, CpcParams, DistanceEvaluator, Evaluator, HccdmEvaluator, HccdmParams,
};
use curionav_planning::forecast::ForecastParams;
use curionav_planning::geometry::Point2;
use curionav_planning::profile::Profile;
use curionav_schemas::{EvaluateRequest, Reject, RejectCode, Value};
use serde::{Deserialize, Serialize};

use crate::convert;
use crate::fields::Fields;

/// Parameters of CNC as they travel with a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CncParams {
    /// The crowd density map.
    pub hccdm: HccdmParams,
    /// How people move on.
    pub forecast: ForecastParams,
}

/// The parameters `profile` gives for `metric`, as they travel with every request: all replicas then
/// compute the same, whatever they were started with.
pub fn parameters(profile: &Profile, metric: &str) -> Result<Value, Reject> {
    match metric {
        "cpc" => convert::to_value(&profile.cpc),
        "cnc" => convert::to_value(&CncParams { hccdm: profile.hccdm.clone(), forecast: profile.forecast }),
        // A metric of somebody else's: its service knows its own parameters.
        _ => Ok(Value::Map(Vec::new())),
    }
}

/// The evaluator of `metric` for `request`, warmed: every field it needs is there when this returns.
pub fn evaluator(metric: &str, request: &EvaluateRequest, fields: &Fields) -> Result<Arc<dyn Evaluator>, Reject> {
    let goal = Point2::new(request.goal_x, request.goal_y);
    Ok(match metric {
        "cpc" => {
            let params: CpcParams = convert::from_value("params", &request.params)?;
            let information = fields.information(request.map, convert::laser(&request.laser), &params.information)?;
            Arc::new(CpcEvaluator::new(information, convert::noise(&request.odometry_noise), params))
        }
        "cnc" => {
            let params: CncParams = convert::from_value("params", &request.params)?;
            Arc::new(HccdmEvaluator::new(params.hccdm, params.forecast))
        }
        "distance" => {
            let radius = convert::robot_model(&request.robot_model).radius();
            let geodesic = fields.geodesic(request.map, goal, radius)?;
            Arc::new(DistanceEvaluator::new(Arc::clone(&fields.map(request.map)?.grid), geodesic))
        }
        other => {
            let reason = format!("metric `{other}` is not built in; known: cnc, cpc, distance");
            return Err(Reject::new(RejectCode::Unknown, reason));
        }
    })
}
