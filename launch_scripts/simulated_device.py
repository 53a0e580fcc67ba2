"""A simulated device: someone presses its button and moves it along y for two seconds, then lets go for two seconds.

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
    was_pressed, pressed = twist.twist.linear.y != 0, next(ticks) // (2 * RATE) % 2 == 0
    twist.twist.linear.y = pressed * SPEED
    pose.pose.position.y += pressed * SPEED / RATE
    twist.header.stamp = pose.header.stamp = node.get_clock().now().to_msg()
    buttons.publish(Joy(buttons=[int(pressed)]))
    poses.publish(pose)
    if pressed or was_pressed:
        twists.publish(twist)


node.create_timer(1 / RATE, tick)
rclpy.spin(node)
