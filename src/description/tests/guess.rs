//! Tests of guessing which part of a description is the arm.

use super::text;
use dq_description::{Description, Guess, guess_frames};
use std::collections::BTreeSet;
use std::fmt::Write;

/// Returns a description of these chains. Each chain is a list of links, with the kind of joint between two links: `F` is a fixed
/// joint, `R` a revolute joint with symmetric limits, and `P` a prismatic joint. `J` is a revolute joint that turns mainly to one
/// side, like a finger. `M:a` mimics the joint that carries the link `a`.
fn robot(chains: &[&str]) -> String {
    let (mut links, mut joints) = (BTreeSet::<&str>::new(), String::new());
    for chain in chains {
        let words: Vec<_> = chain.split(' ').collect();
        links.extend(words.iter().step_by(2));
        for window in words.windows(3).step_by(2) {
            let &[parent, kind, child] = window else { unreachable!() };
            let (kind, leader) = kind.split_once(':').unwrap_or((kind, ""));
            let (name, more) = match kind {
                "F" => ("fixed", String::new()),
                "R" => ("revolute", "<limit lower='-2' upper='2' velocity='1'/>".to_owned()),
                "P" => ("prismatic", "<limit lower='0' upper='0.8' velocity='1'/>".to_owned()),
                "J" => ("revolute", "<limit lower='-0.2' upper='2' velocity='1'/>".to_owned()),
                "M" => ("revolute", format!("<limit lower='-2' upper='2'/><mimic joint='to_{leader}'/>")),
                other => unreachable!("{other}"),
            };
            let ends = format!("<parent link='{parent}'/><child link='{child}'/>");
            let _ = write!(joints, "<joint name='to_{child}' type='{name}'>{ends}{more}</joint>");
        }
    }
    let links: String = links.iter().map(|link| format!("<link name='{link}'/>")).collect();
    format!("<robot name='r'>{links}{joints}</robot>")
}

/// The arm is the longest chain, without wheels, head, gripper and fingers. Its frames are `base_link` and `tool0`, if links with
/// these names exist.
#[test]
fn the_frames_of_real_robots_are_found() {
    for (robot, base, tool, joints) in [
        ("panda", "panda_link0", "panda_hand", 7),
        ("scara", "link0", "tool", 4),
        ("tiago", "base_link", "wrist_ft_tool_link", 8),
        ("ur5", "base_link", "tool0", 6),
        ("xarm7", "world", "link_eef", 7),
    ] {
        let text = text(robot);
        let guess = guess_frames(&text, [None, None]).unwrap();
        assert_eq!([&guess.base, &guess.tool], [base, tool], "{robot}");
        let arm = Description::read(&text, base, tool).unwrap().arm;
        assert_eq!(arm.moving().count(), joints, "{robot}");
        let given = Guess { base: "here".to_owned(), tool: "there".to_owned(), alternatives: Vec::new() };
        assert_eq!(guess_frames(&text, [Some("here"), Some("there")]).unwrap(), given);
    }
}

#[test]
fn the_tool_frame_is_where_a_tool_is_mounted() {
    const ARM: &str = "world F base_link R a R b R c R d R e R f";
    let cases: [(&[&str], &str); 17] = [
        (&[ARM], "f"),
        // A camera, a tool center point or a gripper after `tool0` changes nothing, nor does a sibling.
        (&[ARM, "f F flange F tool0 F camera"], "tool0"),
        (&[ARM, "f F tool0 F hand R left", "hand R right"], "tool0"),
        (&[ARM, "f F hand R left", "f F tool0"], "tool0"),
        (&[ARM, "f F left_flange F left_tool0 F left_camera"], "left_tool0"),
        (&[ARM, "f F flange F adapter F sensor"], "flange"),
        (&[ARM, "f F arm_flange F adapter F hand_flange"], "arm_flange"),
        (&[ARM, "f F adapter F grasp_tcp"], "adapter"),
        // Most of the arm comes after this flange, so the flange is not the tool frame.
        (&["base_link R flange R b R c R d R e R f"], "f"),
        // A jaw: alone, beside a frame, or after a mount.
        (&[ARM, "f J jaw"], "f"),
        (&[ARM, "f F grasp", "f J jaw"], "grasp"),
        (&[ARM, "f F mount J jaw"], "mount"),
        // With few joints, a one-sided joint is the vertical axis of a gantry or a SCARA.
        (&["base_link P a P b P c"], "c"),
        // A hand whose two fingers have one joint each, one of which mimics the other; and a hand with longer, equal fingers.
        (&[ARM, "f F hand P left", "hand M:left right"], "hand"),
        (&[ARM, "f F hand R i1 R i2 R i3", "hand R m1 R m2 R m3", "hand R t1"], "hand"),
        // The rods of a linkage are not a gripper.
        (&["base_link R a R b R c M:c wrist R end", "c M:b rod", "wrist M:c brace"], "end"),
        (&["base_link R a R b R c M:c level"], "level"),
    ];
    for (chains, tool) in cases {
        let guess = guess_frames(&robot(chains), [None, None]).unwrap();
        assert_eq!((guess.base.as_str(), guess.tool.as_str()), ("base_link", tool), "{chains:?}");
    }
    let alternatives = |chains: &[&str]| guess_frames(&robot(chains), [None, None]).unwrap().alternatives;
    assert_eq!(alternatives(&[ARM, "f F tool0 F camera"]), ["f", "camera"]);
    assert_eq!(alternatives(&[ARM, "f F mount J jaw F tip"]), ["f", "jaw"]);
}

#[test]
fn equal_arms_are_not_chosen_by_their_order() {
    let [left, right] = ["torso R la R lb R lc R ld", "torso R ra R rb R rc R rd"];
    let hand = ["ld F hand R index", "hand R thumb"];
    for (chains, named) in [
        (vec![left, right], "\"ld\" or \"rd\""),
        (vec![left, right, "ld F left_tool0", "rd F right_tool0"], "\"left_tool0\" or \"right_tool0\""),
        // A longer arm is not preferred to an arm with its own tool frame.
        (vec![left, right, "ld F left_tool0", "rd R re F right_tool0"], "\"left_tool0\" or \"right_tool0\""),
        // Two arms with grippers: the message proposes their hands, not their fingers.
        (vec![left, right, hand[0], hand[1], "rd F grip J jaw"], "\"hand\" or \"grip\""),
    ] {
        let why = guess_frames(&robot(&chains), [None, None]).unwrap_err().to_string();
        assert!(why.contains("several arms") && why.ends_with(named), "{why}");
        let base = guess_frames(&robot(&chains), [None, Some("rd")]).unwrap().base;
        assert_eq!(base, "torso");
        assert_eq!(guess_frames(&robot(&chains), [Some("ra"), None]).unwrap().base, "ra");
    }
    // A single `tool0` decides.
    assert_eq!(guess_frames(&robot(&[left, right, "rd F tool0"]), [None, None]).unwrap().tool, "tool0");
}
