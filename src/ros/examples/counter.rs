//! The example of the README: a node with a topic, a parameter and a service.

use dq_messages::messages::{StringMessage, SuccessResponse, Trigger};
use dq_messages::{NodeContract, ParameterEvent, TopicContract};
use dq_params::{ParameterStore, Parameters};
use dq_ros::ros::{Environment, LogLevel, Logging, ParameterServer, Resolver, Session, args};
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering::Relaxed};
use std::time::Duration;

#[derive(Parameters)]
struct Counter {
    /// by how much the count grows each second
    #[parameter(default = 1, range = -10..=10)]
    step: i64,
}

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let (_, args) = args::split(std::env::args())?;
    let session = Session::open(&Environment::from_process(&args)?)?;
    let mut node = session.node(Resolver::new("counter", &args)?, Logging::new(&args, LogLevel::Info))?;
    let topics = NodeContract::new([
        ("count", TopicContract::output::<StringMessage>()),
        ("~/parameters", TopicContract::output::<ParameterEvent>().latched(1)),
    ]);
    let counts = node.publisher::<StringMessage>(&topics, "count")?;

    let store = ParameterStore::of::<Counter>()?;
    let growth = Arc::new(AtomicI64::new(store.read::<Counter>()?.step));
    let changed = growth.clone();
    let apply = move |store: &ParameterStore, _: &_| {
        let counter: Counter = store.read().map_err(|why| why.to_string())?;
        changed.store(counter.step, Relaxed);
        Ok(())
    };
    ParameterServer::start(&mut node, &topics, store, Box::new(apply))?;

    let count = Arc::new(AtomicI64::new(0));
    let reset = count.clone();
    node.serve::<Trigger>("~/reset", move |_| {
        reset.store(0, Relaxed);
        SuccessResponse { success: true, message: "the count is 0".to_owned() }
    })?;
    loop {
        let data = count.fetch_add(growth.load(Relaxed), Relaxed).to_string();
        counts.publish(StringMessage { data });
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
}
