//! The subscription to the wrench at the tool.

use super::arm_input::reject_malformed;
use super::events::EventsRecord;
use super::frames::{Frames, SensorFrame};
use super::node_setup::NodeSetup;
use super::senders::{Clocks, Senders};
use super::throttle::Throttle;
use dq_core::servo::{Event, Servo, is_own_frame};
use dq_messages::messages::WrenchStamped;
use dq_ros::ros::{Clock, EndpointId, Subscription};
use dq_wire::wrench_reading;
use std::time::Duration;

/// The interval at which TF is asked for an unknown sensor frame.
const ASK_INTERVAL: Duration = Duration::from_millis(500);

/// The subscription to the wrench at the tool.
pub(super) struct WrenchInput {
    subscription: Subscription<WrenchStamped>,
    /// The last message. The next message is decoded into it.
    wrench: WrenchStamped,
    senders: Senders,
    clock: Clock,
    /// The names of the tool frame and of the base frame. A wrench in one of these frames needs no lookup in TF.
    own: [String; 2],
    /// The name of the last sensor frame that is not in `own`, and the pose of this frame according to TF. The pose is `None` until
    /// TF has answered.
    found: (String, Option<SensorFrame>),
    asks: Throttle,
}

impl WrenchInput {
    /// Subscribes to the wrench. `own` are the names of the tool frame and of the base frame. A keystore from before this topic was
    /// introduced does not grant access to it. Then the servo works without wrenches.
    pub fn new(
        NodeSetup { node, contract, .. }: &mut NodeSetup,
        clock: &Clock,
        own: [&str; 2],
    ) -> Option<Self> {
        let subscription = node.subscription(contract, "wrench");
        let subscription =
            subscription.inspect_err(|why| node.log().warn(&format!("no wrench: {why}"))).ok()?;
        Some(Self {
            subscription,
            wrench: WrenchStamped::default(),
            senders: Senders::default(),
            clock: clock.clone(),
            own: own.map(str::to_owned),
            found: (String::new(), None),
            asks: Throttle::new(ASK_INTERVAL),
        })
    }

    /// Returns publisher number `number`.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.senders.publisher(number)
    }

    /// Passes the received wrenches to the servo. Drops them if the settings do not use wrenches, and while the frame of the sensor
    /// is unknown. Asks TF for this frame, unless it is the tool frame or the base frame.
    pub fn feed(
        &mut self,
        servo: &mut Servo,
        record: &mut EventsRecord,
        frames: Option<&mut Frames>,
        clocks: Clocks,
    ) {
        let Self { subscription, wrench, senders, clock, own, found, asks } = self;
        let (mut unknown, is_off) = (false, servo.settings().contact.is_none());
        let now = clock.now().nanoseconds();
        let malformed = subscription.each_over(wrench, |wrench, origin| {
            if is_off {
                return;
            }
            let frame = &wrench.header.frame_id;
            let reading = wrench_reading(wrench, senders.hear(origin, clocks).by, now);
            let reading = if own.iter().any(|own| is_own_frame(frame, own)) {
                reading
            } else if let (true, Some(sensor)) = (*frame == found.0, &found.1) {
                reading.in_frame(&sensor.parent, sensor.pose)
            } else {
                if *frame != found.0 {
                    *found = (frame.clone(), None);
                }
                unknown = true;
                return;
            };
            let _ = record.take(servo, Event::Wrench(reading));
        });
        reject_malformed(servo, malformed);
        let Some(frames) = frames else { return };
        if unknown && asks.is_due(clocks.now) {
            frames.ask_for_sensor(&found.0);
        }
        if let Some((frame, sensor)) = frames.sensor().filter(|(frame, _)| *frame == found.0) {
            *found = (frame, Some(sensor));
        }
    }
}
