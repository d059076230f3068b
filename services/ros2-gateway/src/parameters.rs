//! The gateway's parameters as `ros2 param` shows them: what its configuration says, which stays until it is started
//! anew.

use curionav_planning::parameters::{Field, Kind, Ranged};
use curionav_ros2::limits::{PARAMETER_VALUES, PARAMETERS, TEXT};
use curionav_ros2::messages as ros;

use crate::config::Ros2Config;
use crate::node::Request;

/// Why nothing is changed.
const READ_ONLY: &str =
    "is said in the gateway's configuration file, table [ros2]; change it there, and start it anew";

/// A question about parameters.
pub(crate) enum Question {
    /// Which are there?
    List(ros::ListParametersRequest),
    /// What are their values?
    Get(ros::GetParametersRequest),
    /// What are their types?
    Types(ros::GetParameterTypesRequest),
    /// What do they mean?
    Describe(ros::DescribeParametersRequest),
    /// May so many be changed, each by itself?
    Set(usize),
    /// May they be changed together?
    SetAtomically,
}

/// One parameter: its name, type, meaning and value.
struct Parameter {
    descriptor: ros::ParameterDescriptor,
    value: ros::ParameterValue,
}

/// All parameters.
pub(crate) struct Parameters(Vec<Parameter>);

impl Parameters {
    /// What a configuration says; fields that it leaves open are none.
    ///
    /// # Errors
    /// If it cannot be shown as a table.
    pub(crate) fn of(config: &Ros2Config) -> anyhow::Result<Self> {
        let mut all = Vec::new();
        flatten(&mut all, "", Ros2Config::FIELDS, &toml::Table::try_from(config)?);
        all.truncate(PARAMETERS);
        Ok(Self(all))
    }

    fn find(&self, name: &str) -> Option<&Parameter> {
        self.0.iter().find(|parameter| parameter.descriptor.name == name)
    }

    /// Answers a question.
    pub(crate) fn answer(&self, question: &Question, asked: &Request) {
        match question {
            Question::List(request) => asked.reply(&self.list(request)),
            Question::Get(request) => {
                let of = |name: &String| self.find(name).map_or_else(Default::default, |it| it.value.clone());
                let values = request.names.iter().map(of).collect();
                asked.reply(&ros::GetParametersResponse { values });
            }
            Question::Types(request) => {
                let of = |name: &String| self.find(name).map_or(0, |it| it.value.type_);
                let types = request.names.iter().map(of).collect();
                asked.reply(&ros::GetParameterTypesResponse { types });
            }
            Question::Describe(request) => {
                let of = |name: &String| match self.find(name) {
                    Some(parameter) => parameter.descriptor.clone(),
                    None => ros::ParameterDescriptor { name: name.clone(), ..Default::default() },
                };
                let descriptors = request.names.iter().map(of).collect();
                asked.reply(&ros::DescribeParametersResponse { descriptors });
            }
            Question::Set(count) => {
                asked.reply(&ros::SetParametersResponse { results: vec![refused(); *count] });
            }
            Question::SetAtomically => {
                asked.reply(&ros::SetParametersAtomicallyResponse { result: refused() });
            }
        }
    }

    /// The names that a request means, as `rclcpp` has it: below its prefixes, and of no more parts than it says.
    fn list(&self, request: &ros::ListParametersRequest) -> ros::ListParametersResponse {
        let is_shallow = |rest: &str| {
            let parts = rest.split('.').filter(|part| !part.is_empty()).count() as u64;
            request.depth == 0 || parts <= request.depth
        };
        let is_below = |name: &str, prefix: &String| {
            let rest = name.strip_prefix(prefix.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.') && is_shallow(rest))
        };
        let is_meant = |name: &str| match request.prefixes.as_slice() {
            [] => is_shallow(name),
            prefixes => prefixes.iter().any(|prefix| is_below(name, prefix)),
        };
        let names = self.0.iter().map(|parameter| &parameter.descriptor.name).filter(|name| is_meant(name));
        let names: Vec<String> = names.cloned().collect();
        let before = names.iter().filter_map(|name| Some(name.rsplit_once('.')?.0.to_owned()));
        let mut prefixes: Vec<String> = before.collect();
        prefixes.dedup();
        ros::ListParametersResponse { result: ros::ListParametersResult { names, prefixes } }
    }
}

fn refused() -> ros::SetParametersResult {
    ros::SetParametersResult { successful: false, reason: READ_ONLY.to_owned() }
}

/// Adds what a table says, with the fields that it has; what has no field is a parameter of another crate.
fn flatten(all: &mut Vec<Parameter>, path: &str, fields: &[Field], table: &toml::Table) {
    for (key, value) in table {
        let field = fields.iter().find(|field| field.name == *key);
        let name = format!("{path}{key}");
        if let toml::Value::Table(inner) = value {
            let fields = match field.map(|field| field.kind) {
                Some(Kind::Table(fields, _)) => fields,
                _ => &[],
            };
            flatten(all, &format!("{name}."), fields, inner);
        } else if let Some(value) = shown(value) {
            all.push(Parameter { descriptor: described(name, field, &value), value });
        }
    }
}

fn described(name: String, field: Option<&Field>, value: &ros::ParameterValue) -> ros::ParameterDescriptor {
    let lines = field.map_or(&[][..], |field| field.meaning);
    let mut description = lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ");
    description.truncate(description.floor_char_boundary(TEXT));
    let ranges = match field.map(|field| field.kind) {
        Some(Kind::Numbers(ranges, None)) => ranges,
        _ => &[],
    };
    let [range] = ranges else {
        return ros::ParameterDescriptor {
            name,
            type_: value.type_,
            description,
            read_only: true,
            ..Default::default()
        };
    };
    let floating = ros::FloatingPointRange { from_value: range.least, to_value: range.most, step: 0.0 };
    let integer = ros::IntegerRange { from_value: range.least as i64, to_value: range.most as i64, step: 1 };
    ros::ParameterDescriptor {
        name,
        type_: value.type_,
        description,
        additional_constraints: format!("{} {}", range.unit, range.why).trim().to_owned(),
        read_only: true,
        dynamic_typing: false,
        floating_point_range: ros::AtMostOne((value.type_ == 3).then_some(floating)),
        integer_range: ros::AtMostOne((value.type_ == 2).then_some(integer)),
    }
}

/// A value as ROS has it; nothing for what it has no type for, such as a list of tables.
fn shown(value: &toml::Value) -> Option<ros::ParameterValue> {
    let nothing = ros::ParameterValue::default();
    Some(match value {
        toml::Value::Boolean(value) => ros::ParameterValue { type_: 1, bool_value: *value, ..nothing },
        toml::Value::Integer(value) => ros::ParameterValue { type_: 2, integer_value: *value, ..nothing },
        toml::Value::Float(value) => ros::ParameterValue { type_: 3, double_value: *value, ..nothing },
        toml::Value::String(value) => {
            ros::ParameterValue { type_: 4, string_value: value.clone(), ..nothing }
        }
        toml::Value::Array(values) if values.len() <= PARAMETER_VALUES => {
            let numbers = values.iter().map(toml::Value::as_float).collect::<Option<Vec<f64>>>()?;
            ros::ParameterValue { type_: 8, double_array_value: numbers, ..nothing }
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> Parameters {
        Parameters::of(&Ros2Config::default()).unwrap()
    }

    #[test]
    fn every_field_is_a_parameter_with_its_meaning_and_range() {
        let all = parameters();
        let tolerance = all.find("mission.goal_tolerance").unwrap();
        assert_eq!((tolerance.value.type_, tolerance.value.double_value), (3, 0.5));
        let range = tolerance.descriptor.floating_point_range.0.unwrap();
        assert_eq!((range.from_value, range.to_value), (0.05, 5.0));
        let domain = all.find("domain").unwrap();
        assert_eq!((domain.value.type_, domain.descriptor.integer_range.0.unwrap().to_value), (2, 232));
        assert_eq!(all.find("topics.scan").unwrap().value.string_value, "scan");
        assert_eq!(all.find("use_sim_time").unwrap().value.type_, 1);
        assert!(all.0.iter().all(|it| it.descriptor.read_only && !it.descriptor.description.is_empty()));
        assert!(all.find("mission.initial_pose").is_none(), "it is left open");
    }

    #[test]
    fn names_are_listed_by_prefix_and_depth_as_rclcpp_does() {
        let all = parameters();
        let listed = |prefixes: &[&str], depth: u64| {
            let prefixes = prefixes.iter().map(|prefix| (*prefix).to_owned()).collect();
            all.list(&ros::ListParametersRequest { prefixes, depth }).result
        };
        assert_eq!(listed(&[], 0).names.len(), all.0.len());
        assert!(listed(&[], 1).names.iter().all(|name| !name.contains('.')));
        let silence = listed(&["silence"], 0);
        assert_eq!(silence.names, ["silence.command", "silence.odom", "silence.scan"]);
        assert_eq!(silence.prefixes, ["silence"]);
        assert!(listed(&["sil"], 0).names.is_empty());
        assert_eq!(listed(&["mission"], 1).prefixes, ["mission"]);
    }
}
