//! Tests admission, refusals, and that no browser delays others.

use crate::page::Page;
use dq_view::{Answer, Ask, Server, Settings, ViewError, ends};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

const UPGRADE: [&str; 4] = [
    "Upgrade: websocket",
    "Sec-WebSocket-Version: 13",
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
    "GET /session HTTP/1.1",
];

fn upgrade<'a>(host: &'a str, origin: &'a str) -> Vec<&'a str> {
    vec![UPGRADE[3], host, origin, UPGRADE[0], UPGRADE[1], UPGRADE[2]]
}

#[tokio::test]
async fn the_page_is_served_with_every_file_it_names_and_no_site_may_use_it() {
    let page = Page::new().await;
    assert_eq!(page.link, format!("http://{}/?token={}", page.address, page.token));
    let document = page.get("/").await;
    let named = |attribute: &str| {
        let parts = document.split(attribute).skip(1);
        parts.map(|part| part.split('"').next().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let mut files: Vec<_> = named("href=\"").into_iter().chain(named("src=\"")).collect();
    files.retain(|file| !file.starts_with(['#', 'd']));
    assert_eq!(files, ["colors.css", "style.css", "guide", "main.js"]);
    let modules = [
        "connection.js",
        "curves.js",
        "drawing.js",
        "goal.js",
        "handles.js",
        "jog.js",
        "limits.js",
        "parameters.js",
        "player.js",
        "run.js",
        "scene.js",
        "space.js",
        "texts.js",
        "theatre.js",
    ]
    .map(str::to_owned);
    for path in files.into_iter().chain(modules).chain([String::new()]) {
        let response = page.get(&format!("/{path}")).await;
        let (head, body) = response.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200") && body.len() > 100, "{path}: {head}");
        for header in [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "x-content-type-options: nosniff",
            "x-frame-options: DENY",
        ] {
            assert!(head.contains(header), "{path}: {head}");
        }
        assert!(!head.to_lowercase().contains("access-control"), "{path}: {head}");
    }
    for (request, code) in [
        ("GET /etc/passwd", 404),
        ("GET /../../etc/passwd", 404),
        ("POST /", 405),
        ("OPTIONS /session", 405),
        ("GET /session", 400),
    ] {
        let response = page.request(&[&format!("{request} HTTP/1.1"), "Host: {}", &page.cookie()]).await;
        assert!(response.starts_with(&format!("HTTP/1.1 {code}")), "{request}: {response}");
        assert!(response.contains("content-security-policy"), "{request}: {response}");
    }
}

/// This is DNS rebinding: the page of another site cannot change the host name that the browser sends.
#[tokio::test]
async fn a_foreign_host_and_a_foreign_origin_are_refused_and_logged() {
    let page = Page::new().await;
    let evil = page.request(&["GET / HTTP/1.1", "Host: evil.example"]).await;
    assert!(evil.starts_with("HTTP/1.1 403") && !evil.contains("<html"), "{evil}");
    let none = page.request(&["GET / HTTP/1.0"]).await;
    assert!(none.starts_with("HTTP/1.0 403"), "{none}");
    for (host, origin, code) in [
        ("Host: evil.example", "Origin: http://evil.example", 403),
        ("Host: {}", "Origin: http://evil.example", 403),
        ("Host: {}", "Origin: null", 403),
        ("Host: {}", "Origin: http://{}", 101),
    ] {
        let response = if code == 101 {
            let browser = page.browser().await;
            drop(browser);
            "HTTP/1.1 101".to_owned()
        } else {
            page.request(&upgrade(host, origin)).await
        };
        assert!(response.starts_with(&format!("HTTP/1.1 {code}")), "{host}, {origin}: {response}");
    }
    page.warned_of("a request was refused: the Host").await;
}

#[tokio::test]
async fn only_a_browser_with_the_link_gets_the_page_on_this_host_and_beyond() {
    for listen in ["127.0.0.1:0", "0.0.0.0:0"] {
        let page = Page::open(listen, true).await;
        assert_eq!(page.token.len(), 32);
        let wrong = format!("Cookie: dq_servo_{}=00000000000000000000000000000000", page.address.port());
        for path in ["/", "/main.js", "/?token=", "/?token=00000000000000000000000000000000", "/nothing"] {
            let stranger = page.request(&[&format!("GET {path} HTTP/1.1"), "Host: {}", &wrong]).await;
            assert!(stranger.starts_with("HTTP/1.1 403"), "{path}: {stranger}");
            assert!(stranger.contains("printed the link") && !stranger.contains(&page.token), "{stranger}");
            assert!(!stranger.contains("set-cookie"), "{stranger}");
        }
        let stranger = page.request(&upgrade("Host: {}", "Origin: http://{}")).await;
        assert!(stranger.starts_with("HTTP/1.1 403"), "{stranger}");
        page.warned_of("no token, or a wrong one").await;
        let path = page.link.rsplit_once('/').unwrap().1;
        let guest = page.request(&[&format!("GET /{path} HTTP/1.1"), "Host: {}"]).await;
        let (head, body) = guest.split_once("\r\n\r\n").unwrap();
        assert!(head.starts_with("HTTP/1.1 200") && body.contains("main.js"), "{guest}");
        let cookie = head.lines().find_map(|line| line.strip_prefix("set-cookie: ")).unwrap();
        assert!(cookie.ends_with("; Path=/; HttpOnly; SameSite=Strict"), "{cookie}");
        assert_eq!(format!("Cookie: {}", cookie.split(';').next().unwrap()), page.cookie());
        assert_eq!(page.browser().await.frame("hello").await["drive"], true);
        // A wrong host name is refused even with the token.
        let by_name = page.request(&["GET / HTTP/1.1", "Host: evil.example", &page.cookie()]).await;
        assert!(by_name.starts_with("HTTP/1.1 403") && !by_name.contains("<html"), "{by_name}");
    }
}

/// Forever connects, sends `line` and waits for the end of the connection.
async fn pester(address: std::net::SocketAddr, line: &'static [u8]) {
    loop {
        if let Ok(mut stream) = TcpStream::connect(address).await {
            let _ = stream.write_all(line).await;
            let _ = stream.read_to_end(&mut Vec::new()).await;
        }
        // A connection that is refused for lack of room comes back soon enough.
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

#[tokio::test]
async fn ninety_unauthorized_clients_that_reconnect_repeatedly_keep_no_guest_out() {
    let page = Page::new().await;
    let lines: [&[u8]; 3] =
        [b"", b"GET / HTTP/1.1\r\nHost: ", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET / HTTP/1.1\r\n"];
    let strangers: Vec<_> =
        (0..90).map(|number| tokio::spawn(pester(page.address, lines[number % 3]))).collect();
    tokio::time::sleep(Duration::from_millis(500)).await;
    for number in 0..20 {
        let document = page.get("/").await;
        assert!(document.starts_with("HTTP/1.1 200"), "{number}: {document}");
        page.browser().await.frame("hello").await;
    }
    strangers.iter().for_each(tokio::task::JoinHandle::abort);
}

async fn bind(listen: &str, token: Option<&str>) -> Result<Server, ViewError> {
    let (listen, token) = (listen.to_owned(), token.map(str::to_owned));
    Server::bind(
        Settings { listen, token, drive: true, guide: "", runs: None, warn: Box::new(|_| {}) },
        ends().1,
    )
    .await
}

#[tokio::test]
async fn a_token_may_be_given_and_must_be_one() {
    let bind = async |token: &str| bind("127.0.0.1:0", Some(token)).await;
    assert!(bind("0123456789abcdef").await.unwrap().link().ends_with("/?token=0123456789abcdef"));
    let Err(why) = bind("guessed").await else { panic!("a token that can be guessed") };
    assert!(why.to_string().contains("16 characters"), "{why}");
}

#[tokio::test]
async fn an_unavailable_address_is_an_error() {
    let page = Page::new().await;
    for (address, why) in [
        (page.address.to_string().as_str(), "is taken by another program"),
        ("nonsense", ""),
        ("127.0.0.1:99999", ""),
    ] {
        let Err(error) = bind(address, None).await else { panic!("{address}") };
        let text = error.to_string();
        assert!(text.contains(address) && text.contains(why) && !text.contains('\n'), "{text}");
    }
}

#[tokio::test]
async fn what_a_browser_asks_reaches_the_robot_and_its_answer_comes_back() {
    let mut page = Page::new().await;
    let mut browser = page.browser().await;
    browser.send(r#"{"id":7,"ask":{"set":{"name":"gains.diffc","value":3}}}"#).await;
    let asked = page.asked().await;
    assert_eq!(asked.ask, Ask::Set { name: "gains.diffc".to_owned(), value: json!(3) });
    asked.answer.send(Answer::refused("too small")).ok().unwrap();
    assert_eq!(browser.frame("answer").await, json!({ "id": 7, "ok": false, "text": "too small" }));
    browser.send(r#"{"id":8,"ask":"stop"}"#).await;
    drop(page.asked().await);
    let text = browser.frame("answer").await["text"].as_str().unwrap().to_owned();
    assert!(text.contains("before an answer came"), "{text}");
}

#[tokio::test]
async fn a_page_that_only_watches_drives_nothing() {
    let mut page = Page::open("127.0.0.1:0", false).await;
    let mut browser = page.browser().await;
    assert_eq!(browser.frame("hello").await["drive"], false);
    let goal = r#"{"goal":{"position":[0.1,0.2,0.3],"orientation":[0,0,0,1]}}"#;
    let set = r#"{"set":{"name":"controller","value":"diffc"}}"#;
    for ask in [goal, set, r#""stop""#, r#""pause""#, r#""resume""#, r#""reset""#] {
        browser.send(&format!(r#"{{"id":1,"ask":{ask}}}"#)).await;
        let answer = browser.frame("answer").await;
        assert_eq!((&answer["ok"], &answer["id"]), (&json!(false), &json!(1)), "{ask}");
        assert!(answer["text"].as_str().unwrap().contains("--watch-only"), "{answer}");
    }
    assert!(page.robot.asks.try_recv().is_err(), "nothing came through");
}

#[tokio::test]
async fn malformed_frames_are_answered_and_logged_and_the_session_goes_on() {
    let page = Page::new().await;
    let mut browser = page.browser().await;
    let deep = "[".repeat(5000);
    for frame in [
        "",
        "{",
        "null",
        r#"{"id":1}"#,
        r#"{"id":1,"ask":"explode"}"#,
        r#"{"id":1,"ask":"stop","and":2}"#,
        &deep,
    ] {
        browser.send(frame).await;
        let answer = browser.frame("answer").await;
        assert_eq!((&answer["ok"], &answer["id"]), (&json!(false), &Value::Null), "{frame}");
        assert!(answer["text"].as_str().unwrap().starts_with("not a request"), "{answer}");
    }
    browser.send_bytes(vec![0, 159, 146, 150]).await;
    assert!(browser.frame("answer").await["text"].as_str().unwrap().contains("bytes"));
    page.warned_of("a browser's message is not a request").await;
    assert!(page.warnings.lock().unwrap().len() <= 2, "a flood fills no log");
    page.robot.now.send_replace(r#"{"now":{"time":1}}"#.into());
    assert_eq!(browser.frame("now").await["time"], 1);
}

#[tokio::test]
async fn a_frame_that_is_too_large_ends_its_session_alone() {
    let page = Page::new().await;
    let (mut large, mut other) = (page.browser().await, page.browser().await);
    large.frame("hello").await;
    // The connection may be closed while the message is being sent.
    let _ = futures::SinkExt::send(&mut large.socket, "x".repeat(100_000).into()).await;
    large.next().await.expect_err("the session ended");
    page.warned_of("broke the protocol").await;
    // A browser that disconnects without a close message causes no warning. Warnings are logged at most once per second.
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let before = page.warnings.lock().unwrap().len();
    let mut gone = page.browser().await;
    gone.frame("hello").await;
    drop(gone);
    tokio::time::sleep(Duration::from_millis(300)).await;
    assert_eq!(page.warnings.lock().unwrap().len(), before);
    page.robot.now.send_replace(r#"{"now":{}}"#.into());
    other.frame("now").await;
}

#[tokio::test]
async fn the_simultaneous_requests_of_a_browser_are_limited() {
    let mut page = Page::new().await;
    let mut browser = page.browser().await;
    for id in 0..20 {
        browser.send(&format!(r#"{{"id":{id},"ask":"pause"}}"#)).await;
    }
    let answer = browser.frame("answer").await;
    assert_eq!((&answer["id"], &answer["ok"]), (&json!(16), &json!(false)), "{answer}");
    // Other browsers have room, and this browser has room again after its answers.
    let mut other = page.browser().await;
    other.send(r#"{"id":99,"ask":"stop"}"#).await;
    for _ in 0..16 {
        let asked = page.asked().await;
        assert_eq!(asked.ask, Ask::Pause);
        asked.answer.send(Answer::done("paused")).ok().unwrap();
    }
    let asked = page.asked().await;
    assert_eq!(asked.ask, Ask::Stop);
    asked.answer.send(Answer::done("stopped")).ok().unwrap();
    assert_eq!(other.frame("answer").await["text"], "stopped");
}

#[tokio::test]
async fn a_late_client_gets_the_current_state_and_a_slow_one_only_the_latest() {
    let page = Page::new().await;
    page.robot.robot.send_replace(r#"{"robot":{"reach":1}}"#.into());
    let mut browser = page.browser().await;
    assert_eq!(browser.frame("robot").await["reach"], 1);
    for time in 0..10_000 {
        page.robot.now.send_replace(format!(r#"{{"now":{{"time":{time}}}}}"#).into());
    }
    let mut count = 1;
    while browser.frame("now").await["time"] != 9_999 {
        count += 1;
    }
    assert!(count < 1000, "{count} frames of 10000");
}

#[tokio::test]
async fn a_frozen_browser_is_dropped_and_delays_no_other() {
    let page = Page::new().await;
    let frozen = page.browser().await;
    let mut other = page.browser().await;
    let large = "x".repeat(1_000_000);
    let started = Instant::now();
    let mut number = 0;
    while !page.warnings.lock().unwrap().iter().any(|line| line.contains("does not read was dropped")) {
        assert!(started.elapsed() < Duration::from_secs(30), "it is still there");
        number += 1;
        page.robot.now.send_replace(format!(r#"{{"now":{{"number":{number},"pad":"{large}"}}}}"#).into());
        // The second browser gets each frame, even if the first one is frozen.
        while other.frame("now").await["number"] != number {}
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    drop(frozen);
}

#[tokio::test]
async fn the_number_of_browsers_is_limited_and_a_place_becomes_free_again() {
    let page = Page::new().await;
    let mut browsers = Vec::new();
    for _ in 0..32 {
        let mut browser = page.browser().await;
        browser.frame("hello").await;
        browsers.push(browser);
    }
    let (code, _) = page.browser().await.next().await.expect_err("it is full").unwrap();
    assert_eq!(code, 1013);
    browsers.pop();
    let again = async {
        while page.browser().await.next().await.is_err() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(10), again).await.expect("a place");
}

#[tokio::test]
async fn heads_that_are_long_or_never_end_are_let_go() {
    let page = Page::new().await;
    let long = ["GET / HTTP/1.1", "Host: {}", &page.cookie(), &format!("X: {}", "x".repeat(100_000))];
    let long = page.request(&long).await;
    assert!(!long.contains("<html"), "{long}");
    let many: Vec<_> = (0..200).map(|i| format!("X-{i}: x")).collect();
    let cookie = page.cookie();
    let lines: Vec<_> =
        ["GET / HTTP/1.1", "Host: {}", &cookie].into_iter().chain(many.iter().map(String::as_str)).collect();
    assert!(!page.request(&lines).await.contains("<html"));
    let mut slow = TcpStream::connect(page.address).await.unwrap();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").await.unwrap();
    let mut rest = Vec::new();
    tokio::time::timeout(Duration::from_secs(15), slow.read_to_end(&mut rest))
        .await
        .expect("it is let go")
        .unwrap();
    assert!(!String::from_utf8_lossy(&rest).contains("<html"));
}
