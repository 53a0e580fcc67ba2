//! The poses of a robot description's links, and the joint of the arm that carries each link.

use super::urdf_reader::Description;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{ArmError, Chain};
use std::collections::HashMap;

/// The joint that carries a link, and the pose of the link relative to that joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The moving joint between base and tool that carries the link, counted from 1; 0 if the link is fixed to the base.
    pub carrier: usize,
    /// The pose of the link in the frame of the [carrier](Self::carrier) joint. That frame moves with the joint, and its z axis is
    /// the joint's axis. If the link is fixed to the base, this is the pose of the link in the base frame.
    pub carrier_from_link: UnitDualQuaternion,
    /// Whether the link is between the arm's base and its tool.
    pub is_of_arm: bool,
    /// Whether the link is between the arm's base and its tool, or is attached to such a link by fixed joints only.
    pub is_rigid: bool,
}

impl Description {
    /// Returns, by link name, the places of all links that joints connect to the arm. `chain` is the arm's kinematics. Joints that
    /// are not part of the arm are at their start positions.
    ///
    /// # Errors
    /// [`ArmError`] if the chain belongs to another arm.
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

    /// Returns the places of all links with the arm's joints at zero. In this result, `carrier_from_link` is the pose of the link in
    /// the base frame.
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
            let position = self.arm.coupling(joint).map_or(0.0, |coupling| coupling.at(0.0));
            let carrier_from_link = place.carrier_from_link * joint.parent_from_child(position);
            place = Place { carrier, carrier_from_link, ..place };
            places.insert(&joint.child, place);
        }
        let mut joints: Vec<_> = self.beside.iter().collect();
        // Each round adds the neighbors of the links found so far, both away from the base and toward the root.
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
