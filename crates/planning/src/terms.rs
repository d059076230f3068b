//! The cost terms that are built in: what each takes from a profile, what it needs derived, how it is built.
//!
//! A new term is a file in [`crate::evaluation`], an implementation of [`BuiltIn`] in `terms/built_in.rs` with its name
//! in the list at the end of that file, and an entry under `[terms]` in a profile. Services, arbiter and command line
//! find it here. The example `own_term` is a term, complete.

mod built_in;
mod task;
mod term_params;

use std::convert::Infallible;
use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::evaluation::Evaluator;
use crate::evaluation::cpc::{InformationField, InformationParams, RayField};
use crate::evaluation::information_to_go::InformationToGoField;
use crate::geometry::Point2;
use crate::occupancy::{GeodesicField, StaticMap};
use crate::parameters::Ranged;
use crate::profile::Profile;
use crate::sensor::LaserModel;
use crate::states::Columns;

pub use built_in::{NAMES, columns, evaluator, is_local, visit};
pub use task::Task;
pub use term_params::{CpcTermParams, InformationToGoTermParams};

/// What is derived from one map. An implementation may keep the fields between calls; [`StaticMap`] itself derives
/// them anew each time.
pub trait DerivedFields {
    /// Why there is no such field.
    type Error;

    /// The map with its distance fields.
    fn map(&self) -> Result<Arc<StaticMap>, Self::Error>;

    /// Distance to go to `goal` for a robot of `radius` metres that keeps [`GeodesicField::PLANNING_MARGIN`] from
    /// walls.
    fn geodesic(&self, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Self::Error>;

    /// What an observation of `laser` is worth, everywhere on the map.
    fn information(
        &self,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Self::Error>;

    /// The rays of which such an observation consists.
    fn rays(&self, laser: LaserModel, params: &InformationParams) -> Result<Arc<RayField>, Self::Error>;

    /// How much longer the way of `task` is for a robot that does not know where it is.
    fn information_to_go(
        &self,
        task: &Task,
        params: &InformationToGoTermParams,
    ) -> Result<Arc<InformationToGoField>, Self::Error>;
}

impl DerivedFields for Arc<StaticMap> {
    type Error = Infallible;

    fn map(&self) -> Result<Self, Infallible> {
        Ok(Self::clone(self))
    }

    fn geodesic(&self, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Infallible> {
        Ok(Arc::new(GeodesicField::new(self, goal, radius + GeodesicField::PLANNING_MARGIN)))
    }

    fn information(
        &self,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Infallible> {
        Ok(Arc::new(InformationField::new(self, &laser, params)))
    }

    fn rays(&self, laser: LaserModel, params: &InformationParams) -> Result<Arc<RayField>, Infallible> {
        self.information(laser, params).map(|of| Arc::new(RayField::new(&of, self, &laser, params)))
    }

    fn information_to_go(
        &self,
        task: &Task,
        params: &InformationToGoTermParams,
    ) -> Result<Arc<InformationToGoField>, Infallible> {
        let information = self.information(task.laser, &params.prediction.information)?;
        Ok(Arc::new(params.field(self, &information, task)))
    }
}

/// An evaluator, or why a field that it needs is missing.
pub type Built<E> = Result<Arc<dyn Evaluator>, E>;

/// A term that is built in.
pub trait BuiltIn {
    /// Its name in profiles and keys.
    const NAME: &'static str;

    /// Whether the arbiter always computes it itself: because that costs less than asking a replica, or because no
    /// service evaluates it.
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

#[cfg(test)]
mod tests;
