"""A ROS 2 node on Eclipse Cyclone DDS that announces itself like a release of ROS 2: peer.py DOMAIN LENGTH, with the length of its GIDs.

Announces the node /peer, and prints the GUID of its publisher. Then prints whether it knows, within five seconds, that the publisher on
/topic is of the node /ours. Ends with its standard input.
"""
import sys
import time
from dataclasses import dataclass

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

domain, LENGTH = (int(argument) for argument in sys.argv[1:])


@dataclass
class Gid(IdlStruct, typename="rmw_dds_common.msg.dds_.Gid_"):
    data: array[uint8, LENGTH]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename="rmw_dds_common.msg.dds_.NodeEntitiesInfo_"):
    node_namespace: str
    node_name: str
    reader_gid_seq: sequence[Gid]
    writer_gid_seq: sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename="rmw_dds_common.msg.dds_.ParticipantEntitiesInfo_"):
    gid: Gid
    node_entities_info_seq: sequence[NodeEntitiesInfo]


@dataclass
class Float64MultiArray(IdlStruct, typename="std_msgs.msg.dds_.Float64MultiArray_"):
    data: sequence[uint8]


def gid(entity):
    return Gid(list(entity.guid.bytes) + [0] * (LENGTH - 16))


def samples(reader):
    """The samples that can be decoded."""
    try:
        return reader.take(100)
    except Exception:  # Announcements of the other length cannot.
        return []


participant = DomainParticipant(domain)
latched = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll, Policy.Durability.TransientLocal)
topic = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo)
announcements = DataReader(participant, topic, qos=latched)
publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
publisher = DataWriter(participant, Topic(participant, "rt/other", Float64MultiArray))

announcer = DataWriter(participant, topic, qos=latched)
node = NodeEntitiesInfo("/", "peer", [], [gid(publisher)])
for _ in range(2):
    announcer.write(ParticipantEntitiesInfo(gid(participant), [node]))
print(publisher.guid.hex, flush=True)
announced, published, end = set(), set(), time.monotonic() + 5
while time.monotonic() < end and not announced & published:
    nodes = (node for sample in samples(announcements) for node in getattr(sample, "node_entities_info_seq", []))
    for gids in (node.writer_gid_seq for node in nodes if (node.node_namespace, node.node_name) == ("/", "ours")):
        assert not any(any(gid.data[16:]) for gid in gids)
        announced |= {bytes(gid.data[:16]) for gid in gids}
    published |= {sample.key.bytes for sample in publications.take(100) if sample.topic_name == "rt/topic"}
    time.sleep(0.01)
print("known" if announced & published else "unknown", flush=True)
sys.stdin.read()
