//! What an arm of more joints than its tool needs does with the rest of its motion.

use super::Task;

/// Where the joints go, as far as the tool leaves them free; by default nowhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// Joint positions \[rad, prismatic: m\], one a joint; empty: nowhere.
    pub positions: Vec<f64>,
    /// How fast they go there [1/s]; 0: not at all.
    pub gain: f64,
}

impl Posture {
    /// Whether there is a posture to go to.
    pub(super) fn is_on(&self) -> bool {
        self.gain > 0.0 && !self.positions.is_empty()
    }

    /// Adds to the joint velocities `target` [rad/s, prismatic: m/s] what takes the joints from `positions` to these, in the null space of
    /// the inverse that `controller` has for `task` there; `free` is room for as many numbers. It takes no more than the speed that the
    /// tool's own motion leaves each joint within its `limits` [rad/s, prismatic: m/s], so that the tool is not slowed either.
    pub(super) fn add<T: Task>(
        &self,
        (task, controller): (&T, &T::Controller),
        (positions, limits): (&[f64], &[f64]),
        free: &mut [f64],
        target: &mut [f64],
    ) {
        for ((free, wanted), position) in free.iter_mut().zip(&self.positions).zip(positions) {
            *free = self.gain * (wanted - position);
        }
        task.leave_tool(controller, free);
        let shares = free.iter().zip(target.iter()).zip(limits).map(|((free, speed), limit)| {
            let room = (limit - speed * free.signum()).max(0.0);
            if free.abs() > room { room / free.abs() } else { 1.0 }
        });
        let share = shares.fold(1.0, f64::min);
        target.iter_mut().zip(free.iter()).for_each(|(speed, free)| *speed += share * free);
    }
}
