//! The session of one browser.

use super::ask::Request;
use super::warning_log::WarningLog;
use super::{Answer, Asked, PageEnd};
use axum::extract::ws::{CloseFrame, Message, WebSocket};
use serde_json::json;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, oneshot, watch};
use tokio::time::{interval, timeout};

/// The largest size of a message that the server accepts from a browser \[bytes\].
pub(super) const LARGEST: usize = 16 * 1024;

/// The longest time that sending a message to a browser may take. After this time, the server disconnects the browser.
pub(super) const PATIENCE: Duration = Duration::from_secs(3);

/// The interval of pings. A browser answers each ping, which shows that it is alive.
const PING: Duration = Duration::from_secs(2);
/// The silence after which a browser is disconnected.
const SILENCE: Duration = Duration::from_secs(10);

/// The largest number of requests of one browser that wait for answers.
const WAITING: usize = 16;

/// The close code of WebSockets (RFC 6455) for a broken protocol.
const PROTOCOL_ERROR: u16 = 1002;

/// The error that the session has ended.
struct Gone;

/// A browser's session.
pub(super) struct Session {
    socket: WebSocket,
    page: PageEnd,
    drive: bool,
    complaints: Arc<WarningLog>,
    answers: (mpsc::Sender<String>, mpsc::Receiver<String>),
    heard: Instant,
}

/// An event in a session.
enum Event {
    Robot,
    Now,
    Race,
    Markers,
    ArmShape,
    Answer(String),
    Frame(Option<Result<Message, axum::Error>>),
    Tick,
}

impl Session {
    pub fn new(socket: WebSocket, mut page: PageEnd, drive: bool, complaints: Arc<WarningLog>) -> Self {
        page.robot.mark_changed();
        page.now.mark_changed();
        page.markers.mark_changed();
        if !page.arm_shape.borrow().is_empty() {
            page.arm_shape.mark_changed();
        }
        Self { socket, page, drive, complaints, answers: mpsc::channel(WAITING), heard: Instant::now() }
    }

    /// Sends `hello`, and then shows the robot until the browser leaves or the server disconnects it.
    pub async fn run(mut self, hello: String) {
        if self.send(hello).await.is_err() {
            return;
        }
        let mut tick = interval(PING);
        loop {
            let event = tokio::select! {
                Ok(()) = self.page.robot.changed() => Event::Robot,
                Ok(()) = self.page.now.changed() => Event::Now,
                Ok(()) = self.page.race.changed() => Event::Race,
                Ok(()) = self.page.markers.changed() => Event::Markers,
                Ok(()) = self.page.arm_shape.changed() => Event::ArmShape,
                Some(answer) = self.answers.1.recv() => Event::Answer(answer),
                frame = self.socket.recv() => Event::Frame(frame),
                _ = tick.tick() => Event::Tick,
            };
            if self.take(event).await.is_err() {
                return;
            }
        }
    }

    async fn take(&mut self, event: Event) -> Result<(), Gone> {
        match event {
            Event::Robot => self.show(|page| &mut page.robot).await,
            Event::Now => self.show(|page| &mut page.now).await,
            Event::Race => self.show(|page| &mut page.race).await,
            Event::Markers => self.show(|page| &mut page.markers).await,
            // The browser then requests the shape.
            Event::ArmShape => {
                let size = self.page.arm_shape.borrow_and_update().len();
                self.send(json!({ "arm_shape": { "size": size } }).to_string()).await
            }
            Event::Answer(answer) => self.send(answer).await,
            Event::Frame(frame) => self.hear(frame).await,
            Event::Tick if self.heard.elapsed() > SILENCE => Err(Gone),
            Event::Tick => self.push(Message::Ping(Vec::new().into())).await,
        }
    }

    async fn show(&mut self, of: fn(&mut PageEnd) -> &mut watch::Receiver<Arc<str>>) -> Result<(), Gone> {
        let frame = of(&mut self.page).borrow_and_update().to_string();
        self.send(frame).await
    }

    async fn hear(&mut self, frame: Option<Result<Message, axum::Error>>) -> Result<(), Gone> {
        self.heard = Instant::now();
        match frame {
            None | Some(Ok(Message::Close(_))) => Err(Gone),
            Some(Ok(Message::Text(text))) => self.request(&text).await,
            Some(Ok(Message::Binary(_))) => self.malformed("not a request: bytes, not text").await,
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(()),
            Some(Err(why)) => {
                let reason = "this is not a message of the protocol, or it is too large".into();
                // If the browser has just disconnected, this fails: then nobody has broken a rule, and no complaint is logged.
                self.push(Message::Close(Some(CloseFrame { code: PROTOCOL_ERROR, reason }))).await?;
                self.complaints.add(&format!("a browser broke the protocol: {why}"));
                Err(Gone)
            }
        }
    }

    async fn malformed(&mut self, why: &str) -> Result<(), Gone> {
        self.complaints.add(&format!("a browser's message is {why}"));
        self.send(Answer::refused(why).frame(None)).await
    }

    /// Forwards a request. Another event sends the answer later.
    async fn request(&mut self, text: &str) -> Result<(), Gone> {
        let Request { id, ask } = match Request::read(text) {
            Ok(request) => request,
            Err(why) => return self.malformed(&why).await,
        };
        if !self.drive {
            let only = Answer::refused("this page only watches (--watch-only)");
            return self.send(only.frame(Some(id))).await;
        }
        let too_many = || Answer::refused("too many requests at once");
        let Ok(room) = self.answers.0.clone().try_reserve_owned() else {
            return self.send(too_many().frame(Some(id))).await;
        };
        let (answer, answered) = oneshot::channel();
        if self.page.asks.try_send(Asked { ask, answer }).is_err() {
            return self.send(too_many().frame(Some(id))).await;
        }
        tokio::spawn(async move {
            let answer =
                answered.await.unwrap_or_else(|_| Answer::refused("the view ended before an answer came"));
            room.send(answer.frame(Some(id)));
        });
        Ok(())
    }

    /// Sends a text message, unless it is empty.
    async fn send(&mut self, frame: String) -> Result<(), Gone> {
        if frame.is_empty() { Ok(()) } else { self.push(Message::Text(frame.into())).await }
    }

    async fn push(&mut self, message: Message) -> Result<(), Gone> {
        match timeout(PATIENCE, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err(Gone),
            Err(_) => {
                self.complaints.add("a browser that does not read was dropped");
                Err(Gone)
            }
        }
    }
}
