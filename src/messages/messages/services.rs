//! The standard services of the nodes, with their requests and responses.

use super::{Message, ServiceType, message, service};
use serde::{Deserialize, Serialize};

message! {
    /// The empty request of `std_srvs/srv/Trigger`. CDR gives an empty structure one dummy octet.
    TriggerRequest = "std_srvs/srv/Trigger_Request" {
        /// The octet that rosidl puts into empty structures.
        structure_needs_at_least_one_member: u8,
    }

    /// The response of a service: whether the call succeeded.
    SuccessResponse = "std_srvs/srv/Trigger_Response" {
        success: bool,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        message: String,
    }

    /// The request of `std_srvs/srv/SetBool`.
    SetBoolRequest = "std_srvs/srv/SetBool_Request" {
        data: bool,
    }
}
service! {
    /// A service without an argument that performs one action.
    Trigger = "std_srvs/srv/Trigger" (TriggerRequest) -> SuccessResponse;
    /// A service that switches one thing on or off.
    SetBool = "std_srvs/srv/SetBool" (SetBoolRequest) -> SuccessResponse;
}
