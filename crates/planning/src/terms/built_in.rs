//! The built-in terms, one after the other: parameters, name, and how the evaluator is made.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::built_in_term::{Built, BuiltIn, Visitor};
use super::derived_fields::DerivedFields;
use super::task::Task;
use super::term_params::{CpcTermParams, InformationToGoTermParams};
use crate::collision_risk::RiskParams;
use crate::crowd_cluster::GroupParams;
use crate::evaluation::collision_risk::CollisionRiskEvaluator;
use crate::evaluation::cpc::{CpcEvaluator, CpcOccludedEvaluator};
use crate::evaluation::distance::{DistanceEvaluator, DistanceMeasure};
use crate::evaluation::hccdm::{HccdmEvaluator, HccdmParams};
use crate::evaluation::human_space::{DopplerEvaluator, HumanSpaceEvaluator, HumanSpaceParams};
use crate::evaluation::information_to_go::InformationToGoEvaluator;
use crate::evaluation::order::OrderEvaluator;
use crate::evaluation::risk::RiskEvaluator;
use crate::evaluation::uncertainty::UncertaintyEvaluator;
use crate::forecast::ForecastParams;
use crate::parameters::{Field, FieldError, Ranged};
use crate::profile::Profile;
use crate::sight::{Sight, SightParams};
use crate::states::Columns;

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
        let cpc = params.prediction.prediction(task, fields)?;
        let field = fields.information_to_go(task, &params)?;
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
        Ok(Arc::new(params.prediction(task, fields)?))
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
        let rays = fields.rays(task.laser, &params.prediction.information)?;
        let cpc = params.prediction.prediction(task, fields)?;
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
        let cpc = params.prediction(task, fields)?;
        Ok(Arc::new(UncertaintyEvaluator { cpc }))
    }
}

crate::parameters! {
    struct CollisionRiskTermParams {
        risk: RiskParams [table],
        forecast: ForecastParams [table],
        prediction: CpcTermParams [table],
        sight: SightParams [table],
    }
}

enum CollisionRisk {}

impl BuiltIn for CollisionRisk {
    const NAME: &'static str = "collision-risk";
    const LOCAL: bool = true;
    type Params = CollisionRiskTermParams;

    fn params(profile: &Profile) -> Self::Params {
        let prediction = CpcTermParams::of(profile);
        CollisionRiskTermParams {
            risk: profile.risk,
            forecast: profile.forecast,
            prediction,
            sight: profile.sight,
        }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let belief = params.risk.belief.then(|| params.prediction.prediction(task, fields)).transpose()?;
        let radius = task.robot.radius();
        let sight = params.sight.of(task, fields)?;
        let standing_share = params.risk.standing_share;
        let v_max = task.robot.v_max;
        Ok(Arc::new(CollisionRiskEvaluator {
            radius,
            v_max,
            standing_share,
            forecast: params.forecast,
            belief,
            sight,
        }))
    }
}

impl SightParams {
    /// What hides people from the robot of `task`, if walls do.
    fn of<F: DerivedFields>(&self, task: &Task, fields: &F) -> Result<Option<Sight>, F::Error> {
        self.walls_hide.then(|| Ok(Sight::new(fields.map()?, task.robot.v_max))).transpose()
    }
}

crate::parameters! {
    struct HumanSpaceTermParams {
        human_space: HumanSpaceParams [table],
        groups: GroupParams [table],
        sight: SightParams [table],
    }
}

impl HumanSpaceTermParams {
    fn of(profile: &Profile) -> Self {
        Self { human_space: profile.human_space, groups: profile.groups, sight: profile.sight }
    }
}

enum HumanSpace {}

impl BuiltIn for HumanSpace {
    const NAME: &'static str = "human-space";
    const LOCAL: bool = true;
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = HumanSpaceTermParams;

    fn params(profile: &Profile) -> Self::Params {
        HumanSpaceTermParams::of(profile)
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let sight = params.sight.of(task, fields)?;
        Ok(Arc::new(HumanSpaceEvaluator { params: params.human_space, groups: params.groups, sight }))
    }
}

enum Doppler {}

impl BuiltIn for Doppler {
    const NAME: &'static str = "doppler";
    const LOCAL: bool = true;
    type Params = HumanSpaceTermParams;

    fn params(profile: &Profile) -> Self::Params {
        HumanSpaceTermParams::of(profile)
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let sight = params.sight.of(task, fields)?;
        Ok(Arc::new(DopplerEvaluator { params: params.human_space, sight }))
    }
}

crate::parameters! {
    struct CncTermParams {
        hccdm: HccdmParams [table],
        groups: GroupParams [table],
        sight: SightParams [table],
    }
}

enum Cnc {}

impl BuiltIn for Cnc {
    const NAME: &'static str = "cnc";
    const COLUMNS: Columns = Columns::POSITIONS;
    type Params = CncTermParams;

    fn params(profile: &Profile) -> Self::Params {
        CncTermParams { hccdm: profile.hccdm, groups: profile.groups, sight: profile.sight }
    }

    fn evaluator<F: DerivedFields>(params: Self::Params, task: &Task, fields: &F) -> Built<F::Error> {
        let sight = params.sight.of(task, fields)?;
        Ok(Arc::new(HccdmEvaluator { params: params.hccdm, groups: params.groups, sight }))
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
            DistanceMeasure::Geodesic => {
                DistanceEvaluator::Geodesic(fields.geodesic(task.goal, task.robot.radius())?)
            }
        }))
    }
}

/// Parameters of the term `order`: it has none.
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
        Ok(Arc::new(RiskEvaluator {
            map: fields.map()?,
            goal: task.goal,
            radius: task.robot.radius(),
            forecast: params.forecast,
            params: params.risk,
        }))
    }
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

        /// Gives the type of the term of that name to `visitor`, and returns its output; `None` if no such term is
        /// built in.
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

/// The evaluator of the term of that name as `profile` wants it; `None` if it is not built in.
pub fn evaluator<F: DerivedFields>(
    name: &str,
    profile: &Profile,
    task: &Task,
    fields: &F,
) -> Option<Built<F::Error>> {
    struct Build<'a, F>(&'a Profile, &'a Task, &'a F);
    impl<F: DerivedFields> Visitor for Build<'_, F> {
        type Output = Built<F::Error>;
        fn visit<T: BuiltIn>(self) -> Self::Output {
            T::evaluator(T::params(self.0), self.1, self.2)
        }
    }
    visit(name, Build(profile, task, fields))
}
