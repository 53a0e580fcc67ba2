//! `dq_servo permissions`: prints the topics and services that each enclave of a secured graph may use, according to the wire
//! contract. `launch_scripts/dq_servo_keystore.sh` signs these permissions.

use super::print::print_line;
use super::{OF_PLANTS, Usage, of_servos};
use dq_config::{DualParameters, GuardParameters, NodeParameters, PLANT_NAMES, ServoParameters};
use dq_core::servo::Interface;
use dq_messages::{Direction, NodeContract};
use dq_ros::ros::args::Remap;
use dq_ros::ros::{Resolver, RosArgs};
use dq_wire::{Contract, ServoKind, command_topic};
use std::collections::BTreeSet;

/// The services of every node with parameters.
const OF_EVERY_NODE: [&str; 7] = [
    "~/describe_parameters",
    "~/get_parameter_types",
    "~/get_parameters",
    "~/list_parameters",
    "~/set_parameters",
    "~/set_parameters_atomically",
    "~/get_type_description",
];

/// The pattern of the names of the nodes that `ros2` creates.
const ROS2_COMMAND_LINE: &str = "_ros2cli_*";

#[derive(clap::Args)]
pub(super) struct Permissions {
    /// The enclave whose permissions to print; by default print the names of all enclaves
    enclave: Option<String>,
}

impl Permissions {
    /// Prints the permissions of an enclave in the namespace of `ros_args`, or the names of all enclaves there.
    pub fn run(&self, ros_args: &RosArgs) -> super::Result<()> {
        let graph = Graph::new(ros_args)?;
        let enclaves = graph.enclaves()?;
        let Some(name) = &self.enclave else {
            let names: Vec<_> = enclaves.iter().map(|enclave| enclave.name.as_str()).collect();
            return Ok(print_line!("{}", names.join("\n"))?);
        };
        let enclave = enclaves.iter().find(|enclave| enclave.name == *name);
        let enclave =
            enclave.ok_or_else(|| Usage(format!("no enclave {name:?} is made in this namespace")))?;
        Ok(print_line!("{}", enclave.xml())?)
    }
}

/// An enclave, with the DDS topics that it may write and read.
struct Enclave {
    name: String,
    writes: BTreeSet<String>,
    reads: BTreeSet<String>,
}

impl Enclave {
    /// Creates an enclave with the permissions that every node needs: discovery, logging, and announcing parameters.
    fn new(name: String) -> Self {
        let mut enclave = Self { name, writes: BTreeSet::new(), reads: BTreeSet::new() };
        enclave.writes.extend(["ros_discovery_info", "rt/rosout", "rt/parameter_events"].map(str::to_owned));
        enclave.reads.extend(["ros_discovery_info", "rt/parameter_events", "rt/clock"].map(str::to_owned));
        enclave
    }

    fn publishes(&mut self, topic: &str) {
        self.writes.insert(format!("rt{topic}"));
    }

    fn subscribes(&mut self, topic: &str) {
        self.reads.insert(format!("rt{topic}"));
    }

    fn serves(&mut self, service: &str) {
        self.reads.insert(format!("rq{service}Request"));
        self.writes.insert(format!("rr{service}Reply"));
    }

    fn calls(&mut self, service: &str) {
        self.writes.insert(format!("rq{service}Request"));
        self.reads.insert(format!("rr{service}Reply"));
    }

    /// Adds the permissions with which `node` can run: its topics, its services and its parameters.
    fn is(&mut self, node: &OurNode) -> super::Result<()> {
        for (name, topic) in node.contract.topics() {
            let name = node.names.topic(name)?;
            match topic.direction {
                Direction::In => self.subscribes(&name),
                Direction::Out => self.publishes(&name),
            }
        }
        for name in &node.both_ways {
            let name = node.names.topic(name)?;
            self.publishes(&name);
            self.subscribes(&name);
        }
        for service in OF_EVERY_NODE.iter().chain(&node.services) {
            self.serves(&node.names.service(service)?);
        }
        Ok(())
    }

    /// Adds the permissions to subscribe to every topic of this node and to request its message types, as `ros2 bag record` does.
    fn watches(&mut self, node: &OurNode) -> super::Result<()> {
        for (name, _) in node.contract.topics() {
            self.subscribes(&node.names.topic(name)?);
        }
        self.calls(&node.names.service("~/get_type_description")?);
        Ok(())
    }

    /// Adds the permissions to call the services of the node, other than those for parameters, and to read the node's status.
    fn commands(&mut self, node: &OurNode) -> super::Result<()> {
        for service in &node.services {
            self.calls(&node.names.service(service)?);
        }
        if let Some(status) = node.status {
            self.subscribes(&node.names.topic(status)?);
        }
        Ok(())
    }

    /// Adds the permissions to get and set the parameters of the node. Also adds the permission to subscribe to `~/parameters`,
    /// on which the node publishes the values that are too long for a service reply.
    fn sets_parameters(&mut self, node: &OurNode) -> super::Result<()> {
        for service in OF_EVERY_NODE {
            self.calls(&node.names.service(service)?);
        }
        self.subscribes(&node.names.topic("~/parameters")?);
        Ok(())
    }

    /// Adds the permission to publish the goals and twists of the node.
    fn sends_goals(&mut self, node: &OurNode) -> super::Result<()> {
        for name in &node.goals {
            self.publishes(&node.names.topic(name)?);
        }
        Ok(())
    }

    /// Returns the permissions document of DDS Security. The document remains valid longer than the certificate, so that only the
    /// certificate can expire.
    fn xml(&self) -> String {
        let topics = |names: &BTreeSet<String>| {
            names.iter().map(|name| format!("            <topic>{name}</topic>\n")).collect::<String>()
        };
        let (name, writes, reads) = (&self.name, topics(&self.writes), topics(&self.reads));
        format!(
            r#"<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="{name}">
      <subject_name>CN={name}</subject_name>
      <validity>
        <not_before>2020-01-01T00:00:00</not_before>
        <not_after>2099-01-01T00:00:00</not_after>
      </validity>
      <allow_rule>
        <domains><id_range><min>0</min><max>232</max></id_range></domains>
        <publish>
          <topics>
{writes}          </topics>
        </publish>
        <subscribe>
          <topics>
{reads}          </topics>
        </subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>"#
        )
    }
}

/// A node of this program, with its names in the graph.
struct OurNode {
    names: Resolver,
    contract: NodeContract,
    services: Vec<&'static str>,
    /// The topics that the node both publishes and subscribes to.
    both_ways: Vec<&'static str>,
    /// The topics of the node's goals and twists.
    goals: Vec<&'static str>,
    /// The topic of the node's status.
    status: Option<&'static str>,
}

impl OurNode {
    fn name(&self) -> String {
        self.names.node().fully_qualified()
    }
}

/// The nodes of this program in a namespace.
struct Graph {
    args: RosArgs,
    contract: Contract,
    servos: Vec<OurNode>,
    /// The simulated arms and guards: those of a single arm, and those of two arms in the namespaces `left` and `right`.
    of_arms: Vec<OurNode>,
}

impl Graph {
    /// Creates the nodes with the namespace and remaps of `args`.
    fn new(args: &RosArgs) -> super::Result<Self> {
        let mut graph = Self {
            args: args.clone(),
            contract: Contract::builtin()?,
            servos: Vec::new(),
            of_arms: Vec::new(),
        };
        graph.servos = vec![
            graph.servo(ServoKind::OneArm, ServoParameters::NODE_NAME)?,
            graph.servo(ServoKind::TwoArms, DualParameters::NODE_NAME)?,
        ];
        let namespace = graph.servos[0].names.node().namespace().trim_end_matches('/').to_owned();
        for place in ["", "/left", "/right"].map(|place| format!("{namespace}{place}")) {
            for name in PLANT_NAMES {
                graph.of_arms.push(graph.plant(&place, name)?);
            }
            graph.of_arms.push(graph.guard(&place)?);
        }
        Ok(graph)
    }

    fn servo(&self, kind: ServoKind, name: &str) -> super::Result<OurNode> {
        let contract = kind.contract(self.contract.clone()).with(self.contract.pictures.clone());
        Ok(OurNode {
            names: Resolver::new(name, &self.args)?,
            contract,
            services: of_servos(kind).iter().map(|(service, _)| *service).collect(),
            // The servo publishes a goal that is dragged in RViz.
            both_ways: vec![kind.goal_topic()],
            goals: vec![kind.goal_topic(), "~/joint_goal", "~/target_twist"],
            status: Some("~/status"),
        })
    }

    fn plant(&self, place: &str, name: &str) -> super::Result<OurNode> {
        Ok(OurNode {
            names: self.names(place, name)?,
            contract: self.contract.plant.clone(),
            services: OF_PLANTS.map(|(service, _)| service).to_vec(),
            both_ways: vec![],
            goals: vec![],
            status: None,
        })
    }

    fn guard(&self, place: &str) -> super::Result<OurNode> {
        let interfaces = [Interface::Velocity, Interface::Position, Interface::Trajectory];
        Ok(OurNode {
            names: self.names(place, GuardParameters::NODE_NAME)?,
            contract: self.contract.guard.clone(),
            services: vec![],
            // The guard subscribes to the servo's commands, and publishes commands when these cease.
            both_ways: interfaces.map(command_topic).to_vec(),
            goals: vec![],
            status: None,
        })
    }

    /// Returns the resolver of a node called `name` in the namespace `place`.
    fn names(&self, place: &str, name: &str) -> super::Result<Resolver> {
        let mut args = self.args.clone();
        let namespace = if place.is_empty() { "/" } else { place };
        args.remaps.insert(0, Remap { node: None, from: "__ns".to_owned(), to: namespace.to_owned() });
        Ok(Resolver::new(name, &args)?)
    }

    fn nodes(&self) -> impl Iterator<Item = &OurNode> {
        self.servos.iter().chain(&self.of_arms)
    }

    /// Returns one enclave for each node, and one for each kind of command.
    fn enclaves(&self) -> super::Result<Vec<Enclave>> {
        let mut enclaves = Vec::new();
        for node in self.nodes() {
            let mut enclave = Enclave::new(node.name());
            enclave.is(node)?;
            enclaves.push(enclave);
        }
        for (name, may) in COMMANDS {
            let mut enclave = self.operator(name)?;
            may(self, &mut enclave)?;
            enclaves.push(enclave);
        }
        Ok(enclaves)
    }

    /// Returns the enclave of the command `name`. The command line of ROS 2 can use this enclave too.
    fn operator(&self, name: &str) -> super::Result<Enclave> {
        let names = Resolver::new(name, &self.args)?;
        let mut enclave = Enclave::new(names.node().fully_qualified());
        for service in OF_EVERY_NODE {
            enclave.serves(&names.service(service)?);
            enclave.serves(&service.replace('~', &format!("/{ROS2_COMMAND_LINE}")));
        }
        Ok(enclave)
    }

    fn watches_all(&self, enclave: &mut Enclave) -> super::Result<()> {
        enclave.subscribes("/rosout");
        self.nodes().try_for_each(|node| enclave.watches(node))
    }

    fn commands_all(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.nodes().try_for_each(|node| enclave.commands(node))
    }

    fn sets_all_parameters(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.nodes().try_for_each(|node| enclave.sets_parameters(node))
    }

    fn sends_all_goals(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.servos.iter().try_for_each(|node| enclave.sends_goals(node))
    }

    /// Adds the permissions of commands that call services, such as `dq_servo stop` and `dq_servo reset`. `dq_servo reset` also reads
    /// the parameters of a node, to check that the node is a simulated arm.
    fn calls(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.commands_all(enclave)?;
        self.of_arms.iter().try_for_each(|node| enclave.sets_parameters(node))
    }

    fn goal(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.sends_all_goals(enclave)?;
        self.watches_all(enclave)?;
        for node in &self.servos {
            enclave.calls(&node.names.service("~/stop")?);
        }
        Ok(())
    }

    fn view(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.goal(enclave)?;
        self.commands_all(enclave)?;
        self.sets_all_parameters(enclave)
    }

    /// Adds the permissions of the demo: servo, simulated arms, operator and view in one process.
    fn demo(&self, enclave: &mut Enclave) -> super::Result<()> {
        self.view(enclave)?;
        self.nodes().try_for_each(|node| enclave.is(node))
    }
}

/// A function that adds the permissions of a command.
type May = fn(&Graph, &mut Enclave) -> super::Result<()>;

/// The names of the nodes that commands create, each with the function that adds the permissions of its command.
const COMMANDS: [(&str, May); 6] = [
    ("dq_servo_goal", Graph::goal),
    ("dq_servo_call", Graph::calls),
    ("dq_servo_param", Graph::sets_all_parameters),
    ("dq_servo_recorder", Graph::watches_all),
    ("dq_servo_view", Graph::view),
    ("dq_servo_demo", Graph::demo),
];
