//! The macro that declares parameter structs and enums of words.

/// Declares a parameter struct, or an enum of words, and what is derived from the declaration.
///
/// After a field's type stands in brackets what it may hold, and at the end its default:
/// `pub substep: f64 [0.01, 1.0, "s", "longer steps show nothing"] = 0.1`. Either all fields have a default, then the
/// struct implements `Default` and each field may be left out of a file, or none has. The brackets hold one of
/// - `least, most, "unit", "why"`: the closed range of a number, or of each number of a list;
/// - `in RANGE, ...`: one or more [`Range`](crate::parameters::Range)s, which apply to the numbers of a list in turn;
/// - `table`: a parameter struct, or a list of them;
/// - `words`: an enum declared with this macro;
/// - `name, "mend"`: a text that must not be empty.
///
/// A list also says after a semicolon how many entries it may have: `...; least, most, "why"`. A field without
/// brackets holds a text, or yes or no. What relates several fields is checked by a function named at the end of the
/// struct: `} check Self::agree`.
///
/// Structs are `Debug`, `Clone`, `PartialEq`, `Serialize` and `Deserialize`, enums `Copy` and `Eq` too. A struct
/// refuses fields that it does not have; a file has the words of an enum in kebab case.
#[macro_export]
macro_rules! parameters {
    // An enum of words.
    (
        $(#[$attribute:meta])*
        $vis:vis enum $name:ident {
            $( $(#[doc = $meaning:literal])* $(#[default $($default:tt)*])? $variant:ident ),* $(,)?
        }
    ) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(rename_all = "kebab-case")]
        $(#[$attribute])*
        $vis enum $name {
            $( $(#[doc = $meaning])* $(#[default $($default)*])? $variant, )*
        }

        impl $crate::parameters::Words for $name {
            fn words() -> Vec<$crate::parameters::Word> {
                vec![$( ($crate::parameters::word(&Self::$variant), &[$($meaning),*]) ),*]
            }
        }
    };

    // A struct.
    (
        $(#[$attribute:meta])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $meaning:literal])*
                $(#[serde($($serde:tt)*)])*
                $field_vis:vis $field:ident : $ty:ty $([$($holds:tt)*])? $(= $default:expr)?
            ),* $(,)?
        } $(check $agree:expr)?
    ) => {
        $crate::parameters! {
            @define $name [$($($field: $default,)?)*]
            $(#[$attribute])*
            $vis struct $name {
                $(
                    $(#[doc = $meaning])*
                    $(#[serde($($serde)*)])*
                    $field_vis $field : $ty,
                )*
            }
        }

        impl $crate::parameters::Ranged for $name {
            const FIELDS: &'static [$crate::parameters::Field] = &[$(
                $crate::parameters::Field {
                    name: $crate::parameters::plain(stringify!($field)),
                    ty: stringify!($ty),
                    meaning: &[$($meaning),*],
                    kind: $crate::parameters!(@kind $ty; $($($holds)*)?),
                }
            ),*];

            fn check(&self) -> Result<(), $crate::parameters::FieldError> {
                let mut fields = Self::FIELDS.iter();
                $(
                    if let Some(_field) = fields.next() {
                        $crate::parameters!(@check self.$field, _field; $($($holds)*)?);
                    }
                )*
                $( $agree(self)?; )?
                Ok(())
            }
        }
    };

    (@define $name:ident [] $($item:tt)*) => {
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        $($item)*
    };
    (@define $name:ident [$($field:ident: $default:expr,)*] $($item:tt)*) => {
        #[derive(Debug, Clone, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        $($item)*

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }
    };

    (@kind $ty:ty;) => { $crate::parameters::Kind::Plain };
    (@kind $ty:ty; name, $mend:expr) => { $crate::parameters::Kind::Plain };
    (@kind $ty:ty; words) => {
        $crate::parameters::Kind::Words(<$ty as $crate::parameters::Words>::words)
    };
    (@kind $ty:ty; table $(; $($entries:expr),*)?) => {
        $crate::parameters::Kind::Table(
            <$ty as $crate::parameters::Ranged>::FIELDS,
            $crate::parameters!(@entries $($($entries),*)?),
        )
    };
    (@kind $ty:ty; in $($range:expr),* $(; $($entries:expr),*)?) => {
        $crate::parameters::Kind::Numbers(&[$($range),*], $crate::parameters!(@entries $($($entries),*)?))
    };
    (@kind $ty:ty; $least:expr, $most:expr, $unit:expr, $why:expr $(; $($entries:expr),*)?) => {
        $crate::parameters::Kind::Numbers(
            &[$crate::parameters::Range { least: $least, most: $most, unit: $unit, why: $why }],
            $crate::parameters!(@entries $($($entries),*)?),
        )
    };
    (@entries) => { None };
    (@entries $least:expr, $most:expr, $why:expr) => {
        Some($crate::parameters::Range { least: $least, most: $most, unit: "entries", why: $why })
    };

    (@check $value:expr, $field:ident;) => {};
    (@check $value:expr, $field:ident; words) => {};
    (@check $value:expr, $field:ident; name, $mend:expr) => {
        $crate::parameters::check_name(&$value, $field, $mend)?;
    };
    (@check $value:expr, $field:ident; table $($rest:tt)*) => {
        $crate::parameters::check_table(&$value, $field)?;
    };
    (@check $value:expr, $field:ident; $($numbers:tt)*) => {
        $crate::parameters::check_numbers(&$value, $field)?;
    };
}

#[cfg(test)]
mod tests {
    use crate::parameters::{Ranged, read};

    parameters! {
        /// A wheel.
        struct Wheel {
            /// Its radius.
            radius: f64 [0.1, 2.0, "m", "larger ones are mills"] = 0.5,
            /// Where its spokes are.
            spokes: Vec<f64> [-1.0, 1.0, "", "they lie within"; 1.0, 3.0, "more are a disc"] = vec![0.0],
        }
    }

    parameters! {
        /// A cart.
        struct Cart {
            /// Its wheels.
            wheels: Vec<Wheel> [table; 1.0, 4.0, "more do not fit"],
        }
    }

    fn fault(text: &str) -> String {
        read::<Cart>(text).unwrap_err().to_string()
    }

    #[test]
    fn both_ends_belong_to_a_range_and_nan_to_none() {
        let radius = |radius| Wheel { radius, ..Wheel::default() }.check();
        assert!([0.1, 2.0].into_iter().all(|r| radius(r).is_ok()));
        assert!([0.0999, 2.001, f64::NAN, f64::INFINITY].into_iter().all(|r| radius(r).is_err()));
    }

    #[test]
    fn a_fault_names_line_and_field_and_says_what_is_allowed_and_why() {
        let long = "line 4: wheels[1].radius: is 3; give 0.1 to 2 m: larger ones are mills";
        assert_eq!(fault("[[wheels]]\nradius = 1\n[[wheels]]\nradius = 3\n"), long);
        let wrong = fault("[[wheels]]\nradius = \"wide\"\n");
        assert!(
            wrong.starts_with("line 2: wheels[0].radius: invalid type")
                && wrong.ends_with("larger ones are mills")
        );
        assert!(
            fault("[[wheels]]\nspokes = [0.5, 7.0]\n").starts_with("line 2: wheels[0].spokes[1]: is 7; ")
        );
    }

    #[test]
    fn a_list_has_as_many_entries_as_it_may() {
        assert!(
            fault("[[wheels]]\nspokes = []\n")
                .starts_with("line 2: wheels[0].spokes: has 0 entries; give 1 to 3")
        );
        assert!(
            fault("wheels = []\n").starts_with("line 1: wheels: has 0 entries; give 1 to 4 entries: more do")
        );
    }
}
