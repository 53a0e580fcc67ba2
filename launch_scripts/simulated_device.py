"""A simulated device: for two seconds someone presses its button and moves it along y, there and back; then lets go for two seconds.

It publishes as a joystick does (`cmd_vel`, ended by a twist of zero) and as a VR controller does (`hand_pose` always; `joy`: the button).
"""

import rclpy
from geometry_msgs.msg import PoseStamped, TwistStamped
from sensor_msgs.msg import Joy

RATE, SPEED = 50, 0.05
rclpy.init()
node = rclpy.create_node("simulated_device")
types = {"cmd_vel": TwistStamped, "hand_pose": PoseStamped, "joy": Joy}
twists, poses, buttons = [node.create_publisher(kind, topic, 1) for topic, kind in types.items()]
twist, pose = TwistStamped(), PoseStamped()


def tick(ticks=iter(range(10**9))):
    second, before = next(ticks) / RATE % 4.0, twist.twist.linear.y
    speed = twist.twist.linear.y = SPEED * (1.0 if second < 1.0 else -1.0 if second < 2.0 else 0.0)
    pose.pose.position.y += speed / RATE
    twist.header.stamp = pose.header.stamp = node.get_clock().now().to_msg()
    buttons.publish(Joy(buttons=[int(speed != 0)]))
    poses.publish(pose)
    if speed != 0 or before != 0:
        twists.publish(twist)


node.create_timer(1 / RATE, tick)
rclpy.spin(node)
