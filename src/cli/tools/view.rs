//! `dq_servo view`: shows the servo, or a recorded run, in a browser.

use super::background_tasks::Runner;
use super::plot::read_all;
use crate::cli::arm::ArmChoice;
use crate::cli::print::print_line;
use crate::cli::run;
use crate::cli::signals::Signals;
use dq_ros::ros::{Environment, LogLevel, Logging, Resolver, RosArgs, Session};
use dq_view::{PageEnd, Peer, RobotEnd, Server, Settings};
use dq_wire::ServoKind;
use std::path::PathBuf;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::{JoinHandle, JoinSet};

/// The default address of the page: on this host only.
const LISTEN: &str = "127.0.0.1:8123";

/// The environment variable with the token of the link. If it is set, each start uses the same token.
const TOKEN: &str = "DQ_SERVO_VIEW_TOKEN";

/// The address on this host with any free port.
const ANY_PORT: &str = "127.0.0.1:0";

/// Show a servo in a browser: watch it, send it goals, switch its law; or play bags
#[derive(clap::Args)]
pub(in crate::cli) struct View {
    /// Play these bags instead of showing a live servo; several bags are shown together. A bag is a rosbag2 directory or one of its
    /// files
    #[arg(value_name = "BAG", conflicts_with_all = ["dual", "watch_only"])]
    bags: Vec<PathBuf>,
    /// Show the servo for two arms
    #[arg(long)]
    dual: bool,
    /// Address and port of the page; port 0: any free one. The printed link has a token (DQ_SERVO_VIEW_TOKEN, or a random one), and
    /// nothing is encrypted
    #[arg(long, default_value = LISTEN, value_name = "ADDRESS:PORT")]
    listen: String,
    /// Only show the robot: the page accepts no requests
    #[arg(long)]
    watch_only: bool,
    #[command(flatten)]
    arm: ArmChoice,
}

impl View {
    /// Returns the page at this address; `None` stands for the default address.
    pub(super) fn at(listen: Option<String>) -> Self {
        let (listen, arm) = (listen.unwrap_or(LISTEN.to_owned()), ArmChoice::default());
        Self { bags: Vec::new(), dual: false, listen, watch_only: false, arm }
    }

    pub(super) async fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        if !self.bags.is_empty() {
            return self.play(ros_args).await;
        }
        let mut signals = Signals::new()?;
        let environment = Environment::from_process(ros_args)?;
        let kind = if self.dual { ServoKind::TwoArms } else { ServoKind::OneArm };
        let page = self.open(kind, &environment, ros_args).await?;
        print_line!("{}", page.link)?;
        let ended = run::until(&mut signals, || false, || Ok(())).await;
        page.close().await;
        ended
    }

    /// Plays the bags until a signal arrives. A signal that arrives while the bags are read ends the program at once.
    async fn play(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        let runs = read_all(&self.bags, &self.arm.and(ros_args), None)?;
        let mut signals = Signals::new()?;
        let warn = |why: &str| dq_ros::stderr::line(format!("warning: {why}"));
        // Keep the channel's other end. If it were dropped, the sessions of browsers would end.
        let (_robot, browsers) = dq_view::ends();
        let server = self.server(browsers, Some(dq_view::recorded_runs(&runs)), Box::new(warn)).await?;
        let page = Page::new(server, async |closed| drop(closed.await));
        print_line!("{}", page.link)?;
        let ended = run::until(&mut signals, || false, || Ok(())).await;
        page.close().await;
        ended
    }

    /// Opens the page for a servo of this kind. The page closes when the returned value is dropped.
    pub(super) async fn open(
        &self,
        kind: ServoKind,
        environment: &Environment,
        ros_args: &RosArgs,
    ) -> crate::cli::Result<Page> {
        let (robot, browsers) = dq_view::ends();
        let viewer = ViewerNode::join(kind, environment, ros_args, robot)?;
        let log = viewer.peer.log().clone();
        let server = self.server(browsers, None, Box::new(move |why| log.warn(why))).await?;
        Ok(Page::new(server, |closed| async move {
            let _ = closed.await;
            viewer.leave().await;
        }))
    }

    /// Opens the page at `listen`. If `listen` is `None`, opens the page at the default address, or at any free port if that fails. The
    /// page joins the graph once a browser connects, and uses no resources until then.
    pub(super) async fn offer(
        listen: Option<String>,
        environment: &Environment,
        ros_args: &RosArgs,
    ) -> crate::cli::Result<Page> {
        let (robot, browsers) = dq_view::ends();
        let warn = || Box::new(|why: &str| dq_ros::stderr::line(format!("warning: {why}")));
        let any_port = Self::at(Some(ANY_PORT.to_owned()));
        let is_chosen = listen.is_some();
        let server = match Self::at(listen).server(browsers.clone(), None, warn()).await {
            Err(_) if !is_chosen => any_port.server(browsers, None, warn()).await?,
            opened => opened?,
        };
        let (environment, ros_args, mut watched) = (environment.clone(), ros_args.clone(), server.watched());
        Ok(Page::new(server, |mut closed| async move {
            let viewer = async {
                let _ = watched.wait_for(|watched| *watched).await;
                ViewerNode::join(ServoKind::OneArm, &environment, &ros_args, robot)
            };
            let viewer = tokio::select! {
                viewer = viewer => viewer,
                _ = &mut closed => return,
            };
            match viewer {
                Ok(viewer) => {
                    let _ = closed.await;
                    viewer.leave().await;
                }
                Err(why) => dq_ros::stderr::line(format!("warning: the page shows nothing: {why}")),
            }
        }))
    }

    async fn server(
        &self,
        browsers: PageEnd,
        runs: Option<String>,
        warn: Box<dyn Fn(&str) + Send + Sync>,
    ) -> Result<Server, dq_view::ViewError> {
        // The token is not on the command line, which all users of a host can read.
        let token = std::env::var(TOKEN).ok().filter(|token| !token.is_empty());
        let (listen, guide) = (self.listen.clone(), include_str!("../../guide/view.md"));
        let settings = Settings { listen, token, drive: !self.watch_only, guide, runs, warn };
        Server::bind(settings, browsers).await
    }
}

/// An open page.
pub(super) struct Page {
    /// The link that opens the page.
    pub link: String,
    /// Whether a browser has connected.
    pub watched: watch::Receiver<bool>,
    _server: JoinSet<()>,
    /// The channel that ends the viewer.
    close: oneshot::Sender<()>,
    viewer: JoinSet<()>,
}

impl Page {
    /// Creates the page that `server` serves. Calls `viewer` with a channel, and spawns the returned task, which runs the page's node.
    /// [`close`](Self::close) sends a message on this channel to end the task.
    fn new<F: Future<Output = ()> + Send + 'static>(
        server: Server,
        viewer: impl FnOnce(oneshot::Receiver<()>) -> F,
    ) -> Self {
        let (link, watched) = (server.link(), server.watched());
        let (close, closed) = oneshot::channel();
        let (serving, viewing) = (server.serve(), viewer(closed));
        let (mut server, mut viewer) = (JoinSet::new(), JoinSet::new());
        server.spawn(serving);
        viewer.spawn(viewing);
        Self { link, watched, _server: server, close, viewer }
    }

    /// Closes the page, and finishes the recording in progress, if there is one.
    pub async fn close(mut self) {
        let _ = self.close.send(());
        self.viewer.join_next().await;
    }
}

/// The page's node in the graph.
struct ViewerNode {
    peer: Peer,
    tasks: JoinHandle<()>,
    _session: Session,
}

impl ViewerNode {
    fn join(
        kind: ServoKind,
        environment: &Environment,
        ros_args: &RosArgs,
        robot: RobotEnd,
    ) -> crate::cli::Result<Self> {
        let session = Session::open(environment)?;
        let names = Resolver::new("dq_servo_view", ros_args)?;
        let (ask, tasks) = mpsc::channel(1);
        let runner = Runner::new(environment, ros_args, robot.race.clone());
        let peer = Peer::start(kind, &session, names, Logging::new(ros_args, LogLevel::Warn), robot, ask)?;
        Ok(Self { peer, tasks: tokio::spawn(runner.run(tasks)), _session: session })
    }

    /// Drops the peer, so that no new requests arrive. Then waits until all tasks have ended, and leaves the graph.
    async fn leave(self) {
        let Self { peer, tasks, _session } = self;
        drop(peer);
        let _ = tasks.await;
    }
}
