"""Reads and writes bags with rosbags from PyPI: `read BAG`, `write BAG mcap|zstd|sqlite3|message[_mcap]|file[_mcap]` and `copy BAG COPY
mcap|sqlite3`.

All print a JSON list with one object for each message: topic, type, time [ns], cdr [hex].
"""

import json
import sys
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore, get_types_from_msg

STORES = [get_typestore(store) for store in (Stores.ROS2_JAZZY, Stores.ROS2_HUMBLE)]
JAZZY = STORES[0]


def entry(connection, time, cdr):
    return {"topic": connection.topic, "type": connection.msgtype, "time": time, "cdr": bytes(cdr).hex()}


def unpadded(cdr):
    """Pads a payload to four bytes, as ROS 2 does."""
    return bytes(cdr).rstrip(b"\0")


def check_definitions(reader):
    """Registers the types that Jazzy does not have. The other definitions in the bag equal those of Jazzy field by field, and so do the
    hashes."""
    for connection in reader.connections:
        assert connection.msgdef.data, connection
        types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
        assert connection.msgtype in types
        for store in STORES:
            store.register({name: fields for name, fields in types.items() if name not in store.fielddefs})
        for name, (_, fields) in types.items():
            assert fields == JAZZY.fielddefs[name][1], (name, fields, JAZZY.fielddefs[name][1])
        assert connection.digest == JAZZY.hash_rihs01(connection.msgtype), connection


def read(path):
    with Reader(path) as reader:
        messages = [entry(*message) for message in reader.messages()]
        check_definitions(reader)
        assert reader.message_count == len(messages), (reader.message_count, len(messages))
        for connection in reader.connections:
            assert connection.msgcount == sum(m["topic"] == connection.topic for m in messages), connection
        for connection, _, cdr in reader.messages():
            for store in STORES:
                value = store.deserialize_cdr(cdr, connection.msgtype)
                assert unpadded(store.serialize_cdr(value, connection.msgtype)) == unpadded(cdr), connection
    # With the bag's own definitions.
    with AnyReader([Path(path)]) as reader:
        assert len([reader.deserialize(cdr, c.msgtype) for c, _, cdr in reader.messages()]) == len(messages)
    return messages


def write(path, kind):
    storage = StoragePlugin.MCAP if kind.endswith(("mcap", "zstd")) else StoragePlugin.SQLITE3
    writer = Writer(path, version=9, storage_plugin=storage)
    compression = {"zstd": CompressionMode.STORAGE, "message": CompressionMode.MESSAGE, "file": CompressionMode.FILE}
    mode = kind.removesuffix("_mcap")
    if mode in compression:
        writer.set_compression(compression[mode], CompressionFormat.ZSTD)
    String, Float64 = JAZZY.types["std_msgs/msg/String"], JAZZY.types["std_msgs/msg/Float64"]
    messages = []
    with writer:
        text = writer.add_connection("/text", String.__msgtype__, typestore=JAZZY)
        number = writer.add_connection("/number", Float64.__msgtype__, typestore=JAZZY)
        for i in range(2000):
            connection, value = (number, Float64(i / 7)) if i % 3 else (text, String("x" * i))
            cdr = JAZZY.serialize_cdr(value, connection.msgtype)
            writer.write(connection, 1_700_000_000_000_000_000 + 1000 * i, cdr)
            messages.append(entry(connection, 1_700_000_000_000_000_000 + 1000 * i, cdr))
    return messages


def copy(source, path, kind):
    """The messages of a bag, mixed with those of a topic that the bag does not have."""
    storage = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    messages = []
    with Reader(source) as reader, Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {c.id: writer.add_connection(c.topic, c.msgtype, typestore=JAZZY) for c in reader.connections}
        text = writer.add_connection("/text", "std_msgs/msg/String", typestore=JAZZY)
        String = JAZZY.types["std_msgs/msg/String"]
        for i, (connection, time, cdr) in enumerate(reader.messages()):
            if i < 100:
                other = JAZZY.serialize_cdr(String("of another topic"), text.msgtype)
                writer.write(text, time, other)
                messages.append(entry(text, time, other))
            writer.write(connections[connection.id], time, cdr)
            messages.append(entry(connection, time, cdr))
    return messages


if __name__ == "__main__":
    command = {"read": read, "write": write, "copy": copy}[sys.argv[1]]
    json.dump(command(*sys.argv[2:]), sys.stdout)
