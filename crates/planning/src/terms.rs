//! The cost terms that are built in: what each takes from a profile, what it needs derived, how it is built.
//!
//! A new term is a file in [`crate::evaluation`], an implementation of [`BuiltIn`] in `terms/built_in.rs` with its name
//! in the list at the end of that file, and an entry under `[terms]` in a profile. Services, arbiter and command line
//! find it here. The example `own_term` is a term, complete.

mod built_in;
mod built_in_term;
mod derived_fields;
mod task;
mod term_params;

pub use built_in::{NAMES, columns, evaluator, is_local, visit};
pub use built_in_term::{Built, BuiltIn, Visitor};
pub use derived_fields::DerivedFields;
pub(crate) use derived_fields::ObstructedMap;
pub use task::Task;
pub use term_params::{CpcTermParams, InformationToGoTermParams};

#[cfg(test)]
mod tests;
