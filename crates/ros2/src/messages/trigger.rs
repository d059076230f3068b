//! `std_srvs/srv/Trigger`: asks for something that needs no words.

use crate::interface::Interface;

const TRIGGER: Interface = Interface::new(
    "std_srvs/srv/Trigger",
    "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
);

message! {
    /// Asks for it. ROS gives a request without fields one byte, because C has no empty structures.
    #[derive(Copy, Eq)]
    TriggerRequest = "std_srvs/srv/Trigger_Request" of TRIGGER, at most 1 << 10;
    {
        /// Without a meaning.
        structure_needs_at_least_one_member: u8,
    }
}

message! {
    /// What has become of it.
    #[derive(Eq)]
    TriggerResponse = "std_srvs/srv/Trigger_Response" of TRIGGER, at most 1 << 10;
    {
        /// Whether it was done.
        success: bool,
        /// In words.
        message: String,
    }
}
