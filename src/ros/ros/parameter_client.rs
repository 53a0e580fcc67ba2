//! Reads and sets another node's parameters.

use super::client::Client;
use super::error::RosError;
use super::node::Node;
use dq_messages::messages::{Message, ServiceType};
use dq_messages::*;
use dq_params::Value;
use std::time::Duration;
use tokio::time::{Instant, timeout_at};

/// The number of values that are requested at once. In a secured graph the reply must fit into one packet.
const VALUES_AT_ONCE: usize = 8;

/// The number of descriptions that are requested at once. It is smaller than [`VALUES_AT_ONCE`], because descriptions are longer.
const DESCRIPTORS_AT_ONCE: usize = 2;

/// After each received state of a node's parameters, the client waits this long for a newer state.
const MORE: Duration = Duration::from_millis(100);

/// Calls the parameter services of one node, whose DDS may be of any vendor.
pub struct ParameterClient<'a> {
    node: &'a mut Node,
    target: String,
    patience: Duration,
}

impl<'a> ParameterClient<'a> {
    /// Creates a client of the node `target` (fully qualified) that waits up to `patience` for each answer.
    pub fn new(node: &'a mut Node, target: &str, patience: Duration) -> Self {
        Self { node, target: target.to_owned(), patience }
    }

    /// Returns the names of all parameters.
    ///
    /// # Errors
    /// [`RosError::Service`] if the node does not answer in time.
    pub async fn list(&mut self) -> Result<Vec<String>, RosError> {
        let client = self.client::<ListParameters>("list_parameters").await?;
        let ListResult { mut names, prefixes } = client.call(ListRequest::default()).await?.result;
        // In a list that is too long for a reply, prefixes stand for names.
        if !prefixes.is_empty() {
            names.extend(client.call(ListRequest { prefixes, depth: 0 }).await?.result.names);
        }
        Ok(names)
    }

    /// Returns all parameters with their values.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn all(&mut self) -> Result<Vec<(String, Value)>, RosError> {
        let names = self.list().await?;
        let client = self.client::<GetParameters>("get_parameters").await?;
        let mut all = Vec::new();
        for names in names.chunks(VALUES_AT_ONCE) {
            let values = client.call(Names { names: names.to_vec() }).await?.values;
            if values.len() < names.len() {
                return self.announced().await;
            }
            let values = values.into_iter().map(ParameterValue::into_value);
            all.extend(names.iter().cloned().zip(values).filter_map(|(name, value)| Some((name, value?))));
        }
        Ok(all)
    }

    /// Returns the value of a parameter; `None` if the node has not declared the parameter.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn get(&mut self, name: &str) -> Result<Option<Value>, RosError> {
        let client = self.client::<GetParameters>("get_parameters").await?;
        let values = client.call(Names { names: vec![name.to_owned()] }).await?.values;
        match values.into_iter().next() {
            Some(value) => Ok(value.into_value()),
            None => {
                let mut all = self.announced().await?.into_iter();
                Ok(all.find_map(|(known, value)| (known == name).then_some(value)))
            }
        }
    }

    /// Reads all parameters with their values from the other node's `~/parameters`. This is necessary if the values are too long
    /// for the reply of a service, because that reply is then empty.
    async fn announced(&mut self) -> Result<Vec<(String, Value)>, RosError> {
        let topic = format!("{}/parameters", self.target);
        let mut states = self.node.raw_subscription(&topic, ParameterEvent::TYPE, true, true)?;
        let end = Instant::now() + self.patience;
        let (mut newest, mut until) = (None::<ParameterEvent>, end);
        // A late subscriber may receive several states in any order.
        while let Ok(Some(message)) = timeout_at(until.min(end), states.next()).await {
            let state = decode::<ParameterEvent>(&message.cdr).ok();
            let state = state.filter(|state| state.node == self.target && !state.new_parameters.is_empty());
            let is_newer = |newer: &ParameterEvent| {
                newest.as_ref().is_none_or(|known| newer.stamp.nanoseconds() > known.stamp.nanoseconds())
            };
            if let Some(state) = state.filter(is_newer) {
                (newest, until) = (Some(state), Instant::now() + MORE);
            }
        }
        let why = format!("its values are too long for a reply, and there was no message on {topic}");
        let service = format!("{}/get_parameters", self.target);
        let newest = newest.ok_or(RosError::Service { service, why })?;
        let parameters = newest.new_parameters.into_iter();
        Ok(parameters.filter_map(|Parameter { name, value }| Some((name, value.into_value()?))).collect())
    }

    /// Sets a parameter. The inner error is the node's reason for a refusal.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn set(&mut self, name: &str, value: &Value) -> Result<Result<(), String>, RosError> {
        let client = self.client::<SetParameters>("set_parameters").await?;
        let parameter = Parameter { name: name.to_owned(), value: value.into() };
        let results = client.call(Changes { parameters: vec![parameter] }).await?.results;
        Ok(match results.into_iter().next() {
            Some(result) if result.successful => Ok(()),
            Some(result) => Err(result.reason),
            None => Err("the node answered without a result".to_owned()),
        })
    }

    /// Sets all of these parameters or none. The inner error is the node's reason for a refusal.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn set_all(&mut self, changes: &[(String, Value)]) -> Result<Result<(), String>, RosError> {
        let client = self.client::<SetParametersAtomically>("set_parameters_atomically").await?;
        let parameter =
            |(name, value): &(String, Value)| Parameter { name: name.clone(), value: value.into() };
        let request = Changes { parameters: changes.iter().map(parameter).collect() };
        let result = client.call(request).await?.result;
        Ok(if result.successful { Ok(()) } else { Err(result.reason) })
    }

    /// Returns the description of a parameter; `None` if the node has not declared the parameter.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn describe(&mut self, name: &str) -> Result<Option<ParameterDescriptor>, RosError> {
        Ok(self.describe_all(&[name.to_owned()]).await?.pop())
    }

    /// Returns the descriptions of these parameters, without those that are not declared.
    ///
    /// # Errors
    /// [`RosError::Service`].
    pub async fn describe_all(&mut self, names: &[String]) -> Result<Vec<ParameterDescriptor>, RosError> {
        let client = self.client::<DescribeParameters>("describe_parameters").await?;
        let mut all = Vec::new();
        for names in names.chunks(DESCRIPTORS_AT_ONCE) {
            let descriptors = client.call(Names { names: names.to_vec() }).await?.descriptors;
            all.extend(descriptors.into_iter().filter(|descriptor| descriptor.kind != 0));
        }
        Ok(all)
    }

    async fn client<S: ServiceType>(&mut self, service: &str) -> Result<Client<S>, RosError> {
        self.node.client(&format!("{}/{service}", self.target), self.patience).await
    }
}
