//! `rcl_interfaces`: the parameters of a node, as `ros2 param` asks for them.

use serde::{Serialize, Serializer};

use crate::cdr::{Cdr, CdrError, CdrFault, Reader, Writer};
use crate::interface::Interface;
use crate::limits::{PARAMETER_VALUES, PARAMETERS};
use crate::random::{Random, Rng};

/// All parameters with their descriptions.
const LIST: usize = 256 << 10;

const LIST_PARAMETERS: Interface = Interface::new(
    "rcl_interfaces/srv/ListParameters",
    "RIHS01_3e6062bfbb27bfb8730d4cef2558221f51a11646d78e7bb30a1e83afac3aad9d",
);
const GET_PARAMETERS: Interface = Interface::new(
    "rcl_interfaces/srv/GetParameters",
    "RIHS01_bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
);
const GET_PARAMETER_TYPES: Interface = Interface::new(
    "rcl_interfaces/srv/GetParameterTypes",
    "RIHS01_da199c878688b3e530bdfe3ca8f74cb9fa0c303101e980a9e8f260e25e1c80ca",
);
const DESCRIBE_PARAMETERS: Interface = Interface::new(
    "rcl_interfaces/srv/DescribeParameters",
    "RIHS01_845b484d71eb0673dae682f2e3ba3c4851a65a3dcfb97bddd82c5b57e91e4cff",
);
const SET_PARAMETERS: Interface = Interface::new(
    "rcl_interfaces/srv/SetParameters",
    "RIHS01_56eed9a67e169f9cb6c1f987bc88f868c14a8fc9f743a263bc734c154015d7e0",
);
const SET_PARAMETERS_ATOMICALLY: Interface = Interface::new(
    "rcl_interfaces/srv/SetParametersAtomically",
    "RIHS01_0e192ef259c07fc3c07a13191d27002222e65e00ccec653ca05e856f79285fcd",
);

message! {
    /// Asks for the names of parameters.
    #[derive(Eq)]
    ListParametersRequest = "rcl_interfaces/srv/ListParameters_Request" of LIST_PARAMETERS, at most LIST;
    {
        /// With which the names begin; empty for all.
        prefixes: Vec<String> [PARAMETERS],
        /// How many parts a name has at most; 0 for any number.
        depth: u64,
    }
}

message! {
    /// Names of parameters (`rcl_interfaces/ListParametersResult`).
    #[derive(Eq)]
    ListParametersResult;
    {
        /// The names.
        names: Vec<String> [PARAMETERS],
        /// What stands in them before the last dot.
        prefixes: Vec<String> [PARAMETERS],
    }
}

message! {
    /// The names of parameters.
    #[derive(Eq)]
    ListParametersResponse = "rcl_interfaces/srv/ListParameters_Response" of LIST_PARAMETERS, at most LIST;
    {
        /// The names.
        result: ListParametersResult,
    }
}

message! {
    /// Asks for the values of parameters.
    #[derive(Eq)]
    GetParametersRequest = "rcl_interfaces/srv/GetParameters_Request" of GET_PARAMETERS, at most LIST;
    {
        /// Their names.
        names: Vec<String> [PARAMETERS],
    }
}

message! {
    /// A value of any type (`rcl_interfaces/ParameterValue`).
    ParameterValue;
    {
        #[serde(rename = "type")]
        /// Which field counts: 0 none, 1 `bool`, 2 integer, 3 double, 4 string, 5 to 9 arrays of byte to string.
        type_: u8,
        /// Of type 1.
        bool_value: bool,
        /// Of type 2.
        integer_value: i64,
        /// Of type 3.
        double_value: f64,
        /// Of type 4.
        string_value: String,
        /// Of type 5.
        byte_array_value: Vec<u8> [PARAMETER_VALUES],
        /// Of type 6.
        bool_array_value: Vec<bool> [PARAMETER_VALUES],
        /// Of type 7.
        integer_array_value: Vec<i64> [PARAMETER_VALUES],
        /// Of type 8.
        double_array_value: Vec<f64> [PARAMETER_VALUES],
        /// Of type 9.
        string_array_value: Vec<String> [PARAMETER_VALUES],
    }
}

message! {
    /// The values of parameters.
    GetParametersResponse = "rcl_interfaces/srv/GetParameters_Response" of GET_PARAMETERS, at most LIST;
    {
        /// In the order of the names; of type 0 where there is no such parameter.
        values: Vec<ParameterValue> [PARAMETERS],
    }
}

message! {
    /// Asks for the types of parameters.
    #[derive(Eq)]
    GetParameterTypesRequest = "rcl_interfaces/srv/GetParameterTypes_Request" of GET_PARAMETER_TYPES, at most LIST;
    {
        /// Their names.
        names: Vec<String> [PARAMETERS],
    }
}

message! {
    /// The types of parameters.
    #[derive(Eq)]
    GetParameterTypesResponse = "rcl_interfaces/srv/GetParameterTypes_Response" of GET_PARAMETER_TYPES, at most LIST;
    {
        /// As of [`ParameterValue`], in the order of the names.
        types: Vec<u8> [PARAMETERS],
    }
}

message! {
    /// Asks what parameters mean.
    #[derive(Eq)]
    DescribeParametersRequest = "rcl_interfaces/srv/DescribeParameters_Request" of DESCRIBE_PARAMETERS, at most LIST;
    {
        /// Their names.
        names: Vec<String> [PARAMETERS],
    }
}

/// A sequence of no more than one item: `T[<=1]` of ROS.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AtMostOne<T>(pub Option<T>);

impl<T: Cdr> Cdr for AtMostOne<T> {
    const MIN_BYTES: usize = u32::MIN_BYTES;

    fn write(&self, out: &mut Writer) -> Result<(), CdrFault> {
        u32::from(self.0.is_some()).write(out)?;
        self.0.iter().try_for_each(|item| item.write(out))
    }

    fn read(input: &mut Reader<'_>) -> Result<Self, CdrError> {
        input.sequence("message", 1).map(|mut items| Self(items.pop()))
    }
}

impl<T: Serialize> Serialize for AtMostOne<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(&self.0)
    }
}

impl<T: Random> Random for AtMostOne<T> {
    fn random(rng: &mut Rng) -> Self {
        Self((rng.below(2) == 1).then(|| T::random(rng)))
    }
}

message! {
    /// Between which values a number may be (`rcl_interfaces/FloatingPointRange`).
    #[derive(Copy)]
    FloatingPointRange;
    {
        /// The least.
        from_value: f64,
        /// The greatest.
        to_value: f64,
        /// Between two values; 0 for any.
        step: f64,
    }
}

message! {
    /// Between which values an integer may be (`rcl_interfaces/IntegerRange`).
    #[derive(Copy, Eq)]
    IntegerRange;
    {
        /// The least.
        from_value: i64,
        /// The greatest.
        to_value: i64,
        /// Between two values; 0 for any.
        step: u64,
    }
}

message! {
    /// What a parameter means (`rcl_interfaces/ParameterDescriptor`).
    ParameterDescriptor;
    {
        /// Its name.
        name: String,
        #[serde(rename = "type")]
        /// As of [`ParameterValue`].
        type_: u8,
        /// In words.
        description: String,
        /// What values may be besides, in words.
        additional_constraints: String,
        /// Whether it stays as it is.
        read_only: bool,
        /// Whether its type may change.
        dynamic_typing: bool,
        /// Of a number.
        floating_point_range: AtMostOne<FloatingPointRange>,
        /// Of an integer.
        integer_range: AtMostOne<IntegerRange>,
    }
}

message! {
    /// What parameters mean.
    DescribeParametersResponse = "rcl_interfaces/srv/DescribeParameters_Response" of DESCRIBE_PARAMETERS, at most LIST;
    {
        /// In the order of the names.
        descriptors: Vec<ParameterDescriptor> [PARAMETERS],
    }
}

message! {
    /// A parameter with a value (`rcl_interfaces/Parameter`).
    Parameter;
    {
        /// Its name.
        name: String,
        /// Its value.
        value: ParameterValue,
    }
}

message! {
    /// Asks to change parameters, each by itself.
    SetParametersRequest = "rcl_interfaces/srv/SetParameters_Request" of SET_PARAMETERS, at most LIST;
    {
        /// With their new values.
        parameters: Vec<Parameter> [PARAMETERS],
    }
}

message! {
    /// Whether a parameter was changed (`rcl_interfaces/SetParametersResult`).
    #[derive(Eq)]
    SetParametersResult;
    {
        /// Whether it was.
        successful: bool,
        /// Why not.
        reason: String,
    }
}

message! {
    /// Whether parameters were changed.
    #[derive(Eq)]
    SetParametersResponse = "rcl_interfaces/srv/SetParameters_Response" of SET_PARAMETERS, at most LIST;
    {
        /// In the order of the request.
        results: Vec<SetParametersResult> [PARAMETERS],
    }
}

message! {
    /// Asks to change parameters, all or none.
    SetParametersAtomicallyRequest = "rcl_interfaces/srv/SetParametersAtomically_Request" of
        SET_PARAMETERS_ATOMICALLY, at most LIST;
    {
        /// With their new values.
        parameters: Vec<Parameter> [PARAMETERS],
    }
}

message! {
    /// Whether all parameters were changed.
    #[derive(Eq)]
    SetParametersAtomicallyResponse = "rcl_interfaces/srv/SetParametersAtomically_Response" of
        SET_PARAMETERS_ATOMICALLY, at most LIST;
    {
        /// Of all of them.
        result: SetParametersResult,
    }
}
