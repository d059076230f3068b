//! The macro that declares the types of ROS 2 interfaces.

/// Declares a struct with the fields of a ROS 2 type, in their order. A sequence has its greatest length after it in
/// brackets. Before a type that is sent by itself stands its name, its interface, whose hash is part of keys, and how
/// many bytes a payload may have.
macro_rules! message {
    (
        $(#[$attribute:meta])*
        $name:ident = $ros:literal of $interface:expr, at most $most:expr;
        $fields:tt
    ) => {
        message! { $(#[$attribute])* $name; $fields }

        impl $crate::message::Message for $name {
            const NAME: &'static str = $ros;
            const INTERFACE: $crate::interface::Interface = $interface;
            const MAX_BYTES: usize = $most;
        }
    };
    (
        $(#[$attribute:meta])*
        $name:ident;
        { $( $(#[$about:meta])* $field:ident : $ty:ty $([$limit:expr])? ),* $(,)? }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
        pub struct $name {
            $( $(#[$about])* pub $field: $ty, )*
        }

        impl $crate::cdr::Cdr for $name {
            const MIN_BYTES: usize = 0 $(+ message!(@least $ty $(, $limit)?))*;

            fn write(&self, out: &mut $crate::cdr::Writer) -> Result<(), $crate::cdr::CdrFault> {
                $( message!(@write self.$field, out $(, $limit)?)?; )*
                Ok(())
            }

            fn read(input: &mut $crate::cdr::Reader<'_>) -> Result<Self, $crate::cdr::CdrError> {
                Ok(Self { $(
                    $field: $crate::cdr::named(
                        stringify!($field),
                        message!(@read input, stringify!($field) $(, $limit)?),
                    )?,
                )* })
            }
        }

        impl $crate::random::Random for $name {
            fn random(rng: &mut $crate::random::Rng) -> Self {
                Self { $( $field: $crate::random::Random::random(rng), )* }
            }
        }
    };
    (@least $ty:ty) => { <$ty as $crate::cdr::Cdr>::MIN_BYTES };
    (@least $ty:ty, $limit:expr) => { <u32 as $crate::cdr::Cdr>::MIN_BYTES };
    (@write $value:expr, $out:ident) => { $crate::cdr::Cdr::write(&$value, $out) };
    (@write $value:expr, $out:ident, $limit:expr) => { $out.sequence(&$value, $limit) };
    (@read $input:ident, $field:expr) => { $crate::cdr::Cdr::read($input) };
    (@read $input:ident, $field:expr, $limit:expr) => { $input.sequence($field, $limit) };
}
