//! Parameter tables: typed structs on either side, a self-describing map on the wire.

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{Way, WayError};
use curionav_planning::parameters::{FieldError, Ranged, read_table};
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
    read_value(value).map_err(|fault| refusal(fault.below(field)))
}

/// A parameter struct from a map, by the rules of files: whole numbers are taken where a float is due, and what is
/// wrong is named by its field.
///
/// # Errors
/// The first fault, as a file with the same content would have it.
pub fn read_value<T: Ranged + DeserializeOwned>(value: &Value) -> Result<T, FieldError> {
    match value.deserialized::<T>() {
        Ok(parameters) => parameters.check().map(|()| parameters),
        Err(ciborium::value::Error::Custom(reason)) => match toml::Table::try_from(value) {
            Ok(table) => read_table(&table),
            Err(_) => Err(FieldError::new("", reason, "give what a file could hold")),
        },
    }
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
    way(order)?;
    Ok(())
}

/// The way that an order gives, if it does.
pub fn way(order: &MissionOrder) -> Result<Option<Way>, Reject> {
    let Some(numbers) = &order.way else { return Ok(None) };
    let points = numbers.chunks_exact(2).map(|point| Point2::new(point[0], point[1]));
    let way = Way::new(points.collect()).map_err(|error: WayError| Refusal::invalid(error).at("way"))?;
    Ok(Some(way))
}

#[cfg(test)]
mod tests {
    use curionav_planning::sensor::LaserModel;

    use super::*;

    fn laser(field: &str, value: Value) -> Result<LaserModel, FieldError> {
        read_value(&Value::Map(vec![(field.into(), value)]))
    }

    #[test]
    fn a_map_is_read_by_the_rules_of_files() {
        assert_eq!(laser("range_max", 6.into()).unwrap().range_max, 6.0);
        assert_eq!(laser("beams", 91.into()).unwrap().beams, 91);
        for (field, value, problem) in [
            ("beams", Value::Float(181.0), "invalid type: floating point `181.0`, expected u32"),
            ("range_max", "6".into(), "invalid type: string \"6\", expected f64"),
            ("range_max", Value::Float(-6.0), "is -6"),
            ("bems", 91.into(), "unknown field `bems`"),
        ] {
            let fault = laser(field, value).unwrap_err();
            assert!(fault.field == field && fault.problem.starts_with(problem), "{fault}");
        }
        let nothing = laser("beams", Value::Null).unwrap_err();
        assert!(nothing.field.is_empty() && !nothing.problem.is_empty(), "{nothing}");
    }
}
