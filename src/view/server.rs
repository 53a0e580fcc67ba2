//! The web server: admits browsers, serves the page, and opens a session for each browser.

use super::assets;
use super::guard::{self, Guard, Guest, Refusal};
use super::session::{self, Session};
use super::warning_log::WarningLog;
use super::{PageEnd, ViewError};
use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::http::header::{CONNECTION, HeaderValue, SET_COOKIE};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde_json::json;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream, lookup_host};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, watch};

/// The largest number of connections without the token.
const MOST_STRANGERS: usize = 256;
/// The largest number of connections with the token but without a session.
const MOST_GUESTS: usize = 64;
/// The largest number of sessions.
const MOST_VIEWERS: usize = 32;

/// The time after which the server closes a connection without the token, so that such connections do not block browsers with the
/// token. The time is long enough to retransmit a lost packet.
const STRANGER_TIME: Duration = Duration::from_secs(2);

/// The time within which a browser must send the head of a request.
const HEAD_TIME: Duration = Duration::from_secs(5);

/// The largest size of the head of a request \[bytes\].
const HEAD_BYTES: usize = 16 * 1024;
/// The largest number of lines of the head of a request.
const HEAD_LINES: usize = 64;

/// The close code of WebSockets (RFC 6455) for "try again later".
const TRY_AGAIN: u16 = 1013;

/// The settings of the server.
pub struct Settings {
    /// The address and port to listen on; port 0 stands for any free port.
    pub listen: String,
    /// The token that admits browsers; `None` for a random one.
    pub token: Option<String>,
    /// Whether browsers may send requests. If false, they may only watch.
    pub drive: bool,
    /// The guide, as text.
    pub guide: &'static str,
    /// [Recorded runs](super::recorded_runs) to play instead of showing a robot.
    pub runs: Option<String>,
    /// Logs warnings.
    pub warn: Box<dyn Fn(&str) + Send + Sync>,
}

/// A listening web server.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
}

/// The state that all connections share.
struct Shared {
    guard: Guard,
    drive: bool,
    guide: &'static str,
    runs: Option<Bytes>,
    page: PageEnd,
    guests: Arc<Semaphore>,
    viewers: Arc<Semaphore>,
    complaints: Arc<WarningLog>,
    /// Whether a session was ever opened.
    watched: watch::Sender<bool>,
}

impl Server {
    /// Opens the listening socket of a server that shows `page`. Connections wait until [`serve`](Self::serve) is called.
    ///
    /// # Errors
    /// [`ViewError::Listen`], [`ViewError::Taken`] or [`ViewError::Token`].
    pub async fn bind(settings: Settings, page: PageEnd) -> Result<Self, ViewError> {
        let Settings { listen, token, drive, guide, runs, warn } = settings;
        if !token.as_deref().is_none_or(guard::is_usable) {
            return Err(ViewError::Token);
        }
        let error = |why: std::io::Error| match why.kind() {
            ErrorKind::AddrInUse => ViewError::Taken(listen.clone()),
            _ => ViewError::Listen { address: listen.clone(), why: why.to_string() },
        };
        let address = lookup_host(&listen).await.map_err(error)?.next();
        let nowhere = || error(std::io::Error::other("no such address"));
        let listener = TcpListener::bind(address.ok_or_else(nowhere)?).await.map_err(error)?;
        let address = listener.local_addr().map_err(error)?;
        let name = listen.rsplit_once(':').map_or("", |(name, _)| name).trim_matches(['[', ']']);
        let token = token.map_or_else(guard::random_token, Ok).map_err(error)?;
        let guard = Guard::new(name, address, token);
        let [guests, viewers] = [MOST_GUESTS, MOST_VIEWERS].map(|most| Arc::new(Semaphore::new(most)));
        let watched = watch::Sender::new(false);
        let complaints = Arc::new(WarningLog::new(warn));
        let shared = Arc::new(Shared {
            guard,
            drive,
            guide,
            runs: runs.map(Bytes::from),
            page,
            guests,
            viewers,
            complaints,
            watched,
        });
        Ok(Self { listener, address, shared })
    }

    /// Returns the link that opens the page, with the token.
    pub fn link(&self) -> String {
        let host = SocketAddr::new(reachable(self.address.ip()), self.address.port());
        format!("http://{host}/?token={}", self.shared.guard.token())
    }

    /// Returns a receiver whose value becomes true when the first browser begins to watch.
    pub fn watched(&self) -> watch::Receiver<bool> {
        self.shared.watched.subscribe()
    }

    /// Serves browsers until the returned future is dropped.
    pub async fn serve(self) {
        let strangers = Arc::new(Semaphore::new(MOST_STRANGERS));
        // Further connections wait in the operating system's queue.
        while let Ok(place) = strangers.clone().acquire_owned().await {
            let stream = match self.listener.accept().await {
                Ok((stream, _)) => stream,
                Err(why) => {
                    // Usually the process has no free file descriptor. A moment later it may have one again.
                    self.shared.complaints.add(&format!("no connection can be taken: {why}"));
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    continue;
                }
            };
            tokio::spawn(receive(stream, self.shared.clone(), place));
        }
    }
}

/// Returns the address for the link to a server that listens on `listening`. If `listening` stands for all addresses of this host,
/// returns the address from which this host sends packets to other networks. Without such an address, returns loopback.
fn reachable(listening: IpAddr) -> IpAddr {
    if !listening.is_unspecified() {
        return listening;
    }
    // Connecting a UDP socket sends nothing. It selects the address of this host from which packets to this documentation address
    // (RFC 5737) would be sent.
    let outward = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).and_then(|socket| {
        socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
        socket.local_addr()
    });
    outward.map_or(Ipv4Addr::LOCALHOST.into(), |address| address.ip())
}

/// Answers the requests of a connection. The connection occupies one of the places for connections without the token (`place`)
/// until the browser sends the token.
async fn receive(stream: TcpStream, shared: Arc<Shared>, place: OwnedSemaphorePermit) {
    let admitted = Arc::new(Notify::new());
    let service = TowerToHyperService::new(router(shared.clone(), admitted.clone()));
    let mut conversation = pin!(converse(stream, service));
    tokio::select! {
        // The server has answered with an error, or the browser has gone.
        _ = &mut conversation => return,
        () = tokio::time::sleep(STRANGER_TIME) => return,
        () = admitted.notified() => drop(place),
    }
    match shared.guests.clone().try_acquire_owned() {
        Ok(_place) => drop(conversation.await),
        Err(_) => shared.complaints.add("a connection was refused: there are too many"),
    }
}

async fn converse(stream: TcpStream, service: TowerToHyperService<Router>) -> hyper::Result<()> {
    // Messages are small and should arrive at once.
    let _ = stream.set_nodelay(true);
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_TIME)
        .max_buf_size(HEAD_BYTES)
        .max_headers(HEAD_LINES)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades()
        .await
}

/// Creates the router of one connection. The router notifies `admitted` when the browser is admitted.
fn router(shared: Arc<Shared>, admitted: Arc<Notify>) -> Router {
    let files = assets::paths().fold(Router::new(), |router, path| {
        router.route(path, get(move || std::future::ready(assets::file(path))))
    });
    files
        .route("/session", any(open_session))
        .route("/arm_shape", get(arm_shape))
        .route("/guide", get(guide))
        .route("/runs", get(runs))
        .layer(from_fn_with_state((shared.clone(), admitted), check))
        .with_state(shared)
}

/// Refuses requests that lack a valid token or come from another site.
async fn check(
    State((shared, admitted)): State<(Arc<Shared>, Arc<Notify>)>,
    request: Request,
    next: Next,
) -> Response {
    match shared.guard.admit(request.uri(), request.headers()) {
        Ok(Guest { host, cookie }) => {
            admitted.notify_one();
            let mut response = assets::guarded(next.run(request).await, Some(&host));
            response.headers_mut().extend(cookie.map(|cookie| (SET_COOKIE, cookie)));
            response
        }
        Err(refusal) => {
            shared.complaints.add(&format!("a request was refused: {refusal}"));
            let refused = match refusal {
                Refusal::Token => assets::for_strangers(),
                Refusal::Host | Refusal::Origin => format!("{refusal}\n").into_response(),
            };
            let mut response = assets::guarded((StatusCode::FORBIDDEN, refused).into_response(), None);
            response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
            response
        }
    }
}

/// Returns the shape of the arm.
async fn arm_shape(State(shared): State<Arc<Shared>>) -> Bytes {
    Bytes::from_owner(shared.page.arm_shape.borrow().clone())
}

/// Returns the guide as plain text, which browsers show. Browsers would only offer to save Markdown as a file.
async fn guide(State(shared): State<Arc<Shared>>) -> &'static str {
    shared.guide
}

/// Returns the recorded runs. On a page that shows a robot, returns "not found".
async fn runs(State(shared): State<Arc<Shared>>) -> Result<Bytes, StatusCode> {
    shared.runs.clone().ok_or(StatusCode::NOT_FOUND)
}

/// Opens a session on a new WebSocket. Closes the WebSocket with [`TRY_AGAIN`] if there are [`MOST_VIEWERS`] sessions already.
async fn open_session(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let upgrade = upgrade.max_message_size(session::LARGEST).max_frame_size(session::LARGEST);
    let Ok(place) = shared.viewers.clone().try_acquire_owned() else {
        shared.complaints.add("a browser was refused: there are too many");
        return upgrade.on_upgrade(|socket| refuse(socket, TRY_AGAIN, "too many browsers are watching"));
    };
    upgrade.on_upgrade(async move |socket| {
        let _place = place;
        shared.watched.send_replace(true);
        let hello = json!({ "hello": {
            "drive": shared.drive,
            "recorded": shared.runs.is_some(),
            "version": env!("CARGO_PKG_VERSION"),
        }});
        let session = Session::new(socket, shared.page.clone(), shared.drive, shared.complaints.clone());
        session.run(hello.to_string()).await;
    })
}

async fn refuse(mut socket: WebSocket, code: u16, reason: &'static str) {
    let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
    // The browser may have gone.
    let _ = tokio::time::timeout(session::PATIENCE, socket.send(close)).await;
}
