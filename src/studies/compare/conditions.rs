//! The imperfections between law and arm: age and noise of the joint states.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::collections::VecDeque;
use std::time::Duration;

/// The control period of every loop: 200 Hz.
pub const PERIOD: Duration = Duration::from_millis(5);

/// The imperfections of the joint states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plant {
    /// The name of the plant, which is a part of file names.
    pub name: &'static str,
    /// The age of joint states, in cycles.
    pub latency: usize,
    /// The largest difference between the measured and the real position of a joint, in either direction \[rad\].
    pub noise: f64,
}

impl Plant {
    /// Returns whether joint states are exact and immediate.
    pub(super) fn is_exact(&self) -> bool {
        self.latency == 0 && self.noise == 0.0
    }
}

/// The angle of one count of a 13-bit encoder \[rad\].
const COUNT: f64 = std::f64::consts::TAU / 8192.0;

/// The name of the plant whose joint states are exact, and reach the law in the cycle in which they are measured. They are called
/// fresh.
pub(super) const FRESH: &str = "ideal";

/// The plants that are compared.
pub const PLANTS: [Plant; 6] = [
    Plant { name: FRESH, latency: 0, noise: 0.0 },
    Plant { name: "latency_5ms", latency: 1, noise: 0.0 },
    Plant { name: "latency_20ms", latency: 4, noise: 0.0 },
    Plant { name: "latency_50ms", latency: 10, noise: 0.0 },
    Plant { name: "latency_100ms", latency: 20, noise: 0.0 },
    Plant { name: "encoder_noise", latency: 0, noise: COUNT },
];

/// Delays joint states and adds noise to the positions.
pub(super) struct Sensor {
    plant: Plant,
    random: ChaCha8Rng,
    on_the_way: VecDeque<Vec<f64>>,
    seen: Vec<f64>,
}

impl Sensor {
    /// Creates the sensor of an arm that has stood at the joint positions `start` \[rad\] until now. Each `task` has its own noise.
    pub fn new(plant: Plant, start: &[f64], task: u32) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(NOISE_SEED);
        random.set_stream(u64::from(task));
        Self {
            plant,
            random,
            on_the_way: std::iter::repeat_n(start.to_vec(), plant.latency).collect(),
            seen: start.to_vec(),
        }
    }

    /// Returns the joint positions that the sensor measures \[rad\]: delayed, and with noise. `theta` are the real positions of this
    /// cycle. Call this function once per cycle.
    pub fn see(&mut self, theta: &[f64]) -> &[f64] {
        match self.on_the_way.pop_front() {
            Some(mut oldest) => {
                self.seen.copy_from_slice(&oldest);
                oldest.copy_from_slice(theta);
                self.on_the_way.push_back(oldest);
            }
            None => self.seen.copy_from_slice(theta),
        }
        if self.plant.noise > 0.0 {
            for angle in &mut self.seen {
                *angle += super::arm::between(-self.plant.noise, self.plant.noise, &mut self.random);
            }
        }
        &self.seen
    }
}

/// The seed of the noise. It differs from the seeds of the tasks.
const NOISE_SEED: u64 = 0x006e_6f69_7365;
