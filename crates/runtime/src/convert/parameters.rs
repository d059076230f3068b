//! Parameter tables: typed structs on either side, a self-describing map on the wire.

use curionav_schemas::{Reject, Value};
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A parameter struct as a map.
pub fn to_value<T: Serialize>(parameters: &T) -> Result<Value, Reject> {
    Value::serialized(parameters).map_err(|e| Reject::invalid("params", e.to_string()))
}

/// A parameter struct from a map; unknown and wrong fields are named.
pub fn from_value<T: DeserializeOwned>(field: &str, value: &Value) -> Result<T, Reject> {
    value.deserialized().map_err(|e| Reject::invalid(field, reason(&e)))
}

/// What the deserialiser says, without the name of its error type.
fn reason(error: &ciborium::value::Error) -> String {
    let ciborium::value::Error::Custom(reason) = error;
    reason.clone()
}
