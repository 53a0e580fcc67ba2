//! A page without a robot, for the tests of the server, on a free port of this host.

use dq_view::{Ask, Asked, RobotEnd, Server, Settings, ends};
use futures::{SinkExt, StreamExt};
use serde_json::Value;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;
use tokio::time::timeout;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::{Error, Message};

/// The longest wait in these tests.
const SOON: Duration = Duration::from_secs(15);

pub struct Page {
    pub robot: RobotEnd,
    pub link: String,
    /// The token of the link and the cookie.
    pub token: String,
    pub warnings: Arc<Mutex<Vec<String>>>,
    pub address: SocketAddr,
    server: JoinHandle<()>,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.server.abort();
    }
}

impl Page {
    pub async fn new() -> Self {
        Self::open("127.0.0.1:0", true).await
    }

    pub async fn open(listen: &str, drive: bool) -> Self {
        let (robot, browsers) = ends();
        let warnings: Arc<Mutex<Vec<String>>> = Arc::default();
        let said = warnings.clone();
        let warn = Box::new(move |why: &str| said.lock().unwrap().push(why.to_owned()));
        let guide = include_str!("../../src/guide/view.md");
        let settings = Settings { listen: listen.to_owned(), token: None, drive, guide, runs: None, warn };
        let server = Server::bind(settings, browsers).await.unwrap();
        let link = server.link();
        let (place, token) = link.split_once("/?token=").unwrap();
        let port = place.rsplit_once(':').unwrap().1;
        let address = format!("127.0.0.1:{port}").parse().unwrap();
        let token = token.to_owned();
        Self { robot, link, token, warnings, address, server: tokio::spawn(server.serve()) }
    }

    /// Returns the response to a request with these lines. `{}` stands for the server's address in them.
    pub async fn request(&self, lines: &[&str]) -> String {
        let head: String = lines
            .iter()
            .map(|line| format!("{}\r\n", line.replace("{}", &self.address.to_string())))
            .collect();
        let mut stream = TcpStream::connect(self.address).await.unwrap();
        // A server that refuses may close before everything is written.
        let _ = stream.write_all(format!("{head}Connection: close\r\n\r\n").as_bytes()).await;
        let mut response = Vec::new();
        let _ = timeout(SOON, stream.read_to_end(&mut response)).await.expect("an answer, or the end");
        String::from_utf8_lossy(&response).into_owned()
    }

    /// Returns the answer to `GET path` if an admitted browser sends it.
    pub async fn get(&self, path: &str) -> String {
        self.request(&[&format!("GET {path} HTTP/1.1"), "Host: {}", &self.cookie()]).await
    }

    /// Returns the cookie header of a browser that has opened the link.
    pub fn cookie(&self) -> String {
        format!("Cookie: dq_servo_{}={}", self.address.port(), self.token)
    }

    /// Opens a browser session on the page.
    pub async fn browser(&self) -> Browser {
        let url = format!("ws://{}/session", self.address);
        let mut request = url.into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{}", self.address).parse().unwrap());
        let cookie = self.cookie().split_once(' ').unwrap().1.parse().unwrap();
        request.headers_mut().insert("Cookie", cookie);
        let stream = TcpStream::connect(self.address).await.unwrap();
        let (socket, _) = tokio_tungstenite::client_async(request, stream).await.unwrap();
        Browser { socket }
    }

    /// Returns the next request of a browser.
    pub async fn asked(&mut self) -> Asked<Ask> {
        timeout(SOON, self.robot.asks.recv()).await.expect("a request").unwrap()
    }

    /// Waits for a warning with this text.
    pub async fn warned_of(&self, text: &str) {
        let warned = async {
            while !self.warnings.lock().unwrap().iter().any(|line| line.contains(text)) {
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        let warned = timeout(SOON, warned).await;
        assert!(warned.is_ok(), "{text:?} is not among {:?}", self.warnings.lock().unwrap());
    }
}

pub struct Browser {
    pub socket: WebSocketStream<TcpStream>,
}

impl Browser {
    pub async fn send(&mut self, text: &str) {
        self.socket.send(Message::text(text)).await.unwrap();
    }

    pub async fn send_bytes(&mut self, bytes: Vec<u8>) {
        self.socket.send(Message::binary(bytes)).await.unwrap();
    }

    /// Returns the next nonempty frame. The wait is limited, and pings do not extend it.
    pub async fn next(&mut self) -> Result<Value, Option<(u16, String)>> {
        timeout(SOON, self.next_text()).await.expect("a frame, or the end")
    }

    async fn next_text(&mut self) -> Result<Value, Option<(u16, String)>> {
        loop {
            match self.socket.next().await {
                Some(Ok(Message::Text(text))) => return Ok(serde_json::from_str(&text).unwrap()),
                Some(Ok(Message::Close(why))) => {
                    return Err(why.map(|why| (why.code.into(), why.reason.to_string())));
                }
                Some(Ok(_)) => {}
                Some(Err(Error::Io(_) | Error::Protocol(_) | Error::ConnectionClosed)) | None => {
                    return Err(None);
                }
                Some(Err(other)) => panic!("{other}"),
            }
        }
    }

    /// Returns the next frame of this kind.
    pub async fn frame(&mut self, kind: &str) -> Value {
        loop {
            let frame = self.next().await.unwrap_or_else(|end| panic!("{kind} was expected, not {end:?}"));
            if let Some(content) = frame.get(kind) {
                return content.clone();
            }
        }
    }
}
