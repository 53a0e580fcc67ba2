//! Where the links of a robot description are, and which joint of the arm carries each.

use super::urdf_reader::Description;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmError, Chain};
use std::collections::HashMap;

/// Where a link is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The joint of the arm that carries it, counted from 1; 0 for what stands with the base.
    pub carrier: usize,
    /// In the frame that moves with this joint, z along its axis; of what stands with the base in the base frame.
    pub carrier_from_link: UnitDualQuaternion,
    /// Whether it is a link between the arm's base and its tool.
    pub is_of_arm: bool,
    /// Whether it is that, or hangs from such a link by fixed joints alone.
    pub is_rigid: bool,
}

impl Description {
    /// Where each link is that hangs together with the arm, whose kinematics are `chain`; joints beside the arm's are where they start.
    ///
    /// # Errors
    /// [`ArmError`] for a chain of another arm.
    pub fn places(&self, chain: &Chain) -> Result<HashMap<&str, Place>, ArmError> {
        let carriers = chain.link_poses(&vec![0.0; self.arm.moving().count()])?;
        let mut places = self.places_in_base();
        for place in places.values_mut() {
            if let Some(number) = place.carrier.checked_sub(1) {
                place.carrier_from_link = carriers[number].inverse() * place.carrier_from_link;
            }
        }
        Ok(places)
    }

    /// The same, but where the links are in the base frame while the arm's joints are at zero.
    fn places_in_base(&self) -> HashMap<&str, Place> {
        let mut carrier = 0;
        let mut place = Place {
            carrier,
            carrier_from_link: UnitDualQuaternion::identity(),
            is_of_arm: true,
            is_rigid: true,
        };
        let base = self.arm.joints.first().map(|joint| (joint.parent.as_str(), place));
        let mut places = HashMap::from_iter(base);
        for joint in &self.arm.joints {
            carrier += usize::from(joint.motion.kind().is_some());
            let carrier_from_link = place.carrier_from_link * joint.parent_from_child(0.0);
            place = Place { carrier, carrier_from_link, ..place };
            places.insert(&joint.child, place);
        }
        let mut joints: Vec<_> = self.beside.iter().collect();
        // Each round reaches the links next to those that are reached, away from the base and towards the root.
        loop {
            let count = joints.len();
            joints.retain(|joint| {
                let parent_from_child = joint.parent_from_child(joint.limits.start());
                let (parent, child) = (joint.parent.as_str(), joint.child.as_str());
                match (places.get(parent).copied(), places.get(child).copied()) {
                    (Some(place), None) => {
                        let carrier_from_link = place.carrier_from_link * parent_from_child;
                        let is_rigid = place.is_rigid && joint.motion.kind().is_none();
                        places
                            .insert(child, Place { carrier_from_link, is_of_arm: false, is_rigid, ..place });
                    }
                    (None, Some(place)) => {
                        let carrier_from_link = place.carrier_from_link * parent_from_child.inverse();
                        places.insert(
                            parent,
                            Place { carrier_from_link, is_of_arm: false, is_rigid: false, ..place },
                        );
                    }
                    (Some(_), Some(_)) => {}
                    (None, None) => return true,
                }
                false
            });
            if joints.len() == count {
                return places;
            }
        }
    }
}
