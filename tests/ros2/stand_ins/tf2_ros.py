"""Stands in for ROS's tf2_ros, which PyPI does not have. `teleop` publishes the goal's frame with it, for RViz only."""


class TransformBroadcaster:
    def __init__(self, node):
        pass

    def sendTransform(self, transform):
        pass
