//! `dq_servo view`: the servo in a browser.

use super::print::print_line;
use super::run;
use super::signals::Signals;
use crate::ros::{Environment, LogLevel, Logging, Resolver, RosArgs, RosError, Session};
use crate::view::{self, Peer, Server, Settings};
use std::sync::Arc;
use tokio::sync::Notify;
use tokio::task::JoinHandle;

/// Where the page is by default: on this host only.
const LISTEN: &str = "127.0.0.1:8123";

/// Show the servo in a browser: watch it, send it goals, switch its law
#[derive(clap::Args)]
pub(super) struct View {
    /// Address and port of the page; port 0: any free one. Beyond this host the printed link has a token, and nothing is encrypted
    #[arg(long, default_value = LISTEN, value_name = "ADDRESS:PORT")]
    listen: String,
    /// Show the page only: nothing can be asked of the robot
    #[arg(long)]
    watch_only: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { listen: LISTEN.to_owned(), watch_only: false }
    }
}

impl View {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let mut signals = Signals::new()?;
        let page = self.open(&Environment::from_process(ros_args)?, ros_args).await?;
        print_line!("{}", page.link)?;
        run::until(&mut signals, || Ok(())).await
    }

    /// Opens the page; it is there until it is dropped.
    pub(super) async fn open(&self, environment: &Environment, ros_args: &RosArgs) -> anyhow::Result<Page> {
        let (robot, browsers) = view::ends();
        let session = Session::open(environment)?;
        let names = Resolver::new("dq_servo_view", ros_args).map_err(RosError::from)?;
        let peer = Peer::start(&session, names, Logging::new(ros_args, LogLevel::Warn), robot)?;
        let log = peer.log().clone();
        let settings = Settings {
            listen: self.listen.clone(),
            drive: !self.watch_only,
            warn: Box::new(move |why| log.warn(why)),
        };
        let server = Server::bind(settings, browsers).await?;
        let (link, watched) = (server.link(), server.watched());
        Ok(Page { link, watched, server: tokio::spawn(server.serve()), _peer: peer, _session: session })
    }
}

/// A page that is open.
pub(super) struct Page {
    /// Opens it.
    pub link: String,
    /// Notified when a browser begins to watch.
    pub watched: Arc<Notify>,
    server: JoinHandle<()>,
    _peer: Peer,
    _session: Session,
}

impl Drop for Page {
    fn drop(&mut self) {
        self.server.abort();
    }
}
