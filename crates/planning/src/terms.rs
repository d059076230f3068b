//! The cost terms that are built in: what each takes from a profile, what it needs derived, how it is built.
//!
//! A new term is a file in [`crate::evaluation`], an implementation of [`BuiltIn`] here with its line in the list
//! at the end of this file, and an entry under `[terms]` in a profile. Services, arbiter and command line find
//! it here. The example `own_term` is a term, complete.

use std::convert::Infallible;
use std::sync::Arc;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::collision_risk::RiskParams;
use crate::evaluation::Evaluator;
use crate::evaluation::collision_risk::CollisionRiskEvaluator;
use crate::evaluation::cpc::{
    CpcEvaluator, CpcOccludedEvaluator, CpcParams, InformationField, InformationParams, RayField,
};
use crate::evaluation::distance::{DistanceEvaluator, DistanceMeasure};
use crate::evaluation::hccdm::{HccdmEvaluator, HccdmParams};
use crate::evaluation::human_space::{DopplerEvaluator, HumanSpaceEvaluator, HumanSpaceParams};
use crate::evaluation::information_to_go::{
    InformationToGoEvaluator, InformationToGoField, InformationToGoParams,
};
use crate::evaluation::order::OrderEvaluator;
use crate::evaluation::risk::RiskEvaluator;
use crate::evaluation::uncertainty::UncertaintyEvaluator;
use crate::forecast::ForecastParams;
use crate::geometry::Point2;
use crate::motion::{OdometryNoise, RobotModel};
use crate::occupancy::{GeodesicField, StaticMap};
use crate::parameters::{Field, FieldError, Range, Ranged};
use crate::profile::{Profile, UncertaintySwitch};
use crate::sensor::LaserModel;
use crate::states::Columns;

/// What stays the same from one cycle of a mission to the next, apart from map and parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    /// Where to go, map frame.
    pub goal: Point2,
    /// What the base can do.
    pub robot: RobotModel,
    /// What the localiser sees with.
    pub laser: LaserModel,
    /// What odometry misses.
    pub noise: OdometryNoise,
}

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

/// Why there is no evaluator.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BuildError<E> {
    /// No term of that name is built in.
    #[error("the term is not built in; known: {}", NAMES.join(", "))]
    Unknown,
    /// A field that it needs is missing.
    #[error("{0}")]
    Field(E),
}

/// An evaluator, or why there is none.
pub type Built<E> = Result<Arc<dyn Evaluator>, BuildError<E>>;

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

crate::parameters! {
    /// Parameters of [`CpcEvaluator`] and of the field it looks up.
    #[derive(Copy)]
    pub struct CpcTermParams {
        /// When observations are credited.
        pub cpc: CpcParams [table],
        /// What they are worth.
        pub information: InformationParams [table],
    }
}

crate::parameters! {
    /// Parameters of [`InformationToGoEvaluator`] and of the field it looks up.
    #[derive(Copy)]
    pub struct InformationToGoTermParams {
        /// What counts as uncertain.
        pub uncertainty: UncertaintySwitch [table],
        /// Error of position with which the robot still counts as being at the goal, metres.
        pub tolerance: f64 [in Range::GOAL_TOLERANCE],
        /// What predicts how uncertain the robot will be.
        pub prediction: CpcTermParams [table],
        /// What that costs.
        pub information_to_go: InformationToGoParams [table],
    }
}

impl InformationToGoTermParams {
    /// The field, from the information field of the same map and laser.
    pub fn field(&self, map: &StaticMap, seen: &InformationField, task: &Task) -> InformationToGoField {
        let way = (task.goal, self.tolerance, task.robot.radius());
        let threshold = self.uncertainty.threshold;
        InformationToGoField::new(map, seen, way, &task.noise, threshold, &self.information_to_go)
    }
}

enum InformationToGo {}

impl BuiltIn for InformationToGo {
    const NAME: &'static str = "information-to-go";
    const LOCAL: bool = true;
    type Params = InformationToGoTermParams;

    fn params(profile: &Profile) -> Self::Params {
        InformationToGoTermParams {
            uncertainty: profile.uncertainty,
            tolerance: profile.goal.tolerance,
            prediction: CpcTermParams::of(profile),
            information_to_go: profile.information_to_go,
        }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let cpc = params.prediction.prediction(task, fields).map_err(BuildError::Field)?;
        let field = fields.information_to_go(task, &params).map_err(BuildError::Field)?;
        Ok(Arc::new(InformationToGoEvaluator { field, cpc }))
    }
}

enum Cpc {}

impl BuiltIn for Cpc {
    const NAME: &'static str = "cpc";
    type Params = CpcTermParams;

    fn params(profile: &Profile) -> Self::Params {
        CpcTermParams::of(profile)
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        Ok(Arc::new(params.prediction(task, fields).map_err(BuildError::Field)?))
    }
}

impl CpcTermParams {
    fn of(profile: &Profile) -> Self {
        Self { cpc: profile.cpc, information: profile.information }
    }

    /// What predicts how well the robot will know its pose.
    fn prediction<F: DerivedFields>(&self, task: &Task, fields: &F) -> Result<CpcEvaluator, F::Error> {
        let information = fields.information(task.laser, &self.information)?;
        Ok(CpcEvaluator::new(information, task.noise, self.cpc))
    }
}

crate::parameters! {
    struct CpcOccludedTermParams {
        prediction: CpcTermParams [table],
        forecast: ForecastParams [table],
    }
}

enum CpcOccluded {}

impl BuiltIn for CpcOccluded {
    const NAME: &'static str = "cpc-occluded";
    type Params = CpcOccludedTermParams;

    fn params(profile: &Profile) -> Self::Params {
        CpcOccludedTermParams { prediction: CpcTermParams::of(profile), forecast: profile.forecast }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let rays = fields.rays(task.laser, &params.prediction.information).map_err(BuildError::Field)?;
        let cpc = params.prediction.prediction(task, fields).map_err(BuildError::Field)?;
        Ok(Arc::new(CpcOccludedEvaluator::new(cpc, rays, params.forecast)))
    }
}

enum Uncertainty {}

impl BuiltIn for Uncertainty {
    const NAME: &'static str = "uncertainty";
    const LOCAL: bool = true;
    type Params = CpcTermParams;

    fn params(profile: &Profile) -> Self::Params {
        CpcTermParams::of(profile)
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let cpc = params.prediction(task, fields).map_err(BuildError::Field)?;
        Ok(Arc::new(UncertaintyEvaluator { cpc }))
    }
}

crate::parameters! {
    struct CollisionRiskTermParams {
        risk: RiskParams [table],
        forecast: ForecastParams [table],
        prediction: CpcTermParams [table],
    }
}

enum CollisionRisk {}

impl BuiltIn for CollisionRisk {
    const NAME: &'static str = "collision-risk";
    const LOCAL: bool = true;
    type Params = CollisionRiskTermParams;

    fn params(profile: &Profile) -> Self::Params {
        let prediction = CpcTermParams::of(profile);
        CollisionRiskTermParams { risk: profile.risk, forecast: profile.forecast, prediction }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let belief = params.risk.belief.then(|| params.prediction.prediction(task, fields));
        let belief = belief.transpose().map_err(BuildError::Field)?;
        let (radius, forecast) = (task.robot.radius(), params.forecast);
        Ok(Arc::new(CollisionRiskEvaluator { radius, forecast, belief }))
    }
}

enum HumanSpace {}

impl BuiltIn for HumanSpace {
    const NAME: &'static str = "human-space";
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = HumanSpaceParams;

    fn params(profile: &Profile) -> Self::Params {
        profile.human_space
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, _: &Task, _: &F) -> Built<F::Error> {
        Ok(Arc::new(HumanSpaceEvaluator { params }))
    }
}

enum Doppler {}

impl BuiltIn for Doppler {
    const NAME: &'static str = "doppler";
    const LOCAL: bool = true;
    type Params = HumanSpaceParams;

    fn params(profile: &Profile) -> Self::Params {
        profile.human_space
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, _: &Task, _: &F) -> Built<F::Error> {
        Ok(Arc::new(DopplerEvaluator { params }))
    }
}

enum Cnc {}

impl BuiltIn for Cnc {
    const NAME: &'static str = "cnc";
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = HccdmParams;

    fn params(profile: &Profile) -> Self::Params {
        profile.hccdm
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, _: &Task, _: &F) -> Built<F::Error> {
        Ok(Arc::new(HccdmEvaluator { params }))
    }
}

crate::parameters! {
    struct DistanceTermParams {
        measure: DistanceMeasure [words],
    }
}

enum Distance {}

impl BuiltIn for Distance {
    const NAME: &'static str = "distance";
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = DistanceTermParams;

    fn params(profile: &Profile) -> Self::Params {
        DistanceTermParams { measure: profile.distance }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        Ok(Arc::new(match params.measure {
            DistanceMeasure::Euclid => DistanceEvaluator::Euclid(task.goal),
            DistanceMeasure::Geodesic => DistanceEvaluator::Geodesic(
                fields.geodesic(task.goal, task.robot.radius()).map_err(BuildError::Field)?,
            ),
        }))
    }
}

/// There are none.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct OrderTermParams {}

impl Ranged for OrderTermParams {
    const FIELDS: &'static [Field] = &[];

    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}

enum Order {}

impl BuiltIn for Order {
    const NAME: &'static str = "order";
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = OrderTermParams;

    fn params(_: &Profile) -> Self::Params {
        OrderTermParams {}
    }

    fn evaluator<F: DerivedFields>(_: Self::Params, _: &Task, _: &F) -> Built<F::Error> {
        Ok(Arc::new(OrderEvaluator))
    }
}

crate::parameters! {
    struct RiskTermParams {
        risk: RiskParams [table],
        forecast: ForecastParams [table],
    }
}

enum Risk {}

impl BuiltIn for Risk {
    const NAME: &'static str = "risk";
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSES;
    type Params = RiskTermParams;

    fn params(profile: &Profile) -> Self::Params {
        RiskTermParams { risk: profile.risk, forecast: profile.forecast }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let map = fields.map().map_err(BuildError::Field)?;
        let RiskTermParams { risk: params, forecast } = params;
        Ok(Arc::new(RiskEvaluator { map, goal: task.goal, radius: task.robot.radius(), forecast, params }))
    }
}

/// Something to do with a term whose type is known only by its name.
pub trait Visitor {
    /// What comes of it.
    type Output;

    /// Does it with `T`.
    fn visit<T: BuiltIn>(self) -> Self::Output;
}

macro_rules! built_in {
    ($($term:ty),+) => {
        /// Names of the terms that are built in.
        pub const NAMES: &[&str] = &[$(<$term>::NAME),+];

        /// Whether the arbiter always computes the term of that name itself.
        pub fn is_local(name: &str) -> bool {
            $((name == <$term>::NAME && <$term>::LOCAL))||+
        }

        /// What the term of that name reads of a candidate; all, if it is not built in.
        pub fn columns(name: &str) -> Columns {
            match name {
                $(<$term>::NAME => <$term>::COLUMNS,)+
                _ => Columns::ALL,
            }
        }

        /// Does what `visitor` does with the term of that name; `None` if it is not built in.
        pub fn visit<V: Visitor>(name: &str, visitor: V) -> Option<V::Output> {
            match name {
                $(<$term>::NAME => Some(visitor.visit::<$term>()),)+
                _ => None,
            }
        }
    };
}

built_in! {
    Cnc, CollisionRisk, Cpc, CpcOccluded, Distance, Doppler, HumanSpace, InformationToGo, Order, Risk, Uncertainty
}

/// The evaluator of the term of that name as `profile` wants it.
pub fn evaluator<F: DerivedFields>(
    name: &str,
    profile: &Profile,
    task: &Task,
    fields: &F,
) -> Built<F::Error> {
    struct Build<'a, F>(&'a Profile, &'a Task, &'a F);
    impl<F: DerivedFields> Visitor for Build<'_, F> {
        type Output = Built<F::Error>;
        fn visit<T: BuiltIn>(self) -> Self::Output {
            T::evaluator(T::params(self.0), self.1, self.2)
        }
    }
    visit(name, Build(profile, task, fields)).unwrap_or(Err(BuildError::Unknown))
}

#[cfg(test)]
mod tests;
