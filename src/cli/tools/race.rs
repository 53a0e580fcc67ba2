//! A race, shown on the live page: two servos move their simulated arms to the same goal, each under its own law. All nodes of the
//! race are in a separate domain.

use crate::cli::error::ensure;
use dq_config::{NodeParameters, PlantParameters, ServoParameters};
use dq_messages::PoseNumbers;
use dq_nodes::{PlantNode, Prepared, ServoNode};
use dq_params::{ParameterError, Value};
use dq_ros::ros::args::{Override, Remap};
use dq_ros::ros::{Environment, LogLevel, Logging, OwnDomain, Resolver, RosArgs, Session};
use dq_view::{Race, RaceWatch};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The interval between the pictures of a race.
const FRAME: Duration = Duration::from_millis(40);

/// The longest time that the two servos and their arms may take until they have discovered each other.
const DISCOVERY: Duration = Duration::from_secs(10);

/// The longest duration of a race.
const LONGEST: Duration = Duration::from_secs(60);

/// The nodes of a race.
pub(super) struct RaceNodes {
    watch: RaceWatch,
    servos: Vec<ServoNode>,
    _plants: Vec<PlantNode>,
    _sessions: Vec<Session>,
    // The domain is kept until the end, so that nobody else takes it.
    _domain: OwnDomain,
}

impl RaceNodes {
    /// Starts the two servos, their simulated arms, and the node that watches the race, in a separate domain.
    pub fn start(environment: &Environment, race: &Race) -> crate::cli::Result<Self> {
        ensure!(
            environment.enclave.is_none(),
            "the arms of a comparison have no keys, and this program runs secured"
        );
        let (environment, domain) = environment.alone()?;
        let (mut servos, mut plants, mut sessions) = (Vec::new(), Vec::new(), Vec::new());
        for (namespace, law) in NAMESPACES.into_iter().zip(&race.laws) {
            let args = arguments(namespace, law, race)?;
            let (of_plant, of_servo) = (Session::open(&environment)?, Session::open(&environment)?);
            plants.push(PlantNode::start(&of_plant, Prepared::<PlantParameters>::new(&args)?)?);
            servos.push(ServoNode::start(&of_servo, Prepared::<ServoParameters>::new(&args)?)?);
            sessions.extend([of_plant, of_servo]);
        }
        let session = Session::open(&environment)?;
        let names = |namespace| Resolver::new("dq_servo_view", &in_namespace(namespace));
        let names = [names(NAMESPACES[0])?, names(NAMESPACES[1])?];
        let logging = Logging::new(&RosArgs::default(), LogLevel::Warn);
        let watch = RaceWatch::join(&session, names, logging, race)?;
        sessions.push(session);
        Ok(Self { watch, servos, _plants: plants, _sessions: sessions, _domain: domain })
    }

    /// Runs race number `number` to its end, and shows it on the page.
    pub async fn run(mut self, goal: PoseNumbers, number: u64, show: watch::Sender<Arc<str>>) {
        let mut frames = tokio::time::interval(FRAME);
        let mut since = Instant::now();
        let mut racing = false;
        loop {
            frames.tick().await;
            self.watch.take();
            let over =
                racing && self.watch.is_over() || since.elapsed() > if racing { LONGEST } else { DISCOVERY };
            show.send_replace(self.watch.frame(number, over).into());
            if over {
                break;
            }
            if !racing && self.watch.is_ready() {
                self.watch.begin(goal);
                (racing, since) = (true, Instant::now());
            }
        }
        for servo in self.servos {
            // Errors do not matter, because these simulated arms need not come to rest.
            let _ = servo.shut_down().await;
        }
    }
}

/// The namespaces of the two servos.
const NAMESPACES: [&str; 2] = ["/compare/one", "/compare/other"];

fn in_namespace(namespace: &str) -> RosArgs {
    let remaps = vec![Remap { node: None, from: "__ns".to_owned(), to: namespace.to_owned() }];
    RosArgs { remaps, log_level: Some(LogLevel::Warn), ..RosArgs::default() }
}

/// Returns the ROS arguments of a servo with the law `law`, and of its simulated arm. Apart from the law, the parameters are those of
/// the servo that the page shows.
fn arguments(namespace: &str, law: &str, race: &Race) -> Result<RosArgs, ParameterError> {
    let give = |node, name: &str, value| Override::Value { node: Some(node), name: name.to_owned(), value };
    let mut args = in_namespace(namespace);
    let nodes = [
        (ServoParameters::NODE_NAME, ServoParameters::declarations()?),
        (PlantParameters::NODE_NAME, PlantParameters::declarations()?),
    ];
    for (node, declared) in nodes {
        let known = race.parameters.iter().filter(|(name, _)| declared.iter().any(|one| one.name == *name));
        // Nobody publishes a simulated time in this domain.
        let known = known.filter(|(name, _)| name != "use_sim_time");
        args.overrides.extend(known.map(|(name, value)| give(node, name, value.clone())));
    }
    let start = Value::DoubleArray(race.start.clone());
    args.overrides.push(give(PlantParameters::NODE_NAME, "initial_positions", start));
    args.overrides.push(give(ServoParameters::NODE_NAME, "controller", Value::String(law.to_owned())));
    Ok(args)
}
