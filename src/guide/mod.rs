//! Pages for people who use the program: what it does, how it is used, what was measured.
// In the heads of their tables units stand in brackets, which rustdoc would take for links.
#![allow(rustdoc::broken_intra_doc_links)]

/// Where the pages' links to each other lead in rustdoc. The files have definitions of their own, which lead to files: of two
/// definitions the first one counts.
macro_rules! links {
    () => {
        "[safety]: safety
[speed]: speed
[laws]: laws
[ros2]: ros2
[view]: view
[bags]: bags
[goals_in_frames]: real_robot#goals-in-frames-of-tf
[jogging]: real_robot#jogging
[guard]: real_robot#the-guard
[which_controller]: real_robot#which-controller
[goals_that_move_with_a_frame]: moving_goals#goals-that-move-with-a-frame

"
    };
}

macro_rules! page {
    ($name:ident, $file:literal) => {
        #[doc = links!()]
        #[doc = include_str!($file)]
        pub mod $name {}
    };
}

page!(reference_work, "reference_work.md");
page!(laws, "laws.md");
page!(commands, "commands.md");
page!(bags, "bags.md");
page!(view, "view.md");
page!(ros2, "ros2.md");
page!(real_robot, "real_robot.md");
page!(moving_goals, "moving_goals.md");
page!(secured, "secured.md");
page!(safety, "safety.md");
page!(speed, "speed.md");
page!(upstream, "upstream.md");
page!(contributing, "contributing.md");

#[cfg(test)]
mod tests;
