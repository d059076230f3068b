//! Maps and what is derived from them, which all of this process share.

use std::sync::LazyLock;

use curionav_mission::fields::Fields;

/// As much as a service keeps.
pub(crate) static FIELDS: LazyLock<Fields> = LazyLock::new(|| Fields::of_maps([]));
