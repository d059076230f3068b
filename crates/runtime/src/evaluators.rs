//! The same evaluators in two homes: behind a service, and in the arbiter that falls back on itself.

use std::sync::Arc;

use curionav_planning::collision_risk::RiskParams;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::evaluation::cpc::{CpcEvaluator, CpcParams, InformationParams};
use curionav_planning::evaluation::distance::{DistanceEvaluator, DistanceMeasure};
use curionav_planning::evaluation::hccdm::{HccdmEvaluator, HccdmParams};
use curionav_planning::evaluation::risk::RiskEvaluator;
use curionav_planning::forecast::ForecastParams;
use curionav_planning::geometry::Point2;
use curionav_planning::profile::Profile;
use curionav_schemas::{EvaluateRequest, Reject, RejectCode, Value};
use serde::{Deserialize, Serialize};

use crate::convert;
use crate::fields::Fields;

/// Parameters of CPC as they travel with a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CpcRequestParams {
    cpc: CpcParams,
    information: InformationParams,
}

/// Parameters of the distance assessment as they travel with a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DistanceRequestParams {
    measure: DistanceMeasure,
}

/// Parameters of risk as they travel with a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RiskRequestParams {
    risk: RiskParams,
    forecast: ForecastParams,
}

/// Metrics that the arbiter evaluates itself: they cost less than asking somebody else would.
pub const AT_HOME: [&str; 2] = ["distance", "risk"];

/// The parameters `profile` gives for `metric`, as they travel with every request: all replicas then
/// compute the same, whatever they were started with.
pub fn parameters(profile: &Profile, metric: &str) -> Result<Value, Reject> {
    match metric {
        "cpc" => convert::to_value(&CpcRequestParams { cpc: profile.cpc, information: profile.information }),
        "cnc" => convert::to_value(&profile.hccdm),
        "distance" => convert::to_value(&DistanceRequestParams { measure: profile.distance }),
        "risk" => convert::to_value(&RiskRequestParams { risk: profile.risk, forecast: profile.forecast }),
        // A metric of somebody else's: its service knows its own parameters.
        _ => Ok(Value::Map(Vec::new())),
    }
}

/// The evaluator of `metric` for `request`, warmed: every field it needs is there when this returns.
pub fn evaluator(
    metric: &str,
    request: &EvaluateRequest,
    fields: &Fields,
) -> Result<Arc<dyn Evaluator>, Reject> {
    let goal = Point2::new(request.goal_x, request.goal_y);
    Ok(match metric {
        "cpc" => {
            let params: CpcRequestParams = convert::from_value("params", &request.params)?;
            let information =
                fields.information(request.map, convert::laser(&request.laser), &params.information)?;
            Arc::new(CpcEvaluator::new(information, convert::noise(&request.odometry_noise), params.cpc))
        }
        "cnc" => {
            let params: HccdmParams = convert::from_value("params", &request.params)?;
            Arc::new(HccdmEvaluator::new(params).map_err(|e| Reject::invalid("params", e.to_string()))?)
        }
        "distance" => {
            let params: DistanceRequestParams = convert::from_value("params", &request.params)?;
            if params.measure == DistanceMeasure::Euclid {
                return Ok(Arc::new(DistanceEvaluator::euclid(goal)));
            }
            let radius = convert::robot_model(&request.robot_model).radius();
            let geodesic = fields.geodesic(request.map, goal, radius)?;
            Arc::new(DistanceEvaluator::new(Arc::clone(&fields.map(request.map)?.grid), geodesic))
        }
        "risk" => {
            let params: RiskRequestParams = convert::from_value("params", &request.params)?;
            let radius = convert::robot_model(&request.robot_model).radius();
            let map = fields.map(request.map)?;
            Arc::new(RiskEvaluator::new(map, goal, radius, params.forecast, params.risk))
        }
        other => {
            let reason = format!("metric `{other}` is not built in; known: cnc, cpc, distance, risk");
            return Err(Reject::new(RejectCode::Unknown, reason));
        }
    })
}
