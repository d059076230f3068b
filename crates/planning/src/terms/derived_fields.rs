//! What evaluators and generators look up instead of computing it.

use std::convert::Infallible;
use std::sync::Arc;

use super::task::Task;
use super::term_params::InformationToGoTermParams;
use crate::evaluation::cpc::{InformationField, InformationParams, RayField};
use crate::evaluation::information_to_go::InformationToGoField;
use crate::geometry::Point2;
use crate::occupancy::{CoarseFloor, GeodesicField, Obstacles, StaticMap};
use crate::sensor::LaserModel;

/// What is derived from one map. An implementation may keep the fields between calls; [`StaticMap`] itself derives
/// them anew each time.
pub trait DerivedFields {
    /// Why there is no such field.
    type Error;

    /// What stands on the map that it does not have.
    fn obstacles(&self) -> Obstacles {
        Obstacles::default()
    }

    /// The map with its distance fields, obstacles included.
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

/// A map with obstacles on it; its fields are derived anew each time, as those of [`StaticMap`] are.
pub(crate) struct ObstructedMap {
    pub(crate) map: Arc<StaticMap>,
    pub(crate) obstacles: Obstacles,
}

impl DerivedFields for ObstructedMap {
    type Error = Infallible;

    fn obstacles(&self) -> Obstacles {
        self.obstacles.clone()
    }

    fn map(&self) -> Result<Arc<StaticMap>, Infallible> {
        Ok(Arc::new(self.map.with_obstacles(&self.obstacles)))
    }

    fn geodesic(&self, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Infallible> {
        let floor = CoarseFloor::new(&self.map, radius + GeodesicField::PLANNING_MARGIN);
        let obstructed = self.map()?;
        Ok(Arc::new(floor.past(&self.map, &obstructed, &self.obstacles, goal)))
    }

    fn information(
        &self,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Infallible> {
        self.map.information(laser, params)
    }

    fn rays(&self, laser: LaserModel, params: &InformationParams) -> Result<Arc<RayField>, Infallible> {
        self.map.rays(laser, params)
    }

    fn information_to_go(
        &self,
        task: &Task,
        params: &InformationToGoTermParams,
    ) -> Result<Arc<InformationToGoField>, Infallible> {
        self.map.information_to_go(task, params)
    }
}
