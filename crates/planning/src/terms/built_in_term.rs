//! What a term says of itself to be built in.

use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::derived_fields::DerivedFields;
use super::task::Task;
use crate::evaluation::Evaluator;
use crate::parameters::Ranged;
use crate::profile::Profile;
use crate::states::Columns;

/// An evaluator, or why a field that it needs is missing.
pub type Built<E> = Result<Arc<dyn Evaluator>, E>;

/// A term that is built in.
pub trait BuiltIn {
    /// Its name in profiles and keys.
    const NAME: &'static str;

    /// Whether the arbiter always computes it itself: because that costs less than asking a replica, because no service
    /// evaluates it, or because it reads what obstacles change, the map or the way to the goal.
    const LOCAL: bool = false;

    /// What it reads of a candidate: a question to a replica carries this and no more.
    const COLUMNS: Columns = Columns::ALL;

    /// Everything of a profile that it depends on, as it travels with every request: all replicas then compute the
    /// same, whatever they were started with.
    type Params: Ranged + Serialize + DeserializeOwned;

    /// Its parameters in `profile`.
    fn params(profile: &Profile) -> Self::Params;

    /// Its evaluator. Every field that it needs is there when this returns.
    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error>;
}

/// Something to do with a term whose type is known only by its name.
pub trait Visitor {
    /// What comes of it.
    type Output;

    /// Does it with `T`.
    fn visit<T: BuiltIn>(self) -> Self::Output;
}
