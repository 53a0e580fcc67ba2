// What laws, tasks and parameters are, in a line each for the user of the page.

export const LAWS = {
  diffc: "Pulls each joint by the difference of the poses: the reference work's diffc.",
  diffc_inverse: "Reduces the difference of the poses evenly, by the damped inverse.",
  logc: "Turns and moves on one screw to the goal: the reference work's logc.",
  logc_transpose: "The screw to the goal, pulling each joint instead of inverting.",
  double_geodesic: "A straight line and the shortest turn, each with its own gain.",
  double_geodesic_transpose: "A straight line and the shortest turn, pulling each joint.",
  unit_quaternion: "A straight line and the quaternion's vector part: the most common law.",
  unit_quaternion_transpose: "The most common law, pulling each joint instead of inverting.",
  lq: "diffc_inverse with gains from a cost of error against speed.",
  h_infinity: "unit_quaternion with gains from bounds on disturbances.",
  predefined_time: "logc with a bound on the time to arrive.",
  logc_pd: "logc of second order: a spring and a damper.",
};

export const TASKS = {
  pose: "Position and orientation.",
  position: "The position; the tool may turn freely.",
  position_and_axis: "The position and the direction of the tool's z axis.",
  orientation: "The orientation; the tool may be anywhere.",
  distance: "The distance from the base alone.",
  relative_pose: "Position and orientation of the right tool, seen from the left.",
  relative_position: "The position of the right tool, seen from the left.",
  relative_position_and_axis: "The position and the z axis of the right tool, seen from the left.",
  relative_orientation: "The orientation of the right tool, seen from the left.",
  relative_distance: "The distance between the tools alone.",
};

// The groups of the parameters that have a slider, by the beginning of their names. The last group takes the rest.
export const GROUPS = [
  ["Speed and position limits", /^limits\./],
  ["Arrival", /^(goal_tolerance\.|progress_timeout)/],
  ["Silence", /_timeout$/],
  ["Singularities", /^damping\./],
  ["Delay and payload", /^(latency|integral|following_error)$/],
  ["Other", /./],
];
