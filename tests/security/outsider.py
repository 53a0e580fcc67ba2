"""A DDS participant of another vendor without a key tries everything for some seconds: outsider.py SECONDS.
Prints the results as JSON: samples read by topic, and answers of the service that it called."""
import json
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "dds"))
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from peer import EVERY, GOAL, PARTICIPANT, RELIABLE, reader, ros, take, writer

# Without the commands, because the outsider sends some itself.
READ = {
    "joint_states": ros.JointState,
    "dq_servo/status": ros.DiagnosticStatus,
    "dq_servo/current_pose": ros.PoseStamped,
}
REQUEST, RESPONSE = ros.SET_PARAMETERS[2:]
CHANGE = ros.Parameter("controller", ros.ParameterValue(type=4, string_value="diffc"))

readers = {topic: reader(topic, kind, EVERY) for topic, kind in READ.items()}
read = dict.fromkeys(READ, 0)
commands = writer("forward_velocity_controller/commands", ros.Float64MultiArray)
goals = writer("goal_pose", ros.PoseStamped)
requests = DataWriter(PARTICIPANT, Topic(PARTICIPANT, "rq/dq_servo/set_parametersRequest", REQUEST), qos=RELIABLE)
replies = DataReader(PARTICIPANT, Topic(PARTICIPANT, "rr/dq_servo/set_parametersReply", RESPONSE), qos=RELIABLE)
answers = 0

end = time.monotonic() + float(sys.argv[1])
while time.monotonic() < end:
    commands.write(ros.Float64MultiArray(data=[0.5] * 6))
    goals.write(GOAL)
    requests.write(REQUEST(client=1, sequence_number=1, parameters=[CHANGE]))
    time.sleep(0.05)
    for topic, source in readers.items():
        read[topic] += len(take(source))
    answers += len(take(replies))
print(json.dumps({"read": read, "answers": answers}))
