//! The evaluators of the built-in terms for requests: parameters as they travel, fields as they are kept.

use std::sync::Arc;

use curionav_planning::evaluation::Evaluator;
use curionav_planning::geometry::Point2;
use curionav_planning::profile::Profile;
use curionav_planning::terms::{self, BuiltIn, Task, Visitor};
use curionav_schemas::{EvaluateRequest, Refusal, Reject, Value};

use curionav_runtime::convert;
use curionav_runtime::fields::Fields;

/// The parameters `profile` gives for `term`, as they travel with every request.
pub fn parameters(profile: &Profile, term: &str) -> Result<Value, Reject> {
    struct Parameters<'a>(&'a Profile);
    impl Visitor for Parameters<'_> {
        type Output = Result<Value, Reject>;
        fn visit<T: BuiltIn>(self) -> Self::Output {
            convert::to_value(&T::params(self.0))
        }
    }
    // The service of a term that is not built in knows its own parameters.
    terms::visit(term, Parameters(profile)).unwrap_or_else(|| Ok(Value::Map(Vec::new())))
}

/// The evaluator of `term` for `request`, warmed: every field it needs is there when this returns.
pub fn evaluator(
    term: &str,
    request: &EvaluateRequest,
    fields: &Fields,
) -> Result<Arc<dyn Evaluator>, Reject> {
    struct Build<'a>(&'a EvaluateRequest, &'a Fields);
    impl Visitor for Build<'_> {
        type Output = Result<Arc<dyn Evaluator>, Reject>;
        fn visit<T: BuiltIn>(self) -> Self::Output {
            let Self(request, fields) = self;
            let task = Task {
                goal: Point2::new(request.goal_x, request.goal_y),
                goal_heading: None,
                robot: convert::checked("robot_model", convert::robot_model(&request.robot_model))?,
                laser: convert::checked("laser", convert::laser(&request.laser))?,
                noise: convert::checked("odometry_noise", convert::noise(&request.odometry_noise))?,
            };
            let params = convert::parameters("params", &request.params)?;
            T::evaluator(params, &task, &fields.of(request.map))
        }
    }
    terms::visit(term, Build(request, fields)).unwrap_or_else(|| Err(unknown(term)))
}

fn unknown(term: &str) -> Reject {
    let known = terms::NAMES.iter().map(|name| (*name).to_owned()).collect();
    Refusal::UnknownName { found: term.to_owned(), known }.at("term")
}
