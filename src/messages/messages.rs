//! The standard messages that the nodes use, with the fields of their `.msg` definitions in order.
//!
//! Only messages that the nodes publish, subscribe to or serve are here. The encoding is plain CDR (little endian on the wire). A
//! test compares the encoded messages with the bytes of a real ROS 2 (`tests/data/cdr_jazzy.json`).

mod geometry;
mod joints;
mod reports;
mod services;
#[cfg(test)]
mod tests;
mod time;

pub use geometry::*;
pub use joints::*;
pub use reports::*;
pub use services::*;
pub use time::*;

use serde::{Serialize, de::DeserializeOwned};

/// A ROS 2 message.
pub trait Message: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// The name of the type in ROS 2: `package/msg/Name`.
    const TYPE: &'static str;
}

/// A ROS 2 service, which has two messages.
pub trait ServiceType: 'static {
    /// The name of the type in ROS 2: `package/srv/Name`.
    const TYPE: &'static str;
    /// The request of a client.
    type Request: Serialize + DeserializeOwned + Clone + Send + 'static;
    /// The response of the server.
    type Response: Serialize + DeserializeOwned + Default + Send + 'static;

    /// Returns a shorter response in place of `_response`, which is too long: it has `_bytes` bytes, but at most `_room` bytes can
    /// reach the client. Returns `None` if the service defines no such response.
    fn too_long(_response: Self::Response, _bytes: usize, _room: usize) -> Option<Self::Response> {
        None
    }
}

/// Declares message structs with the derives that every message needs. Each field gets a generated comment. Further comments are
/// necessary only for units and the like.
macro_rules! message {
    ($(
        $(#[$meta:meta])* $name:ident = $type:literal { $($(#[$field_meta:meta])* $field:ident : $kind:ty),* $(,)? }
    )+) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct $name {
            $(
                $(#[$field_meta])*
                #[doc = ""]
                #[doc = concat!("The field `", stringify!($field), "` of the definition.")]
                pub $field: $kind
            ),*
        }
        impl Message for $name { const TYPE: &'static str = $type; }
    )+};
}

/// Declares service types, given the request and the response of each.
macro_rules! service {
    ($(
        $(#[$meta:meta])* $name:ident = $type:literal ($request:ty) -> $response:ty
        $(, too_long |$response_too_long:ident, $bytes:ident, $room:ident| $instead:expr)?;
    )+) => {$(
        $(#[$meta])*
        pub struct $name;
        impl ServiceType for $name {
            const TYPE: &'static str = $type;
            type Request = $request;
            type Response = $response;
            $(fn too_long($response_too_long: $response, $bytes: usize, $room: usize) -> Option<$response> {
                Some($instead)
            })?
        }
    )+};
}
pub(crate) use {message, service};
