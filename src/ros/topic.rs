//! Topics as DDS knows them.

use rustdds::QosPolicies;

/// A topic as DDS knows it.
#[derive(Clone)]
pub(super) struct DdsTopic {
    /// What ROS 2 calls it, for errors and warnings.
    pub ros_name: String,
    pub name: String,
    pub type_name: String,
    pub qos: QosPolicies,
}

impl DdsTopic {
    /// Messages: `package/msg/Name` is `package::msg::dds_::Name_` in DDS, and topics have the prefix "rt".
    pub fn of_messages(ros_name: &str, message: &str, qos: QosPolicies) -> Self {
        let (package, message) = message.split_once("/msg/").unwrap_or(("", message));
        let type_name = format!("{package}::msg::dds_::{message}_");
        Self { ros_name: ros_name.to_owned(), name: format!("rt{ros_name}"), type_name, qos }
    }

    /// What a service is asked.
    pub fn of_requests(ros_name: &str, service: &str, qos: QosPolicies) -> Self {
        let type_name = service_type(service, "Request");
        Self { ros_name: ros_name.to_owned(), name: request_topic(ros_name), type_name, qos }
    }

    /// What a service answers.
    pub fn of_replies(ros_name: &str, service: &str, qos: QosPolicies) -> Self {
        let type_name = service_type(service, "Response");
        Self { ros_name: ros_name.to_owned(), name: reply_topic(ros_name), type_name, qos }
    }
}

/// The DDS topic of the requests to the service with that fully qualified name.
pub(super) fn request_topic(service: &str) -> String {
    format!("rq{service}Request")
}

/// The DDS topic of its replies.
pub(super) fn reply_topic(service: &str) -> String {
    format!("rr{service}Reply")
}

fn service_type(service: &str, part: &str) -> String {
    let (package, service) = service.split_once("/srv/").unwrap_or(("", service));
    format!("{package}::srv::dds_::{service}_{part}_")
}
