//! Parameter tables: typed structs on either side, a self-describing map on the wire.

use curionav_planning::parameters::{FieldError, Ranged};
use curionav_schemas::{MissionOrder, Refusal, Reject, Value};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A parameter struct as a map.
pub fn to_value<T: Serialize>(parameters: &T) -> Result<Value, Reject> {
    Value::serialized(parameters).map_err(|e| Refusal::invalid(e).at("params"))
}

/// A parameter struct from a map; unknown and wrong fields are named.
pub fn from_value<T: DeserializeOwned>(field: &str, value: &Value) -> Result<T, Reject> {
    // Without the name of the error's type.
    value.deserialized().map_err(|ciborium::value::Error::Custom(reason)| Refusal::invalid(reason).at(field))
}

/// A parameter struct from a map, every number of it within its range.
pub fn parameters<T: Ranged + DeserializeOwned>(field: &str, value: &Value) -> Result<T, Reject> {
    checked(field, from_value(field, value)?)
}

/// A value that came in a message, if its numbers are within their ranges.
pub fn checked<T: Ranged>(field: &str, value: T) -> Result<T, Reject> {
    value.check().map_err(|fault| refusal(fault.below(field)))?;
    Ok(value)
}

/// What is said about a fault to the asker, who knows no file.
pub fn refusal(fault: FieldError) -> Reject {
    Refusal::invalid(format!("{}; {}", fault.problem, fault.mend)).at(fault.field)
}

/// Refuses an order whose robot, laser or odometry no service can work with.
pub fn check_order(order: &MissionOrder) -> Result<(), Reject> {
    checked("robot_model", super::robot_model(&order.robot_model))?;
    checked("laser", super::laser(&order.laser))?;
    checked("odometry_noise", super::noise(&order.odometry_noise))?;
    Ok(())
}
