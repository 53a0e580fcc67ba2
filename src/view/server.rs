//! The web server: lets browsers in, gives them the page, and opens a session for each.

use super::assets;
use super::complaints::Complaints;
use super::guard::Guard;
use super::session::{self, Session};
use super::{PageEnd, ViewError};
use axum::Router;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use axum::extract::{RawQuery, Request, State};
use axum::http::StatusCode;
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{any, get};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpStream, lookup_host};
use tokio::sync::{Semaphore, watch};

/// Connections at once that are no session yet, and sessions.
const MOST_CONNECTIONS: usize = 64;
const MOST_VIEWERS: usize = 32;

/// A browser sends the head of a request within this time \[s\], or is let go.
const HEAD_TIME: Duration = Duration::from_secs(5);

/// The largest head of a request \[bytes\], and how many lines it may have.
const HEAD_BYTES: usize = 16 * 1024;
const HEAD_LINES: usize = 64;

/// Close codes of WebSockets (RFC 6455): against the rules; try again later.
const POLICY: u16 = 1008;
const TRY_AGAIN: u16 = 1013;

/// What the server is to be.
pub struct Settings {
    /// Address and port to listen on; port 0: any that is free.
    pub listen: String,
    /// Whether browsers may ask, or only watch.
    pub drive: bool,
    /// Takes warnings.
    pub warn: Box<dyn Fn(&str) + Send + Sync>,
}

/// A web server that listens.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    shared: Arc<Shared>,
}

/// What every connection needs.
struct Shared {
    guard: Guard,
    drive: bool,
    page: PageEnd,
    viewers: Arc<Semaphore>,
    complaints: Arc<Complaints>,
    /// Whether any browser has ever been let in.
    watched: watch::Sender<bool>,
}

impl Server {
    /// Listens as `settings` say, to show `page`. Nobody is let in before [`serve`](Self::serve).
    ///
    /// # Errors
    /// [`ViewError::Listen`], [`ViewError::Taken`].
    pub async fn bind(settings: Settings, page: PageEnd) -> Result<Self, ViewError> {
        let Settings { listen, drive, warn } = settings;
        let error = |why: std::io::Error| match why.kind() {
            ErrorKind::AddrInUse => ViewError::Taken(listen.clone()),
            _ => ViewError::Listen { address: listen.clone(), why: why.to_string() },
        };
        let address = lookup_host(&listen).await.map_err(error)?.next();
        let nowhere = || error(std::io::Error::other("no such address"));
        let listener = TcpListener::bind(address.ok_or_else(nowhere)?).await.map_err(error)?;
        let address = listener.local_addr().map_err(error)?;
        let name = listen.rsplit_once(':').map_or("", |(name, _)| name).trim_matches(['[', ']']);
        let guard = Guard::new(name, address).map_err(error)?;
        let (viewers, watched) = (Arc::new(Semaphore::new(MOST_VIEWERS)), watch::Sender::new(false));
        let complaints = Arc::new(Complaints::new(warn));
        let shared = Arc::new(Shared { guard, drive, page, viewers, complaints, watched });
        Ok(Self { listener, address, shared })
    }

    /// The link that opens the page. The token is behind the `#`, which browsers keep to themselves.
    pub fn link(&self) -> String {
        let host = SocketAddr::new(reachable(self.address.ip()), self.address.port());
        let token = self.shared.guard.token().map(|token| format!("#token={token}")).unwrap_or_default();
        format!("http://{host}/{token}")
    }

    /// Whether a browser has begun to watch.
    pub fn watched(&self) -> watch::Receiver<bool> {
        self.shared.watched.subscribe()
    }

    /// Serves browsers until it is dropped.
    pub async fn serve(self) {
        let service = TowerToHyperService::new(router(self.shared.clone()));
        let room = Arc::new(Semaphore::new(MOST_CONNECTIONS));
        loop {
            let stream = match self.listener.accept().await {
                Ok((stream, _)) => stream,
                Err(why) => {
                    // Out of descriptors, as a rule: some become free again.
                    self.shared.complaints.add(&format!("no connection can be taken: {why}"));
                    tokio::time::sleep(Duration::from_millis(100)).await;
                    continue;
                }
            };
            let Ok(place) = room.clone().try_acquire_owned() else {
                self.shared.complaints.add("a connection was refused: there are too many");
                continue;
            };
            let service = service.clone();
            tokio::spawn(async move {
                let _place = place;
                // Errors are the browser's: it hears of them, or is gone.
                let _ = converse(stream, service).await;
            });
        }
    }
}

/// An address of this host under which others reach what listens on `listening`.
fn reachable(listening: IpAddr) -> IpAddr {
    if !listening.is_unspecified() {
        return listening;
    }
    // Nothing is sent: connecting chooses the address from which this documentation address (RFC 5737) would be reached.
    let outward = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).and_then(|socket| {
        socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
        socket.local_addr()
    });
    outward.map_or(Ipv4Addr::LOCALHOST.into(), |address| address.ip())
}

async fn converse(stream: TcpStream, service: TowerToHyperService<Router>) -> hyper::Result<()> {
    // What is shown is small and wants to be there at once.
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

fn router(shared: Arc<Shared>) -> Router {
    let files = assets::paths().fold(Router::new(), |router, path| {
        router.route(path, get(move || std::future::ready(assets::file(path))))
    });
    files
        .route("/session", any(open_session))
        .layer(from_fn_with_state(shared.clone(), check))
        .with_state(shared)
}

/// Lets nobody pass who comes by another site.
async fn check(State(shared): State<Arc<Shared>>, request: Request, next: Next) -> Response {
    match shared.guard.check(request.headers()).map(str::to_owned) {
        Ok(host) => assets::guarded(next.run(request).await, Some(&host)),
        Err(refusal) => {
            shared.complaints.add(&format!("a request was refused: {refusal}"));
            assets::guarded((StatusCode::FORBIDDEN, format!("{refusal}\n")).into_response(), None)
        }
    }
}

/// Opens a session; who is not admitted hears so on it, since browsers hide from a page why a WebSocket was refused.
async fn open_session(
    State(shared): State<Arc<Shared>>,
    RawQuery(query): RawQuery,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade.max_message_size(session::LARGEST).max_frame_size(session::LARGEST);
    let token = query.as_deref().and_then(|query| query.strip_prefix("token="));
    if !shared.guard.admits(token) {
        shared.complaints.add("a browser was refused: its link has no token, or a wrong one");
        return upgrade.on_upgrade(|socket| {
            refuse(socket, POLICY, "this link lacks its token: open the whole link that was printed")
        });
    }
    let Ok(place) = shared.viewers.clone().try_acquire_owned() else {
        shared.complaints.add("a browser was refused: there are too many");
        return upgrade.on_upgrade(|socket| refuse(socket, TRY_AGAIN, "too many browsers are watching"));
    };
    upgrade.on_upgrade(async move |socket| {
        let _place = place;
        shared.watched.send_replace(true);
        let session = Session::new(socket, shared.page.clone(), shared.drive, shared.complaints.clone());
        session.run().await;
    })
}

async fn refuse(mut socket: WebSocket, code: u16, reason: &'static str) {
    let close = Message::Close(Some(CloseFrame { code, reason: reason.into() }));
    // Who is gone need not know.
    let _ = tokio::time::timeout(session::PATIENCE, socket.send(close)).await;
}
