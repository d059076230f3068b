//! Reading parameter structs from TOML.

use serde::de::DeserializeOwned;

use super::error::FieldError;
use super::ranged::Ranged;

/// Reads and checks a file. Errors name line and field.
pub fn read<T: Ranged + DeserializeOwned>(text: &str) -> Result<T, FieldError> {
    let value: T = toml::from_str(text).map_err(|e| FieldError::from_syntax(&e, text, T::FIELDS))?;
    value.check().map_err(|e| e.located_in(text))?;
    Ok(value)
}

/// Reads and checks a table that has been part of a file. Errors name the field, by its path within the table.
pub fn read_table<T: Ranged + DeserializeOwned>(table: &toml::Table) -> Result<T, FieldError> {
    // Only a text tells where a value of the wrong kind is.
    read(&table.to_string()).map_err(|e| FieldError { line: None, ..e })
}
